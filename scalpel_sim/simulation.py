"""The frame loop: arm, blade, bridge, tissue and back, 1000 frames per simulated second."""

import gc
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from bridge import Bridge, Fixture, InProcessLink, TissueFrame, TissueLink, VirtualCoupling
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.collision_monitor import CollisionMonitor
from scalpel_sim.instruments.blade_instrument import BladeInstrument
from scalpel_sim.instruments.driven_grasper import DrivenGrasper
from scalpel_sim.instruments.instrument import CoupledBody, Instrument
from scalpel_sim.recording.columns import (
    COLUMNS,
    ColumnGroup,
    FrameData,
    WallTimes,
    columns_of,
    held_group,
    label_group,
)
from scalpel_sim.recording.observations import MaterialSamples, observed, result_at_rest
from scalpel_sim.recording.recording import Recording
from scalpel_sim.recording.row_writer import RowWriter
from scalpel_sim.scene.scene import Scene
from scalpel_sim.state import SimulationState, StartState
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, StageTimes, StateError, StepResult, Wrench

_NO_STEP = StageTimes(0.0, 0.0, 0.0)
"""Times of a frame in which the tissue was not queried."""

EveryFrame = Callable[["Simulation"], bool | None]
"""Called after each frame; a run ends early when it returns True."""

DrawFrame = Callable[["Simulation"], None]
"""Called after each frame, timed as the stage RD: a replay or a live viewer draws it."""


class Scorer(Protocol):
    """Scores a simulation against its task: see `scoring.score.Score`."""

    def after_frame(self, simulation: "Simulation") -> None:
        """Count the last frame."""

    def look(self, simulation: "Simulation") -> None:
        """Look at the tissue now."""

    def terms(self) -> dict[str, float]:
        """Return the terms so far by name, in SI units."""

    def failed(self) -> list[str] | None:
        """Return the conditions of success that do not hold; None where there are none."""

    def figures(self) -> dict[str, Any]:
        """Return the terms so far, for `summary.json`."""


class Simulation:
    """An arm that leads a blade along a stroke, and the tissue that the blade cuts.

    Args:
        arm: At the start of the stroke. `arm.model` and `arm.data` are MuJoCo's own.
        stroke: Where the hand leads the blade, tissue frame.
        link: The tissue.
        frame: Where the tissue lies in the world.
        fixtures: Rigid bodies around it in the world, besides the arm's table: see `touching`.
        tissue_every: Number of frames after which the tissue is queried again.
        coupling: Spring and damper between the arm's blade and the one that cuts; None where they
            are one.
        passivity: Whether what would give the arm energy out of nothing is damped.
    """

    def __init__(
        self,
        arm: DrivenArm,
        stroke: Stroke,
        link: TissueLink,
        frame: TissueFrame,
        fixtures: Iterable[Fixture] = (),
        *,
        tissue_every: int = 1,
        coupling: VirtualCoupling | None = None,
        passivity: bool = True,
    ) -> None:
        self.arm = arm
        self.link = link
        self.frame = frame
        self.bridge = Bridge(
            link,
            frame,
            arm.limits,
            tissue_every=tissue_every,
            coupling=coupling,
            passivity=passivity,
        )
        self.blade = BladeInstrument(arm, stroke, frame, link, self.bridge)
        """The first of the instruments."""
        self.coupled = {
            "tissue_every": repr(tissue_every),
            "coupling": repr(coupling),
            "passivity": repr(passivity),
        }
        """Settings of the coupling of arm and tissue, as text."""
        self.touching = CollisionMonitor(arm, fixtures)
        """Collisions of the arm with fixtures and with itself."""
        self.instruments: list[Instrument] = [self.blade]
        """Instruments that are led: see `add`."""
        self.coupled_bodies: list[CoupledBody] = [self.blade]
        """Bodies that act on the tissue: instruments, and a `GeomCoupling` of the other bodies."""
        self.records = True
        """Whether each frame is recorded, set before the first one. Otherwise no row is computed,
        `recording` stays empty, and memory does not grow."""
        self.n_frames = 0
        """Number of frames so far."""
        labels = label_group(link.describe().labels)
        self._shared = [*COLUMNS.values(), held_group(len(self.bridge.frame_loads)), labels]
        self._groups: list[ColumnGroup] = []
        self._take_columns()
        self.samples = MaterialSamples()
        """Material points that were observed."""
        self._wall_times = WallTimes()
        self._start: StartState | None = None
        self.workspace: FloatArray | None = None
        """Where a hand may lead the middle of the edge [m], tissue frame: the lowest and the
        highest place, shape (2, 3); None: the blade follows a script."""
        self.scene: Scene | None = None
        """Scene that it was made from; None: it was made without one."""
        self.expected_force: float | None = None
        """Force of the cut if the body does not give way [N]; None where that is not known."""
        self.score: Scorer | None = None
        """The score so far, of a scene with a task."""
        self.pictures: list[DrawFrame] = []
        """Called after each frame; most frames they skip."""
        self.wall_seconds = 0.0
        """Wall time of frames, pictures and recording so far."""
        self.dt: float = arm.model.opt.timestep

    def _take_columns(self) -> None:
        """Begin the recording, with the columns of all instruments."""
        groups = (*self._shared, *(each.columns for each in self.instruments))
        self._groups = [group for group in groups if group.quantities]
        self.recording = Recording(columns_of(self._groups))
        """Rows of the frames so far."""
        is_parallel = isinstance(self.link, InProcessLink) and not self.frame.is_rotated
        self._rows = RowWriter(self._groups, self.recording, is_parallel)

    @property
    def stroke(self) -> Stroke:
        """Path of the blade, tissue frame."""
        return self.blade.stroke

    @stroke.setter
    def stroke(self, stroke: Stroke) -> None:
        self.blade.stroke = stroke

    @property
    def wrench(self) -> Wrench:
        """Wrench on the blade in the last frame, world frame."""
        return self.blade.wrench

    def add(self, instrument: Instrument) -> None:
        """Add an instrument of the arm's model, before the first frame."""
        self.instruments.append(instrument)
        self.coupled_bodies.append(instrument)
        self._take_columns()
        if self._start is not None:
            self.note_start()

    @property
    def graspers(self) -> list[DrivenGrasper]:
        """Those of the instruments that are graspers."""
        return [each for each in self.instruments if isinstance(each, DrivenGrasper)]

    @property
    def duration(self) -> float:
        """Simulated time at which the scripts of all instruments have ended [s].

        Of strokes that may end otherwise than planned it is the latest, until they have ended.
        """
        return max(each.duration for each in self.instruments)

    @property
    def title(self) -> str:
        """Name of the scene and of the stroke, for a heading."""
        stroke = "led by hand" if self.stroke.is_led else f"{self.stroke.name} stroke"
        return f"{self.link.describe().scene}: {stroke}"

    @property
    def time(self) -> float:
        """Simulated time of the frames so far [s]."""
        return self.n_frames * self.dt

    @property
    def result(self) -> StepResult:
        """Result of the last step of the tissue, tissue frame."""
        result = self.bridge.result
        if result is None:
            raise RuntimeError("no frame has been done yet: call step() or run() first")
        return result

    def step(self) -> Wrench:
        """Do one frame and return the wrench on the blade.

        Raises:
            ArmError: MuJoCo's state is no longer finite.
            CouplingError: the tissue answered with a wrench that no arm may render.
            LinkError: the tissue is elsewhere, and did not answer.
        """
        start = time.perf_counter()
        arm, blade, now = self.arm, self.blade, self.time
        for instrument in self.instruments:
            instrument.lead(now)
        arm.step1()
        arm.check_if_set()  # the tissue is queried only where a blade can be
        self.touching.check()
        for body in self.coupled_bodies:
            body.follow()
        try:
            blade.wrench = self.bridge.step(blade.segment, self.dt)
        except Exception:
            blade.release()
            raise
        for body in self.coupled_bodies:
            body.apply()
        arm.step2()
        arm.check()
        done = time.perf_counter()
        for draw in self.pictures:
            draw(self)
        drawn = time.perf_counter()
        self.n_frames += 1
        if self.score is not None:
            self.score.after_frame(self)
        if self.records:
            result, stages = self.bridge.result, _NO_STEP
            if result is not None and self.bridge.answered:
                stages = result.stage_times
            self._wall_times = WallTimes(*stages, drawn - done, done - start)
            self._rows.append(self._frame(drawn))
        self.wall_seconds += time.perf_counter() - start
        return blade.wrench

    def save_state(self) -> SimulationState:
        """Return the state of arm, coupling and tissue after the last frame.

        Raises:
            StateError: the tissue is in another process.
        """
        return SimulationState.of(self)

    def load_state(self, state: SimulationState) -> None:
        """Return to a state of its own, as often as wanted; frames after that are forgotten.

        The frames that follow are those that followed then, to the bit. Wall times, pictures and
        files that were written stay.

        Raises:
            StateError: the state is of another simulation.
        """
        state.load_into(self)
        self.samples.relocate()

    def note_start(self) -> None:
        """Keep the present state as the one that `reset` returns to; `prepare` calls it.

        Call it again after `coupled_bodies` was changed.

        Raises:
            StateError: the tissue is in another process.
        """
        self._start = StartState(self)

    def reset(self) -> None:
        """Return to the start: to where `note_start` was called, as often as wanted.

        The frames that follow are those that followed then, to the bit; see `load_state`.

        Raises:
            StateError: no start is known, or the tissue is in another process.
        """
        if self._start is None:
            raise StateError(
                "the simulation has no start to return to. A tissue in another process keeps its "
                "state: run without --connect. In a simulation made without prepare(), call "
                "note_start() before the first frame"
            )
        self._start.load_into(self)
        self.samples.relocate()

    def observe(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return quantities of the last frame by name; before the first one, forces are zero.

        Args:
            names: Quantities of the recording, such as `tip`, `force` or `left_opening`, and names
                of `OBSERVATIONS`, which may have an argument: `points:64`.

        Returns:
            Of each quantity its columns in SI units, shape (n_columns,), as in the recording; of
            an observation its arrays. Copies, world frame.

        Raises:
            UsageError: no quantity is called so.
            StateError: the tissue is in another process, and cannot be observed so.
        """
        return observed(self, self._groups, self._frame(time.perf_counter()), names)

    def _frame(self, recorded_since: float) -> FrameData:
        """Return the last frame, which begins to be recorded at that wall clock [s]."""
        bridge, blade = self.bridge, self.blade
        result = bridge.result
        return FrameData(
            max(self.n_frames - 1, 0) * self.dt,
            blade.segment,
            blade.wrench,
            bridge.wrench_raw,
            result_at_rest(self.link) if result is None else result,
            self.frame,
            bridge.frame_loads,
            self._wall_times,
            recorded_since,
        )

    def run(self, seconds: float, every_frame: EveryFrame | None = None) -> None:
        """Do frames until `seconds` of simulated time have passed or `every_frame` returns True."""
        n_frames = round(seconds / self.dt)
        with no_garbage_collection():
            while self.n_frames < n_frames:
                self.step()
                if every_frame is not None and every_frame(self):
                    return


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Disable Python's cycle collector, which would cost milliseconds in random frames.

    A frame makes no cycles: what it allocates is freed by counting references. Nothing is collected
    at the begin either: with a million objects in memory that takes as long as a hundred frames.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
