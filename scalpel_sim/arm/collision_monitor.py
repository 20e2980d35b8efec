"""Collisions of the arm and its instrument: detected in each frame, counted, and logged once."""

import logging
from collections import Counter
from collections.abc import Iterable

import numpy as np

from bridge import Collisions, Fixture, FixtureBox
from scalpel_sim.arm.collision_geoms import TABLE_THICKNESS, ArmParts, tables
from scalpel_sim.arm.led_arm import LedArm
from tissue import FloatArray

FLOOR_MARGIN = 0.02
"""How far the floor reaches beyond the body [m]. For the tissue it is infinite, but it must not
reach the arm's base."""

CLEARANCE_SHARE = 0.9
"""Share of a clearance that the arm may use up before it is tested again. The rest is far above the
rounding of both lengths."""

_log = logging.getLogger("scalpel_sim")


class CollisionMonitor:
    """Detects in each frame which parts of an arm collide with fixtures or with each other.

    Nothing pushes back where they collide, for neither MuJoCo nor the tissue knows of it: such a
    run is not what the device would do, so its user gets a warning.

    As long as the joints cannot have moved the parts as far as the clearance that was found in the
    last test (`JointReach`), nothing can collide, and nothing is tested.

    Args:
        arm: Its model's planes are fixtures too: the table.
        fixtures: What else stands in the world.

    Raises:
        ValueError: two fixtures have one name.
    """

    def __init__(self, arm: LedArm, fixtures: Iterable[Fixture] = ()) -> None:
        self._arm = arm
        self._parts = ArmParts(arm.model, arm.data, arm.blade.body_id)
        self._collisions = Collisions(self._parts.parts, [*tables(arm.model), *fixtures])
        self._free_way = 0.0
        self._has_passed = False
        self._now: tuple[tuple[str, str], ...] = ()
        self._frames: Counter[tuple[str, str]] = Counter()

    @property
    def now(self) -> tuple[tuple[str, str], ...]:
        """Pairs that collided in the last frame: part, and fixture or part."""
        return self._now

    @property
    def frames(self) -> dict[str, int]:
        """In how many frames each pair collided, by "PART, FIXTURE OR PART"."""
        return {", ".join(pair): n for pair, n in self._frames.items()}

    def check(self) -> None:
        """Detect the collisions of the arm as it is now. The first one of each pair is logged."""
        parts, collisions = self._parts, self._collisions
        if parts.remain_within(self._free_way):
            self._has_passed = True
            return
        if self._has_passed:
            collisions.pass_by(*parts.before())
            self._has_passed = False
        self._now = collisions.colliding_pairs(parts.positions(), parts.axes())
        self._free_way = 0.0 if self._now else CLEARANCE_SHARE * collisions.clearance()
        parts.reach.begin()
        for pair in self._now:
            if pair not in self._frames:
                _log.warning(
                    "at %.3f s the %s meets the %s, and nothing pushes back there: the device "
                    "would stop. Move the stroke, or what is in its way",
                    self._arm.time,
                    *pair,
                )
            self._frames[pair] += 1


def floor_below(bounds: FloatArray, height: float) -> FixtureBox:
    """Return the floor that loose pieces land on, as far as it is below the body. Tissue frame.

    Args:
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
        height: Height of the upper side of the floor [m].
    """
    low, high = bounds[:, :2]
    centre = np.array([*(0.5 * (low + high)), height - 0.5 * TABLE_THICKNESS])
    size = np.array([*(high - low + 2.0 * FLOOR_MARGIN), TABLE_THICKNESS])
    return FixtureBox("floor", size, centre)
