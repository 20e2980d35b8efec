"""Collisions of the arm and its instrument: detected in each frame, counted, and logged once."""

import logging
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bridge import Collisions, Fixture, FixtureBox
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.collision_geoms import (
    TABLE_THICKNESS,
    WORLD,
    ArmParts,
    arms_of_geoms,
    tables,
)
from scalpel_sim.arm.standing import collide
from tissue import FloatArray, IntArray

FLOOR_MARGIN = 0.02
"""Width of the floor beyond the body [m]. For the tissue it is infinite, but it must not
reach the arm's base."""

CLEARANCE_SHARE = 0.9
"""Share of a clearance that the arm may use up before it is tested again. The rest is far above the
rounding of both lengths."""

_PUSH = (
    ": they push each other, and the blade may not follow its stroke. Move the stroke, or what is "
    "in its way"
)
_PASS = (
    ", and MuJoCo lets them pass through each other (contype, conaffinity), where the device would "
    "stop. Move the stroke, or let them collide"
)
"""Consequence where a pair meets."""

_log = logging.getLogger("scalpel_sim")


class CollisionMonitor:
    """Detects in each frame which parts of an arm collide with fixtures or with each other.

    MuJoCo has them push each other, and the blade may leave its way: the user gets a warning. It
    says so where nothing pushes, for a model of the user's own may let its geoms pass through each
    other, and so does a fixture that does not stand in it (`DrivenArm`).

    Of parts of two arms those are tested that the blade's instrument may collide with; what else
    of them collides is MuJoCo's answer.

    As long as the joints cannot have moved the parts as far as the clearance that was found in the
    last test (`JointReach`), nothing can collide, and nothing is tested.

    Args:
        arm: Its model's planes are fixtures too: the table.
        fixtures: What else stands in the world.

    Raises:
        ValueError: two fixtures have one name.
    """

    def __init__(self, arm: DrivenArm, fixtures: Iterable[Fixture] = ()) -> None:
        model, fixtures = arm.model, list(fixtures)
        bodies = {name: model.body(body).id for name, body in arm.fixtures.items()}
        self._arm = arm
        self._parts = ArmParts(model, arm.data, arm.blade.body_id, bodies.values())
        self._geom_of = {
            name: int(model.body_geomadr[body])
            for name, body in bodies.items()
            if model.body_geomnum[body]
        }
        """A geom of each fixture and plane that stands in the model, by its name in reports."""
        planes, taken = [], {fixture.name for fixture in fixtures}
        for geom, plane in tables(model).items():
            name = plane.name
            while name in taken:  # a plane of a user's model may be called as a fixture is
                name = f"{name} of the model"
            taken.add(name)
            planes.append(replace(plane, name=name))
            self._geom_of[name] = geom
        self._collisions = Collisions(self._parts.parts, [*planes, *fixtures])
        self._data = arm.data
        self._arm_of = arms_of_geoms(model, bodies.values())
        # The hand that leads the blade touches nothing, unless the model names it in a pair.
        touches = (model.geom_contype | model.geom_conaffinity | model.npair) != 0
        self._has_two = len(set(self._arm_of[touches].tolist()) - {WORLD}) > 1
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
        """Detect the collisions of the arm as it is now. The first one of each pair is logged.

        Those of two arms are MuJoCo's: of the last `mj_step1`.
        """
        between_arms = self._between_arms() if self._has_two and self._data.ncon else ()
        parts, collisions = self._parts, self._collisions
        if parts.remain_within(self._free_way):
            self._has_passed = True
            if between_arms or self._now:
                self._count(between_arms)
            return
        if self._has_passed:
            collisions.pass_by(*parts.before())
            self._has_passed = False
        found = collisions.colliding_pairs(parts.positions(), parts.axes())
        self._free_way = 0.0 if found else CLEARANCE_SHARE * collisions.clearance()
        parts.reach.begin()
        known = {frozenset(pair) for pair in found}
        self._count((*found, *(pair for pair in between_arms if frozenset(pair) not in known)))

    def _count(self, pairs: tuple[tuple[str, str], ...]) -> None:
        """Take the pairs of this frame, and log those that are new."""
        self._now = pairs
        for pair in pairs:
            if pair not in self._frames:
                happens = _PUSH if self._push_each_other(*pair) else _PASS
                _log.warning("at %.3f s the %s meets the %s%s", self._arm.time, *pair, happens)
            self._frames[pair] += 1

    def _between_arms(self) -> tuple[tuple[str, str], ...]:
        """Return the pairs of parts of two arms that MuJoCo has push each other now."""
        geoms: IntArray = self._data.contact.geom[: self._data.ncon]
        arms = self._arm_of[geoms]
        of_two = (arms[:, 0] != arms[:, 1]) & (arms != WORLD).all(axis=1)
        name = self._parts.names
        pairs = ((name[one], name[other]) for one, other in geoms[of_two].tolist())
        return tuple(dict.fromkeys(pairs))

    def _push_each_other(self, part: str, other: str) -> bool:
        """Whether MuJoCo has a part, and another or a fixture, push each other where they meet."""
        model, numbers = self._arm.model, self._parts.numbers
        geom = numbers[part]
        if other in numbers:
            return collide(model, geom, numbers[other])
        return other in self._geom_of and collide(model, geom, self._geom_of[other])


def floor_below(bounds: FloatArray, height: float, name: str = "floor") -> FixtureBox:
    """Return the floor that loose pieces land on, as far as it is below the body. Tissue frame.

    Args:
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
        height: Height of the upper side of the floor [m].
        name: What it is called.
    """
    low, high = bounds[:, :2]
    centre = np.array([*(0.5 * (low + high)), height - 0.5 * TABLE_THICKNESS])
    size = np.array([*(high - low + 2.0 * FLOOR_MARGIN), TABLE_THICKNESS])
    return FixtureBox(name, size, centre)
