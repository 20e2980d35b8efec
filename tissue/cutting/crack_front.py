"""The crack front: the path of an end of the blade through the tissue, as edges of the mesh.

Where the tip passes through a face, a node is inserted, and successive nodes are joined by edges.
Without them the cut surface inside a tetrahedron that the tip passed through need not be a union of
mesh
faces: it failed for 20 to 50 % of the orders of insertion, and with them for none of 35,580.
"""

from typing import Final, NamedTuple

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, lerp, norm, sub, vec3
from tissue.cutting.blade_path import Path
from tissue.cutting.cut_surface import rank_front_node
from tissue.cutting.end_depth import count_front
from tissue.cutting.snapping import insert_in_face
from tissue.cutting.workspace import Cut
from tissue.geometry.aabb import Aabb, overlap, tetrahedron_box
from tissue.geometry.exact_predicates import LatticePoint, lattice_point, pierces
from tissue.mesh.body import local_index
from tissue.mesh.star import star

MOST_EVENTS = 32
"""Faces that an end of the blade can pass through in one step, of less than half an element."""

PARAMETER_GAP = 1e-9
"""Share of the step below which two events count as one."""

OUTSIDE_TOLERANCE = 1e-6
"""Barycentric weight by which a line through an edge or a corner may miss a face by rounding."""


ALONG_EDGE: Final = -1
"""In place of an end: a front along the edge itself."""


class Event(NamedTuple):
    """An end of the blade passes through a face."""

    when: float
    """Fraction of the line segment; 2 where there is no event."""
    a: int
    """First node of the face."""
    b: int
    """Second node of the face."""
    c: int
    """Third node of the face."""
    weights: Vec3
    """Barycentric weights of the point in the face."""
    half: int
    """The face: 4 * tetrahedron + its local face."""
    outer: bool
    """Whether the face is on the skin or on a cut."""
    leaving: bool
    """Whether the line leaves the tetrahedron there."""


class LineSegment(NamedTuple):
    """A straight line through the body at rest."""

    start: LatticePoint
    """Start of the line on the lattice."""
    stop: LatticePoint
    """End of the line on the lattice."""
    origin: Vec3
    """Start of the line [m]."""
    direction: Vec3
    """Vector from start to end [m]."""


@kernel
def extend_fronts(cut: Cut) -> None:
    """Extend the crack front at the tip and at the heel by their paths in this step."""
    path, front = cut.path, cut.surface.front
    last = len(path.seed) - 1
    for end in range(2):
        sample = 0 if end == 0 else last
        if path.member[sample]:
            front[end] = _insert_front(cut, line_of_sample(path, sample), front[end], end)
        else:
            front[end] = -1
            path.excess[end] = 0.0


@kernel
def line_of_sample(path: Path, sample: int) -> LineSegment:
    """Return the path of a sample of the edge in this step."""
    origin = vec3(path.t0, sample)
    return LineSegment(
        lattice_point(path.lattice_t0, sample),
        lattice_point(path.lattice_t1, sample),
        origin,
        sub(vec3(path.t1, sample), origin),
    )


@kernel
def bring_front_to_blade(cut: Cut) -> None:
    """Insert a crack front along the edge itself, where it rests: the cut opens up to there.

    Otherwise the cut opens up to the last faces that the edge has left behind, up to an element
    short. That matters only while the edge rests, and every front adds nodes.
    """
    path, front = cut.path, cut.surface.front
    last = len(path.seed) - 1
    node = front[0] if path.member[0] else -1
    for k in range(last):
        if not path.linked[k]:
            node = -1
            continue
        origin = vec3(path.t1, k)
        line = LineSegment(
            lattice_point(path.lattice_t1, k),
            lattice_point(path.lattice_t1, k + 1),
            origin,
            sub(vec3(path.t1, k + 1), origin),
        )
        node = _insert_front(cut, line, node, ALONG_EDGE)
        if cut.change.is_full != 0:
            return
    if node >= 0 and path.member[last] and front[1] >= 0:
        _join(cut, node, front[1], ALONG_EDGE)


@kernel
def _insert_front(cut: Cut, line: LineSegment, before: int, end: int) -> int:
    """Insert and join nodes where the line pierces faces, the first one with node `before`.

    Args:
        cut: Read and written.
        line: The line.
        before: Last node of the front; -1 if none.
        end: The end of the edge whose path it is, 0 or 1; or ALONG_EDGE.

    Returns:
        The last node; -1 where the line has left the body, or never was in it.
    """
    when = 0.0
    for _ in range(MOST_EVENTS):
        event = next_event(cut, line, when)
        if event.when > 1.0:
            return before
        when = event.when + PARAMETER_GAP
        node = insert_in_face(cut, event.a, event.b, event.c, event.weights)
        if node < 0:
            return before
        if before >= 0 and not (event.outer and not event.leaving):
            _join(cut, before, node, end)
        before = -1 if event.outer and event.leaving else node
        if cut.change.is_full != 0:
            return before
    return before


@kernel
def next_event(cut: Cut, line: LineSegment, after: float) -> Event:
    """Return the first face that the line pierces after fraction `after` of it."""
    scratch, change = cut.scratch, cut.change
    best = Event(2.0, 0, 0, 0, Vec3(0.0, 0.0, 0.0), -1, False, False)
    for i in range(scratch.n_active):
        best = _earlier_event(cut, scratch.active[i], line, after, best)
    for i in range(change.n_dirty):
        best = _earlier_event(cut, change.dirty[i], line, after, best)
    return best


@kernel
def _earlier_event(cut: Cut, t: int, line: LineSegment, after: float, best: Event) -> Event:
    body = cut.body
    if _is_beyond(cut, t, line):
        return best
    for f in range(4):
        link = body.links[t, f]
        if link >= 0 and link // 4 < t:
            continue  # its neighbour tests it, unless that is not active and so far away
        a = body.tetrahedra[t, (f + 1) % 4]
        b = body.tetrahedra[t, (f + 2) % 4]
        c = body.tetrahedra[t, (f + 3) % 4]
        pa = lattice_point(body.lattice_rest, a)
        pb = lattice_point(body.lattice_rest, b)
        pc = lattice_point(body.lattice_rest, c)
        if not pierces(line.start, line.stop, pa, pb, pc):
            continue
        when, w = _line_plane_intersection(
            line.origin, line.direction, vec3(body.rest, a), vec3(body.rest, b), vec3(body.rest, c)
        )
        when = min(max(when, PARAMETER_GAP), 1.0)
        if not after < when < best.when:
            continue
        normal = cross(
            sub(vec3(body.rest, b), vec3(body.rest, a)), sub(vec3(body.rest, c), vec3(body.rest, a))
        )
        apex = sub(vec3(body.rest, body.tetrahedra[t, f]), vec3(body.rest, a))
        leaving = dot(normal, line.direction) * dot(normal, apex) < 0.0
        best = Event(when, a, b, c, w, 4 * t + f, link < 0, leaving)
    return best


@kernel
def _is_beyond(cut: Cut, t: int, line: LineSegment) -> bool:
    """Return whether the boxes of a tetrahedron and a line are apart."""
    body, p, q = cut.body, line.start, line.stop
    low = Vec3(min(p.x, q.x), min(p.y, q.y), min(p.z, q.z))
    high = Vec3(max(p.x, q.x), max(p.y, q.y), max(p.z, q.z))
    box = tetrahedron_box(body.lattice_rest, body.tetrahedra, t)
    return not overlap(box, Aabb(low, high))


@kernel
def _line_plane_intersection(
    origin: Vec3, along: Vec3, a: Vec3, b: Vec3, c: Vec3
) -> tuple[float, Vec3]:
    """Return where a line crosses the plane of abc: parameter along it, and weights of a, b, c."""
    normal = cross(sub(b, a), sub(c, a))
    slope = dot(normal, along)
    squared = dot(normal, normal)
    if slope == 0.0 or squared == 0.0:
        return -1.0, Vec3(1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0)
    when = dot(normal, sub(a, origin)) / slope
    p = Vec3(origin.x + when * along.x, origin.y + when * along.y, origin.z + when * along.z)
    return when, Vec3(
        dot(cross(sub(c, b), sub(p, b)), normal) / squared,
        dot(cross(sub(a, c), sub(p, c)), normal) / squared,
        dot(cross(sub(b, a), sub(p, a)), normal) / squared,
    )


@kernel
def _join(cut: Cut, start: int, stop: int, end: int) -> None:
    """Insert nodes along the segment between two nodes until edges of the mesh join them.

    Args:
        cut: Read and written.
        start: First node.
        stop: Last node.
        end: The end of the edge whose front they join, 0 or 1; or ALONG_EDGE.
    """
    last = _join_nodes(cut, start, stop, end)
    _count(cut, end, last, stop)


@kernel
def _count(cut: Cut, end: int, a: int, b: int) -> None:
    """Note that the front of an end goes from node a to node b, and the area up to its path."""
    if end != ALONG_EDGE:
        rank_front_node(cut.surface, a, end)
        rank_front_node(cut.surface, b, end)
        count_front(cut.path, end, vec3(cut.body.rest, a), vec3(cut.body.rest, b))


@kernel
def _join_nodes(cut: Cut, start: int, stop: int, end: int) -> int:
    """Insert the nodes of `_join`; return the last one before `stop`."""
    body = cut.body
    around = cut.scratch.around_too
    a = start
    for _ in range(MOST_EVENTS):
        if a == stop:
            return a
        n = star(body, cut.visits, a, body.node_tetrahedron[a], around)
        goal = vec3(body.rest, stop)
        origin = vec3(body.rest, a)
        best = -1.0
        best_when = 1.0
        best_weights = Vec3(0.0, 0.0, 0.0)
        b = c = d = 0
        for i in range(n):
            t = around[i]
            if local_index(body, t, stop) >= 0:
                return a
            k = local_index(body, t, a)
            p = body.tetrahedra[t, (k + 1) % 4]
            q = body.tetrahedra[t, (k + 2) % 4]
            r = body.tetrahedra[t, (k + 3) % 4]
            when, w = _line_plane_intersection(
                origin,
                sub(goal, origin),
                vec3(body.rest, p),
                vec3(body.rest, q),
                vec3(body.rest, r),
            )
            smallest = min(w.x, min(w.y, w.z))
            if when > 0.0 and smallest > best:
                best, best_when, best_weights = smallest, when, w
                b, c, d = p, q, r
        if best < -OUTSIDE_TOLERANCE or best_when >= 1.0:
            return a  # the segment leaves the body: the front continues from `stop`
        node = insert_in_face(cut, b, c, d, best_weights)
        if node < 0:
            return a
        if norm(sub(goal, vec3(body.rest, node))) >= norm(sub(goal, lerp(0.0, origin, goal))):
            return a  # snapping would lead away from the goal
        _count(cut, end, a, node)
        a = node
    return a
