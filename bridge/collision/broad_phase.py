"""Broad phase: whether the blade can touch the tissue in a step, and which fixtures it touches.

The filter is conservative: it rejects only blades that would touch nothing, so the results of a run
do not depend on it.

It tests the swept box of the blade, so that a fast blade cannot pass through a thin body between
two frames: first against one box around the tissue, and if they overlap, against the boxes of its
chunks, which leave the hollows of a body free.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from bridge.collision.chunk_boxes import ChunkBoxes
from bridge.collision.collision_objects import MovableBox, Obstacles, are_colliding, fixture_objects
from bridge.collision.fixtures import Fixture
from bridge.collision.separating_axis import SeparatingAxis
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox, swept_blade
from tissue import BladeShape, BladeSweep, Chunks, FloatArray


class _Overlaps(NamedTuple):
    """What the swept box of the blade overlaps."""

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

    Where they were apart, and the axis that separated them still does (`SeparatingAxis`), they are
    not compared by the collision library.

    Args:
        bounds: Lowest and highest corner of the tissue now [m], shape (2, 3).
        sound_speed: Speed of compression waves in the tissue [m/s].
        fixtures: Obstacles, in the tissue frame.
        blade: Shape of the blade behind the edge; None for the edge alone.
        chunks: Function that asks the tissue for its chunks; None where that takes longer than it
            saves.

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
        self._bounds = _corners(bounds)
        self._sound_speed = sound_speed
        self._bounds_speed = 0.0
        self._blade_shape = blade
        self._chunks = chunks
        self._blade = MovableBox()
        self._chunk_boxes = ChunkBoxes()
        self._separating = SeparatingAxis(blade)
        self._tissue = MovableBox()
        obstacles = fixture_objects(list(fixtures))
        self._has_fixtures = bool(obstacles)
        self._fixtures = Obstacles(obstacles)

    def overlaps(self, sweep: BladeSweep, dt: float, *, engaged: bool = False) -> _Overlaps:
        """Return what the blade can touch while it does `sweep`.

        Args:
            sweep: Motion of the blade, in the tissue frame.
            dt: Duration of the motion [s].
            engaged: Whether the blade holds tissue already, which it may drag out of any box.
        """
        if engaged and not self._has_fixtures:
            return _ONLY_TISSUE
        travel = (self._sound_speed + self._bounds_speed) * dt
        if not self._has_fixtures and self._separating.separates(sweep, self._bounds, travel):
            return _NOTHING
        box = swept_blade(sweep, self._blade_shape)
        self._blade.place(box)
        fixtures = self._fixtures.colliding_with(self._blade.object)
        return _Overlaps(engaged or self._reaches_tissue(box, dt), fixtures)

    def update_bounds(self, bounds: FloatArray, dt: float) -> None:
        """Set the bounds of the tissue after a step of `dt` [s], shape (2, 3)."""
        (ax, ay, az), (bx, by, bz) = self._bounds
        self._bounds = _corners(bounds)
        (ux, uy, uz), (vx, vy, vz) = self._bounds
        moved = max(abs(ux - ax), abs(uy - ay), abs(uz - az))
        self._bounds_speed = max(moved, abs(vx - bx), abs(vy - by), abs(vz - bz)) / dt

    def _reaches_tissue(self, box: SweptBox, dt: float) -> bool:
        low, high = np.array(self._bounds)
        tissue = SweptBox(0.5 * (low + high), high - low + 2.0 * TOUCHING_MARGIN, _WORLD_AXES)
        self._tissue.place(tissue)
        self._blade.place(_inflated(box, (self._sound_speed + self._bounds_speed) * dt))
        if not are_colliding(self._tissue.object, self._blade.object):
            self._separating.find(box, tissue)
            return False
        if self._chunks is None:
            return True
        chunks = self._chunks()
        box = _inflated(box, (self._sound_speed + chunks.fastest) * dt)
        self._blade.place(box)
        return self._chunk_boxes.collide_with(box, self._blade.object, chunks.boxes)


_WORLD_AXES = np.eye(3)
_ONLY_TISSUE, _NOTHING = _Overlaps(True, ()), _Overlaps(False, ())


def _corners(bounds: FloatArray) -> tuple[list[float], list[float]]:
    """Return lowest and highest corner in plain numbers."""
    low, high = bounds.tolist()
    return low, high


def _inflated(box: SweptBox, distance: float) -> SweptBox:
    """Return a box that is larger by a distance [m] on every side."""
    return box._replace(size=box.size + 2.0 * distance)
