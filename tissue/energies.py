"""What is stored in the body and between it and the blade, and what damping takes."""

from tissue.anchors import (
    ANCHORED,
    Anchors,
    Edge,
    anchor_position,
    edge_frame,
    sample_point,
    stored_energy,
)
from tissue.body import NODES, Body
from tissue.elastic import Elastic, Surroundings, elastic_energy, viscous_force
from tissue.flanks import Flanks
from tissue.jit import kernel
from tissue.resistance import Resistance
from tissue.simd import store_point
from tissue.types import FloatArray
from tissue.vec3 import Vec3, dot, sub, vec3


@kernel
def kinetic_energy(body: Body) -> float:
    """Of all nodes [J]."""
    energy = 0.0
    for node in range(body.counts[NODES]):
        v = vec3(body.velocities, node)
        energy += 0.5 * body.masses[node] * dot(v, v)
    return energy


@kernel
def potential_energy(body: Body, gravity: Vec3) -> float:
    """Of all nodes in gravity [J]."""
    energy = 0.0
    for node in range(body.counts[NODES]):
        energy -= body.masses[node] * dot(gravity, vec3(body.positions, node))
    return energy


@kernel
def body_energy(body: Body, elastic: Elastic, gravity: Vec3) -> float:
    """Elastic, kinetic and potential energy [J]."""
    stored = elastic_energy(elastic, body) + kinetic_energy(body)
    return stored + potential_energy(body, gravity)


@kernel
def anchors_energy(
    anchors: Anchors, body: Body, edge: Edge, when: float, resistance: Resistance
) -> float:
    """Stored in what the edge holds at an instant of the time step [J]."""
    n = len(anchors.state)
    frame = edge_frame(edge, when)
    energy = 0.0
    for k in range(n):
        if anchors.state[k] == ANCHORED:
            a = anchor_position(anchors, body, body.positions, k)
            d = sub(sample_point(edge, k, n, when), a)
            if dot(d, frame[1]) >= 0.0:
                energy += stored_energy(anchors, k, d, frame, resistance)
    return energy


@kernel
def flanks_energy(flanks: Flanks) -> float:
    """Stored between the faces of the blade and the tissue, when it gave way last [J]."""
    energy = 0.0
    for i in range(flanks.count[0]):
        energy += flanks.energy[i]
    return energy


@kernel
def dissipated_power(
    body: Body,
    elastic: Elastic,
    surroundings: Surroundings,
    positions: FloatArray,
    velocities: FloatArray,
    scratch: FloatArray,
) -> float:
    """What viscosity and drag take at that motion [W]; `scratch` has the shape of positions."""
    time = surroundings.retardation_time
    power = 0.0
    for node in range(body.counts[NODES]):
        if body.fixed[node]:
            continue
        v = vec3(velocities, node)
        power += surroundings.drag * body.masses[node] * dot(v, v)
        if time > 0.0:
            force = viscous_force(elastic, node, positions, velocities, time)
            store_point(scratch, node, force)
            power -= dot(vec3(scratch, node), v)
    return power
