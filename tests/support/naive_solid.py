"""Slow reference versions of the forces of tetrahedra: deformation gradients and stresses."""

import numpy as np

from tissue import FloatArray, IntArray, TetrahedralMesh
from tissue.laws.energy_density import EnergyDensity


def edges(positions: FloatArray, tetrahedra: IntArray) -> FloatArray:
    """Return columns x1 - x0, x2 - x0, x3 - x0 of each tetrahedron [m], shape (n_tets, 3, 3)."""
    x = positions[tetrahedra]
    return (x[:, 1:] - x[:, :1]).transpose(0, 2, 1)


def volumes(mesh: TetrahedralMesh) -> FloatArray:
    """Return the volume of each tetrahedron at rest [m3]."""
    return np.linalg.det(edges(*mesh)) / 6.0


def gradients(mesh: TetrahedralMesh, positions: FloatArray) -> FloatArray:
    """Return the deformation gradient F of each tetrahedron, shape (n_tets, 3, 3)."""
    return edges(positions, mesh.tetrahedra) @ np.linalg.inv(edges(*mesh))


def around_nodes(mesh: TetrahedralMesh, values: FloatArray) -> FloatArray:
    """Return, for each node, a quarter of the sum of the values of the tetrahedra around it."""
    out = np.zeros(len(mesh.positions))
    np.add.at(out, mesh.tetrahedra, 0.25 * values[:, None])
    return out


def averaged_j(mesh: TetrahedralMesh, positions: FloatArray) -> FloatArray:
    """Return J of each node: volume of the tetrahedra around it over their volume at rest."""
    v = volumes(mesh)
    j = np.linalg.det(gradients(mesh, positions))
    return around_nodes(mesh, v * j) / around_nodes(mesh, v)


def w(law: EnergyDensity, q: FloatArray) -> FloatArray:
    """Return the energy of a law that stiffens over mu / 2, with its straight ends."""
    positive = np.maximum(q, 0.0)
    if law.exponent > 0.0:
        x = np.minimum(law.exponent * positive, 4.0)
        return (np.expm1(x) + np.exp(x) * (law.exponent * q - x)) / law.exponent
    return q + law.second * positive**2 + law.third * positive**3


def slope_of_w(law: EnergyDensity, q: FloatArray) -> FloatArray:
    """Return the derivative of `w`."""
    positive = np.maximum(q, 0.0)
    if law.exponent > 0.0:
        return np.exp(np.minimum(law.exponent * positive, 4.0))
    return 1.0 + 2.0 * law.second * positive + 3.0 * law.third * positive**2


def energy(mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity) -> float:
    """Return the elastic energy less that at rest [J]."""
    v, f = volumes(mesh), gradients(mesh, positions)
    squared, j = (f**2).sum(axis=(1, 2)), np.linalg.det(f)
    if law.exponent + law.second + law.third > 0.0:
        shear = 0.5 * law.mu * w(law, squared - 1.0 - 2.0 * j)
    else:
        shear = 0.5 * law.mu * (squared - 3.0 - np.log((squared + 1.0) / 4.0))
    rest = (1.0 - law.a) ** 2
    total = v @ (shear + 0.5 * law.lam_of_tetrahedra * ((j - law.a) ** 2 - rest))
    of_nodes = 0.5 * law.lam_of_nodes * ((averaged_j(mesh, positions) - law.a) ** 2 - rest)
    return float(total + around_nodes(mesh, v) @ of_nodes)


def stresses(mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity) -> FloatArray:
    """Return the first Piola-Kirchhoff stress of each tetrahedron [Pa], shape (n_tets, 3, 3)."""
    f = gradients(mesh, positions)
    squared, j = (f**2).sum(axis=(1, 2)), np.linalg.det(f)
    cofactors = j[:, None, None] * np.linalg.inv(f).transpose(0, 2, 1)
    p = law.lam_of_tetrahedra * (j - law.a)
    p = p + law.lam_of_nodes * (averaged_j(mesh, positions)[mesh.tetrahedra].mean(axis=1) - law.a)
    if law.exponent + law.second + law.third > 0.0:
        shear = law.mu * slope_of_w(law, squared - 1.0 - 2.0 * j)
        p = p - shear
    else:
        shear = law.mu * (1.0 - 1.0 / (squared + 1.0))
    return shear[:, None, None] * f + p[:, None, None] * cofactors


def forces(mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity) -> FloatArray:
    """Return the force on each node: minus V P grad N, summed over the tetrahedra around it [N]."""
    v, p = volumes(mesh), stresses(mesh, positions, law)
    pulls = -v[:, None, None] * p @ np.linalg.inv(edges(*mesh)).transpose(0, 2, 1)
    out = np.zeros_like(positions)
    for k in range(3):
        np.add.at(out, mesh.tetrahedra[:, k + 1], pulls[:, :, k])
        np.add.at(out, mesh.tetrahedra[:, 0], -pulls[:, :, k])
    return out
