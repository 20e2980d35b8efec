"""All nodes together: the two-level Runge-Kutta method, in as many steps as stability needs."""

import math

from tissue.anchors import frequency_with_anchors
from tissue.body import Body
from tissue.elasticity import Elasticity
from tissue.relaxation.motion import Motion
from tissue.runge_kutta import SAFETY, largest_stable_step, relax
from tissue.types import IntArray


class AllTogether:
    """See `tissue.relaxation.motion.Relaxation`; it remembers nothing."""

    moved = None

    def relax(self, motion: Motion) -> int:
        """Advance the motion; return the Runge-Kutta steps taken."""
        elasticity = motion.elasticity
        near = frequency_with_anchors(
            motion.anchors, motion.body, elasticity.node_frequency_squared, motion.stages.external
        )
        frequency = math.sqrt(max(elasticity.frequency_squared, near))
        surroundings = motion.surroundings
        step = SAFETY * largest_stable_step(
            frequency, surroundings.retardation_time, surroundings.drag
        )
        n = max(1, math.ceil(motion.span / step))
        relax_by(motion, n)
        return n

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray, n: int) -> None:
        """Nothing is remembered."""

    def body_moved(self, body: Body, elasticity: Elasticity) -> None:
        """Nothing is remembered."""

    def grow(self, n_nodes: int) -> None:
        """Nothing is remembered."""


def relax_by(motion: Motion, n: int) -> None:
    """Advance the motion by `n` Runge-Kutta steps."""
    done = 0
    while True:
        done = relax(
            motion.body,
            motion.elasticity.arrays,
            motion.anchors,
            motion.edge,
            motion.visits,
            motion.stages,
            motion.contact.arrays,
            motion.queue,
            motion.surroundings,
            motion.toughness,
            motion.reach,
            motion.dt,
            motion.begin,
            motion.end,
            done,
            n,
        )
        if done == n:
            return
        motion.contact.make_room()
