"""Collision detection as printed (section 3): the active tetrahedra along the blade's line.

In each step: the tetrahedron that holds the point of the blade, searched where it was, next door,
and only then in the whole body; from there the tetrahedra that the line passes through, neighbour
by neighbour; and the edges that the line has swept over.

Where the paper has nothing to say, two things are added. It looks for edges in the tetrahedra that
were active, in steps so small that the line passes through no others; a step that begins outside
the skin is longer, so here they are those that the line has passed through at any instant of the
step. And where the line goes on behind an old cut or in another sheet, to which no face leads, the
trace goes on in the tetrahedra that the edge holds there.
"""

from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.cutting.blade_path import put_on_lattice
from tissue.cutting.collision_detection import find_crossings, note_segments
from tissue.cutting.workspace import Cut
from tissue.geometry.exact_predicates import LatticePoint, lattice_point, orient3d, pierces
from tissue.mesh.body import Body, behind, n_behind
from tissue.mesh.changes import LISTS

IN_NONE = -1
"""In place of a tetrahedron: the point is in none."""

GRAZE = 1e-9
"""Share of a segment by which it may miss a tetrahedron and still meet it: far more than the
rounding of a quotient, and far less than a step of the lattice."""


class Search(Arrays):
    """The search for the point of the blade, and what it took so far."""

    point: IntCell
    """The active point tetrahedron, or IN_NONE."""
    n_swept: IntCell
    """Number of tetrahedra that the line has passed through in this step: the first of
    `CutScratch.active`, those that are active at their head."""
    n_local: IntCell
    """Steps in which the point was where it was before, or next door."""
    n_global: IntCell
    """Steps in which the whole body was searched."""


@kernel
def detect_along_line(cut: Cut, search: Search) -> None:
    """Find the active tetrahedra, and the edges that the line has swept over in this step."""
    put_on_lattice(cut.path, cut.body.lattice)
    find_point(cut, search)
    trace_line(cut, search)
    find_crossings(cut)
    search.n_swept = cut.scratch.n_active
    _keep_active(cut)


@kernel
def find_point(cut: Cut, search: Search) -> None:
    """Find the active point tetrahedron: determineNewActivePointTetrahedron of the paper."""
    body, path = cut.body, cut.path
    old = search.point
    search.point = IN_NONE
    if path.seed[0] < 0:
        return
    p = lattice_point(path.lattice_t1, 0)
    if old != IN_NONE:
        search.point = _beside(body, old, p)
        if search.point != IN_NONE:
            search.n_local += 1
            return
    search.n_global += 1
    for t in range(body.n_tetrahedra):
        if holds(body, t, p):
            search.point = t
            return


@kernel
def _beside(body: Body, t: int, p: LatticePoint) -> int:
    """Return which of `t` and its neighbours holds a point, or IN_NONE."""
    if holds(body, t, p):
        return t
    for f in range(4):
        link = body.links[t, f]
        for k in range(n_behind(body, t, link)):
            neighbour = behind(body, t, link, k)
            if holds(body, neighbour, p):
                return neighbour
    return IN_NONE


@kernel
def trace_line(cut: Cut, search: Search) -> None:
    """List the tetrahedra that the line has passed through: buildNewActiveTetrahedraList."""
    body, path, scratch = cut.body, cut.path, cut.scratch
    cut.visits.epoch += 1
    scratch.n_active = 0
    if search.point != IN_NONE:
        _follow(cut, search.point)
    for i in range(scratch.n_previous):
        _follow(cut, scratch.previous[i])
    for k in range(len(path.seed)):
        if path.seed[k] >= 0:
            _follow(cut, path.seed[k])
    if scratch.n_active == 0:
        search.n_global += 1
        for t in range(body.n_tetrahedra):
            _visit(cut, t)


@kernel
def _follow(cut: Cut, start: int) -> None:
    """List `start` if the line has passed through it, and all that it passed through from there."""
    body, scratch = cut.body, cut.scratch
    i = scratch.n_active
    _visit(cut, start)
    while i < scratch.n_active:
        t = scratch.active[i]
        i += 1
        for f in range(4):
            link = body.links[t, f]
            for k in range(n_behind(body, t, link)):
                _visit(cut, behind(body, t, link, k))


@kernel
def _visit(cut: Cut, t: int) -> None:
    """List tetrahedron `t`, once, if the line has passed through it in this step."""
    scratch, visits = cut.scratch, cut.visits
    if visits.tetrahedra[t] == visits.epoch:
        return
    visits.tetrahedra[t] = visits.epoch
    n = scratch.n_active
    if n == len(scratch.active):
        cut.change.lacks_room = LISTS
    elif note_segments(cut, t, n) and _is_swept(cut, t, n):
        scratch.active[n] = t
        scratch.n_active = n + 1


@kernel
def _keep_active(cut: Cut) -> None:
    """Bring the tetrahedra that the line passes through now to the head, and count them alone."""
    scratch = cut.scratch
    n = 0
    for i in range(scratch.n_active):
        if _is_active(cut, scratch.active[i], i):
            scratch.active[n], scratch.active[i] = scratch.active[i], scratch.active[n]
            n += 1
    scratch.n_active = n


@kernel
def _is_active(cut: Cut, t: int, i: int) -> bool:
    """Return whether the line passes through `t`, at place `i` of the list, after the step."""
    path, segments = cut.path, cut.scratch.segments
    for k in range(segments[i, 0], segments[i, 1] + 1):
        a, b = lattice_point(path.lattice_t1, k), lattice_point(path.lattice_t1, k + 1)
        if path.linked[k] and meets(cut.body, t, a, b):
            return True
    return False


@kernel
def _is_swept(cut: Cut, t: int, place: int) -> bool:
    """Return whether the line has passed through `t`, at a place of the list, in this step.

    Then a side of the swept surface enters the tetrahedron, or an edge of it pierces the surface.
    """
    body, path, segments = cut.body, cut.path, cut.scratch.segments
    for k in range(segments[place, 0], segments[place, 1] + 1):
        a0, b0 = lattice_point(path.lattice_t0, k), lattice_point(path.lattice_t0, k + 1)
        a1, b1 = lattice_point(path.lattice_t1, k), lattice_point(path.lattice_t1, k + 1)
        if not path.linked[k]:
            continue
        if (
            meets(body, t, a1, b1)
            or meets(body, t, a0, b0)
            or meets(body, t, a0, a1)
            or meets(body, t, b0, b1)
        ):
            return True
        for i in range(3):
            for j in range(i + 1, 4):
                p = lattice_point(body.lattice_rest, body.tetrahedra[t, i])
                q = lattice_point(body.lattice_rest, body.tetrahedra[t, j])
                if pierces(p, q, a0, a1, b1) or pierces(p, q, a0, b1, b0):
                    return True
    return False


@kernel
def holds(body: Body, t: int, p: LatticePoint) -> bool:
    """Return whether a tetrahedron holds a point: the paper's InsideTetraTest, exact."""
    return (
        _height(body, t, 0, p) >= 0
        and _height(body, t, 1, p) >= 0
        and _height(body, t, 2, p) >= 0
        and _height(body, t, 3, p) >= 0
    )


@kernel
def meets(body: Body, t: int, a: LatticePoint, b: LatticePoint) -> bool:
    """Return whether segment ab passes through a tetrahedron or touches it: IntersectionTest."""
    enters, leaves = 0.0, 1.0
    for f in range(4):
        at_a, at_b = _height(body, t, f, a), _height(body, t, f, b)
        if at_a < 0 and at_b < 0:
            return False
        if at_a < 0 or at_b < 0:
            crossed = float(at_a) / (float(at_a) - float(at_b))
            if at_a < 0:
                enters = max(enters, crossed)
            else:
                leaves = min(leaves, crossed)
    return enters <= leaves + GRAZE


@kernel
def _height(body: Body, t: int, f: int, p: LatticePoint) -> int:
    """Return six times the volume over face `f` of a tetrahedron; negative: `p` is beyond it."""
    grid, nodes = body.lattice_rest, body.tetrahedra
    a = p if f == 0 else lattice_point(grid, nodes[t, 0])
    b = p if f == 1 else lattice_point(grid, nodes[t, 1])
    c = p if f == 2 else lattice_point(grid, nodes[t, 2])
    d = p if f == 3 else lattice_point(grid, nodes[t, 3])
    return orient3d(a, b, c, d)
