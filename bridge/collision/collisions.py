"""Which parts of an arm meet what stands around them, and where its instrument meets the arm."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import fcl
import numpy as np

from bridge.collision.arm_geoms import Part
from bridge.collision.collision_objects import MovableBox, fixture_objects, meet
from bridge.collision.fixtures import Fixture, bounds_of
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox, box_around
from tissue import BoolArray, FloatArray

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
        standing = list(fixtures)
        self._fixtures = fixture_objects(standing)
        self._half_extents = np.array([part.half_extents for part in parts]).reshape(-1, 3)
        self._reach = np.linalg.norm(self._half_extents, axis=1)
        self._half_thickness = self._half_extents.min(axis=1, initial=np.inf)
        self._positions: FloatArray | None = None
        self._axes = np.zeros((0, 3, 3))
        self._way = MovableBox()
        self._pairs = self._possible_pairs()
        self._first = np.array([pair.part for pair in self._pairs], np.int64)
        self._second = np.array([pair.other for pair in self._pairs], np.int64)
        bounds = [bounds_of(fixture) for fixture in standing]
        self._boxes = np.zeros((len(self._parts) + len(standing), 2, 3))
        if bounds:
            self._boxes[len(self._parts) :] = bounds

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
        is_fast = self._is_fast(positions, axes)
        met = []
        for k in self._near(positions, axes, is_fast):
            i, other = self._pairs[k].part, self._pairs[k].other
            for part in (i, other):
                if part < n:
                    self._objects[part].setTransform(fcl.Transform(axes[part], positions[part]))
            thing = self._objects[i]
            if is_fast[i]:
                self._way.place(self._way_of(i, positions[i], axes[i]))
                thing = self._way.object
            if meet(thing, self._pairs[k].object):
                met.append((self._parts[i].name, self._pairs[k].name))
        self._positions, self._axes = positions.copy(), axes.copy()
        return tuple(met)

    def _possible_pairs(self) -> list["_Pair"]:
        """Return all pairs that it would be news of if they met."""
        links = [
            (j, part)
            for j, part in enumerate(self._parts)
            if part.may_meet_instrument and not part.is_instrument
        ]
        pairs = []
        for i, part in enumerate(self._parts):
            if part.may_meet_fixtures:
                for j, (name, (_, thing)) in enumerate(self._fixtures.items(), len(self._parts)):
                    pairs.append(_Pair(i, j, name, thing))
            if part.is_instrument:
                pairs += [_Pair(i, j, link.name, self._objects[j]) for j, link in links]
        return pairs

    def _near(self, positions: FloatArray, axes: FloatArray, is_fast: BoolArray) -> list[int]:
        """Return the pairs whose boxes along the world's axes meet, and those of fast parts.

        Nearly all are apart, and to ask the library about each took longer than a step of a small
        body.
        """
        n = len(self._parts)
        half = (np.abs(axes) @ self._half_extents[:, :, None])[:, :, 0] + TOUCHING_MARGIN
        self._boxes[:n, 0] = positions - half
        self._boxes[:n, 1] = positions + half
        low, high = self._boxes[:, 0], self._boxes[:, 1]
        first, second = self._first, self._second
        apart = (low[first] > high[second]) | (low[second] > high[first])
        return np.flatnonzero(~apart.any(axis=1) | is_fast[first]).tolist()

    def _is_fast(self, positions: FloatArray, axes: FloatArray) -> BoolArray:
        """Return which parts have gone farther than half of their thickness since the last look."""
        if self._positions is None:
            return np.zeros(len(self._parts), np.bool_)
        moved = np.sqrt(np.square(positions - self._positions).sum(axis=1))
        # No point of it has moved farther by turning: |R1 - R0| |x| bounds |R1 x - R0 x|.
        turned = np.sqrt(np.square(axes - self._axes).sum(axis=(1, 2))) * self._reach
        return moved + turned > self._half_thickness

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


class _Pair(NamedTuple):
    """A part, and what it may meet."""

    part: int
    other: int
    """A part's number; that of a fixture, after all parts."""
    name: str
    """Of the other."""
    object: fcl.CollisionObject
    """The other."""
