"""One call per frame: a blade segment in the world goes in, a wrench in the world comes out."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bridge.arithmetic import PLAIN, Six, compiled_arithmetic
from bridge.collision.broad_phase import BroadPhase
from bridge.collision.fixtures import Fixture
from bridge.counters import Counters
from bridge.coupling.coupling import Coupling, CouplingError, expect_plausible_motion
from bridge.coupling.driven_bodies import DrivenBodies, loads_over
from bridge.coupling.driving import Driving, PathPart
from bridge.coupling.limits import DeviceLimits
from bridge.coupling.local_model import MAX_FRAMES_PER_ANSWER, ImpulseCompensation, LocalModel
from bridge.coupling.passivity import Travel
from bridge.coupling.query import Query, TimedSweep, TissueAnswer
from bridge.coupling.virtual_coupling import Proxy, VirtualCoupling
from bridge.frames import TissueFrame
from bridge.link import InProcessLink, TissueLink, link_to
from bridge.poses import Pose, checked_pose, pose_of, six
from tissue import BladeSegment, BladeSweep, FloatArray, StepResult, Wrench

if TYPE_CHECKING:  # the side without the tissue starts without its compiler
    from tissue import Tissue


class Bridge(Driving):
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
        self._model = LocalModel(tissue_yields=coupling is None)
        self._impulse = ImpulseCompensation()
        self._correction = np.zeros(6)
        self._virtual = coupling
        self._proxy: Proxy | None = None
        self._tissue_every = tissue_every
        # With an answer in each frame the model has nothing to add to the answer itself.
        self._is_direct = waits and tissue_every == 1 and coupling is None
        self._arm: Pose | None = None
        self._queried_at: Pose | None = None
        self._path: list[PathPart] = []
        self._result: StepResult | None = None
        self._raw: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._felt = frame.wrench_to_world(Wrench(np.zeros(3), np.zeros(3), np.zeros(3)))
        self._raw_is_felt = True
        self._touching: tuple[str, ...] = ()
        self._answered = False
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
        arithmetic, before = self._arithmetic, self._arm
        arm = checked_pose(self._frame.segment_to_tissue(segment), segment, arithmetic)
        before = arm if before is None else before
        arm_motion = arithmetic.motion.call(before.tip, before.axes, arm.tip, arm.axes)
        expect_plausible_motion(arm_motion, dt)
        self._arm = arm
        self._n_frames += 1
        if self._is_direct and not self._path:
            raw = self._advance(arm, dt)
        else:
            raw = self._consult(arm, dt)
        work = 0.0 if self._result is None else self._result.work_of_blade
        travel = Travel(arm_motion, 0.5 * arm.length, work)
        self._raw, self._raw_is_felt = raw, False
        felt = self._coupling.felt(raw, arm.tip, dt, travel, self._silence)
        self._raw_is_felt = felt is raw
        self._felt = self._frame.numbers_to_world(felt, arm.tip)
        return self._felt

    @property
    def frame(self) -> TissueFrame:
        """Pose of the tissue in the world."""
        return self._frame

    @property
    def result(self) -> StepResult | None:
        """The tissue's last answer, in the tissue frame; None before the first one."""
        return self._result

    @property
    def answered(self) -> bool:
        """Whether the tissue answered in the last step, so that `result` is new."""
        return self._answered

    @property
    def missing_impulse(self) -> FloatArray:
        """Impulse of the tissue that the arm has not felt yet [N s], tissue frame, shape (3,).

        Zero where the tissue is queried in each frame: the arm feels exactly the tissue's impulse.
        """
        return self._impulse.missing[:3]

    @property
    def wrench_raw(self) -> Wrench:
        """The tissue's last wrench before any limit, in the world."""
        if self._raw_is_felt or self._arm is None:
            return self._felt
        return self._frame.numbers_to_world(self._raw, self._arm.tip)

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the fixtures that the blade's swept box touched at the last query."""
        return self._touching

    @property
    def counters(self) -> Counters:
        """Counts of frames, answers and limits since the start."""
        coupling = self._coupling
        return Counters(
            self._n_frames,
            self._n_answers,
            self._n_rejected,
            coupling.n_force_limited,
            coupling.n_torque_limited,
            coupling.n_slew_limited,
            coupling.n_not_finite,
            coupling.n_implausible,
            coupling.n_silent,
            coupling.n_faded,
            coupling.passivity,
            self._impulse.written_off,
        )

    def _advance(self, arm: Pose, dt: float) -> Six:
        """Advance the tissue by this frame, where it answers in each, and return its wrench."""
        before = self._queried_at or arm
        driven = self._driven.poses
        # It stays where a link fails: the next frame then does both.
        self._path.append(PathPart(arm, dt, driven))
        touches, self._touching = self._broad_phase.overlaps(
            before, arm, dt, engaged=self._engaged()
        )
        self._n_rejected += not touches
        sweep = BladeSweep(before.segment, arm.segment) if touches else None
        result = self._query.step(sweep, dt, driven)
        self._queried_at = arm
        self._driven.take(loads_over(self._link), result)
        self._path.clear()
        self._take(result, dt)
        self._answered = True
        # The wrench is zero, and about no particular point, when no blade is near.
        fx, fy, fz, tx, ty, tz, _, _, _ = result.wrench.numbers
        return fx, fy, fz, tx, ty, tz

    def _consult(self, arm: Pose, dt: float) -> Six:
        """Query the tissue where that is due, and return its wrench, or what it may be by now."""
        balanced = None if self._virtual is None else self._follow(self._virtual, arm, dt)
        blade = arm if self._proxy is None else pose_of(self._proxy.pose)
        self._path.append(PathPart(blade, dt, self._driven.poses))
        query = self._query
        is_due = self._queried_at is None or len(self._path) >= self._tissue_every
        if is_due and not query.is_pending:
            self._start_query()
        answer = query.take_answer()
        if answer is not None:
            self._process(answer)
        self._answered = answer is not None
        self._silence = self._silence + dt if query.is_pending else 0.0
        raw = self._wrench_on(arm, dt) if balanced is None else balanced
        if not self._is_direct:
            self._impulse.record_felt(np.array(raw) - self._correction, blade.segment, dt)
        return raw

    def _follow(self, coupling: VirtualCoupling, arm: Pose, dt: float) -> Six:
        """Move the proxy after the arm, and return the tissue's wrench on both."""
        if self._proxy is None:
            self._proxy = Proxy(coupling, dt, arm.segment)
        proxy, model = self._proxy, self._model
        wrench = model.wrench(proxy.pose)
        self._correction = self._impulse.correction(wrench, proxy.pose, dt)
        return six(proxy.follow(arm.segment, wrench + self._correction, model.stiffness, dt))

    def _start_query(self) -> None:
        """Query the tissue to advance to the present, while the blade moves along its path.

        A blade that already holds tissue moves on a straight line, except in the last frame: the
        wrench at one instant is noise, and the mean over a frame is felt. A blade that does not
        hold tissue may run into it: it moves as the arm did, frame by frame, or the tissue would
        find it deep inside.
        """
        path = self._path
        blade, engaged = path[-1].blade, self._engaged()
        before = self._queried_at or blade
        overlaps = self._broad_phase.overlaps
        if len(path) == 1:
            seconds = path[0].seconds
            touches, self._touching = overlaps(before, blade, seconds, engaged=engaged)
            sweep = BladeSweep(before.segment, blade.segment) if touches else None
            parts = [TimedSweep(sweep, seconds, path[0].driven)]
        else:
            seconds = sum(part.seconds for part in path)
            if self._is_anchored_as_before and len(path) > 2:
                path = [path[-2]._replace(seconds=seconds - path[-1].seconds), path[-1]]
            pairs = list(pairwise([before, *(part.blade for part in path)]))
            found = [overlaps(*pair, seconds, engaged=engaged) for pair in pairs]
            self._touching = tuple(dict.fromkeys(name for one in found for name in one.fixtures))
            touches = any(one.tissue for one in found)
            parts = [
                TimedSweep(BladeSweep(t0.segment, t1.segment), part.seconds, part.driven)
                for (t0, t1), part in zip(pairs, path, strict=True)
            ]
            if not touches:
                parts = [TimedSweep(None, seconds, path[-1].driven)]
        self._n_rejected += not touches
        self._query.start(parts, blade.segment)
        if not self._is_direct:
            self._impulse.end_period()
        self._queried_at, self._path = blade, []

    def _process(self, answer: TissueAnswer) -> None:
        """Update broad phase, local model and impulse from an answer."""
        result = answer.result
        self._driven.take(answer.loads, result)
        self._take(result, answer.seconds)
        if not self._is_direct:
            self._model.update(result, answer.last_wrench, answer.middle_pose)
            in_contact = self._model.in_contact
            self._impulse.compare(result.wrench, answer.seconds, in_contact=in_contact)

    def _take(self, result: StepResult, seconds: float) -> None:
        """Take a result of a step of `seconds` [s]; update the broad phase.

        Raises:
            CouplingError: a node is not finite.
        """
        low, high = result.bounds.tolist()
        if not math.isfinite(sum(low) + sum(high)):
            raise CouplingError("the tissue's nodes are no longer finite: it has diverged")
        self._broad_phase.update_bounds((low, high), seconds)
        before = 0.0 if self._result is None else self._result.anchored_length
        self._is_anchored_as_before = 0.0 < result.anchored_length == before
        self._result = result
        self._n_answers += 1

    def _wrench_on(self, arm: Pose, dt: float) -> Six:
        """Return the tissue's wrench on a blade without a proxy, about its tip."""
        if self._is_direct and self._result is not None:
            # The wrench is zero, and about no particular point, when no blade is near.
            fx, fy, fz, tx, ty, tz, _, _, _ = self._result.wrench.numbers
            return fx, fy, fz, tx, ty, tz
        wrench = self._model.wrench(arm.segment)
        self._correction = self._impulse.correction(wrench, arm.segment, dt)
        return six(wrench + self._correction)

    def _engaged(self) -> bool:
        """Return whether the blade holds tissue, which it may drag out of any box."""
        result = self._result
        return result is not None and (result.anchored_length > 0.0 or result.n_active > 0)
