"""`SimulationState`: arm, coupling and tissue at the end of a frame, in memory or as bytes."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any, Protocol, Self

import mujoco
import numpy as np

from bridge import DrivenFrame, InProcessLink, Proxy, TissueFrame, TissueLink
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.instruments.driven_grasper import DrivenGrasper
from scalpel_sim.instruments.grip import Grip
from scalpel_sim.recording.recording import Recording
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, StateError, TissueState
from tissue.support import Around, Memento, StateRules

_SPEC = mujoco.mjtState.mjSTATE_INTEGRATION
"""State of MuJoCo that its next step depends on: joints, hand, wrenches, end of its solver."""

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
    kept=frozenset(
        {"Scene", "Recording", "Stroke", "GraspMotion", "Fixtures", "ArmGeom"}
        | {"Yardstick", "StrainLimit", "TargetOutside", "TaskCamera"}
    ),
    derived={"Grip._views": _none},
    own=frozenset(
        f"Simulation.{name}"
        for name in (
            *("recording", "records", "n_frames", "pictures", "wall_seconds"),
            *("_shared", "_groups", "_rows", "samples", "_wall_times", "_start"),
        )
    )
    | frozenset(f"DeviceHand.{name}" for name in ("answers", "_hold", "_n_lost", "_looked_at")),
    # Where a stroke leads depends on the time alone. So what a hand did is gone on with by the
    # stroke that was recorded.
    unwritten=frozenset({"BladeInstrument.controller", "DrivenGrasper.controller"}),
    made={kind.__name__: kind for kind in (Grip, DrivenFrame, Proxy)},
)
"""Rules of the state of arm and bridge; the tissue has its own."""

_CONTENT, _ARM, _WHERE = "simulation", "arm", "places"
"""Names of arrays besides the tissue's in the bytes of a state: JSON, MuJoCo's state, `_PLACES`."""


class SavedSimulation(Protocol):
    """A simulation, as far as its state and its settings go; see `simulation.Simulation`."""

    arm: DrivenArm
    link: TissueLink
    frame: TissueFrame
    recording: Recording
    records: bool
    n_frames: int
    coupled: dict[str, str]
    wall_seconds: float

    @property
    def stroke(self) -> Stroke:
        """Path of the blade."""

    @property
    def graspers(self) -> list[DrivenGrasper]:
        """Graspers of other arms."""


class SimulationState:
    """A simulation at the end of a frame.

    It is made by `Simulation.save_state`, or from bytes.
    """

    def __init__(
        self,
        source: Memento | dict[str, str],
        arm: FloatArray,
        places: FloatArray,
        tissue: TissueState,
        n_frames: int,
        wall_seconds: float,
    ) -> None:
        self._source, self._arm, self._tissue = source, arm, tissue
        """Source: the simulation that was saved, or, from bytes, the settings of another one."""
        self._places, self._wall_seconds = places, wall_seconds
        self.n_frames = n_frames
        """Number of frames that were done."""

    @classmethod
    def of(cls, simulation: SavedSimulation) -> Self:
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
        return cls(memento, arm, places, tissue, simulation.n_frames, simulation.wall_seconds)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Return the state that `to_bytes` wrote.

        Raises:
            StateError: the bytes are no state, or not all of one.
        """
        tissue = TissueState.from_bytes(data)
        content = json.loads(tissue.beside(_CONTENT).tobytes())
        arm, places = tissue.beside(_ARM), tissue.beside(_WHERE)
        numbers = content["n_frames"], content["wall_seconds"]
        return cls(content["settings"], arm, places, tissue, *numbers)

    def beside(self, name: str) -> np.ndarray | None:
        """Return an array that was written beside a state from bytes; None: there is none."""
        try:
            return self._tissue.beside(name)
        except StateError:
            return None

    def to_bytes(self, beside: Mapping[str, np.ndarray] | None = None) -> bytes:
        """Return the state as bytes: a NumPy archive (`.npz`) of plain arrays and of JSON.

        What leads arm and graspers is not in it: the stroke and the motions of the simulation that
        loads it do, which are the same; of a hand, what was recorded.

        Args:
            beside: Arrays that are written with it, by names of their own.

        Raises:
            StateError: the state is from bytes itself.
        """
        if not isinstance(self._source, Memento):
            raise StateError("the state is from bytes: keep those")
        simulation = self._source.root
        content = {
            "settings": _settings_of(simulation),
            "wall_seconds": self._wall_seconds,
            "n_frames": self.n_frames,
        }
        text = np.frombuffer(json.dumps(content, allow_nan=False).encode(), np.uint8)
        ours: dict[str, np.ndarray] = {_CONTENT: text, _ARM: self._arm, _WHERE: self._places}
        return self._tissue.to_bytes(self._source, {**(beside or {}), **ours})

    def load_into(self, simulation: SavedSimulation) -> None:
        """Put a simulation to this state.

        Raises:
            StateError: it is of another simulation, or that has recorded less; from bytes: it is of
                one that was not made the same way. The simulation is as it was.
        """
        source = self._source
        if isinstance(source, Memento) and source.root is not simulation:
            raise StateError(
                "the state is of another simulation: load it into the one that saved it, or turn "
                "it into bytes first"
            )
        if simulation.records and len(simulation.recording) < self.n_frames:
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
            _expect_compatible(simulation, source)
            link.tissue.load_state(self._tissue, Around(simulation, _RULES))
            simulation.wall_seconds = self._wall_seconds
        mujoco.mj_setState(model, data, self._arm, _SPEC)
        mujoco.mj_forward(model, data)  # for whoever looks at the arm before the next frame
        mujoco.mj_setState(model, data, self._arm, _SPEC)  # it has moved its solver on
        _put_at(data, self._places)
        simulation.n_frames = self.n_frames
        if simulation.records:
            simulation.recording.cut_back(self.n_frames)


class StartState:
    """The state at the start of a simulation, which owns it without a cycle of references.

    Without that a simulation that is dropped would keep its memory until cycles are collected.

    Raises:
        StateError: its tissue is in another process.
    """

    def __init__(self, simulation: SavedSimulation) -> None:
        self._state = SimulationState.of(simulation)
        self._detach()

    def load_into(self, simulation: SavedSimulation) -> None:
        """Put the simulation of which it is the start to this state."""
        source = self._memento
        source.root = simulation
        source.objects.insert(0, (simulation, self._attributes))
        try:
            self._state.load_into(simulation)
        finally:
            self._detach()

    @property
    def _memento(self) -> Memento:
        assert isinstance(self._state._source, Memento)
        return self._state._source

    def _detach(self) -> None:
        """Keep the attributes of the simulation, which is the first of all objects, without it."""
        self._attributes: dict[str, Any] = self._memento.objects.pop(0)[1]
        self._memento.root = None


def _mujoco_of(simulation: SavedSimulation) -> tuple[Any, Any]:
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


def _of_stroke(stroke: Stroke) -> str:
    """Return what tells a stroke from another one."""
    path = _digest(stroke.path)
    return f"{path} {stroke.guards}" if stroke.guards else path


def _settings_of(simulation: SavedSimulation) -> dict[str, str]:
    """Return the settings on which the frames after a state depend, by name.

    Those of the tissue are in its own state. The stroke of a hand is none: it is led again.
    """
    model = simulation.arm.model
    compiled = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, compiled)
    frame = simulation.frame
    return {
        "MuJoCo": mujoco.__version__,
        "the arm": _digest(compiled),
        "where the tissue lies": repr((frame.origin.tolist(), frame.rotation.tolist())),
        "the stroke": "recorded" if simulation.stroke.is_led else _of_stroke(simulation.stroke),
        "the motions of graspers": repr(
            [
                "recorded" if each.motion.is_led else repr(each.motion.waypoints)
                for each in simulation.graspers
            ]
        ),
        "the columns of the recording": _digest(
            np.frombuffer(",".join(simulation.recording.columns).encode(), np.uint8)
        ),
        **simulation.coupled,
    }


def _expect_compatible(simulation: SavedSimulation, settings: Mapping[str, str]) -> None:
    """Refuse the state of a simulation that is not compatible.

    Args:
        simulation: Where the state is to be loaded.
        settings: Those of the simulation whose state it is.

    Raises:
        StateError: the message says what differs.
    """
    ours = _settings_of(simulation)
    names = sorted(name for name in {*ours, *settings} if ours.get(name) != settings.get(name))
    if names:
        raise StateError(
            f"the state is of another simulation: what differs is {', '.join(names)}. Load it "
            "into one that was made the same way"
        )


def _digest(array: np.ndarray) -> str:
    """Return a short text that differs where the bytes of arrays do."""
    return hashlib.blake2b(np.ascontiguousarray(array).tobytes(), digest_size=8).hexdigest()
