"""How far nodes have moved, and which pairs can touch for it.

Nodes of two kinds. Most move little in a step, and what all of them have moved at most is one
number. A few move much: what the blade drags, a shred that trembles, a piece that falls. They are
restless, and the pairs with them are asked for the ways of their own nodes.
"""

import math

import numpy as np

from tissue.contact.pairs import CLOSING, CLOSING_OF_NODES, N_PAIRS, Nodes, Pairs, nodes_of_pair
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import dot, store, sub, vec3
from tissue.mesh.body import Body, grown

_WAY, MOVE, _LITTLE = 0, 1, 2
"""Places in `Motion.whole`."""

STEP, N_NEW = 0, 1
"""Places in `Motion.number`."""

STEPS_TO_REST = 64
"""Runge-Kutta steps for which a node must move little before it is no longer restless. What
trembles is slow at each turn, and whenever a node becomes restless all pairs are gone through."""


_NEAR = 8.0
"""Distance of a near pair, as a share of what a restless node moves. Larger: more pairs are looked
at always, at a few nanoseconds each; smaller: more are asked one by one, at ten times that."""

STEPS_NEAR = 32
"""Runge-Kutta steps after which it is found out anew how far a near pair is apart: this costs some
ten times as much as to look whether it may touch."""


class Motion(Arrays):
    """Ways of the nodes of faces."""

    seen: FloatArray
    """Where each node was when its motion was measured last [m], shape (node capacity, 3)."""
    way: FloatArray
    """How far each node has gone since it was new [m], shape (node capacity,)."""
    reach: FloatArray
    """How far each node has moved in this step [m], shape (node capacity,)."""
    restless_until: IntArray
    """The measurement at which each node may rest, shape (node capacity,)."""
    number: IntArray
    """Of the step, and of nodes that have become restless in it; shape (2,)."""
    whole: FloatArray
    """Of nodes that are not restless: sum of the largest motions, each time that they were
    measured; how far one has moved in this step at most; and how far one may [m]. Shape (3,)."""


def new_motion(n_nodes: int, little: float) -> Motion:
    """Return no motion.

    Args:
        n_nodes: Nodes that there is room for.
        little: How far a node moves in a Runge-Kutta step at most that is not restless [m].
    """
    return Motion(
        seen=np.zeros((n_nodes, 3)),
        way=np.zeros(n_nodes),
        reach=np.zeros(n_nodes),
        restless_until=np.full(n_nodes, -1, np.int64),
        number=np.zeros(2, np.int64),
        whole=np.array([0.0, 0.0, little]),
    )


def grown_motion(motion: Motion, n_nodes: int) -> Motion:
    """Return the motion with room for that many nodes."""
    return motion.replaced(
        seen=grown(motion.seen, n_nodes),
        way=grown(motion.way, n_nodes),
        reach=grown(motion.reach, n_nodes),
        restless_until=grown(motion.restless_until, n_nodes, -1),
    )


@kernel
def is_restless(motion: Motion, node: int) -> bool:
    """Whether a node moves, or has lately moved, by more than little."""
    return motion.restless_until[node] >= motion.number[STEP]


@kernel
def begin_motion(motion: Motion, body: Body, node: int) -> None:
    """Begin to measure a node."""
    store(motion.seen, node, vec3(body.positions, node))
    motion.way[node] = 0.0
    motion.reach[node] = 0.0
    motion.restless_until[node] = -1


@kernel
def measure_motion(
    motion: Motion,
    body: Body,
    start: FloatArray,
    nodes: IntArray,
    n: int,
) -> float:
    """Measure how far the first `n` of `nodes` have moved; return how far in this step at most [m].

    Args:
        motion: Written.
        body: Where the nodes are now.
        start: Where they were before the Runge-Kutta step [m].
        nodes: Nodes of faces.
        n: How many.
    """
    whole, number = motion.whole, motion.number
    largest_way = 0.0
    largest_reach = 0.0
    largest_move = 0.0
    number[N_NEW] = 0
    for i in range(n):
        node = nodes[i]
        p = vec3(body.positions, node)
        d = sub(p, vec3(motion.seen, node))
        store(motion.seen, node, p)
        way = math.sqrt(dot(d, d))
        motion.way[node] += way
        d = sub(p, vec3(start, node))
        move = math.sqrt(dot(d, d))
        largest_move = move if not move <= largest_move else largest_move
        motion.reach[node] = move
        if not move <= whole[_LITTLE]:
            if not is_restless(motion, node):
                number[N_NEW] += 1
            motion.restless_until[node] = number[STEP] + STEPS_TO_REST
        if not is_restless(motion, node):
            largest_way = max(largest_way, way)
            largest_reach = max(largest_reach, move)
    whole[_WAY] += largest_way
    whole[MOVE] = largest_reach
    return largest_move


@kernel
def has_restless(motion: Motion, nodes: Nodes) -> bool:
    """Whether one of the nodes is restless."""
    a, b, c, d = nodes
    return (
        is_restless(motion, a)
        or is_restless(motion, b)
        or is_restless(motion, c)
        or is_restless(motion, d)
    )


@kernel
def wake_restless(motion: Motion, pairs: Pairs) -> None:
    """Let pairs with a restless node go by the ways of their nodes."""
    for k in range(pairs.counts[N_PAIRS]):
        if has_restless(motion, nodes_of_pair(pairs, k)):
            pairs.wake[k] = -np.inf


@kernel
def horizon(motion: Motion, slack: float) -> float:
    """Pairs that are to be looked at have their `wake` at most at this [m].

    What went through is no deeper than both sides moved in this step, and were before it: `slack`
    at most [m].
    """
    return CLOSING * motion.whole[_WAY] + 2.0 * motion.whole[MOVE] + slack


@kernel
def is_near(motion: Motion, distance: float) -> bool:
    """Whether a pair so far apart [m] would be looked at again in the next step or two anyway."""
    return distance <= _NEAR * motion.whole[_LITTLE]


@kernel
def whose_turn(motion: Motion) -> int:
    """Of each `STEPS_NEAR` near pairs the one that is to be found out anew in this step."""
    return motion.number[STEP] % STEPS_NEAR


@kernel
def can_touch(motion: Motion, pairs: Pairs, k: int, slack: float) -> bool:
    """Whether pair `k` may touch by the ways of its nodes; if not, it sleeps for what is left."""
    a, b, c, d = nodes_of_pair(pairs, k)
    way, reach = motion.way, motion.reach
    apart = pairs.wake_by_nodes[k] - CLOSING_OF_NODES * (way[a] + way[b] + way[c] + way[d])
    if apart <= reach[a] + reach[b] + reach[c] + reach[d] + slack:
        return True
    _sleep(motion, pairs, k, apart)
    return False


@kernel
def note_distance(motion: Motion, pairs: Pairs, k: int, distance: float) -> None:
    """Let pair `k`, that far apart [m], sleep until it may touch."""
    a, b, c, d = nodes_of_pair(pairs, k)
    way = motion.way
    pairs.wake_by_nodes[k] = distance + CLOSING_OF_NODES * (way[a] + way[b] + way[c] + way[d])
    _sleep(motion, pairs, k, distance)


@kernel
def _sleep(motion: Motion, pairs: Pairs, k: int, distance: float) -> None:
    if has_restless(motion, nodes_of_pair(pairs, k)):
        pairs.wake[k] = -np.inf
    else:
        pairs.wake[k] = distance + CLOSING * motion.whole[_WAY]
