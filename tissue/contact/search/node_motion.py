"""Motion of nodes: from where they were paired, since the last time step, and in all.

A node has a ball around where it was when it was paired; pairs hold while it is inside. A node
whose neighbourhood moves little is left alone: it needs no test.
"""

import math

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd import room_for_points
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, dot, norm, store, sub, vec3
from tissue.mesh.body import Body, grown

IN_BALL, OUT_OF_BALL, DIVERGED = 0, 1, 2
"""Results of `measure_motion`: all nodes are in their balls; one is not; one moved by a metre."""

NO_PROXIMITY, PROXIMITY, NOTCH = 0, 1, 2
"""Values of `NodeMotion.self_proximity`: skin that touches no skin of its piece; skin that has come
near some that is far from it at rest; and skin near some that faces it at rest."""

BALL = 0.125
"""Radius of the ball of a slow node, per node size. Larger: more pairs; smaller: they must be
listed more often."""

LARGEST_BALL = 1.0
"""Radius of the ball of a fast node at most, per node size; and of a penetrating node, which is
paired with faces so far above it."""

_TIME_IN_BALL = 6e-3
"""Time of a fast node in its ball at constant speed [s]. Larger: more pairs; smaller:
what falls or swings is paired in every frame."""

_SLOW = 0.05
"""Speed up to which the ball of a slow node is enough [m/s]."""

_PART_OF_BALL = 0.6
"""Share of its ball beyond which a node is paired again along with those that left theirs."""

_QUIET = 6e-4
"""Path in a time step up to which a node is quiet, per node size. Larger: neighbourhoods that
tremble are left alone, and all quiet ones are tested more often; smaller: more is tested."""

_LARGEST_STEP = 1.0
"""Displacement in a time step [m] from which on a body has exploded, and nothing is searched
for."""


class NodeMotion(Arrays):
    """Motion of the nodes."""

    frame: IntCell
    """Number of the search, from 1."""
    n_known: IntCell
    """Number of nodes that were there in the last search."""
    n_moving: IntCell
    """Number of nodes of faces that moved much since the last search."""
    quiet_path: FloatCell
    """Largest approach of two sides by four quiet nodes so far [m]."""
    largest_path: FloatCell
    """Greatest path of any node of the body since the skin was last tested [m]."""
    before: FloatArray
    """Where each node was in the last search [m], shape (node capacity, 3)."""
    reference: FloatArray
    """Where each node was when it was paired [m], shape (node capacity, 3)."""
    displacement: FloatArray
    """Displacement of each node from its reference [m], shape (node capacity, 3)."""
    radius: FloatArray
    """Radius of the ball of each node [m], shape (node capacity,)."""
    path: FloatArray
    """Length of the path of each node so far [m], shape (node capacity,)."""
    moved_at: IntArray
    """Search in which each node last moved much, shape (node capacity,)."""
    self_proximity: IntArray
    """FLAT, FOLDED or NOTCHED, as `proximity` finds it; shape (node capacity,)."""
    node_size: float
    """Mean node size [m]."""


def new_node_motion(n_nodes: int, node_size: float) -> NodeMotion:
    """Return no motion, with room for that many nodes of that mean size [m]."""
    return NodeMotion(
        frame=0,
        n_known=0,
        n_moving=0,
        quiet_path=0.0,
        largest_path=np.inf,
        before=room_for_points(n_nodes),
        reference=room_for_points(n_nodes),
        displacement=np.zeros((n_nodes, 3)),
        radius=np.zeros(n_nodes),
        path=np.zeros(n_nodes),
        moved_at=np.zeros(n_nodes, np.int64),
        self_proximity=np.zeros(n_nodes, np.int64),
        node_size=float(node_size),
    )


def grown_node_motion(motion: NodeMotion, n_nodes: int) -> NodeMotion:
    """Return the motion with room for `n_nodes`."""
    of_nodes = (
        "before",
        "reference",
        "displacement",
        "radius",
        "path",
        "moved_at",
        "self_proximity",
    )
    return motion.replaced(**{name: grown(getattr(motion, name), n_nodes) for name in of_nodes})


@kernel
def measure_motion(motion: NodeMotion, body: Body, nodes: IntArray, n: int) -> int:
    """Add up the paths of the first `n` of `nodes`; return IN_BALL, OUT_OF_BALL or DIVERGED."""
    for node in range(motion.n_known, body.n_nodes):
        store(motion.before, node, vec3(body.positions, node))
    motion.n_known = body.n_nodes
    motion.frame += 1
    quiet, most, result, n_moving = _QUIET * motion.node_size, 0.0, IN_BALL, 0
    for i in range(n):
        node = nodes[i]
        p = vec3(body.positions, node)
        d = sub(p, vec3(motion.reference, node))
        store(motion.displacement, node, d)
        if not dot(d, d) <= motion.radius[node] * motion.radius[node]:
            result = OUT_OF_BALL
        path = norm(sub(p, vec3(motion.before, node)))
        if not path <= _LARGEST_STEP:
            return DIVERGED
        motion.path[node] += path
        if path <= quiet:
            most = max(most, path)
        else:
            motion.moved_at[node] = motion.frame
            n_moving += 1
    motion.quiet_path += 4.0 * most
    motion.n_moving = n_moving
    return result


@kernel
def note_places(motion: NodeMotion, body: Body) -> None:
    """Record where all nodes are, at the end of a search."""
    most = 0.0
    for node in range(body.n_nodes):
        p = vec3(body.positions, node)
        d = sub(p, vec3(motion.before, node))
        most = max(most, dot(d, d))
        store(motion.before, node, p)
    motion.largest_path += math.sqrt(most)


@kernel
def has_left_middle(motion: NodeMotion, body: Body, node: int) -> bool:
    """Whether a node has left the inner part of its ball."""
    d = sub(vec3(body.positions, node), vec3(motion.reference, node))
    most = _PART_OF_BALL * motion.radius[node]
    return not dot(d, d) <= most * most


@kernel
def begin_ball(motion: NodeMotion, body: Body, node: int) -> None:
    """Lay the ball of a node around where it is, as large as its speed needs."""
    size = motion.node_size
    store(motion.reference, node, vec3(body.positions, node))
    store(motion.displacement, node, Vec3(0.0, 0.0, 0.0))
    fast = max(norm(vec3(body.velocities, node)) - _SLOW, 0.0)
    motion.radius[node] = min(BALL * size + _TIME_IN_BALL * fast, LARGEST_BALL * size)
