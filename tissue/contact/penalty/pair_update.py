"""Update of the pairs: faces ask for nodes near them where a node left its ball or a face changed.

A cut, or a lip that the blade drags along, costs its neighbourhood and not the body.
"""

import math

from tissue.contact.faces import NO_FACE, Faces, is_face_of_cut
from tissue.contact.node_normals import area_at_rest
from tissue.contact.penalty.near_pairs import CONTACT_REACH, NearPairs
from tissue.contact.penalty.node_grid import (
    Asking,
    NodeGrid,
    arrange_grid,
    enter_node,
    find_in_box,
    find_near_face,
)
from tissue.contact.penalty.node_ways import (
    BALL,
    LARGEST_BALL,
    NOTCHED,
    NodeWays,
    begin_ball,
    has_left_middle,
)
from tissue.contact.penalty.ridges import Ridges, find_changed_ridges
from tissue.contact.piece_boxes import may_touch, update_piece_boxes
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

OF_ONE_SHEET = 4.0
"""Distance at rest between a node and a corner of a face up to which they are skin of one sheet
that does not touch itself, per node size: about an edge of a tetrahedron."""

SKIN_WAY = 0.5
"""Way of any node after which it is asked again which skin is near another piece, per node size.
Larger: more skin is paired; smaller: all skin is tested more often."""


@kernel
def update_pairs(
    pairs: NearPairs,
    ways: NodeWays,
    ridges: Ridges,
    faces: Faces,
    body: Body,
    normal: FloatArray,
) -> bool:
    """Pair anew what left its ball or changed; return False if there is no room, to call again.

    Args:
        pairs: Written.
        ways: Balls of nodes that are paired anew are laid anew.
        ridges: Those of faces that changed are found anew.
        faces: The faces that may touch.
        body: Where the nodes are.
        normal: Normal of each node, weighted by area [m2], shape (capacity, 3).
    """
    if faces.n_places > len(pairs.triangle):
        return False
    take_faces(pairs, ways, faces, body)
    pairs.n_updates += 1
    if pairs.changed_at == pairs.n_updates:
        find_changed_ridges(ridges, pairs, faces, body)
        _list_nodes(pairs, ways, faces, body)
    else:
        _keep_nodes(pairs, ways, body)
    for at in range(faces.n_places):
        if pairs.is_active[at] == 1 and _has_moved_corner(pairs, at):
            pairs.dirty_at[at] = pairs.n_updates
    _mark_kept_pairs(pairs)
    _enter_nodes(pairs, ways, normal)
    box = _box_of_moved(pairs, ways)
    for at in range(faces.n_places):
        if pairs.is_active[at] == 0:
            continue
        if pairs.dirty_at[at] == pairs.n_updates:
            asking = _asking(pairs, ways, at)
            store_box(pairs.low, pairs.high, at, asking.box)
            _ask(pairs, ways, faces, body, pairs.slow, asking)
            _ask(pairs, ways, faces, body, pairs.fast, asking)
        elif _is_near_moved(pairs, ways, at, box):
            _ask(pairs, ways, faces, body, pairs.anew, _asking(pairs, ways, at))
    if pairs.n_kept + pairs.n_found > len(pairs.wake) // 2:
        return False
    _join_pairs(pairs)
    return True


@kernel
def take_faces(pairs: NearPairs, ways: NodeWays, faces: Faces, body: Body) -> bool:
    """Note faces that changed, and skin that came near other skin or left it; return if any.

    They are dirty in the next update.
    """
    has_any = False
    has_skin_moved = faces.has_skin == 1 and not ways.largest_way <= SKIN_WAY * ways.node_size
    reach = (2.0 * SKIN_WAY + CONTACT_REACH + 2.0 * BALL) * ways.node_size
    if has_skin_moved:
        update_piece_boxes(faces, body, reach)
        ways.largest_way = 0.0
    for at in range(faces.n_places):
        has_changed = pairs.seen_generation[at] != faces.generation[at]
        if not (has_changed or has_skin_moved):
            continue
        face = faces.face[at]
        is_wanted = face != NO_FACE and (
            may_touch(faces, body, at, reach, has_skin_moved) or _is_folded(ways, faces, at)
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
def _is_folded(ways: NodeWays, faces: Faces, at: int) -> bool:
    """Whether a corner of a face is in a fold."""
    node, is_folded = faces.node, ways.is_folded
    a, b, c = is_folded[node[at, 0]], is_folded[node[at, 1]], is_folded[node[at, 2]]
    return bool(a + b + c > 0)


@kernel
def _list_nodes(pairs: NearPairs, ways: NodeWays, faces: Faces, body: Body) -> None:
    """List the nodes of active faces, and which of them are to be paired anew."""
    now = pairs.n_updates
    pairs.n_nodes = 0
    pairs.n_moved = 0
    for at in range(faces.n_places):
        if pairs.is_active[at] == 0:
            continue
        for q in range(3):
            node = pairs.triangle[at, q]
            if pairs.seen_at[node] != now:
                if pairs.seen_at[node] != now - 1 or has_left_middle(ways, body, node):
                    _begin_anew(pairs, ways, body, node)
                pairs.seen_at[node] = now
                pairs.nodes[pairs.n_nodes] = node
                pairs.n_nodes += 1
            if pairs.is_of_cut[at] == 1 and pairs.cut_at[node] != now:
                if pairs.cut_at[node] != now - 1 and pairs.moved_at[node] != now:
                    _begin_anew(pairs, ways, body, node)
                pairs.cut_at[node] = now


@kernel
def _keep_nodes(pairs: NearPairs, ways: NodeWays, body: Body) -> None:
    """Find the nodes to be paired anew where no face has changed; see `_list_nodes`."""
    now = pairs.n_updates
    pairs.n_moved = 0
    for i in range(pairs.n_nodes):
        node = pairs.nodes[i]
        if has_left_middle(ways, body, node):
            _begin_anew(pairs, ways, body, node)
        pairs.seen_at[node] = now
        if pairs.cut_at[node] == now - 1:
            pairs.cut_at[node] = now


@kernel
def _begin_anew(pairs: NearPairs, ways: NodeWays, body: Body, node: int) -> None:
    """Lay the ball of a node anew, and list it as one to be paired."""
    pairs.moved_at[node] = pairs.n_updates
    pairs.moved[pairs.n_moved] = node
    pairs.n_moved += 1
    begin_ball(ways, body, node)
    if pairs.is_lost[node] == 1:
        ways.radius[node] = LARGEST_BALL * ways.node_size


@kernel
def _has_moved_corner(pairs: NearPairs, at: int) -> bool:
    """Whether a node of a face is paired anew."""
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
            pairs.lost_at[node] = now
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
def _box_of_moved(pairs: NearPairs, ways: NodeWays) -> Aabb:
    """Return the box around the balls of the nodes that are paired anew."""
    box = empty_box()
    for i in range(pairs.n_moved):
        node = pairs.moved[i]
        p, r = vec3(ways.reference, node), ways.radius[node]
        box = with_point(with_point(box, Vec3(p.x - r, p.y - r, p.z - r)), p)
        box = with_point(box, Vec3(p.x + r, p.y + r, p.z + r))
    return box


@kernel
def _asking(pairs: NearPairs, ways: NodeWays, at: int) -> Asking:
    """Return a face as it asks for nodes."""
    x, r = ways.reference, ways.radius
    a, b, c = pairs.triangle[at, 0], pairs.triangle[at, 1], pairs.triangle[at, 2]
    i, j, k = vec3(x, a), vec3(x, b), vec3(x, c)
    area = cross(sub(j, i), sub(k, i))
    reach = max(r[a], max(r[b], r[c])) + CONTACT_REACH * ways.node_size
    corners = with_point(with_point(Aabb(i, i), j), k)
    box = widened(corners, reach + BALL * ways.node_size)
    return Asking(at, (a, b, c), i, area, math.sqrt(dot(area, area)), reach, box)


@kernel
def _enter_nodes(pairs: NearPairs, ways: NodeWays, normal: FloatArray) -> None:
    """Put the nodes of faces into the grids."""
    slow, fast, anew = pairs.slow, pairs.fast, pairs.anew
    slow.n_items = fast.n_items = anew.n_items = 0
    most = _MOST_OF_SLOW * ways.node_size
    for i in range(pairs.n_nodes):
        node = pairs.nodes[i]
        if ways.radius[node] <= most:
            enter_node(slow, node)
        else:
            enter_node(fast, node)
        if pairs.moved_at[node] == pairs.n_updates:
            enter_node(anew, node)
    arrange_grid(slow, ways, normal, _CELL * ways.node_size)
    arrange_grid(fast, ways, normal, _LARGE_CELL * ways.node_size)
    arrange_grid(anew, ways, normal, _LARGE_CELL * ways.node_size)


@kernel
def _is_near_moved(pairs: NearPairs, ways: NodeWays, at: int, box: Aabb) -> bool:
    """Whether a node that is paired anew is near a face; `box`: that around all of them."""
    own = box_at(pairs.low, pairs.high, at)
    return overlap(own, box) and find_in_box(pairs.anew, own, ways.node_size) > 0


@kernel
def _ask(
    pairs: NearPairs, ways: NodeWays, faces: Faces, body: Body, grid: NodeGrid, face: Asking
) -> None:
    """Pair a face with the nodes of a grid that may touch it; see `update_pairs`."""
    room = len(pairs.wake) // 2
    for i in range(find_near_face(grid, face, ways.node_size)):
        node = grid.found[i]
        if node in face.nodes or _is_same_skin(pairs, ways, faces, body, face.at, node):
            continue
        if pairs.n_found < room:
            pairs.found_node[pairs.n_found] = node
            pairs.found_face[pairs.n_found] = face.at
            pairs.end[node] += 1
        pairs.n_found += 1


@kernel
def _is_same_skin(
    pairs: NearPairs, ways: NodeWays, faces: Faces, body: Body, at: int, node: int
) -> bool:
    """Whether a face or a node is only of skin, and both are of one sheet of one piece.

    Args:
        pairs: Which faces and nodes are of cuts.
        ways: Which nodes are on the walls of notches.
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
    d, apart = sub(vec3(body.rest, node), vec3(body.rest, a)), OF_ONE_SHEET * ways.node_size
    if dot(d, d) > apart * apart:
        return False
    is_before = dot(d, area_at_rest(body, a, b, c)) > 0.0
    return not (is_before and ways.is_folded[node] == NOTCHED)


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
