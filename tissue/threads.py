"""Runge-Kutta steps whose loops over the body are shared by several threads.

Each node and each tetrahedron is written by one thread, and sums are gathered in the order of rows:
the bits are those of one thread. Between loops the threads wait for each other, which costs 10 to
20 us a loop; it pays from about 20,000 tetrahedra on.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from tissue.anchors import Anchors, Edge, clear_forces, pull
from tissue.body import NODES, TETRAHEDRA, Body
from tissue.contact.resolve import IS_AWAKE, IS_PENDING, ContactState, prepare, resolve
from tissue.elastic import TETRAHEDRA_TOO, Elastic, Surroundings
from tissue.neo_hookean import corner_forces, has_averaged_volumes, pressures, volumes
from tissue.runge_kutta import Stages, first_stage, fourth_stage, second_stage, third_stage
from tissue.slipping import slip
from tissue.solid import n_blocks
from tissue.star import Visits
from tissue.types import FloatArray, IntArray


class Threads:
    """A number of threads that step a body.

    Args:
        n: How many, the caller's own included; at least 2.
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self._pool = ThreadPoolExecutor(n - 1, thread_name_prefix="tissue")

    def relax(
        self,
        body: Body,
        elastic: Elastic,
        anchors: Anchors,
        edge: Edge,
        visits: Visits,
        stages: Stages,
        contact: ContactState,
        queue: IntArray,
        surroundings: Surroundings,
        toughness: float,
        reach: float,
        dt: float,
        begin: float,
        end: float,
        first: int,
        n: int,
    ) -> int:
        """Do what `tissue.runge_kutta.relax` does."""
        share = (end - begin) / n
        is_awake = contact.state[IS_AWAKE] == 1
        external = stages.external
        for i in range(first, n):
            at = begin + i * share
            if contact.state[IS_PENDING] == 0:
                if is_awake:
                    prepare(contact, body)

                def pulled(x: FloatArray, when: float, weight: float, at: float = at) -> None:
                    now = at + when * share
                    pull(anchors, body, edge, x, now, weight * share, dt, toughness, external)

                self._step(body, elastic, stages, surroundings, share * dt, pulled)
            if is_awake:
                contact.state[IS_PENDING] = 1
                if not resolve(contact, body, share * dt):
                    return i
                contact.state[IS_PENDING] = 0
            clear_forces(anchors, body, external)
            slip(anchors, body, visits, edge, at + share, toughness, reach, queue)
        return n

    def _step(
        self,
        body: Body,
        elastic: Elastic,
        stages: Stages,
        surroundings: Surroundings,
        h: float,
        pulled: Callable[[FloatArray, float, float], None],
    ) -> None:
        """One step of Nystroem's form (see `runge_kutta_nystroem`)."""
        n = int(body.counts[NODES])
        arguments = (body, elastic, stages, surroundings, h)
        pulled(body.positions, 0.0, 1.0 / 6.0)
        self._deform(body, elastic, body.positions)
        self._share(n, first_stage, *arguments)
        pulled(stages.positions, 0.5, 2.0 / 3.0)
        self._deform(body, elastic, stages.positions)
        self._share(n, second_stage, *arguments)
        if surroundings.retardation_time > 0.0:
            self._share(n, third_stage, *arguments)
        pulled(stages.positions_4, 1.0, 1.0 / 6.0)
        self._deform(body, elastic, stages.positions_4)
        self._share(n, fourth_stage, *arguments)

    def _deform(self, body: Body, elastic: Elastic, positions: FloatArray) -> None:
        """Evaluate all tetrahedra (see `tissue.elastic.deform`)."""
        if not elastic.has[TETRAHEDRA_TOO]:
            return
        solid = elastic.solid
        blocks = n_blocks(int(body.counts[TETRAHEDRA]))
        if has_averaged_volumes(solid):
            self._share(blocks, volumes, solid, positions, solid.every)
            self._share(int(body.counts[NODES]), pressures, solid, solid.every)
        self._share(blocks, corner_forces, solid, positions, solid.every)

    def _share(self, n: int, loop: Callable[..., None], *arguments: Any) -> None:
        """Run `loop(*arguments, begin, end)` over 0 to `n`, a part of it on each thread."""
        bounds = [n * i // self._n for i in range(self._n + 1)]
        others = [
            self._pool.submit(loop, *arguments, bounds[i], bounds[i + 1]) for i in range(1, self._n)
        ]
        loop(*arguments, bounds[0], bounds[1])
        for other in others:
            other.result()
