"""Slow reference version of stress that relaxes: one matrix for each tetrahedron and term."""

import numpy as np

from tests.support import naive_solid
from tissue import FloatArray, TetrahedralMesh
from tissue.laws.energy_density import EnergyDensity


def elastic_parts(
    mesh: TetrahedralMesh, positions: FloatArray, law: EnergyDensity
) -> tuple[FloatArray, FloatArray]:
    """Return the second Piola-Kirchhoff stress of the shear part, and the pressure [Pa].

    Shapes (n_tets, 3, 3) and (n_tets,). The pressure is that of the whole stress less what the
    shear part takes to be zero at rest.
    """
    f = naive_solid.gradients(mesh, positions)
    j = np.linalg.det(f)
    p = law.lam_of_tetrahedra * (j - 1.0)
    of_nodes = law.lam_of_nodes * (naive_solid.averaged_j(mesh, positions) - 1.0)
    p = p + of_nodes[mesh.tetrahedra].mean(axis=1)
    inverse = np.linalg.inv(f)
    cofactors = j[:, None, None] * inverse.transpose(0, 2, 1)
    shear = naive_solid.stresses(mesh, positions, law) - p[:, None, None] * cofactors
    return inverse @ shear, p


class Relaxation:
    """What has relaxed in each tetrahedron of a mesh.

    Args:
        mesh: The body at rest.
        law: Its elastic law.
        prony: g and tau [s] of each term.
    """

    def __init__(self, mesh, law, prony):
        self.mesh, self.law, self.prony = mesh, law, prony
        n = len(mesh.tetrahedra)
        self.stress = np.zeros((len(prony), n, 3, 3))
        self.pressure = np.zeros((len(prony), n))

    def relax(self, positions, seconds):
        """Let stress relax at those positions [m] for that time [s]."""
        stress, pressure = elastic_parts(self.mesh, positions, self.law)
        for i, (share, time) in enumerate(self.prony):
            left = np.exp(-seconds / time)
            self.stress[i] = left * self.stress[i] + (1.0 - left) * share * stress
            self.pressure[i] = left * self.pressure[i] + (1.0 - left) * share * pressure

    def forces(self, positions):
        """Return the forces on the nodes [N]."""
        mesh = self.mesh
        f = naive_solid.gradients(mesh, positions)
        j = np.linalg.det(f)[:, None, None]
        cofactors = j * np.linalg.inv(f).transpose(0, 2, 1)
        whole = naive_solid.stresses(mesh, positions, self.law) - f @ self.stress.sum(axis=0)
        whole = whole - self.pressure.sum(axis=0)[:, None, None] * cofactors
        normals = np.linalg.inv(naive_solid.edges(*mesh))  # rows: gradients of N1, N2, N3
        of_corners = -naive_solid.volumes(mesh)[:, None, None] * (
            whole @ normals.transpose(0, 2, 1)
        )
        out = np.zeros_like(positions)
        for k in range(3):
            np.add.at(out, mesh.tetrahedra[:, k + 1], of_corners[:, :, k])
            np.add.at(out, mesh.tetrahedra[:, 0], -of_corners[:, :, k])
        return out
