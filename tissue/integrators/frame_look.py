"""`FrameLook`: how a body moves between two time steps, and what it was given so far."""

import math
from typing import NamedTuple

import numpy as np

from tissue.blade.edge import Edge
from tissue.blade.forces import edge_energy
from tissue.blade.side_contact import sides_energy
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, store, vec3
from tissue.elasticity.internal_forces import elastic_energy
from tissue.geometry.aabb import empty_box, with_point
from tissue.integrators.attachments import attached_energy
from tissue.integrators.step_context import StepContext


class FrameLook(NamedTuple):
    """A body between two time steps."""

    is_finite: bool
    """Whether all positions and velocities are finite numbers."""
    low: tuple[float, float, float]
    """Lowest corner of the box around its nodes [m]."""
    high: tuple[float, float, float]
    """Highest corner [m]."""
    fastest: float
    """Speed of its fastest node, fixed ones too [m/s]."""
    kinetic: float
    """Kinetic energy of the nodes that are not fixed [J]."""
    potential: float
    """Energy in gravity [J]."""
    work: float
    """Work of blade and supports so far [J]."""
    dissipated: float
    """What damping, cutting and friction took so far, as far as it is counted [J]."""


LOOK_NUMBERS = 12
"""Numbers that `write_look` writes."""


def look_of(numbers: FloatArray) -> FrameLook:
    """Return what `write_look` wrote."""
    finite, x0, y0, z0, x1, y1, z1, *others = numbers.tolist()
    return FrameLook(finite == 1.0, (x0, y0, z0), (x1, y1, z1), *others)


@kernel
def write_look(context: StepContext, out: FloatArray) -> None:
    """Look at the body; it costs one pass over the nodes.

    Args:
        context: The body and all that acts on it.
        out: Written as `look_of` reads it, shape (`LOOK_NUMBERS`,).
    """
    body, gravity = context.body, context.surroundings.gravity
    box, is_finite = empty_box(), True
    squared = kinetic = potential = 0.0
    for node in range(body.n_nodes):
        x, v = vec3(body.positions, node), vec3(body.velocities, node)
        speed_squared, mass = dot(v, v), body.masses[node]
        # A comparison with nan is false: min and max would overlook it.
        is_finite = is_finite and math.isfinite(x.x + x.y + x.z + speed_squared)
        box = with_point(box, x)
        squared = max(squared, speed_squared)
        kinetic += 0.0 if body.fixed[node] else 0.5 * mass * speed_squared
        potential -= (mass - body.added_masses[node]) * dot(gravity, x)
    corners = out[1:7].reshape(2, 3)
    store(corners, 0, box.low)
    store(corners, 1, box.high)
    totals, attachments = context.blade.totals, context.attachments
    out[0] = 1.0 if is_finite else 0.0
    out[7], out[8], out[9] = math.sqrt(squared), kinetic, potential
    out[10] = totals.work_of_blade + context.supports.work
    spent = totals.work_of_cutting + totals.work_of_breaking + totals.work_of_friction
    spent += attachments.dissipated + attachments.severing
    out[11] = context.damping.dissipated + spent


@kernel
def energy_in_springs(context: StepContext, edge: Edge, when: float) -> float:
    """Return the energy in the body's strain, and in all that holds and touches it [J].

    Args:
        context: The body and all that acts on it.
        edge: The cutting edge over a time step.
        when: Instant of it, as a fraction.
    """
    body, blade, attachments = context.body, context.blade, context.attachments
    held: float = edge_energy(blade, body, edge, when) + sides_energy(blade.sides)
    held += context.contacts.stored
    held += attached_energy(attachments, body.positions, 0, len(attachments.nodes))
    energy: float = elastic_energy(context.elastic, body) + held
    return energy


def room_for_look() -> FloatArray:
    """Return room for what `write_look` writes."""
    return np.zeros(LOOK_NUMBERS)
