"""What the blade met: edges it crossed, faces that its ends passed, tetrahedra it left.

Paper, section 3, on top of what `tissue.sweep` and `tissue.front` find for any scheme.
"""

from tissue.arrays import Arrays
from tissue.body import Body
from tissue.cut import Cut
from tissue.front import MOST_EVENTS, PARAMETER_GAP, next_event
from tissue.jit import kernel
from tissue.paper_scheme.records import (
    NOT_CUT,
    Records,
    cut_edge_code,
    edge_between,
    is_whole,
    reference_at_face,
)
from tissue.path import Path
from tissue.predicates import Point, orient3d, pierces, point
from tissue.types import IntArray


class Waiting(Arrays):
    """Tetrahedra that the blade has met and, for all that is known, not left."""

    tetrahedra: IntArray
    """The list, shape (n_tets,)."""
    n: IntArray
    """How many they are, shape (1,)."""
    is_listed: IntArray
    """Whether a tetrahedron is in the list, shape (n_tets,)."""
    touched: IntArray
    """Step in which the blade was last found to be in each, shape (n_tets,)."""
    step: IntArray
    """Number of the current step, shape (1,)."""


@kernel
def record_crossings(cut: Cut, records: Records) -> int:
    """Record the edges that were crossed, each once; return how many were of split tetrahedra.

    Those are left alone: "each tetrahedron can only be processed once" (section 6).
    """
    work = cut.work
    n_ignored = 0
    for i in range(work.n_crossings[0]):
        e = edge_between(records, work.crossing[i, 0], work.crossing[i, 1])
        if e < 0:
            n_ignored += 1
        elif records.crossed_at[e] == NOT_CUT:
            records.crossed_at[e] = work.crossing_at[i, 0]
    return n_ignored


@kernel
def record_tips(cut: Cut, records: Records) -> None:
    """Record where the ends of the blade passed through faces of whole tetrahedra."""
    last = len(cut.path.seed) - 1
    for end in range(2):
        sample = 0 if end == 0 else last
        if cut.path.member[sample]:
            _record_tip(cut, records, sample)


@kernel
def _record_tip(cut: Cut, records: Records, sample: int) -> None:
    when = 0.0
    for _ in range(MOST_EVENTS):
        event = next_event(cut, sample, when)
        if event.when > 1.0:
            return
        when = event.when + PARAMETER_GAP
        t = event.half // 4
        if not is_whole(records, t):
            continue
        face = records.faces_of[t, event.half % 4]
        total = max(event.weights.x, 0.0) + max(event.weights.y, 0.0) + max(event.weights.z, 0.0)
        for c in range(3):
            node = event.a if c == 0 else (event.b if c == 1 else event.c)
            place = reference_at_face(records, face, node)
            records.tip_weights[face, place] = max(event.weights[c], 0.0) / total


@kernel
def list_waiting(cut: Cut, records: Records, waiting: Waiting) -> None:
    """List the tetrahedra that the blade is in, and those that it cut an edge of on its way."""
    work = cut.work
    waiting.step[0] += 1
    for i in range(work.n_active[0]):
        t = work.active[i]
        if not is_whole(records, t):
            continue
        if _touches(cut.body, cut.path, t, work.segments[i, 0], work.segments[i, 1]):
            waiting.touched[t] = waiting.step[0]
        elif cut_edge_code(records, t) == 0:
            continue
        if waiting.is_listed[t] == 0:
            waiting.is_listed[t] = 1
            waiting.tetrahedra[waiting.n[0]] = t
            waiting.n[0] += 1


@kernel
def _touches(body: Body, path: Path, t: int, first: int, last: int) -> bool:
    """Whether segments `first` to `last` of the edge, where they are now, meet tetrahedron `t`."""
    for k in range(max(first, 0), last + 1):
        if path.linked[k]:
            p = point(path.lattice_t1, k)
            q = point(path.lattice_t1, k + 1)
            if _holds(body, t, p) or _is_pierced(body, t, p, q):
                return True
    return False


@kernel
def _holds(body: Body, t: int, p: Point) -> bool:
    a = point(body.lattice_rest, body.tetrahedra[t, 0])
    b = point(body.lattice_rest, body.tetrahedra[t, 1])
    c = point(body.lattice_rest, body.tetrahedra[t, 2])
    d = point(body.lattice_rest, body.tetrahedra[t, 3])
    return (
        orient3d(p, b, c, d) >= 0
        and orient3d(a, p, c, d) >= 0
        and orient3d(a, b, p, d) >= 0
        and orient3d(a, b, c, p) >= 0
    )


@kernel
def _is_pierced(body: Body, t: int, p: Point, q: Point) -> bool:
    """Whether segment pq goes in or out through a face of `t`."""
    for f in range(4):
        if pierces(
            p,
            q,
            point(body.lattice_rest, body.tetrahedra[t, (f + 1) % 4]),
            point(body.lattice_rest, body.tetrahedra[t, (f + 2) % 4]),
            point(body.lattice_rest, body.tetrahedra[t, (f + 3) % 4]),
        ):
            return True
    return False
