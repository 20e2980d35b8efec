"""The elastic constants of springs on a given mesh, and springs as stiff as requested.

No choice of stiffnesses makes springs along the edges of an irregular mesh an exact elastic body
(Baudet et al. 2009 for van Gelder's): they are off by some 20 % in Young's modulus, have a
Poisson's ratio of their own, and are stiffer along some directions than along others. How much
depends on the mesh, so it is measured on the mesh: in six unit strains at small amplitude, as a
specimen would be tested.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray
from tissue.elasticity.stiffness_matrix import gradients, stiffness_matrix
from tissue.laws.mass_spring import MassSpring
from tissue.material import Material
from tissue.mesh.faces import sorted_faces
from tissue.mesh.mesh_arrays import mesh_arrays
from tissue.types import TetrahedralMesh

if TYPE_CHECKING:  # as in `tissue.elasticity.stiffness_matrix`
    from scipy.sparse import csr_array

PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
"""Voigt's order of the components: xx, yy, zz, yz, xz, xy."""


def _unit_strain(i: int, j: int) -> FloatArray:
    strain = np.zeros((3, 3))
    strain[i, j] = strain[j, i] = 1.0 if i == j else np.sqrt(0.5)
    return strain


STRAINS = np.stack([_unit_strain(*pair) for pair in PAIRS])
"""Unit strains in that order, shape (6, 3, 3). Shears are scaled by the root of two (Mandel), so
that strains are vectors of an orthonormal basis and the stiffness is a matrix in it."""

SOLVED = 1e-9
"""Relative residual at which the interior counts as at rest: the moduli are then exact to 1e-8 or
better, far below the error of a mesh."""

CALIBRATED = 1e-4
"""Largest relative error in Young's modulus after calibration."""

MOST_TRIALS = 30
"""Trials of calibration at most; the secant method takes four or five."""


class Effective(NamedTuple):
    """The elastic constants of a body, averaged over the three axes."""

    young_modulus: float
    """Stress over strain of a bar cut from the body along an axis [Pa]."""
    poisson_ratio: float
    """Transverse contraction of the bar over its extension."""
    zener_ratio: float
    """Shear modulus over that of an isotropic body which is as stiff along the axes: 1 if equal."""


class SpringError(NamedTuple):
    """Deviation of a network of springs from the material that it stands for."""

    asked: Effective
    """The material's own constants."""
    affine: Effective
    """Constants if every node follows the strain and shear is prevented: an upper bound."""
    relaxed: Effective
    """Constants if the surface follows the strain, nodes inside are in equilibrium, and the bar may
    shear: as springs behave in the engine."""
    softest: float
    """Young's modulus along the softest direction, relaxed [Pa]."""
    stiffest: float
    """Young's modulus along the stiffest direction, relaxed [Pa]."""

    @property
    def young_modulus_error(self) -> float:
        """Relative error of the relaxed Young's modulus; 0.2 is 20 % too stiff."""
        return self.relaxed.young_modulus / self.asked.young_modulus - 1.0


def spring_error(mesh: TetrahedralMesh, material: Material) -> SpringError:
    """Return the elastic constants of the material's springs, with their volume term, on this mesh.

    Exact for the given mesh, up to `SOLVED`. It takes a second for 5,000 tetrahedra. Under the
    neo-Hookean law there is no error.

    Args:
        mesh: The body at rest.
        material: The material requested.
    """
    mesh = mesh_arrays(mesh)
    stiffness = stiffness_matrix(mesh, material)
    affine_motion = np.einsum("sij,nj->sni", STRAINS, mesh.positions).reshape(6, -1)
    volume = float(gradients(mesh).volume.sum())
    inside = np.repeat(~on_surface(mesh), 3)
    motion = _relaxed(stiffness, affine_motion, inside)
    affine = affine_motion @ (stiffness @ affine_motion.T) / volume
    relaxed = motion @ (stiffness @ motion.T) / volume
    along = _young_moduli(np.linalg.inv(relaxed), _directions())
    nu = material.poisson_ratio
    return SpringError(
        asked=Effective(material.young_modulus, nu, 1.0),
        affine=_without_shear(affine),
        relaxed=_of_a_bar(relaxed),
        softest=float(along.min()),
        stiffest=float(along.max()),
    )


def calibrated(mesh: TetrahedralMesh, material: Material) -> Material:
    """Return the material with springs such that this mesh has the Young's modulus requested.

    One factor on all springs (`MassSpring.calibration`), found by the secant method on the
    relaxed modulus of `spring_error`. The Poisson's ratio of the mesh and its anisotropy stay as
    they are.

    Raises:
        ValueError: the law has no springs; or no factor gives this modulus, because the volume term
            alone is too stiff on this mesh.
    """
    if not isinstance(material.law, MassSpring):
        raise ValueError(
            f"law {material.law.name} has no springs to calibrate: its stiffness is exact on any "
            "mesh"
        )

    def error(factor: float) -> float:
        return spring_error(mesh, replace(material, law=MassSpring(factor))).young_modulus_error

    before, factor = 1.0, 1.0 / (1.0 + error(1.0))
    error_before = error(before)
    for _ in range(MOST_TRIALS):
        error_now = error(factor)
        if abs(error_now) < CALIBRATED:
            return replace(material, law=MassSpring(factor))
        slope = (error_now - error_before) / (factor - before)
        before, error_before = factor, error_now
        factor = max(factor - error_now / slope, 0.1 * factor) if slope > 0.0 else 0.5 * factor
    raise ValueError(
        f"no stiffness of the springs gives this mesh a Young's modulus of "
        f"{material.young_modulus:g} Pa at poisson_ratio {material.poisson_ratio:g}: use a lower "
        "ratio, a finer mesh, or law neo_hookean"
    )


def on_surface(mesh: TetrahedralMesh) -> BoolArray:
    """Return which nodes lie on faces of one tetrahedron, shape (n_nodes,)."""
    faces = sorted_faces(mesh.tetrahedra)
    outer = faces.halves[faces.starts[faces.counts == 1]]
    found = np.zeros(len(mesh.positions), dtype=np.bool_)
    opposite = mesh.tetrahedra[outer // 4]
    is_corner = np.arange(4) != (outer % 4)[:, None]
    found[opposite[is_corner]] = True
    return found


def _relaxed(matrix: "csr_array", motion: FloatArray, inside: BoolArray) -> FloatArray:
    """Return the motions with the degrees of freedom `inside` at rest, the others as given."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import cg

    settled = motion.copy()
    if not inside.any():
        return settled
    inner = matrix[inside][:, inside]
    preconditioner = diags_array(1.0 / inner.diagonal())
    for case in range(len(motion)):
        load = -(matrix @ motion[case])[inside]
        change, _ = cg(inner, load, rtol=SOLVED, maxiter=20 * len(load), M=preconditioner)
        settled[case, inside] += change
    return settled


def _without_shear(stiffness: FloatArray) -> Effective:
    """Return the constants of a cubic material with the mean entries of this stiffness."""
    c11 = float(np.diag(stiffness)[:3].mean())
    c12 = float(stiffness[[0, 0, 1], [1, 2, 2]].mean())
    twice_c44 = float(np.diag(stiffness)[3:].mean())  # the root of two, squared
    return Effective(
        young_modulus=(c11 - c12) * (c11 + 2.0 * c12) / (c11 + c12),
        poisson_ratio=c12 / (c11 + c12),
        zener_ratio=twice_c44 / (c11 - c12),
    )


def _of_a_bar(stiffness: FloatArray) -> Effective:
    """Return the constants of bars that are free to narrow and to shear."""
    compliance = np.linalg.inv(stiffness)
    s11 = float(np.diag(compliance)[:3].mean())
    s12 = float(compliance[[0, 0, 1], [1, 2, 2]].mean())
    s44 = float(np.diag(compliance)[3:].mean())
    return Effective(
        young_modulus=1.0 / s11, poisson_ratio=-s12 / s11, zener_ratio=(s11 - s12) / s44
    )


def _directions() -> FloatArray:
    """Return unit vectors over half the sphere, 3 degrees apart, shape (n, 3)."""
    polar, around = np.meshgrid(
        np.radians(np.arange(0.0, 91.0, 3.0)), np.radians(np.arange(0.0, 360.0, 3.0))
    )
    flat = np.sin(polar)
    vectors = [flat * np.cos(around), flat * np.sin(around), np.cos(polar)]
    return np.stack(vectors, axis=-1).reshape(-1, 3)


def _young_moduli(compliance: FloatArray, directions: FloatArray) -> FloatArray:
    """Return Young's modulus along each direction [Pa]."""
    stress = np.einsum("ni,nj,sij->ns", directions, directions, STRAINS)
    return np.asarray(1.0 / np.einsum("ns,st,nt->n", stress, compliance, stress))
