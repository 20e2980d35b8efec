"""Ties between two bodies: fibres of which both ends are in the tissue."""

from itertools import pairwise

import numpy as np
import pytest

from tests.support import strokes
from tissue import (
    BladeSegment,
    BladeSweep,
    Material,
    SolverSettings,
    Tissue,
    block,
    fixed_nodes,
    joined,
    placed,
)

GEL = Material(young_modulus=20e3, toughness=20.0)
LOW = block((4, 4, 2), (0.04, 0.04, 0.02))
HIGH = block((3, 3, 2), (0.03, 0.03, 0.02))
NOTHING = (0.0, 0.0, 0.0)
GAP = 1e-3


def two(*, gap=GAP, fixed="none", gravity=NOTHING, **solver) -> Tissue:
    """Return two blocks, one above the other."""
    mesh = joined({"low": LOW, "high": placed(HIGH, (0.005, 0.005, 0.02 + gap))})
    held = fixed_nodes(mesh, fixed, "low") if fixed != "none" else None
    return Tissue(mesh, GEL, fixed=held, gravity=gravity, solver=SolverSettings(**solver))


def layered(tissue, **changes):
    """Tie the facing skin of both by a layer."""
    facing = tissue.facing("high", "low", within=2e-3)
    numbers = {"stiffness": 900.0, "toughness": 20.0, "area": facing.area}
    return tissue.tie(facing.points, facing.others, **(numbers | changes))


def momenta(tissue):
    now = tissue.snapshot()
    each = (now.masses + now.added_masses)[:, None] * now.velocities
    return each.sum(axis=0), np.cross(now.positions, each).sum(axis=0)


def test_the_skin_that_faces_another_body_is_found_with_its_area():
    facing = two().facing("high", "low", within=2e-3)
    assert facing.area == pytest.approx(0.03 * 0.03, rel=1e-12)
    np.testing.assert_allclose(facing.points.rest - [0.0, 0.0, GAP], facing.others.rest, atol=1e-15)
    with pytest.raises(ValueError, match="no skin of the one body faces skin of the other within"):
        two().facing("high", "low", within=0.5e-3)


def test_the_momenta_of_free_bodies_do_not_change_and_the_account_closes():
    tissue = two(gap=4e-3, audit=True, relaxation="verlet")
    facing = tissue.facing("high", "low", within=5e-3)
    tie = tissue.tie(
        facing.points,
        facing.others,
        stiffness=50.0,
        damping=0.01,
        area=facing.area,
        toughness=100.0,
        rest_length=3e-3,
    )
    stored = 0.5 * 50.0 * 1e-3**2
    for _ in range(60):
        energies = tissue.step(None, strokes.DT).energies
    for total in momenta(tissue):
        np.testing.assert_allclose(total, 0.0, atol=1e-17)
    assert np.abs(tissue.snapshot().velocities).max() > 1e-3 and tie.n_points == 18
    assert (energies.work_of_loads, energies.released) == (0.0, pytest.approx(-stored))
    assert abs(energies.residual) < 0.02 * stored


def test_a_body_hangs_from_another_by_a_tie():
    tissue = two(fixed="bottom", gravity=(0.0, 0.0, 9.81))
    tie = layered(tissue)
    tissue.settle()
    tissue.step(None, strokes.DT)
    weight = 9.81 * 1000.0 * 0.03 * 0.03 * 0.02
    assert tie.wrench.force[2] == pytest.approx(weight, rel=0.01)
    gap = np.mean((tissue.positions_of(tie.points) - tissue.positions_of(tie.to))[:, 2])
    assert gap - GAP == pytest.approx(weight / 900.0, rel=0.05)


def upper(tissue, gap):
    """Hold the top of the upper block by springs."""
    mesh = joined({"low": LOW, "high": placed(HIGH, (0.005, 0.005, 0.02 + gap))})
    top = fixed_nodes(mesh, "top")
    held = tissue.attach(top, stiffness=5000.0, damping=1.0)
    return held, tissue.snapshot().positions[top].mean(axis=0)


def test_peeling_a_layer_costs_toughness_times_area():
    tissue = two(fixed="bottom", audit=True)
    tie = layered(tissue, stiffness=3000.0, toughness=4.0)
    held, at = upper(tissue, GAP)
    for height in np.arange(0.0, 0.015, 5e-5):
        held.move(at + np.array([0.0, 0.0, height]))
        energies = tissue.step(None, strokes.DT).energies
    assert tie.is_released and tie.n_points == 0
    assert energies.breaking == pytest.approx(4.0 * 9e-4, rel=1e-9)
    assert abs(energies.residual) < 1e-3 * energies.work_of_loads


def test_the_blade_cuts_a_layer_between_two_bodies():
    gap = 5e-3
    tissue = two(gap=gap, fixed="bottom", audit=True)
    facing = tissue.facing("high", "low", within=2.0 * gap)
    numbers = {"stiffness": 300.0, "toughness": 4.0, "area": facing.area}
    tie = tissue.tie(facing.points, facing.others, **numbers)
    upper(tissue, gap)
    ends = [np.array([x, 0.0, 0.02 + 0.5 * gap]) for x in (-0.005, 0.045)]
    ahead = [np.array([0.0, y, 0.0]) for y in np.arange(-0.002, 0.06, 1e-4)]
    poses = [BladeSegment(ends[0] + y, ends[1] + y, np.array([0.0, 1.0, 0.0])) for y in ahead]
    felt = [tissue.step(BladeSweep(a, b), strokes.DT) for a, b in pairwise(poses)]
    energies = felt[-1].energies
    assert tie.is_released and energies.cutting == 0.0
    assert energies.breaking == pytest.approx(4.0 * facing.area, rel=1e-9)
    assert abs(energies.residual) < 0.02 * energies.work_of_blade


def test_ties_are_kept_through_cuts_of_both_bodies():
    """Each end stays in the body that it was in, at its place in that at rest."""
    tissue = two(gap=0.0, fixed="left,right", precision="double")
    tie = layered(tissue, stiffness=3000.0)
    before = tie.to.rest.copy()
    strokes.make(tissue, strokes.upright(0.0187, -0.004, 0.05, -0.004, 0.045, 0.25))
    assert tissue.n_pieces() == 4
    arrays, now = tissue._stages.handles.attachments.arrays, tissue.snapshot()
    of_node = np.zeros(len(now.positions), np.int64)
    of_node[now.tetrahedra] = tissue.labels()[:, None]
    holds = arrays.state != 2
    assert 10 <= holds.sum() == tie.n_points
    assert (of_node[arrays.nodes] == 2).all() and (of_node[arrays.other_nodes] == 1).all()
    weights, nodes = arrays.other_weights[..., None], now.rest_positions[arrays.other_nodes]
    np.testing.assert_allclose((weights * nodes).sum(axis=1), before, atol=1e-9)


def test_stiff_ties_shorten_the_step_and_stay_stable():
    tissue = two(fixed="bottom", gravity=(0.0, 0.0, 9.81))
    layered(tissue, stiffness=1e6, damping=10.0)
    for _ in range(100):
        tissue.step(None, strokes.DT)
    assert np.abs(tissue.snapshot().velocities).max() < 0.1


def test_ties_are_part_of_the_state():
    tissue = two(fixed="bottom", gravity=(0.0, 0.0, 9.81))
    tie, other = layered(tissue), two(fixed="bottom", gravity=(0.0, 0.0, 9.81))
    state = tissue.save_state()
    for _ in range(20):
        tissue.step(None, strokes.DT)
    after = tissue.snapshot().positions
    other.load_state(type(state).from_bytes(state.to_bytes()))
    assert other.attachments[0].n_points == tie.n_points
    for _ in range(20):
        other.step(None, strokes.DT)
    np.testing.assert_array_equal(other.snapshot().positions, after)


def test_ends_that_cannot_be_are_refused():
    tissue = two()
    facing = tissue.facing("high", "low", within=2e-3)
    numbers = {"stiffness": 1.0, "area": 1e-6, "toughness": 1.0}
    with pytest.raises(ValueError, match="there are 2 other ends for 18 points; give one"):
        tissue.tie(facing.points, tissue.material_points([0, 1]), **numbers)
    tie = tissue.tie(facing.points, tissue.material_points([0]), **numbers)
    with pytest.raises(ValueError, match="its other ends are points of the tissue"):
        tie.move([0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="no tetrahedron has label 'fat'"):
        tissue.facing("fat", "low")
