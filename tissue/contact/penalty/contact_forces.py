"""`PenaltyForces`: contacts as springs that push apart and rub, evaluated with all other forces.

A contact lies between a node and a point of a face, between points of two edges, or between a node
and the floor. With the weights w of its nodes, its gap is g = n . sum(w_i x_i), and

    d = min(offset - g, largest depth)                  depth of the spring
    f = k max(d - tau n . v, 0)                         pressure, where d > 0; v = sum(w_i v_i)
    t = k (s + tau v_t), no longer than mu k d          friction, against the stretch s and sliding

The weights of two sides add up to zero, so what one side gets the other gives; the force acts with
weights that put it and its reaction on one line (`line_of_action`). Friction is a spring
that begins at an anchor; where it pulls with more than Coulomb's limit, the anchor follows at the
end of the substep, so that within a substep forces depend on positions and velocities alone.

Source: Cundall and Strack (1979), A discrete numerical model for granular assemblies, for the
springs with friction.
"""

import numpy as np

from tissue.contact.penalty.line_of_action import weights_on_line
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, add, axpy, dot, norm, scale, store, sub, vec3
from tissue.geometry.tetrahedron import Weights

HANDED_ON = -1.0
"""Value of `PenaltyForces.push` where another contact of the next list has taken over the force."""


class PenaltyForces(Arrays):
    """Two lists of contacts: that in use, and room for the next; both of `capacity` rows.

    The rows of one list are one after the other, so arrays have 2 * capacity rows.
    """

    first: IntCell
    """First row of the list in use: 0, or the capacity."""
    n_contacts: IntCell
    """Number of contacts in the list in use."""
    n_pressing: IntCell
    """Number of contacts that pressed at the end of the last substep."""
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
    push: FloatArray
    """Elastic part of the pressure at the end of the last substep [N], or HANDED_ON; shape
    (2 * capacity,)."""
    anchor: FloatArray
    """Where the spring of friction is slack: sum(w_i x_i) without its part along the normal [m],
    shape (2 * capacity, 3)."""
    spread: FloatArray
    """Weights that the force of each contact last acted with: those that put it and its reaction on
    one line (`line_of_action`); shape (2 * capacity, 4)."""
    impulse: FloatArray
    """Impulse of each contact since the last substep ended [N s], shape (2 * capacity, 3)."""
    velocity: FloatArray
    """sum(w_i v_i) as a contact began to push in this substep [m/s], with the weights `spread`;
    shape (2 * capacity, 3)."""
    friction: float
    """Coefficient of friction."""
    retardation_time: float
    """Damping per stiffness tau [s]."""


def new_penalty_forces(capacity: int, friction: float, retardation_time: float) -> PenaltyForces:
    """Return no contacts, with room for that many."""
    rows = 2 * capacity
    of_floats = ("height", "stiffness", "offset", "largest_depth", "push")
    return PenaltyForces(
        first=0,
        n_contacts=0,
        n_pressing=0,
        work=0.0,
        stored=0.0,
        pressure_impulse=0.0,
        penetration=0.0,
        floor_impulse=np.zeros(3),
        node=np.zeros((rows, 4), np.int64),
        weight=np.zeros((rows, 4)),
        spread=np.zeros((rows, 4)),
        normal=np.zeros((rows, 3)),
        **{name: np.zeros(rows) for name in of_floats},
        **{name: np.zeros((rows, 3)) for name in ("anchor", "impulse", "velocity")},
        friction=float(friction),
        retardation_time=float(retardation_time),
    )


def grown_penalty_forces(forces: PenaltyForces, capacity: int) -> PenaltyForces:
    """Return the contacts with room for that many; the first list is the one in use."""
    n, used = forces.n_contacts, slice(forces.first, forces.first + forces.n_contacts)
    larger = new_penalty_forces(capacity, forces.friction, forces.retardation_time)
    of_rows = ("node", "weight", "normal", "height", "stiffness", "offset", "largest_depth")
    for name in (*of_rows, "push", "anchor"):
        getattr(larger, name)[:n] = getattr(forces, name)[used]
    cells = ("n_contacts", "n_pressing", "work", "stored", "pressure_impulse", "penetration")
    for name in cells:
        setattr(larger, name, getattr(forces, name))
    larger.floor_impulse[:] = forces.floor_impulse
    return larger


def clear_contact_totals(forces: PenaltyForces) -> None:
    """Begin to count impulses and penetration."""
    forces.pressure_impulse = forces.penetration = 0.0
    forces.n_pressing = 0
    forces.floor_impulse[:] = 0.0


@kernel
def weighted_sum(forces: PenaltyForces, c: int, values: FloatArray) -> Vec3:
    """Return the weighted sum of nodal values at contact `c`: one side less the other."""
    return _sum_with(forces.weight, forces.node, c, values)


@kernel
def _sum_with(weight: FloatArray, node: IntArray, c: int, values: FloatArray) -> Vec3:
    """Return the sum of nodal values at contact `c` with these weights."""
    total = scale(weight[c, 0], vec3(values, node[c, 0]))
    for q in range(1, 4):
        total = axpy(weight[c, q], vec3(values, node[c, q]), total)
    return total


@kernel
def is_floor_contact(forces: PenaltyForces, c: int) -> bool:
    """Whether contact `c` is one of a node and the floor."""
    return bool(forces.node[c, 0] == forces.node[c, 1])


@kernel
def clear_contact_forces(forces: PenaltyForces, external: FloatArray) -> None:
    """Set the forces on the nodes of all contacts to zero."""
    nothing = Vec3(0.0, 0.0, 0.0)
    for c in range(forces.first, forces.first + forces.n_contacts):
        for q in range(4):
            store(external, forces.node[c, q], nothing)


@kernel
def add_contact_forces(
    forces: PenaltyForces,
    positions: FloatArray,
    velocities: FloatArray,
    seconds: float,
    external: FloatArray,
) -> None:
    """Add the forces of all contacts to those on the nodes, and count their impulses.

    Args:
        forces: Totals are written.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        seconds: Weight of this evaluation in the integral over time [s].
        external: Forces on the nodes [N], shape (capacity, 3); those of contact are added.
    """
    tau = forces.retardation_time
    pressure = 0.0
    for c in range(forces.first, forces.first + forces.n_contacts):
        across = weighted_sum(forces, c, positions)
        normal = vec3(forces.normal, c)
        along = dot(normal, across)
        depth = forces.offset[c] + forces.height[c] - along
        if not depth > 0.0:
            continue
        depth = min(depth, forces.largest_depth[c])
        k = forces.stiffness[c]
        velocity = weighted_sum(forces, c, velocities)
        approach = dot(normal, velocity)
        force = max(k * (depth - tau * approach), 0.0)
        stretch = sub(axpy(-along, normal, across), vec3(forces.anchor, c))
        pull = axpy(tau, axpy(-approach, normal, velocity), stretch)
        size, limit = k * norm(pull), forces.friction * k * depth
        share = limit / size if size > limit else 1.0
        total = axpy(force, normal, scale(-share * k, pull))
        if not dot(total, total) > 0.0:
            continue
        _spread_force(forces, c, positions, total, external)
        before = vec3(forces.impulse, c)
        if not dot(before, before) > 0.0:
            store(forces.velocity, c, _sum_with(forces.spread, forces.node, c, velocities))
        store(forces.impulse, c, axpy(seconds, total, before))
        if is_floor_contact(forces, c):
            forces.floor_impulse[0] += seconds * total.x
            forces.floor_impulse[1] += seconds * total.y
            forces.floor_impulse[2] += seconds * total.z
        else:
            pressure += force
    forces.pressure_impulse += seconds * pressure


@kernel
def _spread_force(
    forces: PenaltyForces, c: int, positions: FloatArray, force: Vec3, external: FloatArray
) -> None:
    """Add the force of contact `c` to those on its nodes, so that it turns nothing.

    Args:
        forces: `spread` is written.
        c: The contact.
        positions: Positions of the nodes [m].
        force: The force on the side of the positive weights [N].
        external: Forces on the nodes [N]; written.
    """
    if is_floor_contact(forces, c):
        w = Weights(1.0, 0.0, 0.0, 0.0)
    else:
        w = weights_on_line(forces.node, forces.weight, c, positions, force)
    spread = forces.spread
    spread[c, 0], spread[c, 1], spread[c, 2], spread[c, 3] = w.a, w.b, w.c, w.d
    for q in range(4):
        node, weight = forces.node[c, q], spread[c, q]
        external[node, 0] += weight * force.x
        external[node, 1] += weight * force.y
        external[node, 2] += weight * force.z


@kernel
def end_contact_substep(
    forces: PenaltyForces, positions: FloatArray, velocities: FloatArray, external: FloatArray
) -> None:
    """Let anchors follow what slides; count work, and note forces and energies after a substep.

    The work is the impulse times the mean of the velocities before and after: that is by what it
    changed the kinetic energy, however long the substep.

    Args:
        forces: Written.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        external: Forces on the nodes [N], shape (capacity, 3); those of contact are cleared.
    """
    clear_contact_forces(forces, external)
    forces.work += _work_since(forces, velocities)
    stored, n_pressing = 0.0, 0
    for c in range(forces.first, forces.first + forces.n_contacts):
        across = weighted_sum(forces, c, positions)
        normal = vec3(forces.normal, c)
        along = dot(normal, across)
        free = forces.offset[c] + forces.height[c] - along
        tangential = axpy(-along, normal, across)
        if not free > 0.0:
            forces.push[c] = 0.0
            store(forces.anchor, c, tangential)
            continue
        k = forces.stiffness[c]
        depth = min(free, forces.largest_depth[c])
        forces.push[c] = k * depth
        stretch = sub(tangential, vec3(forces.anchor, c))
        size, longest = norm(stretch), forces.friction * depth
        if size > longest:
            stretch = scale(longest / size, stretch)
            store(forces.anchor, c, sub(tangential, stretch))
        stored += k * (depth * (free - 0.5 * depth) + 0.5 * dot(stretch, stretch))
        n_pressing += 1
        forces.penetration = max(forces.penetration, forces.height[c] - along)
    forces.stored = stored
    forces.n_pressing = n_pressing


@kernel
def _work_since(forces: PenaltyForces, velocities: FloatArray) -> float:
    """Return the work of all contacts since the last call [J], and begin to count anew."""
    work = 0.0
    for c in range(forces.first, forces.first + forces.n_contacts):
        impulse = vec3(forces.impulse, c)
        if dot(impulse, impulse) > 0.0:
            after = _sum_with(forces.spread, forces.node, c, velocities)
            both = add(vec3(forces.velocity, c), after)
            work += 0.5 * dot(impulse, both)
            store(forces.impulse, c, Vec3(0.0, 0.0, 0.0))
    return work
