"""Which boxes of the tissue's chunks the swept box of a blade meets."""

import fcl
import numpy as np

from bridge.collision.collision_objects import MovableBox, meet
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox
from tissue import FloatArray, IntArray

_UNTURNED = np.eye(3)


def not_separated(box: SweptBox, chunks: FloatArray) -> IntArray:
    """Return the numbers of the chunks from which no face of the box, or of theirs, separates it.

    Six of the fifteen axes of the separating axis theorem (Gottschalk et al. 1996), for all chunks
    at once; some that only a pair of edges separates are left over. The trees of the collision
    library would not do: they hold a turned box by the ball around it, and a blade is long.

    Args:
        box: Around the blade.
        chunks: Lowest and highest corners, shape (n, 2, 3).
    """
    half = 0.5 * (chunks[:, 1] - chunks[:, 0]) + TOUCHING_MARGIN
    way = 0.5 * (chunks[:, 0] + chunks[:, 1]) - box.centre
    cosines = np.abs(box.axes)
    apart = np.abs(way) > half + cosines @ (0.5 * box.size)
    apart |= np.abs(way @ box.axes) > 0.5 * box.size + half @ cosines
    return np.flatnonzero(~apart.any(axis=1))


class ChunkBoxes:
    """Asks the collision library about the few chunks that are left over."""

    def __init__(self) -> None:
        self._chunk = MovableBox()

    def are_met_by(self, box: SweptBox, there: fcl.CollisionObject, chunks: FloatArray) -> bool:
        """Whether a box meets a chunk.

        Args:
            box: Around the blade.
            there: The same as a collision object.
            chunks: Lowest and highest corners, shape (n, 2, 3).
        """
        for i in not_separated(box, chunks).tolist():
            low, high = chunks[i]
            size = high - low + 2.0 * TOUCHING_MARGIN
            self._chunk.place(SweptBox(0.5 * (low + high), size, _UNTURNED))
            if meet(self._chunk.object, there):
                return True
        return False
