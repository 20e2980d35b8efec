"""The connected pieces of the body: tetrahedra that hang together through faces."""

from tissue.body import TETRAHEDRA, Body
from tissue.hanging import behind, n_behind
from tissue.jit import kernel
from tissue.types import IntArray


@kernel
def count_pieces(body: Body, piece: IntArray, queue: IntArray) -> int:
    """Number the pieces from 0 and write each tetrahedron's to `piece`; return how many there are.

    `piece` and `queue` have a place for each tetrahedron.
    """
    n_tetrahedra = body.counts[TETRAHEDRA]
    for t in range(n_tetrahedra):
        piece[t] = -1
    n_pieces = 0
    for start in range(n_tetrahedra):
        if piece[start] >= 0:
            continue
        piece[start] = n_pieces
        queue[0] = start
        n = 1
        i = 0
        while i < n:
            t = queue[i]
            for f in range(4):
                link = body.links[t, f]
                for k in range(n_behind(body.hanging, t, link)):
                    other = behind(body.hanging, t, link, k)
                    if piece[other] < 0:
                        piece[other] = n_pieces
                        queue[n] = other
                        n += 1
            i += 1
        n_pieces += 1
    return n_pieces
