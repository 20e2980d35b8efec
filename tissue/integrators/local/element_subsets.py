"""Which tetrahedra have to be evaluated for the forces on some nodes only.

The force on a node needs the tetrahedra around it; where volumes are averaged, these need the
pressures of their nodes, and those need the volumes of all tetrahedra around these.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH
from tissue.core.simd_blocks import width_of
from tissue.core.structs import Arrays, IntCell
from tissue.elasticity.finite_elements import Solid, tetrahedron_of_slot
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.neo_hookean import (
    corner_forces,
    displacement_gradients,
    displacements_of_blocks,
    has_averaged_volumes,
    pressures,
)
from tissue.integrators.node_rings import Rings
from tissue.mesh.body import Body


class Patch(Arrays):
    """What to evaluate: lists of blocks of tetrahedra, and of nodes."""

    volumes: IntArray
    """Blocks whose gradients and volumes are needed, shape (block capacity,)."""
    pressures: IntArray
    """Nodes whose pressures are needed, shape (node capacity,)."""
    forces: IntArray
    """Blocks whose forces are needed, shape (block capacity,)."""
    seen: IntArray
    """Search that listed each block last, shape (block capacity,)."""
    n_volumes: IntCell
    """Number of entries in `volumes`."""
    n_pressures: IntCell
    """Number of entries in `pressures`."""
    n_forces: IntCell
    """Number of entries in `forces`."""
    epoch: IntCell
    """Number of the search."""

    def sort(self) -> None:
        """Sort the lists by address, for a subset that is evaluated many times."""
        self.volumes[: self.n_volumes].sort()
        self.pressures[: self.n_pressures].sort()
        self.forces[: self.n_forces].sort()


def new_patch(n_nodes: int, n_tetrahedra: int) -> Patch:
    """Return an empty patch with room for that many nodes and tetrahedra."""
    blocks = (n_tetrahedra + WIDTH - 1) // WIDTH  # the larger number of the two precisions
    return Patch(
        volumes=np.zeros(blocks, np.int64),
        pressures=np.zeros(n_nodes, np.int64),
        forces=np.zeros(blocks, np.int64),
        seen=np.zeros(blocks, np.int64),
        n_volumes=0,
        n_pressures=0,
        n_forces=0,
        epoch=0,
    )


@kernel
def reach_of(elastic: Elastic) -> int:
    """Number of edges over which the motion of a node changes the force on another."""
    averaged = elastic.has_tetrahedra and has_averaged_volumes(elastic.solid)
    return 2 if averaged else 1


@kernel
def find_patch(patch: Patch, elastic: Elastic, rings: Rings, moving: int, affected: int) -> None:
    """List what to evaluate where nodes moved, for the forces that this changes.

    Args:
        patch: Written.
        elastic: For the rows of the tetrahedra around nodes.
        rings: Ring 0 and, for the pressures, ring 1.
        moving: Last of these rings around whose nodes volumes are needed.
        affected: Last of these rings around whose nodes forces are needed.
    """
    patch.n_volumes = patch.n_pressures = patch.n_forces = 0
    if not elastic.has_tetrahedra:
        return
    solid = elastic.solid
    patch.n_forces = _blocks_around(patch, solid, rings, affected, patch.forces)
    patch.n_volumes = _blocks_around(patch, solid, rings, moving, patch.volumes)
    if has_averaged_volumes(solid):
        for k in range(rings.n_found):
            if rings.ring[rings.order[k]] > 1:
                break
            patch.pressures[k] = rings.order[k]
            patch.n_pressures = k + 1


@kernel
def _blocks_around(patch: Patch, solid: Solid, rings: Rings, last_ring: int, out: IntArray) -> int:
    """Write the blocks of the tetrahedra around nodes up to that ring to `out`; return how many."""
    patch.epoch += 1
    n = 0
    for k in range(rings.n_found):
        node = rings.order[k]
        if rings.ring[node] > last_ring:
            break
        first = solid.first[node]
        for slot in range(first, first + solid.count[node]):
            block = tetrahedron_of_slot(solid, slot) // width_of(solid.shape)
            if patch.seen[block] != patch.epoch:
                patch.seen[block] = patch.epoch
                out[n] = block
                n += 1
    return n


@kernel
def deform_patch(patch: Patch, elastic: Elastic, body: Body, positions: FloatArray) -> None:
    """Evaluate the tetrahedra of a patch at `positions` [m], for `internal_force`."""
    if elastic.has_tetrahedra:
        solid = elastic.solid
        displacements_of_blocks(solid, body, positions, patch.volumes, patch.n_volumes)
        displacement_gradients(solid, patch.volumes, 0, patch.n_volumes)
        if has_averaged_volumes(solid):
            pressures(solid, patch.pressures, 0, patch.n_pressures)
        corner_forces(solid, patch.forces, 0, patch.n_forces)
