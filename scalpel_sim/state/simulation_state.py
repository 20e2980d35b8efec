"""`SimulationState`: arm, coupling and tissue at the end of a frame."""

from typing import TYPE_CHECKING, Any, Self

import mujoco
import numpy as np

from bridge import InProcessLink
from tissue import Memento, StateError, StateRules, TissueState

if TYPE_CHECKING:
    from scalpel_sim.simulation import Simulation

_SPEC = mujoco.mjtState.mjSTATE_INTEGRATION
"""What MuJoCo's next step depends on: joints, hand, wrenches, and where its solver ended."""

_RULES = StateRules(
    packages=frozenset({"bridge", "scalpel_sim"}),
    kept=frozenset({"Recording", "Stroke", "GraspMotion", "Fixtures", "ArmGeom"}),
    own=frozenset({"Simulation.recording", "Simulation.pictures", "Simulation.wall_seconds"}),
)
"""What of arm and bridge is state; the tissue has its own."""


class SimulationState:
    """A simulation at the end of a frame. It is made by `Simulation.save_state`."""

    def __init__(
        self, memento: Memento, arm: np.ndarray, tissue: TissueState, n_frames: int
    ) -> None:
        self._memento, self._arm, self._tissue = memento, arm, tissue
        self.n_frames = n_frames
        """Number of frames that were done."""

    @classmethod
    def of(cls, simulation: "Simulation") -> Self:
        """Return the state of a simulation now.

        Raises:
            StateError: its tissue is in another process.
        """
        link, (model, data) = simulation.link, _mujoco_of(simulation)
        if not isinstance(link, InProcessLink):
            raise StateError(
                "the tissue is in another process, and its state cannot be saved over a link: run "
                "without --connect"
            )
        arm = np.empty(mujoco.mj_stateSize(model, _SPEC))
        mujoco.mj_getState(model, data, arm, _SPEC)
        tissue, memento = link.tissue.save_state(), Memento(simulation, _RULES)
        return cls(memento, arm, tissue, len(simulation.recording))

    def load_into(self, simulation: "Simulation") -> None:
        """Put a simulation to this state.

        Raises:
            StateError: it is of another simulation, or that has recorded less.
        """
        if self._memento.root is not simulation:
            raise StateError(
                "the state is of another simulation: load it into the one that saved it"
            )
        if len(simulation.recording) < self.n_frames:
            raise StateError(
                f"the state is of frame {self.n_frames}, and the recording has "
                f"{len(simulation.recording)} frames: put back the recording of then first"
            )
        link, (model, data) = simulation.link, _mujoco_of(simulation)
        assert isinstance(link, InProcessLink)
        link.tissue.load_state(self._tissue)
        self._memento.restore()
        mujoco.mj_setState(model, data, self._arm, _SPEC)
        mujoco.mj_forward(model, data)  # for whoever looks at the arm before the next frame
        mujoco.mj_setState(model, data, self._arm, _SPEC)  # it has moved its solver on
        simulation.recording.cut_back(self.n_frames)


def _mujoco_of(simulation: "Simulation") -> tuple[Any, Any]:
    """Return MuJoCo's model and data."""
    return simulation.arm.model, simulation.arm.data
