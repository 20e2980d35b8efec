"""Contacts as constraints on four nodes: geometry, slop, and what is carried over to the next step.

A contact asks that the gap, n . sum(w_i x_i), be not negative. The weights of a node and of the
point under it in a triangle, or of two points on two edges, add up to zero: what is added to one
side is taken from the other, and momentum is kept but for rounding.

An impulse [N s] changes velocities; a position impulse [kg m] changes positions in the same way, by
weight over mass. Both begin with what was needed in the step before, in the directions of this one
(warm start), so that what is pressed and rests needs little more.

Source: Mueller et al. (2007), Position based dynamics, for corrections by weight over mass.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.contact_table import insert_contact
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.hash_table import HashTable, clear_table, new_hash_table
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, axpy, dot, store, vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import Body, grown

LEAST_MOBILITY = 1e-6
"""Share of its mobility that a contact keeps as it slides. With none left, where it comes to lie on
fixed nodes, no impulse would part its sides, and all that it moves would be moved by 0 / 0."""

WARM_START_SHARE = 0.9
"""Share of a position impulse that a contact begins with, where its impulse does not account for
more. Sides that cannot all be parted would take more in each step without end, if they began with
all of it; at 0.5 a body with 2,700 contacts at rest needed 860 corrections a step instead of 510.
"""


class Manifold(NamedTuple):
    """Where the two sides of a contact meet."""

    weights: Weights
    """Weight of each node; they add up to 0, or to 1 where the other side is the floor."""
    normal: Vec3
    """Unit vector, from the side of the negative weights to the other."""


class Contacts(Arrays):
    """The contacts of one Runge-Kutta step."""

    n_contacts: IntCell
    """Number of contacts."""
    clock: IntCell
    """Number of corrections so far that moved something."""
    seconds: FloatCell
    """Length of the Runge-Kutta step [s]."""
    node: IntArray
    """Nodes of each contact, see `pairs.Nodes`; four times the same on the floor. Shape (capacity,
    4)."""
    face: IntArray
    """Places of the faces of both sides in `Faces`, or -1; shape (capacity, 2)."""
    generation: IntArray
    """Sum of the generations of the two faces when they met, as in `Pairs`; shape (capacity,)."""
    weight: FloatArray
    """Weights of each manifold, shape (capacity, 4)."""
    normal: FloatArray
    """Normal of each manifold, shape (capacity, 3)."""
    floor: FloatArray
    """Height of the floor where the other side is the floor, else 0 [m]; shape (capacity,)."""
    mobility: FloatArray
    """Sum of squared weight over mass [1/kg], shape (capacity,)."""
    response: FloatArray
    """Weight over mass of each node, 0 where it is fixed [1/kg]; shape (capacity, 4)."""
    slop: FloatArray
    """Gap down to which the sides may overlap, for they did before; not positive [m]. Shape
    (capacity,)."""
    position_impulse: FloatArray
    """Position impulse along the normal in this step [kg m], shape (capacity,)."""
    position_friction: FloatArray
    """Position impulse across the normal in this step [kg m], shape (capacity, 3)."""
    impulse: FloatArray
    """Impulse along the normal in this step [N s], shape (capacity,)."""
    last_impulse: FloatArray
    """Impulse along the normal in the step before, 0 where there was none [N s]; shape
    (capacity,)."""
    friction: FloatArray
    """Impulse across the normal in this step [N s], shape (capacity, 3)."""
    table: HashTable
    """Contacts by their nodes, see `contact_table`."""
    corrected_at: IntArray
    """When each contact was last corrected, by `clock`; shape (capacity,)."""
    moved_at: IntArray
    """When each node was last moved by a correction, by `clock`; shape (node capacity,)."""
    recovery: float
    """Speed at which an overlap that was there before the step is undone [m/s]."""


def new_contacts(n_nodes: int, capacity: int, recovery: float) -> Contacts:
    """Return no contacts.

    Args:
        n_nodes: Nodes of the body that there is room for.
        capacity: Contacts that there is room for.
        recovery: Speed at which an overlap that was there before a step is undone [m/s].
    """
    return Contacts(
        n_contacts=0,
        clock=0,
        seconds=0.0,
        node=np.zeros((capacity, 4), np.int64),
        face=np.zeros((capacity, 2), np.int64),
        generation=np.zeros(capacity, np.int64),
        weight=np.zeros((capacity, 4)),
        normal=np.zeros((capacity, 3)),
        floor=np.zeros(capacity),
        mobility=np.zeros(capacity),
        response=np.zeros((capacity, 4)),
        slop=np.zeros(capacity),
        position_impulse=np.zeros(capacity),
        position_friction=np.zeros((capacity, 3)),
        impulse=np.zeros(capacity),
        last_impulse=np.zeros(capacity),
        friction=np.zeros((capacity, 3)),
        table=new_hash_table(4 * capacity),
        corrected_at=np.zeros(capacity, np.int64),
        moved_at=np.zeros(n_nodes, np.int64),
        recovery=recovery,
    )


def grown_contacts(contacts: Contacts, n_nodes: int, capacity: int) -> Contacts:
    """Return the contacts, with room for `n_nodes` and `capacity` contacts; the table is empty."""
    others = {"n_contacts", "clock", "seconds", "table", "moved_at", "recovery"}
    names = set(Contacts.__annotations__) - others
    return contacts.replaced(
        **{name: grown(getattr(contacts, name), capacity) for name in names},
        table=new_hash_table(4 * capacity),
        moved_at=grown(contacts.moved_at, n_nodes),
    )


@kernel
def rebuild_table(contacts: Contacts) -> None:
    """Write all contacts to the table. To be called before others are added."""
    clear_table(contacts.table)
    for k in range(contacts.n_contacts):
        insert_contact(contacts.table, contacts.node, k)


@kernel
def set_manifold(contacts: Contacts, body: Body, k: int, manifold: Manifold) -> None:
    """Write where the sides of contact `k` meet, and how they respond to impulses there."""
    contacts.weight[k, 0] = manifold.weights.a
    contacts.weight[k, 1] = manifold.weights.b
    contacts.weight[k, 2] = manifold.weights.c
    contacts.weight[k, 3] = manifold.weights.d
    store(contacts.normal, k, manifold.normal)
    mobility = 0.0
    for q in range(4):
        node = contacts.node[k, q]
        contacts.response[k, q] = 0.0
        if not body.fixed[node]:
            contacts.response[k, q] = contacts.weight[k, q] / body.masses[node]
            mobility += contacts.weight[k, q] * contacts.response[k, q]
    contacts.mobility[k] = mobility


@kernel
def update_manifold(contacts: Contacts, body: Body, k: int, manifold: Manifold) -> None:
    """Move contact `k` to where its sides now meet, unless only fixed nodes would hold it there."""
    weights = Weights(
        contacts.weight[k, 0], contacts.weight[k, 1], contacts.weight[k, 2], contacts.weight[k, 3]
    )
    before = Manifold(weights, vec3(contacts.normal, k))
    least = LEAST_MOBILITY * contacts.mobility[k]
    set_manifold(contacts, body, k, manifold)
    if not contacts.mobility[k] > least:
        set_manifold(contacts, body, k, before)


@kernel
def carry_over(contacts: Contacts, k: int, n: int, ratio: float) -> None:
    """Make contact `k` of the last step contact `n` of this one; `warm_start` applies its impulses.

    Args:
        contacts: Contact `n` is written; it is `k` or before it.
        k: Contact of the last step.
        n: Contact of this step.
        ratio: Length of this step over that of the last one.
    """
    share = 0.0
    if contacts.impulse[k] > 0.0:
        # An impact is over: the impulse that it took in one step is not needed in the next.
        share = ratio * min(contacts.last_impulse[k] / contacts.impulse[k], 1.0)
    impulse = share * contacts.impulse[k]
    most = max(contacts.seconds * impulse, WARM_START_SHARE * contacts.position_impulse[k])
    of_position = min(ratio * ratio * contacts.position_impulse[k], most)
    position_share = 0.0
    if contacts.position_impulse[k] > 0.0:
        position_share = of_position / contacts.position_impulse[k]
    for q in range(4):
        contacts.node[n, q] = contacts.node[k, q]
        contacts.weight[n, q] = contacts.weight[k, q]
    contacts.face[n, 0] = contacts.face[k, 0]
    contacts.face[n, 1] = contacts.face[k, 1]
    contacts.generation[n] = contacts.generation[k]
    for x in range(3):
        contacts.normal[n, x] = contacts.normal[k, x]
        contacts.friction[n, x] = share * contacts.friction[k, x]
        contacts.position_friction[n, x] = position_share * contacts.position_friction[k, x]
    contacts.floor[n] = contacts.floor[k]
    contacts.mobility[n] = contacts.mobility[k]
    contacts.last_impulse[n] = ratio * contacts.impulse[k]
    contacts.impulse[n] = impulse
    contacts.position_impulse[n] = of_position


@kernel
def warm_start(contacts: Contacts, body: Body, k: int) -> None:
    """Apply the impulses that contact `k` begins with, along and across its normal of this step."""
    normal = vec3(contacts.normal, k)
    of_position = axpy(contacts.position_impulse[k], normal, vec3(contacts.position_friction, k))
    apply_impulse(contacts, k, of_position, body.positions)
    impulse = axpy(contacts.impulse[k], normal, vec3(contacts.friction, k))
    apply_impulse(contacts, k, impulse, body.velocities)


@kernel
def apply_impulse(contacts: Contacts, k: int, impulse: Vec3, values: FloatArray) -> None:
    """Apply an impulse to the nodes of contact `k`, each by its weight over mass.

    Args:
        contacts: The contacts.
        k: Number of the contact.
        impulse: Position impulse [kg m], or impulse [N s].
        values: Positions [m], or velocities [m/s]; written. Shape (node capacity, 3).
    """
    for q in range(4):
        response = contacts.response[k, q]
        if response != 0.0:
            node = contacts.node[k, q]
            values[node, 0] += response * impulse.x
            values[node, 1] += response * impulse.y
            values[node, 2] += response * impulse.z


@kernel
def difference(contacts: Contacts, k: int, values: FloatArray) -> Vec3:
    """Return the weighted sum of nodal values at contact `k`: one side less the other."""
    total = Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        total = axpy(contacts.weight[k, q], vec3(values, contacts.node[k, q]), total)
    return total


@kernel
def gap(contacts: Contacts, positions: FloatArray, k: int) -> float:
    """Return the distance of the two sides along the normal [m], negative where they overlap."""
    along = dot(vec3(contacts.normal, k), difference(contacts, k, positions))
    return along - float(contacts.floor[k])


@kernel
def set_slop(contacts: Contacts, k: int, start: FloatArray) -> None:
    """Write the slop of contact `k`: its gap at `start`, before the step [m], less the recovery."""
    undone = contacts.recovery * contacts.seconds
    contacts.slop[k] = min(gap(contacts, start, k) + undone, 0.0)


@kernel
def is_on_floor(contacts: Contacts, k: int) -> bool:
    """Whether contact `k` is one of a node and the floor."""
    return bool(contacts.node[k, 0] == contacts.node[k, 1])
