"""The motion of rigid cores within a step: their nodes stay where the rigid body has them.

The forces on the nodes of a core are those of a rigid body (`tissue.forces.core_reactions`), but a
method moves nodes along curves that fit a turn only to its order. After each stage the nodes are
put to the nearest pose of the core, in the mean of squares weighted with their masses: that moves
neither the centre of mass nor, to first order, the angular momentum. Position Verlet lets a core
turn freely between its kicks, with the momentum and the angular momentum that it has, so that both
are conserved to rounding.
"""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import point
from tissue.core.simd_points import store_row
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.forces.acceleration import is_solid
from tissue.forces.rigid_motion import RigidMotion, rigid_motion
from tissue.forces.step_context import StepContext
from tissue.geometry.polar_decomposition import apply_transposed, nearest_rotation
from tissue.geometry.tetrahedron import Matrix3, apply, solve
from tissue.mesh.body import Body
from tissue.mesh.rigid_cores import Cores

_CORRECTIONS = 3
"""Corrections of a pose: each takes the angle that it is off to about its product with the largest
strain of the nodes, 1e-6 in a step in which a core turns by 1e-2, say."""


class CorePose(NamedTuple):
    """Where a core is, and how its mass is distributed."""

    middle: Vec3
    """Centre of mass in the frame of the core [m]."""
    inertia: Matrix3
    """Inertia about it, along the axes of that frame [kg m2]."""
    centre: Vec3
    """Centre of mass in space [m]."""
    rotation: Matrix3
    """Axes of the frame, as columns."""


@kernel
def turned_by(rotation: Matrix3, angle: Vec3) -> Matrix3:
    """Return a rotation after a turn by a vector along its axis, as long as its angle [rad]."""
    size = norm(angle)
    if size == 0.0:
        return rotation
    axis, sine, half = scale(1.0 / size, angle), math.sin(size), math.sin(0.5 * size)
    return Matrix3(
        _turned(rotation.c0, axis, sine, 2.0 * half * half),
        _turned(rotation.c1, axis, sine, 2.0 * half * half),
        _turned(rotation.c2, axis, sine, 2.0 * half * half),
    )


@kernel
def _turned(a: Vec3, axis: Vec3, sine: float, versine: float) -> Vec3:
    """Return a vector after a turn about an axis, by Rodrigues' formula."""
    across = cross(axis, a)
    return axpy(versine, cross(axis, across), axpy(sine, across, a))


@kernel
def spin_of(pose: CorePose, angular_momentum: Vec3) -> Vec3:
    """Return the angular velocity [rad/s] of a core with an angular momentum [N m s]."""
    own = solve(pose.inertia, apply_transposed(pose.rotation, angular_momentum))
    spin: Vec3 = apply(pose.rotation, own)
    return spin


@kernel
def pose_of_core(body: Body, cores: Cores, core: int, positions: FloatArray) -> CorePose:
    """Return the pose of a core nearest to where its nodes are.

    Args:
        body: Masses.
        cores: All cores.
        core: Which of them.
        positions: Positions of the nodes [m].
    """
    pieces = cores.pieces
    members = range(pieces.begin[core], pieces.begin[core + 1])
    mass, middle, centre = 0.0, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    for k in members:
        m = body.masses[pieces.node[k]]
        mass += m
        middle = axpy(m, vec3(cores.shape, k), middle)
        centre = axpy(m, vec3(positions, pieces.node[k]), centre)
    middle, centre = scale(1.0 / mass, middle), scale(1.0 / mass, centre)
    zero = Vec3(0.0, 0.0, 0.0)
    a0, a1, a2, s0, s1, s2 = zero, zero, zero, zero, zero, zero
    for k in members:
        m = body.masses[pieces.node[k]]
        own, r = sub(vec3(cores.shape, k), middle), sub(vec3(positions, pieces.node[k]), centre)
        a0, a1, a2 = axpy(m * own.x, r, a0), axpy(m * own.y, r, a1), axpy(m * own.z, r, a2)
        s0, s1, s2 = axpy(m * own.x, own, s0), axpy(m * own.y, own, s1), axpy(m * own.z, own, s2)
    trace = s0.x + s1.y + s2.z
    inertia = Matrix3(
        sub(Vec3(trace, 0.0, 0.0), s0),
        sub(Vec3(0.0, trace, 0.0), s1),
        sub(Vec3(0.0, 0.0, trace), s2),
    )
    spread = Matrix3(s0, s1, s2)
    moved = Matrix3(a0, a1, a2)
    rotation: Matrix3 = nearest_rotation(_over(moved, spread))
    for _ in range(_CORRECTIONS):
        off = add(cross(rotation.c0, a0), add(cross(rotation.c1, a1), cross(rotation.c2, a2)))
        angle = spin_of(CorePose(middle, inertia, centre, rotation), off)
        rotation = turned_by(rotation, angle)
    return CorePose(middle, inertia, centre, rotation)


@kernel
def _over(a: Matrix3, s: Matrix3) -> Matrix3:
    """Return a s^-1 of a symmetric matrix s."""
    return Matrix3(
        apply(a, solve(s, Vec3(1.0, 0.0, 0.0))),
        apply(a, solve(s, Vec3(0.0, 1.0, 0.0))),
        apply(a, solve(s, Vec3(0.0, 0.0, 1.0))),
    )


@kernel
def hold_cores(context: StepContext, positions: FloatArray, velocities: FloatArray) -> None:
    """Put the nodes of cores to the nearest pose, and give them the velocities of rigid bodies.

    Args:
        context: Masses and cores; displacements are written to its elasticity.
        positions: Positions of the nodes [m]; written.
        velocities: Their velocities [m/s]; written.
    """
    body, cores = context.body, context.cores
    for core in range(len(cores.pieces.begin) - 1):
        pose = pose_of_core(body, cores, core, positions)
        _place(context, core, pose, positions)
        motion = rigid_motion(body.masses, positions, cores.pieces, core, velocities)
        _move(cores, core, motion, positions, velocities)


@kernel
def drift_cores(context: StepContext, seconds: float) -> None:
    """Move cores freely, after a loop that moved nodes along straight lines for that time [s].

    Half-way the angular velocity is that of the angular momentum in the pose there: of second
    order.
    """
    body, cores = context.body, context.cores
    x, v, pieces = body.positions, body.velocities, cores.pieces
    for core in range(len(pieces.begin) - 1):
        for k in range(pieces.begin[core], pieces.begin[core + 1]):
            i = pieces.node[k]
            store(x, i, axpy(-seconds, vec3(v, i), vec3(x, i)))
        motion = rigid_motion(body.masses, x, pieces, core, v)
        before = pose_of_core(body, cores, core, x)
        momentum = _angular_momentum(before, motion.angular)
        middle, inertia = before.middle, before.inertia
        half = turned_by(before.rotation, scale(0.5 * seconds, motion.angular))
        angle = scale(seconds, spin_of(CorePose(middle, inertia, before.centre, half), momentum))
        centre = axpy(seconds, motion.linear, motion.centre)
        after = CorePose(middle, inertia, centre, turned_by(before.rotation, angle))
        _place(context, core, after, x)
        _move(cores, core, RigidMotion(centre, motion.linear, spin_of(after, momentum)), x, v)


@kernel
def _angular_momentum(pose: CorePose, spin: Vec3) -> Vec3:
    """Return the angular momentum of a core [N m s] that turns at an angular velocity [rad/s]."""
    own = apply(pose.inertia, apply_transposed(pose.rotation, spin))
    momentum: Vec3 = apply(pose.rotation, own)
    return momentum


@kernel
def _place(context: StepContext, core: int, pose: CorePose, positions: FloatArray) -> None:
    """Put the nodes of a core where a pose has them."""
    body, cores, is_displaced = context.body, context.cores, is_solid(context)
    for k in range(cores.pieces.begin[core], cores.pieces.begin[core + 1]):
        i = cores.pieces.node[k]
        own = sub(vec3(cores.shape, k), pose.middle)
        store(positions, i, add(pose.centre, apply(pose.rotation, own)))
        if is_displaced:
            displacement = context.elastic.solid.displacement
            store_row(displacement, i, point(positions, i) - point(body.rest, i))


@kernel
def _move(
    cores: Cores, core: int, motion: RigidMotion, positions: FloatArray, velocities: FloatArray
) -> None:
    """Give the nodes of a core the velocities of a rigid motion."""
    for k in range(cores.pieces.begin[core], cores.pieces.begin[core + 1]):
        i = cores.pieces.node[k]
        arm = sub(vec3(positions, i), motion.centre)
        store(velocities, i, add(motion.linear, cross(motion.angular, arm)))


@kernel
def change_cores_as_one(context: StepContext, change: FloatArray) -> None:
    """Make changes of the velocities of the nodes of cores [m/s] rigid, with the same momenta."""
    body, cores = context.body, context.cores
    for core in range(len(cores.pieces.begin) - 1):
        motion = rigid_motion(body.masses, body.positions, cores.pieces, core, change)
        _move(cores, core, motion, body.positions, change)


@kernel
def hold_cores_at_geoms(context: StepContext) -> None:
    """Hold cores rigid after geoms pushed single nodes; what that takes is lost in contact."""
    before = _kinetic_energy(context.body, context.cores)
    hold_cores(context, context.body.positions, context.body.velocities)
    context.geoms.dissipated += before - _kinetic_energy(context.body, context.cores)


@kernel
def _kinetic_energy(body: Body, cores: Cores) -> float:
    """Return the kinetic energy of the nodes of all cores [J]."""
    energy = 0.0
    for k in range(len(cores.pieces.node)):
        v = vec3(body.velocities, cores.pieces.node[k])
        energy += 0.5 * body.masses[cores.pieces.node[k]] * dot(v, v)
    return energy
