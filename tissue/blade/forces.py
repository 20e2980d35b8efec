"""The blade's forces on the nodes, slip after a step, stiffness, and mass scaling at the blade."""

from tissue.blade.anchor_materials import is_in_other_material, take_material
from tissue.blade.blade_state import BladeState, clear_impulses
from tissue.blade.edge import Edge, is_sound, motion_at, pose_at
from tissue.blade.edge_anchors import (
    ANCHORED,
    anchors_energy,
    holding_node,
    measure_toughening,
    n_holding_nodes,
)
from tissue.blade.edge_forces import (
    add_anchor_stiffness,
    apply_edge_forces,
    clear_anchor_forces,
    highest_anchor_frequency,
)
from tissue.blade.faces_forces import (
    add_face_stiffness,
    apply_face_forces,
    apply_sliding,
    clear_face_forces,
    highest_face_frequency,
)
from tissue.blade.return_mapping import slip_anchors
from tissue.blade.spine_contact import PRESSING, measure_tip_speeds, spine_energy
from tissue.blade.spine_forces import (
    add_spine_stiffness,
    apply_spine_forces,
    clear_spine_forces,
    highest_spine_frequency,
    slip_spine,
)
from tissue.blade.spine_search import release_spine
from tissue.blade.toughness import depends_on_speed
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.elasticity.frequency.strained import limited_frequency
from tissue.elasticity.internal_forces import Elastic
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

LIMIT_AT_BLADE = 0.5
"""The limit of w^2 at the blade, as a share of that elsewhere. In the organ's stroke the account of
energy left 0.77 % at 1.0, 0.57 % at 0.7 and 0.38 % at 0.5 with two Runge-Kutta steps a millisecond,
and -1.31 % and -0.72 % at 1.0 and 0.5 with four of Verlet; lower, nodes get more mass."""


@kernel
def edge_energy(blade: BladeState, body: Body, edge: Edge, when: float) -> float:
    """Return the energy stored in the edge and the blunt sides at an instant of a time step [J]."""
    pose, law = pose_at(edge, when), blade.toughness
    return anchors_energy(blade.anchors, body, pose, law) + spine_energy(
        blade.spine, body, pose, law
    )


@kernel
def begin_blade_step(
    blade: BladeState, body: Body, edge: Edge, dt: float, is_checked: bool
) -> bool:
    """Begin to count impulse and area; measure how fast the edge moves in this step.

    Args:
        blade: Written.
        body: The tissue.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        is_checked: Whether it is known that a blade can move so.

    Returns:
        Whether one can (`tissue.blade.edge.is_sound`); if not, nothing changes.
    """
    if not is_checked and not is_sound(edge):
        return False
    anchors = blade.anchors
    clear_impulses(blade.totals)
    for k in range(len(anchors.state)):
        anchors.cut[k] = 0.0
    law = blade.toughness
    is_other = is_in_other_material(anchors, body, law)
    if not depends_on_speed(law) and not is_other:  # then nothing changes the energy
        measure_toughening(anchors, body, edge, dt, law)
        return True
    before = edge_energy(blade, body, edge, 0.0)
    measure_toughening(anchors, body, edge, dt, law)
    if is_other:
        for k in range(len(anchors.state)):
            take_material(anchors, body, law, k)
    measure_tip_speeds(blade.spine, edge, dt)
    # A slower edge, and softer tissue, have a lower yield limit: the energy beyond it is spent on
    # the next slip.
    after = edge_energy(blade, body, edge, 0.0)
    blade.totals.work_of_breaking += before - after
    return True


@kernel
def clear_blade_forces(blade: BladeState, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes that the blade acts on to zero: all others are zero."""
    clear_anchor_forces(blade.anchors, body, external)
    clear_face_forces(blade.sides, external)
    clear_spine_forces(blade.spine, body, external)


@kernel
def apply_blade_forces(
    blade: BladeState,
    body: Body,
    edge: Edge,
    positions: FloatArray,
    when: float,
    share: float,
    dt: float,
    external: FloatArray,
) -> None:
    """Write the blade's forces on the nodes, and count impulse and work.

    Args:
        blade: Its totals are written.
        body: The tissue.
        edge: The cutting edge over the time step.
        positions: Positions of the nodes [m].
        when: Instant, as a fraction of the time step.
        share: Weight of this evaluation in the integral over the step; they add up to 1.
        dt: Length of the time step [s].
        external: Forces on the nodes [N], shape (capacity, 3); cleared first.
    """
    clear_blade_forces(blade, body, external)
    motion = motion_at(edge, when)
    apply_edge_forces(blade, body, motion, positions, share, dt, external)
    apply_face_forces(blade, motion, positions, share, dt, external)
    apply_spine_forces(blade, body, motion, positions, share, dt, external)


@kernel
def apply_slip(
    blade: BladeState,
    body: Body,
    visits: Visits,
    edge: Edge,
    external: FloatArray,
    when: float,
    seconds: float,
) -> None:
    """Apply plastic slip at the edge and frictional sliding on the faces, after a step.

    Args:
        blade: Anchors, side contacts and totals are written.
        body: The tissue.
        visits: For searches.
        edge: The cutting edge over the time step.
        external: Forces on the nodes [N], shape (capacity, 3); the blade's are cleared.
        when: Instant, as a fraction of the time step.
        seconds: Time since the last call [s].
    """
    clear_blade_forces(blade, body, external)  # before anchors move to other nodes
    pose = pose_at(edge, when)
    slip_anchors(blade, body, visits, pose, seconds)
    apply_sliding(blade, pose, body.positions, seconds)
    slip_spine(blade, body, visits, pose)


@kernel
def release_edge(blade: BladeState, body: Body, edge: Edge, when: float) -> None:
    """Count the energy of all anchors and blunt sides as released: the blade is taken away."""
    pose, law = pose_at(edge, when), blade.toughness
    blade.totals.released += anchors_energy(blade.anchors, body, pose, law)
    release_spine(blade)


@kernel
def frequency_with_blade(
    blade: BladeState, body: Body, frequency_squared: FloatArray, scratch: FloatArray
) -> float:
    """Return a bound on w^2 [1/s2] over the nodes that the blade acts on: body and blade together.

    `scratch`, shape (capacity, 3), must be zero at those nodes and is so again afterwards.
    """
    add_anchor_stiffness(blade.anchors, body, scratch)
    add_face_stiffness(blade.sides, scratch)
    add_spine_stiffness(blade.spine, body, scratch)
    worst = max(
        highest_anchor_frequency(blade.anchors, body, frequency_squared, scratch),
        highest_face_frequency(blade.sides, body, frequency_squared, scratch),
        highest_spine_frequency(blade.spine, body, frequency_squared, scratch),
    )
    clear_blade_forces(blade, body, scratch)
    return worst


@kernel
def limit_frequency_at_blade(
    blade: BladeState, elastic: Elastic, body: Body, scratch: FloatArray
) -> float:
    """Add mass to nodes that body and blade together make faster than the limit.

    Args:
        blade: Anchors and side contacts.
        elastic: The bounds at rest, and what nodes have got; written.
        body: Masses and velocities are written.
        scratch: Zero at the nodes that the blade acts on, and so again afterwards, shape
            (capacity, 3).

    Returns:
        A bound on w^2 [1/s2] over the nodes that the blade acts on.
    """
    anchors, sides, spine = blade.anchors, blade.sides, blade.spine
    add_anchor_stiffness(anchors, body, scratch)
    add_face_stiffness(sides, scratch)
    add_spine_stiffness(spine, body, scratch)
    worst = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            for i in range(n_holding_nodes(anchors, k)):
                node = holding_node(anchors, body, k, i)
                worst = max(worst, _limited(elastic, body, scratch, node))
    for i in range(sides.n_faces):
        for corner in range(3):
            worst = max(worst, _limited(elastic, body, scratch, sides.node[i, corner]))
    if spine.n_pressing > 0:
        for k in range(len(spine.state)):
            if spine.state[k] >= PRESSING:
                for q in range(4):
                    node = body.tetrahedra[spine.tetrahedron[k], q]
                    worst = max(worst, _limited(elastic, body, scratch, node))
    clear_blade_forces(blade, body, scratch)
    return worst


@kernel
def _limited(elastic: Elastic, body: Body, stiffness: FloatArray, node: int) -> float:
    """Return the bound on w^2 at a node [1/s2], after it got mass where that is needed.

    What contact adds to it takes part in the limit of the body, and not in that at the blade.
    """
    if body.fixed[node]:
        return 0.0
    own, most = elastic.frequency_squared[node], elastic.scaling.allowed_between_cuts
    bound = own + stiffness[node, 0] / body.masses[node]
    left = max(most, elastic.allowed_touching) - elastic.of_contact[node]
    allowed = min(LIMIT_AT_BLADE * most, max(left, own))
    limited: float = limited_frequency(elastic, body, node, bound, allowed)
    limited += elastic.of_contact[node]
    return limited
