"""Collision detection (CD): the active tetrahedra, and the edges that the blade crosses.

Paper, section 3. In each step the active tetrahedra are found again from those that hold the
anchors, through faces: the cost is proportional to the number of tetrahedra along the blade.
"""

from typing import NamedTuple

from tissue.core.hash_table import (
    HashTable,
    clear_table,
    fill_slot,
    hash_of,
    is_filled,
)
from tissue.core.jit import kernel
from tissue.core.simd_rows import natural
from tissue.core.vec3 import Vec3, cross, dot, sub, vec3
from tissue.cutting.blade_path import Path, put_on_lattice
from tissue.cutting.cut_surface import on_cut_surface
from tissue.cutting.workspace import Cut
from tissue.geometry.aabb import Aabb, overlap, segment_box, tetrahedron_box
from tissue.geometry.exact_predicates import lattice_point, orient3d, pierces
from tissue.mesh.body import CUT, behind, n_behind
from tissue.mesh.changes import LISTS


@kernel
def detect_collisions(cut: Cut) -> None:
    """Find the active tetrahedra, and the edges of them that the swept edge crosses."""
    put_on_lattice(cut.path, cut.body.lattice)
    find_active_tetrahedra(cut)
    find_crossings(cut)


@kernel
def find_active_tetrahedra(cut: Cut) -> None:
    """Find the tetrahedra whose box at rest overlaps the box of a swept segment of the edge.

    The search goes through faces: from the tetrahedra that hold a sample, from those that were
    active or changed in the step before, and from one lip of an earlier cut to the other.
    """
    body, path, scratch, visits = cut.body, cut.path, cut.scratch, cut.visits
    visits.epoch += 1
    epoch = visits.epoch
    scratch.n_active = 0
    for k in range(len(path.seed)):
        if path.seed[k] >= 0:
            _visit(cut, path.seed[k], epoch, True)
    for i in range(scratch.n_previous):
        _visit(cut, scratch.previous[i], epoch, False)
    i = 0
    while i < scratch.n_active:
        t = scratch.active[i]
        i += 1
        for f in range(4):
            link = body.links[t, f]
            for k in range(n_behind(body, t, link)):
                _visit(cut, behind(body, t, link, k), epoch, False)
            if link == CUT:
                _visit_other_lip(cut, t, f, epoch)


@kernel
def _visit(cut: Cut, t: int, epoch: int, is_seed: bool) -> None:
    """Add tetrahedron `t` to the active ones if it may touch the swept edge or holds a sample."""
    scratch, visits = cut.scratch, cut.visits
    n = scratch.n_active
    if visits.tetrahedra[t] == epoch:
        return
    if n == len(scratch.active):
        cut.change.lacks_room = LISTS
        return
    visits.tetrahedra[t] = epoch
    if note_segments(cut, t, n) or is_seed:
        scratch.active[n] = t
        scratch.n_active = n + 1


@kernel
def _visit_other_lip(cut: Cut, t: int, f: int, epoch: int) -> None:
    """Visit the tetrahedra that touched cut face `f` of `t` from the other side.

    They are the stars of the twins of its nodes. Twins on the current cut surface are skipped:
    ahead of the blade the lips of the current incision are still connected.
    """
    body, visits = cut.body, cut.visits
    for k in range(4):
        node = body.tetrahedra[t, k]
        if k == f or visits.nodes[node] == epoch or on_cut_surface(cut.surface, node):
            continue
        visits.nodes[node] = epoch
        twin = body.twin[node]
        while twin != node:
            if visits.nodes[twin] != epoch:
                visits.nodes[twin] = epoch
                _visit_star(cut, twin, epoch)
            twin = body.twin[twin]


@kernel
def _visit_star(cut: Cut, node: int, epoch: int) -> None:
    """Visit the tetrahedra around `node`."""
    body, around = cut.body, cut.scratch.around
    around[0] = body.node_tetrahedron[node]
    n = 1
    i = 0
    while i < n:
        t = around[i]
        i += 1
        _visit(cut, t, epoch, False)
        for f in range(4):
            link = body.links[t, f]
            if body.tetrahedra[t, f] != node and link >= 0:
                other = link // 4
                seen = False
                for j in range(n):
                    seen = seen or around[j] == other
                if seen:
                    continue
                if n == len(around):
                    cut.visits.is_full = 1
                    return
                around[n] = other
                n += 1


@kernel
def note_segments(cut: Cut, t: int, n: int) -> bool:
    """List the segments whose boxes overlap that of tetrahedron `t`; return whether any does."""
    body, path, segments = cut.body, cut.path, cut.scratch.segments
    box = tetrahedron_box(body.lattice_rest, body.tetrahedra, t)
    last = len(path.linked) - 1
    near = Segments(last, -1)
    if overlap(_swept_box(path, last), box):  # most tetrahedra around the active ones are not
        near = segments_near(path, box, 0, last)
    found = near.first <= near.last
    segments[n, 0] = near.first if found else -1
    segments[n, 1] = near.last
    return found


class Segments(NamedTuple):
    """Segments of the edge that follow each other."""

    first: int
    """The first one."""
    last: int
    """The last one; before the first where there is none."""


@kernel
def segments_near(path: Path, box: Aabb, begin: int, end: int) -> Segments:
    """Return the first and the last segment, from `begin` to before `end`, that sweep into a box.

    Without a branch, so that LLVM tests eight of them at a time: in a third of the time.
    """
    boxes, low, high = path.boxes, box.low, box.high
    first, last = end, begin - 1
    for i in range(begin, end):
        k = natural(i)
        meets = (
            (boxes[0, k] <= high.x)
            & (boxes[1, k] <= high.y)
            & (boxes[2, k] <= high.z)
            & (boxes[3, k] >= low.x)
            & (boxes[4, k] >= low.y)
            & (boxes[5, k] >= low.z)
        )
        first = min(first, k if meets else end)
        last = max(last, k if meets else begin - 1)
    return Segments(first, last)


@kernel
def _swept_box(path: Path, k: int) -> Aabb:
    """Return the box that segment `k` sweeps, on the lattice; the last one is that of all."""
    b = path.boxes
    return Aabb(Vec3(b[0, k], b[1, k], b[2, k]), Vec3(b[3, k], b[4, k], b[5, k]))


@kernel
def find_crossings(cut: Cut) -> None:
    """Find the edges of active tetrahedra that the swept edge crosses, each tested once."""
    body, scratch = cut.body, cut.scratch
    scratch.n_crossings = 0
    if 2 * 6 * scratch.n_active > len(scratch.tested.item):
        cut.change.lacks_room = LISTS
        return
    clear_table(scratch.tested)
    mask = _mask_for(scratch.tested, 6 * scratch.n_active)
    for i in range(scratch.n_active):
        if scratch.segments[i, 0] < 0:
            continue
        t = scratch.active[i]
        for p in range(3):
            for q in range(p + 1, 4):
                a = min(body.tetrahedra[t, p], body.tetrahedra[t, q])
                b = max(body.tetrahedra[t, p], body.tetrahedra[t, q])
                if _add_tested(scratch.tested, mask, a, b):
                    # Another tetrahedron around the edge may list more segments, but those that
                    # can cross the edge itself are listed by all of them.
                    _cross_edge(cut, a, b, scratch.segments[i, 0], scratch.segments[i, 1])


@kernel
def _mask_for(tested: HashTable, n: int) -> int:
    """Return the mask of as many of the first slots as `n` edges need: the cache holds few."""
    n_slots = 1
    while n_slots < 2 * n and n_slots < len(tested.item):
        n_slots *= 2
    return n_slots - 1


@kernel
def _add_tested(tested: HashTable, mask: int, a: int, b: int) -> bool:
    """Add edge ab to the edges tested; return False if it is among them."""
    key = (a << 32) | b
    slot = hash_of(a, b, 0, 0) & mask
    while is_filled(tested, slot):
        if tested.item[slot] == key:
            return False
        slot = (slot + 1) & mask
    fill_slot(tested, slot, key)
    return True


@kernel
def _cross_edge(cut: Cut, a: int, b: int, first: int, last: int) -> None:
    """Store where one of segments `first` to `last`, swept, crosses edge ab."""
    body, path, scratch = cut.body, cut.path, cut.scratch
    box = segment_box(body.lattice_rest, a, b)
    near = segments_near(path, box, first, last + 1)
    for k in range(near.first, near.last + 1):
        if not overlap(_swept_box(path, k), box):
            continue
        at = _crossing_of_quad(path, cut, a, b, k)
        n = scratch.n_crossings
        if at >= 0.0:
            if n == len(scratch.crossing):
                cut.change.lacks_room = LISTS
                return
            scratch.crossing[n, 0] = a
            scratch.crossing[n, 1] = b
            scratch.crossing[n, 2] = k
            scratch.crossing_at[n, 0] = at
            scratch.n_crossings = n + 1
            return


@kernel
def _crossing_of_quad(path: Path, cut: Cut, a: int, b: int, k: int) -> float:
    """Return the fraction along ab at which it pierces the quad that segment `k` sweeps, or -1."""
    pa = lattice_point(cut.body.lattice_rest, a)
    pb = lattice_point(cut.body.lattice_rest, b)
    tip_t0 = lattice_point(path.lattice_t0, k)
    heel_t0 = lattice_point(path.lattice_t0, k + 1)
    tip_t1 = lattice_point(path.lattice_t1, k)
    heel_t1 = lattice_point(path.lattice_t1, k + 1)
    if pierces(pa, pb, tip_t0, tip_t1, heel_t1):
        va = orient3d(tip_t0, tip_t1, heel_t1, pa)
        vb = orient3d(tip_t0, tip_t1, heel_t1, pb)
        return _crossing_fraction(cut, a, b, k, True, float(va) / (float(va) - float(vb)))
    if pierces(pa, pb, tip_t0, heel_t1, heel_t0):
        va = orient3d(tip_t0, heel_t1, heel_t0, pa)
        vb = orient3d(tip_t0, heel_t1, heel_t0, pb)
        return _crossing_fraction(cut, a, b, k, False, float(va) / (float(va) - float(vb)))
    return -1.0


@kernel
def _crossing_fraction(cut: Cut, a: int, b: int, k: int, ahead: bool, on_lattice: float) -> float:
    """Return the unrounded fraction along ab at which a triangle that segment `k` sweeps cuts it.

    The lattice decides whether it does. The point itself is computed from unrounded positions,
    since the lattice resolves a few millionths of the body only.

    Args:
        cut: Body and path.
        a: First node of the edge.
        b: Second node.
        k: Segment of the cutting edge.
        ahead: Which of the two triangles of the quad: tip and heel at t1, or heel at t0 and t1.
        on_lattice: The fraction on the lattice, used where the edge nearly lies in the plane.
    """
    body, path = cut.body, cut.path
    tip = vec3(path.t0, k)
    u = sub(vec3(path.t1, k) if ahead else vec3(path.t1, k + 1), tip)
    v = sub(vec3(path.t1, k + 1) if ahead else vec3(path.t0, k + 1), tip)
    normal = cross(u, v)
    height_a = dot(normal, sub(vec3(body.rest, a), tip))
    height_b = dot(normal, sub(vec3(body.rest, b), tip))
    if height_a * height_b >= 0.0:
        return on_lattice
    return height_a / (height_a - height_b)
