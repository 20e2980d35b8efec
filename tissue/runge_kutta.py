"""The two-level Runge-Kutta method: positions and velocities in one step of 4th order.

Nystroem's form (Collatz, chapter 2: the paper's reference [4]):

    a1 = a(t,       x,   v           )
    X  = x + h/2 v + h^2/8 a1                  one position for stages 2 and 3
    a2 = a(t + h/2, X,   v + h/2 a1  )
    a3 = a(t + h/2, X,   v + h/2 a2  )
    x4 = x + h v + h^2/2 a3
    a4 = a(t + h,   x4,  v + h a3    )
    x <- x + h v + h^2/6 (a1 + a2 + a3)        the paper's correction terms are those in h^2
    v <- v + h/6 (a1 + 2 a2 + 2 a3 + a4)

Elastic forces are evaluated three times a step, damping four times.
"""

import numpy as np

from tissue.anchors import Anchors, Edge, clear_forces, pull
from tissue.arrays import Arrays
from tissue.body import NODES, Body
from tissue.contact.resolve import IS_AWAKE, IS_PENDING, ContactState, prepare, resolve
from tissue.jit import kernel
from tissue.slipping import slip
from tissue.springs import Springs, accelerations
from tissue.star import Visits
from tissue.types import FloatArray, IntArray

STABILITY_LIMIT = np.array(
    [
        # damping ratio, largest angular frequency times step
        [0.0, 2.587],
        [0.05, 2.587],
        [0.5, 2.587],
        [0.7, 1.863],
        [0.9, 1.469],
        [1.0, 1.331],
        [1.5, 0.907],
        [2.0, 0.687],
        [5.0, 0.278],
    ]
)
"""Where the method is stable for x'' = -w^2 x - 2 zeta w x' (the tests measure it). Between 0.05
and 0.5 the limit is higher; the table stays at its lowest."""

SAFETY = 0.8
"""Share of the stable step that is used. Springs in strong compression are stiffer than at rest;
0.8 covers a compression to about 0.7 of the rest length. Above 1 the body can explode."""


class Stages(Arrays):
    """Scratch of one step, each of shape (capacity, 3)."""

    positions: FloatArray
    velocities: FloatArray
    elastic: FloatArray
    external: FloatArray
    """Forces of anchors on nodes [N]: zero everywhere but at the nodes that anchors hold."""
    a1: FloatArray
    a2: FloatArray
    a3: FloatArray
    a4: FloatArray


def new_stages(n_nodes: int) -> Stages:
    """Return scratch for that many nodes."""
    return Stages(**{name: np.zeros((n_nodes, 3)) for name in Stages.__annotations__})


def largest_stable_step(frequency: float, retardation_time: float, viscous_damping: float) -> float:
    """Return the largest stable step [s] for angular frequencies up to `frequency` [1/s].

    Stiffness-proportional damping adds w * retardation_time / 2 to the damping ratio of a mode,
    drag adds viscous_damping / (2 w).
    """
    if frequency == 0.0:
        return np.inf
    ratio = 0.5 * (frequency * retardation_time + viscous_damping / frequency)
    table = STABILITY_LIMIT
    if ratio > table[-1, 0]:
        limit = table[-1, 1] * table[-1, 0] / ratio
    else:
        # The limit falls nearly as 1 / ratio: a line between its entries would be above it.
        limit = 1.0 / float(np.interp(ratio, table[:, 0], 1.0 / table[:, 1]))
    return limit / frequency


@kernel
def relax(
    body: Body,
    springs: Springs,
    anchors: Anchors,
    edge: Edge,
    visits: Visits,
    stages: Stages,
    contact: ContactState,
    queue: IntArray,
    gravity: FloatArray,
    retardation_time: float,
    viscous_damping: float,
    toughness: float,
    reach: float,
    dt: float,
    begin: float,
    end: float,
    first: int,
    n: int,
) -> int:
    """Advance the body by `n` Runge-Kutta steps, anchors pulling and slipping; return how many.

    Fewer than `n` means that contact needs room: give it some, and go on from the step returned.

    Args:
        body: Positions and velocities are written.
        springs: The rows.
        anchors: Slip after each step.
        edge: The cutting edge over the whole time step of length `dt` [s].
        visits: For searches.
        stages: Scratch.
        contact: What may touch; corrects positions and velocities after each step.
        queue: Scratch.
        gravity: [m/s2], shape (3,).
        retardation_time: Damping along springs [s].
        viscous_damping: Drag [1/s].
        toughness: [J/m2].
        reach: See `slip` [m].
        dt: Length of the time step [s].
        begin: Fraction of the time step at which to begin.
        end: Fraction at which to end.
        first: Step to begin with: 0, or where it stopped for want of room.
        n: Number of Runge-Kutta steps.
    """
    share = (end - begin) / n
    is_awake = contact.state[IS_AWAKE] == 1
    for i in range(first, n):
        at = begin + i * share
        if contact.state[IS_PENDING] == 0:
            if is_awake:
                prepare(contact, body)
            runge_kutta_nystroem(
                body,
                springs,
                anchors,
                edge,
                stages,
                gravity,
                retardation_time,
                viscous_damping,
                toughness,
                dt,
                at,
                share,
            )
        if is_awake:
            contact.state[IS_PENDING] = 1
            if not resolve(contact, body, share * dt):
                return i
            contact.state[IS_PENDING] = 0
        clear_forces(anchors, body, stages.external)  # before anchors go to other nodes
        slip(anchors, body, visits, edge, at + share, toughness, reach, queue)
    return n


@kernel
def runge_kutta_nystroem(
    body: Body,
    springs: Springs,
    anchors: Anchors,
    edge: Edge,
    stages: Stages,
    gravity: FloatArray,
    retardation_time: float,
    viscous_damping: float,
    toughness: float,
    dt: float,
    at: float,
    share: float,
) -> None:
    """Advance positions and velocities from fraction `at` of the time step by `share` of it."""
    h = share * dt
    n = body.counts[NODES]
    x = body.positions
    v = body.velocities
    xs = stages.positions
    vs = stages.velocities
    a1 = stages.a1
    a2 = stages.a2
    a3 = stages.a3
    a4 = stages.a4
    damping = (retardation_time, viscous_damping, gravity)
    forces = (stages.external, True, stages.elastic)

    pull(anchors, body, edge, x, at, share / 6.0, dt, toughness, stages.external)
    accelerations(springs, body, x, v, *damping, *forces, a1)
    for i in range(n):
        for c in range(3):
            xs[i, c] = x[i, c] + 0.5 * h * v[i, c] + 0.125 * h * h * a1[i, c]
            vs[i, c] = v[i, c] + 0.5 * h * a1[i, c]

    pull(
        anchors, body, edge, xs, at + 0.5 * share, share * 2.0 / 3.0, dt, toughness, stages.external
    )
    accelerations(springs, body, xs, vs, *damping, *forces, a2)
    for i in range(n):
        for c in range(3):
            vs[i, c] = v[i, c] + 0.5 * h * a2[i, c]

    accelerations(springs, body, xs, vs, *damping, stages.external, False, stages.elastic, a3)
    for i in range(n):
        for c in range(3):
            xs[i, c] = x[i, c] + h * v[i, c] + 0.5 * h * h * a3[i, c]
            vs[i, c] = v[i, c] + h * a3[i, c]

    pull(anchors, body, edge, xs, at + share, share / 6.0, dt, toughness, stages.external)
    accelerations(springs, body, xs, vs, *damping, *forces, a4)
    for i in range(n):
        for c in range(3):
            x[i, c] += h * v[i, c] + h * h / 6.0 * (a1[i, c] + a2[i, c] + a3[i, c])
            v[i, c] += h / 6.0 * (a1[i, c] + 2.0 * a2[i, c] + 2.0 * a3[i, c] + a4[i, c])
