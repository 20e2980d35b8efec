"""Connected pieces of the body, joined through faces; loose pieces, of which no node is fixed."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.mesh.body import Body, behind, n_behind
from tissue.mesh.mesh_arrays import tetrahedron_array
from tissue.types import Piece, Snapshot


@kernel
def label_pieces(body: Body, piece: IntArray, queue: IntArray) -> int:
    """Write the number of each tetrahedron's piece, from 0, to `piece`; return how many there are.

    `piece` and `queue`, which is scratch, have an entry for each tetrahedron.
    """
    n_tetrahedra = body.n_tetrahedra
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
                for k in range(n_behind(body, t, link)):
                    other = behind(body, t, link, k)
                    if piece[other] < 0:
                        piece[other] = n_pieces
                        queue[n] = other
                        n += 1
            i += 1
        n_pieces += 1
    return n_pieces


def piece_of_tetrahedra(body: Snapshot) -> IntArray:
    """Return the piece that each tetrahedron is in, shape (n_tets,), numbered as in `pieces_of`.

    The nodes suffice: the tetrahedra around a node are connected through faces, or the node would
    have been doubled, so pieces share no node.
    """
    tetrahedra = tetrahedron_array(body.tetrahedra)
    edges = np.stack([np.repeat(tetrahedra[:, 0], 3), tetrahedra[:, 1:].ravel()], axis=1)
    _, group = components(len(body.positions), edges)
    volumes = _volumes(np.asarray(body.rest_positions, dtype=np.float64), tetrahedra)
    found, first, piece = np.unique(group[tetrahedra[:, 0]], return_index=True, return_inverse=True)
    piece = piece.ravel()
    by_size = np.lexsort((first, -np.bincount(piece, volumes, len(found))))
    rank = np.empty(len(found), dtype=np.int64)
    rank[by_size] = np.arange(len(found))
    return rank[piece]


def pieces_of(body: Snapshot) -> tuple[Piece, ...]:
    """Return the connected pieces of a body, the largest at rest first.

    Centre, momenta and inertia are those of point masses at the nodes, as in the engine.
    """
    body = body._replace(tetrahedra=tetrahedron_array(body.tetrahedra))
    of_tetrahedron = piece_of_tetrahedra(body)
    of_node = np.zeros(len(body.positions), dtype=np.int64)
    of_node[body.tetrahedra] = of_tetrahedron[:, None]
    at_rest = _volumes(body.rest_positions, body.tetrahedra)
    now = _volumes(body.positions, body.tetrahedra)
    pieces = []
    for i in range(int(of_tetrahedron.max()) + 1):
        tetrahedra, nodes = of_tetrahedron == i, of_node == i
        masses = body.masses[nodes, None]
        mass = float(masses.sum())
        centre = (masses * body.positions[nodes]).sum(axis=0) / mass
        velocity = (masses * body.velocities[nodes]).sum(axis=0) / mass
        arms = body.positions[nodes] - centre
        inertia = (masses * arms**2).sum() * np.eye(3) - arms.T @ (masses * arms)
        pieces.append(
            Piece(
                n_tetrahedra=int(tetrahedra.sum()),
                n_nodes=int(nodes.sum()),
                is_held=bool(body.fixed[nodes].any()),
                rest_volume=float(at_rest[tetrahedra].sum()),
                volume=float(now[tetrahedra].sum()),
                mass=mass,
                centre=centre,
                velocity=velocity,
                angular_momentum=np.cross(arms, masses * (body.velocities[nodes] - velocity)).sum(
                    axis=0
                ),
                inertia=inertia,
            )
        )
    return tuple(pieces)


def _volumes(positions: FloatArray, tetrahedra: IntArray) -> FloatArray:
    """Return signed volumes [m3], shape (n_tets,)."""
    a, b, c, d = (positions[tetrahedra[:, k]] for k in range(4))
    return np.asarray(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0)


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


def components(n: int, pairs: IntArray) -> tuple[int, IntArray]:
    """Return the number of components, and that of each vertex.

    Args:
        n: Number of vertices.
        pairs: Vertices that are joined, shape (n_pairs, 2).

    Returns:
        How many components there are, and for each vertex its component, shape (n,). They are
        numbered in the order of their lowest vertices.
    """
    parent = np.arange(n)
    _join(parent, np.ascontiguousarray(pairs))
    labels = np.cumsum(parent == np.arange(n)) - 1  # a root is the lowest vertex of its set
    return int(labels[-1]) + 1 if n else 0, labels[parent]


@kernel
def _root(parent: IntArray, vertex: int) -> int:
    """Return the root of the set that holds `vertex`, and shorten the path to it."""
    while parent[vertex] != vertex:
        parent[vertex] = parent[parent[vertex]]
        vertex = parent[vertex]
    return vertex


@kernel
def _join(parent: IntArray, pairs: IntArray) -> None:
    """Join the sets of each pair; afterwards each vertex's parent is its root."""
    for k in range(len(pairs)):
        a, b = _root(parent, pairs[k, 0]), _root(parent, pairs[k, 1])
        if a < b:
            parent[b] = a
        else:
            parent[a] = b
    for vertex in range(len(parent)):
        parent[vertex] = _root(parent, vertex)
