"""Terms of the tissue: where it was stretched too far, and what was cut out of it."""

import numpy as np

from scalpel_sim.scoring.yardstick import StrainLimit, Yardstick
from tissue import FloatArray, IntArray, MaterialPoints, Snapshot, Tissue, piece_of_tetrahedra


class StrainTerm:
    """The volume of a part that was stretched beyond its limit so far.

    Each tetrahedron before any cut stands for its volume, and its middle for the strain there: that
    of the tetrahedron which holds this material point now.

    Args:
        limit: The part, and its limit.
    """

    def __init__(self, limit: StrainLimit) -> None:
        self._limit = limit
        # `points` finds its points from here, so that a state that is put back has them too.
        self._holders: IntArray = limit.tetrahedra.copy()
        self._points = MaterialPoints(limit.centres, self._holders, np.zeros(len(limit.centres)))
        self._was_above = np.zeros(len(limit.centres), bool)

    def look(self, tissue: Tissue) -> None:
        """Look at the strain now."""
        tissue.mark_strained(self._points, self._limit.limit, self._was_above)

    @property
    def volume(self) -> float:
        """Volume at rest that was stretched beyond the limit [m3]."""
        return float(self._limit.volumes[self._was_above].sum())


class PiecesTerm:
    """Pieces of the body, and what was cut out of it.

    What is cut out is all but the largest piece, or but as many as the body had at first.

    Args:
        yardstick: The target.
        body: The body before any cut.
        n_pieces: Number of its pieces then.
    """

    def __init__(self, yardstick: Yardstick, body: Snapshot, n_pieces: int) -> None:
        self._target = yardstick.target
        self._of_target = float(_volumes(body)[body.labels == yardstick.target].sum())
        self._n_at_first = n_pieces
        self.n = n_pieces
        """Number of pieces."""
        self.removed = 0.0
        """Share of the target that was cut out."""
        self.healthy = 0.0
        """Volume of other tissue that was cut out [m3]."""

    def look(self, tissue: Tissue) -> None:
        """Look at the pieces after new faces were cut."""
        n = tissue.n_pieces()
        if n == self.n:  # a cut joins none, so they are the same
            return
        self.n = n
        if self._target is None or n <= self._n_at_first:
            return
        body = tissue.snapshot()
        piece, volumes = piece_of_tetrahedra(body), _volumes(body)
        is_out = piece >= self._n_at_first  # the largest comes first
        is_target = body.labels == self._target
        self.removed = float(volumes[is_out & is_target].sum()) / self._of_target
        self.healthy = float(volumes[is_out & ~is_target].sum())


def _volumes(body: Snapshot) -> FloatArray:
    """Return the volume of each tetrahedron at rest [m3]."""
    corners = body.rest_positions[body.tetrahedra]
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)
