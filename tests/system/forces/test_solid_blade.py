"""The whole blade is solid: its back and ends push, only its edge cuts, and its tip pierces."""

import itertools

import numpy as np
import pytest

from scalpel_sim.validate import spine
from scalpel_sim.validate.findings import FAIL, PASS
from tests.support import strokes
from tissue import BladeShape, BladeSweep, Material, SolverSettings, Tissue, block

SIZE = (0.06, 0.06, 0.03)
EDGE, TOP = 0.02, SIZE[2]
SHAPE = BladeShape()
GEL = Material(10e3, toughness=20.0, viscous_damping=50.0)
DOWN, MIDDLE = np.array([0.0, 0.0, -1.0]), np.array([0.0311, 0.0307, TOP])
LEADS = {  # places of tip and heel from the leading point, and where the edge faces
    "back": ((0.0, -EDGE / 2, SHAPE.height), (0.0, EDGE / 2, SHAPE.height), (0.0, 0.0, 1.0)),
    "heel": ((0.0, 0.0, EDGE), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "tip": ((0.0, 0.0, 0.0), (0.0, 0.0, EDGE), (0.0, 1.0, 0.0)),
}


def body(material=GEL, cells=(12, 12, 6)):
    mesh = block(cells, SIZE)
    held = mesh.positions[:, 2] == 0.0
    solver = SolverSettings(audit=True)
    return Tissue(mesh, material, fixed=held, gravity=(0, 0, 0), blade=SHAPE, solver=solver)


def led(leads, depths, beside=(0.0, 0.0, 0.0)):
    """Return a stroke whose leading point goes to these depths below the skin [m]."""
    tip, heel, forward = LEADS[leads]
    at = MIDDLE + np.array(beside)
    places = [at + depth * DOWN for depth in depths]
    return [strokes.pose(p + tip, p + heel, forward) for p in places]


def down_to(depth, speed=0.05):
    return np.arange(-0.5e-3, depth + 1e-9, speed * strokes.DT)


@pytest.mark.parametrize("leads", ["back", "heel"])
def test_a_blade_led_spine_or_heel_first_dents_and_cuts_nothing(leads):
    tissue, pressed = body(), []
    for places in itertools.pairwise(led(leads, down_to(6e-3))):
        last = tissue.step(BladeSweep(*places), strokes.DT)
        contacts = last.contacts
        # At the heel the end of the edge holds skin for an instant, and then it drags by 1 mN more.
        of_side = contacts.normal @ DOWN > 0.9
        pressed.append(contacts.normal_force[of_side].sum())
    assert last.wrench.force[2] > 0.1
    assert (np.diff(pressed[10:]) > -1e-3).all()
    assert last.cut_area == 0.0
    # At the heel the end of the edge itself slips a little over the skin.
    assert last.energies.cutting < (0.01 if leads == "heel" else 1e-9) * last.energies.work_of_blade
    assert tissue.bounds[1, 2] < TOP + 3e-3


def test_the_dent_goes_back_with_the_blade_and_its_energy_with_it():
    tissue = body()
    depths = down_to(4e-3)
    results = strokes.make(tissue, led("back", np.append(depths, depths[::-1])))
    pressed, last = results[len(depths) - 1].energies, results[-1].energies
    assert last.held == 0.0
    assert last.work_of_blade < 0.2 * pressed.work_of_blade
    assert abs(last.residual) < 1e-3 * pressed.work_of_blade
    assert not tissue.step(None, strokes.DT).wrench.force.any()


@pytest.mark.parametrize("leads", list(LEADS))
def test_forces_and_torques_of_the_blunt_sides_have_their_opposites(leads):
    results = strokes.make(body(), led(leads, down_to(4e-3), beside=(0.0, 0.004, 0.0)))
    last = results[-1]
    np.testing.assert_allclose(last.force_on_tissue, -last.wrench.force, atol=1e-15)
    contacts = last.contacts
    forces = contacts.normal * contacts.normal_force[:, None] + contacts.friction
    levers = contacts.point - last.wrench_t1.point
    np.testing.assert_allclose(last.wrench_t1.force, -forces.sum(axis=0), atol=1e-12)
    np.testing.assert_allclose(last.wrench_t1.torque, -np.cross(levers, forces).sum(0), atol=1e-12)


def test_a_tip_pierces_at_toughness_times_height_and_pays_for_it():
    material = GEL
    results = strokes.make(body(material), led("tip", down_to(8e-3)))
    steady = np.array([result.wrench.force[2] for result in results[-60:]])
    np.testing.assert_allclose(steady, material.toughness * SHAPE.height, rtol=0.05)
    last = results[-1].energies
    work = np.diff([results[-61].work_of_blade, results[-1].work_of_blade])
    area = SHAPE.height * 59 * 0.05 * strokes.DT
    assert last.cutting - results[-60].energies.cutting == pytest.approx(20.0 * area, rel=0.05)
    assert work == pytest.approx(20.0 * area, rel=0.1)
    assert abs(last.residual) < 2e-3 * last.work_of_blade


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_back_that_slides_over_the_skin_pays_for_friction_alone(friction):
    depths = down_to(3e-3)
    mesh_material = Material(10e3, toughness=20.0, viscous_damping=50.0, blade_friction=friction)
    tissue = body(mesh_material)
    strokes.make(tissue, led("back", depths))
    ways = np.arange(0.0, 8e-3, 0.05 * strokes.DT)
    slide = [led("back", [3e-3], beside=(0.0, way, 0.0))[0] for way in ways]
    results = strokes.make(tissue, slide)
    force = np.mean([result.wrench.force for result in results[-40:]], axis=0)
    # Along the back, with the slope of the dent at its two ends.
    assert -force[1] / force[2] == pytest.approx(friction, abs=0.03)
    last = results[-1].energies
    assert abs(last.residual) < 2e-3 * last.work_of_blade


def test_a_cut_edge_first_touches_the_skin_with_its_edge_alone():
    """The back and the ends come in through the mouth of the cut, and press on nothing."""
    tissue = body(cells=(12, 12, 6))
    stroke = [
        strokes.pose((0.0311, y, 0.018), (0.0311, y, 0.04), (0.0, 1.0, 0.0))
        for y in np.arange(-0.01, 0.05, 1e-4)
    ]
    most = 0
    for sweep in strokes.sweeps(stroke):
        tissue.step(sweep, strokes.DT)
        most = max(most, tissue._model.interaction.state.spine.n_pressing)
    assert tissue.cut_report().n_cut_nodes > 20
    assert most == 0


def test_the_force_on_a_back_hardly_depends_on_the_mesh():
    coarse, fine = (spine.dent(0.4e-3, cells) for cells in ((12, 12, 6), (20, 20, 10)))
    assert coarse.held == pytest.approx(fine.held, rel=0.06)


def test_a_back_that_meets_the_force_of_a_strip_passes_and_one_that_goes_through_fails():
    found = spine.dent(1e-3, (12, 12, 6), frames_held=0)
    assert [check.verdict for check in spine.check_dent("it", found, found.held)] == [PASS, PASS]
    through = found._replace(held=1e-16, cut_area=1e-6)
    assert [check.verdict for check in spine.check_dent("it", through, found.held)] == [FAIL, FAIL]
