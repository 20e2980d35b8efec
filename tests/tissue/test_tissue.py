"""The interface of `Tissue`: arguments, refusals and results."""

import copy
import gc
import pickle
import subprocess
import sys
import weakref

import numpy as np
import pytest

from tests.support import bodies, strokes
from tissue import (
    BladeSegment,
    BladeShape,
    BladeSweep,
    Material,
    MeshError,
    TetrahedralMesh,
    Tissue,
    block,
)
from tissue.shapes.isosurface_stuffing import stuff

MESH = block((2, 2, 2), (0.04, 0.04, 0.04))
POSE = strokes.pose((0.02, 0.01, -0.01), (0.02, 0.01, 0.05), (0.0, 1.0, 0.0))


@pytest.fixture
def tissue():
    return Tissue(MESH, fixed=bodies.sides(MESH), gravity=(0.0, 0.0, 0.0))


REFUSED = [  # the blade at the end of a step, and what is said of it
    *(({part: [0.0, x, 0.0]}, "finite") for part in BladeSegment._fields for x in (np.nan, np.inf)),
    *(({"tip": wrong}, "blade") for wrong in (np.zeros(2), np.zeros((3, 1)), np.zeros(4))),
    ({"heel": POSE.tip}, "no length"),
    ({"forward": [0.0, 0.0, 1.0]}, "edge"),
    ({"forward": [0.0, 0.0, 0.0]}, "edge"),
    ({"forward": -POSE.forward}, "smaller steps"),
    ({"forward": [1.0, 0.0, 0.0]}, "smaller steps"),
    ({"tip": POSE.heel, "heel": POSE.tip}, "smaller steps"),
]


@pytest.mark.parametrize(("changes", "said"), REFUSED)
def test_a_motion_of_the_blade_that_makes_no_sense_is_refused(tissue, changes, said):
    arrays = {name: np.array(value) for name, value in changes.items()}
    with pytest.raises(ValueError, match=said):
        tissue.step(BladeSweep(POSE, POSE._replace(**arrays)), 1e-3)


@pytest.mark.parametrize(("length", "why"), [(1e-4, "shorter than"), (200.0, "too long")])
def test_an_edge_that_does_not_fit_the_mesh_is_refused_and_changes_nothing(tissue, length, why):
    heel = POSE.tip + np.array([0.0, 0.0, length])
    before = tissue.snapshot()
    with pytest.raises(ValueError, match=rf"edge of the blade is .* mm long, {why}.*(Use|Pass)"):
        tissue.step(BladeSweep(POSE._replace(heel=heel), POSE._replace(heel=heel)), 1e-3)
    for one, other in zip(before, tissue.snapshot(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_long_edge_has_as_many_samples_as_a_short_one_for_its_length(tissue):
    def samples(length):
        heel = POSE.tip + np.array([0.0, 0.0, length])
        tissue.step(BladeSweep(POSE._replace(heel=heel), POSE._replace(heel=heel)), 1e-3)
        return tissue._model.interaction.n_samples - 1

    assert samples(3.0) == pytest.approx(10 * samples(0.3), rel=0.02)


@pytest.mark.parametrize("dt", [-1e-3, np.nan, np.inf])
def test_a_time_step_that_is_negative_or_not_finite_is_refused(tissue, dt):
    with pytest.raises(ValueError, match="dt"):
        tissue.step(None, dt)


BROKEN = {
    "inverted": MESH._replace(
        tetrahedra=np.vstack([MESH.tetrahedra[0, [0, 2, 1, 3]], MESH.tetrahedra[1:]])
    ),
    "twice": MESH._replace(tetrahedra=np.vstack([MESH.tetrahedra, MESH.tetrahedra[:1]])),
    "out of range": MESH._replace(tetrahedra=MESH.tetrahedra + 1),
    "no tetrahedra": MESH._replace(tetrahedra=np.zeros((0, 4), dtype=np.int64)),
    "NaN": MESH._replace(positions=np.where(MESH.positions == 0.02, np.nan, MESH.positions)),
    "flat": MESH._replace(positions=MESH.positions * [1.0, 1.0, 0.0]),
    "mesh_from_arrays": MESH._replace(positions=np.vstack([MESH.positions, [1.0, 1.0, 1.0]])),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_broken_mesh_is_refused(fault):
    with pytest.raises(MeshError, match=fault if fault == "mesh_from_arrays" else None):
        Tissue(BROKEN[fault])


@pytest.mark.parametrize(
    "options",
    [
        {"fixed": np.zeros(3, dtype=bool)},
        {"positions": np.zeros((3, 3))},
        {"positions": np.full_like(MESH.positions, np.nan)},
        {"gravity": (0.0, 0.0)},
        {"gravity": (0.0, 0.0, np.nan)},
    ],
    ids=["too few fixed", "too few positions", "NaN positions", "flat gravity", "NaN gravity"],
)
def test_arguments_that_do_not_fit_the_mesh_are_refused(options):
    with pytest.raises(ValueError):
        Tissue(MESH, **options)


@pytest.mark.parametrize(
    ("name", "value"),
    [("young_modulus", 0.0), ("density", -1.0), ("toughness", np.nan), ("viscous_damping", -0.1)],
)
def test_a_material_with_a_quantity_of_the_wrong_sign_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        Material(**{name: value})


def test_the_engine_copies_its_arguments(tissue):
    mesh = TetrahedralMesh(MESH.positions.copy(), MESH.tetrahedra.copy())
    positions, fixed = mesh.positions.copy(), bodies.sides(mesh)
    tissue = Tissue(mesh, fixed=fixed, positions=positions)
    for array in (*mesh[:2], positions, fixed):
        array[:] = 0
    np.testing.assert_array_equal(tissue.snapshot().positions, MESH.positions)
    assert tissue.snapshot().fixed.any()


@pytest.mark.parametrize("copied", [copy.deepcopy, pickle.dumps])
def test_a_tissue_refuses_to_be_copied_and_says_what_to_do(tissue, copied):
    with pytest.raises(TypeError, match=r"neither pickled nor copied; take Tissue.save_state"):
        copied(tissue)


def test_a_snapshot_is_a_copy(tissue):
    for array in (*tissue.snapshot(), *tissue.surface()[:4]):
        array[...] = 0
    np.testing.assert_array_equal(tissue.snapshot().positions, MESH.positions)
    assert tissue.n_tetrahedra == 48
    assert tissue.n_nodes == 27


def test_bounds_are_the_current_lowest_and_highest_corner(tissue):
    np.testing.assert_allclose(tissue.bounds, [[0.0] * 3, [0.04] * 3])
    np.testing.assert_array_equal(tissue.step(None, 1e-3).bounds, tissue.bounds)


def test_a_step_of_zero_length_moves_nothing(tissue):
    before = tissue.snapshot().positions
    result = tissue.step(BladeSweep(POSE, POSE), 0.0)
    np.testing.assert_array_equal(tissue.snapshot().positions, before)
    assert np.isfinite(result.wrench.force).all()


def test_a_step_reports_the_times_of_its_stages(tissue):
    results = strokes.make(tissue, strokes.slanted(MESH))
    assert all(min(r.stage_times) >= 0.0 for r in results)
    assert max(r.stage_times.topology for r in results) > 0.0
    assert results[0].n_substeps >= 1
    assert max(r.n_active for r in results) > 0


def test_the_active_point_tetrahedron_contains_the_tip():
    mesh = block((4, 6, 4), (0.04, 0.06, 0.04))
    tissue = Tissue(mesh, fixed=bodies.sides(mesh), gravity=(0.0, 0.0, 0.0))
    stroke = strokes.upright(0.0217, -0.005, 0.03, 0.0183, 0.05)
    last = strokes.make(tissue, stroke)[-1]
    body = tissue.snapshot()
    corners = body.rest_positions[body.tetrahedra[last.active_point_tetrahedron]]
    # In the rest shape the tip lags behind the blade, by as much as the tissue is dragged.
    assert np.abs(corners[:, 0].mean() - 0.0217) < 0.01
    assert np.abs(corners[:, 2].mean() - 0.0183) < 0.01
    assert 0.01 < corners[:, 1].mean() < 0.035


def test_a_blade_of_another_length_starts_with_new_anchors(tissue):
    strokes.make(tissue, strokes.upright(0.0187, -0.01, 0.02, -0.01, 0.05))
    held = tissue.step(sweep_of(0.02, 0.06), 1e-3)
    other = tissue.step(sweep_of(0.02, 0.03), 1e-3)
    assert np.isfinite(held.wrench.force).all()
    assert np.isfinite(other.wrench.force).all()
    assert other.anchored_length <= 0.03 + 1e-12


def sweep_of(y, length):
    pose = strokes.pose((0.0187, y, -0.01), (0.0187, y, -0.01 + length), (0.0, 1.0, 0.0))
    return BladeSweep(pose, pose)


def test_a_tissue_that_is_no_longer_used_is_freed_at_once():
    """It does not wait for the garbage collector: a server makes one for each client."""
    gc.disable()
    try:
        tissue = Tissue(MESH)
        strokes.make(tissue, strokes.straight(MESH))
        remains = weakref.ref(tissue._model)
        del tissue
        assert remains() is None
    finally:
        gc.enable()


def test_a_whole_number_of_seconds_leaves_fractions_as_they_are():
    program = """
import numpy as np
from tissue import Tissue, block
tissue = Tissue(block((1, 1, 1), (0.02, 0.02, 0.02)))
tissue.step(None, 0)
tissue.step(None, 1e-3)
print(tissue.snapshot().velocities[:, 2].max())
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert float(done.stdout) == pytest.approx(-9.81e-3, rel=1e-2)


def test_a_blade_that_moves_too_far_in_a_step_is_refused_before_it_does_anything():
    tissue = Tissue(block((2, 2, 2), (0.02, 0.02, 0.02)))
    near = BladeSegment(np.array([0.01, -0.01, 0.03]), np.array([0.01, -0.01, 0.0]), np.eye(3)[1])
    way = 1e3 * np.eye(3)[1]
    far = near._replace(tip=near.tip + way, heel=near.heel + way)
    before = tissue.snapshot()
    with pytest.raises(ValueError, match=r"moves 1e\+03 m in one step; that may be \d+"):
        tissue.step(BladeSweep(near, far), 1e-3)
    assert all(map(np.array_equal, before, tissue.snapshot()))


def test_a_warning_of_a_huge_toughness_has_no_hundreds_of_digits(caplog):
    Tissue(MESH, Material(toughness=1e300))
    assert "1e+299 mm" in caplog.text
    assert len(caplog.text) < 600


@pytest.mark.parametrize(
    "make",
    [
        lambda: BladeShape(bevel_angle=1e300),
        lambda: stuff(lambda points: points[:, 0], [[0.0] * 3, [1.0] * 3], 1e-90),
    ],
)
def test_a_refusal_of_a_huge_number_has_no_hundreds_of_digits(make):
    with pytest.raises(ValueError, match=r"e\+\d\d") as refused:
        make()
    assert len(str(refused.value)) < 200
