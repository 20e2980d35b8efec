"""The search for the skin ahead of the blade's blunt sides, in each part of a step.

A sample that was away from the tissue and is now within it has come through the skin that lies
straight behind it, seen along the side's outward direction. While it presses, that point is looked
for again, so that the sample slides over the skin from face to face.

A side meets skin only where it goes ahead of the edge. Where the edge goes ahead, it parts what
would come to the other sides.
"""

from typing import NamedTuple

import numpy as np

from tissue.blade.blade_state import BladeState
from tissue.blade.edge import BladeMotion, BladePose, displacement_of
from tissue.blade.faces_contact import FaceContacts
from tissue.blade.return_mapping import locate
from tissue.blade.spine_contact import (
    AWAY,
    IDLE,
    PIERCING,
    PRESSING,
    SpineSide,
    fit_stiffness,
    press_energy,
    press_of,
    spine_side,
    touched_point,
)
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, store, sub, vec3
from tissue.geometry.tetrahedron import Weights, barycentric_in, clipped, interpolate
from tissue.mesh.body import CUT, Body
from tissue.mesh.point_location import tetrahedron_at
from tissue.mesh.star import Visits
from tissue.mesh.tetrahedron_grid import TetrahedronGrid

LEAST_FACING, LEAST_FACING_OF_LIP = 0.3, 0.9
"""Cosine of the angle between a face's normal and the inward direction of a blunt side, from which
skin, or a face that was cut, lies ahead of the side. The lips of a cut that bends are tilted
against a blade in it: with 0.3 they held back one that was withdrawn."""

DEEPEST_ENTRY = 0.5
"""Depth below the skin of a sample that has just come through it, at most, per `BladeState.reach`.
What is deeper has come in otherwise, through the mouth of a cut."""

ON_FACE = 1e-9
"""Barycentric weight above which, less its sign, a line meets a face, so that no line passes
between two faces for rounding."""

ON_PLANE = 1e-9
"""Distance from the blade's plane up to which a face still meets it [m]: above any rounding."""

_NOT_LISTED = -1


class Skin(NamedTuple):
    """The skin behind a sample."""

    face: int
    """The face, as 4 * tetrahedron + corner opposite; -1 for none."""
    depth: float
    """Distance of the sample from it [m]."""
    weights: Weights
    """Barycentric weights of the point in its tetrahedron."""


@kernel
def update_spine(blade: BladeState, body: Body, grid: TetrahedronGrid, motion: BladeMotion) -> None:
    """Find what the blunt sides press on.

    Args:
        blade: The samples are written; its side contacts list the open faces around the blade.
        body: The tissue.
        grid: Grid that lists the tetrahedra.
        motion: Pose and motion of the blade.
    """
    spine, pose = blade.spine, motion.pose
    n_faces = _NOT_LISTED
    for k in range(len(spine.state)):
        if spine.state[k] == PIERCING:
            continue
        side = spine_side(spine, pose, k)
        if spine.state[k] != PRESSING:
            was_away = spine.state[k] == AWAY
            spine.state[k] = IDLE
            if not _leads(motion, side):
                continue
            if tetrahedron_at(body, grid, body.positions, side.at) < 0:
                spine.state[k] = AWAY
                continue
            if not was_away:
                continue
        if n_faces == _NOT_LISTED:
            n_faces = _list_faces_in_plane(blade.sides, body, pose)
        skin = _skin_behind(blade.sides, body, side, pose.normal, n_faces)
        if spine.state[k] == PRESSING:
            _slide(blade, body, pose, side, k, skin)
        elif skin.face >= 0 and skin.depth <= DEEPEST_ENTRY * blade.reach:
            spine.held[k, 0] = spine.held[k, 1] = 0.0
            spine.state[k] = PRESSING
            spine.n_pressing += 1
            _take_point(blade, body, pose, side, k, skin)


@kernel
def _leads(motion: BladeMotion, side: SpineSide) -> bool:
    """Return whether a side goes ahead of the edge, or the blade stands still.

    Where the edge goes ahead, it parts what would come to the other sides.
    """
    moved = displacement_of(motion, side.at)
    return bool(dot(moved, side.outward) >= max(dot(moved, motion.pose.forward), 0.0))


@kernel
def _slide(
    blade: BladeState, body: Body, pose: BladePose, side: SpineSide, k: int, skin: Skin
) -> None:
    """Press sample `k` on the skin where it is now; release it where there is none.

    Args:
        blade: The sample is written.
        body: The tissue.
        pose: Pose of the blade.
        side: Axes of the sample.
        k: The sample.
        skin: The skin straight behind it.
    """
    spine, farthest = blade.spine, DEEPEST_ENTRY * blade.reach
    point = touched_point(spine, body, body.positions, k)
    press = press_of(spine, k, side, pose.normal, point, blade.toughness)
    if skin.face >= 0 and skin.depth <= press.depth + farthest:
        blade.totals.released += press_energy(spine, k, press)
        spine.held[k, 0], spine.held[k, 1] = press.beside, press.across
        _take_point(blade, body, pose, side, k, skin)
        return
    # There is no skin straight behind it, or other skin that lies beyond.
    stretch = sub(side.at, point)
    sideways = axpy(-dot(stretch, side.outward), side.outward, stretch)
    if norm(sideways) > farthest:
        blade.totals.released += press_energy(spine, k, press)
        spine.energy[k] = 0.0
        spine.state[k] = IDLE
        spine.n_pressing -= 1


@kernel
def _take_point(
    blade: BladeState, body: Body, pose: BladePose, side: SpineSide, k: int, skin: Skin
) -> None:
    """Begin the contact of sample `k` with a point of the skin; count its first energy.

    Args:
        blade: The sample is written.
        body: The tissue.
        pose: Pose of the blade.
        side: Axes of the sample.
        k: The sample.
        skin: The point.
    """
    spine = blade.spine
    _set_point(blade, body, k, skin.face // 4, skin.weights)
    fit_stiffness(spine, body, k, pose.normal)
    point = touched_point(spine, body, body.positions, k)
    press = press_of(spine, k, side, pose.normal, point, blade.toughness)
    spine.energy[k] = press_energy(spine, k, press)
    blade.totals.released -= spine.energy[k]


@kernel
def _set_point(blade: BladeState, body: Body, k: int, t: int, w: Weights) -> None:
    """Write the point that sample `k` touches, by its weights in tetrahedron `t`."""
    spine, row = blade.spine, body.material[t]
    for i in range(4):
        spine.relative[k, i] = blade.toughness.relative[row, i]
    spine.material[k], spine.friction[k] = row, blade.sides.of_materials[row, 0]
    spine.tetrahedron[k] = t
    spine.weights[k, 0], spine.weights[k, 1] = w.a, w.b
    spine.weights[k, 2], spine.weights[k, 3] = w.c, w.d
    store(spine.rest, k, interpolate(w, body.rest, body.tetrahedra, t))


@kernel
def _list_faces_in_plane(sides: FaceContacts, body: Body, pose: BladePose) -> int:
    """Write the open faces around that the blade's plane meets to `sides.found`; return how many.

    All samples are in that plane, and find skin within it.
    """
    n = 0
    plane = dot(pose.tip, pose.normal)
    for i in range(sides.n_around):
        low, high = np.inf, -np.inf
        for corner in range(3):
            at = vec3(body.positions, sides.node_around[i, corner])
            across = dot(at, pose.normal) - plane
            low, high = min(low, across), max(high, across)
        if low <= ON_PLANE and high >= -ON_PLANE:
            sides.found[n] = i
            n += 1
    return n


@kernel
def _skin_behind(sides: FaceContacts, body: Body, side: SpineSide, normal: Vec3, n: int) -> Skin:
    """Return the nearest open face that a line from a sample straight into the blade meets.

    Args:
        sides: The first `n` of `found` are the faces that the plane of the blade meets.
        body: The tissue.
        side: Axes of the sample.
        normal: Normal of the blade's plane.
        n: How many faces these are.
    """
    best = Skin(-1, np.inf, Weights(0.0, 0.0, 0.0, 0.0))
    for i in range(n):
        skin = _face_behind(body, sides.around[sides.found[i]], sides.outward, side, normal)
        if skin.face >= 0 and skin.depth < best.depth:
            best = skin
    return best


@kernel
def _face_behind(body: Body, face: int, outward: IntArray, side: SpineSide, normal: Vec3) -> Skin:
    """Return where a line from a sample straight into the blade meets a face, if it does."""
    none = Skin(-1, np.inf, Weights(0.0, 0.0, 0.0, 0.0))
    t, f = face // 4, face % 4
    i, j, k = outward[f, 0], outward[f, 1], outward[f, 2]
    a = sub(vec3(body.positions, body.tetrahedra[t, i]), side.at)
    b = sub(vec3(body.positions, body.tetrahedra[t, j]), side.at)
    c = sub(vec3(body.positions, body.tetrahedra[t, k]), side.at)
    # Twice the areas that the line's foot makes with the corners, seen along the line.
    au, av = dot(a, side.beside), dot(a, normal)
    bu, bv = dot(b, side.beside), dot(b, normal)
    cu, cv = dot(c, side.beside), dot(c, normal)
    wa, wb, wc = bu * cv - bv * cu, cu * av - cv * au, au * bv - av * bu
    total = wa + wb + wc
    if total == 0.0:
        return none
    wa, wb, wc = wa / total, wb / total, wc / total
    if min(wa, min(wb, wc)) < -ON_FACE:
        return none
    depth = -(wa * dot(a, side.outward) + wb * dot(b, side.outward) + wc * dot(c, side.outward))
    if depth < 0.0:
        return none
    area = cross(sub(b, a), sub(c, a))
    least = LEAST_FACING_OF_LIP if body.links[t, f] == CUT else LEAST_FACING
    if dot(area, side.outward) > -least * norm(area):
        return none
    return Skin(face, depth, _in_tetrahedron(i, wa, j, wb, k, wc))


@kernel
def _in_tetrahedron(i: int, wi: float, j: int, wj: float, k: int, wk: float) -> Weights:
    """Return the weights of the four corners from those of corners `i`, `j` and `k`."""
    return Weights(
        (wi if i == 0 else 0.0) + (wj if j == 0 else 0.0) + (wk if k == 0 else 0.0),
        (wi if i == 1 else 0.0) + (wj if j == 1 else 0.0) + (wk if k == 1 else 0.0),
        (wi if i == 2 else 0.0) + (wj if j == 2 else 0.0) + (wk if k == 2 else 0.0),
        (wi if i == 3 else 0.0) + (wj if j == 3 else 0.0) + (wk if k == 3 else 0.0),
    )


@kernel
def release_spine(blade: BladeState) -> None:
    """End all contact of the blunt sides; count their energy as released."""
    spine = blade.spine
    for k in range(len(spine.state)):
        blade.totals.released += spine.energy[k]
        spine.energy[k] = 0.0
        spine.state[k] = AWAY
    spine.n_pressing = 0


@kernel
def move_point(blade: BladeState, body: Body, visits: Visits, k: int, p: Vec3) -> bool:
    """Move a sample to a point of the body at rest; return whether the point is inside.

    Args:
        blade: The sample is written.
        body: The tissue.
        visits: For searches.
        k: The sample.
        p: The point [m]; for one outside, a point of the tetrahedron nearby is taken.
    """
    spine = blade.spine
    location = locate(body, visits, p, spine.tetrahedron[k], blade.queue)
    t = location.tetrahedron
    _set_point(blade, body, k, t, clipped(barycentric_in(p, body.rest, body.tetrahedra, t)))
    return location.inside


@kernel
def relocate_spine(blade: BladeState, body: Body, visits: Visits) -> None:
    """Find the tetrahedra of the touched points again after the mesh changed."""
    spine = blade.spine
    if spine.n_pressing == 0:
        return
    for k in range(len(spine.state)):
        if spine.state[k] >= PRESSING:
            move_point(blade, body, visits, k, vec3(spine.rest, k))
