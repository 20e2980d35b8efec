"""The nodes that have moved since a search last asked: only these it has to test again."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.mesh.body import grown


class Moved(Arrays):
    """The nodes that have moved, each once."""

    nodes: IntArray
    """Nodes listed, shape (capacity,)."""
    seen: IntArray
    """Value of `epoch` when each node was last listed, shape (capacity,)."""
    n_nodes: IntCell
    """Number of nodes listed."""
    epoch: IntCell
    """Number of the list: emptying it begins another."""


def none_moved(n_nodes: int) -> Moved:
    """Return an empty list with room for that many nodes."""
    nodes, seen = np.zeros((2, n_nodes), np.int64)
    return Moved(nodes=nodes, seen=seen, n_nodes=0, epoch=1)


def grown_moved(moved: Moved, n_nodes: int) -> Moved:
    """Return the list with room for that many nodes."""
    return moved.replaced(nodes=grown(moved.nodes, n_nodes), seen=grown(moved.seen, n_nodes))


@kernel
def note_moved(moved: Moved, nodes: IntArray, n: int) -> None:
    """Add the first `n` of `nodes` to the list."""
    for i in range(n):
        if moved.seen[nodes[i]] != moved.epoch:
            moved.seen[nodes[i]] = moved.epoch
            moved.nodes[moved.n_nodes] = nodes[i]
            moved.n_nodes += 1


@kernel
def forget_moved(moved: Moved) -> None:
    """Empty the list."""
    moved.n_nodes = 0
    moved.epoch += 1
