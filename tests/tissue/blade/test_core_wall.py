"""The edge at a rigid core, which it does not cut."""

from itertools import pairwise

import numpy as np
import pytest

from tissue import (
    BladeSegment,
    BladeSweep,
    CoreCutError,
    Material,
    SolverSettings,
    Tissue,
    block,
    fixed_nodes,
)

MESH = block((9, 6, 6), (0.03, 0.02, 0.02))
MIDDLE = np.array([0.015, 0.01, 0.01])
INSIDE = np.linalg.norm(MESH.positions - MIDDLE, axis=1) < 0.006
GEL = Material(young_modulus=5e3, law="neo_hookean", viscous_damping=10.0, toughness=20.0)
STILL = (0.0, 0.0, 0.0)


def with_stone(material=GEL, **solver):
    settings = SolverSettings(audit=True, **solver)
    held = fixed_nodes(MESH, "bottom")
    tissue = Tissue(MESH, material, fixed=held, gravity=STILL, solver=settings)
    tissue.make_rigid(INSIDE)
    return tissue


def edge(x, aside=2e-4):
    """Return an upright edge through the whole block, which faces along x."""
    tip, heel = ([x, MIDDLE[1] + aside, z] for z in (-0.004, 0.026))
    return BladeSegment(np.array(tip), np.array(heel), np.array([1.0, 0.0, 0.0]))


def shape_of(tissue):
    """Return the distances between the corners of the tetrahedra of the core [m]."""
    body = tissue.snapshot()
    core = INSIDE[MESH.tetrahedra].all(axis=1)
    corners = body.positions[body.tetrahedra[: len(core)][core]].reshape(-1, 3)
    return np.linalg.norm(corners[:, None] - corners[None], axis=2)


def test_an_edge_is_held_at_a_core_and_cuts_the_tissue_beside_it():
    tissue, forces, states = with_stone(), [], set()
    before = shape_of(tissue)
    for t0, t1 in pairwise(edge(x) for x in np.arange(-0.001, 0.04, 1e-4)):
        result = tissue.step(BladeSweep(t0, t1), 1e-3)
        forces.append(float(np.linalg.norm(result.wrench.force)))
        states |= {each.state for each in tissue.acting_forces()}
    np.testing.assert_allclose(shape_of(tissue), before, atol=1e-12)
    assert "anchored, at a rigid core" in states
    assert max(forces) > 2.0 * max(forces[:60])  # the edge came to the core after 60 steps
    assert tissue.cut_report().n_cut_nodes > 50
    energies = result.energies
    assert abs(energies.residual) < 1e-2 * energies.work_of_blade


def test_a_cut_that_is_given_leaves_a_core_whole():
    tissue = with_stone()
    before = shape_of(tissue)
    rows = [[[x, 0.0102, -0.004], [x, 0.0102, 0.026]] for x in np.arange(-0.001, 0.032, 5e-4)]
    area = tissue.incise(rows, (1.0, 0.0, 0.0))
    section = np.pi * 0.006**2
    assert 0.03 * 0.02 - 2.0 * section < area < 0.03 * 0.02
    np.testing.assert_array_equal(shape_of(tissue), before)
    assert tissue.n_pieces() == 1


def test_a_step_in_which_the_paper_s_scheme_would_cut_a_core_is_undone():
    springs = Material(young_modulus=5e3, law="springs", poisson_ratio=0.25, toughness=5.0)
    tissue = with_stone(springs, scheme="paper")
    with pytest.raises(CoreCutError, match="has come to a rigid core, which it does not cut, at"):
        for t0, t1 in pairwise(edge(x) for x in np.arange(-0.001, 0.04, 1e-4)):
            state = tissue.snapshot()
            tissue.step(BladeSweep(t0, t1), 1e-3)
    assert all(np.array_equal(a, b) for a, b in zip(state, tissue.snapshot(), strict=True))
    assert tissue.n_tetrahedra > len(MESH.tetrahedra)
