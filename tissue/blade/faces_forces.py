"""Forces of the blade's side faces on the nodes, and sliding against friction."""

import numpy as np

from tissue.blade.blade_state import (
    BladeState,
    add_reaction,
    add_to_node,
    running_totals,
    store_totals,
)
from tissue.blade.edge import (
    BladeCoordinates,
    BladeMotion,
    BladePose,
    blade_coordinates,
    displacement_of,
)
from tissue.blade.faces_contact import (
    CORNER,
    END_SLOPE,
    OTHER,
    POINTS,
    FaceContacts,
    contact_forces,
    corners_of,
    friction_stretch,
    is_clear,
    penetration,
    point_near_first,
    turned,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add
from tissue.mesh.body import Body


@kernel
def apply_face_forces(
    blade: BladeState,
    motion: BladeMotion,
    positions: FloatArray,
    share: float,
    dt: float,
    external: FloatArray,
) -> None:
    """Add the forces of the side faces to those on the nodes; count impulse and work.

    Args:
        blade: Its totals are written.
        motion: Pose and motion of the blade.
        positions: Positions of the nodes [m].
        share: Weight of this evaluation in the integral over the step; they add up to 1.
        dt: Length of the time step [s].
        external: Forces on the nodes [N], shape (capacity, 3).
    """
    sides, pose = blade.sides, motion.pose
    if sides.n_faces == 0:
        return
    seconds = share * dt
    running = running_totals(blade.totals)
    for i in range(sides.n_faces):
        corners = corners_of(sides, positions, i)
        if is_clear(sides, pose, corners, i):
            continue
        for q in range(POINTS):
            p = point_near_first(corners)
            corners = turned(corners)
            force = _force_at(sides, pose, i, q, blade_coordinates(pose, p))
            if force.x == 0.0 and force.y == 0.0 and force.z == 0.0:
                continue
            for corner in range(3):
                w = CORNER if corner == q else OTHER
                node = sides.node[i, corner]
                running = add_to_node(external, running, node, w, force, seconds)
            running = add_reaction(running, p, force, displacement_of(motion, p), share, seconds)
    store_totals(blade.totals, running)


@kernel
def _force_at(sides: FaceContacts, pose: BladePose, i: int, q: int, at: BladeCoordinates) -> Vec3:
    """Return the force of the blade on the tissue at a contact point [N]."""
    inside = penetration(sides, pose.length, i, q, at)
    if inside.depth <= 0.0:
        return Vec3(0.0, 0.0, 0.0)
    forces = contact_forces(sides, pose, i, q, at, inside)
    return add(forces.normal, forces.friction)


@kernel
def apply_sliding(
    blade: BladeState, pose: BladePose, positions: FloatArray, seconds: float
) -> None:
    """Slide the contact points whose friction exceeds its limit, and count the work.

    Args:
        blade: Side contacts and totals are written.
        pose: Pose of the blade.
        positions: Positions of the nodes [m].
        seconds: Time since sliding was applied last [s].
    """
    sides, totals = blade.sides, blade.totals
    states = sides.states
    for i in range(sides.n_faces):
        stiffness = sides.stiffness * states.area[i]
        energy = 0.0
        corners = corners_of(sides, positions, i)
        for q in range(POINTS):
            at = blade_coordinates(pose, point_near_first(corners))
            corners = turned(corners)
            depth = penetration(sides, pose.length, i, q, at).depth
            held = friction_stretch(sides, i, q, at, max(stiffness * depth, 0.0))
            before = held.along * held.along + held.behind * held.behind
            spent = stiffness * np.sqrt(before) * held.surplus + 0.5 * stiffness * before
            if depth <= 0.0:
                states.stuck_along[i, q] = at.along
                states.stuck_behind[i, q] = at.behind
                states.sliding_speed[i, q] = 0.0
                totals.work_of_friction += spent
                continue
            _slide_point(sides, i, q, at, stiffness * depth, seconds)
            left = friction_stretch(sides, i, q, at, stiffness * depth)
            kept = 0.5 * stiffness * (left.along * left.along + left.behind * left.behind)
            totals.work_of_friction += spent - kept
            energy += 0.5 * stiffness * depth * depth + kept
        states.energy[i] = energy


@kernel
def _slide_point(
    sides: FaceContacts, i: int, q: int, at: BladeCoordinates, normal_force: float, seconds: float
) -> None:
    """Move the point where friction would be zero, by an implicit step.

    stiffness (stretch - slide) = friction limit + viscosity slide / seconds, solved for the slide.
    """
    states = sides.states
    da = at.along - states.stuck_along[i, q]
    ds = at.behind - states.stuck_behind[i, q]
    stretch = np.sqrt(da * da + ds * ds)
    stiffness = sides.stiffness * states.area[i]
    surplus = stiffness * stretch - sides.friction[i] * normal_force
    if surplus <= 0.0 or seconds <= 0.0:
        states.sliding_speed[i, q] = 0.0
        return
    slide = surplus / (stiffness + sides.viscosity[i] * states.area[i] / seconds)
    states.stuck_along[i, q] += slide * da / stretch
    states.stuck_behind[i, q] += slide * ds / stretch
    states.sliding_speed[i, q] = slide / seconds


@kernel
def clear_face_forces(sides: FaceContacts, external: FloatArray) -> None:
    """Set the forces on the nodes that the side faces may press on to zero."""
    for i in range(sides.n_faces):
        for corner in range(3):
            node = sides.node[i, corner]
            external[node, 0] = external[node, 1] = external[node, 2] = 0.0


@kernel
def add_face_stiffness(sides: FaceContacts, stiffness: FloatArray) -> None:
    """Add the rows of the side contacts to `stiffness` [N/m], shape (capacity, 3).

    Only x of `stiffness` is used. The stiffness of a contact point is the same across the face and
    along it; a slope adds its share.
    """
    more = 1.0 + max(sides.slope, END_SLOPE) ** 2
    for i in range(sides.n_faces):
        for corner in range(3):
            # The weights of the three points on a corner add up to 1.
            stiffness[sides.node[i, corner], 0] += more * sides.stiffness * sides.states.area[i]


@kernel
def highest_face_frequency(
    sides: FaceContacts, body: Body, frequency_squared: FloatArray, stiffness: FloatArray
) -> float:
    """Return a bound on w^2 [1/s2] over the nodes near the side faces.

    It is that of the body, `frequency_squared`, and of `stiffness` together.
    """
    worst = 0.0
    for i in range(sides.n_faces):
        for corner in range(3):
            node = sides.node[i, corner]
            if not body.fixed[node]:
                own = frequency_squared[node] + stiffness[node, 0] / body.masses[node]
                worst = max(worst, own)
    return worst
