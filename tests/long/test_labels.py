"""Random incisions leave the volume of each label, and the mass of each material, as they were."""

import numpy as np

from tests.support import bodies, incisions
from tests.support.battery import battery
from tissue import Material, SolverSettings, Tissue
from tissue.mesh.validation import signed_volumes

N_LABELS, N_INCISIONS = 4, 10
KINDS = list(incisions.KINDS)


@battery(n_per_change=2, n_long=100)
def test_ten_incisions_keep_volume_and_mass_of_each_label(tally, case):
    mesh = bodies.jittered(3, case)
    labels = np.random.default_rng(case).integers(0, N_LABELS, len(mesh.tetrahedra))
    before = np.bincount(labels, weights=signed_volumes(mesh.positions, mesh.tetrahedra))
    densities = 1000.0 + 100.0 * np.arange(N_LABELS)
    materials = {i: Material(density=each) for i, each in enumerate(densities)}
    solver = SolverSettings(mass_scaling=None)
    tissue = Tissue(mesh._replace(labels=labels), materials, solver=solver)
    for k in range(N_INCISIONS):
        kind = KINDS[(case + k) % len(KINDS)]
        tissue.incise(*incisions.incision(mesh, kind, N_INCISIONS * case + k))
    body = tissue.snapshot()
    volumes = signed_volumes(body.rest_positions, body.tetrahedra)
    np.testing.assert_allclose(np.bincount(body.labels, weights=volumes), before, rtol=1e-9)
    np.testing.assert_allclose(body.masses.sum(), densities @ before, rtol=1e-12)
    tally["tetrahedra made"] += len(body.tetrahedra) - len(mesh.tetrahedra)
