"""A body of tetrahedra without springs: its forces, its energy and its relaxation."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from tests.tissue.kernels_of import springs_of
from tissue import BoolArray, FloatArray, TetrahedralMesh
from tissue.core.jit import kernel
from tissue.core.simd import store_point
from tissue.elasticity.energy import solid_energy
from tissue.elasticity.finite_elements import Solid, averages_shear, n_blocks, no_solid
from tissue.elasticity.frequency.at_rest import bound_solid_frequencies
from tissue.elasticity.neo_hookean import deform_solid, solid_force, solid_forces
from tissue.elasticity.rest_shapes import build_tetrahedra
from tissue.elasticity.stars import build_stars, room_for_stars
from tissue.elasticity.viscoelasticity import prepare_relaxation, relax_blocks, relax_nodes
from tissue.elasticity.viscous_stress import Viscosity, no_viscosity, viscous_corner_forces
from tissue.laws.energy_density import (
    EnergyDensity,
    averaged_shear,
    exponential,
    neo_hookean,
    polynomial,
    volume_term,
)
from tissue.mesh.body import Body, build_body
from tissue.mesh.star import LARGEST_STAR, no_visits

YOUNG_MODULUS = 10e3


def law_of(poisson_ratio: float, averaged: bool = True) -> EnergyDensity:
    """Return the neo-Hookean law with Young's modulus `YOUNG_MODULUS`."""
    return neo_hookean(*lame(poisson_ratio), averaged=averaged)


def lame(poisson_ratio: float) -> tuple[float, float]:
    """Return Lame's mu and lam for Young's modulus `YOUNG_MODULUS` [Pa]."""
    mu = YOUNG_MODULUS / (2.0 * (1.0 + poisson_ratio))
    return mu, 2.0 * mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio)


LAWS = {
    "averaged": law_of(0.45),
    "plain": law_of(0.45, averaged=False),
    "averaged volume": volume_term(20e3),
    "plain volume": volume_term(20e3, averaged=False),
    "half averaged": law_of(0.45).replaced(
        mu=4e3, lam_of_tetrahedra=10e3, lam_of_nodes=10e3, a=1.15
    ),
    "exponential": exponential(*lame(0.45), 12.0),
    "yeoh": polynomial(*lame(0.45), 2.0, 5.0),
    "averaged shear": averaged_shear(law_of(0.45)),
    "averaged exponential": averaged_shear(exponential(*lame(0.45), 12.0)),
    "averaged yeoh": averaged_shear(polynomial(*lame(0.45), 2.0, 5.0)),
}


class SolidBody(NamedTuple):
    """A body and its tetrahedra as a solid."""

    body: Body
    solid: Solid

    def forces(self, positions: FloatArray) -> FloatArray:
        """Return the forces on the nodes at `positions` [N]."""
        out = np.zeros((self.body.n_nodes, 3))
        evaluate(self.solid, self.body, self.placed(positions), out)
        return out

    def energy(self, positions: FloatArray) -> float:
        """Return the elastic energy of the nodes at `positions`, less that at rest [J]."""
        return solid_energy(self.solid, self.body, self.placed(positions))

    def viscous_forces(self, positions: FloatArray, velocities: FloatArray) -> FloatArray:
        """Return the viscous forces on the nodes per retardation time [N/s]."""
        out = np.zeros((self.body.n_nodes, 3))
        self.body.velocities[: len(velocities)] = velocities
        viscosity = no_viscosity(self.solid, is_viscous=True)
        evaluate_viscous(viscosity, self.solid, self.body, self.placed(positions), out)
        return out

    def placed(self, positions: FloatArray) -> FloatArray:
        """Copy the positions into the body; return its array, which has spare capacity."""
        self.body.positions[: len(positions)] = positions
        return self.body.positions

    def frequency(self) -> float:
        """Return the bound on the angular frequencies [1/s]."""
        return float(np.sqrt(self.solid.frequency_squared[: self.body.n_nodes].max()))


def solid_of(
    mesh: TetrahedralMesh,
    law: EnergyDensity,
    fixed: BoolArray | None = None,
    *,
    prony: Sequence[tuple[float, float]] = (),
    is_single: bool = False,
) -> SolidBody:
    """Return the body of a mesh as a solid."""
    body = build_body(mesh, None, fixed)
    springs_of(body)
    return built(body, law, prony=prony, is_single=is_single)


def built(
    body: Body,
    law: EnergyDensity,
    *,
    prony: Sequence[tuple[float, float]] = (),
    is_single: bool = False,
) -> SolidBody:
    """Return the solid of a body whose masses are set."""
    n, n_tetrahedra = body.n_nodes, body.n_tetrahedra
    room = (len(body.rest), len(body.tetrahedra))
    terms = np.array(prony, dtype=np.float64).reshape(-1, 2, 1)
    series = terms[:, 0], terms[:, 1]
    solid = no_solid(law, *room, room_for_stars(*room), series=series, is_single=is_single)
    visits = no_visits(*room)
    build_tetrahedra(solid, body, solid.every, n_tetrahedra)
    around = np.zeros(LARGEST_STAR, dtype=np.int64)
    assert build_stars(solid, body, visits, solid.every, n, around) == n
    assert bound_solid_frequencies(solid, body, visits, solid.every, n) == n
    return SolidBody(body, solid)


def relax(solid: SolidBody, positions: FloatArray, seconds: float) -> None:
    """Let the stress of the nodes at `positions` relax for that time [s]."""
    solid.placed(positions)
    relax_where_it_is(solid.solid, solid.body, seconds)


def moved(mesh: TetrahedralMesh, share: float = 0.1, seed: int = 0) -> FloatArray:
    """Return random positions around rest; the spread is a share of the extent."""
    noise = np.random.default_rng(seed).normal(size=mesh.positions.shape)
    return mesh.positions + share * np.ptp(mesh.positions) * noise


def highest_frequency(solid: SolidBody, positions: FloatArray | None = None) -> float:
    """Return the highest angular frequency at rest or at `positions` [1/s]."""
    here = solid.body.rest[: solid.body.n_nodes].copy() if positions is None else positions
    free = np.repeat(~solid.body.fixed[: len(here)], 3)
    roots = np.sqrt(np.repeat(solid.body.masses[: len(here)], 3))
    step = 1e-6 * np.ptp(here)

    def product(u):
        direction = np.where(free, u.ravel() / roots, 0.0).reshape(-1, 3)
        direction = (
            direction / np.abs(direction).max()
            if (longest := np.abs(direction).max())
            else direction
        )
        pull = solid.forces(here - step * direction) - solid.forces(here + step * direction)
        return np.where(free, longest * pull.ravel() / (2.0 * step) / roots, 0.0)

    n = len(roots)
    start = np.random.default_rng(0).normal(size=n)
    operator = LinearOperator((n, n), matvec=product, dtype=np.float64)
    return float(np.sqrt(eigsh(operator, k=1, which="LA", v0=start, tol=1e-4)[0][0]))


@kernel
def evaluate(solid: Solid, body: Body, positions: FloatArray, out: FloatArray) -> None:
    """Write the forces on all nodes to `out`."""
    solid_forces(solid, body, positions)
    for i in range(body.n_nodes):
        store_point(out, i, solid_force(solid, i))


@kernel
def evaluate_viscous(
    viscosity: Viscosity, solid: Solid, body: Body, positions: FloatArray, out: FloatArray
) -> None:
    """Write the viscous forces on all nodes to `out`."""
    viscous_corner_forces(viscosity, solid, body, positions, body.velocities)
    for i in range(body.n_nodes):
        store_point(out, i, solid_force(solid, i))


@kernel
def relax_where_it_is(solid: Solid, body: Body, seconds: float) -> None:
    """Let the stress of a body relax for that time [s]."""
    deform_solid(solid, body, body.positions)
    prepare_relaxation(solid, seconds)
    relax_blocks(solid, 0, n_blocks(solid, body.n_tetrahedra))
    if averages_shear(solid):
        relax_nodes(solid, 0, body.n_nodes)
