"""`Elasticity` owns what forces inside a body follow from; it follows the cuts."""

import numpy as np

from tissue.body import NODES, Body
from tissue.elastic import Elastic
from tissue.material import Material
from tissue.springs import bound_frequencies, build_rows, grown_springs, no_springs
from tissue.star import LARGEST_STAR, Visits
from tissue.touched import largest_frequency
from tissue.types import FloatArray, IntArray

ROOM_FOR_SPRINGS = 1 << 16
"""Free springs that the body begins with, beyond its own; the pool doubles when they are used."""


class Elasticity:
    """The rows of a body, and a bound on its frequencies.

    Args:
        material: What it is made of.
        body: The body; its masses are written.
        visits: For searches.
    """

    def __init__(self, material: Material, body: Body, visits: Visits) -> None:
        self._material = material
        self._around = np.zeros(LARGEST_STAR, dtype=np.int64)
        n_nodes = len(body.rest)
        self.arrays = Elastic(springs=no_springs(n_nodes, 20 * n_nodes + ROOM_FOR_SPRINGS))
        self.frequency_squared = 0.0
        """Bound on the square of every angular frequency so far [1/s2]."""
        n = int(body.counts[NODES])
        self.mesh_changed(body, visits, np.arange(n), n)

    def mesh_changed(self, body: Body, visits: Visits, nodes: IntArray, n: int) -> None:
        """Write masses and rows of the first `n` of `nodes` anew: the mesh around them changed."""
        done = 0
        while True:
            springs = self.arrays.springs
            done += build_rows(
                body,
                visits,
                springs,
                nodes[done:n],
                n - done,
                self._material.density,
                self._material.spring_modulus,
                self._around,
            )
            if done == n:
                break
            pool = 2 * len(springs.neighbour)
            self.arrays = Elastic(springs=grown_springs(springs, len(springs.first), pool))
        bound_frequencies(body, springs, nodes, n)
        largest = largest_frequency(body, springs.frequency_squared, nodes, n)
        self.frequency_squared = max(self.frequency_squared, largest)

    def grow(self, n_nodes: int) -> None:
        """Make room for that many nodes."""
        springs = self.arrays.springs
        self.arrays = Elastic(springs=grown_springs(springs, n_nodes, len(springs.neighbour)))

    @property
    def node_frequency_squared(self) -> FloatArray:
        """Bound on the square of the angular frequency at each node [1/s2]."""
        return self.arrays.springs.frequency_squared
