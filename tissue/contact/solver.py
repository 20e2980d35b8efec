"""Solver of contacts: Gauss-Seidel, in a fixed order, after each Runge-Kutta step.

- Positions are corrected, in the metric of the masses, to where no gap is negative; an overlap that
  was there before the step is undone only a little, for that is work that nothing accounts for.
- Then velocities are, by impulses that stop the approach and nothing more (plastic impact). No
  contact ever pulls.

Friction follows the same law in positions and velocities: within Coulomb's cone it holds the points
together, on the cone it slides. A contact is skipped as long as no other moves its nodes.

Within a step of length h, what is pressed by a force f on a mass m sinks in and is put back,
h^2 f / (6 m) deep on average: it rests too low by about so much.

Source: Moreau (1988), Unilateral contact and dry friction in finite freedom dynamics, for the
plastic impact.
"""

from tissue.contact.constraints import (
    Contacts,
    Manifold,
    apply_impulse,
    difference,
    gap,
    set_manifold,
    set_slop,
)
from tissue.contact.contact_table import has_contact, insert_contact
from tissue.contact.pairs import Nodes, nodes_of
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, dot, norm, scale, store, sub, vec3
from tissue.mesh.body import Body

ITERATIONS = 5
"""Gauss-Seidel iterations at most. Two stacked blocks need 10 to 20 when they meet; with a warm
start these are spread over some steps."""

FRICTION_ITERATIONS = 4
"""Iterations of friction: nodes of one face hold it together, so few are needed."""


@kernel
def begin_iterations(contacts: Contacts) -> None:
    """Let every contact be due."""
    for k in range(contacts.n_contacts):
        contacts.corrected_at[k] = -1


@kernel
def have_moved_since(contacts: Contacts, nodes: Nodes, when: int) -> bool:
    """Whether a correction has moved one of the nodes after the time `when`, by `clock`."""
    moved = contacts.moved_at
    a, b, c, d = nodes
    return bool(moved[a] > when or moved[b] > when or moved[c] > when or moved[d] > when)


@kernel
def is_due(contacts: Contacts, k: int) -> bool:
    """Whether a node of contact `k` was moved since the contact was last corrected."""
    return have_moved_since(contacts, nodes_of(contacts.node, k), contacts.corrected_at[k])


@kernel
def note_correction(contacts: Contacts, k: int, has_moved: bool) -> None:
    """Note that contact `k` is corrected, and whether that makes others due."""
    if has_moved:
        contacts.clock += 1
        for q in range(4):
            contacts.moved_at[contacts.node[k, q]] = contacts.clock
    contacts.corrected_at[k] = contacts.clock


@kernel
def add_contact(
    contacts: Contacts,
    body: Body,
    nodes: Nodes,
    manifold: Manifold,
    floor: float,
    start: FloatArray,
) -> bool:
    """Add a contact and correct positions, unless it is there already or nothing in it can move.

    Args:
        contacts: Written, if there is room.
        body: Positions are written.
        nodes: Nodes of the contact.
        manifold: Where its sides meet.
        floor: Height of the floor [m] where the other side is the floor, else 0.
        start: Positions before the step [m], shape (node capacity, 3).

    Returns:
        Whether it was added; it is of no face.
    """
    k = contacts.n_contacts
    if k == len(contacts.slop) or has_contact(contacts.table, contacts.node, nodes):
        return False
    for q in range(4):
        contacts.node[k, q] = nodes[q]
    set_manifold(contacts, body, k, manifold)
    if contacts.mobility[k] == 0.0:
        return False
    insert_contact(contacts.table, contacts.node, k)
    contacts.n_contacts += 1
    contacts.face[k, 0] = -1
    contacts.face[k, 1] = -1
    contacts.floor[k] = floor
    contacts.position_impulse[k] = 0.0
    contacts.impulse[k] = 0.0
    contacts.last_impulse[k] = 0.0
    for x in range(3):
        contacts.position_friction[k, x] = 0.0
        contacts.friction[k, x] = 0.0
    set_slop(contacts, k, start)
    note_correction(contacts, k, _solve_position(contacts, body, k) > 0.0)
    return True


@kernel
def solve_positions(
    contacts: Contacts, body: Body, start: FloatArray, coefficient: float, tolerance: float
) -> None:
    """Move nodes to where no gap is negative, and back by what friction holds.

    Args:
        contacts: Position impulses are written.
        body: Positions are written.
        start: Positions before the step [m], shape (node capacity, 3).
        coefficient: Coefficient of friction.
        tolerance: Largest correction in an iteration at which iterations end [m].
    """
    begin_iterations(contacts)
    for _ in range(ITERATIONS):
        most = 0.0
        for k in range(contacts.n_contacts):
            if is_due(contacts, k):
                move = _solve_position(contacts, body, k)
                note_correction(contacts, k, move > tolerance)
                most = max(most, move)
        if most <= tolerance:
            break
    begin_iterations(contacts)
    for _ in range(FRICTION_ITERATIONS):
        most = 0.0
        for k in range(contacts.n_contacts):
            if contacts.position_impulse[k] > 0.0 and is_due(contacts, k):
                moved = sub(difference(contacts, k, body.positions), difference(contacts, k, start))
                limit = coefficient * contacts.position_impulse[k]
                total = contacts.position_friction
                move = _solve_friction(contacts, k, moved, limit, total, body.positions)
                note_correction(contacts, k, move > tolerance)
                most = max(most, move)
        if most <= tolerance:
            break


@kernel
def solve_velocities(
    contacts: Contacts, body: Body, coefficient: float, seconds: float, tolerance: float
) -> None:
    """Apply impulses that stop the sides' approach, and their sliding as far as friction can.

    Args:
        contacts: Impulses are written.
        body: Velocities are written.
        coefficient: Coefficient of friction.
        seconds: Length of the Runge-Kutta step [s].
        tolerance: Largest change of a gap in a step at which iterations end [m].
    """
    begin_iterations(contacts)
    for _ in range(ITERATIONS):
        most = 0.0
        for k in range(contacts.n_contacts):
            if is_due(contacts, k):
                move = _solve_velocity(contacts, body, k) * seconds
                note_correction(contacts, k, move > tolerance)
                most = max(most, move)
        if most <= tolerance:
            break
    begin_iterations(contacts)
    for _ in range(FRICTION_ITERATIONS):
        most = 0.0
        for k in range(contacts.n_contacts):
            if not is_due(contacts, k):
                continue
            if contacts.impulse[k] > 0.0 or norm(vec3(contacts.friction, k)) > 0.0:
                sliding = difference(contacts, k, body.velocities)
                limit = coefficient * contacts.impulse[k]
                total = contacts.friction
                change = _solve_friction(contacts, k, sliding, limit, total, body.velocities)
                move = change * seconds
                note_correction(contacts, k, move > tolerance)
                most = max(most, move)
        if most <= tolerance:
            break


@kernel
def _solve_position(contacts: Contacts, body: Body, k: int) -> float:
    """Close the gap of contact `k`, or undo what was corrected too much; return the move [m]."""
    before = contacts.position_impulse[k]
    missing = contacts.slop[k] - gap(contacts, body.positions, k)
    now = max(before + missing / contacts.mobility[k], 0.0)
    if now == before:
        return 0.0
    contacts.position_impulse[k] = now
    apply_impulse(contacts, k, scale(now - before, vec3(contacts.normal, k)), body.positions)
    return float(abs(now - before) * contacts.mobility[k])


@kernel
def _solve_velocity(contacts: Contacts, body: Body, k: int) -> float:
    """Stop the approach of contact `k`; return by how much its speed changes [m/s]."""
    normal = vec3(contacts.normal, k)
    speed = dot(normal, difference(contacts, k, body.velocities))
    before = contacts.impulse[k]
    now = max(before - speed / contacts.mobility[k], 0.0)
    if now == before:
        return 0.0
    contacts.impulse[k] = now
    apply_impulse(contacts, k, scale(now - before, normal), body.velocities)
    return float(abs(now - before) * contacts.mobility[k])


@kernel
def _solve_friction(
    contacts: Contacts,
    k: int,
    relative: Vec3,
    limit: float,
    total: FloatArray,
    values: FloatArray,
) -> float:
    """Undo the part of `relative` across the normal as far as friction can; return how much.

    Args:
        contacts: The contacts.
        k: Number of the contact.
        relative: Displacement [m] or velocity [m/s] of one side relative to the other.
        limit: Greatest length of row `k` of `total`.
        total: Position impulses [kg m] or impulses [N s] across the normal; written.
        values: Positions [m] or velocities [m/s]; written.
    """
    normal = vec3(contacts.normal, k)
    across = axpy(-dot(relative, normal), normal, relative)
    before = vec3(total, k)
    now = axpy(-1.0 / contacts.mobility[k], across, before)
    size = norm(now)
    if size > limit:
        now = scale(limit / size, now)
    store(total, k, now)
    change = sub(now, before)
    apply_impulse(contacts, k, change, values)
    return norm(change) * float(contacts.mobility[k])
