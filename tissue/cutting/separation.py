"""Separation: cut the links across the faces on the cut surface, and give each lip its own nodes.

A face is cut if its three nodes lie on the cut surface and its two tetrahedra are on different
sides of the cut surface. A node whose tetrahedra are then no longer connected through faces is
doubled.
"""

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, sub, vec3
from tissue.cutting.blade_path import plane_near
from tissue.cutting.cut_surface import (
    decide_side,
    decided_side,
    note_side,
    on_cut_surface,
    put_on_cut_surface,
    rank_of,
    side_of,
)
from tissue.cutting.workspace import Cut
from tissue.geometry.tetrahedron import face_area, tetrahedron_volume
from tissue.mesh.body import CUT, Body, local_index
from tissue.mesh.changes import NODES, note_dirty, note_face
from tissue.mesh.star import star

FRAGMENT_TETRAHEDRA = 16
"""Tetrahedra that a fragment has at most: a closed piece of more of them is always cut loose."""


@kernel
def open_cut_surface(cut: Cut) -> None:
    """Cut the faces on the cut surface, and double their nodes."""
    _mark_faces(cut)
    _keep_fragments(cut)
    open_faces(cut)
    for i in range(cut.change.n_flagged):
        _detach_fans(cut, cut.change.flagged[i])


@kernel
def open_faces(cut: Cut) -> None:
    """Count the area of the faces whose links were cut in this pass, and double their nodes."""
    change = cut.change
    for i in range(change.n_faces):
        if change.faces[i, 1] >= 0:
            change.area += face_area(
                cut.body.rest, cut.body.tetrahedra, change.faces[i, 0], change.faces[i, 1]
            )
            _detach_along_face(cut, i)


@kernel
def close_cut_surface(cut: Cut) -> None:
    """Cut what remains along the whole cut surface: by now the sides of all its nodes are known."""
    surface = cut.surface
    for i in range(surface.n_nodes):
        _mark_faces_at_node(cut, surface.nodes[i])
    open_cut_surface(cut)


@kernel
def _mark_faces_at_node(cut: Cut, node: int) -> None:
    around = cut.scratch.around_too
    n = star(cut.body, cut.visits, node, cut.body.node_tetrahedron[node], around)
    for i in range(n):
        _mark_faces_of(cut, around[i])


@kernel
def _mark_faces(cut: Cut) -> None:
    """Cut every face between the two sides: near the blade, behind it, and at new nodes."""
    scratch, change = cut.scratch, cut.change
    for i in range(scratch.n_active):
        _mark_faces_of(cut, scratch.active[i])
    for i in range(scratch.n_previous):  # by now the sides of all their nodes are known
        _mark_faces_of(cut, scratch.previous[i])
    for i in range(change.n_flagged):
        _mark_faces_at_node(cut, change.flagged[i])


@kernel
def _mark_faces_of(cut: Cut, t: int) -> None:
    body, surface, change = cut.body, cut.surface, cut.change
    n_on = 0
    for k in range(4):
        if on_cut_surface(surface, body.tetrahedra[t, k]):
            n_on += 1
    if n_on < 3:
        return
    for f in range(4):
        link = body.links[t, f]
        if link < 0 or (n_on == 3 and on_cut_surface(surface, body.tetrahedra[t, f])):
            continue
        if n_on == 4 and not _face_is_on(cut, t, f):
            continue
        other = link // 4
        if body.is_rigid[t] and body.is_rigid[other]:
            continue  # within a core
        side = tetrahedron_side(cut, t)
        other_side = tetrahedron_side(cut, other)
        if side * other_side >= 0:
            continue
        if _is_beyond_front(cut, t, f):
            continue
        if _n_links(body, t) == 1 or _n_links(body, other) == 1:
            continue  # a tetrahedron keeps its last link: alone it would be a fragment
        decide_side(surface, t, side)
        decide_side(surface, other, other_side)
        note_face(change, t, f, other, link % 4)
        body.links[t, f] = CUT
        body.links[other, link % 4] = CUT


@kernel
def _face_is_on(cut: Cut, t: int, f: int) -> bool:
    for k in range(4):
        if k != f and not on_cut_surface(cut.surface, cut.body.tetrahedra[t, k]):
            return False
    return True


@kernel
def _is_beyond_front(cut: Cut, t: int, f: int) -> bool:
    """Return whether a face on the cut surface is beyond a crack front that it has a side in.

    Where a front bends towards the cut, the mesh may have a face in the bend.
    """
    body, surface, path = cut.body, cut.surface, cut.path
    for i in range(1, 4):
        a = body.tetrahedra[t, (f + i) % 4]
        rank = rank_of(surface, a)
        if rank == 0:
            continue
        step = 1 if rank > 0 else -1
        for j in range(1, 4):
            b = body.tetrahedra[t, (f + j) % 4]
            if rank_of(surface, b) != rank + step:
                continue
            other = body.tetrahedra[t, (f + 6 - i - j) % 4]
            along = sub(vec3(body.rest, b), vec3(body.rest, a))
            aside = sub(vec3(body.rest, other), vec3(body.rest, a))
            sample = 0 if rank > 0 else len(path.member) - 1
            turn = dot(cross(along, aside), vec3(path.sideways, sample))
            return turn * step < 0.0
    return False


@kernel
def _n_links(body: Body, t: int) -> int:
    n = 0
    for f in range(4):
        if body.links[t, f] >= 0:
            n += 1
    return n


@kernel
def tetrahedron_side(cut: Cut, t: int) -> int:
    """Return the side of the cut surface of tetrahedron `t`: +1, -1, or 0 where it is on both.

    A decision stays. Otherwise its nodes off the cut surface decide: by the side that they were
    found on, else by their positions. Where all four nodes are on the cut surface, the centroid
    decides.
    """
    decided = decided_side(cut.surface, t)
    if decided != 0:
        return decided
    body, surface = cut.body, cut.surface
    seen = 0
    n_off = 0
    mixed = False
    for k in range(4):
        node = body.tetrahedra[t, k]
        if on_cut_surface(surface, node):
            continue
        n_off += 1
        side = side_of(surface, node)
        if side != 0:
            mixed = mixed or (seen != 0 and side != seen)
            seen = side
    if mixed:
        return 0
    if seen != 0:
        return seen
    centroid = Vec3(0.0, 0.0, 0.0)
    for k in range(4):
        p = vec3(body.rest, body.tetrahedra[t, k])
        centroid = Vec3(centroid.x + 0.25 * p.x, centroid.y + 0.25 * p.y, centroid.z + 0.25 * p.z)
    plane = plane_near(cut.path, centroid)
    if n_off == 0:
        return _geometric_side(centroid, plane.point, plane.normal)
    geometric = 0
    for k in range(4):
        node = body.tetrahedra[t, k]
        if not on_cut_surface(surface, node):
            side = _geometric_side(vec3(body.rest, node), plane.point, plane.normal)
            if geometric != 0 and side != geometric:
                return 0
            geometric = side
    return geometric


@kernel
def _geometric_side(p: Vec3, on: Vec3, normal: Vec3) -> int:
    return 1 if dot(sub(p, on), normal) >= 0.0 else -1


@kernel
def _keep_fragments(cut: Cut) -> None:
    """Link small closed pieces that this pass made back to the side of larger contact."""
    change, body, scratch, visits = cut.change, cut.body, cut.scratch, cut.visits
    n_faces = change.n_faces
    first = visits.epoch + 1
    for i in range(n_faces):
        for j in range(0, 4, 2):
            start = change.faces[i, j]
            if change.faces[i, 1] < 0:
                continue
            n = small_piece(cut, start, first)
            if n == 0:
                continue
            volume = 0.0
            for m in range(n):
                volume += tetrahedron_volume(body.rest, body.tetrahedra, scratch.around[m])
            if volume <= cut.limits.crumb:
                _relink(cut, n)
            for m in range(n):  # a stamp of `first` or later means: part of a large piece
                visits.tetrahedra[scratch.around[m]] = 0


@kernel
def small_piece(cut: Cut, start: int, first: int) -> int:
    """Collect the connected piece of `start` in `scratch.around`; return its size, 0 if large.

    Tetrahedra that a search since visit `first` has stamped belong to a large piece.
    """
    body, visits, piece = cut.body, cut.visits, cut.scratch.around
    visits.epoch += 1
    epoch = visits.epoch
    if visits.tetrahedra[start] >= first:
        return 0
    visits.tetrahedra[start] = epoch
    piece[0] = start
    n = 1
    i = 0
    while i < n:
        for f in range(4):
            link = body.links[piece[i], f]
            if link >= 0 and visits.tetrahedra[link // 4] != epoch:
                if n == FRAGMENT_TETRAHEDRA or visits.tetrahedra[link // 4] >= first:
                    return 0
                visits.tetrahedra[link // 4] = epoch
                piece[n] = link // 4
                n += 1
        i += 1
    return n


@kernel
def _relink(cut: Cut, n: int) -> None:
    """Undo the cut faces between the piece in `scratch.around` and the side it touches most.

    The piece was just collected, so its tetrahedra are stamped with the current visit.
    """
    change, body, surface = cut.change, cut.body, cut.surface
    epoch = cut.visits.epoch
    area_plus = 0.0
    area_minus = 0.0
    for row in range(change.n_faces):
        outside = _outside_of_piece(cut, row, epoch)
        if outside >= 0:
            area = face_area(body.rest, body.tetrahedra, change.faces[row, 0], change.faces[row, 1])
            if decided_side(surface, outside) > 0:
                area_plus += area
            else:
                area_minus += area
    if area_plus == 0.0 and area_minus == 0.0:
        return
    side = 1 if area_plus >= area_minus else -1
    for row in range(change.n_faces):
        outside = _outside_of_piece(cut, row, epoch)
        if outside >= 0 and decided_side(surface, outside) == side:
            t = change.faces[row, 0]
            f = change.faces[row, 1]
            other = change.faces[row, 2]
            g = change.faces[row, 3]
            body.links[t, f] = 4 * other + g
            body.links[other, g] = 4 * t + f
            change.faces[row, 1] = -1
    for i in range(n):
        decide_side(surface, cut.scratch.around[i], side)


@kernel
def _outside_of_piece(cut: Cut, row: int, epoch: int) -> int:
    """Return the tetrahedron outside the piece at cut face `row`; -1 unless just one is."""
    faces, seen = cut.change.faces, cut.visits.tetrahedra
    if faces[row, 1] < 0:
        return -1
    first_in = seen[faces[row, 0]] == epoch
    second_in = seen[faces[row, 2]] == epoch
    if first_in == second_in:
        return -1
    outside: int = faces[row, 2] if first_in else faces[row, 0]
    return outside


@kernel
def _detach_along_face(cut: Cut, row: int) -> None:
    """Double the nodes of cut face `row` whose tetrahedra only it connected.

    Where a star fell apart, each part has a face that was cut in this pass.
    """
    change, body = cut.change, cut.body
    for side in range(0, 4, 2):
        t = change.faces[row, side]
        note_dirty(change, t)
        for k in range(4):
            if k != change.faces[row, side + 1]:
                _detach(cut, body.tetrahedra[t, k], t)


@kernel
def _detach_fans(cut: Cut, node: int) -> None:
    """Double a node inserted in the rim of an old cut, if the tetrahedra around it are apart."""
    body, change = cut.body, cut.change
    for i in range(change.n_dirty):
        t = change.dirty[i]
        if local_index(body, t, node) >= 0:
            _detach(cut, node, t)


@kernel
def _detach(cut: Cut, node: int, t: int) -> None:
    """Double `node` for the part of its star that holds `t`, if that is apart."""
    body, scratch, change, visits = cut.body, cut.scratch, cut.change, cut.visits
    star(body, visits, node, body.node_tetrahedron[node], scratch.around)
    if visits.tetrahedra[t] == visits.epoch:
        return
    if body.n_nodes == len(body.rest):
        change.lacks_room = NODES
        return
    n = star(body, visits, node, t, scratch.around)
    copy = _copy_node(cut, node)
    for i in range(n):
        body.tetrahedra[scratch.around[i], local_index(body, scratch.around[i], node)] = copy
        note_dirty(change, scratch.around[i])
    body.node_tetrahedron[copy] = t


@kernel
def _copy_node(cut: Cut, node: int) -> int:
    body, surface = cut.body, cut.surface
    copy = body.n_nodes
    body.n_nodes += 1
    for x in range(3):
        body.rest[copy, x] = body.rest[node, x]
        body.positions[copy, x] = body.positions[node, x]
        body.velocities[copy, x] = body.velocities[node, x]
        body.lattice_rest[copy, x] = body.lattice_rest[node, x]
    body.fixed[copy] = body.fixed[node]
    body.masses[copy] = 0.0
    body.twin[copy] = body.twin[node]
    body.twin[node] = copy
    body.off_path[copy] = body.off_path[node]
    if on_cut_surface(surface, node):
        put_on_cut_surface(surface, copy, surface.offset[node])
    rank = rank_of(surface, node)
    note_side(surface, copy, side_of(surface, node), True)
    surface.past_offset[copy] = surface.past_offset[node]
    surface.rank[copy] = rank
    return copy
