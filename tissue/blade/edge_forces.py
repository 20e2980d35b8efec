"""Forces of the cutting edge on the nodes."""

from tissue.blade.blade_state import (
    BladeState,
    add_reaction,
    add_to_node,
    running_totals,
    store_totals,
)
from tissue.blade.edge import (
    BladeMotion,
    displacement_of,
)
from tissue.blade.edge_anchors import (
    ANCHORED,
    Anchors,
    anchor_position,
    holding_node,
    holding_weight,
    n_holding_nodes,
    pulling_point,
    surplus_stretch,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import axpy, dot, scale, store, sub, vec3
from tissue.mesh.body import Body


@kernel
def apply_edge_forces(
    blade: BladeState,
    body: Body,
    motion: BladeMotion,
    positions: FloatArray,
    share: float,
    dt: float,
    external: FloatArray,
) -> None:
    """Add the forces of the anchors to those on the nodes; count impulse and work.

    No anchor pulls harder than its yield limit, not even within a Runge-Kutta step.

    Args:
        blade: Its totals are written.
        body: The tissue.
        motion: Pose and motion of the blade.
        positions: Positions of the nodes [m].
        share: Weight of this evaluation in the integral over the step; they add up to 1.
        dt: Length of the time step [s].
        external: Forces on the nodes [N], shape (capacity, 3).
    """
    anchors, pose = blade.anchors, motion.pose
    n = len(anchors.state)
    seconds = share * dt
    running = running_totals(blade.totals)
    for k in range(n):
        if anchors.state[k] != ANCHORED:
            continue
        b = pulling_point(anchors, pose, k)
        stretch = sub(b, anchor_position(anchors, body, positions, k))
        if dot(stretch, pose.forward) < 0.0:
            continue  # backed off: an edge pushes, and does not pull
        surplus = surplus_stretch(anchors, k, stretch, pose, blade.toughness)
        force = scale(anchors.stiffness[k], sub(stretch, surplus))
        store(anchors.impulse, k, axpy(seconds, force, vec3(anchors.impulse, k)))
        for i in range(n_holding_nodes(anchors, k)):
            node, weight = holding_node(anchors, body, k, i), holding_weight(anchors, k, i)
            running = add_to_node(external, running, node, weight, force, seconds)
        # The surplus is about to slip and bears no force: without it the force points from the
        # anchor to the blade, so that the torques on the two cancel as well.
        at = sub(b, surplus)
        running = add_reaction(running, at, force, displacement_of(motion, at), share, seconds)
    store_totals(blade.totals, running)


@kernel
def clear_anchor_forces(anchors: Anchors, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes that anchors pull on to zero."""
    before = -1
    for k in range(len(anchors.state)):
        t = anchors.tetrahedron[k]
        if anchors.state[k] != ANCHORED or (t == before and anchors.coarse.share[k] == 0.0):
            continue
        before = t
        for i in range(n_holding_nodes(anchors, k)):
            node = holding_node(anchors, body, k, i)
            external[node, 0] = external[node, 1] = external[node, 2] = 0.0


@kernel
def add_anchor_stiffness(anchors: Anchors, body: Body, stiffness: FloatArray) -> None:
    """Add the anchors' rows to `stiffness` [N/m], shape (capacity, 3), of which x is used.

    Gershgorin's bound: anchor K adds K |w_i| sum |w| to the row of node i.
    """
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            total = 0.0
            for i in range(n_holding_nodes(anchors, k)):
                total += abs(holding_weight(anchors, k, i))
            for i in range(n_holding_nodes(anchors, k)):
                node = holding_node(anchors, body, k, i)
                row = anchors.stiffness[k] * abs(holding_weight(anchors, k, i)) * total
                stiffness[node, 0] += row


@kernel
def highest_anchor_frequency(
    anchors: Anchors, body: Body, frequency_squared: FloatArray, stiffness: FloatArray
) -> float:
    """Return a bound on w^2 [1/s2] over the nodes that anchors pull on.

    It is that of the body, `frequency_squared`, and of `stiffness` together.
    """
    worst = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            for i in range(n_holding_nodes(anchors, k)):
                node = holding_node(anchors, body, k, i)
                if not body.fixed[node]:
                    own = frequency_squared[node] + stiffness[node, 0] / body.masses[node]
                    worst = max(worst, own)
    return worst
