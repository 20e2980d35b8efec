"""Integrators of all nodes together, in as many equal steps as stability needs."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tissue.blade.blade_mass import limit_frequency_at_blade
from tissue.blade.forces import frequency_with_blade
from tissue.contact.self_contact import SelfContact
from tissue.core.array_types import IntArray
from tissue.elasticity.strained_frequency import StepLimit
from tissue.integrators.damping import LONGEST_INTERVAL, SLOW_DAMPING
from tissue.integrators.options import Global, IntegratorOptions, Verlet
from tissue.integrators.stability import (
    StableStep,
    damping_rate,
    nystroem_step,
    stage_damped_step,
    verlet_step,
)
from tissue.integrators.step_context import Increment
from tissue.integrators.substeps import (
    nystroem_steps,
    nystroem_steps_with_forces,
    runge_kutta_steps,
    runge_kutta_steps_with_forces,
    verlet_steps,
    verlet_steps_with_forces,
)
from tissue.integrators.system import System
from tissue.integrators.threaded import Threads
from tissue.material import Law
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import largest_speed
from tissue.types import TissueError

STEPS_BETWEEN_STRAIN_BOUNDS = 2
"""Steps between two bounds on the frequencies of the strained body. A lip that snaps back, or is
pinched, is as much shorter within a frame of eight steps as an element is long."""

LONGEST_MOTION = 0.5
"""How far the fastest node moves in a step, as a share of the node size, at most. A bound on
frequencies holds where the body is; what moves farther may be stiffer before the next bound. With
less, strokes take more steps; without it, a body far from rest can become unstable."""

MOST_STEPS = 10_000.0
"""Steps of an increment at most, per step that the body at rest would take. In 160 blocks that
recovered from random positions of their nodes it was 150. Without a limit, motion that has become
unstable takes more and more steps and never ends."""

_ROUNDING = 1e-9
"""Share by which a frequency stays below that which would take another step."""


class Method(NamedTuple):
    """A method that advances all nodes together."""

    take_steps: Callable[..., int]
    """Takes a number of steps, as `tissue.integrators.substeps.runge_kutta_steps`."""
    take_steps_with_forces: Callable[..., None]
    """The same where contact acts as forces: `runge_kutta_steps_with_forces`."""
    stable_step: StableStep
    """The largest step."""
    damps_between_steps: bool
    """Whether damping acts between steps; if not, in every stage of them."""


def method_of(options: IntegratorOptions, law: Law) -> Method:
    """Return the method of a choice; for integrators that do not move all nodes, Runge-Kutta.

    These move all nodes where a body settles.
    """
    if isinstance(options, Verlet):
        return Method(verlet_steps, verlet_steps_with_forces, verlet_step, True)
    usual = "stage" if law == "springs" else "step"
    if isinstance(options, Global) and (options.damping or usual) == "step":
        return Method(nystroem_steps, nystroem_steps_with_forces, nystroem_step, True)
    return Method(runge_kutta_steps, runge_kutta_steps_with_forces, stage_damped_step, False)


class GlobalStepper:
    """All nodes together. An `Integrator` without memory.

    Args:
        method: How they are moved.
        threads: How many threads share the loops over the body.
    """

    moved = None
    moving = None

    def __init__(self, method: Method, threads: int = 1) -> None:
        self.method = method
        self._threads = Threads(threads) if threads > 1 else None
        self._nothing = np.zeros(0)

    def advance(self, system: System, increment: Increment) -> int:
        """Advance the motion by an increment; return the steps taken."""
        system.find_contacts(increment.span)
        elasticity, blade = system.elasticity, system.interaction.state
        self._limit_mass(system, increment.span)
        near = limit_frequency_at_blade(
            blade, elasticity.arrays, system.body, system.stages.external
        )
        added = system.contact.added_frequency_squared
        least = max(elasticity.frequency_squared, near) + added
        if elasticity.stiffens:
            added += self._added_by_blade(system)
        longest = self.method.stable_step(elasticity, least, system.surroundings)
        done = 0
        while True:
            n, highest = _without_another_step(least, longest, increment.span)
            limit = StepLimit(highest - added, added, n)
            step = self._stable_step(system, least, limit)
            moved = largest_speed(system.body) * increment.span / system.node_size
            n = _number_of_steps(
                max(increment.span / step, moved / LONGEST_MOTION),
                max(increment.span / longest, 1.0),
            )
            rate = damping_rate(elasticity, system.surroundings)
            is_slow = rate * LONGEST_INTERVAL * increment.span / n <= SLOW_DAMPING
            system.damping.interval = LONGEST_INTERVAL if is_slow else 1
            if not elasticity.follows_strain or n <= STEPS_BETWEEN_STRAIN_BOUNDS:
                self.take_steps(system, increment, n)
                return done + n
            share = STEPS_BETWEEN_STRAIN_BOUNDS / n
            end = increment.begin + share * (increment.end - increment.begin)
            self.take_steps(system, increment._replace(end=end), STEPS_BETWEEN_STRAIN_BOUNDS)
            increment = increment._replace(begin=end)
            done += STEPS_BETWEEN_STRAIN_BOUNDS

    def _limit_mass(self, system: System, span: float) -> None:
        """Let nodes get no mass between cuts where one step suffices for a span [s] without it."""
        elasticity, scaling = system.elasticity, system.elasticity.arrays.scaling
        at_rest = elasticity.frequency_squared + system.contact.added_frequency_squared
        longest = self.method.stable_step(elasticity, at_rest, system.surroundings)
        n, highest = _without_another_step(at_rest, longest, span)
        suffices = max(scaling.allowed, highest) if n == 1 else scaling.allowed
        scaling.allowed_between_cuts = suffices

    def _added_by_blade(self, system: System) -> float:
        """Return what the blade adds to w^2 [1/s2] at most.

        Tissue that stiffens is stiffest where the blade holds it, and resists together with it.
        """
        if len(self._nothing) != len(system.body.masses):
            self._nothing = np.zeros(len(system.body.masses))
        blade, scratch = system.interaction.state, system.stages.external
        return frequency_with_blade(blade, system.body, self._nothing, scratch)

    def _stable_step(self, system: System, least: float, limit: StepLimit) -> float:
        """Return the largest stable step [s] until the next bound on the strained body.

        Where the law stiffens as tissue is stretched, the bound is also evaluated where the nodes
        will be then: an exponential law can double its modulus in two steps.

        Args:
            system: Body and forces.
            least: Bound on w^2 with the body at rest [1/s2].
            limit: The strained body is looked at no closer than the number of steps asks for.
        """
        elasticity, surroundings = system.elasticity, system.surroundings
        body, visits = system.body, system.visits
        strained = elasticity.strained_frequency_squared(body, visits, limit)
        step = self.method.stable_step(elasticity, max(least, strained + limit.added), surroundings)
        if not elasticity.stiffens or math.isinf(step):  # infinite: every node is held
            return step
        duration = STEPS_BETWEEN_STRAIN_BOUNDS * step
        ahead = elasticity.frequency_squared_ahead(body, visits, limit, duration)
        highest = max(least, max(strained, ahead) + limit.added)
        return self.method.stable_step(elasticity, highest, surroundings)

    def take_steps(self, system: System, increment: Increment, n: int) -> None:
        """Advance the motion by an increment in `n` steps."""
        if self._threads is not None:
            self._threads.join(system.context)
        contact, done = system.contact, 0
        if not isinstance(contact, SelfContact):
            self.method.take_steps_with_forces(system.context, *increment, n)
            return
        while True:
            done = self.method.take_steps(system.context, contact.arrays, *increment, done, n)
            if done == n:
                return
            contact.make_room()

    def mesh_changed(self, nodes: IntArray) -> None:
        """Do nothing: no step depends on the one before."""

    def body_moved(self, body: Body) -> None:
        """Do nothing: no step depends on the one before."""

    def grow(self, n_nodes: int) -> None:
        """Do nothing: there are no arrays."""


def _number_of_steps(least: float, at_rest: float) -> int:
    """Return the number of steps of an increment.

    Args:
        least: How many it takes at least.
        at_rest: How many the body at rest would take.

    Raises:
        TissueError: It is more than `MOST_STEPS` times as many, or not a number.
    """
    if not least <= MOST_STEPS * at_rest:
        raise TissueError(
            f"the motion of the tissue became unstable: it would take {least:.2g} steps of the "
            f"integrator to go on, where tissue at rest takes {math.ceil(at_rest)}. Use a shorter "
            "time step, or a material that is softer or heavier"
        )
    return max(1, math.ceil(least))


def _without_another_step(
    frequency_squared: float, longest: float, span: float
) -> tuple[int, float]:
    """Return how many steps a frequency takes, and up to which w^2 [1/s2] it is no more.

    Args:
        frequency_squared: A bound on w^2 [1/s2].
        longest: The longest step with it [s].
        span: Time to advance by [s].
    """
    if math.isinf(longest):
        return 1, math.inf
    n = max(1, math.ceil(span / longest))
    return n, (1.0 - _ROUNDING) * frequency_squared * (n * longest / span) ** 2
