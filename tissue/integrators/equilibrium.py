"""Equilibrium by dynamic relaxation with viscous damping that is found meanwhile.

All nodes are damped as is critical for the slowest mode in which they still move. Its frequency is
Rayleigh's quotient of the path of the last steps: masses times what the accelerations changed by on
it. Sources: Day (1965) for the method; Papadrakakis (1981) and Underwood (1983) for the damping.
"""

import math
from typing import NamedTuple

import numpy as np

from tissue.blade.edge import Edge
from tissue.core.array_types import FloatArray
from tissue.elasticity.frequency.strained import StepLimit
from tissue.forces.step_context import Increment
from tissue.forces.terms import accelerations
from tissue.integrators.equilibrium_checks import (
    SupportConditions,
    fastest_node,
    gone_too_far,
    restless,
)
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.integrator import UnstableError, not_finite
from tissue.integrators.model import TissueModel
from tissue.integrators.stability import stable_step
from tissue.types import TissueError

SETTLED = 1e-4 * 9.81
"""Acceleration at which the body counts as settled [m/s2]. Cubes, bars and the organ are then
within 0.05 % of their sag from rest; at ten times as much within 0.5 %, after 2/3 of the steps."""
RESTLESS = 0.9 * 9.81
"""Acceleration above which a body that has not settled is refused [m/s2]: what pulls as hard as its
weight, after all these steps, falls, and is no slow rest of its motion."""
ROUNDING = 10.0 * 2.0**-24
"""Part of a displacement that single precision makes of it, up to the force on a node. Measured 7
times 2^-24 in the organ, where accelerations fall to 0.01 to 0.03 m/s2 and no further."""
QUIET = 200
"""Tests in a row at which accelerations are mere rounding, until the body counts as settled: 800
steps, in which slow motion comes to rest below the rounding. The organ is then 0.2 um from where it
would be in the end."""
LONGEST_SETTLING = 20_000
"""Steps after which to give up waiting."""
STEPS_BETWEEN_TESTS = 4
"""Steps between two evaluations of the forces, from which the damping follows. It acts after each
step: after each fourth it would meet what turns round meanwhile always at one phase, and at that
without velocity the motion would never end."""
STEPS_BETWEEN_CHECKS = 1000
"""Steps between two checks that no part of the body falls away."""
DISTURBANCE = 1e-3
"""Displacement by which a node leaves an equilibrium that is not stable, per mean node size:
in one where disturbances grow at 20 /s it is then accelerated by more than `SETTLED`."""
FARTHEST_HELD = 10.0
"""Longest way of a node, per diagonal of the box around the body; beyond, it is not held."""


class Motion(NamedTuple):
    """Motion of a body after some steps."""

    accelerations: FloatArray
    """Accelerations of its nodes but for damping [m/s2], shape (n_nodes, 3)."""
    frequency_squared: float
    """Bound on w^2 of the body as it is strained, with its contacts [1/s2]."""


class Settling(NamedTuple):
    """Account of a body that came to rest."""

    n_steps: int
    """Steps that it took."""
    is_at_rest: bool
    """Whether it is at rest; if not, this was not long enough."""
    accelerations: FloatArray
    """Accelerations of its nodes at the end [m/s2], shape (n_nodes, 3)."""


def settle(
    stepper: GlobalStepper, system: TissueModel, edge: Edge, support: SupportConditions
) -> Settling:
    """Relax to equilibrium. Supports that move stop.

    Args:
        stepper: Moves all nodes.
        system: Body, forces and contact; the loads are in its stages.
        edge: The edge of no blade.
        support: What the body comes to rest on, for what is said where it does not.

    Raises:
        TissueError: a part of the body is held by nothing, the motion became unstable, or it is
            faster than `RESTLESS` in the end. All nodes are then where they were, and stopped.
    """
    body, n = system.body, system.body.n_nodes
    velocities, begin = body.velocities[:n], body.positions[:n].copy()
    velocities[body.fixed[:n]] = 0.0
    system.supports.is_moving = 0
    if body.fixed[:n].all():
        system.relax_stress(math.inf)
        return Settling(0, True, np.zeros((n, 3)))
    try:
        with system.without_drag():
            return _relax(stepper, system, edge, support)
    except TissueError as error:
        body.positions[:n] = begin
        velocities[:] = 0.0
        if isinstance(error, UnstableError):
            raise TissueError(
                f"the body cannot come to rest: {error.fault}: {support.remedy}"
            ) from error
        raise


def _relax(
    stepper: GlobalStepper, system: TissueModel, edge: Edge, support: SupportConditions
) -> Settling:
    """Move the nodes until they are at rest, or for `LONGEST_SETTLING` steps."""
    body, n, rate = system.body, system.body.n_nodes, 0.0
    masses = body.masses[:n, None] * ~body.fixed[:n, None]
    watch, before = _Watch(system, support), np.zeros((n, 3))
    for done in range(0, LONGEST_SETTLING, STEPS_BETWEEN_TESTS):
        positions_t0 = body.positions[:n].copy()
        motion = _take_steps(stepper, system, edge, rate)
        moved, change = body.positions[:n] - positions_t0, motion.accelerations - before
        if done > 0:
            rate = _frequency(masses, moved, change)
        before = motion.accelerations
        if watch.is_at_rest(motion, done + STEPS_BETWEEN_TESTS):
            body.velocities[:n] = 0.0
            return Settling(done + STEPS_BETWEEN_TESTS, True, before)
        if done == 0:
            _disturb(system)
    fastest = fastest_node(system, before)
    if fastest.acceleration > RESTLESS:
        raise restless(system, fastest, watch.begin[fastest.node], LONGEST_SETTLING, support)
    return Settling(LONGEST_SETTLING, False, before)


def _disturb(system: TissueModel) -> None:
    """Move every free node but those of cores a little, always by the same displacements.

    A symmetric body that is compressed from a symmetric start comes to a symmetric equilibrium, be
    it as unstable as a needle on its point: a block of springs between two plates stayed there with
    elements inside out.
    """
    body, n = system.body, system.body.n_nodes
    free = ~body.fixed[:n]
    free[system.cores.nodes] = False
    shifts = np.random.default_rng(0).uniform(-1.0, 1.0, (n, 3))
    body.positions[:n][free] += DISTURBANCE * system.node_size * shifts[free]


def _take_steps(stepper: GlobalStepper, system: TissueModel, edge: Edge, rate: float) -> Motion:
    """Take steps, each after its damping.

    Args:
        stepper: Moves all nodes.
        system: Body, forces and contact.
        edge: The edge of no blade.
        rate: Angular frequency for which damping is critical [1/s].
    """
    elasticity, contact, n = system.elasticity, system.contact, system.body.n_nodes
    at_rest = elasticity.frequency_squared
    limit = StepLimit(at_rest, 0.0, 0)
    strained = elasticity.strained_frequency_squared(system.body, system.visits, limit)
    added = contact.added_frequency_squared + system.added_by_attachments
    highest = max(at_rest, strained) + added
    step = stable_step(stepper.method.number, elasticity.arrays, highest, system.surroundings)
    dt = STEPS_BETWEEN_TESTS * step
    contact.begin()
    system.find_contacts(dt)
    system.find_geom_contacts(dt)
    velocities = system.body.velocities[:n]
    for i in range(STEPS_BETWEEN_TESTS):
        velocities *= math.exp(-2.0 * rate * step)
        velocities_t0 = velocities.copy()
        part = Increment(edge, dt, i / STEPS_BETWEEN_TESTS, (i + 1) / STEPS_BETWEEN_TESTS)
        stepper.take_steps(system, part, 1)
    system.relax_stress(math.inf)
    if contact.is_touching:  # what holds a body on the floor is not in its forces
        return Motion((velocities - velocities_t0) / step, highest)
    found = system.stages.a1
    accelerations(system.context, found)
    return Motion(found[:n].copy(), highest)


def _frequency(masses: FloatArray, path: FloatArray, change: FloatArray) -> float:
    """Return the angular frequency of a motion by Rayleigh's quotient [1/s]; 0 where it softens.

    Args:
        masses: Of the nodes that are not fixed [kg], 0 for others; shape (n_nodes, 1).
        path: How far the nodes moved [m], shape (n_nodes, 3).
        change: How their accelerations changed on it [m/s2], shape (n_nodes, 3).
    """
    moved = float((masses * path**2).sum())
    stiffness = -float((masses * path * change).sum())
    return math.sqrt(stiffness / moved) if stiffness > 0.0 and moved > 0.0 else 0.0


class _Watch:
    """Whether a body has come to rest, and whether it is held.

    Args:
        system: The body where it begins.
        support: What it comes to rest on.
    """

    def __init__(self, system: TissueModel, support: SupportConditions) -> None:
        self._system, self._support = system, support
        self.begin = self._positions.copy()
        """Where the nodes were at first [m], shape (n_nodes, 3)."""
        self._farthest = FARTHEST_HELD * float(np.linalg.norm(np.ptp(self.begin, axis=0)))
        self._n_quiet = 0

    def is_at_rest(self, motion: Motion, taken: int) -> bool:
        """Return whether the body is at rest.

        Args:
            motion: How it moves.
            taken: Steps so far.

        Raises:
            TissueError: a node went too far, or where no number is.
        """
        largest = float(np.abs(motion.accelerations).max())
        if not math.isfinite(largest):
            raise not_finite()
        if taken % STEPS_BETWEEN_CHECKS == 0:
            self._expect_near()
        # A piece that falls far is displaced by metres, and what is rounded there is no small part.
        is_rounding = largest < min(self._rounding(motion.frequency_squared), RESTLESS)
        self._n_quiet = self._n_quiet + 1 if is_rounding else 0
        return largest < SETTLED or self._n_quiet == QUIET

    @property
    def _positions(self) -> FloatArray:
        return self._system.body.positions[: self._system.body.n_nodes]

    def _rounding(self, frequency_squared: float) -> float:
        """Return the acceleration that is made by the rounding of displacements [m/s2].

        `frequency_squared`: the highest w^2 of the body [1/s2].
        """
        system = self._system
        if not system.elasticity.is_single:
            return 0.0
        moved = float(np.abs(self._positions - system.body.rest[: system.body.n_nodes]).max())
        return ROUNDING * moved * frequency_squared

    def _expect_near(self) -> None:
        """Refuse a body of which a part is far away.

        Raises:
            TissueError: it is.
        """
        distances = np.linalg.norm(self._positions - self.begin, axis=1)
        node = int(distances.argmax())
        if distances[node] > self._farthest:
            raise gone_too_far(self._system, node, self.begin[node], self._support)
