"""Forces of tetrahedra in single precision, against those in double."""

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.tissue.solids import LAWS, moved, solid_of
from tissue import Material, SolverSettings, Tissue
from tissue.core.jit import is_compiling

MESH = bodies.jittered(3, 1)

LARGEST_ERROR = 2e-6
"""Of a force, per largest force: some thirty roundings of single precision (6e-8)."""

in_kernels = pytest.mark.kernel


@in_kernels
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_forces_in_single_precision_are_those_in_double(law):
    double, single = solid_of(MESH, law), solid_of(MESH, law, is_single=True)
    for share in (1e-4, 1e-2, 0.1):
        x = moved(MESH, share)
        expected = double.forces(x)
        error = np.abs(single.forces(x) - expected).max()
        assert error < LARGEST_ERROR * np.abs(expected).max()


@in_kernels
def test_forces_in_single_precision_are_zero_at_rest_and_balance_elsewhere():
    for law in LAWS.values():
        assert not solid_of(MESH, law).forces(MESH.positions).any()
        single = solid_of(MESH, law, is_single=True)
        assert not single.forces(MESH.positions).any()
        forces = single.forces(moved(MESH))
        assert np.abs(forces.sum(axis=0)).max() < LARGEST_ERROR * np.abs(forces).max()


@in_kernels
def test_the_energy_in_single_precision_is_that_in_double():
    for law in LAWS.values():
        double, single = solid_of(MESH, law), solid_of(MESH, law, is_single=True)
        x = moved(MESH, 0.03)
        assert single.energy(x) == pytest.approx(double.energy(x), rel=1e-5)


@pytest.mark.skipif(not is_compiling(), reason="a whole cut: compiled only")
@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_the_force_of_a_whole_cut_in_single_precision_is_within_a_hundredth(relaxation):
    force = {}
    for precision in ("double", "single"):
        solver = SolverSettings(relaxation=relaxation, precision=precision)
        material = Material(law="neo_hookean", poisson_ratio=0.45, toughness=5.0)
        tissue = Tissue(BLOCK, material, fixed=bodies.sides(BLOCK), solver=solver)
        results = strokes.make(tissue, strokes.straight(BLOCK))
        force[precision] = np.array([result.wrench.force for result in results])
    difference = np.abs(force["single"] - force["double"]).max()
    assert difference < 0.01 * np.abs(force["double"]).max()


BLOCK = bodies.jittered(4, 2, size=0.04)
