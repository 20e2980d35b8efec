"""`DeformedBody`: the method of `Tissue` that returns displacement, strain and stress."""

from typing import get_args

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.fields.node_strain import largest_principal_strains
from tissue.fields.node_stress import von_mises_stresses
from tissue.loads.handles import DrivenBody
from tissue.mesh.surface import boundary_nodes
from tissue.types import SurfaceQuantity


class DeformedBody(DrivenBody):
    """A body whose deformation can be looked at."""

    def surface_values(self, quantity: SurfaceQuantity) -> FloatArray:
        """Return a quantity at each vertex of `surface()`, shape (n_vertices,).

        `displacement`: distance from rest [m]. `strain`: largest principal Green-Lagrange strain,
        (l^2 - 1) / 2 where the most stretched direction is l times as long. `stress`: equivalent
        stress of von Mises of the elastic Cauchy stress [Pa], under any law, less what has relaxed.
        Strain and stress are those of the tetrahedra around the node, by volume.

        It changes nothing of the body, and takes about as long as a step.

        Raises:
            ValueError: there is no such quantity.
        """
        body = self._body
        n = body.n_nodes
        nodes = boundary_nodes(body)
        if quantity == "displacement":
            offsets = body.positions[nodes] - body.rest[nodes]
            return np.asarray(np.linalg.norm(offsets, axis=1), float)
        values, sums = np.empty(n), np.zeros((n, 7))
        if quantity == "strain":
            largest_principal_strains(body, sums, values)
        elif quantity == "stress":
            von_mises_stresses(self._system.elasticity.arrays, body, sums, values)
        else:
            raise ValueError(
                f"there is no quantity {quantity!r}. Known: {', '.join(get_args(SurfaceQuantity))}"
            )
        return values[nodes]
