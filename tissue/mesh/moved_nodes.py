"""Which nodes have moved since somebody last asked: all that a search has to look at again."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.mesh.body import grown

N_MOVED, _EPOCH = 0, 1
"""Places in `Moved.state`."""


class Moved(Arrays):
    """A list of nodes, each once."""

    nodes: IntArray
    """Shape (capacity,)."""
    seen: IntArray
    """Question before which each was last noted, shape (capacity,)."""
    state: IntArray
    """How many are listed, and the number of the question; shape (2,)."""


def none_moved(n_nodes: int) -> Moved:
    """Return an empty list with room for that many nodes."""
    nodes, seen = np.zeros((2, n_nodes), np.int64)
    return Moved(nodes=nodes, seen=seen, state=np.array([0, 1]))


def grown_moved(moved: Moved, n_nodes: int) -> Moved:
    """Return the list with room for that many nodes."""
    return moved.replaced(nodes=grown(moved.nodes, n_nodes), seen=grown(moved.seen, n_nodes))


@kernel
def note_moved(moved: Moved, nodes: IntArray, n: int) -> None:
    """Note the first `n` of `nodes`."""
    for i in range(n):
        if moved.seen[nodes[i]] != moved.state[_EPOCH]:
            moved.seen[nodes[i]] = moved.state[_EPOCH]
            moved.nodes[moved.state[N_MOVED]] = nodes[i]
            moved.state[N_MOVED] += 1


@kernel
def forget_moved(moved: Moved) -> None:
    """Empty the list: the question was answered."""
    moved.state[N_MOVED] = 0
    moved.state[_EPOCH] += 1
