"""The connected pieces of the body: tetrahedra that are connected through faces."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.geometry.connected_components import components
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
