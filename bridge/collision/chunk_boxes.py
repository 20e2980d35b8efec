"""Collision of a blade's swept box with the boxes of the tissue's chunks."""

import fcl
import numpy as np

from bridge.arithmetic import Triple
from bridge.collision.collision_objects import MovableBox, are_colliding
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox
from tissue import FloatArray, IntArray

_WORLD_AXES = np.eye(3)


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
