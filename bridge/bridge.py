"""One call per frame: a blade segment in the world goes in, a wrench in the world comes out."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from bridge.broad_phase import BroadPhase
from bridge.coupling import Coupling, CouplingError, DeviceLimits
from bridge.fixtures import Fixture
from bridge.frames import TissueFrame
from bridge.link import TissueLink
from tissue.types import BladeSegment, BladeSweep, StepResult, Wrench

SHORTEST_EDGE = 1e-6
"""[m]. A shorter cutting edge has no direction that a swept box could be aligned with."""

LARGEST_COSINE = 0.99
"""Of the angle between `forward` and the edge. `forward` should be across the edge (0); nearer than
eight degrees to it, the plane of the blade is a matter of rounding."""


UNIT_TOLERANCE = 1e-6
"""How far the length of `forward` may be from 1: what single precision leaves."""


class Counters(NamedTuple):
    """What happened since the start, in frames."""

    frames: int
    """Calls of `Bridge.step`."""
    rejected: int
    """The broad phase saw that the blade could not touch the tissue."""
    force_limited: int
    """The force was above the device's limit."""
    torque_limited: int
    """The torque was above the device's limit."""
    slew_limited: int
    """The force changed faster than the device can."""
    not_finite: int
    """The tissue answered with a NaN or an infinity."""
    absurd: int
    """The tissue answered with a wrench that only a simulation that blows up gives."""


class Bridge:
    """Carries the blade's motion to the tissue and the tissue's wrench back.

    Args:
        link: The tissue, here or in another process. Whoever made it closes it.
        frame: Where the tissue lies in the world.
        limits: What the haptic device can exert; None for a device without limits.
        fixtures: What else the blade may meet, in the world; see `touching`.

    Raises:
        ValueError: two fixtures have one name.
    """

    def __init__(
        self,
        link: TissueLink,
        frame: TissueFrame = TissueFrame(),
        limits: DeviceLimits | None = None,
        fixtures: Iterable[Fixture] = (),
    ) -> None:
        self._link = link
        self._frame = frame
        self._coupling = Coupling(limits or DeviceLimits())
        tissue = link.describe()
        self._broad_phase = BroadPhase(
            tissue.bounds,
            tissue.material.wave_speed,
            map(frame.fixture_to_tissue, fixtures),
            blade=tissue.blade,
            chunks=link.chunks,
        )
        self._segment: BladeSegment | None = None
        self._result: StepResult | None = None
        self._wrench_raw = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))
        self._touching: tuple[str, ...] = ()
        self._n_frames = 0
        self._n_rejected = 0

    def step(self, segment: BladeSegment, dt: float) -> Wrench:
        """Let the tissue live through `dt` [s] while the blade moves here from where it was.

        In the first call the blade has not moved.

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
        _check(segment, dt)
        after = self._frame.segment_to_tissue(segment)
        sweep = BladeSweep(self._segment or after, after)
        contacts = self._broad_phase.contacts(sweep, dt, engaged=self._engaged())
        near = contacts.tissue
        result = self._link.step(sweep if near else None, dt)
        if not np.isfinite(result.bounds).all():
            raise CouplingError("the tissue's nodes are no longer finite: it has diverged")
        self._broad_phase.tissue_moved(result.bounds, dt)
        self._segment, self._result, self._touching = after, result, contacts.fixtures
        self._n_frames += 1
        self._n_rejected += not near
        # Without a blade the tissue's wrench is zero, and at no particular point; what a slew limit
        # still lets go of acts at the tip all the same.
        wrench = result.wrench if near else result.wrench._replace(point=after.tip)
        self._wrench_raw = self._frame.wrench_to_world(wrench)
        return self._coupling.felt(self._wrench_raw, dt)

    @property
    def result(self) -> StepResult | None:
        """What the tissue said in the last step, in the tissue frame; None before the first."""
        return self._result

    @property
    def wrench_raw(self) -> Wrench:
        """The tissue's last wrench before any limit, in the world."""
        return self._wrench_raw

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the fixtures that the blade's swept box met in the last step."""
        return self._touching

    @property
    def counters(self) -> Counters:
        """What happened since the start."""
        return Counters(
            self._n_frames,
            self._n_rejected,
            self._coupling.n_force_limited,
            self._coupling.n_torque_limited,
            self._coupling.n_slew_limited,
            self._coupling.n_not_finite,
            self._coupling.n_absurd,
        )

    def _engaged(self) -> bool:
        """Whether the blade holds tissue: it may drag it along, out of any box."""
        result = self._result
        return result is not None and (result.anchored_length > 0.0 or result.n_active > 0)


def _check(segment: BladeSegment, dt: float) -> None:
    """Refuse what no arm in its senses sends.

    Raises:
        ValueError: it did.
    """
    if not (dt > 0.0 and math.isfinite(dt)):
        raise ValueError(f"the frame lasts {dt} s; it must be positive and finite")
    if not math.isfinite(segment.tip.sum() + segment.heel.sum() + segment.forward.sum()):
        raise ValueError(f"the blade's pose is not finite: {segment}")
    edge = segment.tip - segment.heel
    length = math.hypot(*edge.tolist())
    if length < SHORTEST_EDGE:
        raise ValueError(f"the cutting edge is {length} m long; at least {SHORTEST_EDGE} m")
    forward_length = math.hypot(*segment.forward.tolist())
    if abs(forward_length - 1.0) > UNIT_TOLERANCE:
        raise ValueError(f"forward must be a unit vector; its length is {forward_length}")
    cosine = abs(float(edge @ segment.forward)) / length
    if cosine > LARGEST_COSINE:
        raise ValueError(
            f"forward must be across the edge; they are {math.degrees(math.acos(cosine)):.2g} "
            "degrees apart"
        )
