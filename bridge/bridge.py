"""One call per frame: a blade segment in the world goes in, a wrench in the world comes out."""

import math
from collections.abc import Iterable

import numpy as np

from bridge.collision.broad_phase import BroadPhase
from bridge.collision.fixtures import Fixture
from bridge.counters import Counters
from bridge.coupling.coupling import Coupling, CouplingError, DeviceLimits
from bridge.coupling.impulse import ImpulseDebt
from bridge.coupling.local_model import MOST_FRAMES_PER_ANSWER, LocalModel
from bridge.coupling.passivity import Travel
from bridge.coupling.query import Answer, Inquiry, Leg
from bridge.coupling.virtual_coupling import Proxy, VirtualCoupling
from bridge.frames import TissueFrame
from bridge.link import TissueLink
from bridge.poses import check_pose, half_length, motion
from tissue import BladeSegment, BladeSweep, FloatArray, StepResult, Wrench


class Bridge:
    """Carries the blade's motion to the tissue and the tissue's wrench back.

    By default the tissue is asked in each frame, and the arm feels in the next one the wrench
    averaged over it: the impulse on the arm is that on the tissue, to the last bit, and the same
    blade path does the same work on both sides. Where the tissue is asked only every few frames,
    its last wrench and its local stiffness answer in between: see `LocalModel`.

    Args:
        link: The tissue, here or in another process. Whoever made it closes it.
        frame: Where the tissue lies in the world.
        limits: What the haptic device can exert; None for a device without limits.
        fixtures: What else the blade may meet, in the world; see `touching`.
        tissue_every: Frames in which the tissue is asked once, for all of them.
        coupling: Between the arm's blade and the one that cuts; None where they are one.
        passivity: Whether what would give the arm energy out of nothing is damped. It is counted
            in either case.
        waits: Whether a frame waits for the tissue. Otherwise the arm goes on by what the tissue
            said last, and feels less of it the longer the tissue is silent: for a device that must
            be served in time. Such a run is not the same twice.

    Raises:
        ValueError: two fixtures have one name, or `tissue_every` is no number of frames.
    """

    def __init__(
        self,
        link: TissueLink,
        frame: TissueFrame = TissueFrame(),
        limits: DeviceLimits | None = None,
        fixtures: Iterable[Fixture] = (),
        *,
        tissue_every: int = 1,
        coupling: VirtualCoupling | None = None,
        passivity: bool = True,
        waits: bool = True,
    ) -> None:
        if not (tissue_every == int(tissue_every) and 1 <= tissue_every <= MOST_FRAMES_PER_ANSWER):
            raise ValueError(
                f"the tissue is to be asked every {tissue_every} frames; it must be a whole number "
                f"from 1 to {MOST_FRAMES_PER_ANSWER}"
            )
        self._frame = frame
        self._coupling = Coupling(limits or DeviceLimits(), passivity=passivity)
        tissue = link.describe()
        self._broad_phase = BroadPhase(
            tissue.bounds,
            tissue.material.wave_speed,
            map(frame.fixture_to_tissue, fixtures),
            blade=tissue.blade,
            chunks=link.chunks if waits else None,  # to ask for them is to wait
        )
        self._inquiry = Inquiry(link, waits)
        self._model = LocalModel(gives_way=coupling is None)
        self._debt = ImpulseDebt()
        self._back = np.zeros(6)
        self._virtual = coupling
        self._proxy: Proxy | None = None
        self._tissue_every = tissue_every
        # Nothing is between two answers, so the model has nothing to add to the answer itself.
        self._is_direct = waits and tissue_every == 1 and coupling is None
        self._segment: BladeSegment | None = None
        self._asked_at: BladeSegment | None = None
        self._way: list[tuple[BladeSegment, float]] = []
        self._result: StepResult | None = None
        self._wrench_raw = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))
        self._touching: tuple[str, ...] = ()
        self._answered = False
        self._holds_as_much = False
        self._silence = 0.0
        self._n_frames = 0
        self._n_answers = 0
        self._n_rejected = 0

    def step(self, segment: BladeSegment, dt: float) -> Wrench:
        """Let the tissue live through `dt` [s] while the blade moves here from where it was.

        In the first call the blade has not moved. The tissue is asked in the first call, and then
        in every `tissue_every`-th one.

        Args:
            segment: The cutting edge at the end of the frame, in the world.
            dt: Length of the frame [s].

        Returns:
            What the arm feels, in the world, within the device's limits; its point is the tip.

        Raises:
            ValueError: the segment is not finite or has no plane, or `dt` is not positive.
            CouplingError: the tissue has diverged. Take the last wrench off the arm: it is stale.
            LinkError: the tissue is in another process and did not answer; the same holds.
        """
        if not (dt > 0.0 and math.isfinite(dt)):
            raise ValueError(f"the frame lasts {dt} s; it must be positive and finite")
        check_pose(segment)
        arm = self._frame.segment_to_tissue(segment)
        way = motion(self._segment or arm, arm)
        self._segment = arm
        self._n_frames += 1
        led = None if self._virtual is None else self._lead(self._virtual, arm, dt)
        blade = arm if self._proxy is None else self._proxy.pose
        self._way.append((blade, dt))
        is_due = self._asked_at is None or len(self._way) >= self._tissue_every
        if is_due and not self._inquiry.is_open:
            self._ask()
        answer = self._inquiry.answer()
        if answer is not None:
            self._take(answer)
        self._answered = answer is not None
        self._silence = self._silence + dt if self._inquiry.is_open else 0.0
        raw = self._felt_of(arm, dt) if led is None else led
        if not self._is_direct:
            self._debt.felt(raw - self._back, blade, dt)
        self._wrench_raw = Wrench(raw[:3], raw[3:], arm.tip)
        work = 0.0 if self._result is None else self._result.work_of_blade
        travel = Travel(way, half_length(arm), work)
        return self._frame.wrench_to_world(
            self._coupling.felt(self._wrench_raw, dt, travel, self._silence)
        )

    @property
    def result(self) -> StepResult | None:
        """What the tissue said last, in the tissue frame; None before the first answer."""
        return self._result

    @property
    def answered(self) -> bool:
        """Whether the tissue answered in the last step, so that `result` is new."""
        return self._answered

    @property
    def owed(self) -> FloatArray:
        """Impulse that the tissue felt and the arm not yet [N s], tissue frame, shape (3,).

        Zero where the tissue is asked in each frame: the arm feels just what the tissue felt.
        """
        return self._debt.owed[:3]

    @property
    def wrench_raw(self) -> Wrench:
        """The tissue's last wrench before any limit, in the world."""
        return self._frame.wrench_to_world(self._wrench_raw)

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the fixtures that the blade's swept box met when the tissue was last asked."""
        return self._touching

    @property
    def counters(self) -> Counters:
        """What happened since the start."""
        coupling = self._coupling
        return Counters(
            self._n_frames,
            self._n_answers,
            self._n_rejected,
            coupling.n_force_limited,
            coupling.n_torque_limited,
            coupling.n_slew_limited,
            coupling.n_not_finite,
            coupling.n_absurd,
            coupling.n_silent,
            coupling.n_faded,
            coupling.passivity,
            self._debt.written_off,
        )

    def _lead(self, coupling: VirtualCoupling, arm: BladeSegment, dt: float) -> FloatArray:
        """Let the proxy follow the arm, and return what both feel of the tissue."""
        if self._proxy is None:
            self._proxy = Proxy(coupling, dt, arm)
        wrench = self._model.wrench(self._proxy.pose)
        self._back = self._debt.back(wrench, self._proxy.pose, dt)
        return self._proxy.follow(arm, wrench + self._back, self._model.stiffness, dt)

    def _ask(self) -> None:
        """Ask the tissue to live up to now, while the blade that cuts comes to where it is.

        A blade that holds tissue already goes straight there, but for the last frame: the wrench at
        one instant is noise, the mean over a frame is what is felt. One that does not hold tissue
        may meet it on the way: it goes as the arm went, frame by frame, or the tissue would find it
        deep inside.
        """
        blade = self._way[-1][0]
        seconds = sum(dt for _, dt in self._way)
        way = self._way
        if self._holds_as_much and len(way) > 2:
            way = [(way[-2][0], seconds - way[-1][1]), way[-1]]
        before, sweeps = self._asked_at or blade, []
        for pose, _ in way:
            sweeps.append(BladeSweep(before, pose))
            before = pose
        engaged = self._engaged()
        met = [self._broad_phase.contacts(sweep, seconds, engaged=engaged) for sweep in sweeps]
        self._touching = tuple(dict.fromkeys(name for one in met for name in one.fixtures))
        if any(one.tissue for one in met):
            legs = [Leg(sweep, dt) for sweep, (_, dt) in zip(sweeps, way, strict=True)]
        else:
            legs = [Leg(None, seconds)]
            self._n_rejected += 1
        self._inquiry.ask(legs, blade)
        self._debt.asked()
        self._asked_at, self._way = blade, []

    def _take(self, answer: Answer) -> None:
        """Take note of what the tissue said."""
        result = answer.result
        if not math.isfinite(sum(result.bounds.ravel().tolist())):
            raise CouplingError("the tissue's nodes are no longer finite: it has diverged")
        self._broad_phase.tissue_moved(result.bounds, answer.seconds)
        if not self._is_direct:
            self._model.answered(result, answer.last_leg, answer.middle)
            self._debt.answered(result.wrench, answer.seconds, in_contact=self._model.in_contact)
        held = 0.0 if self._result is None else self._result.anchored_length
        self._holds_as_much = 0.0 < result.anchored_length == held
        self._result = result
        self._n_answers += 1

    def _felt_of(self, arm: BladeSegment, dt: float) -> FloatArray:
        """Return the tissue's wrench on a blade without a proxy, about its tip, shape (6,)."""
        if self._is_direct and self._result is not None:
            # Without a blade near it is zero, and at no particular point.
            return np.concatenate([self._result.wrench.force, self._result.wrench.torque])
        wrench = self._model.wrench(arm)
        self._back = self._debt.back(wrench, arm, dt)
        return wrench + self._back

    def _engaged(self) -> bool:
        """Whether the blade holds tissue: it may drag it along, out of any box."""
        result = self._result
        return result is not None and (result.anchored_length > 0.0 or result.n_active > 0)
