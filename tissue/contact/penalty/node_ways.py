"""How far nodes have moved: from where they were paired, since the last time step, and in all.

A node has a ball around where it was when it was paired; pairs hold while it is inside. A node
whose neighbourhood moves little is left alone: it need not be asked whether it touches something.
"""

import math

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd import room_for_points
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, dot, norm, store, sub, vec3
from tissue.mesh.body import Body, grown

IN_BALL, OUT_OF_BALL, LOST = 0, 1, 2
"""Results of `measure_ways`: all nodes are in their balls; one is not; one moved by a metre."""

FLAT, FOLDED, NOTCHED = 0, 1, 2
"""Values of `NodeWays.is_folded`: skin that touches no skin of its piece; skin that has come near
some that is far from it at rest; and skin near some that faces it at rest."""

BALL = 0.125
"""Radius of the ball of a slow node, per node size. Larger: more pairs; smaller: they must be
listed more often."""

LARGEST_BALL = 1.0
"""Radius of the ball of a fast node at most, per node size; and of a node that is lost, which is
paired with faces so far above it."""

_TIME_IN_BALL = 6e-3
"""How long a fast node stays in its ball if it keeps its speed [s]. Larger: more pairs; smaller:
what falls or swings is paired in every frame."""

_SLOW = 0.05
"""Speed up to which the ball of a slow node is enough [m/s]."""

_PART_OF_BALL = 0.6
"""Share of its ball beyond which a node is paired anew along with those that left theirs."""

_QUIET = 6e-4
"""Way in a time step up to which a node is quiet, per node size. Larger: neighbourhoods that
tremble are left alone, and all quiet ones are asked more often; smaller: more is asked."""

_LARGEST_WAY = 1.0
"""Way in a time step [m] from which on a body has exploded, and nothing is searched for."""


class NodeWays(Arrays):
    """What is known of how nodes moved."""

    frame: IntCell
    """Number of the search, from 1."""
    n_known: IntCell
    """Number of nodes that were there in the last search."""
    n_moving: IntCell
    """Number of nodes of faces that moved much since the last search."""
    quiet_way: FloatCell
    """How much nearer four quiet nodes can have brought two sides so far [m]."""
    largest_way: FloatCell
    """Greatest way of any node of the body since the skin was last looked at [m]."""
    before: FloatArray
    """Where each node was in the last search [m], shape (node capacity, 3)."""
    reference: FloatArray
    """Where each node was when it was paired [m], shape (node capacity, 3)."""
    displacement: FloatArray
    """How far each node is from its reference [m], shape (node capacity, 3)."""
    radius: FloatArray
    """Radius of the ball of each node [m], shape (node capacity,)."""
    way: FloatArray
    """How far each node has gone so far [m], shape (node capacity,)."""
    moved_at: IntArray
    """Search in which each node last moved much, shape (node capacity,)."""
    is_folded: IntArray
    """FLAT, FOLDED or NOTCHED, as `folds` finds it; shape (node capacity,)."""
    node_size: float
    """Mean node size [m]."""


def new_node_ways(n_nodes: int, node_size: float) -> NodeWays:
    """Return no motion, with room for that many nodes of that mean size [m]."""
    return NodeWays(
        frame=0,
        n_known=0,
        n_moving=0,
        quiet_way=0.0,
        largest_way=np.inf,
        before=room_for_points(n_nodes),
        reference=room_for_points(n_nodes),
        displacement=np.zeros((n_nodes, 3)),
        radius=np.zeros(n_nodes),
        way=np.zeros(n_nodes),
        moved_at=np.zeros(n_nodes, np.int64),
        is_folded=np.zeros(n_nodes, np.int64),
        node_size=float(node_size),
    )


def grown_node_ways(ways: NodeWays, n_nodes: int) -> NodeWays:
    """Return the motion with room for `n_nodes`."""
    of_nodes = ("before", "reference", "displacement", "radius", "way", "moved_at", "is_folded")
    return ways.replaced(**{name: grown(getattr(ways, name), n_nodes) for name in of_nodes})


@kernel
def measure_ways(ways: NodeWays, body: Body, nodes: IntArray, n: int) -> int:
    """Add up the ways of the first `n` of `nodes`; return IN_BALL, OUT_OF_BALL or LOST."""
    for node in range(ways.n_known, body.n_nodes):
        store(ways.before, node, vec3(body.positions, node))
    ways.n_known = body.n_nodes
    ways.frame += 1
    quiet, most, result, n_moving = _QUIET * ways.node_size, 0.0, IN_BALL, 0
    for i in range(n):
        node = nodes[i]
        p = vec3(body.positions, node)
        d = sub(p, vec3(ways.reference, node))
        store(ways.displacement, node, d)
        if not dot(d, d) <= ways.radius[node] * ways.radius[node]:
            result = OUT_OF_BALL
        way = norm(sub(p, vec3(ways.before, node)))
        if not way <= _LARGEST_WAY:
            return LOST
        ways.way[node] += way
        if way <= quiet:
            most = max(most, way)
        else:
            ways.moved_at[node] = ways.frame
            n_moving += 1
    ways.quiet_way += 4.0 * most
    ways.n_moving = n_moving
    return result


@kernel
def note_places(ways: NodeWays, body: Body) -> None:
    """Note where all nodes are, at the end of a search."""
    most = 0.0
    for node in range(body.n_nodes):
        p = vec3(body.positions, node)
        d = sub(p, vec3(ways.before, node))
        most = max(most, dot(d, d))
        store(ways.before, node, p)
    ways.largest_way += math.sqrt(most)


@kernel
def has_left_middle(ways: NodeWays, body: Body, node: int) -> bool:
    """Whether a node has left the inner part of its ball."""
    d = sub(vec3(body.positions, node), vec3(ways.reference, node))
    most = _PART_OF_BALL * ways.radius[node]
    return not dot(d, d) <= most * most


@kernel
def begin_ball(ways: NodeWays, body: Body, node: int) -> None:
    """Lay the ball of a node around where it is, as large as its speed asks for."""
    size = ways.node_size
    store(ways.reference, node, vec3(body.positions, node))
    store(ways.displacement, node, Vec3(0.0, 0.0, 0.0))
    fast = max(norm(vec3(body.velocities, node)) - _SLOW, 0.0)
    ways.radius[node] = min(BALL * size + _TIME_IN_BALL * fast, LARGEST_BALL * size)
