"""Forces of contact with rigid geoms in the stages of a substep: reactions, as of supports.

A node that touches a geom gets, in each stage, the force that keeps it from being accelerated into
the geom, and along it within Coulomb's cone: what rests is in balance whatever the step is, as if
the node were held. That it touches, and in which direction that pushes, was found after the last
substep (`tissue.contact.geoms.kinematic_contact`). A face has three nodes, which other contacts
hold as well; it keeps the force that it had then.
"""

from tissue.contact.geoms.contact_impulses import push, weighted
from tissue.contact.geoms.geom_arrays import NODE_CONTACT
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import store_point
from tissue.core.vec3 import Vec3, axpy, dot, norm, scale, store, vec3
from tissue.integrators.node_loops import acceleration
from tissue.integrators.step_context import StepContext


@kernel
def add_geom_reactions(
    context: StepContext, positions: FloatArray, velocities: FloatArray, share: float, dt: float
) -> None:
    """Add the forces of contacts with geoms on the nodes, after `deform` at the same positions.

    The contacts are taken one after the other, so that the sums do not depend on threads.

    Args:
        context: Forces are added to its stages; impulses and works to its contacts.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        share: Weight of this evaluation in the integral over the time step; 0: nothing is counted.
        dt: Length of the time step [s].
    """
    contacts = context.geoms
    rows = range(contacts.first, contacts.first + contacts.n_contacts)
    for c in rows:
        if contacts.touches[c] == 1 and contacts.face[c] != NODE_CONTACT:
            _act(context, c, vec3(contacts.force, c), positions, velocities, share * dt, dt)
    # Nodes last: their reactions bear what faces around them press with.
    for c in rows:
        if contacts.touches[c] == 1 and contacts.face[c] == NODE_CONTACT:
            force = _reaction(context, c, positions, velocities)
            _act(context, c, force, positions, velocities, share * dt, dt)


@kernel
def _act(
    context: StepContext,
    c: int,
    force: Vec3,
    positions: FloatArray,
    velocities: FloatArray,
    seconds: float,
    dt: float,
) -> None:
    """Add a force of contact `c` on its nodes, and count what it does in some time [s]."""
    contacts, external = context.geoms, context.stages.external
    for q in range(3):
        node, weight = contacts.node[c, q], contacts.weight[c, q]
        if weight != 0.0:
            store(external, node, axpy(weight, force, vec3(external, node)))
    if seconds > 0.0:
        impulse = scale(seconds, force)
        store(contacts.pressed, c, axpy(1.0, impulse, vec3(contacts.pressed, c)))
        x, v = weighted(contacts, c, positions), weighted(contacts, c, velocities)
        push(contacts, c, impulse, x, v, dt)


@kernel
def _reaction(context: StepContext, c: int, positions: FloatArray, velocities: FloatArray) -> Vec3:
    """Return the force of a geom on the node of contact `c` [N].

    What slides is braked as it was in the last substep; by how much it must be braked more or less
    is known after this one.
    """
    contacts, node, scratch = context.geoms, context.geoms.node[c, 0], context.supports.force
    store_point(scratch, 0, acceleration(context, node, positions, velocities))
    load = scale(context.body.masses[node], vec3(scratch, 0))
    normal, g = vec3(contacts.normal, c), contacts.geom[c]
    along = dot(load, normal)
    if along >= 0.0:
        return Vec3(0.0, 0.0, 0.0)
    if contacts.sticks[c] == 1:
        pull = scale(-1.0, axpy(-along, normal, load))
    else:
        before = vec3(contacts.force, c)
        pull = axpy(-dot(before, normal), normal, before)
    limit, length = contacts.geoms.friction[g] * -along, norm(pull)
    return axpy(-along, normal, scale(min(limit / length, 1.0) if length > 0.0 else 0.0, pull))
