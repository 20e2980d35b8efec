"""Update of the pairs: faces query nodes near them where a node left its ball or a face changed.

A cut, or a lip that the blade drags along, costs its neighbourhood and not the body.
"""

import math

from tissue.contact.geometry.faces import (
    NO_FACE,
    Faces,
    area_at_rest,
    is_face_of_cut,
    may_touch,
    update_piece_boxes,
)
from tissue.contact.search.feature_edges import FeatureEdges, find_changed_edges
from tissue.contact.search.near_pairs import CONTACT_REACH, NearPairs
from tissue.contact.search.node_grid import (
    FaceQuery,
    NodeGrid,
    arrange_grid,
    enter_node,
    find_in_box,
    find_near_face,
)
from tissue.contact.search.node_motion import (
    BALL,
    LARGEST_BALL,
    NOTCH,
    NodeMotion,
    begin_ball,
    has_left_middle,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, sub, vec3
from tissue.geometry.aabb import (
    Aabb,
    box_at,
    empty_box,
    overlap,
    store_box,
    widened,
    with_point,
)
from tissue.mesh.body import Body

_MOST_OF_SLOW = 0.2
"""Radius of a ball up to which its node is among the slow, per node size."""

_CELL, _LARGE_CELL = 1.4, 3.0
"""Edges of the cells of slow and of other nodes, per node size."""

_OF_ONE_SHEET = 4.0
"""Distance at rest between a node and a corner of a face up to which they are skin of one sheet
that does not touch itself, per node size: about an edge of a tetrahedron."""

SKIN_PATH = 0.5
"""Path of any node after which it is tested again which skin is near another piece, per node size.
Larger: more skin is paired; smaller: all skin is tested more often."""


@kernel
def update_pairs(
    pairs: NearPairs,
    motion: NodeMotion,
    edges: FeatureEdges,
    faces: Faces,
    body: Body,
    normal: FloatArray,
) -> bool:
    """Pair again what left its ball or changed; return False if there is no room, to call again.

    Args:
        pairs: Written.
        motion: Balls of nodes that are paired again are laid again.
        edges: Those of faces that changed are found again.
        faces: The faces that may touch.
        body: Where the nodes are.
        normal: Normal of each node, weighted by area [m2], shape (capacity, 3).
    """
    if faces.n_places > len(pairs.triangle):
        return False
    take_faces(pairs, motion, faces, body)
    pairs.n_updates += 1
    if pairs.changed_at == pairs.n_updates:
        find_changed_edges(edges, pairs, faces, body)
        _list_nodes(pairs, motion, faces, body)
    else:
        _keep_nodes(pairs, motion, body)
    for at in range(faces.n_places):
        if pairs.is_active[at] == 1 and _has_moved_corner(pairs, at):
            pairs.dirty_at[at] = pairs.n_updates
    _mark_kept_pairs(pairs)
    _enter_nodes(pairs, motion, normal)
    box = _box_of_moved(pairs, motion)
    for at in range(faces.n_places):
        if pairs.is_active[at] == 0:
            continue
        if pairs.dirty_at[at] == pairs.n_updates:
            query = _query(pairs, motion, at)
            store_box(pairs.low, pairs.high, at, query.box)
            _pair_face(pairs, motion, faces, body, pairs.slow, query)
            _pair_face(pairs, motion, faces, body, pairs.fast, query)
        elif _is_near_moved(pairs, motion, at, box):
            _pair_face(pairs, motion, faces, body, pairs.renewed, _query(pairs, motion, at))
    if pairs.n_kept + pairs.n_found > len(pairs.wake) // 2:
        return False
    _join_pairs(pairs)
    return True


@kernel
def take_faces(pairs: NearPairs, motion: NodeMotion, faces: Faces, body: Body) -> bool:
    """Record faces that changed, and skin that came near other skin or left it; return if any.

    They are dirty in the next update.
    """
    has_any = False
    has_skin_moved = faces.has_skin == 1 and not motion.largest_path <= SKIN_PATH * motion.node_size
    reach = (2.0 * SKIN_PATH + CONTACT_REACH + 2.0 * BALL) * motion.node_size
    if has_skin_moved:
        update_piece_boxes(faces, body, reach)
        motion.largest_path = 0.0
    for at in range(faces.n_places):
        has_changed = pairs.seen_generation[at] != faces.generation[at]
        if not (has_changed or has_skin_moved):
            continue
        face = faces.face[at]
        is_wanted = face != NO_FACE and (
            may_touch(faces, body, at, reach, has_skin_moved) or _is_near_itself(motion, faces, at)
        )
        if not has_changed and is_wanted == (pairs.is_active[at] == 1):
            continue
        pairs.seen_generation[at] = faces.generation[at]
        pairs.is_active[at] = is_wanted
        pairs.dirty_at[at] = pairs.n_updates + 1
        pairs.changed_at = pairs.n_updates + 1
        has_any = True
        if is_wanted:
            pairs.is_of_cut[at] = is_face_of_cut(faces, body, at)
            pairs.tetrahedron[at] = face // 4
            for q in range(3):
                pairs.triangle[at, q] = faces.node[at, q]
    return has_any


@kernel
def _is_near_itself(motion: NodeMotion, faces: Faces, at: int) -> bool:
    """Whether a corner of a face is near skin of its own piece."""
    node, self_proximity = faces.node, motion.self_proximity
    a, b, c = self_proximity[node[at, 0]], self_proximity[node[at, 1]], self_proximity[node[at, 2]]
    return bool(a + b + c > 0)


@kernel
def _list_nodes(pairs: NearPairs, motion: NodeMotion, faces: Faces, body: Body) -> None:
    """List the nodes of active faces, and which of them are to be paired again."""
    now = pairs.n_updates
    pairs.n_nodes = 0
    pairs.n_moved = 0
    for at in range(faces.n_places):
        if pairs.is_active[at] == 0:
            continue
        for q in range(3):
            node = pairs.triangle[at, q]
            if pairs.seen_at[node] != now:
                if pairs.seen_at[node] != now - 1 or has_left_middle(motion, body, node):
                    _renew(pairs, motion, body, node)
                pairs.seen_at[node] = now
                pairs.nodes[pairs.n_nodes] = node
                pairs.n_nodes += 1
            if pairs.is_of_cut[at] == 1 and pairs.cut_at[node] != now:
                if pairs.cut_at[node] != now - 1 and pairs.moved_at[node] != now:
                    _renew(pairs, motion, body, node)
                pairs.cut_at[node] = now


@kernel
def _keep_nodes(pairs: NearPairs, motion: NodeMotion, body: Body) -> None:
    """Find the nodes to be paired again where no face has changed; see `_list_nodes`."""
    now = pairs.n_updates
    pairs.n_moved = 0
    for i in range(pairs.n_nodes):
        node = pairs.nodes[i]
        if has_left_middle(motion, body, node):
            _renew(pairs, motion, body, node)
        pairs.seen_at[node] = now
        if pairs.cut_at[node] == now - 1:
            pairs.cut_at[node] = now


@kernel
def _renew(pairs: NearPairs, motion: NodeMotion, body: Body, node: int) -> None:
    """Lay the ball of a node again, and list it as one to be paired."""
    pairs.moved_at[node] = pairs.n_updates
    pairs.moved[pairs.n_moved] = node
    pairs.n_moved += 1
    begin_ball(motion, body, node)
    if pairs.is_penetrating[node] == 1:
        motion.radius[node] = LARGEST_BALL * motion.node_size


@kernel
def _has_moved_corner(pairs: NearPairs, at: int) -> bool:
    """Whether a node of a face is paired again."""
    now, node, moved = pairs.n_updates, pairs.triangle, pairs.moved_at
    return bool(moved[node[at, 0]] == now or moved[node[at, 1]] == now or moved[node[at, 2]] == now)


@kernel
def _mark_kept_pairs(pairs: NearPairs) -> None:
    """Find the pairs that hold, and count them at their nodes, in `end`."""
    now, n = pairs.n_updates, 0
    for i in range(pairs.n_nodes):
        pairs.end[pairs.nodes[i]] = 0
    for k in range(pairs.first, pairs.first + pairs.n_pairs):
        node, at = pairs.node[k], pairs.face[k]
        has_moved = pairs.seen_at[node] != now or pairs.moved_at[node] == now
        is_kept = not (has_moved or pairs.is_active[at] == 0 or pairs.dirty_at[at] == now)
        if is_kept:
            pairs.end[node] += 1
            n += 1
        elif pairs.is_near[k] == 1:
            pairs.unpaired_at[node] = now
        pairs.is_kept[k] = is_kept
    pairs.n_kept = n
    pairs.n_found = 0


@kernel
def _copy_pair(pairs: NearPairs, k: int, to: int) -> None:
    """Copy a pair to another row."""
    pairs.node[to] = pairs.node[k]
    pairs.face[to] = pairs.face[k]
    pairs.is_near[to] = pairs.is_near[k]
    pairs.wake[to] = pairs.wake[k]
    for x in range(3):
        pairs.relative[to, x] = pairs.relative[k, x]


@kernel
def _box_of_moved(pairs: NearPairs, motion: NodeMotion) -> Aabb:
    """Return the box around the balls of the nodes that are paired again."""
    box = empty_box()
    for i in range(pairs.n_moved):
        node = pairs.moved[i]
        p, r = vec3(motion.reference, node), motion.radius[node]
        box = with_point(with_point(box, Vec3(p.x - r, p.y - r, p.z - r)), p)
        box = with_point(box, Vec3(p.x + r, p.y + r, p.z + r))
    return box


@kernel
def _query(pairs: NearPairs, motion: NodeMotion, at: int) -> FaceQuery:
    """Return the query of a face for nodes."""
    x, r = motion.reference, motion.radius
    a, b, c = pairs.triangle[at, 0], pairs.triangle[at, 1], pairs.triangle[at, 2]
    i, j, k = vec3(x, a), vec3(x, b), vec3(x, c)
    area = cross(sub(j, i), sub(k, i))
    reach = max(r[a], max(r[b], r[c])) + CONTACT_REACH * motion.node_size
    corners = with_point(with_point(Aabb(i, i), j), k)
    box = widened(corners, reach + BALL * motion.node_size)
    return FaceQuery(at, (a, b, c), i, area, math.sqrt(dot(area, area)), reach, box)


@kernel
def _enter_nodes(pairs: NearPairs, motion: NodeMotion, normal: FloatArray) -> None:
    """Put the nodes of faces into the grids."""
    slow, fast, renewed = pairs.slow, pairs.fast, pairs.renewed
    slow.n_items = fast.n_items = renewed.n_items = 0
    most = _MOST_OF_SLOW * motion.node_size
    for i in range(pairs.n_nodes):
        node = pairs.nodes[i]
        if motion.radius[node] <= most:
            enter_node(slow, node)
        else:
            enter_node(fast, node)
        if pairs.moved_at[node] == pairs.n_updates:
            enter_node(renewed, node)
    arrange_grid(slow, motion, normal, _CELL * motion.node_size)
    arrange_grid(fast, motion, normal, _LARGE_CELL * motion.node_size)
    arrange_grid(renewed, motion, normal, _LARGE_CELL * motion.node_size)


@kernel
def _is_near_moved(pairs: NearPairs, motion: NodeMotion, at: int, box: Aabb) -> bool:
    """Whether a node that is paired again is near a face; `box`: that around all of them."""
    own = box_at(pairs.low, pairs.high, at)
    return overlap(own, box) and find_in_box(pairs.renewed, own, motion.node_size) > 0


@kernel
def _pair_face(
    pairs: NearPairs, motion: NodeMotion, faces: Faces, body: Body, grid: NodeGrid, face: FaceQuery
) -> None:
    """Pair a face with the nodes of a grid that may touch it; see `update_pairs`."""
    room = len(pairs.wake) // 2
    for i in range(find_near_face(grid, face, motion.node_size)):
        node = grid.found[i]
        if node in face.nodes or _is_same_skin(pairs, motion, faces, body, face.at, node):
            continue
        if pairs.n_found < room:
            pairs.found_node[pairs.n_found] = node
            pairs.found_face[pairs.n_found] = face.at
            pairs.end[node] += 1
        pairs.n_found += 1


@kernel
def _is_same_skin(
    pairs: NearPairs, motion: NodeMotion, faces: Faces, body: Body, at: int, node: int
) -> bool:
    """Whether a face or a node is only of skin, and both are of one sheet of one piece.

    Args:
        pairs: Which faces and nodes are of cuts.
        motion: Which nodes are on the walls of notches.
        faces: The piece that each face is of.
        body: The body at rest.
        at: Place of the face.
        node: The node.
    """
    if pairs.is_of_cut[at] == 1 and pairs.cut_at[node] == pairs.n_updates:
        return False
    piece = faces.piece[body.node_tetrahedron[node]]
    if piece < 0 or piece != faces.piece[pairs.tetrahedron[at]]:
        return False
    a, b, c = pairs.triangle[at, 0], pairs.triangle[at, 1], pairs.triangle[at, 2]
    d, apart = sub(vec3(body.rest, node), vec3(body.rest, a)), _OF_ONE_SHEET * motion.node_size
    if dot(d, d) > apart * apart:
        return False
    is_before = dot(d, area_at_rest(body, a, b, c)) > 0.0
    return not (is_before and motion.self_proximity[node] == NOTCH)


@kernel
def _join_pairs(pairs: NearPairs) -> None:
    """Write the pairs that hold, and those found, by their nodes into the other list; use that."""
    first, total = len(pairs.wake) // 2 - pairs.first, 0
    for i in range(pairs.n_nodes):
        node = pairs.nodes[i]
        pairs.begin[node] = first + total
        total += pairs.end[node]
        pairs.end[node] = pairs.begin[node]
    for k in range(pairs.first, pairs.first + pairs.n_pairs):
        if pairs.is_kept[k] == 1:
            node = pairs.node[k]
            _copy_pair(pairs, k, pairs.end[node])
            pairs.end[node] += 1
    for i in range(pairs.n_found):
        node = pairs.found_node[i]
        k = pairs.end[node]
        pairs.node[k], pairs.face[k] = node, pairs.found_face[i]
        pairs.is_near[k], pairs.wake[k] = 0, -1.0
        pairs.end[node] += 1
    pairs.first, pairs.n_pairs = first, total
