"""The body at small strain as matrices, for calibration and comparison with theory.

The forces of the engine are nonlinear and never stored as a matrix. Here is their derivative at
rest, assembled with NumPy: force = -K displacement, exactly that of the engine's kernels to first
order (a test compares the two).

Springs: K = sum of k u u^T, k by van Gelder. Change of volume: each node has the mean dilatation of
the tetrahedra around it, by volume; besides springs, a share acts on each tetrahedron by itself
(`OWN_SHARE`). Laws of solids: dilatation averaged over nodes, and of the shear a share, the rest
of each tetrahedron by itself (`tissue.elasticity.averaged_shear`). Of the dilatation that each of
these strains has by itself the law takes a part away (`EnergyDensity.excess`).
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.laws.energy_density import OWN_SHARE, averaged_shear
from tissue.material import Material
from tissue.types import TetrahedralMesh

if TYPE_CHECKING:  # imported where it is used: it takes half a second
    from scipy.sparse import csr_array

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
"""Local nodes of a tetrahedron's edges."""


class EdgeSprings(NamedTuple):
    """The springs of a mesh, each once."""

    ends: IntArray
    """Nodes at the ends of each spring, the lower first, shape (n_springs, 2)."""
    stiffness: FloatArray
    """Stiffness of each spring [N/m], shape (n_springs,)."""


class Gradients(NamedTuple):
    """Gradients of the linear shape functions of the tetrahedra of a mesh, and volumes."""

    shape: FloatArray
    """Gradients of the four shape functions [1/m], shape (n_tets, 4, 3)."""
    volume: FloatArray
    """Volumes [m3], shape (n_tets,)."""


def gradients(mesh: TetrahedralMesh) -> Gradients:
    """Return the gradients of the linear shape functions, and volumes."""
    corners = mesh.positions[mesh.tetrahedra]
    edges = corners[:, 1:] - corners[:, :1]
    inverse = np.linalg.inv(edges)  # columns: gradients of the shape functions of corners 1, 2, 3
    of_others = np.swapaxes(inverse, 1, 2)
    shape = np.concatenate([-of_others.sum(axis=1, keepdims=True), of_others], axis=1)
    return Gradients(shape, np.abs(np.linalg.det(edges)) / 6.0)


def edge_springs(mesh: TetrahedralMesh, modulus: float) -> EdgeSprings:
    """Return the springs of van Gelder's formula, k = E V / l^2; `modulus` is E [Pa]."""
    volume = gradients(mesh).volume
    ends = np.sort(mesh.tetrahedra[:, _EDGES].reshape(-1, 2), axis=1)
    unique, which = np.unique(ends, axis=0, return_inverse=True)
    around = np.bincount(which.ravel(), weights=np.repeat(volume, len(_EDGES)))
    span = mesh.positions[unique[:, 1]] - mesh.positions[unique[:, 0]]
    return EdgeSprings(unique, modulus * around / np.sum(span**2, axis=1))


def masses(mesh: TetrahedralMesh, density: float) -> FloatArray:
    """Return the mass of each node [kg], a quarter of each tetrahedron around it."""
    share = np.repeat(density * gradients(mesh).volume / 4.0, 4)
    return _at_nodes(mesh, share)


def stiffness_matrix(
    mesh: TetrahedralMesh, material: Material, *, averaged: bool = True, element: str = "averaged"
) -> "csr_array":
    """Return K of the body at rest [N/m], shape (3 n_nodes, 3 n_nodes), x y z of each node in turn.

    Args:
        mesh: The body at rest.
        material: What the body is made of, with its law.
        averaged: Whether dilatation is averaged over nodes, as in the engine; False for plain
            linear tetrahedra, which lock (for comparison).
        element: How tetrahedra are strained under laws of solids (`SolverSettings.element`).
    """
    density = material.law.density(material.moduli)
    if material.law.has_springs:
        springs = _of_springs(mesh, edge_springs(mesh, material.spring_modulus))
        if density is None:
            return springs
        own = OWN_SHARE if averaged else 1.0
        mixed = own * _own_dilatation(mesh) + (1.0 - own) * _mean_dilatation(mesh)
        return springs + material.volume_modulus * mixed
    assert density is not None  # without springs tetrahedra are elastic
    if averaged and element == "averaged":
        density = averaged_shear(density)
    share = density.shear_of_nodes
    dilatation = _mean_dilatation if averaged else _own_dilatation
    own = density.lam_of_tetrahedra - (1.0 - share) * density.excess
    return (
        (1.0 - share) * _of_shear(mesh, material.mu)
        + share * _of_mean_shear(mesh, material.mu)
        + own * _own_dilatation(mesh)
        + (density.lam_of_nodes - share * density.excess) * dilatation(mesh)
    )


def _of_springs(mesh: TetrahedralMesh, springs: EdgeSprings) -> "csr_array":
    """Return the sum of k u u^T, u the unit vector along each spring."""
    ends, stiffness = springs
    span = mesh.positions[ends[:, 1]] - mesh.positions[ends[:, 0]]
    unit = span / np.linalg.norm(span, axis=1, keepdims=True)
    signed = np.stack([-unit, unit], axis=1)  # elongation per displacement of the two ends
    return _squared(_rows(ends, signed, len(mesh.positions)), stiffness)


def _own_dilatation(mesh: TetrahedralMesh) -> "csr_array":
    """Return the Hessian of the sum of V (div u)^2 / 2 over tetrahedra [m]."""
    shape, volume = gradients(mesh)
    return _squared(_rows(mesh.tetrahedra, shape, len(mesh.positions)), volume)


def _mean_dilatation(mesh: TetrahedralMesh) -> "csr_array":
    """Return the Hessian of the sum over nodes of V (div u)^2 / 2, div u averaged at each [m]."""
    mean, at_node = _means(mesh)
    shape, _ = gradients(mesh)
    return _squared(mean @ _rows(mesh.tetrahedra, shape, len(at_node)), at_node)


def _of_mean_shear(mesh: TetrahedralMesh, mu: float) -> "csr_array":
    """Return the Hessian of the sum over nodes of mu V eps:eps, eps averaged at each [N/m]."""
    mean, at_node = _means(mesh)
    shape, _ = gradients(mesh)
    total: Any = 0.0
    for c in range(3):
        for d in range(c, 3):
            vectors = np.zeros((*mesh.tetrahedra.shape, 3))
            vectors[..., c] += 0.5 * shape[..., d]
            vectors[..., d] += 0.5 * shape[..., c]
            weight = (1.0 if c == d else 2.0) * 2.0 * mu
            rows = mean @ _rows(mesh.tetrahedra, vectors, len(at_node))
            total = total + weight * _squared(rows, at_node)
    return total


def _means(mesh: TetrahedralMesh) -> tuple["csr_array", FloatArray]:
    """Return the matrix of averages around nodes, from tetrahedra, and the volumes there [m3]."""
    from scipy.sparse import csr_array

    volume = gradients(mesh).volume
    n_nodes, n_tets = len(mesh.positions), len(volume)
    quarter = np.repeat(volume / 4.0, 4)
    at_node = _at_nodes(mesh, quarter)
    where = (mesh.tetrahedra.ravel(), np.repeat(np.arange(n_tets), 4))
    return csr_array((quarter / at_node[where[0]], where), shape=(n_nodes, n_tets)), at_node


def _of_shear(mesh: TetrahedralMesh, mu: float) -> "csr_array":
    """Return the Hessian of the sum of mu V eps:eps over tetrahedra [N/m]."""
    from scipy.sparse import csr_array

    shape, volume = gradients(mesh)
    # eps:eps = (grad u : grad u + grad u : grad u^T) / 2
    same = np.einsum("tic,tjc->tij", shape, shape)
    blocks = np.einsum("tij,cd->ticjd", same, np.eye(3))
    blocks += np.einsum("tid,tjc->ticjd", shape, shape)
    blocks *= (mu * volume)[:, None, None, None, None]
    dofs = (3 * mesh.tetrahedra[:, :, None] + np.arange(3)).reshape(len(volume), 12)
    rows = np.repeat(dofs, 12, axis=1).ravel()
    columns = np.tile(dofs, (1, 12)).ravel()
    size = 3 * len(mesh.positions)
    return csr_array((blocks.ravel(), (rows, columns)), shape=(size, size))


def _at_nodes(mesh: TetrahedralMesh, shares: FloatArray) -> FloatArray:
    """Return the sum at each node of the shares of the corners of tetrahedra, shape (n_nodes,)."""
    n_nodes = len(mesh.positions)
    return np.asarray(
        np.bincount(mesh.tetrahedra.ravel(), weights=shares, minlength=n_nodes), float
    )


def _rows(nodes: IntArray, vectors: FloatArray, n_nodes: int) -> "csr_array":
    """Return the matrix that has, in row r, vector [r, i] in the columns of node [r, i]."""
    from scipy.sparse import csr_array

    n, width = nodes.shape
    columns = (3 * nodes[:, :, None] + np.arange(3)).ravel()
    rows: npt.NDArray[np.int64] = np.repeat(np.arange(n), 3 * width)
    return csr_array((vectors.ravel(), (rows, columns)), shape=(n, 3 * n_nodes))


def _squared(rows: "csr_array", weights: FloatArray) -> "csr_array":
    """Return the sum over rows of weight times row^T row."""
    from scipy.sparse import csr_array

    scaled = rows.multiply(np.sqrt(weights)[:, None])
    half = csr_array(scaled)
    return csr_array(half.T @ half)
