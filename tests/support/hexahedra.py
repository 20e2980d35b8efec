"""Hexahedra of 27 nodes in linear elasticity: a reference that neither locks nor needs many."""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import spsolve

from tissue import FloatArray, IntArray

_GAUSS = np.polynomial.legendre.leggauss(3)


class Hexahedra:
    """A brick of 27-node hexahedra, which may be deformed to another shape.

    Args:
        cells: Number of elements along each axis.
        place: Maps points of the unit cube, shape (n, 3), to the body at rest [m].
    """

    def __init__(
        self, cells: tuple[int, int, int], place: Callable[[FloatArray], FloatArray]
    ) -> None:
        counts = [2 * n + 1 for n in cells]
        grid = np.indices(counts).reshape(3, -1).T
        self.unit = grid / np.array([2.0 * n for n in cells])
        self.points = place(self.unit)
        corners = 2 * np.indices(cells).reshape(3, -1).T
        local = np.indices((3, 3, 3)).reshape(3, -1).T
        nodes = corners[:, None] + local
        self.elements: IntArray = np.ravel_multi_index(tuple(nodes.transpose(2, 0, 1)), counts)

    def stiffness(self, mu: float, lam: float) -> csr_array:
        """Return K [N/m] for Lame's constants [Pa]."""
        n, blocks = 3 * len(self.points), 0.0
        for gradient, weight in self._at_gauss_points():
            same = np.einsum("eac,ebc->eab", gradient, gradient)
            block = mu * np.einsum("eab,ij->eaibj", same, np.eye(3))
            block += mu * np.einsum("eaj,ebi->eaibj", gradient, gradient)
            block += lam * np.einsum("eai,ebj->eaibj", gradient, gradient)
            blocks = blocks + weight[:, None, None, None, None] * block
        dofs = (3 * self.elements[:, :, None] + np.arange(3)).reshape(len(self.elements), -1)
        rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
        columns = np.tile(dofs, (1, dofs.shape[1])).ravel()
        return csr_array((np.asarray(blocks).ravel(), (rows, columns)), shape=(n, n))

    def _at_gauss_points(self):
        for i, x in enumerate(_GAUSS[0]):
            for j, y in enumerate(_GAUSS[0]):
                for k, z in enumerate(_GAUSS[0]):
                    shapes, slopes = zip(*(_shapes(each) for each in (x, y, z)), strict=True)
                    natural = [
                        np.einsum(
                            "a,b,c->abc", *(slopes[q] if q == axis else shapes[q] for q in range(3))
                        )
                        for axis in range(3)
                    ]
                    natural = np.stack(natural, axis=-1).reshape(27, 3)
                    jacobian = np.einsum("eac,ad->ecd", self.points[self.elements], natural)
                    gradient = np.einsum("ad,edc->eac", natural, np.linalg.inv(jacobian))
                    weight = _GAUSS[1][i] * _GAUSS[1][j] * _GAUSS[1][k]
                    yield gradient, weight * np.linalg.det(jacobian)

    def face_loads(self, axis: int) -> FloatArray:
        """Return the share of an even load on the far face that each node carries, shape (n,)."""
        # Simpson's rule: shape functions of second order, by area along the other two axes.
        shares = np.zeros(len(self.points))
        on_face = np.isclose(self.unit[:, axis], 1.0)
        rest = [q for q in range(3) if q != axis]
        for q in rest:
            n = len(np.unique(self.unit[:, q]))
            simpson = np.array([1.0, *(4.0 if k % 2 else 2.0 for k in range(1, n - 1)), 1.0])
            factor = simpson[np.rint(self.unit[:, q] * (n - 1)).astype(int)]
            shares = np.where(on_face, factor, 0.0) * (shares if q == rest[1] else 1.0)
        return shares / shares.sum()


def solved(stiffness, is_held: FloatArray, motion: FloatArray, force: FloatArray) -> FloatArray:
    """Return the displacements [m], shape (n, 3), where `is_held` those of `motion`."""
    held = np.repeat(is_held, 3)
    u, f = motion.ravel().astype(float), force.ravel()
    free = ~held
    k = csr_array(stiffness)
    u[free] = spsolve(k[free][:, free].tocsc(), f[free] - k[free][:, held] @ u[held])
    return u.reshape(-1, 3)


def _shapes(x: float) -> tuple[FloatArray, FloatArray]:
    """Return the three shape functions of second order on a line from -1 to 1, and slopes."""
    return (
        np.array([0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)]),
        np.array([x - 0.5, -2.0 * x, x + 0.5]),
    )
