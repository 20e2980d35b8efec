"""Which nodes have moved since somebody last asked: all that a search has to look at again."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.mesh.body import grown


class Moved(Arrays):
    """A list of nodes, each once."""

    nodes: IntArray
    """Shape (capacity,)."""
    seen: IntArray
    """Question before which each was last noted, shape (capacity,)."""
    n_nodes: IntCell
    """Number of nodes listed."""
    epoch: IntCell
    """Number of the question."""


def none_moved(n_nodes: int) -> Moved:
    """Return an empty list with room for that many nodes."""
    nodes, seen = np.zeros((2, n_nodes), np.int64)
    return Moved(nodes=nodes, seen=seen, n_nodes=0, epoch=1)


def grown_moved(moved: Moved, n_nodes: int) -> Moved:
    """Return the list with room for that many nodes."""
    return moved.replaced(nodes=grown(moved.nodes, n_nodes), seen=grown(moved.seen, n_nodes))


@kernel
def note_moved(moved: Moved, nodes: IntArray, n: int) -> None:
    """Note the first `n` of `nodes`."""
    for i in range(n):
        if moved.seen[nodes[i]] != moved.epoch:
            moved.seen[nodes[i]] = moved.epoch
            moved.nodes[moved.n_nodes] = nodes[i]
            moved.n_nodes += 1


@kernel
def forget_moved(moved: Moved) -> None:
    """Empty the list: the question was answered."""
    moved.n_nodes = 0
    moved.epoch += 1
