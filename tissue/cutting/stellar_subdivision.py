"""Stellar subdivision: insert a node into an edge or a face, and split all tetrahedra around it.

These are the paper's splitEdge and splitFace (section 4.3) without the case table: the whole star
is split at once, so that no node hangs. A node at positive weights turns a tetrahedron into
children of positive volume.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, sub, vec3
from tissue.cutting.cut_surface import decide_side, decided_side, touch
from tissue.cutting.workspace import Cut
from tissue.geometry.exact_predicates import nearest
from tissue.geometry.tetrahedron import smallest_altitude, tetrahedron_volume
from tissue.mesh.angular_momentum import note_spin
from tissue.mesh.body import local_index, relative_density
from tissue.mesh.changes import PASS_NODES, SPARE_NODES, note_child, note_dirty
from tissue.mesh.star import edge_star

NO_ROOM = -1
"""Returned in place of a node where the arrays must grow first."""


@kernel
def split_edge(cut: Cut, a: int, b: int, t: float) -> int:
    """Insert a node into edge ab at fraction `t` from a; return the node, or NO_ROOM."""
    n = edge_star(cut.body, cut.visits, a, b, cut.scratch.parents)
    return _split(cut, n, 2, a, b, -1, Vec3(1.0 - t, t, 0.0))


@kernel
def split_face(cut: Cut, a: int, b: int, c: int, w: Vec3) -> int:
    """Insert a node into face abc; return the node, or NO_ROOM.

    Args:
        cut: Read and written.
        a: First corner.
        b: Second corner.
        c: Third corner.
        w: Barycentric weights of the node.
    """
    n = _face_star(cut, a, b, c)
    return _split(cut, n, 3, a, b, c, w)


@kernel
def _face_star(cut: Cut, a: int, b: int, c: int) -> int:
    parents = cut.scratch.parents
    n = edge_star(cut.body, cut.visits, a, b, parents)
    kept = 0
    for i in range(n):
        if local_index(cut.body, parents[i], c) >= 0:
            parents[kept] = parents[i]
            kept += 1
    return kept


@kernel
def edge_split_is_good(cut: Cut, a: int, b: int, t: float) -> bool:
    """Return whether splitting edge ab at `t` splits no core, and every altitude stays high."""
    n = edge_star(cut.body, cut.visits, a, b, cut.scratch.parents)
    return _children_are_good(cut, n, 2, a, b, -1, Vec3(1.0 - t, t, 0.0))


@kernel
def face_split_is_good(cut: Cut, a: int, b: int, c: int, w: Vec3) -> bool:
    """Return whether splitting face abc splits no core, and leaves altitudes above the guard.

    Args:
        cut: Body and limits.
        a: First corner.
        b: Second corner.
        c: Third corner.
        w: Barycentric weights of the node to insert.
    """
    n = _face_star(cut, a, b, c)
    return _children_are_good(cut, n, 3, a, b, c, w)


@kernel
def is_edge_of_core(cut: Cut, a: int, b: int) -> bool:
    """Return whether edge ab is of a rigid core, which is not split."""
    body, parents = cut.body, cut.scratch.parents
    if body.n_rigid == 0:
        return False
    is_of_core = False
    for i in range(edge_star(body, cut.visits, a, b, parents)):
        is_of_core = is_of_core or body.is_rigid[parents[i]]
    return is_of_core


@kernel
def _pick(i: int, a: int, b: int, c: int) -> int:
    return a if i == 0 else (b if i == 1 else c)


@kernel
def _mix(values: FloatArray, a: int, b: int, c: int, w: Vec3, x: int) -> float:
    """Return component `x` of a field at weights `w` of nodes a, b and, unless it is -1, c."""
    value: float = w.x * values[a, x] + w.y * values[b, x]
    if c >= 0:
        value += w.z * values[c, x]
    return value


@kernel
def _children_are_good(cut: Cut, n: int, n_ends: int, a: int, b: int, c: int, w: Vec3) -> bool:
    body = cut.body
    rest = body.rest
    p = Vec3(_mix(rest, a, b, c, w, 0), _mix(rest, a, b, c, w, 1), _mix(rest, a, b, c, w, 2))
    for i in range(n):
        t = cut.scratch.parents[i]
        if body.is_rigid[t]:
            return False
        for e in range(n_ends):
            replaced = _pick(e, a, b, c)
            q0 = p if body.tetrahedra[t, 0] == replaced else vec3(rest, body.tetrahedra[t, 0])
            q1 = p if body.tetrahedra[t, 1] == replaced else vec3(rest, body.tetrahedra[t, 1])
            q2 = p if body.tetrahedra[t, 2] == replaced else vec3(rest, body.tetrahedra[t, 2])
            q3 = p if body.tetrahedra[t, 3] == replaced else vec3(rest, body.tetrahedra[t, 3])
            if smallest_altitude(q0, q1, q2, q3) < cut.limits.guard:
                return False
    return True


@kernel
def _split(cut: Cut, n: int, n_ends: int, a: int, b: int, c: int, w: Vec3) -> int:
    """Split the first `n` of `scratch.parents`, which all hold a, b (and c), at weights `w`.

    Child e of a parent is the parent with its end e replaced by the new node. Child 0 takes the
    parent's place, the others are appended.
    """
    body, scratch, change = cut.body, cut.scratch, cut.change
    n_appended = n * (n_ends - 1)
    if (
        n == 0
        or body.n_nodes + SPARE_NODES > len(body.rest)
        or body.n_tetrahedra + n_appended > len(body.tetrahedra)
        or change.n_flagged > PASS_NODES
    ):
        change.is_full = 1
        return NO_ROOM
    node = _new_node(cut, a, b, c, w)
    for i in range(n):
        t = scratch.parents[i]
        scratch.place[t] = i
        scratch.children[i, 0] = t
        for e in range(1, n_ends):
            scratch.children[i, e] = body.n_tetrahedra
            body.n_tetrahedra += 1
        for f in range(4):
            scratch.parent_links[i, f] = body.links[t, f]
    _note_spin(cut, n, n_ends, a, b, c, w, node)
    for i in range(n):
        _make_children(cut, i, n_ends, a, b, c, node)
    for i in range(n):
        for e in range(n_ends):
            _link_child(cut, n, i, e, n_ends, a, b, c)
    return node


@kernel
def _new_node(cut: Cut, a: int, b: int, c: int, w: Vec3) -> int:
    """Append a node; position and velocity are linear, which keeps momentum and strain."""
    body = cut.body
    node = body.n_nodes
    body.n_nodes += 1
    for x in range(3):
        body.rest[node, x] = _mix(body.rest, a, b, c, w, x)
        body.positions[node, x] = _mix(body.positions, a, b, c, w, x)
        body.velocities[node, x] = _mix(body.velocities, a, b, c, w, x)
    p = nearest(body.lattice, vec3(body.rest, node))
    body.lattice_rest[node, 0] = p.x
    body.lattice_rest[node, 1] = p.y
    body.lattice_rest[node, 2] = p.z
    body.fixed[node] = body.fixed[a] and body.fixed[b] and (c < 0 or body.fixed[c])
    body.masses[node] = 0.0
    body.twin[node] = node
    body.off_path[node] = 0.0
    touch(cut.surface, node)
    return node


@kernel
def _note_spin(cut: Cut, n: int, n_ends: int, a: int, b: int, c: int, w: Vec3, node: int) -> None:
    """Store the rotation of the ends about the new node: it has a share of their masses now."""
    body, volume = cut.body, 0.0
    for i in range(n):
        t = cut.scratch.parents[i]
        volume += relative_density(body, t) * tetrahedron_volume(body.rest, body.tetrahedra, t)
    place, velocity = vec3(body.positions, node), vec3(body.velocities, node)
    for e in range(n_ends):
        end = _pick(e, a, b, c)
        weight = w.x if e == 0 else (w.y if e == 1 else w.z)
        arm = sub(vec3(body.positions, end), place)
        motion = sub(vec3(body.velocities, end), velocity)
        note_spin(cut.change, weight * volume, arm, motion)


@kernel
def _make_children(cut: Cut, i: int, n_ends: int, a: int, b: int, c: int, node: int) -> None:
    body, scratch = cut.body, cut.scratch
    parent = scratch.parents[i]
    side = decided_side(cut.surface, parent)
    # The last child first: child 0 overwrites the parent.
    for back in range(n_ends):
        e = n_ends - 1 - back
        child = scratch.children[i, e]
        for k in range(4):
            old = body.tetrahedra[parent, k]
            body.tetrahedra[child, k] = node if old == _pick(e, a, b, c) else old
        decide_side(cut.surface, child, side)
        note_dirty(cut.change, child)
        if child != parent:
            body.material[child] = body.material[parent]
            note_child(cut.change, child, parent)
    for e in range(n_ends):
        child = scratch.children[i, e]
        for k in range(4):
            body.node_tetrahedron[body.tetrahedra[child, k]] = child


@kernel
def _link_child(cut: Cut, n: int, i: int, e: int, n_ends: int, a: int, b: int, c: int) -> None:
    body, scratch = cut.body, cut.scratch
    child = scratch.children[i, e]
    own = _end_at(cut, i, e, n_ends, a, b, c)
    for f in range(4):
        old = scratch.parent_links[i, f]
        other_end = -1
        for j in range(n_ends):
            if j != e and _end_at(cut, i, j, n_ends, a, b, c) == f:
                other_end = j
        if f == own:  # the parent's face opposite this end: the neighbour stays
            body.links[child, f] = old
            if old >= 0:
                body.links[old // 4, old % 4] = 4 * child + f
        elif other_end >= 0:  # between two children of this parent
            body.links[child, f] = 4 * scratch.children[i, other_end] + own
        elif old >= 0:  # between children of two parents
            body.links[child, f] = 4 * scratch.children[scratch.place[old // 4], e] + old % 4
        else:
            body.links[child, f] = old


@kernel
def _end_at(cut: Cut, i: int, e: int, n_ends: int, a: int, b: int, c: int) -> int:
    """Return the local place of end `e` in parent `i`: a sibling of child `e` still holds it."""
    sibling = cut.scratch.children[i, (e + 1) % n_ends]
    return local_index(cut.body, sibling, _pick(e, a, b, c))
