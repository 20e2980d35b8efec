"""`ByRings`: owns the arrays of the hierarchical relaxation, and finds frames that are stable."""

import math

import numpy as np

from tissue.anchors import frequency_with_anchors
from tissue.body import Body
from tissue.contact.resolve import prepare
from tissue.elasticity import Elasticity
from tissue.relaxation.breadth_first import N_FOUND, grown_rings, new_rings, search_around
from tissue.relaxation.focus import find_focus
from tissue.relaxation.hierarchical import (
    grown_trails,
    hierarchical_frame,
    new_trails,
    ring_frequencies,
)
from tissue.relaxation.motion import Motion, end_step
from tissue.relaxation.moved import Moved, grown_moved, none_moved, note_moved
from tissue.relaxation.options import Hierarchical
from tissue.runge_kutta import SAFETY, largest_stable_step
from tissue.types import FloatArray, IntArray


class ByRings:
    """The paper's hierarchical relaxation; see `tissue.relaxation.motion.Relaxation`.

    The focus is the nodes that the blade holds; when it has let go, those that it held last.

    Args:
        options: Its settings.
        n_nodes: Room for nodes.
    """

    def __init__(self, options: Hierarchical, n_nodes: int) -> None:
        self._options = options
        self._rings = new_rings(n_nodes)
        self._focus = new_rings(n_nodes)
        self._trails = new_trails(n_nodes)
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
        n = self._n_frames(motion)
        share = (motion.end - motion.begin) / n
        for i in range(n):
            if i > 0:
                self._find_rings(motion)  # the anchors may have gone to other nodes
            if motion.contact.is_awake:
                prepare(motion.contact.arrays, body)
            at = motion.begin + i * share
            hierarchical_frame(
                body,
                springs,
                motion.anchors,
                motion.edge,
                self._rings,
                self._trails,
                motion.stages.external,
                motion.surroundings,
                motion.toughness,
                motion.dt,
                at,
                share,
                options.updates,
                options.rings,
                self._is_far_frozen,
            )
            end_step(motion, share * motion.dt, at + share)
            note_moved(self._moved, self._rings.order, int(self._rings.state[N_FOUND]))
        return n * options.updates

    def _find_rings(self, motion: Motion) -> None:
        """Find the rings around what the blade holds."""
        springs = motion.elasticity.arrays.springs
        find_focus(self._focus, motion.body, motion.anchors)
        search_around(self._rings, self._focus, springs, self._options.rings + 1)

    def _n_frames(self, motion: Motion) -> int:
        """Return in how many frames the steps of all rings are stable."""
        elasticity, body = motion.elasticity, motion.body
        highest, options = self._highest, self._options
        springs = elasticity.arrays.springs
        ring_frequencies(body, springs, self._rings, options.rings, self._is_far_frozen, highest)
        by_node = elasticity.arrays.frequency_squared
        near = frequency_with_anchors(motion.anchors, body, by_node, motion.stages.external)
        highest[0] = max(highest[0], near)
        return n_frames(motion, highest, options)

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray, n: int) -> None:
        """Nodes that are new may have moved as others did."""
        note_moved(self._moved, nodes, n)

    def body_moved(self, body: Body, elasticity: Elasticity) -> None:
        """Nothing is remembered that this would change."""

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes."""
        self._rings = grown_rings(self._rings, n_nodes)
        self._focus = grown_rings(self._focus, n_nodes)
        self._trails = grown_trails(self._trails, n_nodes)
        self._moved = grown_moved(self._moved, n_nodes)


def n_frames(motion: Motion, highest: FloatArray, options: Hierarchical) -> int:
    """Return the frames that it takes for each ring's steps to be stable.

    Args:
        motion: What is to be divided.
        highest: Bound on w^2 of the nodes of each ring, and last of all beyond [1/s2].
        options: Steps of each ring.
    """
    n = 1
    surroundings = motion.surroundings
    for ring, frequency_squared in enumerate(highest):
        updates = options.updates >> ring if ring <= options.rings else 1
        step = largest_stable_step(
            math.sqrt(frequency_squared), surroundings.retardation_time, surroundings.drag
        )
        n = max(n, math.ceil(motion.span / (updates * SAFETY * step)))
    return n
