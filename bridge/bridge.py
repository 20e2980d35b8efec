"""One call per frame: a blade segment in the world goes in, a wrench in the world comes out."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from bridge.arithmetic import PLAIN, Six, compiled_arithmetic
from bridge.collision.broad_phase import BroadPhase
from bridge.collision.fixtures import Fixture
from bridge.counters import Counters
from bridge.coupling.coupling import Coupling, CouplingError, expect_plausible_motion
from bridge.coupling.driven_bodies import DrivenBodies, DrivenContact, DrivenFrame, loads_over
from bridge.coupling.limits import DeviceLimits
from bridge.coupling.local_model import MAX_FRAMES_PER_ANSWER, Prediction
from bridge.coupling.passivity import Travel
from bridge.coupling.query import PathPart, Query, TissueAnswer, sweeps_along, with_bodies
from bridge.coupling.virtual_coupling import VirtualCoupling
from bridge.driven import FrameAttachment, FrameLoad, FrameTie, GeomPoses, plain_region
from bridge.frames import TissueFrame
from bridge.link import InProcessLink, TissueLink, link_to
from bridge.poses import Pose, expect_plane, finite, pose_of, pose_of_numbers
from tissue import BladeSegment, BladeSweep, Geom, Snapshot, StepResult, Wrench

if TYPE_CHECKING:  # the side without the tissue starts without its compiler
    from tissue import Tissue


class Bridge:
    """Carries the blade's motion to the tissue and the tissue's wrench back.

    By default the tissue is queried in each frame, and the arm feels in the next one the wrench
    averaged over it: the impulse on the arm equals that on the tissue, to the last bit, and the
    same blade path does the same work on both sides. Where the tissue is queried only every few
    frames, its last wrench and its local stiffness answer in between: see `LocalModel`.

    Args:
        tissue: The tissue itself, or a link to one, here or in another process. The caller closes
            a link.
        frame: Pose of the tissue in the world.
        limits: Limits of the haptic device; None for a device without limits.
        fixtures: Obstacles in the world that the blade may touch; see `touching`.
        tissue_every: Frames per query of the tissue, which covers all of them.
        coupling: Coupling between the arm's blade and the one that cuts; None where they are one.
        passivity: Whether a wrench that would generate energy at the arm is damped. The energy is
            counted in either case.
        waits: Whether a frame waits for the tissue. Otherwise the arm uses the tissue's last
            answer, and feels less of it the longer the tissue does not answer: for a device that
            must be served in time. Such a run is not reproducible.

    Raises:
        TypeError: `tissue` is neither a tissue nor a link.
        ValueError: two fixtures have one name, or `tissue_every` is not a whole number in range.
    """

    def __init__(
        self,
        tissue: Tissue | TissueLink,
        frame: TissueFrame = TissueFrame(),
        limits: DeviceLimits | None = None,
        fixtures: Iterable[Fixture] = (),
        *,
        tissue_every: int = 1,
        coupling: VirtualCoupling | None = None,
        passivity: bool = True,
        waits: bool = True,
    ) -> None:
        if not (tissue_every == int(tissue_every) and 1 <= tissue_every <= MAX_FRAMES_PER_ANSWER):
            raise ValueError(
                f"the tissue is to be queried every {tissue_every} frames; it must be a whole "
                f"number from 1 to {MAX_FRAMES_PER_ANSWER}"
            )
        link = link_to(tissue)
        self._frame = frame
        # A process without the tissue starts without its compiler.
        self._arithmetic = compiled_arithmetic() if isinstance(link, InProcessLink) else PLAIN
        self._coupling = Coupling(
            limits or DeviceLimits(), passivity=passivity, arithmetic=self._arithmetic
        )
        body = link.describe()
        self._broad_phase = BroadPhase(
            body.bounds,
            body.material.wave_speed,
            map(frame.fixture_to_tissue, fixtures),
            blade=body.blade,
            chunks=link.chunks if waits else None,  # a query for chunks would wait
        )
        self._link = link
        self._query = Query(link, waits)
        self._driven = DrivenBodies(link)
        self._prediction = Prediction(coupling)
        self._tissue_every = tissue_every
        # With an answer in each frame the model has nothing to add to the answer itself.
        self._is_direct = waits and tissue_every == 1 and coupling is None
        self._arm: Pose | None = None
        self._queried_at: Pose | None = None
        self._path: list[PathPart] = []
        self.result: StepResult | None = None
        """The tissue's last answer, in the tissue frame; None before the first one."""
        self._raw: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._felt = frame.wrench_to_world(Wrench(np.zeros(3), np.zeros(3), np.zeros(3)))
        self._raw_is_felt = True
        self.touching: tuple[str, ...] = ()
        """Names of the fixtures that the blade's swept box touched at the last query."""
        self.answered = False
        """Whether the tissue answered in the last step, so that `result` is new."""
        self._is_anchored_as_before = False
        self._silence = 0.0
        self._n_frames = 0
        self._n_answers = 0
        self._n_rejected = 0

    def step(self, segment: BladeSegment, dt: float) -> Wrench:
        """Advance the tissue by `dt` [s] while the blade moves here from its last pose.

        In the first call the blade has not moved. The tissue is queried in the first call, and then
        in every `tissue_every`-th one.

        Args:
            segment: Cutting edge at the end of the frame, in the world.
            dt: Length of the frame [s].

        Returns:
            Wrench that the arm feels, in the world, within the device's limits, about the tip.

        Raises:
            ValueError: the segment is not finite or has no plane, or `dt` is not positive.
            CouplingError: the tissue has diverged, or the blade moves as no hand moves it
                (`expect_plausible_motion`). Set the wrench on the arm to zero: it is stale.
            LinkError: the tissue is in another process and did not answer. Set the wrench on the
                arm to zero: it is stale.
        """
        if not (dt > 0.0 and math.isfinite(dt)):
            raise ValueError(f"the frame lasts {dt} s; it must be positive and finite")
        arm, motion = self._arrived(segment, dt)
        self._arm = arm
        self._n_frames += 1
        if self._is_direct and not self._path:
            raw = self._advance(arm, dt)
        else:
            raw = self._consult(arm, dt)
        self._raw, self._raw_is_felt = raw, False
        work, felt = 0.0 if self.result is None else self.result.work_of_blade, raw
        if not self._coupling.passes(raw, motion, work, self._silence):
            travel = Travel(motion, 0.5 * arm.length, work)
            felt = self._coupling.felt(raw, arm.tip, dt, travel, self._silence)
        self._raw_is_felt = felt is raw
        self._felt = self._frame.numbers_to_world(felt, arm.tip)
        return self._felt

    def _arrived(self, given: BladeSegment, dt: float) -> tuple[Pose, Six]:
        """Return the checked pose of the blade, and its motion since the last frame of `dt` [s]."""
        frame, before = self._frame, self._arm
        segment, origin = given, frame.numbers_of_origin
        if frame.is_rotated:
            segment, origin = frame.segment_to_tissue(given), (0.0, 0.0, 0.0)
        if before is None:
            first = frame.segment_to_tissue(given)
            expect_plane(first, given)
            before = pose_of(first)
        is_plausible, numbers, axes, motion = self._arithmetic.arrival.call(
            segment.numbers, origin, before.tip, before.axes, dt
        )
        arm = pose_of_numbers(numbers, axes)
        if not is_plausible:
            expect_plane(arm.segment, given)
            expect_plausible_motion(motion, dt)
        return arm, motion

    def attach(
        self,
        where: str | npt.ArrayLike,
        *,
        stiffness: float,
        damping: float = 0.0,
        breaks_at: float = math.inf,
        origin: Sequence[float] | None = None,
    ) -> DrivenFrame:
        """Attach a frame to tissue, over any link; return the frame, which is moved in each step.

        Args:
            where: A region as text, a mask of nodes, numbers of nodes, or places in the body at
                rest [m], as for `tissue.Tissue.attach`; tissue frame.
            stiffness: Total stiffness of the springs [N/m].
            damping: Total damping of the springs [N s/m].
            breaks_at: Force at which the frame releases the tissue [N].
            origin: Origin of the frame [m], tissue frame; None: the mean of the points.

        Raises:
            ValueError: see `tissue.Tissue.attach`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        at = None if origin is None else np.asarray(origin, np.float64)
        frame = self._driven.attach(
            FrameAttachment(plain_region(where), stiffness, damping, breaks_at, at)
        )
        self._path = with_bodies(self._path, frame=frame.pose)
        return frame

    def tie(
        self,
        where: str | npt.ArrayLike,
        to: npt.ArrayLike,
        *,
        stiffness: float,
        area: float,
        toughness: float,
        damping: float = 0.0,
        rest_length: float | None = None,
        breaks_at: float = math.inf,
    ) -> DrivenFrame:
        """Tie tissue by fibres that the blade can cut, over any link; return their frame.

        The fibres end at the frame, which rests until it is moved; `n_points` is the number of
        fibres.

        Args:
            where: Where the fibres begin; as for `attach`.
            to: Where the fibres end [m], tissue frame, shape (3,), or one place for each, (n, 3).
            stiffness: Total stiffness of the fibres along them [N/m].
            area: Total cross-section of the fibres [m2].
            toughness: Energy of cutting a fibre [J/m2].
            damping: Total damping of the fibres along them [N s/m].
            rest_length: Length up to which each is slack [m]; None: the distance of its ends now.
            breaks_at: Total force of the fibres at which they break [N].

        Raises:
            ValueError: see `tissue.Tissue.tie`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        ends = finite(np.atleast_2d(np.asarray(to)), (None, 3), "where fibres end")
        of_fibres = (stiffness, area, toughness, damping, rest_length, breaks_at)
        frame = self._driven.tie(FrameTie(plain_region(where), ends, *of_fibres))
        self._path = with_bodies(self._path, frame=frame.pose)
        return frame

    def release(self, frame: DrivenFrame) -> None:
        """Release what a frame is attached to; again it does nothing.

        Raises:
            ValueError: it is none of this bridge.
            LinkError: the tissue is in another process, and did not answer.
        """
        self._query.wait()
        self._driven.release(frame)

    def collide_with(self, geoms: Sequence[Geom], poses: GeomPoses) -> DrivenContact:
        """Replace the rigid geoms that the tissue touches, over any link; return the contact.

        The contact is moved in each step. What the tissue's own scene had it touch, such as a
        table, must be among the geoms.

        Args:
            geoms: What the tissue can touch from now on.
            poses: Where they are; tissue frame.

        Raises:
            ValueError: see `tissue.Tissue.collide_with`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        contact = self._driven.collide_with(geoms, poses, answer_is_due=self._query.is_pending)
        self._path = with_bodies(self._path, geoms=contact.poses)
        return contact

    def snapshot(self) -> Snapshot:
        """Return the whole state of the tissue, after its last answer; tissue frame.

        Raises:
            LinkError: the tissue is in another process, and did not answer.
        """
        self._query.wait()
        return self._link.snapshot()

    @property
    def frame_loads(self) -> Sequence[FrameLoad]:
        """Load on each frame that acts on the tissue, in its last answer; tissue frame.

        First come those of the tissue's own scene, then the driven ones.
        """
        return self._driven.loads

    @property
    def frame(self) -> TissueFrame:
        """Pose of the tissue in the world."""
        return self._frame

    @property
    def wrench_raw(self) -> Wrench:
        """The tissue's last wrench before any limit, in the world."""
        if self._raw_is_felt or self._arm is None:
            return self._felt
        return self._frame.numbers_to_world(self._raw, self._arm.tip)

    @property
    def counters(self) -> Counters:
        """Counts of frames, answers and limits since the start."""
        of_tissue = (self._n_frames, self._n_answers, self._n_rejected)
        return Counters.of(*of_tissue, self._coupling, self._prediction.impulse_written_off)

    def _advance(self, arm: Pose, dt: float) -> Six:
        """Advance the tissue by this frame, where it answers in each, and return its wrench."""
        before, engaged = self._queried_at or arm, self._engaged()
        driven = self._driven.poses
        try:
            touches, self.touching = self._broad_phase.overlaps(before, arm, dt, engaged=engaged)
            self._n_rejected += not touches
            sweep = BladeSweep(before.segment, arm.segment) if touches else None
            result = self._query.step(sweep, dt, driven)
            self._queried_at = arm
            if self._driven.are_loaded:
                self._driven.take(loads_over(self._link), result)
        except BaseException:
            self._path.append(PathPart(arm, dt, driven))  # the next frame does both
            raise
        self._take(result, dt)
        self.answered = True
        return _about_tip(result)

    def _consult(self, arm: Pose, dt: float) -> Six:
        """Query the tissue where that is due, and return its wrench, or what it may be by now."""
        blade, balanced = self._prediction.follow(arm, dt)
        self._path.append(PathPart(blade, dt, self._driven.poses))
        query = self._query
        is_due = self._queried_at is None or len(self._path) >= self._tissue_every
        if is_due and not query.is_pending:
            self._start_query()
        answer = query.take_answer()
        if answer is not None:
            self._process(answer)
        self.answered = answer is not None
        self._silence = self._silence + dt if query.is_pending else 0.0
        raw = self._wrench_on(arm, dt) if balanced is None else balanced
        if not self._is_direct:
            self._prediction.record_felt(raw, blade.segment, dt)
        return raw

    def _start_query(self) -> None:
        """Query the tissue to advance to the present, while the blade moves along its path."""
        blade = self._path[-1].blade
        overlaps = functools.partial(self._broad_phase.overlaps, engaged=self._engaged())
        straight = self._is_anchored_as_before and len(self._path) > 2
        found = sweeps_along(self._path, self._queried_at or blade, overlaps, straight=straight)
        self.touching = found.fixtures
        self._n_rejected += not found.touches
        self._query.start(found.parts, blade.segment)
        if not self._is_direct:
            self._prediction.end_period()
        self._queried_at, self._path = blade, []

    def _process(self, answer: TissueAnswer) -> None:
        """Update broad phase, local model and impulse from an answer."""
        result = answer.result
        self._driven.take(answer.loads, result)
        self._take(result, answer.seconds)
        if not self._is_direct:
            self._prediction.update(answer)

    def _take(self, result: StepResult, seconds: float) -> None:
        """Take a result of a step of `seconds` [s]; update the broad phase.

        Raises:
            CouplingError: a node is not finite.
        """
        box = result.box
        (ax, ay, az), (bx, by, bz) = box
        if not math.isfinite(ax + ay + az + bx + by + bz):
            raise CouplingError("the tissue's nodes are no longer finite: it has diverged")
        self._broad_phase.update_bounds(box, seconds)
        before = 0.0 if self.result is None else self.result.anchored_length
        self._is_anchored_as_before = 0.0 < result.anchored_length == before
        self.result = result
        self._n_answers += 1

    def _wrench_on(self, arm: Pose, dt: float) -> Six:
        """Return the tissue's wrench on a blade without a proxy, about its tip."""
        if self._is_direct and self.result is not None:
            return _about_tip(self.result)
        return self._prediction.wrench_on(arm.segment, dt)

    def _engaged(self) -> bool:
        """Return whether the blade holds tissue, which it may drag out of any box."""
        result = self.result
        return result is not None and (result.anchored_length > 0.0 or result.n_active > 0)


def _about_tip(result: StepResult) -> Six:
    """Return force [N] and torque about the tip [N m] of a result.

    They are zero, and about no particular point, when no blade is near.
    """
    fx, fy, fz, tx, ty, tz, _, _, _ = result.wrench.numbers
    return fx, fy, fz, tx, ty, tz
