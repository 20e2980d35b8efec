"""Contacts as constraints on four nodes, and the impulses that keep them.

A contact asks that the gap, n . sum(w_i x_i), be not negative. The weights of a node and of the
point under it in a triangle, or of two points on two edges, add up to zero: what is added to one
side is taken from the other, and momentum is kept to the last bit but rounding.

After a Runge-Kutta step two corrections follow, each by Gauss-Seidel in a fixed order:

- positions, in the metric of the masses, to where the gap is zero;
- velocities, by impulses that stop the approach and nothing more (plastic impact): the kinetic
  energy cannot grow.

Friction follows the same law in both: within Coulomb's cone it holds the points together, on the
cone it slides. Correcting velocities alone a body would creep down a slope by half of what gravity
adds in a step; correcting positions alone it would bounce.

Sources: Moreau (1988), Unilateral contact and dry friction in finite freedom dynamics, for the
plastic impact; Mueller et al. (2007), Position based dynamics, for corrections by weight over mass.
"""

import numpy as np

from tissue.arrays import Arrays
from tissue.body import Body
from tissue.jit import kernel
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3, axpy, dot, norm, scale, sub, vec3

SWEEPS = 10
"""Gauss-Seidel sweeps at most. Two stacked blocks need 10 to 20; what is left is pushed out in the
steps that follow."""

FRICTION_SWEEPS = 4
"""Sweeps of friction: nodes of one face hold it together, so few are needed."""


class Contacts(Arrays):
    """The contacts of one Runge-Kutta step."""

    node: IntArray
    """Shape (capacity, 4)."""
    weight: FloatArray
    """Shape (capacity, 4); they add up to 0, or to 1 where the other side is the floor."""
    normal: FloatArray
    """Unit vector, from the side of the negative weights to the other; shape (capacity, 3)."""
    floor: FloatArray
    """Height of the floor where the other side is the floor, else 0 [m]; shape (capacity,)."""
    mobility: FloatArray
    """Sum of squared weight over mass [1/kg], shape (capacity,)."""
    shift: FloatArray
    """Correction of positions along the normal [kg m], shape (capacity,)."""
    drag: FloatArray
    """Correction of positions across it [kg m], shape (capacity, 3)."""
    impulse: FloatArray
    """Along the normal [N s], shape (capacity,)."""
    friction: FloatArray
    """Across it [N s], shape (capacity, 3)."""
    count: IntArray
    """Shape (1,)."""


def new_contacts(capacity: int) -> Contacts:
    """Return no contacts, with room for that many."""
    return Contacts(
        node=np.zeros((capacity, 4), np.int64),
        weight=np.zeros((capacity, 4)),
        normal=np.zeros((capacity, 3)),
        floor=np.zeros(capacity),
        mobility=np.zeros(capacity),
        shift=np.zeros(capacity),
        drag=np.zeros((capacity, 3)),
        impulse=np.zeros(capacity),
        friction=np.zeros((capacity, 3)),
        count=np.zeros(1, np.int64),
    )


@kernel
def add_contact(
    contacts: Contacts,
    body: Body,
    nodes: tuple[int, int, int, int],
    weights: tuple[float, float, float, float],
    normal: Vec3,
    floor: float,
) -> None:
    """Add a contact, unless none of its nodes can move."""
    mobility = 0.0
    for q in range(4):
        if not body.fixed[nodes[q]]:
            mobility += weights[q] * weights[q] / body.masses[nodes[q]]
    if mobility == 0.0:
        return
    k = contacts.count[0]
    contacts.count[0] += 1
    for q in range(4):
        contacts.node[k, q] = nodes[q]
        contacts.weight[k, q] = weights[q]
    contacts.normal[k, 0] = normal.x
    contacts.normal[k, 1] = normal.y
    contacts.normal[k, 2] = normal.z
    contacts.floor[k] = floor
    contacts.mobility[k] = mobility
    contacts.shift[k] = 0.0
    contacts.impulse[k] = 0.0
    for x in range(3):
        contacts.drag[k, x] = 0.0
        contacts.friction[k, x] = 0.0


@kernel
def difference(contacts: Contacts, k: int, values: FloatArray) -> Vec3:
    """Weighted sum of nodal values at contact `k`: one side less the other."""
    total = Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        total = axpy(contacts.weight[k, q], vec3(values, contacts.node[k, q]), total)
    return total


@kernel
def gap(contacts: Contacts, body: Body, k: int) -> float:
    """Distance of the two sides along the normal [m], negative where they overlap."""
    return (
        dot(vec3(contacts.normal, k), difference(contacts, k, body.positions)) - contacts.floor[k]
    )


@kernel
def _apply(contacts: Contacts, body: Body, k: int, correction: Vec3, values: FloatArray) -> None:
    """Add a correction [kg m] or [kg m/s] to the nodes of contact `k`, each by its weight."""
    for q in range(4):
        node = contacts.node[k, q]
        if not body.fixed[node]:
            share = contacts.weight[k, q] / body.masses[node]
            values[node, 0] += share * correction.x
            values[node, 1] += share * correction.y
            values[node, 2] += share * correction.z


@kernel
def _push(contacts: Contacts, body: Body, k: int) -> float:
    """Close the gap of contact `k`, or what of its correction is too much; return the move [m]."""
    before = contacts.shift[k]
    now = max(before - gap(contacts, body, k) / contacts.mobility[k], 0.0)
    if now == before:
        return 0.0
    contacts.shift[k] = now
    normal = vec3(contacts.normal, k)
    _apply(contacts, body, k, scale(now - before, normal), body.positions)
    return abs(now - before) * contacts.mobility[k]


@kernel
def push_last(contacts: Contacts, body: Body) -> None:
    """Push apart the contact that was added last."""
    if contacts.count[0] > 0:
        _push(contacts, body, contacts.count[0] - 1)


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
    for _ in range(SWEEPS):
        most = 0.0
        for k in range(contacts.count[0]):
            most = max(most, _push(contacts, body, k))
        if most <= small:
            break
    for _ in range(FRICTION_SWEEPS):
        for k in range(contacts.count[0]):
            if contacts.shift[k] > 0.0:
                moved = sub(difference(contacts, k, body.positions), difference(contacts, k, start))
                limit = coefficient * contacts.shift[k]
                _hold(contacts, body, k, moved, limit, contacts.drag, body.positions)


@kernel
def stop_approach(contacts: Contacts, body: Body, coefficient: float, small: float) -> None:
    """Give impulses that stop the sides' approach, and their sliding as far as friction can.

    Args:
        contacts: `impulse` and `friction` are written.
        body: Velocities are written.
        coefficient: Of friction.
        small: Change of velocity at which the sweeps end [m/s].
    """
    for _ in range(SWEEPS):
        most = 0.0
        for k in range(contacts.count[0]):
            normal = vec3(contacts.normal, k)
            speed = dot(normal, difference(contacts, k, body.velocities))
            before = contacts.impulse[k]
            now = max(before - speed / contacts.mobility[k], 0.0)
            contacts.impulse[k] = now
            if now != before:
                _apply(contacts, body, k, scale(now - before, normal), body.velocities)
                most = max(most, abs(now - before) * contacts.mobility[k])
        if most <= small:
            break
    for _ in range(FRICTION_SWEEPS):
        for k in range(contacts.count[0]):
            if contacts.impulse[k] > 0.0:
                sliding = difference(contacts, k, body.velocities)
                limit = coefficient * contacts.impulse[k]
                _hold(contacts, body, k, sliding, limit, contacts.friction, body.velocities)


@kernel
def _hold(
    contacts: Contacts,
    body: Body,
    k: int,
    relative: Vec3,
    limit: float,
    held: FloatArray,
    values: FloatArray,
) -> None:
    """Take away the part of `relative` across the normal, by at most `limit` in all."""
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
    _apply(contacts, body, k, sub(now, before), values)
