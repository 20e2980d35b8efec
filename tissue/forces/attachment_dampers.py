"""Dampers of points that an attachment holds in all directions: they act between steps.

In a stage of a step a damper of rate r would limit the step to some 2 / r, however slow the springs
are: jaws that hold a lobe of liver by dampers near the critical ones took four steps for one of the
lobe. Each damper alone brings its point nearer to the velocity of what it is tied to by

    v <- v + z / (1 + z / 2) (v_end - v),   z = d s / m,   1 / m = sum_q w_q^2 / m_q

over a time s, and to that velocity from z = 2 on, so that it turns no motion round. Up to there a
point that is drawn past its end at an even speed is resisted by the whole force of its damper; with
1 - exp(-z) in place of z / (1 + z / 2) it would be 2 tanh(z / 2) / z of it. They do so one after
the other, in a fixed order. What a point gets as an impulse, its frame gives.
"""

from tissue.core.jit import kernel
from tissue.core.vec3 import add, axpy, dot, scale, store, sub, vec3
from tissue.forces.attachments import (
    STRAIGHT,
    Attachments,
    attached_point,
    count_impulse,
    is_held_all_round,
)
from tissue.forces.step_context import StepContext
from tissue.mesh.body import Body


@kernel
def change_by_dampers(context: StepContext, seconds: float, dt: float) -> None:
    """Add what dampers change in some time to the changes of the velocities of the nodes.

    Energies are counted: what nodes lose here is taken out of what all damping between steps is
    found to dissipate.

    Args:
        context: Changes in its stages [m/s], impulses and energies are written.
        seconds: For how long the dampers act [s].
        dt: Length of the time step [s].
    """
    attachments, body, change = context.attachments, context.body, context.stages.change
    for p in range(len(attachments.nodes)):
        damping = attachments.damping[p]
        if damping == 0.0 or attachments.state[p] != STRAIGHT:
            continue
        if not is_held_all_round(attachments, p):
            continue
        mobility = _mobility(attachments, body, p)
        before = add(
            attached_point(attachments, p, body.velocities), attached_point(attachments, p, change)
        )
        of_end = scale(1.0 / dt, sub(vec3(attachments.end, p), vec3(attachments.begin, p)))
        share = damping * seconds
        share /= max(1.0 + 0.5 * share * mobility, share * mobility)
        impulse = scale(share, sub(of_end, before))
        count_impulse(attachments, p, attached_point(attachments, p, body.positions), impulse)
        taken = dot(impulse, axpy(0.5 * mobility, impulse, before))
        given = dot(impulse, of_end)
        attachments.work += given
        attachments.dissipated += given - taken
        of_supports = 0.0
        for q in range(4):
            node, weight = attachments.nodes[p, q], attachments.weights[p, q]
            if body.fixed[node]:
                of_supports += weight * dot(impulse, vec3(body.velocities, node))
            else:
                more = scale(weight / body.masses[node], impulse)
                store(change, node, add(vec3(change, node), more))
        context.supports.work -= of_supports
        context.damping.dissipated += taken - of_supports


@kernel
def _mobility(attachments: Attachments, body: Body, p: int) -> float:
    """Return the velocity that a unit impulse gives point `p` [1/kg]: 0 where all is fixed."""
    mobility = 0.0
    for q in range(4):
        node, weight = attachments.nodes[p, q], attachments.weights[p, q]
        if not body.fixed[node]:
            mobility += weight * weight / body.masses[node]
    return mobility
