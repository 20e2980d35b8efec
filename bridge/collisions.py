"""Which parts of an arm meet what stands around them, and where its instrument meets the arm."""

import math
from collections.abc import Iterable, Sequence

import fcl
import numpy as np

from bridge.collision_objects import MovableBox, Obstacles, fixture_objects
from bridge.fixtures import Fixture
from bridge.parts import Part
from bridge.swept_box import SweptBox, box_around
from tissue.types import FloatArray

_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


class Collisions:
    """Looks at all parts once a frame. World frame.

    A part is asked about where it is now; one that has gone farther than half of its own thickness
    since the last look, about a box around its whole way, so that it cannot pass through anything
    unseen by what stands still. Whether the blade meets the tissue is the broad phase's affair.

    Args:
        parts: Of the arm and its instrument.
        fixtures: What stands in the world.

    Raises:
        ValueError: two parts, or two fixtures, have one name.
    """

    def __init__(self, parts: Sequence[Part], fixtures: Iterable[Fixture] = ()) -> None:
        names = [part.name for part in parts]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two parts have the name {name!r}")
        self._parts = tuple(parts)
        self._shapes = [part.geometry() for part in parts]
        self._objects = [fcl.CollisionObject(shape, fcl.Transform()) for shape in self._shapes]
        self._fixtures = Obstacles(fixture_objects(list(fixtures)))
        each = list(zip(parts, self._shapes, self._objects, strict=True))
        self._links = Obstacles(
            {
                part.name: (shape, thing)
                for part, shape, thing in each
                if part.may_meet_instrument and not part.is_instrument
            }
        )
        self._half_extents = np.array([part.half_extents for part in parts]).reshape(-1, 3)
        self._reach = np.linalg.norm(self._half_extents, axis=1)
        self._half_thickness = self._half_extents.min(axis=1, initial=np.inf)
        self._positions: FloatArray | None = None
        self._axes = np.zeros((0, 3, 3))
        self._way = MovableBox()

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts, in the order in which `touching` wants their poses."""
        return self._parts

    def touching(self, positions: FloatArray, axes: FloatArray) -> tuple[tuple[str, str], ...]:
        """Return the pairs that meet, a part first and what it meets second.

        Args:
            positions: Of the parts' origins [m], shape (n_parts, 3).
            axes: Their axes as columns, shape (n_parts, 3, 3).

        Raises:
            ValueError: a shape is another, or a number is not finite.
        """
        n = len(self._parts)
        if positions.shape != (n, 3) or axes.shape != (n, 3, 3):
            raise ValueError(
                f"poses of shape {positions.shape} and {axes.shape} for {n} parts; wanted "
                f"{(n, 3)} and {(n, 3, 3)}"
            )
        if not math.isfinite(positions.sum() + axes.sum()):
            raise ValueError("the pose of a part of the arm is not finite")
        for thing, position, turned in zip(self._objects, positions, axes, strict=True):
            thing.setTransform(fcl.Transform(turned, position))
        self._links.moved()
        is_fast = self._is_fast(positions, axes)
        pairs: list[tuple[str, str]] = []
        for i, part in enumerate(self._parts):
            thing = self._objects[i]
            if is_fast[i]:
                self._way.place(self._way_of(i, positions[i], axes[i]))
                thing = self._way.object
            if part.may_meet_fixtures:
                pairs += [(part.name, other) for other in self._fixtures.met_by(thing)]
            if part.is_instrument:
                pairs += [(part.name, other) for other in self._links.met_by(thing)]
        self._positions, self._axes = positions.copy(), axes.copy()
        return tuple(pairs)

    def _is_fast(self, positions: FloatArray, axes: FloatArray) -> list[bool]:
        """Return which parts have gone farther than half of their thickness since the last look."""
        if self._positions is None:
            return [False] * len(self._parts)
        moved = np.sqrt(np.square(positions - self._positions).sum(axis=1))
        # No point of it has moved farther by turning: |R1 - R0| |x| bounds |R1 x - R0 x|.
        turned = np.sqrt(np.square(axes - self._axes).sum(axis=(1, 2))) * self._reach
        return (moved + turned > self._half_thickness).tolist()

    def _way_of(self, i: int, position: FloatArray, axes: FloatArray) -> SweptBox:
        """Return a box around a part at the last look, now, and between.

        Between two looks its corners go along arcs, of which the chords are known: one that turns
        by an angle leaves its chord by half of the chord times the tangent of a quarter of it.
        """
        assert self._positions is not None
        local = _CORNERS * self._half_extents[i]
        before = self._positions[i] + local @ self._axes[i].T
        now = position + local @ axes.T
        cosine = 0.5 * (np.trace(self._axes[i].T @ axes) - 1.0)
        angle = float(np.arccos(min(max(cosine, -1.0), 1.0)))
        chord = float(np.linalg.norm(now - before, axis=1).max())
        return box_around(
            np.concatenate((before, now)), axes, 0.5 * chord * float(np.tan(0.25 * angle))
        )
