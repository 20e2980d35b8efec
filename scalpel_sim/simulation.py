"""The frame loop: arm, blade, bridge, and back, a thousand times a simulated second."""

import gc
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import numpy as np

from bridge import Bridge, Fixture, TissueFrame, TissueLink, VirtualCoupling
from scalpel_sim.arm.arm import Arm
from scalpel_sim.arm.collision_monitor import Touching
from scalpel_sim.output.frame_row import row_of
from scalpel_sim.output.recording import Recording
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, StageTimes, StepResult, Wrench

NO_WRENCH = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))

_AT_REST = StageTimes(0.0, 0.0, 0.0)
"""Of a frame in which the tissue was not asked."""

EveryFrame = Callable[["Simulation"], bool | None]
"""Called after each frame; a run ends early where it returns True."""

Picture = Callable[["Simulation"], None]
"""Called after each frame too, and takes what it wants to show: a replay, a live viewer."""


class Simulation:
    """An arm that leads a blade along a stroke, and the tissue that the blade meets.

    Args:
        arm: At the start of the stroke. `arm.model` and `arm.data` are MuJoCo's own.
        stroke: Where the hand leads the blade, tissue frame.
        link: The tissue.
        frame: Where the tissue lies in the world.
        fixtures: What stands around it in the world, beside the arm's table: see `touching`.
        tissue_every: Frames in which the tissue is asked once, for all of them.
        coupling: Between the arm's blade and the one that cuts; None where they are one.
        passivity: Whether what would give the arm energy out of nothing is damped.
    """

    def __init__(
        self,
        arm: Arm,
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
        self.stroke = stroke
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
        self.wrench = NO_WRENCH
        """What the blade felt in the last frame, world frame."""
        self.touching = Touching(arm, fixtures)
        """Which parts of the arm meet what."""
        self.recording = Recording()
        """What happened in each frame so far."""
        self.pictures: list[Picture] = []
        """Called after each frame, outside its clock; most frames they let pass."""
        self.wall_seconds = 0.0
        """Wall time spent in frames and pictures so far."""
        self.dt: float = arm.model.opt.timestep

    @property
    def title(self) -> str:
        """What is cut, and how, for a heading."""
        return f"{self.link.describe().scene}: {self.stroke.name} stroke"

    @property
    def time(self) -> float:
        """Simulated time [s]: that of the frames so far."""
        return len(self.recording) * self.dt

    @property
    def result(self) -> StepResult:
        """What the tissue did when it was last asked, tissue frame."""
        result = self.bridge.result
        if result is None:
            raise RuntimeError("no frame has been done yet: call step() or run() first")
        return result

    def step(self) -> Wrench:
        """Do one frame and return what the blade felt in it.

        Raises:
            ArmError: MuJoCo's state is no longer finite.
            CouplingError: the tissue answered with what no arm may feel.
            LinkError: the tissue is elsewhere, and did not answer.
        """
        start = time.perf_counter()
        self.arm.hand.follow(self.frame.segment_to_world(self.stroke.pose(self.time)))
        self.arm.step1()
        self.touching.look()
        segment = self.arm.blade.segment()
        self.wrench = self._answer(segment)
        self.arm.blade.apply(self.wrench)
        self.arm.step2()
        self.arm.check()
        framed = time.perf_counter()
        for picture in self.pictures:
            picture(self)
        drawn = time.perf_counter()

        profile = self.result.profile if self.bridge.answered else _AT_REST
        self.recording.append(
            row_of(
                self.time,
                segment,
                self.wrench,
                self.bridge.wrench_raw,
                self.result,
                profile,
                self.frame,
                picture_seconds=drawn - framed,
                frame_seconds=framed - start,
            )
        )
        self.wall_seconds += time.perf_counter() - start
        return self.wrench

    def _answer(self, segment: BladeSegment) -> Wrench:
        """Return what the tissue answers; where it does not, let go of the arm."""
        try:
            return self.bridge.step(segment, self.dt)
        except Exception:
            self.arm.blade.apply(NO_WRENCH)
            raise

    def run(self, seconds: float, every_frame: EveryFrame | None = None) -> None:
        """Do frames until `seconds` of simulated time have passed, or `every_frame` says so."""
        n_frames = round(seconds / self.dt)
        with no_garbage_collection():
            while len(self.recording) < n_frames:
                self.step()
                if every_frame is not None and every_frame(self):
                    return


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Keep Python's cycle collector out of the frames, where it would cost milliseconds at random.

    A frame makes no cycles: what it allocates is freed by counting references.
    """
    was_enabled = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if was_enabled:
            gc.enable()
