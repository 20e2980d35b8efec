"""`PenaltyForces`: contacts as springs that push apart and rub, evaluated with all other forces.

A contact lies between a node and a point of a face, between points of two edges, or between a node
and the floor. With the weights w of its nodes, its gap is g = n . sum(w_i x_i), and

    d = min(offset - g, largest depth)                  depth of the spring
    f = k max(d - tau n . v, 0)                         pressure, where d > 0; v = sum(w_i v_i)
    t = k (s + tau v_t), no longer than mu k d          friction, against the stretch s and sliding

The weights of two sides add up to zero, so what one side gets the other gives; the force acts with
weights that put it and its reaction on one line and where there is none,
forces on its four nodes take the torque (`torque_balance`). Friction is a spring
that begins at an anchor; where it pulls with more than Coulomb's limit, the anchor follows at the
end of the substep, so that within a substep forces depend on positions and velocities alone.

Source: Cundall and Strack (1979), A discrete numerical model for granular assemblies, for the
springs with friction.
"""

import numpy as np

from tissue.contact.response.torque_balance import TorqueBalance, new_torque_balance
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, filled
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, axpy, dot, scale, store, sub, vec3
from tissue.mesh.body import Body

_HANDED_ON = -1.0
"""Value of `PenaltyForces.push` where a contact of the next list continues with the force."""

SAME_DIRECTION = 0.7
"""Cosine between normals above which contacts are one: 45 degrees. Larger: a node on a curved lip
has several that share its stiffness; smaller: it is not held in a corner."""


class PenaltyForces(Arrays):
    """Two lists of contacts: that in use, and room for the next; both of `capacity` rows.

    The capacity is a multiple of eight: so many contacts are evaluated at a time. The rows of one
    list are one after the other, so arrays have 2 * capacity rows.
    """

    first: IntCell
    """First row of the list in use: 0, or the capacity."""
    n_contacts: IntCell
    """Number of contacts in the list in use."""
    n_fading: IntCell
    """Number of contacts at the end of that list that were given up while they pressed: their
    forces fade."""
    n_pressing: IntCell
    """Number of contacts that pressed at the end of the last substep."""
    n_nodes: IntCell
    """Number of nodes in contact."""
    has_acted: IntCell
    """1 if forces of contact are among those on the nodes, else 0."""
    work: FloatCell
    """Work of all contact forces on the body so far [J]; mostly negative."""
    stored: FloatCell
    """Energy of the springs at the end of the last substep [J]."""
    pressure_impulse: FloatCell
    """Sum of the impulses that pressed sides together since totals were cleared [N s]."""
    penetration: FloatCell
    """Greatest depth of a contact that pressed since totals were cleared [m]."""
    floor_impulse: FloatArray
    """Impulse of the floor on the body since totals were cleared [N s], shape (3,)."""
    touching: IntArray
    """Nodes in contact, each once; shape (4 * capacity,)."""
    node: IntArray
    """Nodes: one and the corners of a face, or the ends of two edges; four times the same on the
    floor. Shape (2 * capacity, 4)."""
    weight: FloatArray
    """Weight of each node; they add up to 0, or to 1 on the floor. Shape (2 * capacity, 4)."""
    normal: FloatArray
    """Unit vector towards the side of the positive weights, shape (2 * capacity, 3)."""
    height: FloatArray
    """Height of the floor where that is the other side, else 0 [m]; shape (2 * capacity,)."""
    stiffness: FloatArray
    """Stiffness k [N/m], shape (2 * capacity,)."""
    offset: FloatArray
    """Gap below which the spring pushes [m], shape (2 * capacity,)."""
    largest_depth: FloatArray
    """Depth above which the force grows no more [m], shape (2 * capacity,)."""
    damping_time: FloatArray
    """Damping per stiffness tau [s], shape (2 * capacity,)."""
    push: FloatArray
    """Elastic part of the pressure at the end of the last substep [N], or _HANDED_ON; shape
    (2 * capacity,)."""
    anchor: FloatArray
    """Where the spring of friction is slack: sum(w_i x_i) without its part along the normal [m],
    shape (2 * capacity, 3)."""
    spread: FloatArray
    """Weights that the force of each contact last acted with: those that put it and its reaction on
    one line (`torque_balance`); shape (2 * capacity, 4)."""
    impulse: FloatArray
    """Impulse of each contact since the last substep ended [N s], shape (2 * capacity, 3)."""
    velocity: FloatArray
    """sum(w_i v_i) as a contact began to push in this substep [m/s], with the weights `spread`;
    shape (2 * capacity, 3)."""
    listed_velocity: FloatArray
    """sum(w_i v_i) at the same instant [m/s], with the weights of the list; shape
    (2 * capacity, 3)."""
    balance: TorqueBalance
    """Torque balances of contacts whose force and reaction are on no line."""
    balance_work: FloatArray
    """Scratch: work of the torque balances of eight contacts [J]; shape (8,)."""
    acting: FloatArray
    """Scratch: the forces of eight contacts, and their pressures [N]; shape (8, 4)."""
    place: FloatArray
    """The numbers from 0 to 7."""
    friction: FloatArray
    """Coefficient of friction of each contact, shape (2 * capacity,)."""
    retardation_time: float
    """Longest damping per stiffness [s]."""


def new_penalty_forces(capacity: int, friction: float, retardation_time: float) -> PenaltyForces:
    """Return no contacts, with room for that many."""
    rows = 2 * filled(capacity)
    of_floats = ("height", "stiffness", "offset", "largest_depth", "push")
    of_vectors = ("anchor", "impulse", "velocity", "listed_velocity")
    return PenaltyForces(
        first=0,
        n_contacts=0,
        n_fading=0,
        n_pressing=0,
        n_nodes=0,
        has_acted=0,
        work=0.0,
        stored=0.0,
        pressure_impulse=0.0,
        penetration=0.0,
        floor_impulse=np.zeros(3),
        touching=np.zeros(2 * rows, np.int64),
        node=np.zeros((rows, 4), np.int64),
        weight=np.zeros((rows, 4)),
        spread=np.zeros((rows, 4)),
        normal=np.zeros((rows, 3)),
        **{name: np.zeros(rows) for name in of_floats},
        **{name: np.zeros((rows, 3)) for name in of_vectors},
        damping_time=np.full(rows, float(retardation_time)),
        balance=new_torque_balance(rows),
        balance_work=np.zeros(WIDTH),
        acting=np.zeros((WIDTH, 4)),
        place=np.arange(float(WIDTH)),
        friction=np.full(rows, float(friction)),
        retardation_time=float(retardation_time),
    )


def grown_penalty_forces(forces: PenaltyForces, capacity: int) -> PenaltyForces:
    """Return the contacts with room for that many; the first list is the one in use."""
    n, used = forces.n_contacts, slice(forces.first, forces.first + forces.n_contacts)
    # Of a body of one coefficient all rows have it, and those of others are written with each list.
    larger = new_penalty_forces(capacity, float(forces.friction[0]), forces.retardation_time)
    of_rows = ("node", "weight", "normal", "height", "stiffness", "offset", "largest_depth")
    for name in (*of_rows, "damping_time", "push", "anchor", "friction"):
        getattr(larger, name)[:n] = getattr(forces, name)[used]
    cells = ("n_contacts", "n_fading", "n_pressing", "work", "stored", "pressure_impulse")
    for name in (*cells, "penetration"):
        setattr(larger, name, getattr(forces, name))
    larger.floor_impulse[:] = forces.floor_impulse
    return larger


@kernel
def clear_contact_totals(forces: PenaltyForces) -> None:
    """Begin to count impulses and penetration."""
    forces.pressure_impulse = forces.penetration = 0.0
    forces.n_pressing = 0
    for x in range(3):
        forces.floor_impulse[x] = 0.0


@kernel
def weighted_sum(forces: PenaltyForces, c: int, values: FloatArray) -> Vec3:
    """Return the weighted sum of nodal values at contact `c`: one side less the other."""
    weight, node = forces.weight, forces.node
    total = scale(weight[c, 0], vec3(values, node[c, 0]))
    for q in range(1, 4):
        total = axpy(weight[c, q], vec3(values, node[c, q]), total)
    return total


@kernel
def clear_contact_forces(forces: PenaltyForces, external: FloatArray) -> None:
    """Set the forces on the nodes of all contacts to zero, if there are any."""
    if forces.has_acted == 0:
        return
    forces.has_acted = 0
    for i in range(forces.n_nodes):
        store(external, forces.touching[i], Vec3(0.0, 0.0, 0.0))


@kernel
def list_touching_nodes(forces: PenaltyForces, share: FloatArray) -> None:
    """List the nodes in contact, and write the share of each in all contacts: sum(|w|)."""
    rows, n = range(forces.first, forces.first + forces.n_contacts), 0
    for c in rows:
        for q in range(4):
            share[forces.node[c, q]] = -1.0
    for c in rows:
        for q in range(4):
            node = forces.node[c, q]
            if share[node] < 0.0:
                share[node] = 0.0
                forces.touching[n] = node
                n += 1
            share[node] += abs(forces.weight[c, q])
    forces.n_nodes = n


@kernel
def begin_contact(forces: PenaltyForces, c: int, height: float) -> None:
    """Begin contact `c` without a force; `height`: that of the floor [m], else 0."""
    forces.height[c] = height
    forces.stiffness[c] = 0.0
    forces.offset[c] = 0.0
    forces.push[c] = 0.0
    store(forces.anchor, c, Vec3(0.0, 0.0, 0.0))
    store(forces.impulse, c, Vec3(0.0, 0.0, 0.0))


@kernel
def take_over(
    forces: PenaltyForces, body: Body, before: tuple[int, int], now: tuple[int, int]
) -> None:
    """Give the forces of contacts before to those of a node that have just begun.

    Each takes over one force at most: that of its own face, else that of the nearest direction.

    Args:
        forces: Written.
        body: Where the nodes are.
        before: First contact of the node before, and how many.
        now: First contact of the node now, and how many.
    """
    for of_same_face in (True, False):
        for c in range(now[0], now[0] + now[1]):
            if forces.stiffness[c] > 0.0:
                continue
            normal, heir, most = vec3(forces.normal, c), -1, SAME_DIRECTION
            for old in range(before[0], before[0] + before[1]):
                cosine = dot(vec3(forces.normal, old), normal)
                may_take = forces.push[old] != _HANDED_ON and (
                    not of_same_face or _are_of_same_nodes(forces, old, c)
                )
                if may_take and cosine > most:
                    heir, most = old, cosine
            if heir >= 0:
                _take_over_from(forces, body, heir, c)


@kernel
def _take_over_from(forces: PenaltyForces, body: Body, old: int, c: int) -> None:
    """Give the force of contact `old` to contact `c`."""
    forces.push[c] = forces.push[old]
    forces.stiffness[c] = forces.stiffness[old]
    forces.offset[c] = forces.offset[old]
    forces.push[old] = _HANDED_ON
    normal = vec3(forces.normal, c)
    stretch = sub(_across(forces, body, old), vec3(forces.anchor, old))
    stretch = axpy(-dot(stretch, normal), normal, stretch)
    store(forces.anchor, c, sub(_across(forces, body, c), stretch))


@inlined
def _are_of_same_nodes(forces: PenaltyForces, a: int, b: int) -> bool:
    """Whether two contacts have the same nodes."""
    node = forces.node
    return bool(
        node[a, 0] == node[b, 0]
        and node[a, 1] == node[b, 1]
        and node[a, 2] == node[b, 2]
        and node[a, 3] == node[b, 3]
    )


@kernel
def _across(forces: PenaltyForces, body: Body, c: int) -> Vec3:
    """Return what separates the sides of contact `c` across its normal [m]."""
    d, normal = weighted_sum(forces, c, body.positions), vec3(forces.normal, c)
    return axpy(-dot(d, normal), normal, d)


@kernel
def copy_contact(forces: PenaltyForces, c: int, to: int) -> None:
    """Copy a contact to a row of the next list, where it continues."""
    for q in range(4):
        forces.node[to, q] = forces.node[c, q]
        forces.weight[to, q] = forces.weight[c, q]
    store(forces.normal, to, vec3(forces.normal, c))
    store(forces.anchor, to, vec3(forces.anchor, c))
    store(forces.impulse, to, Vec3(0.0, 0.0, 0.0))
    forces.height[to] = forces.height[c]
    forces.stiffness[to] = forces.stiffness[c]
    forces.offset[to] = forces.offset[c]
    forces.push[to] = forces.push[c]
    forces.push[c] = _HANDED_ON
