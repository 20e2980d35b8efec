"""Rest: a body that has been calm for a while, and that nothing touches, is not moved.

Until then it takes its steps. It is moved again from the time step in which a blade touches it, a
support moves, a load acts or its mesh changes.
"""

from tissue.blade.anchors import is_engaged
from tissue.contact.penalty.contact_forces import add_contact_forces, end_contact_substep
from tissue.core.jit import kernel
from tissue.core.simd import point_of, store_point
from tissue.elasticity.energy import kinetic_energy
from tissue.elasticity.relaxed_stress import relaxes
from tissue.integrators.step_context import StepContext

CALM_SPEED = 0.06
"""Speed of the fastest node up to which a body is calm, in node sizes per second: 0.28 mm/s in the
organ, whose nodes at rest tremble at up to 0.06 mm/s in single precision, and after many cuts at
0.2 mm/s. Larger: a slow motion stops short of its end; smaller: a body never comes to rest."""

TIME_TO_REST = 0.25
"""How long a body is calm until it is at rest [s]. Shorter: a swing of some micrometres, which is
slow at its turning points, stops there, and a sag stops 40 nm short of its end."""


@kernel
def may_rest(context: StepContext, drag: float) -> bool:
    """Return whether nothing acts that would move a calm body.

    A loose piece that touches nothing drifts on, however slowly, and without drag nothing comes to
    rest. Stress that relaxes moves a body slowly for a long time.

    Args:
        context: What takes part.
        drag: Rate at which free motion dies away [1/s].
    """
    blade = context.blade
    is_touched = is_engaged(blade.anchors) or blade.sides.n_faces > 0 or blade.blunt.n_pressing > 0
    is_drifting = len(context.loose.node) > 0 and context.contacts.n_contacts == 0
    if is_touched or is_drifting or context.supports.is_moving == 1:
        return False
    return drag > 0.0 and not relaxes(context.elastic.solid)


@kernel
def stop_nodes(context: StepContext) -> None:
    """Stop all nodes; damping has taken what kinetic energy was left."""
    body = context.body
    context.damping.dissipated += kinetic_energy(body)
    for i in range(body.n_nodes):
        store_point(body.velocities, i, point_of(0.0, 0.0, 0.0))


@kernel
def rest(context: StepContext, seconds: float) -> None:
    """Let a time pass at rest [s]: contacts press as they are."""
    body, contacts, external = context.body, context.contacts, context.stages.external
    if contacts.n_contacts > 0:
        add_contact_forces(contacts, body.positions, body.velocities, seconds, external)
        end_contact_substep(contacts, body.positions, body.velocities, external)
