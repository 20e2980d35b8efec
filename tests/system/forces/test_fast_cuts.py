"""Cuts whose toughness rises with speed: the blade pays its own law on every place of the mesh.

Gelatine at 200 mm/s is 36 times as tough as in a slow cut. Where the edge runs in a plane of the
mesh, all of the cut is made from the skin, which is no cheaper.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.support import strokes
from tissue import MATERIALS, BladeShape, SolverSettings, Tissue, block, fixed_nodes

GELATIN = replace(MATERIALS["gelatin"].material, blade_friction=0.0)
SIZE, CELLS = (0.03, 0.045, 0.015), (6, 9, 3)
"""A block [m] in cells of 5 mm."""
DEPTH = 0.009
"""How deep the tip of the edge is [m]."""
NO_GRAVITY = (0.0, 0.0, 0.0)
PLACES = {"plane": 0.015, "beside it": 0.0156, "middle of a cell": 0.0175, "between": 0.0187}
"""Where the edge cuts [m]."""


def law(speed):
    """Return the toughness at a speed [J/m2]."""
    ratio = speed / GELATIN.toughness_speed
    return GELATIN.toughness * (1.0 + ratio**GELATIN.toughness_exponent)


def drawn(x, speed, fixed, low, slope):
    """Draw an edge along y; return the mean force against it over its last third [N]."""
    mesh = block(CELLS, SIZE)
    tissue = Tissue(mesh, GELATIN, fixed=fixed_nodes(mesh, fixed), gravity=NO_GRAVITY)
    along = np.array([0.0, -math.sin(slope), math.cos(slope)])
    length = (SIZE[2] + 0.01 - low) / math.cos(slope)
    poses = [
        strokes.pose(tip, tip + length * along, (0.0, along[2], -along[1]))
        for tip in ((x, y, low) for y in strokes.along_y(-0.004, 0.032, speed))
    ]
    force = [-result.wrench.force[1] for result in strokes.make(tissue, poses)]
    return np.mean(force[-len(force) // 3 :])


@pytest.mark.parametrize("speed", [0.1, 0.2])
@pytest.mark.parametrize("place", PLACES)
def test_a_drawn_edge_pays_the_toughness_at_its_speed(place, speed):
    force = drawn(PLACES[place], speed, "bottom", SIZE[2] - DEPTH, 0.0)
    assert force == pytest.approx(law(speed) * DEPTH, rel=0.05)


@pytest.mark.parametrize("place", ["plane", "middle of a cell"])
def test_an_edge_that_cuts_through_pays_it(place):
    force = drawn(PLACES[place], 0.1, "left,right", -0.005, 0.0)
    assert force == pytest.approx(law(0.1) * SIZE[2], rel=0.05)


def test_a_slow_edge_pays_it():
    force = drawn(PLACES["plane"], 0.02, "bottom", SIZE[2] - DEPTH, 0.0)
    assert force == pytest.approx(law(0.02) * DEPTH, rel=0.05)


def test_a_sloped_edge_pays_what_its_speed_across_itself_asks_for():
    slope, speed = math.radians(60.0), 0.1
    force = drawn(PLACES["plane"], speed, "bottom", SIZE[2] - DEPTH, slope)
    assert force == pytest.approx(law(speed * math.cos(slope)) * DEPTH, rel=0.05)


@pytest.mark.parametrize("speed", [0.02, 0.2])
@pytest.mark.parametrize("place", ["plane", "middle of a cell"])
def test_a_tip_that_pierces_pays_it(place, speed):
    mesh, blade = block((6, 6, 6), (0.03, 0.03, 0.03)), BladeShape()
    tissue = Tissue(
        mesh,
        GELATIN,
        fixed=fixed_nodes(mesh, "bottom"),
        gravity=NO_GRAVITY,
        blade=blade,
        solver=SolverSettings(audit=True),
    )
    step = speed * strokes.DT
    heights = 0.03 + np.arange(1e-3, -9e-3, -step)
    poses = [
        strokes.pose((PLACES[place], 0.012, z), (PLACES[place], 0.012, z + 0.04), (0.0, 1.0, 0.0))
        for z in heights
    ]
    results = strokes.make(tissue, poses)
    force = np.mean([result.wrench.force[2] for result in results[-len(results) // 4 :]])
    assert force == pytest.approx(law(speed) * blade.height, rel=0.05)
    energies = results[-1].energies
    assert abs(energies.residual) < 0.01 * energies.work_of_blade
