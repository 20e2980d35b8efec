"""What makes tissue elastic and viscous: springs, and dampers along the same edges."""

from typing import NamedTuple

from tissue.arrays import Arrays
from tissue.jit import inlined
from tissue.simd import Point, point_of
from tissue.spring_forces import damping_force, elastic_and_damping_force, elastic_force
from tissue.springs import Springs
from tissue.types import FloatArray
from tissue.vec3 import Vec3


class Elastic(Arrays):
    """All that forces inside the body follow from."""

    springs: Springs


class Surroundings(NamedTuple):
    """What slows and pulls every node besides its neighbours."""

    gravity: Vec3
    """[m/s2]."""
    drag: float
    """Rate at which free motion dies away [1/s]."""
    retardation_time: float
    """Damping along each edge, per its stiffness [s]."""


@inlined
def internal_force(
    elastic: Elastic,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Force of the body on one of its nodes, elastic and viscous [N]."""
    if retardation_time == 0.0:
        return elastic_force(elastic.springs, node, positions)
    return elastic_and_damping_force(elastic.springs, node, positions, velocities, retardation_time)


@inlined
def viscous_force(
    elastic: Elastic,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """The viscous part of it [N]; linear in the velocities."""
    if retardation_time == 0.0:
        return point_of(0.0, 0.0, 0.0)
    return damping_force(elastic.springs, node, positions, velocities, retardation_time)
