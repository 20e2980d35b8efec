"""Rest: a body that has been calm for a while, and that nothing touches, is not moved.

Until then it takes its steps. It is moved again from the time step in which a blade touches it, a
support moves, a load acts or its mesh changes.
"""

import math

from tissue.blade.edge_anchors import is_engaged
from tissue.contact.response.forces import add_contact_forces, end_contact_substep
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import point_of, store_point
from tissue.core.vec3 import dot, store, sub, vec3
from tissue.elasticity.energy import kinetic_energy
from tissue.elasticity.relaxed_stress import relaxes
from tissue.integrators.step_context import StepContext
from tissue.mesh.body import Body

CALM_SPEED = 0.01
"""Speed up to which a body is calm, the root of the mean square of its nodes weighted with their
masses, in node sizes per second: 47 um/s in the organ. Larger: a slow motion of the body stops
short of its end. Smaller, or the speed of the fastest node instead: a sliver of some milligrams
that swings by micrometres after many cuts keeps the body from rest for seconds."""

CALM_FASTEST = 4.0
"""Speed of the fastest node up to which a body is calm, in node sizes per second: 0.02 m/s in the
organ. Larger: a sliver that snaps is stopped; smaller: as above."""

CALM_WAY = 0.003
"""How far a node may move while a body is calm, per node size: 14 um in the organ. Larger: what
creeps stops short of its end; smaller: as above."""

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
    is_touched = is_engaged(blade.anchors) or blade.sides.n_faces > 0 or blade.spine.n_pressing > 0
    is_drifting = len(context.loose.node) > 0 and context.contacts.n_contacts == 0
    if is_touched or is_drifting or context.supports.is_moving == 1 or context.geoms.n_contacts > 0:
        return False
    return drag > 0.0 and not relaxes(context.elastic.solid)


@kernel
def mean_speed(body: Body) -> float:
    """Return the root of the mean square speed of the nodes, weighted with their masses [m/s]."""
    total = 0.0
    for i in range(body.n_nodes):
        total += body.masses[i]
    return math.sqrt(2.0 * kinetic_energy(body) / total)


@kernel
def keep_positions(body: Body, kept: FloatArray) -> None:
    """Write where the nodes are to `kept` [m], shape (capacity, 3)."""
    for i in range(body.n_nodes):
        store(kept, i, vec3(body.positions, i))


@kernel
def have_stayed(body: Body, kept: FloatArray, way: float) -> bool:
    """Return whether no node is farther than `way` [m] from where it was kept."""
    furthest = 0.0
    for i in range(body.n_nodes):
        moved = sub(vec3(body.positions, i), vec3(kept, i))
        furthest = max(furthest, dot(moved, moved))
    return bool(furthest <= way * way)


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
