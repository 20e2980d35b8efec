"""Runge-Kutta steps whose loops over the body are shared by several threads.

Each node and each tetrahedron is written by one thread, and sums are gathered in the order of rows:
the bits are those of one thread. Between loops the threads wait for each other, which costs 30 to
80 us a loop. Two threads measured: 60,000 tetrahedra step 1.35 (springs) to 1.8 times as fast,
20,000 at 0.9 of the speed of one.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from tissue.blade.forces import apply_blade_forces
from tissue.core.array_types import FloatArray
from tissue.elasticity.finite_elements import n_blocks
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.neo_hookean import (
    corner_forces,
    displacements,
    gradients,
    has_averaged_volumes,
    pressures,
)
from tissue.integrators.runge_kutta import first_stage, fourth_stage, second_stage, third_stage
from tissue.integrators.step_context import Increment, StepContext
from tissue.integrators.substeps import begin_substep, end_substep
from tissue.integrators.system import System
from tissue.mesh.body import Body


class Threads:
    """A number of threads that step a body.

    Args:
        n: How many, the caller's own included; at least 2.
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self._pool = ThreadPoolExecutor(n - 1, thread_name_prefix="tissue")

    def take_steps(self, system: System, increment: Increment, n: int) -> None:
        """Advance the motion by an increment in `n` Runge-Kutta steps, as `runge_kutta_steps`."""
        share = (increment.end - increment.begin) / n
        for i in range(n):
            at = increment.begin + i * share
            seconds, when = share * increment.dt, at + share
            begin_substep(system.context, seconds, i, n)
            self._step(system.context, increment, at, share)
            while not end_substep(system.context, increment.edge, seconds, when):
                system.contact.make_room()

    def _step(self, context: StepContext, increment: Increment, at: float, share: float) -> None:
        """Take one step of Nystroem's form, as `runge_kutta_nystroem`."""
        body, elastic, stages = context.body, context.elastic, context.stages
        x2, x4 = stages.positions, stages.positions_4
        n, h = body.n_nodes, share * increment.dt
        half, end = at + 0.5 * share, at + share
        _apply_blade(context, increment, body.positions, at, share / 6.0)
        self._deform(body, elastic, body.positions)
        self._share(n, first_stage, context, h)
        _apply_blade(context, increment, x2, half, share * 2.0 / 3.0)
        self._deform(body, elastic, x2)
        self._share(n, second_stage, context, h)
        if context.surroundings.retardation_time > 0.0:
            self._share(n, third_stage, context, h)
        _apply_blade(context, increment, x4, end, share / 6.0)
        self._deform(body, elastic, x4)
        self._share(n, fourth_stage, context, h)

    def _deform(self, body: Body, elastic: Elastic, positions: FloatArray) -> None:
        """Evaluate all tetrahedra (see `tissue.elasticity.internal_forces.deform`)."""
        if not elastic.has_tetrahedra:
            return
        solid = elastic.solid
        blocks = n_blocks(solid, body.n_tetrahedra)
        self._share(body.n_nodes, displacements, solid, body, positions, solid.every)
        self._share(blocks, gradients, solid, solid.every)
        if has_averaged_volumes(solid):
            self._share(body.n_nodes, pressures, solid, solid.every)
        self._share(blocks, corner_forces, solid, solid.every)

    def _share(self, n: int, loop: Callable[..., None], *arguments: Any) -> None:
        """Run `loop(*arguments, begin, end)` over 0 to `n`, a part of it on each thread."""
        bounds = [n * i // self._n for i in range(self._n + 1)]
        others = [
            self._pool.submit(loop, *arguments, bounds[i], bounds[i + 1]) for i in range(1, self._n)
        ]
        loop(*arguments, bounds[0], bounds[1])
        for other in others:
            other.result()


def _apply_blade(
    context: StepContext, increment: Increment, positions: FloatArray, when: float, share: float
) -> None:
    """Write the blade's forces on the nodes at `positions` [m]; see `apply_blade_forces`."""
    blade, body, external = context.blade, context.body, context.stages.external
    edge, dt = increment.edge, increment.dt
    apply_blade_forces(blade, body, edge, positions, when, share, dt, external)
