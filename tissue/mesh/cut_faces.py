"""Faces that cuts have opened, as users and other processes have them."""

from typing import Final, NamedTuple

from tissue.core.array_types import FloatArray, IntArray

BY_BLADE: Final = 0
"""Cause of a face that the edge of a blade has cut."""

FINISHED: Final = 1
"""Cause of a face that parts a bridge which the blade passed over, where an incision ended."""

GIVEN: Final = 2
"""Cause of a face that was cut along a given surface, by no blade."""


class CutFaces(NamedTuple):
    """Faces that cuts have opened, one side of each, in the order in which they came. Copies."""

    corners: FloatArray
    """Corners in the body at rest [m], shape (n, 3, 3)."""
    areas: FloatArray
    """Areas at rest [m2], shape (n,)."""
    labels: IntArray
    """Labels of the tissue on both sides, shape (n, 2)."""
    causes: IntArray
    """Cause of each, shape (n,): 0, the edge of a blade; 1, a small bridge that was parted where an
    incision ended; 2, `Tissue.incise`."""
    times: FloatArray
    """Ends of the steps in which they were opened [s], since the body was made, shape (n,)."""

    @property
    def n(self) -> int:
        """Number of faces."""
        return len(self.areas)
