"""Skin of one piece touches itself: what folds, and the walls of notches; and what does not."""

import numpy as np
import pytest

from scalpel_sim.scene.scene import GEL
from tests.support import strokes
from tissue import SolverSettings, TetrahedralMesh, Tissue, block

CELL = 0.004
"""Edge of the cells [m]; a node size is 2.8 mm."""


def bracket(gap: float) -> TetrahedralMesh:
    """Return two arms of 80 mm, 8 mm thick and a gap [m] apart, that a web joins at low x."""
    height = 0.016 + gap
    mesh = block((20, 3, round(height / CELL)), (0.08, 0.012, height))
    x, _, z = mesh.positions[mesh.tetrahedra].mean(axis=1).T
    corners = mesh.tetrahedra[(x < 0.016) | (np.abs(z - 0.5 * height) > 0.5 * gap)]
    used, kept = np.unique(corners, return_inverse=True)
    return TetrahedralMesh(mesh.positions[used], kept.reshape(-1, 4))


def fallen(gap: float, solver: SolverSettings) -> tuple[Tissue, float]:
    """Let the upper arm fall on the lower one; return the body and how low it came [m]."""
    mesh = bracket(gap)
    held, arm = mesh.positions[:, 2] < 1e-6, mesh.positions[:, 2] > 0.0079 + gap
    tissue = Tissue(mesh, GEL, fixed=held, solver=solver)
    lowest = np.inf
    for _ in range(200):
        tissue.step(None, strokes.DT)
        x, y, z = tissue.snapshot().positions[arm].T
        is_over = (x > 0.02) & (x < 0.078) & (y > 0.0) & (y < 0.012)
        lowest = min(lowest, z[is_over].min())
    return tissue, lowest


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
@pytest.mark.parametrize("gap", [0.004, 0.012, 0.032])
def test_an_arm_that_falls_on_another_of_the_same_piece_stays_on_it(gap, relaxation):
    """The upper arm would sag by 0.4 m, and hits the lower one at up to a metre a second.

    The gaps are 1.4, 4 and 11 node sizes. The lower arm is 8 mm thick, and gives way.
    """
    _, lowest = fallen(gap, SolverSettings(relaxation=relaxation))
    assert 0.0055 < lowest < 0.009


def test_edges_of_one_piece_are_not_tested_against_each_other():
    """A limit: docs/contact.md names it. Nodes hold the arm here."""
    tissue, _ = fallen(0.012, SolverSettings())
    contact = tissue._model.contact
    assert contact.forces.n_pressing > 5
    assert contact.search.edge_pairs.n_pairs == 0
