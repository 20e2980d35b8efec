"""Cut settings, which trade path error against time step, and the cut report."""

import math

import numpy as np
import pytest

from tests.support import soundness
from tests.support.strokes import curved, make, upright
from tissue import CutReport, CutSettings, Material, SolverSettings, Tissue, block, fixed_nodes

SIZE = 0.04
CELLS = 4
MESH = block((CELLS, CELLS, CELLS), (SIZE, SIZE, SIZE))
SOFT_TO_CUT = Material(toughness=0.1)
"""Material that a blade drags along by only 10 µm, so that cuts follow the blade."""
HELD = fixed_nodes(MESH, "left,right")
NO_GRAVITY = (0.0, 0.0, 0.0)
DRAG = 0.02
"""Largest displacement of the tissue by the blade [node sizes]."""


def cut_at(x: float, cut: CutSettings = CutSettings()) -> Tissue:
    """Return a block cut in two at `x` [m] by an upright blade."""
    tissue = Tissue(
        MESH, SOFT_TO_CUT, fixed=HELD, gravity=NO_GRAVITY, solver=SolverSettings(cut=cut)
    )
    make(tissue, upright(x, -0.005, SIZE + 0.01, -0.01, SIZE + 0.01))
    return tissue


def curved_with(snap: float, guard: float) -> CutReport:
    quality = CutSettings(snap=snap, floor=snap, guard=guard)
    tissue = Tissue(
        MESH, SOFT_TO_CUT, fixed=HELD, gravity=NO_GRAVITY, solver=SolverSettings(cut=quality)
    )
    make(tissue, curved(MESH))
    return tissue.cut_report()


def test_the_path_error_is_the_distance_of_the_cut_faces_from_the_path_of_the_blade():
    x = 0.0185
    tissue = cut_at(x)
    surface, found = tissue.surface(), tissue.cut_report()
    nodes = np.unique(surface.triangles[surface.is_cut])
    off = np.abs(surface.rest_positions[nodes, 0] - x)
    assert found.n_cut_nodes == len(nodes)
    assert off.mean() > 0.1 * found.node_size  # most crossings snapped to nodes
    assert found.path_error_largest == pytest.approx(off.max(), abs=DRAG * found.node_size)
    assert found.path_error_mean == pytest.approx(off.mean(), abs=DRAG * found.node_size)


def test_a_cut_along_the_faces_of_the_mesh_has_no_path_error_and_no_growth():
    found = cut_at(SIZE / 2).cut_report()
    assert found.n_cut_nodes == 2 * (CELLS + 1) ** 2
    assert found.path_error_largest < DRAG * found.node_size
    assert (found.growth, found.frequency_growth) == (1.0, pytest.approx(1.0, rel=0.5))


def test_less_snapping_follows_the_blade_more_closely_and_needs_shorter_time_steps():
    rough, fine = curved_with(0.5, 0.25), curved_with(0.05, 0.05)
    assert fine.path_error_mean < 0.5 * rough.path_error_mean
    assert fine.growth > rough.growth
    assert fine.substep_growth > rough.substep_growth > 1.0


def test_the_smallest_altitude_is_that_of_the_thinnest_tetrahedron_and_not_below_the_guard():
    tissue = cut_at(0.0176)
    body, found = tissue.snapshot(), tissue.cut_report()
    lowest = soundness.smallest_altitude(body.rest_positions, body.tetrahedra)
    assert found.now.altitude == pytest.approx(lowest, rel=1e-9)
    assert found.guard <= found.now.altitude < found.initial.altitude


def test_an_uncut_body_has_no_path_error_and_no_growth():
    found = Tissue(MESH).cut_report()
    assert (found.n_cut_nodes, found.path_error_mean, found.path_error_largest) == (0, 0.0, 0.0)
    assert found.initial == found.now
    assert (found.growth, found.frequency_growth, found.substep_growth) == (1.0, 1.0, 1.0)


def test_a_body_with_all_nodes_fixed_has_a_report():
    found = Tissue(MESH, fixed=np.ones(len(MESH.positions), bool)).cut_report()
    assert found.now.frequency == 0.0 and math.isinf(found.now.time_step)
    assert (found.frequency_growth, found.substep_growth) == (1.0, 1.0)


@pytest.mark.parametrize("name", ["snap", "floor", "guard", "crumb"])
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_a_cut_setting_that_is_not_a_share_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"{name} is {value}"):
        CutSettings(**{name: value})


@pytest.mark.parametrize(("name", "value"), [("snap", 1.1), ("guard", 0.6)])
def test_a_cut_setting_that_no_mesh_can_satisfy_is_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} is {value}.* at most"):
        CutSettings(**{name: value})
