"""Finishing: where an incision ends, the small bridges that the blade passed over are parted.

The path of the edge is known at its samples only, and ends at the last one that held tissue. At the
ends of the cut surface, and between two parts of it, tissue of less than an element can stay whole.
The faces that part it are those of the minimum cut between the two lips
(`tissue.cutting.minimum_cut`). They are cut where their area is a small share of the cut surface.
Where it is not, the blade left a bridge that is to stay. No blade pays for the work of these cuts:
their area is reported by itself.
"""

from tissue.core.jit import kernel
from tissue.cutting.cut_surface import decide_side, decided_side, on_cut_surface, past_offset
from tissue.cutting.minimum_cut import FlowGraph, clear_lips, minimum_cut, put_on_lip
from tissue.cutting.separation import open_faces, small_piece
from tissue.cutting.workspace import Cut
from tissue.mesh.body import CUT
from tissue.mesh.changes import LISTS
from tissue.mesh.star import star

MOST_FINISHED = 0.15
"""Area of the bridges that are finished, as a share of the cut surface, at most. Of a stroke that
ends where a sixth of the stroke is left, the bridge stays."""

MOST_PASSED = 0.25
"""The same, of an edge that has left all tissue ahead and of which neither end was ever in it. It
has passed through all tissue there was: no bridge is one that it left. Where a thin wall folds,
and breaks away from the edge at once, what no sample saw was up to 18 %."""

MOST_TRIES = 16
"""Minimum cuts that are tried, where all but the last would part a fragment."""


@kernel
def finish_cut_surface(cut: Cut, graph: FlowGraph, cut_area: float) -> None:
    """Part the bridges between the lips of the current incision if they are small.

    Args:
        cut: The changes have been cleared; they are written.
        graph: Without lips, before and after.
        cut_area: Area of the faces cut in this incision [m2].
    """
    path = cut.path
    has_passed = path.is_through == 1 and path.has_end_in == 0
    limit = (MOST_PASSED if has_passed else MOST_FINISHED) * cut_area
    _collect_lips(cut, graph)
    for _ in range(MOST_TRIES):
        area = minimum_cut(graph, cut.body, cut.visits, limit)
        if area == 0.0 or area > limit or not _cut_links(cut, graph):
            break
        if not _spare_fragments(cut, graph):
            _note_sides(cut)
            area_before = cut.change.area
            open_faces(cut)
            cut.change.finished_area += cut.change.area - area_before
            break
        _restore_links(cut)
    clear_lips(graph)


@kernel
def _collect_lips(cut: Cut, graph: FlowGraph) -> None:
    """Find the tetrahedra of the lips: those with a face that this incision has cut."""
    body, surface, around = cut.body, cut.surface, cut.scratch.around
    for i in range(surface.n_nodes):
        node = surface.nodes[i]
        n = star(body, cut.visits, node, body.node_tetrahedron[node], around)
        for j in range(n):
            t = around[j]
            side = decided_side(surface, t)
            if side == 0 or graph.lip[t] != 0:
                continue
            for f in range(4):
                if body.links[t, f] == CUT:
                    put_on_lip(graph, t, side)
                    break


@kernel
def _cut_links(cut: Cut, graph: FlowGraph) -> bool:
    """Cut the links across the minimum cut, and list its faces; return whether there was room."""
    body, change, visits = cut.body, cut.change, cut.visits
    change.n_faces = 0
    for i in range(graph.n_queued):
        t = graph.queue[i]
        for f in range(4):
            link = body.links[t, f]
            if link < 0 or visits.tetrahedra[link // 4] == visits.epoch:
                continue
            if change.n_faces == len(change.faces):
                _restore_links(cut)
                change.lacks_room = LISTS
                return False
            row = change.n_faces
            change.n_faces += 1
            change.faces[row, 0] = t
            change.faces[row, 1] = f
            change.faces[row, 2] = link // 4
            change.faces[row, 3] = link % 4
            body.links[t, f] = CUT
            body.links[link // 4, link % 4] = CUT
    return True


@kernel
def _restore_links(cut: Cut) -> None:
    """Undo `_cut_links`."""
    change, links = cut.change, cut.body.links
    for row in range(change.n_faces):
        links[change.faces[row, 0], change.faces[row, 1]] = (
            4 * change.faces[row, 2] + change.faces[row, 3]
        )
        links[change.faces[row, 2], change.faces[row, 3]] = (
            4 * change.faces[row, 0] + change.faces[row, 1]
        )
    change.n_faces = 0


@kernel
def _spare_fragments(cut: Cut, graph: FlowGraph) -> bool:
    """Take fragments that the cut would part off the lips; return whether there are any.

    A fragment hangs on one lip and touches the other with a few faces. Parting these would make it
    loose, and would not part the lips.
    """
    change, visits, piece = cut.change, cut.visits, cut.scratch.around
    first = visits.epoch + 1
    any_fragment = False
    for row in range(change.n_faces):
        for j in range(0, 4, 2):
            n = small_piece(cut, change.faces[row, j], first)
            any_fragment = any_fragment or n > 0
            for i in range(n):
                graph.lip[piece[i]] = 0
                visits.tetrahedra[piece[i]] = 0  # a stamp of `first` or later: of a large piece
    return any_fragment


@kernel
def _note_sides(cut: Cut) -> None:
    """Store the sides of the tetrahedra at the new faces, and the nodes that no blade passed."""
    body, change = cut.body, cut.change
    for row in range(change.n_faces):
        t = change.faces[row, 0]
        decide_side(cut.surface, t, 1)
        decide_side(cut.surface, change.faces[row, 2], -1)
        for k in range(4):
            node = body.tetrahedra[t, k]
            is_new = not on_cut_surface(cut.surface, node) and past_offset(cut.surface, node) < 0.0
            if k != change.faces[row, 1] and is_new:
                body.off_path[node] = -1.0
