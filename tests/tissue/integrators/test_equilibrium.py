"""Bodies settle: to where forces balance, also where forces are rounded."""

import re

import numpy as np
import pytest

from tests.support import bodies
from tissue import (
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    TissueError,
    block,
    fixed_nodes,
    liver_lobe,
)
from tissue.integrators import equilibrium
from tissue.integrators.equilibrium import LONGEST_SETTLING

STRETCH = np.array([1.05, 1.0, 1.0])
CUBE = block((4, 4, 4), (0.04,) * 3)
BAR = block((8, 2, 2), (0.08, 0.02, 0.02))
NEAR = 1e-3
"""Distance from rest over the largest displacement up to which a body is at rest: twice what was
measured at worst."""


def way_to_rest(tissue, seconds):
    """Return how far the nodes move in a time [s] over the largest displacement from rest."""
    settled = tissue.snapshot().positions
    sag = np.abs(settled - tissue._body.rest[: tissue.n_nodes]).max()
    tissue._stages.global_stepper.wake()
    for _ in range(round(seconds / 1e-2)):
        tissue.step(None, 1e-2)
    return np.abs(tissue.snapshot().positions - settled).max() / sag


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


@pytest.mark.parametrize("drag", [0, 5.0, 400.0], ids="drag {}".format)
def test_drag_of_the_tissue_changes_neither_the_steps_nor_the_rest(drag):
    """A drag of 400 /s stops the slow bending of the bar ten times as hard as is critical."""
    fixed = fixed_nodes(BAR, "left")

    def settled(drag):
        tissue = Tissue(BAR, Material(young_modulus=1e5, viscous_damping=drag), fixed=fixed)
        return tissue.settle(), tissue.snapshot().positions

    steps, positions = settled(drag)
    steps_at_40, positions_at_40 = settled(40.0)
    assert steps == steps_at_40 < LONGEST_SETTLING
    np.testing.assert_allclose(positions, positions_at_40, atol=1e-9)


@pytest.mark.parametrize("law", ["neo_hookean", "springs"])
@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_bar_that_has_settled_stays_where_it_is(law, relaxation):
    ratio = 0.25 if law == "springs" else 0.45
    material = Material(young_modulus=1e5, law=law, poisson_ratio=ratio, viscous_damping=60.0)
    solver = SolverSettings(relaxation=relaxation)
    tissue = Tissue(BAR, material, fixed=fixed_nodes(BAR, "left"), solver=solver)
    assert tissue.settle() < LONGEST_SETTLING
    assert way_to_rest(tissue, 1.0) < NEAR


def test_motion_that_nothing_damps_settles_too():
    """The bar of the validation: at peaks of its kinetic energy fast modes stop the slow ones."""
    mesh = block((7, 2, 2), (0.1, 0.03, 0.03))
    material = Material(young_modulus=1e6, viscous_damping=0.0, retardation_time=0.0)
    solver = SolverSettings(relaxation="verlet")
    tissue = Tissue(mesh, material, fixed=fixed_nodes(mesh, "left"), solver=solver)
    assert tissue.settle() < 2000


def test_what_lies_on_a_floor_settles_there():
    tissue = Tissue(CUBE, Material(), floor=-1e-6)
    assert tissue.settle() < LONGEST_SETTLING
    assert way_to_rest(tissue, 1.0) < 5 * NEAR
    assert tissue.snapshot().positions[:, 2].min() > -1e-3


def test_a_body_that_nothing_holds_is_not_settled_and_stays_as_it_is():
    tissue = Tissue(CUBE, Material())
    with pytest.raises(TissueError, match=r"nothing holds it against \(0, 0, -0\.6"):
        tissue.settle()
    np.testing.assert_array_equal(tissue.snapshot().positions, CUBE.positions)
    raised = Tissue(CUBE, Material(), floor=-1e-6, gravity=(0.0, 0.0, 9.81))
    with pytest.raises(
        TissueError, match=r"nothing holds it.*do not press it on the floor"
    ) as error:
        raised.settle()
    assert "put a floor" not in str(error.value)


def test_a_load_on_a_body_that_nothing_holds_is_refused_unless_it_balances():
    tissue = Tissue(CUBE, Material(), gravity=(0.0, 0.0, 0.0))
    tissue.settle()
    load = tissue.push("right", (0.1, 0.0, 0.0))
    with pytest.raises(TissueError, match=r"against \(0\.1, "):
        tissue.settle()
    tissue.push("left", (-0.1, 0.0, 0.0))
    tissue.settle()
    assert np.ptp(tissue.snapshot().positions[:, 0]) > 0.0401
    tissue.release(load)


def test_a_piece_that_falls_away_is_named_and_the_body_is_where_it_was():
    other = CUBE.positions + np.array([0.1, 0.0, 0.0])
    n = len(CUBE.positions)
    two = TetrahedralMesh(
        np.concatenate((CUBE.positions, other)),
        np.concatenate((CUBE.tetrahedra, CUBE.tetrahedra + n)),
    )
    fixed = np.arange(2 * n) < n  # the first piece alone is held
    tissue = Tissue(two, Material(), fixed=fixed)
    with pytest.raises(TissueError, match=r"node \d+, at \(0\.1.*Nothing holds the piece"):
        tissue.settle()
    np.testing.assert_array_equal(tissue.snapshot().positions, two.positions)
    assert (tissue.snapshot().velocities == 0.0).all()


def test_a_body_of_which_every_node_is_fixed_is_settled():
    fixed = np.ones(len(CUBE.positions), bool)
    tissue = Tissue(CUBE, Material(), fixed=fixed, positions=CUBE.positions * 1.01)
    assert tissue.settle() == 0
    np.testing.assert_array_equal(tissue.snapshot().positions, CUBE.positions * 1.01)
    tissue.step(None, 1e-3)
    assert (tissue.snapshot().velocities == 0.0).all()


def test_a_body_that_gives_way_is_refused_with_what_may_help():
    soft = Material(law="neo_hookean", young_modulus=1.0)
    tissue = Tissue(BAR, soft, fixed=fixed_nodes(BAR, "left"), gravity=(0.0, 0.0, -1e3))
    with pytest.raises(TissueError, match=r"cannot come to rest: .*stiffer material"):
        tissue.settle()


def test_a_body_that_is_as_fast_as_at_first_is_refused_and_stays_where_it_was(monkeypatch):
    monkeypatch.setattr(equilibrium, "LONGEST_SETTLING", 40)
    taut = Tissue(BAR, Material(), fixed=fixed_nodes(BAR, "left"), positions=1.1 * BAR.positions)
    with pytest.raises(TissueError, match=r"cannot come to rest: after 40 steps node \d+, at"):
        taut.settle()
    np.testing.assert_array_equal(taut.snapshot().positions, 1.1 * BAR.positions)


def test_a_body_that_does_not_come_to_rest_gets_a_warning_that_says_where(monkeypatch, caplog):
    monkeypatch.setattr(equilibrium, "LONGEST_SETTLING", 80)
    tissue = Tissue(BAR, Material(), fixed=fixed_nodes(BAR, "left"))
    assert tissue.settle() == 80
    found = re.search(
        r"not come to rest.* 80 steps node (\d+), at .* by ([\d.]+) m/s2", caplog.text
    )
    assert found is not None
    assert int(found[1]) < len(BAR.positions)
    assert float(found[2]) > equilibrium.SETTLED
    monkeypatch.undo()
    caplog.clear()
    assert tissue.settle() < LONGEST_SETTLING
    assert caplog.text == ""


def test_a_mesh_in_millimetres_is_refused_at_once_with_how_far_it_sags_and_the_scale(monkeypatch):
    monkeypatch.setattr(equilibrium, "LONGEST_SETTLING", 0)  # no step is taken
    mesh = block((4, 3, 3), (171.0, 120.0, 120.0))
    tissue = Tissue(mesh, Material(), fixed=fixed_nodes(mesh, "left,right"))
    with pytest.raises(TissueError, match=r"171 m in a material of 1e\+04 Pa.*--scale 0\.001"):
        tissue.settle()


@pytest.mark.parametrize(("side", "weight"), [("left,right", 50.0), ("none", 2.0)])
def test_a_body_too_soft_for_its_weight_is_told_so_and_not_that_nothing_holds_it(side, weight):
    """It is held at two sides, or lies on a floor."""
    soft = Material(young_modulus=9810.0 * 0.04 / weight, toughness=1e-4)
    floor = 0.0 if side == "none" else None
    tissue = Tissue(CUBE, soft, fixed=fixed_nodes(CUBE, side), floor=floor)
    with pytest.raises(TissueError, match=r"0\.04 m .* sags under its own weight") as error:
        tissue.settle()
    assert "Nothing holds" not in str(error.value)


def test_supports_that_are_everywhere_carry_any_weight():
    """The distance to a support counts, not the size of the body."""
    fixed = np.ones(len(CUBE.positions), bool)
    fixed[np.flatnonzero(~fixed_nodes(CUBE, "left,right,front,back,bottom,top"))[0]] = False
    tissue = Tissue(CUBE, Material(young_modulus=3.0, toughness=1e-4), fixed=fixed)
    assert tissue.settle() < LONGEST_SETTLING


def test_a_body_that_hangs_on_springs_too_soft_is_told_so():
    tissue = Tissue(CUBE, Material())
    tissue.attach("top", stiffness=1e-6)
    with pytest.raises(TissueError, match="attachments hold it, and give way"):
        tissue.settle()


def test_a_body_that_gives_way_under_a_load_is_not_told_that_it_is_too_heavy():
    tissue = Tissue(CUBE, Material(), fixed=fixed_nodes(CUBE, "left"))
    tissue.push("right", (1e4, 0.0, 0.0))
    with pytest.raises(TissueError, match="less gravity, load or stretch") as error:
        tissue.settle()
    assert "weight" not in str(error.value)
