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

from tissue.blade.anchors import Edge
from tissue.blade.forces import Tool, act, give_way
from tissue.contact.resolve import prepare, resolve
from tissue.contact.state import IS_AWAKE, IS_PENDING, ContactState
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point, point_of, room_for_points, store_point, times
from tissue.core.structs import Arrays
from tissue.elasticity.internal_forces import (
    Elastic,
    Surroundings,
    deform,
    internal_force,
    viscous_force,
)
from tissue.mesh.body import Body
from tissue.mesh.star import Visits


class Stages(Arrays):
    """Scratch of one step, each of shape (capacity, 3)."""

    positions: FloatArray
    """Of the second and third stage [m]."""
    positions_4: FloatArray
    """Of the fourth [m]."""
    velocities: FloatArray
    """Of the second stage, then of the fourth [m/s]."""
    change: FloatArray
    """Velocities of the third stage less those of the second [m/s]."""
    external: FloatArray
    """Forces of the blade on nodes [N]: zero everywhere but at those that it acts on."""
    a1: FloatArray
    a2: FloatArray


def new_stages(n_nodes: int) -> Stages:
    """Return scratch for that many nodes."""
    return Stages(**{name: room_for_points(n_nodes) for name in Stages.__annotations__})


@kernel
def relax(
    body: Body,
    elastic: Elastic,
    tool: Tool,
    edge: Edge,
    visits: Visits,
    stages: Stages,
    contact: ContactState,
    queue: IntArray,
    surroundings: Surroundings,
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
        elastic: What the forces inside the body follow from.
        tool: What the blade does to it; gives way after each step.
        edge: The cutting edge over the whole time step of length `dt` [s].
        visits: For searches.
        stages: Scratch.
        contact: What may touch; corrects positions and velocities after each step.
        queue: Scratch.
        surroundings: Gravity and damping.
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
            runge_kutta_nystroem(body, elastic, tool, edge, stages, surroundings, dt, at, share)
        if is_awake:
            contact.state[IS_PENDING] = 1
            if not resolve(contact, body, share * dt):
                return i
            contact.state[IS_PENDING] = 0
        now = at + share
        give_way(tool, body, visits, edge, stages.external, now, share * dt, reach, queue)
    return n


@kernel
def runge_kutta_nystroem(
    body: Body,
    elastic: Elastic,
    tool: Tool,
    edge: Edge,
    stages: Stages,
    surroundings: Surroundings,
    dt: float,
    at: float,
    share: float,
) -> None:
    """Advance positions and velocities from fraction `at` of the time step by `share` of it."""
    h = share * dt
    n = body.n_nodes
    external = stages.external
    half, end = at + 0.5 * share, at + share
    act(tool, body, edge, body.positions, at, share / 6.0, dt, external)
    deform(elastic, body, body.positions)
    first_stage(body, elastic, stages, surroundings, h, 0, n)
    x2 = stages.positions
    act(tool, body, edge, x2, half, share * 2.0 / 3.0, dt, external)
    deform(elastic, body, x2)
    second_stage(body, elastic, stages, surroundings, h, 0, n)
    if surroundings.retardation_time > 0.0:
        third_stage(body, elastic, stages, surroundings, h, 0, n)
    x4 = stages.positions_4
    act(tool, body, edge, x4, end, share / 6.0, dt, external)
    deform(elastic, body, x4)
    fourth_stage(body, elastic, stages, surroundings, h, 0, n)


@inlined
def acceleration(
    body: Body,
    elastic: Elastic,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    external: FloatArray,
    surroundings: Surroundings,
) -> Point:
    """Acceleration of a node [m/s2]; of a fixed one zero."""
    if body.fixed[node]:
        return point_of(0.0, 0.0, 0.0)
    time = surroundings.retardation_time
    force = internal_force(elastic, node, positions, velocities, time) + point(external, node)
    gravity = point_of(*surroundings.gravity)
    free = gravity - times(surroundings.drag, point(velocities, node))
    return free + times(1.0 / body.masses[node], force)


@kernel
def first_stage(
    body: Body,
    elastic: Elastic,
    stages: Stages,
    surroundings: Surroundings,
    h: float,
    begin: int,
    end: int,
) -> None:
    """a1 of the nodes from `begin` to `end`, and where the second stage finds them."""
    x, v = body.positions, body.velocities
    for i in range(begin, end):
        a1 = acceleration(body, elastic, i, x, v, stages.external, surroundings)
        store_point(stages.a1, i, a1)
        x2 = point(x, i) + times(0.5 * h, point(v, i)) + times(0.125 * h * h, a1)
        store_point(stages.positions, i, x2)
        store_point(stages.velocities, i, point(v, i) + times(0.5 * h, a1))


@kernel
def second_stage(
    body: Body,
    elastic: Elastic,
    stages: Stages,
    surroundings: Surroundings,
    h: float,
    begin: int,
    end: int,
) -> None:
    """a2, and how much the third stage's velocities differ; without dampers a3 as well."""
    x2, v2 = stages.positions, stages.velocities
    has_dampers = surroundings.retardation_time > 0.0
    for i in range(begin, end):
        a2 = acceleration(body, elastic, i, x2, v2, stages.external, surroundings)
        change = times(0.5 * h, a2 - point(stages.a1, i))
        if has_dampers:
            store_point(stages.a2, i, a2)
            store_point(stages.change, i, change)
        else:
            a3 = a2 if body.fixed[i] else a2 - times(surroundings.drag, change)
            _positions_and_velocities(body, stages, i, a2, a3, h)


@kernel
def third_stage(
    body: Body,
    elastic: Elastic,
    stages: Stages,
    surroundings: Surroundings,
    h: float,
    begin: int,
    end: int,
) -> None:
    """a3, which differs from a2 by damping alone, and damping is linear in the velocities."""
    time = surroundings.retardation_time
    for i in range(begin, end):
        a2 = point(stages.a2, i)
        a3 = a2
        if not body.fixed[i]:
            viscous = viscous_force(elastic, i, stages.positions, stages.change, time)
            a3 = a2 + times(1.0 / body.masses[i], viscous)
            a3 = a3 - times(surroundings.drag, point(stages.change, i))
        _positions_and_velocities(body, stages, i, a2, a3, h)


@inlined
def _positions_and_velocities(
    body: Body, stages: Stages, i: int, a2: Point, a3: Point, h: float
) -> None:
    """New positions, and new velocities but for what a4 adds."""
    x, v, a1 = point(body.positions, i), point(body.velocities, i), point(stages.a1, i)
    moved = x + times(h, v)
    store_point(stages.positions_4, i, moved + times(0.5 * h * h, a3))
    store_point(stages.velocities, i, v + times(h, a3))
    both = a2 + a3
    store_point(body.positions, i, moved + times(h * h / 6.0, a1 + both))
    store_point(body.velocities, i, v + times(h / 6.0, a1 + both + both))


@kernel
def fourth_stage(
    body: Body,
    elastic: Elastic,
    stages: Stages,
    surroundings: Surroundings,
    h: float,
    begin: int,
    end: int,
) -> None:
    """a4, and what the velocities lack."""
    x4, v4 = stages.positions_4, stages.velocities
    for i in range(begin, end):
        a4 = acceleration(body, elastic, i, x4, v4, stages.external, surroundings)
        store_point(body.velocities, i, point(body.velocities, i) + times(h / 6.0, a4))


@kernel
def accelerations(
    body: Body,
    elastic: Elastic,
    external: FloatArray,
    surroundings: Surroundings,
    out: FloatArray,
) -> None:
    """Write the acceleration of every node as it is and moves now to `out` [m/s2]."""
    x, v = body.positions, body.velocities
    deform(elastic, body, x)
    for i in range(body.n_nodes):
        store_point(out, i, acceleration(body, elastic, i, x, v, external, surroundings))
