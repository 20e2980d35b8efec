"""`SavedBody`: the methods of `Tissue` that save its state and load it."""

from tissue.blade_shape import BladeShape
from tissue.core.memento import Spares
from tissue.fields.deformed_body import DeformedBody
from tissue.material import Material
from tissue.state.identity import Identity
from tissue.state.tissue_state import Around, TissueState


class SavedBody(DeformedBody):
    """A body whose state can be saved and loaded."""

    material: Material
    blade: BladeShape | None
    floor: float | None
    _identity: Identity
    _spares: Spares

    def save_state(self) -> TissueState:
        """Return the state between two steps: what follows depends on it alone.

        It costs less than a step. The same steps after `load_state` give the same bits.

        Raises:
            TissueError: the body has stopped (`step`).
        """
        self._expect_moving()
        return TissueState.of(self, self._identity, self._spares)

    def load_state(self, state: TissueState, around: Around | None = None) -> None:
        """Put the body to a state, its own or that of a tissue made alike, as often as wanted.

        A body that has stopped goes on. Loads, attachments and geoms are again those of then. In
        the tissue that was saved they are the same objects; in another one those with the same
        number, in the order in which they were made, and where there are none, new ones. What was
        made later does not act any more.

        Args:
            state: The state.
            around: What refers to the tissue, and was written with it: see `TissueState.to_bytes`.

        Raises:
            StateError: the state is of another version, another body, or other settings, or is no
                state; the body is as it was.
        """
        before = self._attachments.all
        state.load_into(self, self._identity, around)
        self._stopped, self._is_changed = None, True
        for attachment in before:
            if attachment not in self._attachments.all:
                attachment.is_released = True
                attachment.forget()

    def expect_state(self, state: TissueState) -> None:
        """Refuse a state of another body, other settings or another version, and change nothing.

        Raises:
            StateError: the message says what differs.
        """
        state.expect_of(self._identity)

    def _begin_state(self) -> None:
        """Note which body this is, before any cut."""
        system = self._system
        gravity, settings = system.surroundings.gravity, (self.material, self.blade, self.floor)
        self._identity = Identity.of(system.body, gravity, *settings, self.solver)
        self._spares = Spares()
