"""Which tetrahedra have to be evaluated for the forces on some nodes only.

The force on a node needs the tetrahedra around it; where volumes are averaged, these need the
pressures of their nodes, and those need the volumes of all tetrahedra around these.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH
from tissue.core.structs import Arrays
from tissue.elasticity.finite_elements import Solid, n_blocks, tetrahedron_at
from tissue.elasticity.internal_forces import TETRAHEDRA_TOO, Elastic
from tissue.elasticity.neo_hookean import corner_forces, has_averaged_volumes, pressures, volumes
from tissue.integrators.node_rings import N_FOUND, Rings

N_VOLUMES, N_PRESSURES, N_FORCES, _EPOCH = 0, 1, 2, 3
"""Places in `Patch.state`."""


class Patch(Arrays):
    """What to evaluate: lists of blocks of tetrahedra, and of nodes."""

    volumes: IntArray
    """Blocks whose volumes are needed, shape (block capacity,)."""
    pressures: IntArray
    """Nodes whose pressures are, shape (node capacity,)."""
    forces: IntArray
    """Blocks whose forces are, shape (block capacity,)."""
    seen: IntArray
    """Search that listed each block last, shape (block capacity,)."""
    state: IntArray
    """Lengths of the three lists, and the number of the search; shape (4,)."""

    def sort(self) -> None:
        """Sort the lists, as memory is: for a patch that is evaluated many times."""
        for places, n in zip((self.volumes, self.pressures, self.forces), self.state, strict=False):
            places[:n].sort()


def new_patch(n_nodes: int, n_tetrahedra: int) -> Patch:
    """Return an empty patch with room for that many nodes and tetrahedra."""
    blocks = n_blocks(n_tetrahedra)
    return Patch(
        volumes=np.zeros(blocks, np.int64),
        pressures=np.zeros(n_nodes, np.int64),
        forces=np.zeros(blocks, np.int64),
        seen=np.zeros(blocks, np.int64),
        state=np.zeros(4, np.int64),
    )


@kernel
def reach_of(elastic: Elastic) -> int:
    """How many edges apart two nodes may be of which one feels the other move."""
    averaged = elastic.has[TETRAHEDRA_TOO] and has_averaged_volumes(elastic.solid)
    return 2 if averaged else 1


@kernel
def find_patch(patch: Patch, elastic: Elastic, rings: Rings, moving: int, feeling: int) -> None:
    """List what to evaluate where nodes moved, for the forces on nodes that feel it.

    Args:
        patch: Written.
        elastic: For the rows of the tetrahedra around nodes.
        rings: Ring 0 and, for the pressures, ring 1.
        moving: Up to which of these rings volumes are needed around the nodes.
        feeling: Up to which of these rings forces are needed around the nodes.
    """
    state = patch.state
    state[N_VOLUMES] = state[N_PRESSURES] = state[N_FORCES] = 0
    if not elastic.has[TETRAHEDRA_TOO]:
        return
    solid = elastic.solid
    state[N_FORCES] = _blocks_around(patch, solid, rings, feeling, patch.forces)
    if has_averaged_volumes(solid):
        state[N_VOLUMES] = _blocks_around(patch, solid, rings, moving, patch.volumes)
        for k in range(rings.state[N_FOUND]):
            if rings.ring[rings.order[k]] > 1:
                break
            patch.pressures[k] = rings.order[k]
            state[N_PRESSURES] = k + 1


@kernel
def _blocks_around(patch: Patch, solid: Solid, rings: Rings, last_ring: int, out: IntArray) -> int:
    """Write the blocks of the tetrahedra around nodes up to that ring to `out`; return how many."""
    patch.state[_EPOCH] += 1
    n = 0
    for k in range(rings.state[N_FOUND]):
        node = rings.order[k]
        if rings.ring[node] > last_ring:
            break
        first = solid.first[node]
        for slot in range(first, first + solid.count[node]):
            block = tetrahedron_at(solid, slot) // WIDTH
            if patch.seen[block] != patch.state[_EPOCH]:
                patch.seen[block] = patch.state[_EPOCH]
                out[n] = block
                n += 1
    return n


@kernel
def deform_patch(patch: Patch, elastic: Elastic, positions: FloatArray) -> None:
    """Evaluate the tetrahedra of a patch at `positions` [m], for `internal_force`."""
    if elastic.has[TETRAHEDRA_TOO]:
        solid, state = elastic.solid, patch.state
        if has_averaged_volumes(solid):
            volumes(solid, positions, patch.volumes, 0, state[N_VOLUMES])
            pressures(solid, patch.pressures, 0, state[N_PRESSURES])
        corner_forces(solid, positions, patch.forces, 0, state[N_FORCES])
