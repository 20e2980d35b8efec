"""Damping between steps: dampers and drag change velocities between two elastic steps or pairs.

With D the damping and E the elastic motion the steps are D(s/2) E(s) D(s) E(s) D(s) ..., Strang's
splitting. E(s) is one step of the integrator or, where damping is slow, two. Each D is one explicit
step at the positions as they are,

    v <- v + s (viscous force / m - drag v)

of first order: a motion that dies away at the rate r does so at about r (1 + r s / 2). A second
evaluation of the dampers would be needed for the second order.

It is stable up to s times the highest rate = 2 (`tissue.integrators.stability`). What it takes from
the kinetic energy is what the dampers dissipate, so that no integral of a power is needed.
"""

from tissue.core.jit import kernel
from tissue.core.simd import point, point_of, store_point, times
from tissue.core.simd_rows import natural
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.internal_forces import Elastic, viscous_force
from tissue.integrators.stages import Stages
from tissue.mesh.body import Body

SLOW_DAMPING = 0.5
"""Highest rate of damping times two steps up to which damping acts once in two steps; with Verlet
that of the uncut body. What dies away fastest does so at 1.39 times its rate then, a mode of single
elements. In liver the product is 0.33 with four steps of Verlet in a millisecond, and 0.67 with two
of the Nystroem method: with these, damping acts in each."""

FASTEST_DECAY = 1.0
"""The same for the body as it is cut, with Verlet: up to here damping stops no motion in less than
the interval, and turns none round. Slivers die away faster than by their rate then. After the
organ's cut, whose slivers double the highest rate, it is 0.67 with four steps."""

LONGEST_INTERVAL = 2
"""Steps between two times that damping acts, at most. What turns by pi in an interval, at the same
phase each time, would keep the part of its motion that is not velocity: in two steps that is the
fastest mode there may be."""


class Damping(Arrays):
    """Damping that acts between steps, and the loss in damping either way."""

    interval: IntCell
    """Steps from one time that it acts to the next, at most `LONGEST_INTERVAL`."""

    owed: FloatCell
    """Time for which it has yet to act [s]: half of the steps since it acted last."""
    dissipated: FloatCell
    """Energy lost in viscosity and drag so far [J]; where damping acts in every stage it is counted
    for an account of energy alone."""
    is_counted: IntCell
    """1 where an account of energy is kept, else 0."""
    rate_uncut: float
    """Highest rate at which damping stops a motion of the body before it is cut [1/s]."""
    retardation_time: float
    """Damping along each edge, per stiffness of the edge [s]; 0 where it acts in every stage."""
    drag: float
    """Rate at which free motion dies away [1/s]; 0 where it acts in every stage."""


@kernel
def damping_changes(
    damping: Damping,
    body: Body,
    elastic: Elastic,
    stages: Stages,
    seconds: float,
    begin: int,
    end: int,
) -> None:
    """Find how damping changes the velocities of the nodes from `begin` to `end`.

    Args:
        damping: How strong it is.
        body: Masses, positions and velocities.
        elastic: The dampers.
        stages: The changes are written.
        seconds: How long damping acts [s].
        begin: First node.
        end: End of the nodes.
    """
    time, drag = damping.retardation_time, damping.drag
    x, v = body.positions, body.velocities
    for node in range(begin, end):
        i = natural(node)
        change = point_of(0.0, 0.0, 0.0)
        if not body.fixed[i]:
            change = times(-drag, point(v, i))
            if time > 0.0:
                force = viscous_force(elastic, i, x, v, time)
                change = change + times(1.0 / body.masses[i], force)
        store_point(stages.change, i, times(seconds, change))


@kernel
def change_velocities(damping: Damping, body: Body, stages: Stages) -> None:
    """Change all velocities as `damping_changes` found, and count what is dissipated."""
    v = body.velocities
    dissipated = 0.0
    for i in range(body.n_nodes):
        before = vec3(v, i)
        store_point(v, i, point(v, i) + point(stages.change, i))
        after = vec3(v, i)
        dissipated += 0.5 * body.masses[i] * (dot(before, before) - dot(after, after))
    damping.dissipated += dissipated
