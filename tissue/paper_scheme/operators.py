"""splitEdge and splitFace: the nodes of a presplit tetrahedron and the references to them.

Paper, section 4.3. A node is made when the first tetrahedron at its edge or face is split, and the
others take it over. At first all references point to it. splitEdge lets the reference of one end of
a cut edge point to a second node; splitFace does so for one corner of a face that is cut across.
Neither does anything where a tetrahedron that was split before holds the node together.
"""

from tissue.body import NODES, Body
from tissue.jit import kernel
from tissue.paper_scheme.cut_edge_code import is_cut
from tissue.paper_scheme.placing import Placing
from tissue.paper_scheme.presplit import CENTRE, EDGE_NODE, FACE_NODE
from tissue.paper_scheme.records import (
    NO_NODE,
    Records,
    Table,
    reference_at_edge,
    reference_at_face,
)
from tissue.predicates import nearest
from tissue.types import FloatArray, IntArray
from tissue.vec3 import vec3


@kernel
def refer_to_nodes(
    records: Records,
    table: Table,
    placing: Placing,
    body: Body,
    t: int,
    code: int,
    references: IntArray,
) -> None:
    """Write the node that each part of tetrahedron `t` refers to, making those that are missing.

    Args:
        records: The initial mesh.
        table: The lookup table.
        placing: Where the nodes are.
        body: Gets the new nodes.
        t: An initial tetrahedron.
        code: Its cut-edge code.
        references: Global node of each local node, for each part; shape (5, 14).
    """
    for i in range(4):
        references[i, i] = records.tetrahedra[t, i]
    for e in range(6):
        _split_edge(records, table, placing, body, t, code, e, references)
    for k in range(4):
        _split_face(records, table, placing, body, t, code, k, references)


@kernel
def _split_edge(
    records: Records,
    table: Table,
    placing: Placing,
    body: Body,
    t: int,
    code: int,
    e: int,
    references: IntArray,
) -> None:
    edge = records.edges_of[t, e]
    nodes = records.edge_nodes
    if nodes[edge, 0] == NO_NODE:
        nodes[edge, 0] = nodes[edge, 1] = _new_node(
            records, placing.weights, body, t, EDGE_NODE + e
        )
    if not is_cut(code, e):
        records.edge_held[edge] = 1
    elif nodes[edge, 0] == nodes[edge, 1] and records.edge_held[edge] == 0:
        nodes[edge, 1] = _copy_node(body, nodes[edge, 0])
    for end in range(2):
        i = table.edge_ends[e, end]
        place = reference_at_edge(records, edge, records.tetrahedra[t, i])
        references[i, EDGE_NODE + e] = nodes[edge, place]


@kernel
def _split_face(
    records: Records,
    table: Table,
    placing: Placing,
    body: Body,
    t: int,
    code: int,
    k: int,
    references: IntArray,
) -> None:
    face = records.faces_of[t, k]
    local = FACE_NODE + k
    detached = table.detached[code, k]
    nodes = records.face_nodes
    if placing.is_own[k] == 1:
        node = _new_node(records, placing.weights, body, t, local)
        for c in range(3):
            references[table.face_corners[k, c], local] = node
        if detached >= 0:
            references[detached, local] = _copy_node(body, node)
        references[CENTRE, local] = references[table.of_centre[code, k], local]
        return
    if nodes[face, 0] == NO_NODE:
        nodes[face, 0] = _new_node(records, placing.weights, body, t, local)
        nodes[face, 1] = nodes[face, 2] = nodes[face, 0]
        for c in range(3):
            corner = table.face_corners[k, c]
            place = reference_at_face(records, face, records.tetrahedra[t, corner])
            records.face_weights[face, place] = placing.weights[local, corner]
    if detached < 0:
        records.face_held[face] = 1
    elif records.face_held[face] == 0 and _is_one(nodes, face):
        place = reference_at_face(records, face, records.tetrahedra[t, detached])
        nodes[face, place] = _copy_node(body, nodes[face, place])
    for c in range(3):
        corner = table.face_corners[k, c]
        place = reference_at_face(records, face, records.tetrahedra[t, corner])
        references[corner, local] = nodes[face, place]
    references[CENTRE, local] = references[table.of_centre[code, k], local]


@kernel
def _is_one(nodes: IntArray, face: int) -> bool:
    return nodes[face, 0] == nodes[face, 1] and nodes[face, 1] == nodes[face, 2]


@kernel
def _new_node(records: Records, weights: FloatArray, body: Body, t: int, local: int) -> int:
    """Append a node where the field of tetrahedron `t` puts it; it has no mass yet."""
    node = _append_node(body)
    fixed = True
    for x in range(3):
        body.rest[node, x] = body.positions[node, x] = body.velocities[node, x] = 0.0
    for i in range(4):
        w = weights[local, i]
        if w == 0.0:
            continue
        corner = records.tetrahedra[t, i]
        fixed = fixed and body.fixed[corner]
        for x in range(3):
            body.rest[node, x] += w * body.rest[corner, x]
            body.positions[node, x] += w * body.positions[corner, x]
            body.velocities[node, x] += w * body.velocities[corner, x]
    body.fixed[node] = fixed
    p = nearest(body.lattice, vec3(body.rest, node))
    body.lattice_rest[node, 0] = p.x
    body.lattice_rest[node, 1] = p.y
    body.lattice_rest[node, 2] = p.z
    return node


@kernel
def _copy_node(body: Body, node: int) -> int:
    copy = _append_node(body)
    for x in range(3):
        body.rest[copy, x] = body.rest[node, x]
        body.positions[copy, x] = body.positions[node, x]
        body.velocities[copy, x] = body.velocities[node, x]
        body.lattice_rest[copy, x] = body.lattice_rest[node, x]
    body.fixed[copy] = body.fixed[node]
    body.twin[copy] = body.twin[node]
    body.twin[node] = copy
    return copy


@kernel
def _append_node(body: Body) -> int:
    node = body.counts[NODES]
    body.counts[NODES] += 1
    body.masses[node] = 0.0
    body.twin[node] = node
    return node
