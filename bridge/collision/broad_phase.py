"""Can the blade touch the tissue in this step? And which fixtures does it meet?

A strict filter: where it says no, the tissue would have found nothing that the blade touches, so a
run does not depend on whether the filter is there.

The question is asked with the swept box of the blade, so that a fast blade cannot pass through a
thin body from one frame to the next: first against one box around the tissue, and where that is
met, against the boxes of its chunks, which leave the hollows of a body free.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from bridge.collision.chunk_boxes import ChunkBoxes
from bridge.collision.collision_objects import MovableBox, Obstacles, fixture_objects, meet
from bridge.collision.fixtures import Fixture
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox, swept_blade
from tissue import BladeShape, BladeSweep, Chunks, FloatArray


class _Contacts(NamedTuple):
    """What the swept box of the blade meets."""

    tissue: bool
    """Whether it meets the tissue's boxes."""
    fixtures: tuple[str, ...]
    """Names of the fixtures that it meets, in the order in which they were given."""


class BroadPhase:
    """The rules by which the boxes are kept large enough.

    The bounds of the tissue are those at the end of the last step. In the step to come a node may
    leave them, so the blade's box is inflated by what a node can travel: `dt` times the sum of

    - the speed of sound in the tissue, that of compression. A node of an elastic body moves at
      strain times that speed, and tissue tears before its strain is 1;
    - how fast the body, or a loose piece of it, falls or swings as a whole: for the box around all,
      the fastest that a side of it moved in the last step; for the chunks, the fastest node.

    Args:
        bounds: Lowest and highest corner of the tissue now [m], shape (2, 3).
        sound_speed: Of the tissue [m/s].
        fixtures: In the tissue frame.
        blade: The body behind the edge; None for the edge alone.
        chunks: Asks the tissue for its chunks; None where that costs more than it saves.

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
        self._bounds = bounds.copy()
        self._sound_speed = sound_speed
        self._bounds_speed = 0.0
        self._blade_shape = blade
        self._chunks = chunks
        self._blade = MovableBox()
        self._chunk_boxes = ChunkBoxes()
        self._tissue = MovableBox()
        standing = fixture_objects(list(fixtures))
        self._has_fixtures = bool(standing)
        self._fixtures = Obstacles(standing)

    def contacts(self, sweep: BladeSweep, dt: float, *, engaged: bool = False) -> _Contacts:
        """Return what the blade can touch while it does `sweep` in `dt` [s].

        Args:
            sweep: In the tissue frame.
            dt: [s].
            engaged: Whether the blade holds tissue already, which it may drag out of any box.
        """
        if engaged and not self._has_fixtures:
            return _Contacts(True, ())
        box = swept_blade(sweep, self._blade_shape)
        self._blade.place(box)
        fixtures = self._fixtures.met_by(self._blade.object)
        return _Contacts(engaged or self._meets_tissue(box, dt), fixtures)

    def tissue_moved(self, bounds: FloatArray, dt: float) -> None:
        """Take note of where the tissue is after a step of `dt` [s]."""
        self._bounds_speed = float(np.abs(bounds - self._bounds).max()) / dt
        self._bounds = bounds.copy()

    def _meets_tissue(self, box: SweptBox, dt: float) -> bool:
        low, high = self._bounds
        size = high - low + 2.0 * TOUCHING_MARGIN
        self._tissue.place(SweptBox(0.5 * (low + high), size, _UNTURNED))
        self._blade.place(_inflated(box, (self._sound_speed + self._bounds_speed) * dt))
        if not meet(self._tissue.object, self._blade.object):
            return False
        if self._chunks is None:
            return True
        chunks = self._chunks()
        box = _inflated(box, (self._sound_speed + chunks.fastest) * dt)
        self._blade.place(box)
        return self._chunk_boxes.are_met_by(box, self._blade.object, chunks.boxes)


_UNTURNED = np.eye(3)


def _inflated(box: SweptBox, distance: float) -> SweptBox:
    """Return a box that holds all that is no farther than `distance` [m] from this one."""
    return box._replace(size=box.size + 2.0 * distance)
