"""`SkinCourse`: the line on the skin that a stroke follows as it lies, and when it is where."""

from typing import NamedTuple

import numpy as np

from bridge import TissueLink
from tissue import FloatArray, IntArray


class SkinCourse(NamedTuple):
    """Places on the skin above the tip, in the order in which it is to come to them."""

    times: FloatArray
    """When the tip is to be below each, on the clock of the strokes [s], shape (n,)."""
    at_rest: FloatArray
    """Where they are in the body at rest [m], shape (n, 3)."""
    lying: FloatArray
    """Where they were in the body as it lay when the stroke was planned [m], shape (n, 3)."""
    speed: float
    """Speed of the tip between its ramps [m/s]."""

    def __repr__(self) -> str:
        """Return a short text: the path of the stroke tells one course from another."""
        return f"SkinCourse({len(self.times)} places)"

    def moved_by(self, seconds: float) -> "SkinCourse":
        """Return it on a clock that is ahead [s]."""
        return self._replace(times=self.times + seconds)

    def displacements(self, link: TissueLink, holders: IntArray) -> FloatArray:
        """Return how far the places have moved since the stroke was planned [m], shape (n, 3).

        Args:
            link: The body.
            holders: Tetrahedron that held each place, or -1; written. Shape (n,).
        """
        return np.asarray(link.positions_of(self.at_rest, holders) - self.lying)
