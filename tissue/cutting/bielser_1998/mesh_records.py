"""Records of the initial mesh: which edges are cut, and the nodes on edges and in faces.

Only tetrahedra of the initial mesh are cut, each once. An edge has one record, shared by all
tetrahedra around it, and a face one, shared by two: so both sides of a face agree on its nodes.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.cutting.bielser_1998.case_table import LOOKUP
from tissue.cutting.bielser_1998.template_1_to_17 import EDGES, FACES, PRESPLIT, bit_of
from tissue.mesh.body import Body
from tissue.mesh.faces import sorted_faces
from tissue.mesh.nonconforming import may_hang

NOT_CUT = -1.0
"""In place of the fraction at which an edge is cut."""
NO_NODE = -1
"""In place of a node that does not exist."""
WHOLE_STILL = -1
"""In place of a tetrahedron's first appended child."""


class Records(Arrays):
    """Records of the initial mesh. n_tets, n_edges and n_faces are its own."""

    tetrahedra: IntArray
    """Nodes A, B, C, D of each tetrahedron, shape (n_tets, 4)."""
    links: IntArray
    """Half-faces behind each face, as `Body.links` before the first cut; shape (n_tets, 4)."""
    first_child: IntArray = sized("tetrahedra", fill=WHOLE_STILL)
    """First appended child, or WHOLE_STILL; child 0 replaces its parent; shape (n_tets,)."""
    edges_of: IntArray
    """The edges AB BC BD AC CD AD of each tetrahedron, shape (n_tets, 6)."""
    faces_of: IntArray
    """The face opposite each corner, shape (n_tets, 4)."""
    edges: IntArray
    """Ends of each edge, ascending; sorted, shape (n_edges, 2)."""
    first_edge: IntArray
    """First edge whose lower end is each node, shape (n_nodes + 1,)."""
    faces: IntArray
    """Corners of each face, ascending, shape (n_faces, 3)."""
    first_around: IntArray
    """Where each edge's tetrahedra begin in `around`, shape (n_edges + 1,)."""
    around: IntArray
    """The tetrahedra around each edge, shape (6 n_tets,)."""
    crossed_at: FloatArray = sized("edges", fill=NOT_CUT)
    """Fraction from its first end at which the blade crossed each edge, or NOT_CUT; (n_edges,)."""
    crossed_in: IntArray = sized("edges")
    """Incision in which the blade crossed each edge, shape (n_edges,)."""
    incision: IntCell
    """Number of the current incision, from 1."""
    edge_nodes: IntArray = sized("edges", 2, fill=NO_NODE)
    """The references to each edge's node, one for each end, or NO_NODE; shape (n_edges, 2)."""
    edge_held: IntArray = sized("edges")
    """Whether a split tetrahedron holds the edge's node together, shape (n_edges,)."""
    tip_weights: FloatArray = sized("faces", 3)
    """Weights of the corners of each face where the tip passed through it, or 0; (n_faces, 3)."""
    face_weights: FloatArray = sized("faces", 3)
    """Weights of the corners of each face at its node, shape (n_faces, 3)."""
    face_nodes: IntArray = sized("faces", 3, fill=NO_NODE)
    """The references to each face's node, one for each corner, or NO_NODE; shape (n_faces, 3)."""
    face_held: IntArray = sized("faces")
    """Whether a split tetrahedron holds the face's node together, shape (n_faces,)."""


class Table(Arrays):
    """The generic split and the lookup table: the fields of `Presplit`, `Lookup` and two more."""

    children: IntArray
    part: IntArray
    inner: IntArray
    triangle: IntArray
    along: IntArray
    outer: IntArray
    case: IntArray
    opened: IntArray
    detached: IntArray
    of_centre: IntArray
    edge_ends: IntArray
    """Corners of each edge, shape (6, 2)."""
    face_corners: IntArray
    """Corners of each face, shape (4, 3)."""


def with_room_to_hang(body: Body) -> Body:
    """Return an uncut body with room for hanging nodes."""
    n_nodes, n_tetrahedra = body.n_nodes, body.n_tetrahedra
    tetrahedra = body.tetrahedra[:n_tetrahedra]
    n_faces = len(sorted_faces(tetrahedra).starts)
    return body.replaced(hanging=may_hang(n_faces, n_nodes, tetrahedra))


def records_of(body: Body) -> Records:
    """Return the records of an uncut body."""
    n_nodes, n_tetrahedra = body.n_nodes, body.n_tetrahedra
    tetrahedra = body.tetrahedra[:n_tetrahedra].copy()
    ends = np.sort(tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    edges, edges_of = np.unique(ends, axis=0, return_inverse=True)
    edges_of = edges_of.reshape(n_tetrahedra, 6).astype(np.int64)
    sorting = sorted_faces(tetrahedra)
    first = sorting.halves[sorting.starts]
    faces = np.sort(tetrahedra[first[:, None] // 4, np.array(FACES)[first % 4]], axis=1)
    faces_of = np.empty(4 * n_tetrahedra, dtype=np.int64)
    faces_of[sorting.halves] = np.repeat(np.arange(len(faces)), sorting.counts)
    sizes = {"tetrahedra": n_tetrahedra, "edges": len(edges), "faces": len(faces)}
    return Records.new(
        sizes,
        tetrahedra=tetrahedra,
        links=body.links[:n_tetrahedra].copy(),
        edges_of=edges_of,
        faces_of=faces_of.reshape(n_tetrahedra, 4),
        edges=np.ascontiguousarray(edges),
        first_edge=np.searchsorted(edges[:, 0], np.arange(n_nodes + 1)).astype(np.int64),
        first_around=np.append(0, np.cumsum(np.bincount(edges_of.ravel()))).astype(np.int64),
        around=np.argsort(edges_of.ravel(), kind="stable") // 6,
        faces=np.ascontiguousarray(faces),
        incision=1,
    )


def table() -> Table:
    """Return the generic split and the lookup table, for kernels."""
    return Table(
        **PRESPLIT._asdict(),
        **LOOKUP._asdict(),
        edge_ends=np.array(EDGES),
        face_corners=np.array(FACES),
    )


@kernel
def is_whole(records: Records, t: int) -> bool:
    """Return whether `t` is a tetrahedron of the initial mesh that is not split."""
    return t < len(records.first_child) and records.first_child[t] == WHOLE_STILL


@kernel
def cut_edge_code(records: Records, t: int) -> int:
    """Return the cut-edge code of an initial tetrahedron."""
    code = 0
    for e in range(6):
        if records.crossed_at[records.edges_of[t, e]] != NOT_CUT:
            code |= 1 << bit_of(e)
    return code


@kernel
def child_of(records: Records, t: int, c: int) -> int:
    """Return child `c` of the initial tetrahedron `t`, which is split."""
    return t if c == 0 else records.first_child[t] + c - 1


@kernel
def edge_between(records: Records, a: int, b: int) -> int:
    """Return the edge of the initial mesh from node `a` to a higher node `b`, or -1."""
    if a + 1 >= len(records.first_edge):
        return -1
    for e in range(records.first_edge[a], records.first_edge[a + 1]):
        if records.edges[e, 1] == b:
            return e
    return -1


@kernel
def reference_at_edge(records: Records, e: int, node: int) -> int:
    """Return which reference to the node of edge `e` its end `node` has."""
    return 0 if records.edges[e, 0] == node else 1


@kernel
def reference_at_face(records: Records, face: int, node: int) -> int:
    """Return which reference to the node of a face its corner `node` has."""
    if records.faces[face, 0] == node:
        return 0
    return 1 if records.faces[face, 1] == node else 2
