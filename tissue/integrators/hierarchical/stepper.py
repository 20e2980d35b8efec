"""`HierarchicalStepper`: owns the arrays of the hierarchical relaxation, and finds frames that are
stable."""

import math
from collections.abc import Sequence

import numpy as np

from tissue.blade.forces import frequency_with_tool
from tissue.contact.resolve import prepare
from tissue.core.array_types import IntArray
from tissue.elasticity.elasticity import Elasticity
from tissue.integrators.focus import find_held, find_rings
from tissue.integrators.hierarchical.kernels import (
    grown_trails,
    hierarchical_frame,
    new_trails,
    ring_frequencies,
)
from tissue.integrators.node_rings import N_FOUND, grown_rings, new_rings
from tissue.integrators.options import Hierarchical
from tissue.integrators.stability import SAFETY, largest_stable_step
from tissue.integrators.step_context import Motion, end_step
from tissue.mesh.body import Body
from tissue.mesh.moved_nodes import Moved, grown_moved, none_moved, note_moved


class HierarchicalStepper:
    """The paper's hierarchical relaxation; see `tissue.integrators.step_context.Relaxation`.

    The focus is the tetrahedron that the blade holds nearest to its tip; when it has let go, the
    one that it held last.

    Args:
        options: Its settings.
        n_nodes: Room for nodes.
    """

    def __init__(self, options: Hierarchical, n_nodes: int) -> None:
        self._options = options
        self._rings = new_rings(n_nodes)
        self._held = new_rings(n_nodes)
        self._trails = new_trails(n_nodes)
        self._scratch = np.zeros(n_nodes, np.int64)
        self._moved = none_moved(n_nodes)
        self._highest = np.zeros(options.rings + 2)

    @property
    def moved(self) -> Moved | None:
        """Nodes that moved since it was emptied; None where all do."""
        return self._moved if self._is_far_frozen else None

    @property
    def moving(self) -> tuple[IntArray, int] | None:
        """Nodes that may have moved in the last call of `relax`, and how many; None where all."""
        if not self._is_far_frozen:
            return None
        return self._rings.order, int(self._rings.state[N_FOUND])

    @property
    def _is_far_frozen(self) -> bool:
        return self._options.far == "frozen"

    def relax(self, motion: Motion) -> int:
        """Advance the motion; return how many steps the nodes of the focus took."""
        options, body = self._options, motion.body
        springs = motion.elasticity.arrays.springs
        self._find_rings(motion)
        n, every = self._divide(motion)
        if motion.contact.is_awake:
            prepare(motion.contact.arrays, body)
        hierarchical_frame(
            body,
            springs,
            motion.tool,
            motion.edge,
            self._rings,
            self._trails,
            motion.stages.external,
            motion.surroundings,
            motion.dt,
            motion.begin,
            motion.end - motion.begin,
            n,
            every,
            options.rings,
            self._is_far_frozen,
        )
        end_step(motion, motion.span, motion.end)
        note_moved(self._moved, self._rings.order, int(self._rings.state[N_FOUND]))
        return n

    def _find_rings(self, motion: Motion) -> None:
        """Find the rings around what the blade holds."""
        springs = motion.elasticity.arrays.springs
        find_held(self._held, motion.body, motion.tool)
        last = self._options.rings + 1
        find_rings(self._rings, self._held, springs, last, self._scratch)

    def _divide(self, motion: Motion) -> tuple[int, IntArray]:
        """Return how many micro steps to take, and after how many each ring is moved."""
        elasticity, body = motion.elasticity, motion.body
        highest, options = self._highest, self._options
        by_node = elasticity.arrays.frequency_squared
        ring_frequencies(body, by_node, self._rings, options.rings, self._is_far_frozen, highest)
        near = frequency_with_tool(motion.tool, body, by_node, motion.stages.external)
        highest[0] = max(highest[0], near)
        around = motion.surroundings
        needed = []
        for squared in highest:
            step = largest_stable_step(math.sqrt(squared), around.retardation_time, around.drag)
            needed.append(motion.span / (SAFETY * step))
        return ring_steps(options, needed)

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray, n: int) -> None:
        """Nodes that are new may have moved as others did."""
        note_moved(self._moved, nodes, n)

    def body_moved(self, body: Body, elasticity: Elasticity) -> None:
        """Nothing is remembered that this would change."""

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes."""
        self._rings = grown_rings(self._rings, n_nodes)
        self._held = grown_rings(self._held, n_nodes)
        self._scratch = np.zeros(n_nodes, np.int64)
        self._trails = grown_trails(self._trails, n_nodes)
        self._moved = grown_moved(self._moved, n_nodes)


def ring_steps(options: Hierarchical, needed: Sequence[float]) -> tuple[int, IntArray]:
    """Return how many micro steps a frame has, and after how many each ring is moved.

    Args:
        options: I and s_max.
        needed: Steps in a frame for which the nodes of each ring, and last those beyond, are
            stable.
    """
    last = options.rings
    steps = [options.updates >> ring for ring in range(last + 1)] + [1]
    for ring in range(last + 1, -1, -1):
        while steps[ring] < needed[ring]:
            steps[ring] *= 2
        if ring <= last:  # no fewer than further out, where blade and old cuts are stiff alike
            while steps[ring] < steps[ring + 1]:
                steps[ring] *= 2
    return steps[0], steps[0] // np.array(steps)
