"""The rigid motion of loose pieces, which drag does not act on: a loose piece falls freely.

Drag damps the slow modes of tissue, which viscosity barely reaches. It stands for what
happens within tissue, and so acts on the motion of a piece less its rigid part, that with the same
momentum and the same angular momentum as the piece has. What is left has neither, so that drag
changes neither. Where drag differs from label to label, momenta are those of mass times drag. A
piece that is held somewhere has no rigid motion.
"""

from typing import NamedTuple

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import point, point_of, store_point, times
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, scale, sub, vec3
from tissue.forces.step_context import StepContext
from tissue.geometry.tetrahedron import Matrix3, determinant, solve
from tissue.mesh.body import Body
from tissue.mesh.pieces import LoosePieces

ROUND_ENOUGH = 1e-9
"""Determinant of a piece's inertia over that of a ball of the same trace, from which it is solved
for the rotation. Nodes in one line, with a determinant of zero, do not say how fast they turn about
it; then drag acts on the rotation too."""


class RigidMotion(NamedTuple):
    """Motion of a rigid piece; as velocities, or as displacements that are small."""

    centre: Vec3
    """Centre of mass [m]."""
    linear: Vec3
    """Motion of the centre of mass."""
    angular: Vec3
    """Rotation about it, along its axis."""


@kernel
def rigid_motion(
    masses: FloatArray, positions: FloatArray, pieces: LoosePieces, piece: int, motion: FloatArray
) -> RigidMotion:
    """Return the rigid part of the motion of a piece: with its momentum and angular momentum.

    Args:
        masses: Mass of each node [kg], shape (capacity,).
        positions: Positions of the nodes [m].
        pieces: The pieces.
        piece: Which of them.
        motion: Velocity, or displacement, of each node; shape (capacity, 3).
    """
    begin, end = pieces.begin[piece], pieces.begin[piece + 1]
    mass = 0.0
    centre, linear = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    for k in range(begin, end):
        i = pieces.node[k]
        m = masses[i]
        mass += m
        centre = axpy(m, vec3(positions, i), centre)
        linear = axpy(m, vec3(motion, i), linear)
    centre, linear = scale(1.0 / mass, centre), scale(1.0 / mass, linear)
    turned = Vec3(0.0, 0.0, 0.0)
    c0, c1, c2 = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    for k in range(begin, end):
        i = pieces.node[k]
        m = masses[i]
        r = sub(vec3(positions, i), centre)
        turned = axpy(m, cross(r, vec3(motion, i)), turned)
        rr = dot(r, r)
        c0 = axpy(m, axpy(-r.x, r, Vec3(rr, 0.0, 0.0)), c0)
        c1 = axpy(m, axpy(-r.y, r, Vec3(0.0, rr, 0.0)), c1)
        c2 = axpy(m, axpy(-r.z, r, Vec3(0.0, 0.0, rr)), c2)
    inertia = Matrix3(c0, c1, c2)
    mean = (c0.x + c1.y + c2.z) / 3.0
    if determinant(inertia) <= ROUND_ENOUGH * mean * mean * mean:
        return RigidMotion(centre, linear, Vec3(0.0, 0.0, 0.0))
    return RigidMotion(centre, linear, solve(inertia, turned))


@kernel
def add_rigid_part(
    body: Body, loose: LoosePieces, motion: FloatArray, factor: float, out: FloatArray
) -> None:
    """Add the rigid part of the motion of loose pieces to `out`, for each node by its drag.

    Args:
        body: Masses and positions.
        loose: The loose pieces.
        motion: Velocity, or displacement, of each node; shape (capacity, 3).
        factor: By which the rigid part is multiplied where drag is highest.
        out: Where it is added, shape (capacity, 3).
    """
    masses = body.masses
    if body.materials.has_one_drag == 0:
        # Drag on what is left of the motion has neither a resultant nor a torque.
        masses = body.dragged_masses
        for k in range(len(loose.node)):
            i = loose.node[k]
            masses[i] = body.masses[i] * body.drag[i]
    for piece in range(len(loose.begin) - 1):
        rigid = rigid_motion(masses, body.positions, loose, piece, motion)
        for k in range(loose.begin[piece], loose.begin[piece + 1]):
            i = loose.node[k]
            r = sub(vec3(body.positions, i), rigid.centre)
            at = add(rigid.linear, cross(rigid.angular, r))
            share = factor * body.drag[i]
            store_point(out, i, point(out, i) + times(share, point_of(at.x, at.y, at.z)))


@kernel
def note_loose_positions(context: StepContext) -> None:
    """Note where the nodes of loose pieces are before a step whose stages are damped."""
    loose, body, stages = context.loose, context.body, context.stages
    for k in range(len(loose.node)):
        i = loose.node[k]
        store_point(stages.start_positions, i, point(body.positions, i))


@kernel
def return_rigid_motion(context: StepContext, h: float) -> None:
    """Give loose pieces back what drag took from their rigid motion in a step of `h` [s].

    It is drag times the path of the pieces, which is the integral of their velocity.
    """
    loose, body, stages, damping = context.loose, context.body, context.stages, context.damping
    given = 0.0
    for k in range(len(loose.node)):
        i = loose.node[k]
        store_point(stages.change, i, point(body.positions, i) - point(stages.start_positions, i))
        store_point(stages.a1, i, point_of(0.0, 0.0, 0.0))
    add_rigid_part(body, loose, stages.change, context.surroundings.drag, stages.a1)
    for k in range(len(loose.node)):
        i = loose.node[k]
        before = vec3(body.velocities, i)
        store_point(body.velocities, i, point(body.velocities, i) + point(stages.a1, i))
        moved = times(0.5 * h, point(stages.a1, i))
        store_point(body.positions, i, point(body.positions, i) + moved)
        weight = body.masses[i] - body.added_masses[i]
        fallen = dot(context.surroundings.gravity, vec3(stages.a1, i))
        given -= 0.5 * h * weight * fallen
        after = vec3(body.velocities, i)
        given += 0.5 * body.masses[i] * (dot(after, after) - dot(before, before))
    if context.damping.is_counted == 1:
        damping.dissipated -= given
