"""Collision detection: the active tetrahedra, and the edges of theirs that the blade crosses.

Paper, section 3. The list of active tetrahedra is found anew in each step from the tetrahedra that
hold the anchors, through faces: the cost is that of the tetrahedra along the blade.
"""

from tissue.core.jit import kernel
from tissue.core.vec3 import cross, dot, sub, vec3
from tissue.cutting.blade_path import Path
from tissue.cutting.cut_surface import on_sheet
from tissue.cutting.workspace import Cut
from tissue.geometry.exact_predicates import orient3d, pierces, point
from tissue.mesh.body import CUT
from tissue.mesh.nonconforming import behind, n_behind


@kernel
def find_active_tetrahedra(cut: Cut) -> None:
    """Find the tetrahedra whose box at rest meets the box of a swept piece of the edge.

    They are searched through faces: from those that hold a sample, from those that were active or
    changed in the step before, and from one lip of an earlier cut to the other.
    """
    body, path, work, visits = cut.body, cut.path, cut.work, cut.visits
    visits.epoch += 1
    epoch = visits.epoch
    work.n_active[0] = 0
    for k in range(len(path.seed)):
        if path.seed[k] >= 0:
            _visit(cut, path.seed[k], epoch, True)
    for i in range(work.n_previous[0]):
        _visit(cut, work.previous[i], epoch, False)
    i = 0
    while i < work.n_active[0]:
        t = work.active[i]
        i += 1
        for f in range(4):
            link = body.links[t, f]
            for k in range(n_behind(body.hanging, t, link)):
                _visit(cut, behind(body.hanging, t, link, k), epoch, False)
            if link == CUT:
                _visit_other_lip(cut, t, f, epoch)


@kernel
def _visit(cut: Cut, t: int, epoch: int, is_seed: bool) -> None:
    """Let tetrahedron `t` be active if it meets the swept edge, or holds a sample of it."""
    work, visits = cut.work, cut.visits
    n = work.n_active[0]
    if visits.tetrahedra[t] == epoch or n == len(work.active):
        return
    visits.tetrahedra[t] = epoch
    if _note_segments(cut, t, n) or is_seed:
        work.active[n] = t
        work.n_active[0] = n + 1


@kernel
def _visit_other_lip(cut: Cut, t: int, f: int, epoch: int) -> None:
    """Visit the tetrahedra that touched cut face `f` of `t` from the other side.

    They are the stars of the twins of its nodes. Those on the current sheet are left out: the lips
    of the current incision still hang together ahead of the blade.
    """
    body, visits = cut.body, cut.visits
    for k in range(4):
        node = body.tetrahedra[t, k]
        if k == f or visits.nodes[node] == epoch or on_sheet(cut.sheet, node):
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
    body, around = cut.body, cut.work.around
    around[0] = body.node_tetrahedron[node]
    n = 1
    i = 0
    while i < n:
        t = around[i]
        i += 1
        _visit(cut, t, epoch, False)
        for f in range(4):
            link = body.links[t, f]
            if body.tetrahedra[t, f] != node and link >= 0 and n < len(around):
                other = link // 4
                seen = False
                for j in range(n):
                    seen = seen or around[j] == other
                if not seen:
                    around[n] = other
                    n += 1


@kernel
def _note_segments(cut: Cut, t: int, n: int) -> bool:
    """Note which segments' boxes meet that of tetrahedron `t`; return whether any does."""
    body, path, segments = cut.body, cut.path, cut.work.segments
    grid = body.lattice_rest
    a = body.tetrahedra[t, 0]
    b = body.tetrahedra[t, 1]
    c = body.tetrahedra[t, 2]
    d = body.tetrahedra[t, 3]
    low_x = min(min(grid[a, 0], grid[b, 0]), min(grid[c, 0], grid[d, 0]))
    low_y = min(min(grid[a, 1], grid[b, 1]), min(grid[c, 1], grid[d, 1]))
    low_z = min(min(grid[a, 2], grid[b, 2]), min(grid[c, 2], grid[d, 2]))
    high_x = max(max(grid[a, 0], grid[b, 0]), max(grid[c, 0], grid[d, 0]))
    high_y = max(max(grid[a, 1], grid[b, 1]), max(grid[c, 1], grid[d, 1]))
    high_z = max(max(grid[a, 2], grid[b, 2]), max(grid[c, 2], grid[d, 2]))
    first = -1
    last = -2
    boxes = path.boxes
    for k in range(len(path.linked) - 1):
        if not path.linked[k]:
            continue
        if boxes[k, 0] > high_x or boxes[k, 1] > high_y or boxes[k, 2] > high_z:
            continue
        if boxes[k, 3] < low_x or boxes[k, 4] < low_y or boxes[k, 5] < low_z:
            continue
        if first < 0:
            first = k
        last = k
    segments[n, 0] = first
    segments[n, 1] = last
    return first >= 0


@kernel
def find_crossings(cut: Cut) -> None:
    """Find the edges of active tetrahedra that the swept edge crosses, each asked once."""
    body, work, visits = cut.body, cut.work, cut.visits
    visits.epoch += 1
    epoch = visits.epoch
    mask = len(work.hash_keys) - 1
    work.n_crossings[0] = 0
    for i in range(work.n_active[0]):
        if work.segments[i, 0] < 0:
            continue
        t = work.active[i]
        for p in range(3):
            for q in range(p + 1, 4):
                a = min(body.tetrahedra[t, p], body.tetrahedra[t, q])
                b = max(body.tetrahedra[t, p], body.tetrahedra[t, q])
                key = (a << 32) | b
                # Fibonacci hashing: 2^64 / golden ratio, as a signed number.
                slot = ((key * -7046029254386353131) >> 40) & mask
                while work.hash_stamps[slot] == epoch and work.hash_keys[slot] != key:
                    slot = (slot + 1) & mask
                if work.hash_stamps[slot] != epoch:
                    work.hash_stamps[slot] = epoch
                    work.hash_keys[slot] = key
                    # Another tetrahedron around the edge may see more segments, but those that
                    # meet the edge itself are seen by all of them.
                    _cross_edge(cut, a, b, work.segments[i, 0], work.segments[i, 1])


@kernel
def _cross_edge(cut: Cut, a: int, b: int, first: int, last: int) -> None:
    """Note where segments `first` to `last`, swept, cross edge ab."""
    body, path, work = cut.body, cut.path, cut.work
    grid = body.lattice_rest
    low_x = min(grid[a, 0], grid[b, 0])
    low_y = min(grid[a, 1], grid[b, 1])
    low_z = min(grid[a, 2], grid[b, 2])
    high_x = max(grid[a, 0], grid[b, 0])
    high_y = max(grid[a, 1], grid[b, 1])
    high_z = max(grid[a, 2], grid[b, 2])
    boxes = path.boxes
    for k in range(first, last + 1):
        if not path.linked[k]:
            continue
        if boxes[k, 0] > high_x or boxes[k, 1] > high_y or boxes[k, 2] > high_z:
            continue
        if boxes[k, 3] < low_x or boxes[k, 4] < low_y or boxes[k, 5] < low_z:
            continue
        at = _crossed_at(path, cut, a, b, k)
        n = work.n_crossings[0]
        if at >= 0.0 and n < len(work.crossing):
            work.crossing[n, 0] = a
            work.crossing[n, 1] = b
            work.crossing[n, 2] = k
            work.crossing_at[n, 0] = at
            work.n_crossings[0] = n + 1
            return


@kernel
def _crossed_at(path: Path, cut: Cut, a: int, b: int, k: int) -> float:
    """Where along ab the quad that segment `k` sweeps is pierced, as a fraction, or -1."""
    pa = point(cut.body.lattice_rest, a)
    pb = point(cut.body.lattice_rest, b)
    tip_t0 = point(path.lattice_t0, k)
    heel_t0 = point(path.lattice_t0, k + 1)
    tip_t1 = point(path.lattice_t1, k)
    heel_t1 = point(path.lattice_t1, k + 1)
    if pierces(pa, pb, tip_t0, tip_t1, heel_t1):
        va = orient3d(tip_t0, tip_t1, heel_t1, pa)
        vb = orient3d(tip_t0, tip_t1, heel_t1, pb)
        return _fraction(cut, a, b, k, True, float(va) / (float(va) - float(vb)))
    if pierces(pa, pb, tip_t0, heel_t1, heel_t0):
        va = orient3d(tip_t0, heel_t1, heel_t0, pa)
        vb = orient3d(tip_t0, heel_t1, heel_t0, pb)
        return _fraction(cut, a, b, k, False, float(va) / (float(va) - float(vb)))
    return -1.0


@kernel
def _fraction(cut: Cut, a: int, b: int, k: int, ahead: bool, on_lattice: float) -> float:
    """Where along ab it meets the plane of a triangle that segment `k` sweeps, unrounded.

    The lattice decides that it does; where the point is, it would tell to a few millionths of the
    body only. Where a plane nearly holds the edge, `on_lattice` is as good as any answer.
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
