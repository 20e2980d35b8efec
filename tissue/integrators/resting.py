"""Rest: a body that has barely moved for a while, and that nothing touches, is not moved.

Until then it takes its steps. It is moved again from the time step in which a blade touches it, a
support moves, a load acts or its mesh changes.
"""

import math

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import point_of, store_point
from tissue.core.vec3 import dot, store, sub, vec3
from tissue.elasticity.energy import kinetic_energy
from tissue.elasticity.relaxed_stress import relaxes
from tissue.forces.step_context import StepContext
from tissue.forces.terms import leave_at_rest
from tissue.mesh.body import Body

SPEED_AT_REST = 0.01
"""Speed up to which a body is nearly at rest, the root of the mean square of its nodes weighted
with their masses, in node sizes per second: 47 um/s in the organ. Larger: a slow motion of the body
stops short of its end. Smaller, or the speed of the fastest node instead: a sliver of some
milligrams that swings by micrometres after many cuts keeps the body from rest for seconds."""

FASTEST_AT_REST = 4.0
"""Speed of the fastest node up to which a body is nearly at rest, in node sizes per second: 0.02
m/s in the organ. Larger: a sliver that snaps is stopped; smaller: as above."""

MOTION_AT_REST = 0.003
"""Distance that a node may move while a body is nearly at rest, per node size: 14 um in the organ.
Larger: what creeps stops short of its end; smaller: as above."""

TIME_TO_REST = 0.25
"""Time for which a body is nearly at rest until it is at rest [s]. Shorter: a swing of some
micrometres, which is slow at its turning points, stops there, and a sag stops 40 nm short of its
end."""


@kernel
def may_rest(context: StepContext, drag: float) -> bool:
    """Return whether nothing acts that would move a body that is nearly at rest.

    Without drag nothing comes to rest. Stress that relaxes moves a body slowly for a long time.

    Args:
        context: What takes part.
        drag: Rate at which free motion dies away [1/s].
    """
    return drag > 0.0 and not relaxes(context.elastic.solid) and leave_at_rest(context)


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
def have_stayed(body: Body, kept: FloatArray, distance: float) -> bool:
    """Return whether no node is farther than `distance` [m] from where it was kept."""
    furthest = 0.0
    for i in range(body.n_nodes):
        moved = sub(vec3(body.positions, i), vec3(kept, i))
        furthest = max(furthest, dot(moved, moved))
    return bool(furthest <= distance * distance)


@kernel
def stop_nodes(context: StepContext) -> None:
    """Stop all nodes; damping has taken what kinetic energy was left."""
    body = context.body
    context.damping.dissipated += kinetic_energy(body)
    for i in range(body.n_nodes):
        store_point(body.velocities, i, point_of(0.0, 0.0, 0.0))
