"""The operators splitEdge and splitFace: nodes of a presplit tetrahedron and references to them.

Paper, section 4.3. A node is made when the first tetrahedron at its edge or face is split; the
others use the same. At first all references point to it. splitEdge makes the reference of one end
of a cut edge point to a second node; splitFace does so for one corner of a face that is cut across.
Neither does anything where a tetrahedron that was split before holds the node together.
"""

from tissue.core.jit import kernel
from tissue.core.vec3 import vec3
from tissue.cutting.bielser_1998.cut_edge_code import is_edge_cut
from tissue.cutting.bielser_1998.mesh_records import NO_NODE, reference_at_edge, reference_at_face
from tissue.cutting.bielser_1998.template_1_to_17 import CENTRE, EDGE_NODE, FACE_NODE
from tissue.cutting.bielser_1998.workspace import Split
from tissue.geometry.exact_predicates import nearest
from tissue.mesh.body import Body


@kernel
def refer_to_nodes(s: Split, t: int, code: int) -> None:
    """Write the node that each part of tetrahedron `t` refers to, making those that are missing.

    Args:
        s: The new nodes and the references are written.
        t: An initial tetrahedron whose nodes have been placed.
        code: Its cut-edge code.
    """
    for i in range(4):
        s.references[i, i] = s.records.tetrahedra[t, i]
    for e in range(6):
        _split_edge(s, t, code, e)
    for k in range(4):
        if s.placing.is_own[k] == 1:
            _make_own_node(s, t, code, k)
        else:
            _split_face(s, t, code, k)
        local = FACE_NODE + k
        s.references[CENTRE, local] = s.references[s.table.of_centre[code, k], local]


@kernel
def _split_edge(s: Split, t: int, code: int, e: int) -> None:
    records, nodes = s.records, s.records.edge_nodes
    edge = records.edges_of[t, e]
    if nodes[edge, 0] == NO_NODE:
        nodes[edge, 0] = nodes[edge, 1] = _new_node(s, t, EDGE_NODE + e)
    if not is_edge_cut(code, e):
        records.edge_held[edge] = 1
    elif nodes[edge, 0] == nodes[edge, 1] and records.edge_held[edge] == 0:
        nodes[edge, 1] = _copy_node(s.body, nodes[edge, 0])
    for end in range(2):
        i = s.table.edge_ends[e, end]
        place = reference_at_edge(records, edge, records.tetrahedra[t, i])
        s.references[i, EDGE_NODE + e] = nodes[edge, place]


@kernel
def _split_face(s: Split, t: int, code: int, k: int) -> None:
    records, nodes = s.records, s.records.face_nodes
    face = records.faces_of[t, k]
    local = FACE_NODE + k
    if nodes[face, 0] == NO_NODE:
        nodes[face, 0] = nodes[face, 1] = nodes[face, 2] = _new_node(s, t, local)
        for c in range(3):
            corner = s.table.face_corners[k, c]
            place = reference_at_face(records, face, records.tetrahedra[t, corner])
            records.face_weights[face, place] = s.placing.weights[local, corner]
    detached = s.table.detached[code, k]
    is_one = nodes[face, 0] == nodes[face, 1] and nodes[face, 1] == nodes[face, 2]
    if detached < 0:
        records.face_held[face] = 1
    elif is_one and records.face_held[face] == 0:
        place = reference_at_face(records, face, records.tetrahedra[t, detached])
        nodes[face, place] = _copy_node(s.body, nodes[face, place])
    for c in range(3):
        corner = s.table.face_corners[k, c]
        place = reference_at_face(records, face, records.tetrahedra[t, corner])
        s.references[corner, local] = nodes[face, place]


@kernel
def _make_own_node(s: Split, t: int, code: int, k: int) -> None:
    """Make a node in face `k` for this tetrahedron alone: the guard moved it."""
    local = FACE_NODE + k
    node = _new_node(s, t, local)
    for c in range(3):
        s.references[s.table.face_corners[k, c], local] = node
    detached = s.table.detached[code, k]
    if detached >= 0:
        s.references[detached, local] = _copy_node(s.body, node)


@kernel
def _new_node(s: Split, t: int, local: int) -> int:
    """Append a node, interpolated in tetrahedron `t`; it has no mass yet."""
    body, corners = s.body, s.records.tetrahedra
    node = _append_node(body)
    fixed = True
    for x in range(3):
        body.rest[node, x] = body.positions[node, x] = body.velocities[node, x] = 0.0
    for i in range(4):
        w = s.placing.weights[local, i]
        if w == 0.0:
            continue
        corner = corners[t, i]
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
    node = body.n_nodes
    body.n_nodes += 1
    body.masses[node] = 0.0
    body.twin[node] = node
    return node
