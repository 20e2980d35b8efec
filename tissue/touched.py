"""Which nodes a cut step touched, and the largest local frequency among them."""

from tissue.body import Body
from tissue.cut import N_DIRTY, Change
from tissue.jit import kernel
from tissue.star import Visits
from tissue.types import FloatArray, IntArray


@kernel
def touched_nodes(body: Body, change: Change, visits: Visits, out: IntArray) -> int:
    """Write the nodes of the changed tetrahedra to `out`, each once; return how many."""
    visits.epoch[0] += 1
    epoch = visits.epoch[0]
    n = 0
    for i in range(change.counts[N_DIRTY]):
        for k in range(4):
            node = body.tetrahedra[change.dirty[i], k]
            if visits.nodes[node] != epoch:
                visits.nodes[node] = epoch
                out[n] = node
                n += 1
    return n


@kernel
def largest_frequency(body: Body, frequency_squared: FloatArray, nodes: IntArray, n: int) -> float:
    """Largest bound on w^2 [1/s2] among the first `n` of `nodes` that can move."""
    largest = 0.0
    for i in range(n):
        if not body.fixed[nodes[i]]:
            largest = max(largest, frequency_squared[nodes[i]])
    return largest
