"""Bodies settle: to where forces balance, also where forces are rounded."""

import numpy as np

from tests import bodies
from tissue import Material, SolverSettings, Tissue, liver_lobe
from tissue.integrators.equilibrium import LONGEST_SETTLING

STRETCH = np.array([1.05, 1.0, 1.0])


def test_single_precision_settles_where_double_does_and_as_soon():
    """Accelerations of a stretched organ fall to some 0.02 m/s2 and no further."""
    mesh, found = liver_lobe(), {}
    for precision in ("single", "double"):
        tissue = Tissue(
            mesh,
            Material(law="neo_hookean", poisson_ratio=0.45, young_modulus=4.74e3),
            fixed=bodies.sides(mesh, share=0.08),
            positions=mesh.positions * STRETCH,
            solver=SolverSettings(precision=precision),
        )
        found[precision] = tissue.settle(), tissue.snapshot().positions
    (steps, positions), (steps_double, positions_double) = found["single"], found["double"]
    assert steps < 2 * steps_double < LONGEST_SETTLING
    np.testing.assert_allclose(positions, positions_double, atol=2e-5)
