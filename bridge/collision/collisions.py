"""Collisions of an arm's geoms with fixtures, and of its instrument with the arm itself.

The geoms are simple shapes: those of the arm's bodies, of the handle and of the blade.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import fcl
import numpy as np

from bridge.collision.collision_objects import MovableBox, are_colliding, fixture_objects
from bridge.collision.fixtures import Fixture, FixtureBox, bounds_of
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox, box_around, gap_between
from tissue import BoolArray, FloatArray, Geom

GeomShape = Literal["box", "sphere", "capsule", "cylinder"]

SIZES_PER_SHAPE = {"box": 3, "sphere": 1, "capsule": 2, "cylinder": 2}
"""Number of sizes of each shape."""


@dataclass(frozen=True)
class ArmGeom:
    """A rigid body of one simple shape, centred on its own origin: a geom in MuJoCo's words.

    Raises:
        ValueError: the shape is unknown, or a size is missing or not positive.
    """

    name: str
    """Name of the geom, in reports."""
    shape: GeomShape
    """Shape of the geom."""
    sizes: tuple[float, ...]
    """Sizes [m], in MuJoCo's order: half the lengths of a box; the radius of a sphere; the radius
    and half the length along z, without the caps, of a capsule or cylinder."""
    is_instrument: bool = False
    """Whether the geom belongs to the blade or its handle, which must not touch the arm either."""
    checked_against_instrument: bool = True
    """Whether a collision with the instrument is reported: False next to it, where geoms always
    overlap."""
    checked_against_fixtures: bool = True
    """Whether a collision with a fixture is reported: False for a geom that stands on one."""

    def __post_init__(self) -> None:
        if self.shape not in get_args(GeomShape):
            raise ValueError(
                f"geom {self.name!r} is a {self.shape!r}; wanted one of "
                f"{', '.join(get_args(GeomShape))}"
            )
        if len(self.sizes) != SIZES_PER_SHAPE[self.shape] or not all(
            math.isfinite(size) and size > 0.0 for size in self.sizes
        ):
            raise ValueError(
                f"geom {self.name!r} has the sizes {self.sizes} m; a {self.shape} has "
                f"{SIZES_PER_SHAPE[self.shape]}, all positive"
            )

    @property
    def half_extents(self) -> FloatArray:
        """Half the size of the geom's bounding box along its own axes [m], shape (3,)."""
        _, half = Geom(self.name, self.shape, self.sizes).box()
        return half

    def geometry(self) -> fcl.CollisionGeometry:
        """Return a new geometry of the collision library."""
        if self.shape == "box":
            return fcl.Box(*(2.0 * size for size in self.sizes))
        if self.shape == "sphere":
            return fcl.Sphere(self.sizes[0])
        make = fcl.Capsule if self.shape == "capsule" else fcl.Cylinder
        return make(self.sizes[0], 2.0 * self.sizes[1])


_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


class Collisions:
    """Tests all geoms of an arm once a frame. World frame.

    A geom is tested where it is now; one that has moved farther than half of its own thickness
    since the last frame, by a box around its whole path, so that it cannot tunnel through a
    fixture. Whether the blade touches the tissue is decided by the broad phase.

    Args:
        geoms: Geoms of the arm and its instrument.
        fixtures: Obstacles in the world.

    Raises:
        ValueError: two geoms, or two fixtures, have one name.
    """

    def __init__(self, geoms: Sequence[ArmGeom], fixtures: Iterable[Fixture] = ()) -> None:
        names = [geom.name for geom in geoms]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two geoms have the name {name!r}")
        self._geoms = tuple(geoms)
        self._shapes = [geom.geometry() for geom in geoms]
        self._objects = [fcl.CollisionObject(shape, fcl.Transform()) for shape in self._shapes]
        obstacles = list(fixtures)
        self._fixtures = fixture_objects(obstacles)
        self._half_extents = np.array([geom.half_extents for geom in geoms]).reshape(-1, 3)
        self._reach = np.linalg.norm(self._half_extents, axis=1)
        self._half_thickness = self._half_extents.min(axis=1, initial=np.inf)
        self._positions: FloatArray | None = None
        self._axes = np.zeros((0, 3, 3))
        self._fixture_boxes = [_oriented_box(fixture) for fixture in obstacles]
        self._swept = MovableBox()
        self._pairs = self._possible_pairs()
        self._first = np.array([pair.geom for pair in self._pairs], np.int64)
        self._second = np.array([pair.other for pair in self._pairs], np.int64)
        bounds = [bounds_of(fixture) for fixture in obstacles]
        self._boxes = np.zeros((len(self._geoms) + len(obstacles), 2, 3))
        if bounds:
            self._boxes[len(self._geoms) :] = bounds

    @property
    def geoms(self) -> tuple[ArmGeom, ...]:
        """The geoms, in the order in which `colliding_pairs` expects their poses."""
        return self._geoms

    def colliding_pairs(
        self, positions: FloatArray, axes: FloatArray
    ) -> tuple[tuple[str, str], ...]:
        """Return the names of each pair that collides, a geom first and the other object second.

        Args:
            positions: Origins of the geoms [m], shape (n_geoms, 3).
            axes: Axes of the geoms as columns, shape (n_geoms, 3, 3).

        Raises:
            ValueError: an array has a wrong shape, or a number is not finite.
        """
        n = len(self._geoms)
        if positions.shape != (n, 3) or axes.shape != (n, 3, 3):
            raise ValueError(
                f"poses of shape {positions.shape} and {axes.shape} for {n} geoms; wanted "
                f"{(n, 3)} and {(n, 3, 3)}"
            )
        if not math.isfinite(positions.sum() + axes.sum()):
            raise ValueError("the pose of a geom of the arm is not finite")
        is_fast = self._is_fast(positions, axes)
        found = []
        for k in self._near(positions, axes, is_fast):
            i, other = self._pairs[k].geom, self._pairs[k].other
            for geom in (i, other):
                if geom < n:
                    self._objects[geom].setTransform(fcl.Transform(axes[geom], positions[geom]))
            tested = self._objects[i]
            if is_fast[i]:
                self._swept.place(self._swept_box(i, positions[i], axes[i]))
                tested = self._swept.object
            if are_colliding(tested, self._pairs[k].object):
                found.append((self._geoms[i].name, self._pairs[k].name))
        self.pass_by(positions, axes)
        return tuple(found)

    def pass_by(self, positions: FloatArray, axes: FloatArray) -> None:
        """Take the poses of a frame in which nothing can collide, instead of testing them.

        Args:
            positions: Origins of the geoms [m], shape (n_geoms, 3).
            axes: Axes of the geoms as columns, shape (n_geoms, 3, 3).
        """
        self._positions, self._axes = positions.copy(), axes.copy()

    def clearance(self) -> float:
        """Return a distance [m] that no pair came nearer than in the poses that were tested last.

        It is that of bounding boxes, by `gap_between`, so zero does not mean that a pair collides.
        """
        assert self._positions is not None
        first, second, boxes = self._first, self._second, self._boxes
        gaps = np.maximum(boxes[first, 0] - boxes[second, 1], boxes[second, 0] - boxes[first, 1])
        distances = np.sqrt(np.square(np.maximum(gaps, 0.0)).sum(axis=1))
        # Boxes along the world's axes are larger than those along the geoms' own.
        for k in np.flatnonzero(distances == 0.0).tolist():
            pair = self._pairs[k]
            distances[k] = gap_between(self._box(pair.geom), self._box(pair.other))
        return float(distances.min(initial=math.inf))

    def _box(self, i: int) -> SweptBox:
        """Return the bounding box of a geom in its last pose, or of a fixture by its number."""
        if i >= len(self._geoms):
            return self._fixture_boxes[i - len(self._geoms)]
        assert self._positions is not None
        return SweptBox(self._positions[i], 2.0 * self._half_extents[i], self._axes[i])

    def _possible_pairs(self) -> list["_Pair"]:
        """Return all pairs whose collision is to be reported."""
        arm = [
            (j, geom)
            for j, geom in enumerate(self._geoms)
            if geom.checked_against_instrument and not geom.is_instrument
        ]
        pairs = []
        for i, geom in enumerate(self._geoms):
            if geom.checked_against_fixtures:
                for j, (name, (_, obstacle)) in enumerate(self._fixtures.items(), len(self._geoms)):
                    pairs.append(_Pair(i, j, name, obstacle))
            if geom.is_instrument:
                pairs += [_Pair(i, j, other.name, self._objects[j]) for j, other in arm]
        return pairs

    def _near(self, positions: FloatArray, axes: FloatArray, is_fast: BoolArray) -> list[int]:
        """Return the pairs whose axis-aligned boxes overlap, and those of fast geoms.

        Nearly all pairs are apart. To test each by the library took longer than a step of a small
        body.
        """
        n = len(self._geoms)
        half = (np.abs(axes) @ self._half_extents[:, :, None])[:, :, 0] + TOUCHING_MARGIN
        self._boxes[:n, 0] = positions - half
        self._boxes[:n, 1] = positions + half
        low, high = self._boxes[:, 0], self._boxes[:, 1]
        first, second = self._first, self._second
        apart = (low[first] > high[second]) | (low[second] > high[first])
        return np.flatnonzero(~apart.any(axis=1) | is_fast[first]).tolist()

    def _is_fast(self, positions: FloatArray, axes: FloatArray) -> BoolArray:
        """Return which geoms have moved farther than half of their thickness in this frame."""
        if self._positions is None:
            return np.zeros(len(self._geoms), np.bool_)
        moved = np.sqrt(np.square(positions - self._positions).sum(axis=1))
        # Bound on the displacement by rotation: |R1 x - R0 x| <= |R1 - R0| |x|.
        rotated = np.sqrt(np.square(axes - self._axes).sum(axis=(1, 2))) * self._reach
        is_fast: BoolArray = moved + rotated > self._half_thickness
        return is_fast

    def _swept_box(self, i: int, position: FloatArray, axes: FloatArray) -> SweptBox:
        """Return a box around a geom in the last frame, now, and in between.

        In between its corners move along arcs, of which the chords are known: an arc of some angle
        is farther from its chord by at most half of the chord times the tangent of a quarter of it.
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


def _oriented_box(fixture: Fixture) -> SweptBox:
    """Return the box of a fixture: its own, or one along the world's axes around a mesh."""
    if isinstance(fixture, FixtureBox):
        return SweptBox(fixture.centre, fixture.size, fixture.rotation)
    low, high = bounds_of(fixture)
    return SweptBox(0.5 * (low + high), high - low, np.eye(3))


class _Pair(NamedTuple):
    """A geom, and an object that it may collide with."""

    geom: int
    """Number of the geom."""
    other: int
    """Number of the other geom; for a fixture, its number after those of all geoms."""
    name: str
    """Name of the other geom or fixture."""
    object: fcl.CollisionObject
    """The other geom or fixture."""
