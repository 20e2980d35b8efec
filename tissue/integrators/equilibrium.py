"""Equilibrium by dynamic relaxation with kinetic damping.

The nodes are stopped whenever their kinetic energy has passed a peak: a body that swings is stopped
where it goes fastest, near the equilibrium. Source: Cundall (1976), for the method; Topping and
Khan (1994) for kinetic damping.
"""

import math

import numpy as np

from tissue.blade.edge import Edge
from tissue.elasticity.strained_frequency import StepLimit
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.runge_kutta import accelerations
from tissue.integrators.stability import stable_step
from tissue.integrators.step_context import Increment
from tissue.integrators.system import System

SETTLED = 1e-3
"""Acceleration at which the body counts as settled, in units of 9.81 m/s2."""
ROUNDING = 10.0 * 2.0**-24
"""Part of a displacement that single precision makes of it, up to the force on a node. Measured 7
times 2^-24 in the organ, where accelerations fall to 0.01 to 0.03 m/s2 and no further."""
QUIET = 200
"""Evaluations in a row at which accelerations are mere rounding, until the body counts as settled:
800 steps, in which slow motion comes to rest below the rounding. The organ is then 0.4 um from
where it would be at last; after a quarter of these steps 25 um."""
LONGEST_SETTLING = 20_000
"""Runge-Kutta steps after which to give up waiting."""
STEPS_BETWEEN_PEAKS = 4
"""Runge-Kutta steps between two evaluations of the kinetic energy."""


def settle(stepper: GlobalStepper, system: System, edge: Edge) -> int:
    """Relax to equilibrium; return the steps that it took. Supports that move stop.

    Args:
        stepper: Moves all nodes.
        system: Body, forces and contact.
        edge: The edge of no blade.
    """
    body, elasticity = system.body, system.elasticity
    n, energy, n_quiet = body.n_nodes, 0.0, 0
    velocities, masses = body.velocities[:n], body.masses[:n, None]
    velocities[body.fixed[:n]] = 0.0
    system.supports.is_moving = 0
    for done in range(0, LONGEST_SETTLING, STEPS_BETWEEN_PEAKS):
        at_rest = elasticity.frequency_squared
        limit = StepLimit(at_rest, 0.0, 0)
        strained = elasticity.strained_frequency_squared(body, system.visits, limit)
        highest = max(at_rest, strained) + system.contact.added_frequency_squared
        arrays, around = elasticity.arrays, system.surroundings
        step = stable_step(stepper.method.limit, arrays, highest, around)
        dt = STEPS_BETWEEN_PEAKS * step
        system.contact.begin()
        system.find_contacts(dt)
        velocities_t0 = velocities.copy()
        stepper.take_steps(system, Increment(edge, dt, 0.0, 1.0), STEPS_BETWEEN_PEAKS)
        system.relax_stress(math.inf)
        if system.contact.is_awake:  # what holds a body on the floor is not in its forces
            largest = np.abs(velocities - velocities_t0).max() / dt
        else:
            a = system.stages.a1
            accelerations(system.context, a)
            largest = np.abs(a[:n]).max()
        before, energy = energy, float((masses * velocities**2).sum())
        if energy < before:
            velocities[:] = 0.0
            energy = 0.0
        n_quiet = n_quiet + 1 if largest < _rounding(system, highest) else 0
        if largest < SETTLED * 9.81 or n_quiet == QUIET:
            velocities[:] = 0.0
            return done + STEPS_BETWEEN_PEAKS
    return LONGEST_SETTLING


def _rounding(system: System, frequency_squared: float) -> float:
    """Return the acceleration that is made by the rounding of displacements [m/s2].

    Args:
        system: The body.
        frequency_squared: Its highest w^2 [1/s2].
    """
    if not system.elasticity.is_single:
        return 0.0
    body, n = system.body, system.body.n_nodes
    moved = float(np.abs(body.positions[:n] - body.rest[:n]).max())
    return ROUNDING * moved * frequency_squared
