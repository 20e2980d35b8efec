"""Which samples of the edge are anchored, and which are free.

A free sample that enters the tissue is anchored where it is. A free sample next to an anchored one
is anchored as far behind the blade as its neighbour. In an existing slit neither is: nothing is
left to cut there. A sample that backed off and then went elsewhere is freed.
"""

from tissue.blade.anchor_materials import take_material
from tissue.blade.blade_state import BladeState
from tissue.blade.body_sheets import join_sheet, rotation_of_sheet
from tissue.blade.edge import BladePose, Edge, pose_at, sample_point
from tissue.blade.edge_anchors import (
    ANCHORED,
    FREE,
    RETRACTED,
    Anchors,
    anchor_position,
    begin_account,
    pulling_point,
    stored_energy,
)
from tissue.blade.material_frame import find_sheets, rest_offset, to_material
from tissue.blade.return_mapping import locate, set_anchor
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, cross, dot, norm, scale, store, sub, vec3
from tissue.cutting.blade_path import Path, nearest_on_edge
from tissue.geometry.polar_decomposition import apply_transposed
from tissue.geometry.tetrahedron import (
    barycentric_in,
    interpolate,
    nearest_on_segment,
    nearest_on_triangle,
    normalised,
)
from tissue.mesh.body import CUT, Body
from tissue.mesh.interfaces import NO_LAYER
from tissue.mesh.point_location import tetrahedra_along
from tissue.mesh.star import Visits
from tissue.mesh.tetrahedron_grid import TetrahedronGrid

_BESIDE = 0.7
"""Cosine of the angle between the blade's normal and the direction to the nearest cut face, from
which the point is next to that face, in the slit. Below, it is ahead of the rim, or under the
bottom."""


@kernel
def free_retracted(
    blade: BladeState, body: Body, visits: Visits, path: Path, pose: BladePose
) -> None:
    """Free the samples that backed off and then went elsewhere: into tissue not cut yet.

    A blade that backs off, goes deeper and then forward again cuts below its old slit: the path of
    its samples begins again. The path of a sample next to an anchored one continues where it was,
    or the tissue between would stay whole.

    Args:
        blade: The anchors are written.
        body: The tissue.
        visits: For searches.
        path: Path of the edge through the material.
        pose: Pose of the blade.
    """
    anchors = blade.anchors
    n = len(anchors.state)
    any_retracted = False
    for k in range(n):
        any_retracted = any_retracted or anchors.state[k] == RETRACTED
    if not any_retracted:
        return
    find_sheets(anchors, body, blade.reach)
    for k in range(n):
        if anchors.state[k] != RETRACTED:
            continue
        rotation = rotation_of_sheet(anchors.sheets, k)
        a = anchor_position(anchors, body, body.positions, k)
        offset = apply_transposed(rotation, sub(sample_point(pose, k, n), a))
        p = add(vec3(anchors.rest, k), offset)
        if is_behind_edge(path, p):
            continue
        if locate(body, visits, p, anchors.tetrahedron[k], blade.queue).inside:
            anchors.state[k] = FREE
            path.known[k] = _is_beside_anchored(anchors, k)


@kernel
def _is_beside_anchored(anchors: Anchors, k: int) -> bool:
    """Return whether the sample before or behind sample `k` is anchored."""
    state = anchors.state
    return (k > 0 and state[k - 1] == ANCHORED) or (k + 1 < len(state) and state[k + 1] == ANCHORED)


@kernel
def anchor_beside(
    blade: BladeState, body: Body, visits: Visits, pose: BladePose, slit_reach: float
) -> None:
    """Anchor the free samples next to an anchored one that are in the tissue too.

    The anchors trail behind the blade by the same distance along the edge: a sample is in the
    tissue if the point that far behind it is. Tissue beyond `BladeState.reach` is not taken.

    Args:
        blade: The anchors are written.
        body: The tissue.
        visits: For searches.
        pose: Pose of the blade.
        slit_reach: Distance from a cut face up to which a point is in the slit [m] (`is_in_slit`).
    """
    anchors = blade.anchors
    n = len(anchors.state)
    find_sheets(anchors, body, blade.reach)
    for direction in range(2):
        for i in range(n):
            k = i if direction == 0 else n - 1 - i
            adjacent = k - 1 if direction == 0 else k + 1
            if anchors.state[k] != FREE or not 0 <= adjacent < n:
                continue
            if anchors.state[adjacent] != ANCHORED:
                continue
            rotation = rotation_of_sheet(anchors.sheets, adjacent)
            offset = rest_offset(pose, rotation, n, k, adjacent)
            p = add(vec3(anchors.rest, adjacent), offset)
            location = locate(body, visits, p, anchors.tetrahedron[adjacent], blade.queue)
            if not location.inside:
                continue
            t = location.tetrahedron
            w = barycentric_in(p, body.rest, body.tetrahedra, t)
            here = interpolate(w, body.positions, body.tetrahedra, t)
            stretch = sub(sample_point(pose, k, n), here)
            if norm(stretch) > blade.reach:  # the tissue there is turned otherwise
                continue
            ahead = add(p, scale(slit_reach, apply_transposed(rotation, pose.forward)))
            if _runs_in_slit(blade, body, visits, pose, t, p, ahead, slit_reach):
                continue
            # Next to skin that is not broken it is skin too, or the edge broke in unopposed there.
            _begin_anchor(blade, body, k, t, p, anchors.at_skin[adjacent])
            join_sheet(anchors.sheets, k, adjacent)
            anchors.rest_share[k] = anchors.rest_share[adjacent]
            store(anchors.rest_area, k, vec3(anchors.rest_area, adjacent))
            anchors.offset[k] = anchors.offset[adjacent]
            stretch = sub(pulling_point(anchors, pose, k), here)
            begin_account(anchors, k, stretch, pose)
            if anchors.pulls[k]:
                blade.totals.released -= stored_energy(anchors, k, stretch, pose, blade.toughness)


@kernel
def _runs_in_slit(
    blade: BladeState,
    body: Body,
    visits: Visits,
    pose: BladePose,
    t: int,
    p: Vec3,
    ahead: Vec3,
    reach: float,
) -> bool:
    """Return whether a sample is in a slit that continues ahead of it, one cut before.

    Just ahead of a crack front is a slit too, the one that is being cut: it ends there.

    Args:
        blade: Scratch for searches.
        body: The tissue.
        visits: For searches.
        pose: Pose of the blade.
        t: The tetrahedron that holds the sample.
        p: The sample in the body at rest [m].
        ahead: A point ahead of it [m].
        reach: Distance from a cut face up to which a point is in the slit [m].
    """
    if not is_in_slit(body, t, p, pose.along, pose.forward, reach):
        return False
    location = locate(body, visits, ahead, t, blade.queue)
    return location.inside and is_in_slit(
        body, location.tetrahedron, ahead, pose.along, pose.forward, reach
    )


@kernel
def anchor_entering(
    blade: BladeState,
    body: Body,
    grid: TetrahedronGrid,
    edge: Edge,
    when: float,
    slit_reach: float,
    low: Vec3,
    high: Vec3,
) -> None:
    """Anchor the free samples that have entered the tissue.

    Args:
        blade: The anchors are written.
        body: The tissue.
        grid: Grid that lists the tetrahedra.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
        slit_reach: Distance from a cut face up to which a point is in the slit [m] (`is_in_slit`).
        low: Lowest corner of the tissue's box [m].
        high: Highest corner of the tissue's box [m].
    """
    anchors, found = blade.anchors, blade.queue
    n = len(anchors.state)
    pose = pose_at(edge, when)
    k = 0
    while k < n:
        stop = k
        while stop < n and _may_enter(anchors, pose, stop, low, high):
            stop += 1
        if stop == k:
            k += 1
            continue
        after = tetrahedra_along(body, grid, (pose.tip, pose.heel), n, k, stop, found)
        for sample in range(k, after):
            if found[sample] >= 0:
                _enter(blade, body, pose, sample, found[sample], slit_reach)
        k = after


@kernel
def _may_enter(anchors: Anchors, pose: BladePose, k: int, low: Vec3, high: Vec3) -> bool:
    """Return whether sample `k` is free, and lies in the box from `low` to `high` [m]."""
    return bool(
        anchors.state[k] == FREE and _in_box(sample_point(pose, k, len(anchors.state)), low, high)
    )


@kernel
def _enter(
    blade: BladeState, body: Body, pose: BladePose, k: int, t: int, slit_reach: float
) -> None:
    """Anchor sample `k` where it is, in tetrahedron `t`, unless it is in a slit there."""
    b = sample_point(pose, k, len(blade.anchors.state))
    w = barycentric_in(b, body.positions, body.tetrahedra, t)
    p = interpolate(w, body.rest, body.tetrahedra, t)
    if not is_in_slit(body, t, p, pose.along, pose.forward, slit_reach):
        _begin_anchor(blade, body, k, t, p, True)


@kernel
def _begin_anchor(blade: BladeState, body: Body, k: int, t: int, p: Vec3, at_skin: bool) -> None:
    """Anchor sample `k`, which has not cut yet, at rest point `p` [m] of tetrahedron `t`."""
    anchors = blade.anchors
    anchors.coarse.share[k] = 0.0
    set_anchor(anchors, body, k, t, p)
    anchors.layer[k] = NO_LAYER
    take_material(anchors, body, blade.toughness, k)
    anchors.slipped[k] = False
    anchors.is_new[k] = True
    anchors.pulls[k] = True
    anchors.offset[k] = 0.0
    store(anchors.stretch, k, Vec3(0.0, 0.0, 0.0))
    store(anchors.impulse, k, Vec3(0.0, 0.0, 0.0))
    anchors.rest_share[k] = 1.0
    store(anchors.rest_area, k, Vec3(0.0, 0.0, 0.0))
    anchors.at_skin[k] = at_skin
    anchors.at_core[k] = False


@kernel
def any_free_in_box(anchors: Anchors, pose: BladePose, low: Vec3, high: Vec3) -> bool:
    """Return whether a free sample lies in the box from `low` to `high` [m]."""
    n = len(anchors.state)
    k = 0
    while k < n and not _may_enter(anchors, pose, k, low, high):
        k += 1
    return k < n


@kernel
def _in_box(p: Vec3, low: Vec3, high: Vec3) -> bool:
    return low.x <= p.x <= high.x and low.y <= p.y <= high.y and low.z <= p.z <= high.z


@kernel
def is_in_slit(body: Body, t: int, p: Vec3, along: Vec3, forward: Vec3, reach: float) -> bool:
    """Return whether a point of the body at rest is next to a cut face parallel to the blade.

    A new cut so near to that face would be snapped to it: there is nothing left to cut, and no
    tissue ahead that resists.

    Args:
        body: The tissue.
        t: The tetrahedron that holds `p`.
        p: The point [m].
        along: Unit vector along the edge, in the deformed body.
        forward: Unit vector in which the edge cuts.
        reach: Distance within which crossings are snapped to existing nodes [m].
    """
    if not _near_cut(body, t):
        return False
    normal = normalised(cross(to_material(body, t, forward), to_material(body, t, along)))
    if _is_beside(body, t, p, normal, reach):
        return True
    for f in range(4):
        link = body.links[t, f]
        if link < 0:
            continue
        other = link // 4
        if _is_beside(body, other, p, normal, reach):
            return True
        for g in range(4):
            further = body.links[other, g]
            if further >= 0 and _is_beside(body, further // 4, p, normal, reach):
                return True
    return False


@kernel
def _near_cut(body: Body, t: int) -> bool:
    """Return whether a tetrahedron with a face of `t` has a node that a cut doubled."""
    for f in range(4):
        if body.twin[body.tetrahedra[t, f]] != body.tetrahedra[t, f]:
            return True
    for f in range(4):
        link = body.links[t, f]
        if link >= 0:
            node = body.tetrahedra[link // 4, link % 4]
            if body.twin[node] != node:
                return True
    return False


@kernel
def _is_beside(body: Body, t: int, p: Vec3, normal: Vec3, reach: float) -> bool:
    """Return whether a cut face of `t` is within `reach` of `p`, in the direction of `normal`."""
    for f in range(4):
        if body.links[t, f] != CUT:
            continue
        d = sub(
            p,
            nearest_on_triangle(
                p,
                vec3(body.rest, body.tetrahedra[t, (f + 1) % 4]),
                vec3(body.rest, body.tetrahedra[t, (f + 2) % 4]),
                vec3(body.rest, body.tetrahedra[t, (f + 3) % 4]),
            ),
        )
        distance = norm(d)
        if distance <= reach and abs(dot(d, normal)) >= _BESIDE * distance:
            return True
    return False


@kernel
def is_behind_edge(path: Path, p: Vec3) -> bool:
    """Return whether a point of the body at rest [m] is behind the edge, between tip and heel."""
    k, along = nearest_on_edge(path, p)
    if k < 0:
        return False
    is_first = k == 0 or not path.linked[k - 1]
    is_last = k + 2 == len(path.linked) or not path.linked[k + 1]
    if (is_first and along < 0.0) or (is_last and along > 1.0):
        return False
    at = nearest_on_segment(vec3(path.t1, k), vec3(path.t1, k + 1), p)
    return dot(sub(p, at), vec3(path.forward, k)) <= 0.0
