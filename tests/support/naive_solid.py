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
    return np.linalg.det(edges(mesh.positions, mesh.tetrahedra)) / 6.0


def gradients(mesh: TetrahedralMesh, positions: FloatArray) -> FloatArray:
    """Return the deformation gradient F of each tetrahedron, shape (n_tets, 3, 3)."""
    return edges(positions, mesh.tetrahedra) @ np.linalg.inv(edges(mesh.positions, mesh.tetrahedra))


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


def averaged_gradients(mesh: TetrahedralMesh, positions: FloatArray) -> FloatArray:
    """Return F averaged around each node by volume, shape (n_nodes, 3, 3)."""
    v, f = volumes(mesh), gradients(mesh, positions)
    sums = [around_nodes(mesh, v * f[:, i, j]) for i in range(3) for j in range(3)]
    return (np.array(sums) / around_nodes(mesh, v)).T.reshape(-1, 3, 3)


def shear_energy(law: EnergyDensity, f: FloatArray) -> FloatArray:
    """Return the shear part of the energy per volume [J/m3], 0 at rest without stress there."""
    squared, j = (f**2).sum(axis=(1, 2)), np.linalg.det(f)
    if law.exponent + law.second + law.third > 0.0:
        return 0.5 * law.mu * w(law, squared - 1.0 - 2.0 * j)
    return 0.5 * law.mu * (squared - 3.0 - np.log((squared + 1.0) / 4.0) - 1.5 * (j - 1.0))


def shear_stress(law: EnergyDensity, f: FloatArray) -> FloatArray:
    """Return the derivative of `shear_energy` [Pa]."""
    squared, c = (f**2).sum(axis=(1, 2))[:, None, None], cofactors(f)
    if law.exponent + law.second + law.third > 0.0:
        factor = slope_of_w(law, (squared - 1.0 - 2.0 * np.linalg.det(f)[:, None, None]))
        return law.mu * factor * (f - c)
    return law.mu * ((1.0 - 1.0 / (squared + 1.0)) * f - 0.75 * c)


def cofactors(f: FloatArray) -> FloatArray:
    """Return the cofactors of matrices that can be inverted."""
    return np.linalg.det(f)[:, None, None] * np.linalg.inv(f).transpose(0, 2, 1)


def volume_energy(law: EnergyDensity, lam: float, j: FloatArray) -> FloatArray:
    """Return lam/2 ((J - a)^2 - (1 - a)^2), without the part that is linear in J of the shear."""
    linear = 0.0 if law.a == 1.0 else lam * (law.a - 1.0) * (j - 1.0)
    return 0.5 * lam * ((j - law.a) ** 2 - (1.0 - law.a) ** 2) + linear


def shear_measure(f: FloatArray) -> FloatArray:
    """Return q = |F|^2 - 1 - 2 J."""
    return (f**2).sum(axis=(1, 2)) - 1.0 - 2.0 * np.linalg.det(f)


def spread(mesh: TetrahedralMesh, positions: FloatArray) -> FloatArray:
    """Return the spread of q around each node over that at which averages are given up, 0.03."""
    v, q = volumes(mesh), shear_measure(gradients(mesh, positions))
    averaged = around_nodes(mesh, v * q) / around_nodes(mesh, v)
    own = shear_measure(averaged_gradients(mesh, positions))
    return np.maximum(0.5 * (averaged - own), 0.0) / 0.03


def energy(mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity) -> float:
    """Return the elastic energy less that at rest [J]."""
    v, f, share = volumes(mesh), gradients(mesh, positions), law.shear_of_nodes
    j, of_nodes = np.linalg.det(f), averaged_j(mesh, positions)
    own = (1.0 - share) * shear_energy(law, f) + volume_energy(law, law.lam_of_tetrahedra, j)
    mean = volume_energy(law, law.lam_of_nodes, of_nodes)
    if share:
        x = spread(mesh, positions)
        taken = 0.03 * (x - 2.0 * np.log1p(x) - 1.0 / (1.0 + x) + 1.0)
        mean = mean + share * shear_energy(law, averaged_gradients(mesh, positions))
        mean = mean + share * law.shear_modulus * taken
    return float(v @ own + around_nodes(mesh, v) @ mean)


def taken_back(mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity) -> FloatArray:
    """Return the shear modulus that tetrahedra take back around each node [Pa], (n_nodes, 1, 1)."""
    x = spread(mesh, positions)
    return (law.shear_of_nodes * law.shear_modulus * (x / (1.0 + x)) ** 2)[:, None, None]


def shear_stress_of_tetrahedra(
    mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity
) -> FloatArray:
    """Return the stress of the shear of each tetrahedron by itself [Pa], shape (n_tets, 3, 3)."""
    f = gradients(mesh, positions)
    taken = taken_back(mesh, positions, law)[mesh.tetrahedra].mean(axis=1)
    return (1.0 - law.shear_of_nodes) * shear_stress(law, f) + taken * (f - cofactors(f))


def shear_stress_of_nodes(
    mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity
) -> FloatArray:
    """Return the stress of the averaged shear of each node [Pa], shape (n_nodes, 3, 3)."""
    f = averaged_gradients(mesh, positions)
    taken = taken_back(mesh, positions, law)
    return law.shear_of_nodes * shear_stress(law, f) - taken * (f - cofactors(f))


def stresses(mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity) -> FloatArray:
    """Return the first Piola-Kirchhoff stress of each tetrahedron [Pa], shape (n_tets, 3, 3)."""
    f = gradients(mesh, positions)
    of_nodes = law.lam_of_nodes * (averaged_j(mesh, positions) - 1.0)
    p = law.lam_of_tetrahedra * (np.linalg.det(f) - 1.0) + of_nodes[mesh.tetrahedra].mean(axis=1)
    total = shear_stress_of_tetrahedra(mesh, positions, law) + p[:, None, None] * cofactors(f)
    if law.shear_of_nodes:
        mean = shear_stress_of_nodes(mesh, positions, law)[mesh.tetrahedra].mean(axis=1)
        total = total + mean
    return total


def forces(mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity) -> FloatArray:
    """Return the force on each node: minus V P grad N, summed over the tetrahedra around it [N]."""
    v, p = volumes(mesh), stresses(mesh, positions, law)
    pulls = (
        -v[:, None, None]
        * p
        @ np.linalg.inv(edges(mesh.positions, mesh.tetrahedra)).transpose(0, 2, 1)
    )
    out = np.zeros_like(positions)
    for k in range(3):
        np.add.at(out, mesh.tetrahedra[:, k + 1], pulls[:, :, k])
        np.add.at(out, mesh.tetrahedra[:, 0], -pulls[:, :, k])
    return out


def viscous_moduli(law: EnergyDensity) -> tuple[FloatArray, FloatArray]:
    """Return mu and lam of tetrahedra by themselves, and of averages around nodes [Pa].

    Those of the stiffness at rest, but that no bulk modulus of tetrahedra is negative.
    """
    mu = law.shear_modulus * np.array([1.0 - law.shear_of_nodes, law.shear_of_nodes])
    lam = np.array([law.lam_of_tetrahedra, law.lam_of_nodes])
    lam -= law.excess * np.array([1.0 - law.shear_of_nodes, law.shear_of_nodes])
    lacking = max(-lam[0] - 2.0 / 3.0 * mu[0], 0.0) if law.lam_of_nodes else 0.0
    return mu, lam + np.array([lacking, -lacking])


def largest_growth(mesh: TetrahedralMesh, positions: FloatArray) -> FloatArray:
    """Return by how much the square of a face of each tetrahedron has grown at most, or 1."""

    def squares(x):
        corners = x[mesh.tetrahedra]
        faces = [np.delete(corners, k, axis=1) for k in range(4)]
        normals = [np.cross(f[:, 1] - f[:, 0], f[:, 2] - f[:, 0]) for f in faces]
        return np.array([(n**2).sum(axis=1) for n in normals])

    return np.maximum((squares(positions) / squares(mesh.positions)).max(axis=0), 1.0)


def viscous_forces(
    mesh: TetrahedralMesh, positions: FloatArray, velocities: FloatArray, law: EnergyDensity
) -> FloatArray:
    """Return the viscous force on each node per retardation time [N/s].

    Minus V T cof F grad N with T = 2 mu J d + lam tr(J d) 1, J d = sym(F' (cof F)^T).
    """
    v, inverse = volumes(mesh), np.linalg.inv(edges(mesh.positions, mesh.tetrahedra))
    share = 2.0 / (1.0 + largest_growth(mesh, positions))
    c = share[:, None, None] * cofactors(gradients(mesh, positions))
    rate = edges(velocities, mesh.tetrahedra) @ inverse @ c.transpose(0, 2, 1)
    rate = 0.5 * (rate + rate.transpose(0, 2, 1))
    sums = [around_nodes(mesh, v * rate[:, i, j]) for i in range(3) for j in range(3)]
    of_nodes = (np.array(sums) / around_nodes(mesh, v)).T.reshape(-1, 3, 3)
    stress = np.zeros_like(rate)
    for r, mu, lam in zip(
        (rate, of_nodes[mesh.tetrahedra].mean(axis=1)), *viscous_moduli(law), strict=True
    ):
        stress += 2.0 * mu * r + lam * np.trace(r, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    pulls = -v[:, None, None] * stress @ c @ inverse.transpose(0, 2, 1)
    out = np.zeros_like(positions)
    for k in range(3):
        np.add.at(out, mesh.tetrahedra[:, k + 1], pulls[:, :, k])
        np.add.at(out, mesh.tetrahedra[:, 0], -pulls[:, :, k])
    return out
