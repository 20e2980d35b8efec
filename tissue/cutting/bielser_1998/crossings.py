"""Records of what the blade crossed: edges, faces that its ends passed, tetrahedra it has left.

Paper, section 3, on top of what `tissue.cutting.collision_detection` and
`tissue.cutting.crack_front` find for any scheme.
"""

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.cutting.bielser_1998.mesh_records import (
    NO_NODE,
    NOT_CUT,
    Records,
    cut_edge_code,
    edge_between,
    is_whole,
    reference_at_face,
)
from tissue.cutting.blade_path import Path
from tissue.cutting.crack_front import MOST_EVENTS, PARAMETER_GAP, line_of_sample, next_event
from tissue.cutting.workspace import Cut
from tissue.mesh.body import Body


class Waiting(Arrays):
    """Tetrahedra of which the blade has cut an edge and that it has not left yet."""

    tetrahedra: IntArray
    """The waiting tetrahedra, shape (n_tets,)."""
    n_listed: IntCell
    """Number of tetrahedra in the list."""
    is_listed: IntArray
    """Whether a tetrahedron is in the list, shape (n_tets,)."""


@kernel
def record_crossings(cut: Cut, records: Records) -> int:
    """Record the crossed edges of the initial mesh; return how many others were crossed.

    Others are ignored: "each tetrahedron can only be processed once" (section 6). An edge that is
    crossed a second time in one incision has both ends on one side again, and is not cut: a blade
    that moves along an edge trembles from one side of it to the other.
    """
    scratch = cut.scratch
    n_ignored = 0
    for i in range(scratch.n_crossings):
        e = edge_between(records, scratch.crossing[i, 0], scratch.crossing[i, 1])
        if e < 0:
            n_ignored += 1
        elif records.crossed_at[e] == NOT_CUT:
            records.crossed_at[e] = scratch.crossing_at[i, 0]
            records.crossed_in[e] = records.incision
        elif records.crossed_in[e] == records.incision and records.edge_nodes[e, 0] == NO_NODE:
            records.crossed_at[e] = NOT_CUT
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
    line = line_of_sample(cut.path, sample)
    when = 0.0
    for _ in range(MOST_EVENTS):
        event = next_event(cut, line, when)
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
    """Add the active tetrahedra of which the blade has cut an edge to the waiting ones."""
    scratch = cut.scratch
    for i in range(scratch.n_active):
        t = scratch.active[i]
        if is_whole(records, t) and waiting.is_listed[t] == 0 and cut_edge_code(records, t) != 0:
            waiting.is_listed[t] = 1
            waiting.tetrahedra[waiting.n_listed] = t
            waiting.n_listed += 1


@kernel
def has_left(body: Body, path: Path, t: int, reach: float) -> bool:
    """Return whether the edge, where it is now, is farther than `reach` [m] from the box of `t`."""
    grid = body.lattice_rest
    margin = int(reach / body.lattice.spacing)
    a = body.tetrahedra[t, 0]
    b = body.tetrahedra[t, 1]
    c = body.tetrahedra[t, 2]
    d = body.tetrahedra[t, 3]
    for k in range(len(path.linked) - 1):
        if not path.linked[k] or reach < 0.0:
            continue
        is_near = True
        for x in range(3):
            low = min(min(grid[a, x], grid[b, x]), min(grid[c, x], grid[d, x]))
            high = max(max(grid[a, x], grid[b, x]), max(grid[c, x], grid[d, x]))
            p = path.lattice_t1[k, x]
            q = path.lattice_t1[k + 1, x]
            is_near = is_near and min(p, q) <= high + margin and max(p, q) >= low - margin
        if is_near:
            return False
    return True
