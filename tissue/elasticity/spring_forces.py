"""Forces of springs and dampers on a node: its row, eight slots at a time.

Each spring is evaluated at both its ends, with the same bits, so that action is reaction. The sum
at a node is taken in the order of its row, on any thread.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined
from tissue.core.simd import (
    WIDTH,
    Point,
    eight_points,
    lanes,
    load_lanes,
    square_root,
    summed,
    times,
)
from tissue.elasticity.springs import Springs

NO_LENGTH = 1e-300
"""Added to squared lengths [m2], far below any: it prevents division by zero in slots without a
spring and between nodes that coincide."""


@inlined
def elastic_force(springs: Springs, node: int, positions: FloatArray) -> Point:
    """Return the pull of the springs on a node [N]: the sum of k (l - l0) along each."""
    x, y, z = lanes(positions[node, 0]), lanes(positions[node, 1]), lanes(positions[node, 2])
    fx = fy = fz = lanes(0.0)
    slot = springs.first[node]
    end = slot + springs.count[node]
    while slot < end:
        dx, dy, dz = eight_points(positions, springs.neighbour, slot)
        dx, dy, dz = dx - x, dy - y, dz - z
        length = square_root(dx * dx + dy * dy + dz * dz + lanes(NO_LENGTH))
        pull = load_lanes(springs.stiffness, slot) - load_lanes(springs.rest_pull, slot) / length
        fx, fy, fz = fx + pull * dx, fy + pull * dy, fz + pull * dz
        slot += WIDTH
    return summed(fx, fy, fz)


@inlined
def damping_force(
    springs: Springs,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Return the force of the dampers on a node [N]: retardation time times k l' along each spring.

    Args:
        springs: The rows.
        node: The node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        retardation_time: Viscosity per stiffness [s].
    """
    x, y, z = lanes(positions[node, 0]), lanes(positions[node, 1]), lanes(positions[node, 2])
    u, v, w = lanes(velocities[node, 0]), lanes(velocities[node, 1]), lanes(velocities[node, 2])
    fx = fy = fz = lanes(0.0)
    slot = springs.first[node]
    end = slot + springs.count[node]
    while slot < end:
        dx, dy, dz = eight_points(positions, springs.neighbour, slot)
        dx, dy, dz = dx - x, dy - y, dz - z
        du, dv, dw = eight_points(velocities, springs.neighbour, slot)
        approach = (du - u) * dx + (dv - v) * dy + (dw - w) * dz
        squared = dx * dx + dy * dy + dz * dz + lanes(NO_LENGTH)
        pull = load_lanes(springs.stiffness, slot) * approach / squared
        fx, fy, fz = fx + pull * dx, fy + pull * dy, fz + pull * dz
        slot += WIDTH
    return times(retardation_time, summed(fx, fy, fz))


@inlined
def elastic_and_damping_force(
    springs: Springs,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Return the sum of `elastic_force` and `damping_force` [N], in one pass over the row.

    Args:
        springs: The rows.
        node: The node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        retardation_time: Viscosity per stiffness [s].
    """
    x, y, z = lanes(positions[node, 0]), lanes(positions[node, 1]), lanes(positions[node, 2])
    u, v, w = lanes(velocities[node, 0]), lanes(velocities[node, 1]), lanes(velocities[node, 2])
    time, one = lanes(retardation_time), lanes(1.0)
    fx = fy = fz = lanes(0.0)
    slot = springs.first[node]
    end = slot + springs.count[node]
    while slot < end:
        dx, dy, dz = eight_points(positions, springs.neighbour, slot)
        dx, dy, dz = dx - x, dy - y, dz - z
        du, dv, dw = eight_points(velocities, springs.neighbour, slot)
        approach = (du - u) * dx + (dv - v) * dy + (dw - w) * dz
        inverse = one / square_root(dx * dx + dy * dy + dz * dz + lanes(NO_LENGTH))
        stiffness = load_lanes(springs.stiffness, slot)
        pull = stiffness - load_lanes(springs.rest_pull, slot) * inverse
        pull = pull + stiffness * (time * approach * inverse * inverse)
        fx, fy, fz = fx + pull * dx, fy + pull * dy, fz + pull * dz
        slot += WIDTH
    return summed(fx, fy, fz)
