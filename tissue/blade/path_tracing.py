"""The path of the cutting edge through the material: from anchors to the path that is cut.

The path is a chain of material points, one a sample. Samples in the tissue are at their anchors. A
few more samples on either side reach out through the skin, so that the cut surface always ends
outside the body or at a real end of the blade; their offset from the anchored neighbour is that on
the blade.
"""

from tissue.blade.blade_state import BladeState
from tissue.blade.body_sheets import join_sheet, rotation_of_sheet
from tissue.blade.edge import BladePose, Edge, pose_at, sample_displacement
from tissue.blade.edge_anchors import ANCHORED, FREE, LEFT, RETRACTED, Anchors
from tissue.blade.layer_following import follow_layers, shift_to_layers
from tissue.blade.material_frame import find_sheets, rest_offset
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, norm, scale, store, sub, vec3
from tissue.cutting.blade_path import Path, average_directions
from tissue.cutting.end_depth import shift_ends, take_back_shifts
from tissue.geometry.polar_decomposition import apply_transposed
from tissue.mesh.body import OUTER, Body, walk

OUTREACH = 6
"""Samples by which the chain extends beyond the last one in the tissue: a mean node size. With one,
or on coarse meshes with three, a corner of the skin between two samples can stay uncut."""

SMOOTHING = 6
"""Passes of smoothing along the edge; they reach over half a mean node size to either side."""

LONGEST_LINK = 2.0
"""Excess of the cut between two samples over its length on the blade, at most, per
`BladeState.reach`. Beyond it they hold two sheets: a cut surface between them would cut where no
blade was."""

LONGEST_JUMP = 4.0
"""Distance within which a sample may take hold again and its path continue, per
`BladeState.reach`: about an edge of a tetrahedron, which is 3 to 4 node sizes. Further away it
holds another sheet, where its path begins. An anchor that slips may go further: all that it slips
through is cut."""

STEEPEST = 1.0
"""Displacement of the path sideways per displacement ahead, at most. Steeper steps leave tetrahedra
uncut."""


@kernel
def trace_path(
    blade: BladeState, body: Body, edge: Edge, when: float, margin: float, path: Path
) -> None:
    """Write the path of the samples since the last call. Samples that left are freed.

    Each sheet is followed by itself: with its own rotation, and a beginning and an end of its own.

    Args:
        blade: The anchors at the end of the step.
        body: The tissue.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
        margin: How far outside the skin the cut surface begins and ends [m].
        path: Written; its last end is the new start.
    """
    anchors = blade.anchors
    n = len(anchors.state)
    pose = pose_at(edge, when)
    find_sheets(anchors, body, blade.reach)
    _note_progress(anchors)
    _note_passage(anchors, path)
    take_back_shifts(path)
    for k in range(n):
        store(path.t0, k, vec3(path.t1, k))
        path.member[k] = anchors.state[k] != FREE
        path.seed[k] = -1
        if path.member[k]:
            _follow_anchor(blade, body, edge, pose, k, margin, path)
    for k in range(n):
        if anchors.state[k] == FREE:
            _place_beside(blade, pose, k, path)
    spacing = pose.length / (n - 1.0)
    _link(path, spacing + LONGEST_LINK * blade.reach)
    _smooth(path)
    for k in range(n):
        if path.member[k]:
            _begin_or_go_on(blade, body, k, margin, path)
    average_directions(path, blade.reach)
    has_layers = len(body.interfaces.toughness) > 0
    if has_layers:
        follow_layers(blade, body, path)
    shift_ends(path, body, blade.reach)
    if has_layers:
        shift_to_layers(path)
    for k in range(n):
        path.known[k] = path.member[k]
        if anchors.sheets.first[k] == k and anchors.sheets.has_left[k]:
            path.has_left = 1
        if anchors.state[k] == LEFT:
            anchors.state[k] = FREE


@kernel
def _note_progress(anchors: Anchors) -> None:
    """Find of each sheet whether an anchor in it has cut, whether one pulls, and if all left."""
    sheets = anchors.sheets
    for k in range(len(anchors.state)):
        sheet = sheets.first[k]
        if sheet == k:
            sheets.has_begun[k] = sheets.is_cut[k] = False
            sheets.has_left[k] = True
        if sheet >= 0:
            pulls = anchors.state[k] == ANCHORED or anchors.state[k] == LEFT
            sheets.is_cut[sheet] = sheets.is_cut[sheet] or pulls
            sheets.has_begun[sheet] = sheets.has_begun[sheet] or anchors.slipped[k]
            sheets.has_left[sheet] = sheets.has_left[sheet] and anchors.state[k] == LEFT


@kernel
def _note_passage(anchors: Anchors, path: Path) -> None:
    """Store whether an end of the edge holds tissue, and whether the edge leaves all ahead."""
    state = anchors.state
    if state[0] != FREE or state[len(state) - 1] != FREE:
        path.has_end_in = 1
    path.is_through = 1
    for k in range(len(state)):
        if state[k] == ANCHORED or state[k] == RETRACTED:
            path.is_through = 0


@kernel
def _follow_anchor(
    blade: BladeState,
    body: Body,
    edge: Edge,
    pose: BladePose,
    k: int,
    margin: float,
    path: Path,
) -> None:
    """Write where sample `k` is, which holds tissue, and how the blade lies there.

    Args:
        blade: The anchors.
        body: The tissue.
        edge: The cutting edge over the time step.
        pose: Pose of the blade.
        k: The sample.
        margin: How far outside the skin the cut surface begins and ends [m].
        path: Written.
    """
    anchors = blade.anchors
    rotation = rotation_of_sheet(anchors.sheets, k)
    ahead = apply_transposed(rotation, pose.forward)
    store(path.forward, k, ahead)
    store(path.sideways, k, apply_transposed(rotation, pose.normal))
    path.seed[k] = anchors.tetrahedron[k]
    at = vec3(anchors.rest, k)
    if anchors.is_new[k] and norm(sub(at, vec3(path.t0, k))) > LONGEST_JUMP * blade.reach:
        path.known[k] = False
    anchors.is_new[k] = False
    # A blade that only presses has not cut yet: the path waits outside the skin.
    if anchors.slipped[k]:
        store(path.t1, k, at)
    elif not path.known[k]:
        store(path.t1, k, _behind(body, at, margin, ahead, path.seed[k]))
    # Where the blade backs off, the cut surface does not continue.
    if (
        anchors.state[k] == LEFT
        and dot(sample_displacement(edge, k, len(anchors.state)), pose.forward) > 0.0
    ):
        _extend_beyond_skin(body, k, axpy(margin, ahead, at), path)


@kernel
def _begin_or_go_on(blade: BladeState, body: Body, k: int, margin: float, path: Path) -> None:
    """Write where the step of sample `k` begins: where it was, or where it met a sheet."""
    sheets = blade.anchors.sheets
    sheet = sheets.first[k]
    ahead = vec3(path.forward, k)
    if sheets.has_left[sheet]:
        store(path.t1, k, axpy(margin, ahead, vec3(path.t1, k)))
    if path.known[k]:
        _limit_step(path, k)
    elif sheets.has_begun[sheet] and sheets.is_cut[sheet]:
        # A new member begins outside the skin, behind where it is now.
        store(path.t0, k, _behind(body, vec3(path.t1, k), margin, ahead, path.seed[k]))
    else:
        store(path.t0, k, vec3(path.t1, k))


@kernel
def forget_path(path: Path) -> None:
    """Forget where the edge has been: the next path begins at the next contact."""
    path.has_left = path.has_end_in = path.is_through = 0
    for end in range(2):
        store(path.direction, end, Vec3(0.0, 0.0, 0.0))
        path.excess[end] = 0.0
    for k in range(len(path.member)):
        path.member[k] = False
        path.known[k] = False
        path.aside[k] = 0.0
        store(path.shift, k, Vec3(0.0, 0.0, 0.0))


@kernel
def _behind(body: Body, p: Vec3, margin: float, ahead: Vec3, seed: int) -> Vec3:
    """Return where the cut begins that the edge enters at `p` [m]: outside the skin, or in a slit.

    In the midst of tissue, where a tip was driven in, it begins at `p` itself.
    """
    behind = axpy(-margin, ahead, p)
    if seed >= 0 and walk(body, behind, seed).inside:
        return p
    return behind


@kernel
def _extend_beyond_skin(body: Body, k: int, p: Vec3, path: Path) -> None:
    """End the cut surface at `p` [m], where sample `k` left the body, if that is outside."""
    at = walk(body, p, path.seed[k])
    if not at.inside and at.link == OUTER:
        store(path.t1, k, p)


@kernel
def _place_beside(blade: BladeState, pose: BladePose, k: int, path: Path) -> None:
    """Place a free sample from the nearest samples that are, or just were, in the tissue.

    Between two sheets it goes with one of them: the nearer one along the edge.
    """
    anchors, sheets = blade.anchors, blade.anchors.sheets
    n = len(anchors.state)
    n_adjacent = 0
    p = Vec3(0.0, 0.0, 0.0)
    for distance in range(1, OUTREACH + 1):
        for adjacent in range(k - distance, k + distance + 1, 2 * distance):
            if not 0 <= adjacent < n or anchors.state[adjacent] == FREE:
                continue
            if n_adjacent == 1 and sheets.first[adjacent] != sheets.first[k]:
                continue
            n_adjacent += 1
            join_sheet(sheets, k, adjacent)
            offset = rest_offset(pose, rotation_of_sheet(sheets, adjacent), n, k, adjacent)
            at = add(vec3(path.t1, adjacent), offset)
            p = add(p, at)
            if _is_elsewhere(path, k, adjacent, at, blade.reach):
                path.known[k] = False
        if n_adjacent > 0:
            path.member[k] = True
            store(path.t1, k, scale(1.0 / n_adjacent, p))
            store(path.forward, k, vec3(path.forward, sheets.first[k]))
            store(path.sideways, k, vec3(path.sideways, sheets.first[k]))
            return


@kernel
def _is_elsewhere(path: Path, k: int, adjacent: int, p: Vec3, reach: float) -> bool:
    """Return whether a free sample was with another sheet than the one that it is placed with now.

    It is where it was not near the sample that it is placed next to.

    Args:
        path: With the step of sample `adjacent`.
        k: The sample that is placed.
        adjacent: The sample that it is placed next to.
        p: Where it is placed [m].
        reach: `BladeState.reach` [m].
    """
    allowed = LONGEST_JUMP * reach
    if not path.known[adjacent]:
        return norm(sub(p, vec3(path.t0, k))) > allowed
    before = norm(sub(vec3(path.t0, k), vec3(path.t0, adjacent)))
    return before > norm(sub(p, vec3(path.t1, adjacent))) + allowed


@kernel
def _link(path: Path, longest: float) -> None:
    """Link the samples next to each other that are so at rest too, to at most `longest` [m]."""
    n = len(path.member)
    for k in range(n):
        path.linked[k] = (
            k + 1 < n
            and path.member[k]
            and path.member[k + 1]
            and norm(sub(vec3(path.t1, k + 1), vec3(path.t1, k))) <= longest
        )


@kernel
def _smooth(path: Path) -> None:
    """Smooth how far samples next to each other lie sideways, over about a node size.

    Anchors in different tetrahedra are dragged sideways by different amounts. The mesh cannot hold
    a fold of the cut surface that is finer than its tetrahedra; it would tear along one.
    """
    n = len(path.member)
    for _ in range(SMOOTHING):
        for parity in range(2):
            for k in range(parity, n, 2):
                if k == 0 or not (path.linked[k - 1] and path.linked[k]):
                    continue
                here, sideways = vec3(path.t1, k), vec3(path.sideways, k)
                distance = 0.0
                for adjacent in range(k - 1, k + 2, 2):
                    distance += dot(sub(vec3(path.t1, adjacent), here), sideways)
                store(path.t1, k, axpy(0.5 * distance / 2, sideways, here))


@kernel
def _limit_step(path: Path, k: int) -> None:
    """Hold a sample back that is not ahead of where it has been, or moves more sideways than ahead.

    The first is in its own cut; the second would fold the cut surface.
    """
    start, sideways = vec3(path.t0, k), vec3(path.sideways, k)
    step = sub(vec3(path.t1, k), start)
    ahead = dot(step, vec3(path.forward, k))
    if ahead <= 0.0:
        store(path.t1, k, start)
        return
    drift = dot(step, sideways)
    kept = min(max(drift, -STEEPEST * ahead), STEEPEST * ahead)
    store(path.t1, k, axpy(kept - drift, sideways, vec3(path.t1, k)))
