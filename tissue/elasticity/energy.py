"""Energies stored in the body, and the power that damping dissipates."""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import store_point
from tissue.core.vec3 import Vec3, dot, vec3
from tissue.elasticity.internal_forces import Elastic, Surroundings, elastic_energy, viscous_force
from tissue.mesh.body import Body


@kernel
def kinetic_energy(body: Body) -> float:
    """Return the kinetic energy of the nodes that are not fixed [J]."""
    energy = 0.0
    for node in range(body.n_nodes):
        if body.fixed[node]:  # its motion is that of its support
            continue
        v = vec3(body.velocities, node)
        energy += 0.5 * body.masses[node] * dot(v, v)
    return energy


@kernel
def potential_energy(body: Body, gravity: Vec3) -> float:
    """Return the potential energy of all nodes in gravity [J]."""
    energy = 0.0
    for node in range(body.n_nodes):
        weight = body.masses[node] - body.added_masses[node]
        energy -= weight * dot(gravity, vec3(body.positions, node))
    return energy


@kernel
def body_energy(body: Body, elastic: Elastic, gravity: Vec3) -> float:
    """Return the sum of elastic, kinetic and potential energy [J]."""
    stored = elastic_energy(elastic, body) + kinetic_energy(body)
    return stored + potential_energy(body, gravity)


@kernel
def dissipated_power(
    body: Body,
    elastic: Elastic,
    surroundings: Surroundings,
    positions: FloatArray,
    velocities: FloatArray,
    scratch: FloatArray,
) -> float:
    """Return the power that viscosity and drag dissipate [W].

    Args:
        body: Masses and fixed nodes.
        elastic: The dampers.
        surroundings: Drag and retardation time.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        scratch: Overwritten; shaped as positions.
    """
    time = surroundings.retardation_time
    power = 0.0
    for node in range(body.n_nodes):
        v = vec3(velocities, node)
        if not body.fixed[node]:
            power += surroundings.drag * body.masses[node] * dot(v, v)
        if time > 0.0:
            force = viscous_force(elastic, node, positions, velocities, time)
            store_point(scratch, node, force)
            power -= dot(vec3(scratch, node), v)
    return power
