"""`StepLog`: a saved state and the steps since, from which any of them can be done again."""

from typing import Any

from tissue.core.attributes import attributes_of, set_attributes
from tissue.core.memento import Memento, Spares, attributes_in, derived_in
from tissue.loads.step_inputs import StepInputs
from tissue.state.tissue_state import RULES

STEPS_BETWEEN_STATES = 1000
"""Steps of the integrator after which a state is saved. To save one takes as long as six to ten of
them in the organ, so that a run takes 0.8 % longer; to do steps again, half as long as these in the
mean, a sixth of a second, which is rare."""

MOST_FRAMES = 1000
"""Time steps after which one is saved in any case: their inputs are kept."""


class StepState:
    """A tissue at one time, for the tissue itself to keep.

    Unlike a `TissueState` it does not refer to the tissue: that would keep the arrays of both in
    memory until Python looks for cycles.

    Args:
        tissue: The tissue.
        spares: Memory of states that are gone.
    """

    def __init__(self, tissue: Any, spares: Spares) -> None:
        kind = type(tissue)
        left_out = attributes_in(RULES.own, kind) | derived_in(RULES, kind).keys()
        now = attributes_of(tissue)
        self._attributes = {name: value for name, value in now.items() if name not in left_out}
        self._memento = Memento(self._attributes, RULES, spares)

    def restore(self, tissue: Any) -> None:
        """Put the tissue back to what it was."""
        self._memento.restore()
        kind = type(tissue)
        derived = {name: make() for name, make in derived_in(RULES, kind).items()}
        set_attributes(tissue, self._attributes | derived, attributes_in(RULES.own, kind))


class StepLog:
    """What it takes to be at the begin of any step since a state was saved."""

    def __init__(self) -> None:
        self.state: StepState | None = None
        """The saved state; None: there is none."""
        self.inputs: list[StepInputs] = []
        """What acted in each time step since."""
        self._n_substeps = 0
        self.spares = Spares()
        """Memory of states that are gone."""

    def begin(self, state: StepState) -> None:
        """Begin with a state."""
        self.state = state
        self.inputs.clear()
        self._n_substeps = 0

    def add(self, inputs: StepInputs, n_substeps: int) -> bool:
        """Note a step that was done, of that many steps of the integrator.

        Returns whether a state should be saved.
        """
        self.inputs.append(inputs)
        self._n_substeps += n_substeps
        return self._n_substeps >= STEPS_BETWEEN_STATES or len(self.inputs) >= MOST_FRAMES
