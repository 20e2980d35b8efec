"""`SimulationState`: arm, coupling and tissue at the end of a frame, in memory or as bytes."""

import json
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import mujoco
import numpy as np

from bridge import InProcessLink, LedGrip, Proxy
from scalpel_sim.arm.grip import Grip
from scalpel_sim.state.made_alike import expect_alike, settings_of
from tissue import Around, FloatArray, Memento, StateError, StateRules, TissueState

if TYPE_CHECKING:
    from scalpel_sim.simulation import Simulation

_SPEC = mujoco.mjtState.mjSTATE_INTEGRATION
"""What MuJoCo's next step depends on: joints, hand, wrenches, and where its solver ended."""

_PLACES = (
    *("xpos", "xquat", "xmat", "xipos", "ximat", "xanchor", "xaxis"),
    *("geom_xpos", "geom_xmat", "site_xpos", "site_xmat"),
    *("cam_xpos", "cam_xmat", "light_xpos", "light_xdir"),
)
"""MuJoCo's arrays of where all is in the world. At the end of a frame they are those of its first
half, as the tissue met the blade, and the joints have moved on: so they do not follow from them."""


def _none() -> None:
    return None


_RULES = StateRules(
    packages=frozenset({"bridge", "scalpel_sim"}),
    kept=frozenset({"Recording", "Stroke", "GraspMotion", "Fixtures", "ArmGeom"}),
    derived={"Grip._views": _none},
    own=frozenset({"Simulation.recording", "Simulation.pictures", "Simulation.wall_seconds"}),
    # Where a stroke leads depends on the time alone. So what a hand did is gone on with by the
    # stroke that was recorded.
    unwritten=frozenset({"Simulation.leader", "LedGrasper.leader"}),
    made={kind.__name__: kind for kind in (Grip, LedGrip, Proxy)},
)
"""What of arm and bridge is state; the tissue has its own."""

_CONTENT, _ARM, _WHERE = "simulation", "arm", "places"
"""Names of arrays beside the tissue's in the bytes of a state: JSON, MuJoCo's state, `_PLACES`."""


class _Elsewhere(NamedTuple):
    """A state from bytes, which another process may have saved."""

    settings: dict[str, str]
    """Settings of the simulation that was saved: see `made_alike`."""
    wall_seconds: float
    """Wall time of its frames so far [s]."""


class SimulationState:
    """A simulation at the end of a frame.

    It is made by `Simulation.save_state`, or from bytes.
    """

    def __init__(
        self,
        source: Memento | _Elsewhere,
        arm: FloatArray,
        places: FloatArray,
        tissue: TissueState,
        n_frames: int,
    ) -> None:
        self._source, self._arm, self._tissue = source, arm, tissue
        self._places = places
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
        places = np.concatenate([getattr(data, name).ravel() for name in _PLACES])
        return cls(memento, arm, places, tissue, len(simulation.recording))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Return the state that `to_bytes` wrote.

        Raises:
            StateError: the bytes are no state, or not all of one.
        """
        tissue = TissueState.from_bytes(data)
        content = json.loads(tissue.beside(_CONTENT).tobytes())
        source = _Elsewhere(content["settings"], content["wall_seconds"])
        arm, places = tissue.beside(_ARM), tissue.beside(_WHERE)
        return cls(source, arm, places, tissue, content["n_frames"])

    def to_bytes(self) -> bytes:
        """Return the state as bytes: a NumPy archive (`.npz`) of plain arrays and of JSON.

        What leads arm and graspers is not in it: the stroke and the motions of the simulation that
        loads it do, which are the same; of a hand, what was recorded.

        Raises:
            StateError: the state is from bytes itself.
        """
        if not isinstance(self._source, Memento):
            raise StateError("the state is from bytes: keep those")
        simulation = self._source.root
        content = {
            "settings": settings_of(simulation),
            "wall_seconds": simulation.wall_seconds,
            "n_frames": self.n_frames,
        }
        text = np.frombuffer(json.dumps(content, allow_nan=False).encode(), np.uint8)
        beside: dict[str, np.ndarray] = {_CONTENT: text, _ARM: self._arm, _WHERE: self._places}
        return self._tissue.to_bytes(self._source, beside)

    def load_into(self, simulation: "Simulation") -> None:
        """Put a simulation to this state.

        Raises:
            StateError: it is of another simulation, or that has recorded less; from bytes: it is of
                one that was not made alike. The simulation is as it was.
        """
        source = self._source
        if isinstance(source, Memento) and source.root is not simulation:
            raise StateError(
                "the state is of another simulation: load it into the one that saved it, or turn "
                "it into bytes first"
            )
        if len(simulation.recording) < self.n_frames:
            raise StateError(
                f"the state is of frame {self.n_frames}, and the recording has "
                f"{len(simulation.recording)} frames: put back the recording of then first"
            )
        link, (model, data) = simulation.link, _mujoco_of(simulation)
        if isinstance(source, Memento):
            assert isinstance(link, InProcessLink)
            link.tissue.load_state(self._tissue)
            source.restore()
        else:
            if not isinstance(link, InProcessLink):
                raise StateError(
                    "the tissue is in another process, and a state cannot be loaded over a link: "
                    "run without --connect"
                )
            link.tissue.expect_state(self._tissue)
            expect_alike(simulation, source.settings)
            link.tissue.load_state(self._tissue, Around(simulation, _RULES))
            simulation.wall_seconds = source.wall_seconds
        mujoco.mj_setState(model, data, self._arm, _SPEC)
        mujoco.mj_forward(model, data)  # for whoever looks at the arm before the next frame
        mujoco.mj_setState(model, data, self._arm, _SPEC)  # it has moved its solver on
        _put_at(data, self._places)
        simulation.recording.cut_back(self.n_frames)


def _mujoco_of(simulation: "Simulation") -> tuple[Any, Any]:
    """Return MuJoCo's model and data."""
    return simulation.arm.model, simulation.arm.data


def _put_at(data: Any, places: FloatArray) -> None:
    """Put what is in the world to where it was: `_PLACES` in a row, in the frame of the world."""
    begin = 0
    for name in _PLACES:
        array = getattr(data, name)
        end = begin + array.size
        array[:] = places[begin:end].reshape(array.shape)
        begin = end
