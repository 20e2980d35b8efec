"""Split one tetrahedron in seventeen, and open it along the triangles of its case (section 4.2)."""

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, axpy, store, sub, vec3
from tissue.cutting.bielser_1998.case_table import CASES
from tissue.cutting.bielser_1998.mesh_records import (
    NO_NODE,
    Records,
    Table,
    child_of,
    is_whole,
    reference_at_edge,
    reference_at_face,
)
from tissue.cutting.bielser_1998.node_placement import Placing, place_nodes
from tissue.cutting.bielser_1998.template_1_to_17 import (
    CENTRE,
    EDGE_NODE,
    FACE_NODE,
    N_CHILDREN,
    is_edge_cut,
)
from tissue.geometry.exact_predicates import nearest
from tissue.geometry.tetrahedron import face_area, tetrahedron_volume
from tissue.mesh.angular_momentum import note_spin
from tissue.mesh.body import CUT, OUTER, Body, relative_density
from tissue.mesh.changes import Change, note_child, note_dirty, note_face
from tissue.mesh.nonconforming import HANGING, join_list, leave_list

MOST_NEW_NODES = 20
"""Nodes that one split can make: two on each edge, two in each face."""


class SplitCounts(Arrays):
    """Counts of what the scheme did since the body was made."""

    n_of_case: IntArray = sized(len(CASES))
    """Split tetrahedra of each case, A to E; shape (5,)."""
    n_guarded: IntCell
    """Split tetrahedra whose face nodes the guard moved."""
    n_own: IntCell
    """Face nodes that the guard made for one tetrahedron alone."""
    n_ignored: IntCell
    """Crossings with edges of tetrahedra that were split already."""


class Split(Arrays):
    """All that the split of a tetrahedron reads and writes."""

    body: Body
    records: Records
    table: Table
    change: Change
    placing: Placing
    references: IntArray
    """Scratch: global node of each local node, for each part; shape (5, 14)."""
    counts: SplitCounts


@kernel
def split_tetrahedron(s: Split, t: int, code: int) -> bool:
    """Split the initial tetrahedron `t` by its code; return whether there was room."""
    body, records, change = s.body, s.records, s.change
    if body.n_nodes + MOST_NEW_NODES > len(body.rest) or body.n_tetrahedra + N_CHILDREN - 1 > len(
        body.tetrahedra
    ):
        change.is_full = 1
        return False
    if place_nodes(records, s.table, s.placing, t, code):
        s.counts.n_guarded += 1
    for k in range(4):
        s.counts.n_own += s.placing.is_own[k]
    refer_to_nodes(s, t, code)
    s.counts.n_of_case[s.table.case[code]] += 1
    volume = tetrahedron_volume(body.rest, body.tetrahedra, t)
    density = body.materials.density[body.material[t]]
    moving = relative_density(body, t) * volume
    for i in range(4):
        corner = records.tetrahedra[t, i]
        leave_list(body.hanging, corner, t)
        body.masses[corner] -= 0.25 * density * volume
        note_spin(s.change, moving, _arm(s, t, corner), vec3(body.velocities, corner))
    records.first_child[t] = body.n_tetrahedra
    body.n_tetrahedra += N_CHILDREN - 1
    for c in range(N_CHILDREN):
        _make_child(s, t, c)
        _link_inside(s, t, c, code)
    for k in range(4):
        _link_outside(s, t, k)
    return True


@kernel
def _make_child(s: Split, t: int, c: int) -> None:
    body, table = s.body, s.table
    child = child_of(s.records, t, c)
    for k in range(4):
        node = s.references[table.part[c], table.children[c, k]]
        body.tetrahedra[child, k] = node
        body.node_tetrahedron[node] = child
        join_list(body.hanging, node, child, k)
    volume = tetrahedron_volume(body.rest, body.tetrahedra, child)
    for k in range(4):
        _add_mass(s, t, table.children[c, k], body.tetrahedra[child, k], volume)
    note_dirty(s.change, child)
    if child != t:
        body.material[child] = body.material[t]
        note_child(s.change, child, t)


@kernel
def _add_mass(s: Split, t: int, local: int, node: int, volume: float) -> None:
    """Add the mass of a fourth of `volume` [m3] of tetrahedron `t` to `node`, as it moves in `t`.

    A node that a neighbour made earlier has moved by itself since: the collision is inelastic, and
    momentum is kept.
    """
    body = s.body
    mass = 0.25 * body.materials.density[body.material[t]] * volume
    total = body.masses[node] - body.added_masses[node] + mass
    velocity = vec3(body.velocities, node) if local < 4 else _velocity_within(s, t, local)
    note_spin(s.change, -relative_density(body, t) * volume, _arm(s, t, node), velocity)
    if local >= 4 and not body.fixed[node]:
        before = vec3(body.velocities, node)
        store(body.velocities, node, axpy(mass / total, sub(velocity, before), before))
    body.masses[node] += mass


@kernel
def _velocity_within(s: Split, t: int, local: int) -> Vec3:
    """Return the velocity of the initial tetrahedron `t` where a node of its template is [m/s]."""
    velocity = Vec3(0.0, 0.0, 0.0)
    for i in range(4):
        corner = s.records.tetrahedra[t, i]
        velocity = axpy(s.placing.weights[local, i], vec3(s.body.velocities, corner), velocity)
    return velocity


@kernel
def _arm(s: Split, t: int, node: int) -> Vec3:
    """Return the vector from the first corner of the initial tetrahedron `t` to a node [m]."""
    origin = vec3(s.body.positions, s.records.tetrahedra[t, 0])
    return sub(vec3(s.body.positions, node), origin)


@kernel
def _link_inside(s: Split, t: int, c: int, code: int) -> None:
    """Link a child to the others, or cut the link where the case opens a triangle (insertFace)."""
    body, table = s.body, s.table
    child = child_of(s.records, t, c)
    for f in range(4):
        link = table.inner[c, f]
        if link < 0:
            continue
        triangle = table.triangle[c, f]
        if triangle >= 0 and (table.opened[code] >> triangle) & 1 == 1:
            body.links[child, f] = CUT
            if link // 4 > c:
                s.change.area += face_area(body.rest, body.tetrahedra, child, f)
                note_face(s.change, child, f, child_of(s.records, t, link // 4), link % 4)
        else:
            body.links[child, f] = 4 * child_of(s.records, t, link // 4) + link % 4


@kernel
def _link_outside(s: Split, t: int, k: int) -> None:
    """Link the six small faces in face `k` of `t` to what is behind it.

    That is the skin, the six small faces of a neighbour that is split, or the one face of a
    neighbour that is whole: then the nodes on its edges and in its middle hang.
    """
    body, records, table = s.body, s.records, s.table
    behind = records.links[t, k]
    row = records.faces_of[t, k]
    other = behind // 4
    n = 0
    for i in range(4):
        for j in range(4):
            if table.along[i, j] < 0 or k in (i, j):
                continue
            c = table.along[i, j]
            child = child_of(records, t, c)
            f = table.outer[c, k]
            if behind == OUTER:
                body.links[child, f] = OUTER
            elif is_whole(records, other):
                n += 1
                body.links[child, f] = HANGING - row
                body.hanging.faces[row, n] = child
            else:
                mate, g = _mate(s, t, i, j, other, behind % 4)
                body.links[child, f] = 4 * mate + g
                body.links[mate, g] = 4 * child + f
    if n > 0:
        body.hanging.faces[row, 0] = other
        body.links[other, behind % 4] = HANGING - row


@kernel
def _mate(s: Split, t: int, i: int, j: int, other: int, k: int) -> tuple[int, int]:
    """Return the child of `other` along the edge from corner i to j of `t`, and its outer face."""
    records, table = s.records, s.table
    i_too = _corner_of(records, other, records.tetrahedra[t, i])
    j_too = _corner_of(records, other, records.tetrahedra[t, j])
    c = table.along[i_too, j_too]
    return child_of(records, other, c), table.outer[c, k]


@kernel
def _corner_of(records: Records, t: int, node: int) -> int:
    for i in range(4):
        if records.tetrahedra[t, i] == node:
            return i
    return -1


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
