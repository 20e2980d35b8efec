"""The forces that keep rigid cores rigid: d'Alembert's, with no resultant, no torque and no work.

The nodes of a core are accelerated as the rigid body that they are,

    a = A + alpha x r + omega x (omega x r),

with A and alpha from all the forces on them, the centre of mass and the inertia of their masses.
What each node lacks of that is the force that the others of the core exert on it. So the core has
the resultant and the torque of all that acts on it, whatever that is, and each method moves it.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import store_point
from tissue.core.vec3 import Vec3, add, axpy, cross, store, sub, vec3
from tissue.forces.acceleration import acceleration
from tissue.forces.rigid_motion import rigid_motion
from tissue.forces.step_context import StepContext
from tissue.mesh.rigid_cores import Cores


@kernel
def clear_core_forces(cores: Cores, external: FloatArray) -> None:
    """Set the forces on the nodes of cores to zero."""
    node = cores.pieces.node
    for k in range(len(node)):
        store(external, node[k], Vec3(0.0, 0.0, 0.0))


@kernel
def add_core_reactions(context: StepContext, positions: FloatArray, velocities: FloatArray) -> None:
    """Add the forces that keep cores rigid, after all others at the same positions.

    Args:
        context: Forces are added to its stages, of which `change` is scratch.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
    """
    pieces, body = context.cores.pieces, context.body
    free, external = context.stages.change, context.stages.external
    for core in range(len(pieces.begin) - 1):
        now = rigid_motion(body.masses, positions, pieces, core, velocities)
        members = range(pieces.begin[core], pieces.begin[core + 1])
        for k in members:
            i = pieces.node[k]
            store_point(free, i, acceleration(context, i, positions, velocities))
            arm = sub(vec3(positions, i), now.centre)
            inward = cross(now.angular, cross(now.angular, arm))
            store(free, i, sub(vec3(free, i), inward))
        rigid = rigid_motion(body.masses, positions, pieces, core, free)
        for k in members:
            i = pieces.node[k]
            arm = sub(vec3(positions, i), rigid.centre)
            lacking = sub(add(rigid.linear, cross(rigid.angular, arm)), vec3(free, i))
            store(external, i, axpy(body.masses[i], lacking, vec3(external, i)))
