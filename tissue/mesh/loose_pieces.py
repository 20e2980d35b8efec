"""The loose pieces of the body: connected pieces of which no node is fixed."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.structs import Arrays
from tissue.mesh.body import Body
from tissue.mesh.pieces import label_pieces


class LoosePieces(Arrays):
    """The nodes of each loose piece."""

    node: IntArray
    """Nodes of all loose pieces, piece by piece; shape (n,)."""
    begin: IntArray
    """Where the nodes of each piece begin in `node`, and then the end; shape (n_pieces + 1,)."""


def no_loose_pieces() -> LoosePieces:
    """Return that there is no loose piece."""
    return LoosePieces(node=np.zeros(0, np.int64), begin=np.zeros(1, np.int64))


def loose_pieces_of(body: Body) -> LoosePieces:
    """Return the loose pieces of a body, in the order of their first tetrahedra."""
    piece, queue = np.empty((2, body.n_tetrahedra), np.int64)
    n_pieces = label_pieces(body, piece, queue)
    fixed = body.fixed[: body.n_nodes]
    if n_pieces == 1 and fixed.any():
        return no_loose_pieces()
    of_node = np.full(body.n_nodes, n_pieces)
    of_node[body.tetrahedra[: body.n_tetrahedra]] = piece[:, None]
    is_held = np.zeros(n_pieces + 1, np.bool_)
    is_held[of_node[fixed]] = True
    is_held[n_pieces] = True  # of a node without a tetrahedron
    nodes = np.flatnonzero(~is_held[of_node])
    nodes = nodes[np.argsort(of_node[nodes], kind="stable")]
    _, begin = np.unique(of_node[nodes], return_index=True)
    return LoosePieces(node=nodes, begin=np.append(begin, len(nodes)).astype(np.int64))


def are_same_pieces(one: LoosePieces, other: LoosePieces) -> bool:
    """Return whether two are the same nodes, in the same pieces."""
    return np.array_equal(one.begin, other.begin) and np.array_equal(one.node, other.node)
