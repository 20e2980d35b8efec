"""Elastic and viscous forces on a node.

The law of the material decides whether springs along the edges, tetrahedra as elements of a solid,
or both are elastic. Viscosity is that of dampers along the edges where springs act, else that of
tetrahedra (`tissue.elasticity.viscous_stress`).
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point, point_of, store_point, times
from tissue.core.sized import sized
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3
from tissue.elasticity.collapse import Collapsing
from tissue.elasticity.finite_elements import Solid
from tissue.elasticity.mass_scaling import MassScaling
from tissue.elasticity.neo_hookean import solid_force, solid_forces
from tissue.elasticity.springs import (
    Springs,
    damping_force,
    elastic_and_damping_force,
    elastic_force,
)
from tissue.elasticity.viscous_stress import Viscosity, is_viscous, viscous_corner_forces
from tissue.mesh.body import Body


class Elastic(Arrays, two_precisions=True):
    """All that forces inside the body are computed from."""

    springs: Springs
    """Springs along the edges, and dampers of their stiffness; empty without springs."""
    solid: Solid
    """Tetrahedra as elements; empty where springs alone are elastic."""
    viscosity: Viscosity
    """Resistance to their rate of deformation; empty where springs act, or without viscosity."""
    collapsing: Collapsing
    """Forces that keep tetrahedra from turning inside out where springs alone are elastic."""
    has_springs: IntCell
    """1 if springs along the edges pull, else 0."""
    has_tetrahedra: IntCell
    """1 if tetrahedra resist deformation, else 0."""
    highest: FloatCell
    """Bound on the square of every angular frequency so far [1/s2]: it never falls."""
    highest_of_tetrahedra: FloatCell
    """Bound on the square of the frequencies of tetrahedra alone so far [1/s2]."""
    highest_of_dampers: FloatCell
    """Bound on the square of the frequencies of springs alone so far [1/s2]: dampers along the
    edges have their stiffness."""
    scaling: MassScaling
    """Which nodes get mass where tetrahedra carry the shear."""
    frequency_squared: FloatArray = sized("nodes")
    """Bound on the square of the local angular frequency [1/s2], shape (nodes,)."""
    n_touching: IntCell
    """Number of nodes to whose w^2 contact adds, where tetrahedra resist deformation."""
    highest_touching: FloatCell
    """Bound on w^2 of these with their contacts [1/s2]."""
    allowed_touching: FloatCell
    """Bound above which they get mass [1/s2]."""
    touching: IntArray = sized("nodes")
    """These nodes, shape (nodes,)."""
    of_contact: FloatArray = sized("nodes")
    """Part of contact in w^2 of each node [1/s2], shape (nodes,); 0 where nothing touches it."""


class Surroundings(Arrays):
    """Gravity, and the damping of the motion."""

    gravity: Vec3
    """Acceleration of free fall [m/s2]."""
    drag: float
    """Rate at which free motion dies away [1/s]."""
    retardation_time: float
    """Viscosity per stiffness at rest, of springs or of tetrahedra [s]."""


@kernel
def damped_frequency(elastic: Elastic) -> float:
    """Return a bound on the rates of decay by viscosity, per retardation time [1/s2].

    It is that on w^2 of what is viscous.
    """
    if is_viscous(elastic.viscosity):
        return float(elastic.highest_of_tetrahedra)
    return float(elastic.highest_of_dampers)


@kernel
def deform(elastic: Elastic, body: Body, positions: FloatArray) -> None:
    """Evaluate all tetrahedra at `positions` [m], for `internal_force`."""
    if elastic.has_tetrahedra:
        solid_forces(elastic.solid, body, positions)


@inlined
def internal_force(
    elastic: Elastic,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Return the elastic and viscous force on a node [N], after `deform` at the same positions.

    Where tetrahedra are viscous, `keep_viscous_forces` was run before that, with the velocities.

    Args:
        elastic: Springs and elements.
        node: The node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        retardation_time: Viscosity per stiffness [s].
    """
    springs = elastic.springs
    total = point_of(0.0, 0.0, 0.0)
    if not elastic.has_springs:
        if retardation_time > 0.0:
            total = times(retardation_time, point(elastic.viscosity.force, node))
    elif retardation_time > 0.0:
        total = elastic_and_damping_force(springs, node, positions, velocities, retardation_time)
    else:
        total = elastic_force(springs, node, positions)
    if elastic.has_tetrahedra:
        total = total + solid_force(elastic.solid, node)
    return total


@inlined
def viscous_force(
    elastic: Elastic,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Return the viscous part of the force on a node [N], which is linear in the velocities.

    Where tetrahedra are viscous, after `resist` at the same positions and velocities.

    Args:
        elastic: What is viscous.
        node: The node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        retardation_time: Viscosity per stiffness [s].
    """
    if is_viscous(elastic.viscosity):
        return times(retardation_time, solid_force(elastic.solid, node))
    return damping_force(elastic.springs, node, positions, velocities, retardation_time)


@kernel
def resist(elastic: Elastic, body: Body, positions: FloatArray, velocities: FloatArray) -> None:
    """Evaluate how tetrahedra resist `velocities` [m/s] at `positions` [m], for `viscous_force`."""
    if is_viscous(elastic.viscosity):
        viscous_corner_forces(elastic.viscosity, elastic.solid, body, positions, velocities)


@kernel
def keep_viscous_forces(elastic: Elastic, body: Body) -> None:
    """Keep the viscous forces of tetrahedra for `internal_force`, after `resist`."""
    if is_viscous(elastic.viscosity):
        for i in range(body.n_nodes):
            store_point(elastic.viscosity.force, i, solid_force(elastic.solid, i))


@kernel
def bound_both_frequencies(elastic: Elastic, nodes: IntArray, n: int) -> None:
    """Write the bound on w^2 at the first `n` of `nodes`: that of springs plus that of elements."""
    for i in range(n):
        node = nodes[i]
        bound = 0.0
        if elastic.has_springs:
            bound += elastic.springs.frequency_squared[node]
        if elastic.has_tetrahedra:
            bound += elastic.solid.frequency_squared[node]
        elastic.frequency_squared[node] = bound
