"""Forces on a body from outside, one by one: each kind is there, and they balance the weight."""

import numpy as np
import pytest

from tissue import Geom, Material, SolverSettings, Tissue, block

GEL = Material(law="neo_hookean", young_modulus=50e3, poisson_ratio=0.0, viscous_damping=20.0)
MESH = block((3, 3, 2), (0.03, 0.03, 0.02))
DT = 1e-3


def brick(**others):
    """A brick that is relaxed by Verlet's method, as most scenes are not: it is quick."""
    return Tissue(MESH, GEL, solver=SolverSettings(relaxation="verlet"), **others)


def of(tissue, kind):
    found = [each for each in tissue.acting_forces() if each.kind == kind]
    assert found, kind
    return found


def total(forces):
    return np.sum([each.force for each in forces], axis=0)


def weight_of(tissue):
    return 9.81 * tissue.snapshot().masses.sum()


def test_a_floor_bears_the_weight_of_what_rests_on_it():
    tissue = brick(floor=0.0)
    tissue.settle()
    for _ in range(300):
        tissue.step(None, DT)
    forces = of(tissue, "floor")
    assert total(forces) == pytest.approx(
        [0.0, 0.0, weight_of(tissue)], abs=0.02 * weight_of(tissue)
    )
    for each in forces:
        assert each.depth > 0.0
        assert each.point[2] < 1e-3
        assert each.friction <= each.limit


def test_supports_bear_the_weight_and_the_load():
    fixed = MESH.positions[:, 2] < 1e-6
    tissue = brick(fixed=fixed)
    tissue.push("top", [0.0, 0.0, -0.1])
    tissue.settle()
    (support,) = of(tissue, "support")
    assert support.force == pytest.approx([0.0, 0.0, weight_of(tissue) + 0.1], abs=2e-3)
    assert support.name == f"{fixed.sum()} fixed nodes"
    (load,) = of(tissue, "load")
    assert load.force == pytest.approx([0.0, 0.0, -0.1])
    assert load.point[2] == pytest.approx(0.02, abs=1e-3)


def test_what_is_held_and_touched_is_named_with_its_force():
    tissue = brick(gravity=(0.0, 0.0, 0.0), fixed=MESH.positions[:, 0] < 1e-6)
    held = tissue.attach("top", stiffness=100.0)
    held.move(held.wrench.point + np.array([0.0, 0.0, 1e-4]))
    tied = tissue.tie("right", [0.05, 0.0, 0.0], stiffness=10.0, area=1e-5, toughness=100.0)
    pads = [Geom("plate", "box", (0.003, 0.02, 0.02), 0.5)]
    tissue.collide_with(pads, [[0.0329, 0.015, 0.01]])
    for _ in range(5):
        tissue.step(None, DT)
    (attachment,), (ligament,) = of(tissue, "attachment"), of(tissue, "ligament")
    assert (attachment.force == -held.wrench.force).all()
    assert attachment.force[2] > 0.0
    assert attachment.state == "16 of 16 points hold"
    assert (ligament.force == -tied.wrench.force).all()
    geoms = of(tissue, "geom")
    assert {each.name for each in geoms} == {"plate"}
    result = tissue.step(None, DT)
    expected = result.contacts.normal_force[result.contacts.geom == 0].sum()
    assert total(of(tissue, "geom"))[0] == pytest.approx(-expected, rel=1e-6)
