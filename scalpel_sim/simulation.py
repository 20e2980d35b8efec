"""The frame loop: arm, blade, bridge, tissue and back, 1000 frames per simulated second."""

import gc
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from bridge import Bridge, Fixture, TissueFrame, TissueLink, VirtualCoupling
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.collision_monitor import CollisionMonitor
from scalpel_sim.instruments.driven_grasper import DrivenGrasper
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.recording.frame_row import FrameRows, WallTimes
from scalpel_sim.recording.recording import Recording, columns_of_hand, held_columns
from scalpel_sim.state import SimulationState
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray, StageTimes, StepResult, Wrench

NO_WRENCH = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))

_NO_STEP = StageTimes(0.0, 0.0, 0.0)
"""Times of a frame in which the tissue was not asked."""

EveryFrame = Callable[["Simulation"], bool | None]
"""Called after each frame; a run ends early when it returns True."""

DrawFrame = Callable[["Simulation"], None]
"""Called after each frame, timed as the stage RD: a replay or a live viewer draws it."""


class CoupledBody(Protocol):
    """A body that acts on the tissue in each frame, and is acted on by it: a grip, a contact."""

    def follow(self) -> None:
        """Be where the model is, before the tissue's step: between MuJoCo's two halves of one."""

    def apply(self) -> None:
        """Apply to the model what the tissue did in its step."""


class Controller(Protocol):
    """Leads the hand in each frame: a `StrokeFollower`, or a person by a `Teleoperation`."""

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""


class Simulation:
    """An arm that leads a blade along a stroke, and the tissue that the blade cuts.

    Args:
        arm: At the start of the stroke. `arm.model` and `arm.data` are MuJoCo's own.
        stroke: Where the hand leads the blade, tissue frame.
        link: The tissue.
        frame: Where the tissue lies in the world.
        fixtures: Rigid bodies around it in the world, beside the arm's table: see `touching`.
        tissue_every: Number of frames after which the tissue is asked again.
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
        self.stroke = stroke
        self.bridge = Bridge(
            link,
            frame,
            arm.limits,
            tissue_every=tissue_every,
            coupling=coupling,
            passivity=passivity,
        )
        self.coupled = {
            "tissue_every": repr(tissue_every),
            "coupling": repr(coupling),
            "passivity": repr(passivity),
        }
        """Settings of the coupling of arm and tissue, as text."""
        self.wrench = NO_WRENCH
        """Wrench on the blade in the last frame, world frame."""
        self.touching = CollisionMonitor(arm, fixtures)
        """Collisions of the arm with fixtures and with itself."""
        self._rows = FrameRows(frame)
        self.recording = Recording(others=held_columns(len(self.bridge.frame_loads)))
        """Rows of the frames so far."""
        self.graspers: list[DrivenGrasper] = []
        """Graspers of other arms: see `add_grasper`."""
        self.coupled_bodies: list[CoupledBody] = []
        """Other bodies that act on the tissue, graspers among them."""
        self.workspace: FloatArray | None = None
        """Where a hand may lead the middle of the edge [m], tissue frame: the lowest and the
        highest place, shape (2, 3); None: the blade follows a script."""
        self.expected_force: float | None = None
        """Force of the cut if the body does not give way [N]; None where that is not known."""
        self.pictures: list[DrawFrame] = []
        """Called after each frame; most frames they skip."""
        self.wall_seconds = 0.0
        """Wall time of frames, pictures and recording so far."""
        self.dt: float = arm.model.opt.timestep

    @property
    def stroke(self) -> Stroke:
        """Path of the blade, tissue frame."""
        return self._stroke

    @stroke.setter
    def stroke(self, stroke: Stroke) -> None:
        self._stroke = stroke
        self.controller: Controller = StrokeFollower(self.arm.hand, stroke, self.frame)
        """Leads the blade in each frame."""

    def add_grasper(self, grasper: DrivenGrasper) -> None:
        """Add a grasper of the arm's model, before the first frame."""
        self.graspers.append(grasper)
        self.coupled_bodies.append(grasper)
        names = [name for each in self.graspers for name in columns_of_hand(each.name)]
        held = held_columns(self.recording.n_held)
        self.recording = Recording(others=[*held, *names])

    @property
    def duration(self) -> float:
        """When the blade and all graspers are at the end of their ways [s]."""
        return max(self.stroke.duration, *(each.motion.duration for each in self.graspers), 0.0)

    @property
    def title(self) -> str:
        """Name of the scene and of the stroke, for a heading."""
        stroke = "led by hand" if self.stroke.is_led else f"{self.stroke.name} stroke"
        return f"{self.link.describe().scene}: {stroke}"

    @property
    def time(self) -> float:
        """Simulated time of the frames so far [s]."""
        return len(self.recording) * self.dt

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
        arm, blade, now = self.arm, self.arm.blade, self.time
        self.controller.lead(now)
        for grasper in self.graspers:
            grasper.lead(now)
        arm.step1()
        arm.check_if_set()  # the tissue is asked only where a blade can be
        self.touching.check()
        segment = blade.segment()
        for body in self.coupled_bodies:
            body.follow()
        self.wrench = self._wrench_on(segment)
        blade.apply(self.wrench)
        for body in self.coupled_bodies:
            body.apply()
        arm.step2()
        arm.check()
        done = time.perf_counter()
        for draw in self.pictures:
            draw(self)
        drawn = time.perf_counter()
        self._record(now, segment, drawn - done, done - start)
        self.wall_seconds += time.perf_counter() - start
        return self.wrench

    def save_state(self) -> SimulationState:
        """Return the state of arm, coupling and tissue after the last frame.

        Raises:
            StateError: the tissue is in another process.
        """
        return SimulationState.of(self)

    def load_state(self, state: SimulationState) -> None:
        """Put it back to a state of its own, as often as wanted; frames after that are forgotten.

        The frames that follow are those that followed then, to the bit. Wall times, pictures and
        files that were written stay.

        Raises:
            StateError: the state is of another simulation.
        """
        state.load_into(self)

    def _record(self, now: float, segment: BladeSegment, *wall_seconds: float) -> None:
        """Add a frame to the recording, and to its row how long that took.

        Args:
            now: Simulated time at which the frame began [s].
            segment: Where the blade is at its end.
            wall_seconds: Wall times of its pictures, and of the frame without them [s].
        """
        start = time.perf_counter()
        bridge, result = self.bridge, self.result
        stages = result.stage_times if bridge.answered else _NO_STEP
        row = self._rows.row_of(
            now,
            segment,
            self.wrench,
            bridge.wrench_raw,
            result,
            WallTimes(*stages, *wall_seconds),
        )
        held = self._forces_on_attachments()
        row.append(time.perf_counter() - start)
        row += held
        for grasper in self.graspers:
            row += grasper.record()
        self.recording.append(row)

    def _forces_on_attachments(self) -> list[float]:
        """Return the forces of the tissue on what holds it by its own scene [N], world frame."""
        if not self.recording.n_held:
            return []
        loads = self.bridge.frame_loads[: self.recording.n_held]
        forces = [self.frame.vectors_to_world(load.wrench.force) for load in loads]
        return [number for force in forces for number in force.tolist()]

    def _wrench_on(self, segment: BladeSegment) -> Wrench:
        """Return the wrench of the tissue; where there is none, take the last one off the arm."""
        try:
            return self.bridge.step(segment, self.dt)
        except Exception:
            self.arm.blade.apply(NO_WRENCH)
            raise

    def run(self, seconds: float, every_frame: EveryFrame | None = None) -> None:
        """Do frames until `seconds` of simulated time have passed or `every_frame` returns True."""
        n_frames = round(seconds / self.dt)
        with no_garbage_collection():
            while len(self.recording) < n_frames:
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
