"""Tetrahedra that bridge the cut: behind the blade, with nodes on both sides of the cut surface.

Every edge that the blade crosses gets a node on the cut surface. An edge between the two sides can
only remain where the cut surface turns within an element, so that a node was on one side of it at
first and on the other later. Such edges are found when a tetrahedron leaves the list of active
ones, and cut. An edge of the mesh ahead of the cut surface, or beyond the path of its ends, is no
bridge.
"""

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, dot, lerp, sub, vec3
from tissue.cutting.blade_path import Path, Plane, is_unswept, nearest_on_edge, plane_at
from tissue.cutting.cut_surface import note_side, on_cut_surface, side_of
from tissue.cutting.snapping import insert_crossing, snap_distance
from tissue.cutting.workspace import Cut, flag
from tissue.mesh.changes import LISTS


@kernel
def resolve_bridges(cut: Cut) -> None:
    """Cut the bridges among tetrahedra that were active or changed and are no longer active.

    These tetrahedra stay in `scratch.previous`: `separation` marks their faces once more.
    """
    scratch, visits = cut.scratch, cut.visits
    visits.epoch += 1
    epoch = visits.epoch
    for i in range(scratch.n_active):
        visits.tetrahedra[scratch.active[i]] = epoch
    # The searches below overwrite `visits`, so the list is filtered first.
    n = 0
    for i in range(scratch.n_previous):
        if visits.tetrahedra[scratch.previous[i]] != epoch:
            scratch.previous[n] = scratch.previous[i]
            n += 1
    scratch.n_previous = n
    for i in range(n):
        _resolve(cut, scratch.previous[i])
        if cut.change.is_full != 0:
            return


@kernel
def remember_active(cut: Cut) -> None:
    """Keep the tetrahedra that are active or changed now, for the next `resolve_bridges`."""
    scratch, change = cut.scratch, cut.change
    n = 0
    if scratch.n_active + change.n_dirty > len(scratch.previous):
        change.lacks_room = LISTS
        return
    for i in range(scratch.n_active):
        scratch.previous[n] = scratch.active[i]
        n += 1
    for i in range(change.n_dirty):
        scratch.previous[n] = change.dirty[i]
        n += 1
    scratch.n_previous = n


@kernel
def _resolve(cut: Cut, t: int) -> None:
    body, surface = cut.body, cut.surface
    for p in range(3):
        for q in range(p + 1, 4):
            a = min(body.tetrahedra[t, p], body.tetrahedra[t, q])
            b = max(body.tetrahedra[t, p], body.tetrahedra[t, q])
            if on_cut_surface(surface, a) or on_cut_surface(surface, b):
                continue
            if side_of(surface, a) * side_of(surface, b) < 0:
                _resolve_edge(cut, a, b)
                return


@kernel
def _resolve_edge(cut: Cut, a: int, b: int) -> None:
    """Cut an edge between the two sides, or correct the side of a node far from the blade."""
    body, surface = cut.body, cut.surface
    pa = vec3(body.rest, a)
    pb = vec3(body.rest, b)
    segment = _nearest_segment(cut.path, lerp(0.5, pa, pb))
    if segment < 0:
        return
    height_a = _height(plane_at(cut.path, segment, pa), pa)
    height_b = _height(plane_at(cut.path, segment, pb), pb)
    if height_a * height_b < 0.0:
        t = height_a / (height_a - height_b)
        if not is_unswept(cut.path, lerp(t, pa, pb), cut.limits.floor, cut.limits.guard):
            insert_crossing(cut, a, b, segment, t)
        return
    side = 1 if height_a + height_b >= 0.0 else -1
    wrong = a if side_of(surface, a) != side else b
    height = abs(height_a) if wrong == a else abs(height_b)
    if height < snap_distance(cut, wrong):
        flag(cut, wrong)
    else:
        note_side(surface, wrong, side, True)


@kernel
def _height(plane: Plane, p: Vec3) -> float:
    return dot(sub(p, plane.point), plane.normal)


@kernel
def _nearest_segment(path: Path, p: Vec3) -> int:
    """Return the segment of the edge nearest to `p` [m]; -1 beyond tip or heel: no cut there."""
    near = nearest_on_edge(path, p)
    last = len(path.linked) - 2
    beyond = (near.segment == 0 and near.along <= 0.0) or (
        near.segment == last and near.along >= 1.0
    )
    return -1 if beyond else near.segment
