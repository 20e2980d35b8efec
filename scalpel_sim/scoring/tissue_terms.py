"""Terms of the tissue: where it was stretched too far, and what was cut out of it."""

from typing import NamedTuple

import numpy as np

from bridge import TissueLink
from scalpel_sim.scoring.yardstick import StrainLimit, Yardstick
from tissue import FloatArray, IntArray, MaterialPoints, Snapshot, Tissue, piece_of_tetrahedra
from tissue.support import components


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

    What is cut out is all but the largest piece, or but as many as there were at first. Of several
    bodies that do not hang together, each is looked at by itself.

    Args:
        yardstick: The target.
        body: The body before any cut.
        n_pieces: Number of its pieces then.
    """

    def __init__(self, yardstick: Yardstick, body: Snapshot, n_pieces: int) -> None:
        self._target = yardstick.target
        self._of_target = float(_volumes(body)[np.isin(body.labels, self._target)].sum())
        self._bodies = _bodies_of(body) if self._target else ()
        self.n = n_pieces
        """Number of pieces."""
        self.removed = 0.0
        """Share of the target that was cut out."""
        self.healthy = 0.0
        """Volume of other tissue that was cut out [m3]."""

    def look(self, link: TissueLink) -> None:
        """Look at the pieces after new faces were cut."""
        n = link.n_pieces()
        if n == self.n:  # cuts join none, so they are the same
            return
        self.n = n
        if not self._target:
            return
        body = link.snapshot()
        piece, volumes = piece_of_tetrahedra(body), _volumes(body)
        is_out = np.zeros(len(piece), bool)
        for each in self._bodies:
            largest_first = np.unique(piece[np.isin(body.labels, each.labels)])
            is_out |= np.isin(piece, largest_first[each.n_pieces :])
        is_target = np.isin(body.labels, self._target)
        self.removed = float(volumes[is_out & is_target].sum()) / self._of_target
        self.healthy = float(volumes[is_out & ~is_target].sum())


class _Body(NamedTuple):
    """A body before any cut: labels that hang together."""

    labels: IntArray
    """Its labels, shape (n,)."""
    n_pieces: int
    """Number of its pieces: of a mesh that was in several."""


def _bodies_of(body: Snapshot) -> tuple[_Body, ...]:
    """Return the bodies before any cut."""
    labels, label = np.unique(body.labels, return_inverse=True)
    piece = piece_of_tetrahedra(body)
    n = int(piece.max()) + 1
    # Pieces and labels are vertices of a graph, with an edge where a piece has a label.
    pairs = np.unique(np.stack([piece, n + label.reshape(-1)], axis=1), axis=0)
    n_bodies, of_vertex = components(n + len(labels), pairs)
    of_piece, of_label = of_vertex[:n], of_vertex[n:]
    return tuple(_Body(labels[of_label == i], int((of_piece == i).sum())) for i in range(n_bodies))


def _volumes(body: Snapshot) -> FloatArray:
    """Return the volume of each tetrahedron at rest [m3]."""
    corners = body.rest_positions[body.tetrahedra]
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)
