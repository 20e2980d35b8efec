"""The search for the skin that is in the way of the blade's blunt sides, in each part of a step.

A sample that was outside the tissue and is now within it has come through the skin that lies
straight behind it, seen along the side's outward direction. While it presses, that point is looked
for again, so that the sample slides over the skin from face to face.

The end at the tip meets skin only where the tip leads, in a stab. Where the edge leads, it parts
what would come to that end.
"""

from typing import NamedTuple

import numpy as np

from tissue.blade.blade_state import BladeState
from tissue.blade.blunt_contact import (
    AWAY,
    PIERCING,
    PRESSING,
    TIP_END,
    WITHIN,
    BluntContacts,
    BluntSide,
    blunt_side,
    press_energy,
    press_of,
    touched_point,
)
from tissue.blade.edge import BladeMotion, displacement_of
from tissue.blade.return_mapping import locate
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, norm, store, sub, vec3
from tissue.geometry.tetrahedron import Weights, barycentric_in, interpolate
from tissue.mesh.body import Body
from tissue.mesh.point_location import TetrahedronGrid, tetrahedron_at
from tissue.mesh.star import Visits

LEAST_FACING = 0.3
"""Cosine of the angle between a face's normal and the inward direction of a blunt side, from which
the face is in the way of the side. The lips of a cut, along which the sides slide, are not."""

DEEPEST_ENTRY = 0.5
"""How deep below the skin a sample can be that has just come through it, per `BladeState.reach`.
What is deeper has come in otherwise, through the mouth of a cut."""

ON_FACE = 1e-9
"""Barycentric weight above which, less its sign, a line meets a face, so that no line passes
between two faces for rounding."""


class Skin(NamedTuple):
    """The skin behind a sample."""

    face: int
    """The face, as 4 * tetrahedron + corner opposite; -1 for none."""
    depth: float
    """Distance of the sample from it [m]."""
    weights: Weights
    """Barycentric weights of the point in its tetrahedron."""


@kernel
def update_blunt_sides(
    blade: BladeState, body: Body, grid: TetrahedronGrid, motion: BladeMotion
) -> None:
    """Find what the blunt sides press on.

    Args:
        blade: The samples are written; its side contacts list the open faces around the blade.
        body: The tissue.
        grid: Grid that lists the tetrahedra.
        motion: Pose and motion of the blade.
    """
    blunt, totals, law = blade.blunt, blade.totals, blade.toughness
    pose, deepest = motion.pose, DEEPEST_ENTRY * blade.reach
    for k in range(len(blunt.state)):
        side = blunt_side(blunt, pose, k)
        if blunt.state[k] == PIERCING:
            continue
        if blunt.state[k] != PRESSING:
            was_outside = blunt.state[k] == AWAY
            is_within = tetrahedron_at(body, grid, body.positions, side.at) >= 0
            blunt.state[k] = WITHIN if is_within else AWAY
            if not (was_outside and is_within and _may_enter(blunt, motion, k, side)):
                continue
        skin = _skin_behind(blade, body, side, pose.normal)
        if skin.face < 0:
            continue
        if blunt.state[k] == PRESSING:
            point = touched_point(blunt, body, body.positions, k)
            press = press_of(blunt, k, side, pose.normal, point, law)
            if skin.depth > press.depth + deepest:
                continue  # other skin, beyond that which it touches
            totals.released += press_energy(blunt, k, press)
            blunt.held[k, 0], blunt.held[k, 1] = press.beside, press.across
        elif skin.depth <= deepest:
            blunt.held[k, 0] = blunt.held[k, 1] = 0.0
            blunt.state[k] = PRESSING
            blunt.n_pressing += 1
        else:
            continue
        _take_point(blade, body, k, skin)
        point = touched_point(blunt, body, body.positions, k)
        press = press_of(blunt, k, side, pose.normal, point, law)
        blunt.energy[k] = press_energy(blunt, k, press)
        totals.released -= blunt.energy[k]


@kernel
def _may_enter(blunt: BluntContacts, motion: BladeMotion, k: int, side: BluntSide) -> bool:
    """Return whether sample `k` meets skin; at the tip's end, whether the tip leads."""
    if blunt.side[k] != TIP_END:
        return True
    moved = displacement_of(motion, side.at)
    return bool(dot(moved, side.outward) > max(dot(moved, motion.pose.forward), 0.0))


@kernel
def _take_point(blade: BladeState, body: Body, k: int, skin: Skin) -> None:
    """Let sample `k` touch a point of the skin."""
    blunt, t = blade.blunt, skin.face // 4
    blunt.tetrahedron[k] = t
    w = skin.weights
    blunt.weights[k, 0], blunt.weights[k, 1] = w.a, w.b
    blunt.weights[k, 2], blunt.weights[k, 3] = w.c, w.d
    store(blunt.rest, k, interpolate(w, body.rest, body.tetrahedra, t))


@kernel
def _skin_behind(blade: BladeState, body: Body, side: BluntSide, normal: Vec3) -> Skin:
    """Return the nearest open face that a line from a sample straight into the blade meets."""
    sides = blade.sides
    best = Skin(-1, np.inf, Weights(0.0, 0.0, 0.0, 0.0))
    for i in range(sides.n_around):
        skin = _face_behind(body, sides.around[i], sides.outward, side, normal)
        if skin.face >= 0 and skin.depth < best.depth:
            best = skin
    return best


@kernel
def _face_behind(body: Body, face: int, outward: IntArray, side: BluntSide, normal: Vec3) -> Skin:
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
    if dot(area, side.outward) > -LEAST_FACING * norm(area):
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
def release_blunt_sides(blade: BladeState) -> None:
    """End all contact of the blunt sides; count their energy as released."""
    blunt = blade.blunt
    for k in range(len(blunt.state)):
        blade.totals.released += blunt.energy[k]
        blunt.energy[k] = 0.0
        blunt.state[k] = AWAY
    blunt.n_pressing = 0


@kernel
def move_point(blade: BladeState, body: Body, visits: Visits, k: int, p: Vec3) -> bool:
    """Let a sample touch a point of the body at rest; return whether the point is inside.

    Args:
        blade: The sample is written.
        body: The tissue.
        visits: For searches.
        k: The sample.
        p: The point [m]; for one outside, a point of the tetrahedron nearby is taken.
    """
    blunt = blade.blunt
    location = locate(body, visits, p, blunt.tetrahedron[k], blade.queue)
    t = location.tetrahedron
    w = barycentric_in(p, body.rest, body.tetrahedra, t)
    if not location.inside:
        w = _clipped(w)
    blunt.tetrahedron[k] = t
    blunt.weights[k, 0], blunt.weights[k, 1] = w.a, w.b
    blunt.weights[k, 2], blunt.weights[k, 3] = w.c, w.d
    store(blunt.rest, k, interpolate(w, body.rest, body.tetrahedra, t))
    return location.inside


@kernel
def _clipped(w: Weights) -> Weights:
    """Return the weights of a point of the tetrahedron near one that is outside it."""
    a, b, c, d = max(w.a, 0.0), max(w.b, 0.0), max(w.c, 0.0), max(w.d, 0.0)
    total = a + b + c + d
    return Weights(a / total, b / total, c / total, d / total)


@kernel
def relocate_blunt_sides(blade: BladeState, body: Body, visits: Visits) -> None:
    """Find the tetrahedra of the touched points again after the mesh changed."""
    blunt = blade.blunt
    if blunt.n_pressing == 0:
        return
    for k in range(len(blunt.state)):
        if blunt.state[k] >= PRESSING:
            move_point(blade, body, visits, k, vec3(blunt.rest, k))
