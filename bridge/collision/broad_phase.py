"""Broad phase: whether the blade can touch the tissue in a step, and which fixtures it touches.

The filter is conservative: it rejects only blades that would touch nothing, so the results of a run
do not depend on it.

It tests the swept box of the blade, so that a fast blade cannot pass through a thin body between
two frames: first against one box around the tissue, and if they overlap, against the boxes of its
chunks, which leave the hollows of a body free.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import fcl
import numpy as np

from bridge.arithmetic import Triple
from bridge.collision.coherence import SeparatingAxis, WitnessPoint
from bridge.collision.collision_objects import MovableBox, Obstacles, are_colliding, fixture_objects
from bridge.collision.fixtures import Fixture
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox, swept_blade
from bridge.poses import Pose
from tissue import BladeShape, BladeSweep, Chunks, FloatArray, IntArray


class Overlaps(NamedTuple):
    """Overlaps of the swept box of the blade."""

    tissue: bool
    """Whether it overlaps the tissue's boxes."""
    fixtures: tuple[str, ...]
    """Names of the fixtures that it overlaps, in the order in which they were given."""


class BroadPhase:
    """Boxes around blade and tissue that are large enough for a whole step.

    The bounds of the tissue are those at the end of the last step. In the next step a node may
    leave them, so the blade's box is inflated by the distance that a node can travel: `dt` times
    the sum of

    - the speed of compression waves in the tissue. A node of an elastic body moves at strain times
      that speed, and tissue tears before its strain is 1;
    - the speed at which the body, or a loose piece of it, falls or swings as a whole: for the box
      around the body, that of its fastest side in the last step; for the chunks, that of the
      fastest node.

    The collision library is queried only where the last answer may have changed: not where blade
    and tissue were apart and an axis still separates them (`SeparatingAxis`), nor where they
    overlapped and a point of the blade is still near the tissue (`WitnessPoint`).

    Args:
        bounds: Lowest and highest corner of the tissue now [m], shape (2, 3).
        sound_speed: Speed of compression waves in the tissue [m/s].
        fixtures: Obstacles, in the tissue frame.
        blade: Shape of the blade behind the edge; None for the edge alone.
        chunks: Function that queries the tissue for its chunks; None where that takes longer than
            it saves.

    Raises:
        ValueError: two fixtures have one name.
    """

    def __init__(
        self,
        bounds: FloatArray,
        sound_speed: float,
        fixtures: Iterable[Fixture] = (),
        *,
        blade: BladeShape | None = None,
        chunks: Callable[[], Chunks] | None = None,
    ) -> None:
        low, high = bounds.tolist()
        self._bounds: tuple[Triple, Triple] = low, high
        self._sound_speed = sound_speed
        self._bounds_before, self._seconds = self._bounds, 1.0
        self._shift: float | None = None
        self._blade_shape = blade
        self._chunks = chunks
        self._blade = MovableBox()
        self._chunk_boxes = ChunkBoxes()
        self._separating = SeparatingAxis(blade)
        self._witness = WitnessPoint(blade)
        self._tissue = MovableBox()
        obstacles = fixture_objects(list(fixtures))
        self._has_fixtures = bool(obstacles)
        self._fixtures = Obstacles(obstacles)

    def overlaps(self, before: Pose, after: Pose, dt: float, *, engaged: bool = False) -> Overlaps:
        """Return what the blade can touch while it moves.

        Args:
            before: Pose of the blade at the start, in the tissue frame.
            after: Pose of the blade at the end.
            dt: Duration of the motion [s].
            engaged: Whether the blade holds tissue already, which it may drag out of any box.
        """
        if self._has_fixtures:
            self._blade.place(self._swept(before, after))
            fixtures = self._fixtures.colliding_with(self._blade.object)
            return Overlaps(engaged or self._reaches_tissue(before, after, dt), fixtures)
        touches = engaged or self._reaches_tissue(before, after, dt)
        return _ONLY_TISSUE if touches else _NOTHING

    def update_bounds(self, bounds: tuple[Triple, Triple], dt: float) -> None:
        """Set lowest and highest corner of the tissue [m] after a step of `dt` [s]."""
        self._bounds_before, self._bounds, self._seconds = self._bounds, bounds, dt
        self._shift = None
        if self._separating.axis is not None:
            self._separating.tissue_moved(self._shift_of_bounds())

    def _shift_of_bounds(self) -> float:
        """Return how far the fastest side of the box around the tissue moved in a step [m]."""
        if self._shift is None:  # a blade that holds tissue does not query it
            (ax, ay, az), (bx, by, bz) = self._bounds_before
            (ux, uy, uz), (vx, vy, vz) = self._bounds
            moved = max(abs(ux - ax), abs(uy - ay), abs(uz - az))
            self._shift = max(moved, abs(vx - bx), abs(vy - by), abs(vz - bz))
        return self._shift

    def _reaches_tissue(self, before: Pose, after: Pose, dt: float) -> bool:
        """Return whether the blade can touch the tissue: its box, and then one of its chunks."""
        travel = (self._sound_speed + self._shift_of_bounds() / self._seconds) * dt
        if self._separating.separates(before, after, self._bounds, travel):
            return False
        witness = self._witness
        if not (
            witness.is_within(travel, after, *self._bounds)
            or self._collides_with_bounds(before, after, travel)
        ):
            return False
        if self._chunks is None:
            return True
        boxes, fastest = self._chunks()
        travel = (self._sound_speed + fastest) * dt
        last = self._chunk_boxes.last_of(boxes)
        if last is not None and witness.is_within(travel, after, *last):
            return True
        box = _inflated(self._swept(before, after), travel)
        self._blade.place(box)
        if not self._chunk_boxes.collide_with(box, self._blade.object, boxes):
            return False
        found = self._chunk_boxes.last_of(boxes)
        if found is not None:
            witness.find(after, *found)
        return True

    def _collides_with_bounds(self, before: Pose, after: Pose, travel: float) -> bool:
        """Return whether the blade, larger by `travel` [m], overlaps the box around the tissue."""
        low, high = np.array(self._bounds)
        box = self._swept(before, after)
        tissue = SweptBox(0.5 * (low + high), high - low + 2.0 * TOUCHING_MARGIN, _WORLD_AXES)
        self._tissue.place(tissue)
        self._blade.place(_inflated(box, travel))
        if not are_colliding(self._tissue.object, self._blade.object):
            self._separating.find(box, tissue)
            return False
        self._separating.forget()
        if self._chunks is None:
            self._witness.find(after, *self._bounds)
        return True

    def _swept(self, before: Pose, after: Pose) -> SweptBox:
        """Return the box around the blade during its motion."""
        return swept_blade(BladeSweep(before.segment, after.segment), self._blade_shape)


_WORLD_AXES = np.eye(3)
_ONLY_TISSUE, _NOTHING = Overlaps(True, ()), Overlaps(False, ())


def _inflated(box: SweptBox, distance: float) -> SweptBox:
    """Return a box that is larger by a distance [m] on every side."""
    return box._replace(size=box.size + 2.0 * distance)


def not_separated(box: SweptBox, chunks: FloatArray) -> IntArray:
    """Return the numbers of the chunks that no face of the box, or of their own, separates from it.

    Six of the fifteen axes of the separating axis theorem (Gottschalk et al. 1996), for all chunks
    at once; chunks that only a pair of edges separates remain. The trees of the collision library
    are of no use here: they bound a rotated box by a sphere, and a blade is long.

    Args:
        box: Swept box of the blade.
        chunks: Lowest and highest corners of the chunks [m], shape (n, 2, 3).
    """
    half = 0.5 * (chunks[:, 1] - chunks[:, 0]) + TOUCHING_MARGIN
    offset = 0.5 * (chunks[:, 0] + chunks[:, 1]) - box.centre
    cosines = np.abs(box.axes)
    apart = np.abs(offset) > half + cosines @ (0.5 * box.size)
    apart |= np.abs(offset @ box.axes) > 0.5 * box.size + half @ cosines
    return np.flatnonzero(~apart.any(axis=1))


class ChunkBoxes:
    """Tests a box against chunks: all at once, then those that remain by the collision library.

    The chunk that it overlapped last is tested first, because mostly it still does.
    """

    def __init__(self) -> None:
        self._chunk = MovableBox()
        self._last = -1

    def collide_with(self, box: SweptBox, fcl_box: fcl.CollisionObject, chunks: FloatArray) -> bool:
        """Return whether a box overlaps a chunk.

        Args:
            box: Swept box of the blade.
            fcl_box: The box as an object of the collision library.
            chunks: Lowest and highest corners of the chunks [m], shape (n, 2, 3).
        """
        if 0 <= self._last < len(chunks) and self._collides(fcl_box, chunks[self._last]):
            return True
        for i in not_separated(box, chunks).tolist():
            if self._collides(fcl_box, chunks[i]):
                self._last = i
                return True
        return False

    def last_of(self, chunks: FloatArray) -> tuple[Triple, Triple] | None:
        """Return the corners [m] of the chunk that overlapped last; None if it is not known."""
        if not 0 <= self._last < len(chunks):
            return None
        low, high = chunks[self._last].tolist()
        return low, high

    def _collides(self, fcl_box: fcl.CollisionObject, chunk: FloatArray) -> bool:
        """Return whether a box overlaps a chunk, of which the corners are given."""
        low, high = chunk
        size = high - low + 2.0 * TOUCHING_MARGIN
        self._chunk.place(SweptBox(0.5 * (low + high), size, _WORLD_AXES))
        return are_colliding(self._chunk.object, fcl_box)
