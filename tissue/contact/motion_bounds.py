"""Bounds of how far nodes have moved, and which pairs can touch for it.

Most nodes move little in a step: they are slow, and the largest displacement of them all is one
number. A few move much: what the blade drags, a shred that trembles, a piece that falls. They are
fast, and pairs with a fast node go by the paths of their own four nodes.
"""

import math

import numpy as np

from tissue.contact.pairs import CLOSING, CLOSING_OF_NODES, Nodes, Pairs, nodes_of_pair
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import dot, store, sub, vec3
from tissue.mesh.body import Body, grown

FAST_STEPS = 64
"""Runge-Kutta steps for which a node must move little before it is slow again. What trembles is
slow at each turning point, and whenever a node becomes fast all pairs are gone through."""

_NEAR = 8.0
"""Distance of a near pair, as a share of the displacement of a fast node. Larger: more pairs are
tested in every step, at a few nanoseconds each; smaller: more are tested one by one, at ten times
that."""

STEPS_NEAR = 32
"""Runge-Kutta steps after which the distance of a near pair is computed again: this costs some ten
times as much as to test whether it may touch."""


class MotionBounds(Arrays):
    """Paths of the nodes of faces."""

    step: IntCell
    """Number of the Runge-Kutta step."""
    n_newly_fast: IntCell
    """Number of nodes that became fast when motion was measured last."""
    slow_path: FloatCell
    """Sum of the largest displacements of slow nodes from one measurement to the next [m]."""
    slow_move: FloatCell
    """Largest displacement of a slow node in this step [m]."""
    seen: FloatArray
    """Where each node was when its motion was measured last [m], shape (node capacity, 3)."""
    path: FloatArray
    """Length of the path of each node since it was first measured [m], shape (node capacity,)."""
    move: FloatArray
    """Displacement of each node in this step [m], shape (node capacity,)."""
    fast_until: IntArray
    """Step up to which each node is fast, shape (node capacity,)."""
    fast_move: float
    """Displacement in a Runge-Kutta step above which a node is fast [m]."""


def new_motion_bounds(n_nodes: int, fast_move: float) -> MotionBounds:
    """Return no motion.

    Args:
        n_nodes: Nodes that there is room for.
        fast_move: Displacement in a Runge-Kutta step above which a node is fast [m].
    """
    return MotionBounds(
        step=0,
        n_newly_fast=0,
        slow_path=0.0,
        slow_move=0.0,
        seen=np.zeros((n_nodes, 3)),
        path=np.zeros(n_nodes),
        move=np.zeros(n_nodes),
        fast_until=np.full(n_nodes, -1, np.int64),
        fast_move=fast_move,
    )


def grown_motion_bounds(motion: MotionBounds, n_nodes: int) -> MotionBounds:
    """Return the motion with room for `n_nodes`."""
    return motion.replaced(
        seen=grown(motion.seen, n_nodes),
        path=grown(motion.path, n_nodes),
        move=grown(motion.move, n_nodes),
        fast_until=grown(motion.fast_until, n_nodes, -1),
    )


@kernel
def is_fast(motion: MotionBounds, node: int) -> bool:
    """Whether a node moves, or has lately moved, by more than `fast_move` in a step."""
    return bool(motion.fast_until[node] >= motion.step)


@kernel
def begin_measuring(motion: MotionBounds, body: Body, node: int) -> None:
    """Begin to measure a node."""
    store(motion.seen, node, vec3(body.positions, node))
    motion.path[node] = 0.0
    motion.move[node] = 0.0
    motion.fast_until[node] = -1


@kernel
def measure_motion(
    motion: MotionBounds,
    body: Body,
    start: FloatArray,
    nodes: IntArray,
    n: int,
) -> float:
    """Measure how far nodes have moved; return the largest displacement in this step [m].

    Args:
        motion: Written.
        body: Where the nodes are now.
        start: Where they were before the Runge-Kutta step [m], shape (node capacity, 3).
        nodes: Nodes of faces; the first `n` are measured.
        n: Number of nodes.
    """
    largest_path = 0.0
    largest_slow = 0.0
    largest_move = 0.0
    n_newly_fast = 0
    for i in range(n):
        node = nodes[i]
        p = vec3(body.positions, node)
        d = sub(p, vec3(motion.seen, node))
        store(motion.seen, node, p)
        path = math.sqrt(dot(d, d))
        motion.path[node] += path
        d = sub(p, vec3(start, node))
        move = math.sqrt(dot(d, d))
        largest_move = move if not move <= largest_move else largest_move
        motion.move[node] = move
        if not move <= motion.fast_move:
            if not is_fast(motion, node):
                n_newly_fast += 1
            motion.fast_until[node] = motion.step + FAST_STEPS
        if not is_fast(motion, node):
            largest_path = max(largest_path, path)
            largest_slow = max(largest_slow, move)
    motion.n_newly_fast = n_newly_fast
    motion.slow_path += largest_path
    motion.slow_move = largest_slow
    return largest_move


@kernel
def has_fast(motion: MotionBounds, nodes: Nodes) -> bool:
    """Whether one of the nodes is fast."""
    a, b, c, d = nodes
    return is_fast(motion, a) or is_fast(motion, b) or is_fast(motion, c) or is_fast(motion, d)


@kernel
def wake_fast_pairs(motion: MotionBounds, pairs: Pairs) -> None:
    """Let pairs with a fast node go by the paths of their nodes."""
    for k in range(pairs.n_pairs):
        if has_fast(motion, nodes_of_pair(pairs, k)):
            pairs.wake[k] = -np.inf


@kernel
def horizon(motion: MotionBounds, residual: float) -> float:
    """Return up to which `wake` pairs are to be tested [m].

    What went through is no deeper than both sides moved in this step plus how deep they were before
    it: `residual` [m] at most.
    """
    return CLOSING * motion.slow_path + 2.0 * motion.slow_move + residual


@kernel
def is_near(motion: MotionBounds, distance: float) -> bool:
    """Whether a pair so far apart [m] would be tested again in the next step or two anyway."""
    return distance <= _NEAR * motion.fast_move


@kernel
def first_scheduled(motion: MotionBounds) -> int:
    """Return the first near pair whose distance is computed in this step.

    The others are every `STEPS_NEAR`-th after it.
    """
    return motion.step % STEPS_NEAR


@kernel
def can_touch(motion: MotionBounds, pairs: Pairs, k: int, residual: float) -> bool:
    """Whether far pair `k` may touch by the paths of its nodes; if not, let it sleep on.

    Args:
        motion: Paths of the nodes.
        pairs: Pair `k` is written.
        k: Number of the pair.
        residual: How deep in each other its sides may have been before the step [m].
    """
    a, b, c, d = nodes_of_pair(pairs, k)
    path, move = motion.path, motion.move
    distance = pairs.wake_by_nodes[k] - CLOSING_OF_NODES * (path[a] + path[b] + path[c] + path[d])
    if distance <= move[a] + move[b] + move[c] + move[d] + residual:
        return True
    _let_sleep(motion, pairs, k, distance)
    return False


@kernel
def note_distance(motion: MotionBounds, pairs: Pairs, k: int, distance: float) -> None:
    """Let pair `k`, whose sides are `distance` [m] apart, sleep until it may touch."""
    a, b, c, d = nodes_of_pair(pairs, k)
    path = motion.path
    pairs.wake_by_nodes[k] = distance + CLOSING_OF_NODES * (path[a] + path[b] + path[c] + path[d])
    _let_sleep(motion, pairs, k, distance)


@kernel
def _let_sleep(motion: MotionBounds, pairs: Pairs, k: int, distance: float) -> None:
    """Write the horizon at which pair `k` is to be tested."""
    if has_fast(motion, nodes_of_pair(pairs, k)):
        pairs.wake[k] = -np.inf
    else:
        pairs.wake[k] = distance + CLOSING * motion.slow_path
