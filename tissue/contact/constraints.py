"""Contacts as constraints on four nodes, and the impulses that keep them.

A contact asks that the gap, n . sum(w_i x_i), be not negative. The weights of a node and of the
point under it in a triangle, or of two points on two edges, add up to zero: what is added to one
side is taken from the other, and momentum is kept to the last bit but rounding.

Contacts act after a Runge-Kutta step, in which nothing held the sides apart:

- positions are corrected, in the metric of the masses, to where no gap is negative; of what sides
  overlapped before the step only a little, for it would be work that nobody paid for;
- then velocities, by impulses that stop the approach and nothing more (plastic impact). No contact
  ever pulls.

Both begin with what was needed in the step before, in the directions of this one, so that what is
pressed and rests needs little more. Within a step of length h, what is pressed by a force f on a
mass m sinks in and is put back, h^2 f / (6 m) deep on average: it rests too low by about so much.
That was measured against three ways to hold it there, by an impulse in the direction of the step
before (half of it at both ends of the step; lent for the step and taken back; positions put higher
by as much). All feed small nodes of triangles, whose normals turn with them: corners of lips
fluttered at 0.1 to 1 m/s without end. This way takes energy from them.

Friction follows the same law in positions and velocities: within Coulomb's cone it holds the points
together, on the cone it slides. All of it by Gauss-Seidel, in a fixed order; a contact is passed
over as long as no other moves its nodes.

Sources: Moreau (1988), Unilateral contact and dry friction in finite freedom dynamics, for the
plastic impact; Mueller et al. (2007), Position based dynamics, for corrections by weight over mass.
"""

import numpy as np

from tissue.contact.contact_table import (
    KnownContacts,
    forget_known,
    is_known,
    know,
    new_known_contacts,
)
from tissue.contact.pairs import Nodes, nodes_of
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, axpy, dot, norm, scale, store, sub, vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import Body, grown

LEAST_MOBILITY = 1e-6
"""Share of its mobility that a contact keeps as it slides. With none left, where it comes to lie on
fixed nodes, no impulse would part its sides, and all that it moves would be moved by 0 / 0."""

SWEEPS = 5
"""Gauss-Seidel sweeps at most. Two stacked blocks need 10 to 20 when they meet; as each step begins
with what the last one found, these are spread over some steps."""

KEPT = 0.9
"""Share of a shift that a contact begins with, where its impulse does not account for more. Sides
that cannot all be parted would take more in each step without end, if they began with all of it; at
0.5 a body with 2,700 contacts at rest needed 860 corrections a step in place of 510."""

FRICTION_SWEEPS = 4
"""Sweeps of friction: nodes of one face hold it together, so few are needed."""


class Contacts(Arrays):
    """The contacts of one Runge-Kutta step."""

    node: IntArray
    """Shape (capacity, 4)."""
    face: IntArray
    """Places of the faces of both sides, in `Faces`, or -1; shape (capacity, 2)."""
    generation: IntArray
    """Sum of the generations of the two when they met, as in `Pairs`; shape (capacity,)."""
    weight: FloatArray
    """Shape (capacity, 4); they add up to 0, or to 1 where the other side is the floor."""
    normal: FloatArray
    """Unit vector, from the side of the negative weights to the other; shape (capacity, 3)."""
    floor: FloatArray
    """Height of the floor where the other side is the floor, else 0 [m]; shape (capacity,)."""
    mobility: FloatArray
    """Sum of squared weight over mass [1/kg], shape (capacity,)."""
    share: FloatArray
    """Weight over mass of each node, 0 where it is fixed [1/kg]; shape (capacity, 4)."""
    bearable: FloatArray
    """Gap that is left for the steps to come, for it was there before; not positive [m]. Shape
    (capacity,)."""
    shift: FloatArray
    """Correction of positions along the normal, in this step [kg m]; shape (capacity,)."""
    drag: FloatArray
    """Correction of positions across it [kg m], shape (capacity, 3)."""
    impulse: FloatArray
    """Along the normal, in this step [N s], shape (capacity,)."""
    last_impulse: FloatArray
    """In the step before, 0 where there was none [N s]; shape (capacity,)."""
    friction: FloatArray
    """Across it [N s], shape (capacity, 3)."""
    known: KnownContacts
    done: IntArray
    """When each was last corrected, by `clock`; shape (capacity,)."""
    moved: IntArray
    """When each node was last moved by a correction, by `clock`; shape (node capacity,)."""
    clock: IntArray
    """Corrections that moved something so far, shape (1,)."""
    count: IntArray
    """Shape (1,)."""
    seconds: FloatArray
    """Length of the Runge-Kutta step [s], shape (1,)."""
    recovery: float
    """Speed at which an overlap that was there before is undone [m/s]."""


def new_contacts(n_nodes: int, capacity: int, recovery: float) -> Contacts:
    """Return no contacts, with room for that many; see `Contacts` for `recovery` [m/s]."""
    return Contacts(
        node=np.zeros((capacity, 4), np.int64),
        face=np.zeros((capacity, 2), np.int64),
        generation=np.zeros(capacity, np.int64),
        weight=np.zeros((capacity, 4)),
        normal=np.zeros((capacity, 3)),
        floor=np.zeros(capacity),
        mobility=np.zeros(capacity),
        share=np.zeros((capacity, 4)),
        bearable=np.zeros(capacity),
        shift=np.zeros(capacity),
        drag=np.zeros((capacity, 3)),
        impulse=np.zeros(capacity),
        last_impulse=np.zeros(capacity),
        friction=np.zeros((capacity, 3)),
        known=new_known_contacts(capacity),
        done=np.zeros(capacity, np.int64),
        moved=np.zeros(n_nodes, np.int64),
        clock=np.zeros(1, np.int64),
        count=np.zeros(1, np.int64),
        seconds=np.zeros(1),
        recovery=recovery,
    )


def grown_contacts(contacts: Contacts, n_nodes: int, capacity: int) -> Contacts:
    """Return the contacts with room for that many."""
    names = set(Contacts.__annotations__) - {
        "known",
        "moved",
        "clock",
        "count",
        "seconds",
        "recovery",
    }
    return contacts.replaced(
        **{name: grown(getattr(contacts, name), capacity) for name in names},
        known=new_known_contacts(capacity),
        moved=grown(contacts.moved, n_nodes),
    )


@kernel
def know_contacts(contacts: Contacts) -> None:
    """Let those that there are be found by their nodes. To be called before others are added."""
    forget_known(contacts.known)
    for k in range(contacts.count[0]):
        know(contacts.known, contacts.node, k)


@kernel
def keep(contacts: Contacts, k: int, n: int, longer: float) -> None:
    """Let contact `k` of the last step be contact `n` of this one, which is `longer` times as long.

    `begin_with_last` gives what it took.
    """
    share = 0.0
    if contacts.impulse[k] > 0.0:
        # An impact is over: what it took in one step is not needed in the next.
        share = longer * min(contacts.last_impulse[k] / contacts.impulse[k], 1.0)
    impulse = share * contacts.impulse[k]
    most = max(contacts.seconds[0] * impulse, KEPT * contacts.shift[k])
    shift = min(longer * longer * contacts.shift[k], most)
    of_shift = shift / contacts.shift[k] if contacts.shift[k] > 0.0 else 0.0
    for q in range(4):
        contacts.node[n, q] = contacts.node[k, q]
        contacts.weight[n, q] = contacts.weight[k, q]
    contacts.face[n, 0] = contacts.face[k, 0]
    contacts.face[n, 1] = contacts.face[k, 1]
    contacts.generation[n] = contacts.generation[k]
    for x in range(3):
        contacts.normal[n, x] = contacts.normal[k, x]
        contacts.friction[n, x] = share * contacts.friction[k, x]
        contacts.drag[n, x] = of_shift * contacts.drag[k, x]
    contacts.floor[n] = contacts.floor[k]
    contacts.mobility[n] = contacts.mobility[k]
    contacts.last_impulse[n] = longer * contacts.impulse[k]
    contacts.impulse[n] = impulse
    contacts.shift[n] = shift


@kernel
def begin_with_last(contacts: Contacts, body: Body, k: int) -> None:
    """Give what contact `k` took in the last step, where it is now."""
    normal = vec3(contacts.normal, k)
    shift = axpy(contacts.shift[k], normal, vec3(contacts.drag, k))
    _apply(contacts, k, shift, body.positions)
    impulse = axpy(contacts.impulse[k], normal, vec3(contacts.friction, k))
    _apply(contacts, k, impulse, body.velocities)


@kernel
def turn(contacts: Contacts, body: Body, k: int, weights: Weights, normal: Vec3) -> None:
    """Let contact `k` be where its sides now meet."""
    contacts.weight[k, 0] = weights.a
    contacts.weight[k, 1] = weights.b
    contacts.weight[k, 2] = weights.c
    contacts.weight[k, 3] = weights.d
    store(contacts.normal, k, normal)
    mobility = 0.0
    for q in range(4):
        node = contacts.node[k, q]
        contacts.share[k, q] = 0.0
        if not body.fixed[node]:
            contacts.share[k, q] = contacts.weight[k, q] / body.masses[node]
            mobility += contacts.weight[k, q] * contacts.share[k, q]
    contacts.mobility[k] = mobility


@kernel
def follow(contacts: Contacts, body: Body, k: int, weights: Weights, normal: Vec3) -> None:
    """Let contact `k` be where its sides now meet, unless only fixed nodes would bear it there."""
    before = Weights(
        contacts.weight[k, 0], contacts.weight[k, 1], contacts.weight[k, 2], contacts.weight[k, 3]
    )
    normal_before = vec3(contacts.normal, k)
    least = LEAST_MOBILITY * contacts.mobility[k]
    turn(contacts, body, k, weights, normal)
    if not contacts.mobility[k] > least:
        turn(contacts, body, k, before, normal_before)


@kernel
def add_contact(
    contacts: Contacts,
    body: Body,
    nodes: Nodes,
    weights: Weights,
    normal: Vec3,
    floor: float,
    start: FloatArray,
) -> bool:
    """Add a contact and push it apart, unless it is there already or nothing in it can move.

    `start` is where the nodes were before the step [m]. It is of no face, if none is said. Return
    whether it was added.
    """
    k = contacts.count[0]
    if k == len(contacts.shift) or is_known(contacts.known, contacts.node, nodes):
        return False
    for q in range(4):
        contacts.node[k, q] = nodes[q]
    turn(contacts, body, k, weights, normal)
    if contacts.mobility[k] == 0.0:
        return False
    know(contacts.known, contacts.node, k)
    contacts.count[0] += 1
    contacts.face[k, 0] = -1
    contacts.face[k, 1] = -1
    contacts.floor[k] = floor
    contacts.shift[k] = 0.0
    contacts.impulse[k] = 0.0
    contacts.last_impulse[k] = 0.0
    for x in range(3):
        contacts.drag[k, x] = 0.0
        contacts.friction[k, x] = 0.0
    bear(contacts, k, start)
    note_move(contacts, k, _push(contacts, body, k) > 0.0)
    return True


@kernel
def difference(contacts: Contacts, k: int, values: FloatArray) -> Vec3:
    """Weighted sum of nodal values at contact `k`: one side less the other."""
    total = Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        total = axpy(contacts.weight[k, q], vec3(values, contacts.node[k, q]), total)
    return total


@kernel
def gap(contacts: Contacts, positions: FloatArray, k: int) -> float:
    """Distance of the two sides along the normal [m], negative where they overlap."""
    return dot(vec3(contacts.normal, k), difference(contacts, k, positions)) - contacts.floor[k]


@kernel
def bear(contacts: Contacts, k: int, start: FloatArray) -> None:
    """Note how much of a gap contact `k` may leave, from where its nodes were before the step."""
    undone = contacts.recovery * contacts.seconds[0]
    contacts.bearable[k] = min(gap(contacts, start, k) + undone, 0.0)


@kernel
def _apply(contacts: Contacts, k: int, correction: Vec3, values: FloatArray) -> None:
    """Add a correction [kg m] or [kg m/s] to the nodes of contact `k`, each by its weight."""
    for q in range(4):
        share = contacts.share[k, q]
        if share != 0.0:
            node = contacts.node[k, q]
            values[node, 0] += share * correction.x
            values[node, 1] += share * correction.y
            values[node, 2] += share * correction.z


@kernel
def _push(contacts: Contacts, body: Body, k: int) -> float:
    """Close the gap of contact `k`, or what of its correction is too much; return the move [m]."""
    before = contacts.shift[k]
    too_little = contacts.bearable[k] - gap(contacts, body.positions, k)
    now = max(before + too_little / contacts.mobility[k], 0.0)
    if now == before:
        return 0.0
    contacts.shift[k] = now
    normal = vec3(contacts.normal, k)
    _apply(contacts, k, scale(now - before, normal), body.positions)
    return abs(now - before) * contacts.mobility[k]


@kernel
def have_moved_since(contacts: Contacts, nodes: Nodes, when: int) -> bool:
    """Whether a correction has moved one of the nodes after that time, by `clock`."""
    moved = contacts.moved
    a, b, c, d = nodes
    return moved[a] > when or moved[b] > when or moved[c] > when or moved[d] > when


@kernel
def begin_sweeps(contacts: Contacts) -> None:
    """Let every contact be due."""
    for k in range(contacts.count[0]):
        contacts.done[k] = -1


@kernel
def is_due(contacts: Contacts, k: int) -> bool:
    """Whether a node of contact `k` was moved since it was last corrected."""
    return have_moved_since(contacts, nodes_of(contacts.node, k), contacts.done[k])


@kernel
def note_move(contacts: Contacts, k: int, has_moved: bool) -> None:
    """Note that contact `k` is corrected, and whether that is for others to look at."""
    if has_moved:
        contacts.clock[0] += 1
        for q in range(4):
            contacts.moved[contacts.node[k, q]] = contacts.clock[0]
    contacts.done[k] = contacts.clock[0]


@kernel
def push_apart(
    contacts: Contacts, body: Body, start: FloatArray, coefficient: float, small: float
) -> None:
    """Move nodes to where no gap is negative, and back by what friction holds.

    Args:
        contacts: `shift` and `drag` are written.
        body: Positions are written.
        start: Positions before the step [m].
        coefficient: Of friction.
        small: Move at which the sweeps end [m].
    """
    begin_sweeps(contacts)
    for _ in range(SWEEPS):
        most = 0.0
        for k in range(contacts.count[0]):
            if is_due(contacts, k):
                move = _push(contacts, body, k)
                note_move(contacts, k, move > small)
                most = max(most, move)
        if most <= small:
            break
    begin_sweeps(contacts)
    for _ in range(FRICTION_SWEEPS):
        most = 0.0
        for k in range(contacts.count[0]):
            if contacts.shift[k] > 0.0 and is_due(contacts, k):
                moved = sub(difference(contacts, k, body.positions), difference(contacts, k, start))
                limit = coefficient * contacts.shift[k]
                move = _hold(contacts, k, moved, limit, contacts.drag, body.positions)
                note_move(contacts, k, move > small)
                most = max(most, move)
        if most <= small:
            break


@kernel
def stop_approach(
    contacts: Contacts, body: Body, coefficient: float, seconds: float, small: float
) -> None:
    """Give impulses that stop the sides' approach, and their sliding as far as friction can.

    Args:
        contacts: `impulse` and `friction` are written.
        body: Velocities are written.
        coefficient: Of friction.
        seconds: Length of the Runge-Kutta step [s].
        small: Change of the gap, in a step, at which the sweeps end [m].
    """
    begin_sweeps(contacts)
    for _ in range(SWEEPS):
        most = 0.0
        for k in range(contacts.count[0]):
            if not is_due(contacts, k):
                continue
            normal = vec3(contacts.normal, k)
            speed = dot(normal, difference(contacts, k, body.velocities))
            before = contacts.impulse[k]
            now = max(before - speed / contacts.mobility[k], 0.0)
            contacts.impulse[k] = now
            move = abs(now - before) * contacts.mobility[k] * seconds
            if now != before:
                _apply(contacts, k, scale(now - before, normal), body.velocities)
                most = max(most, move)
            note_move(contacts, k, move > small)
        if most <= small:
            break
    begin_sweeps(contacts)
    for _ in range(FRICTION_SWEEPS):
        most = 0.0
        for k in range(contacts.count[0]):
            if not is_due(contacts, k):
                continue
            if contacts.impulse[k] > 0.0 or norm(vec3(contacts.friction, k)) > 0.0:
                sliding = difference(contacts, k, body.velocities)
                limit = coefficient * contacts.impulse[k]
                change = _hold(contacts, k, sliding, limit, contacts.friction, body.velocities)
                move = change * seconds
                note_move(contacts, k, move > small)
                most = max(most, move)
        if most <= small:
            break


@kernel
def _hold(
    contacts: Contacts,
    k: int,
    relative: Vec3,
    limit: float,
    held: FloatArray,
    values: FloatArray,
) -> float:
    """Take away the part of `relative` across the normal, by at most `limit` in all; return it."""
    normal = vec3(contacts.normal, k)
    across = axpy(-dot(relative, normal), normal, relative)
    before = vec3(held, k)
    now = axpy(-1.0 / contacts.mobility[k], across, before)
    size = norm(now)
    if size > limit:
        now = scale(limit / size, now)
    held[k, 0] = now.x
    held[k, 1] = now.y
    held[k, 2] = now.z
    change = sub(now, before)
    _apply(contacts, k, change, values)
    return norm(change) * contacts.mobility[k]
