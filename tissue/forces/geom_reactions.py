"""Forces of contact with rigid geoms in the stages of a substep: reactions, as of supports.

Where tissue touches a geom, each stage has the force that keeps it from being accelerated into the
geom, and along it within Coulomb's cone: what rests is in balance whatever the step is, as if it
were held. That it touches, and in which direction that pushes, was found after the last substep
(`tissue.contact.geoms.kinematic_contact`). Contacts that share nodes are solved together, by Gauss
and Seidel's method on accelerations. If faces kept the force of the last substep, they would sink
in, and putting them out again would add energy: up to four fifths of the work of a closing jaw.

Source: Baraff (1994), Fast contact force computation for nonpenetrating rigid bodies, for contact
in terms of accelerations.
"""

from tissue.contact.geoms.geom_arrays import GeomContacts, n_corners
from tissue.contact.geoms.kinematic_contact import (
    SWEEPS,
    add_to_nodes,
    note_mobility,
    push,
    weighted,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import store_point
from tissue.core.vec3 import Vec3, add, axpy, dot, norm, scale, store, sub, vec3
from tissue.forces.acceleration import acceleration
from tissue.forces.step_context import StepContext


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
    _note_accelerations(context, positions, velocities)
    for _ in range(SWEEPS if contacts.are_coupled == 1 else 1):
        for c in rows:
            if contacts.touches[c] == 1:
                _correct_reaction(contacts, c)
    for c in rows:
        if contacts.touches[c] == 1:
            _act(context, c, vec3(contacts.reaction, c), positions, velocities, share * dt, dt)


@kernel
def _note_accelerations(
    context: StepContext, positions: FloatArray, velocities: FloatArray
) -> None:
    """Note how the nodes that touch accelerate, with contact as it was in the last substep."""
    contacts, body, accelerations = context.geoms, context.body, context.geoms.acceleration
    rows = range(contacts.first, contacts.first + contacts.n_contacts)
    for c in rows:
        for q in range(n_corners(contacts, c)):
            contacts.is_noted[contacts.node[c, q]] = 0
    for c in rows:
        if contacts.touches[c] == 0:
            continue
        for q in range(n_corners(contacts, c)):
            node = contacts.node[c, q]
            if contacts.is_noted[node] == 0:
                contacts.is_noted[node] = 1
                store_point(accelerations, node, acceleration(context, node, positions, velocities))
    for c in rows:
        if contacts.touches[c] == 1:
            note_mobility(contacts, body, c)  # nodes may have got mass since the last substep
            store(contacts.reaction, c, Vec3(0.0, 0.0, 0.0))
            _change_reaction(contacts, c, vec3(contacts.force, c))


@kernel
def _change_reaction(contacts: GeomContacts, c: int, change: Vec3) -> None:
    """Add to the reaction of contact `c` [N], and to the accelerations of its nodes."""
    store(contacts.reaction, c, add(vec3(contacts.reaction, c), change))
    add_to_nodes(contacts, c, change, contacts.acceleration)


@kernel
def _correct_reaction(contacts: GeomContacts, c: int) -> None:
    """Change the reaction of contact `c` so that its point does not accelerate into the geom.

    What sticks does not accelerate along it either. What slides is braked as it was in the last
    substep; by how much it must be braked more or less is known after this one.
    """
    mobility = contacts.mobility[c]
    if mobility == 0.0:
        return
    normal, before = vec3(contacts.normal, c), vec3(contacts.reaction, c)
    now = axpy(-1.0 / mobility, weighted(contacts, c, contacts.acceleration), before)
    press = max(dot(now, normal), 0.0)
    if contacts.sticks[c] == 0:
        now = vec3(contacts.force, c)
    pull = axpy(-dot(now, normal), normal, now)
    limit, length = contacts.friction[c] * press, norm(pull)
    share = min(limit / length, 1.0) if length > 0.0 else 0.0
    _change_reaction(contacts, c, sub(axpy(press, normal, scale(share, pull)), before))


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
    for q in range(n_corners(contacts, c)):
        node, weight = contacts.node[c, q], contacts.weight[c, q]
        if weight != 0.0:
            store(external, node, axpy(weight, force, vec3(external, node)))
    if seconds > 0.0:
        impulse = scale(seconds, force)
        store(contacts.pressed, c, axpy(1.0, impulse, vec3(contacts.pressed, c)))
        x, v = weighted(contacts, c, positions), weighted(contacts, c, velocities)
        push(contacts, c, impulse, x, v, dt)
