"""What an integrator calls: the blade's forces on the nodes, slip after a step, and stiffness."""

from tissue.blade.anchors import (
    add_anchor_stiffness,
    anchors_energy,
    clear_anchor_forces,
    highest_anchor_frequency,
    measure_speeds,
)
from tissue.blade.blade_state import BladeState
from tissue.blade.blunt_contact import blunt_energy, measure_tip_speeds
from tissue.blade.blunt_forces import (
    add_blunt_stiffness,
    apply_blunt_forces,
    clear_blunt_forces,
    highest_blunt_frequency,
    slip_blunt_sides,
)
from tissue.blade.blunt_search import release_blunt_sides
from tissue.blade.edge import Edge, is_sound, motion_at, pose_at
from tissue.blade.edge_forces import apply_edge_forces
from tissue.blade.impulse_totals import clear_impulses
from tissue.blade.return_mapping import slip_anchors
from tissue.blade.side_forces import (
    add_side_stiffness,
    apply_side_forces,
    apply_sliding,
    clear_side_forces,
    highest_side_frequency,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.mesh.body import Body
from tissue.mesh.star import Visits


@kernel
def edge_energy(blade: BladeState, body: Body, edge: Edge, when: float) -> float:
    """Return the energy stored in the edge and the blunt sides at an instant of a time step [J]."""
    pose, law = pose_at(edge, when), blade.toughness
    return anchors_energy(blade.anchors, body, pose, law) + blunt_energy(
        blade.blunt, body, pose, law
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
    if blade.toughness.exponent == 0.0:  # then speed does not change the energy
        measure_speeds(anchors, edge, dt)
        return True
    before = edge_energy(blade, body, edge, 0.0)
    measure_speeds(anchors, edge, dt)
    measure_tip_speeds(blade.blunt, edge, dt)
    # A slower edge has a lower yield limit: the energy beyond it is spent on the next slip.
    after = edge_energy(blade, body, edge, 0.0)
    blade.totals.work_of_breaking += before - after
    return True


@kernel
def clear_blade_forces(blade: BladeState, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes that the blade acts on to zero: all others are zero."""
    clear_anchor_forces(blade.anchors, body, external)
    clear_side_forces(blade.sides, external)
    clear_blunt_forces(blade.blunt, body, external)


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
    apply_side_forces(blade, motion, positions, share, dt, external)
    apply_blunt_forces(blade, body, motion, positions, share, dt, external)


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
    slip_blunt_sides(blade, body, visits, pose)


@kernel
def release_edge(blade: BladeState, body: Body, edge: Edge, when: float) -> None:
    """Count the energy of all anchors and blunt sides as released: the blade is taken away."""
    pose, law = pose_at(edge, when), blade.toughness
    blade.totals.released += anchors_energy(blade.anchors, body, pose, law)
    release_blunt_sides(blade)


@kernel
def frequency_with_blade(
    blade: BladeState, body: Body, frequency_squared: FloatArray, scratch: FloatArray
) -> float:
    """Return a bound on w^2 [1/s2] over the nodes that the blade acts on: body and blade together.

    `scratch`, shape (capacity, 3), must be zero at those nodes and is so again afterwards.
    """
    add_anchor_stiffness(blade.anchors, body, scratch)
    add_side_stiffness(blade.sides, scratch)
    add_blunt_stiffness(blade.blunt, body, scratch)
    worst = max(
        highest_anchor_frequency(blade.anchors, body, frequency_squared, scratch),
        highest_side_frequency(blade.sides, body, frequency_squared, scratch),
        highest_blunt_frequency(blade.blunt, body, frequency_squared, scratch),
    )
    clear_blade_forces(blade, body, scratch)
    return worst
