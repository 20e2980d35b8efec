"""Friction of bodies whose labels differ in it: on a floor, on a geom, and on each other."""

import numpy as np
import pytest

from tests.support import bodies, incisions, strokes
from tests.support.overlaps import SLAB, joined
from tissue import Geom, Material, Tissue, block
from tissue.mesh.validation import signed_volumes

SLIPPERY, ROUGH = 0.2, 0.5
GEL = Material(young_modulus=50e3, viscous_damping=2.0)
MATERIALS = {0: GEL.changed(friction=SLIPPERY), 1: GEL.changed(friction=ROUGH)}
HELD = 1e-3
"""Way in 0.2 s up to which a block counts as held [m]: one that slides by a degree goes as far."""


def leaning(degrees: float) -> tuple[float, float, float]:
    """Return a gravity that leans along x instead of the ground."""
    angle = np.radians(degrees)
    return (9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle))


def way_of(tissue: Tissue, nodes: np.ndarray, seconds: float = 0.2) -> float:
    """Return how far nodes slide along x, once the body has come to rest on what it stands on."""
    for _ in range(300):
        tissue.step(None, strokes.DT)
    before = tissue.snapshot().positions[nodes, 0].mean()
    for _ in range(round(seconds / strokes.DT)):
        tissue.step(None, strokes.DT)
    return float(tissue.snapshot().positions[nodes, 0].mean() - before)


def stand(tissue: Tissue, on: str) -> None:
    """Put a body on a table that has the friction of the tissue, unless it is on a floor."""
    if on == "table":
        tissue.collide_with([Geom("table", "plane", friction=None)])


@pytest.mark.parametrize("on", ["floor", "table"])
def test_of_two_blocks_on_a_slope_the_slippery_one_slides_and_the_rough_one_holds(on):
    one = block((3, 3, 2), (0.03, 0.03, 0.02))
    mesh = joined(one, one, (0.0, 0.04, 0.0))
    labels = np.repeat([0, 1], len(one.tetrahedra))
    floor = 0.0 if on == "floor" else None
    where = {"gravity": leaning(17.0), "floor": floor}
    tissue = Tissue(mesh._replace(labels=labels), MATERIALS, **where)
    stand(tissue, on)
    n = len(one.positions)
    rough = way_of(tissue, np.arange(n, 2 * n))
    assert abs(rough) < HELD
    before = tissue.snapshot().velocities[:n, 0].mean()
    for _ in range(100):
        tissue.step(None, strokes.DT)
    gained = (tissue.snapshot().velocities[:n, 0].mean() - before) / 0.1
    slope = np.radians(17.0)
    expected = 9.81 * (np.sin(slope) - SLIPPERY * np.cos(slope))
    assert gained == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("on", ["floor", "table"])
@pytest.mark.parametrize(("degrees", "slides"), [(17.8, False), (20.8, True)])
def test_halves_of_a_block_hold_together_up_to_the_mean_of_their_friction(on, degrees, slides):
    """Both bear half of the weight: tan 19.3 degrees is (0.2 + 0.5) / 2."""
    mesh = block((4, 4, 1), (0.04, 0.04, 0.01))
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    labels = (middles[:, 1] > 0.02).astype(np.int64)
    floor = 0.0 if on == "floor" else None
    where = {"gravity": leaning(degrees), "floor": floor}
    tissue = Tissue(mesh._replace(labels=labels), MATERIALS, **where)
    stand(tissue, on)
    way = way_of(tissue, np.arange(len(mesh.positions)))
    assert way > HELD if slides else abs(way) < HELD


@pytest.mark.parametrize("lower", [0, 1])
def test_on_each_other_the_slippery_one_decides_whichever_is_below(lower):
    below, above = block((6, 6, 2), SLAB), block((4, 4, 2), (0.02, 0.02, 0.01))
    mesh = joined(below, above, (0.01, 0.01, SLAB[2] + 1e-3))
    n = len(below.tetrahedra)
    labels = np.concatenate([np.full(n, lower), np.full(len(above.tetrahedra), 1 - lower)])
    held = mesh.positions[:, 2] == 0.0
    ways = []
    for degrees in (10.0, 13.0):  # tan 11.3 degrees is 0.2
        where = {"fixed": held, "gravity": leaning(degrees)}
        tissue = Tissue(mesh._replace(labels=labels), MATERIALS, **where)
        ways.append(way_of(tissue, np.arange(len(below.positions), len(mesh.positions))))
    assert abs(ways[0]) < HELD < ways[1]


def test_each_node_has_the_mean_of_its_tetrahedra_after_cuts():
    mesh = bodies.jittered(3, 5)
    tissue = Tissue(mesh._replace(labels=np.arange(len(mesh.tetrahedra)) % 2), MATERIALS)
    for seed, kind in enumerate(list(incisions.KINDS)[:3]):
        tissue.incise(*incisions.incision(mesh, kind, seed))
    body = tissue.snapshot()
    volume = signed_volumes(body.rest_positions, body.tetrahedra)
    friction = np.where(tissue.labels() == 1, ROUGH, SLIPPERY)
    total, of_node = np.zeros(tissue.n_nodes), np.zeros(tissue.n_nodes)
    for k in range(4):
        np.add.at(total, body.tetrahedra[:, k], volume)
        np.add.at(of_node, body.tetrahedra[:, k], volume * friction)
    assert tissue.n_nodes > len(mesh.positions)
    found = tissue._body.friction[: tissue.n_nodes]
    np.testing.assert_allclose(found, of_node / total, rtol=1e-12)


def test_a_factor_changes_the_friction_of_what_lies_on_a_floor():
    mesh = block((3, 3, 2), (0.03, 0.03, 0.02))
    tissue = Tissue(mesh, MATERIALS[1], gravity=leaning(17.0), floor=0.0)
    nodes = np.arange(len(mesh.positions))
    assert abs(way_of(tissue, nodes)) < HELD
    tissue.set_material(None, friction=SLIPPERY / ROUGH)
    assert way_of(tissue, nodes) > HELD
