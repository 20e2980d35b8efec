"""Whole cuts: a blade without an arm passes through a body and leaves a sound mesh."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scalpel_sim.scene.blade import SCALPEL
from scalpel_sim.scene.scene import GEL
from tests.support import bodies, soundness, strokes
from tests.support.planned_strokes import plan_stroke
from tissue import (
    BladeSegment,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    liver_lobe,
)

CUBE = (0.04, 0.04, 0.04)

MESHES = {
    "grid 2x2x2": block((2, 2, 2), CUBE),
    "grid 4x6x4": block(),
    "jittered 3, 0": bodies.jittered(3, 0),
    "jittered 3, 1": bodies.jittered(3, 1),
    "jittered 4, 0": bodies.jittered(4, 0),
    "jittered 4, 2": bodies.jittered(4, 2),
}


def at_rest(mesh: TetrahedralMesh, **options) -> Tissue:
    """Return a body held at its left and right side, without gravity."""
    options = {"fixed": bodies.sides(mesh), "gravity": (0.0, 0.0, 0.0)} | options
    return Tissue(mesh, **options)


def expect_sound(before, tissue: Tissue, pieces: int) -> None:
    """Fail unless the body is sound and in that many pieces, as the engine and the test count."""
    after = tissue.snapshot()
    assert soundness.faults(before, after) == []
    assert soundness.n_pieces(after.tetrahedra) == pieces
    assert tissue.n_pieces() == pieces


@pytest.mark.parametrize("stroke", strokes.THROUGH)
@pytest.mark.parametrize("mesh", MESHES)
def test_a_stroke_through_leaves_two_sound_pieces(mesh, stroke):
    tissue = at_rest(MESHES[mesh])
    before = tissue.snapshot()
    results = strokes.make(tissue, strokes.THROUGH[stroke](MESHES[mesh]))
    expect_sound(before, tissue, pieces=2)
    after = tissue.snapshot()
    assert soundness.faults(before, after, volume=1e-12) == []
    assert results[-1].cut_area == pytest.approx(soundness.cut_area(before, after), rel=1e-9)
    assert results[-1].n_tetrahedra == len(after.tetrahedra)


@pytest.mark.parametrize("stroke", strokes.THROUGH)
def test_an_organ_falls_into_two_sound_pieces(stroke):
    mesh = liver_lobe()
    tissue = at_rest(mesh, fixed=bodies.sides(mesh, share=0.08))
    before = tissue.snapshot()
    strokes.make(tissue, strokes.THROUGH[stroke](mesh))
    expect_sound(before, tissue, pieces=2)


EXTENT = 0.2
"""Longest side of the scaled third-party meshes [m]: twice an organ's, as they are coarse."""


@pytest.mark.skipif(not bodies.FOLDER, reason="SCALPEL_SIM_TEST_MESHES names no folder")
@pytest.mark.parametrize(
    ("file", "stroke"),
    [*itertools.product(bodies.FILES, ["straight", "curved"]), ("sofa_liver.msh", "slanted")],
)
def test_a_third_party_mesh_falls_into_two_sound_pieces(file, stroke):
    raw = bodies.third_party_mesh(file)
    longest = np.ptp(raw.positions, axis=0).max()
    mesh = raw._replace(positions=raw.positions * (EXTENT / longest))
    tissue = at_rest(mesh, fixed=bodies.sides(mesh, share=0.1))
    before = tissue.snapshot()
    whole = tissue.n_pieces()
    planned = plan_stroke(stroke, mesh)
    poses = [planned.pose(t) for t in np.arange(0.0, planned.duration + strokes.DT, strokes.DT)]
    strokes.make(tissue, poses)
    expect_sound(before, tissue, pieces=whole + 1)


@pytest.mark.parametrize(
    ("wall", "spacing", "stroke"),
    [
        (3.5e-3, 3.4e-3, "slanted"),
        (5.8e-3, 5.8e-3, "straight"),
        (5.8e-3, 5.8e-3, "curved"),
        (7e-3, 7e-3, "slanted"),
    ],
)
def test_a_bowl_with_one_element_in_its_wall_falls_into_two_sound_pieces(wall, spacing, stroke):
    """The thinnest folds inwards before the blade, against the wall behind it."""
    mesh = bodies.half_shell(wall, spacing)
    tissue = at_rest(mesh, material=GEL, fixed=bodies.sides(mesh, share=0.05), blade=SCALPEL)
    before = tissue.snapshot()
    planned = plan_stroke(stroke, mesh, material=GEL)
    poses = [planned.pose(t) for t in np.arange(0.0, planned.duration + strokes.DT, strokes.DT)]
    results = strokes.make(tissue, poses)
    expect_sound(before, tissue, pieces=2)
    shares = [piece.rest_volume for piece in tissue.pieces()]
    assert min(shares) > 0.3 * sum(shares)
    last = results[-1]
    assert last.finished_area <= 0.15 * (last.cut_area - last.finished_area)


def test_the_paper_s_slab_grows_to_at_most_850_tetrahedra():
    for stroke in (strokes.straight(block()), strokes.slanted(block(), 0.2, 0.2)):
        tissue = at_rest(block())
        assert tissue.n_tetrahedra == 576
        strokes.make(tissue, stroke)
        assert tissue.n_tetrahedra <= 850


def test_a_plane_between_those_of_the_mesh_splits_the_6_tetrahedra_of_each_cell_into_28():
    """Two of the six have 2 nodes on either side: 6 parts each. Four have 1 and 3: 4 parts each."""
    tissue = at_rest(block(), solver=SolverSettings(element="plain"))  # strained less at the blade
    strokes.make(tissue, strokes.straight(block(), 0.41))
    assert tissue.n_tetrahedra == 576 + 24 * (28 - 6)


INCISIONS = {
    "stops inside": strokes.upright(0.0217, -0.01, 0.03, -0.01, 0.05),
    "the tip always inside": strokes.upright(0.0217, -0.01, 0.1, 0.0173, 0.05),
    "the tip on a line of the grid": strokes.upright(0.02, -0.01, 0.1, 0.02, 0.05),
    "the heel inside": strokes.upright(0.0217, -0.01, 0.1, -0.01, 0.0237),
    "pressed in from above": [
        strokes.pose((0.0217, -0.01, z), (0.0217, 0.07, z), (0.0, 0.0, -1.0))
        for z in 0.05 - strokes.along_y(0.0, 0.03)
    ],
}


@pytest.mark.parametrize("mesh", ["grid 4x6x4", "jittered 4, 0"])
@pytest.mark.parametrize("name", INCISIONS)
def test_an_incision_leaves_one_sound_piece(name, mesh):
    tissue = at_rest(MESHES[mesh])
    before = tissue.snapshot()
    results = strokes.make(tissue, INCISIONS[name])
    assert results[-1].cut_area > 2e-4
    expect_sound(before, tissue, pieces=1)


@pytest.mark.parametrize("x", [0.02, 0.0217, 0.0243])
def test_a_blade_drawn_back_along_its_cut_cuts_nothing_and_meets_no_force(x):
    there = strokes.upright(x, -0.01, 0.03, -0.01, 0.05)
    tissue = at_rest(block())
    cut = strokes.make(tissue, there)[-1]
    results = strokes.make(tissue, [*reversed(there)])
    assert results[-1].cut_area == cut.cut_area
    assert results[-1].n_tetrahedra == cut.n_tetrahedra
    if x == 0.02:  # rounding errors of the contact of the lips
        assert np.abs([r.wrench.force for r in results[20:]]).max() < 1e-15


def gap(tissue: Tissue) -> float:
    """Return the largest distance between copies of one node, across the lips of the cut [m]."""
    body = tissue.snapshot()
    _, same = np.unique(body.rest_positions, axis=0, return_inverse=True)
    order = np.argsort(same.ravel(), kind="stable")
    x, same = body.positions[order], same.ravel()[order]
    twins = same[1:] == same[:-1]
    return float(np.linalg.norm(x[1:] - x[:-1], axis=1)[twins].max(initial=0.0))


@pytest.mark.parametrize("mesh", ["grid 4x6x4", "jittered 4, 0"])
def test_a_slit_opens_when_the_sides_are_pulled_apart(mesh):
    def slit(stretch):
        x = MESHES[mesh].positions
        # The toughness is low so that no tetrahedron is inverted, from which springs may not
        # recover: only the gap between the lips is tested here.
        tissue = at_rest(
            MESHES[mesh], material=Material(toughness=2.0), positions=x * [stretch, 1.0, 1.0]
        )
        tissue.settle()
        strokes.make(tissue, strokes.upright(0.0207 * stretch, -0.01, 0.03, -0.01, 0.05))
        tissue.settle()
        assert tissue.n_pieces() == 1
        return gap(tissue)

    gaps = [slit(stretch) for stretch in (1.0, 1.05, 1.15)]
    assert gaps[0] < 1e-3
    assert gaps[0] + 5e-4 < gaps[1] < gaps[2]
    assert gaps[2] > 2e-3


def test_a_cut_in_a_stretched_and_turned_body_is_sound():
    mesh = bodies.jittered(4, 0)
    stretched = mesh._replace(positions=mesh.positions * [1.1, 1.0, 1.0])
    turn, shift = Rotation.from_rotvec([0.0, 0.5, 0.0]), np.array([0.3, -0.1, 0.2])
    tissue = at_rest(mesh, positions=turn.apply(stretched.positions) + shift)
    before = tissue.snapshot()
    stroke = [
        BladeSegment(turn.apply(p.tip) + shift, turn.apply(p.heel) + shift, turn.apply(p.forward))
        for p in strokes.straight(stretched)
    ]
    strokes.make(tissue, stroke)
    expect_sound(before, tissue, pieces=2)


@pytest.mark.parametrize("lean", [0.1, 0.25, 0.5])
def test_the_cut_area_is_that_of_a_leaning_blade_through_the_block(lean):
    """Nodes near the path of the blade are put on the cut; its area changes by less than 2 %."""
    tissue = at_rest(block())
    results = strokes.make(tissue, strokes.slanted(block(), lean, rake=0.0))
    assert results[-1].cut_area == pytest.approx(0.06 * 0.04 / np.cos(lean), rel=0.03)


def test_the_number_of_active_tetrahedra_does_not_depend_on_the_size_of_the_body():
    def most_active(n):
        """Return the most active tetrahedra for a 10 mm blade in n x 6 x n cells of 10 mm."""
        mesh = block((n, 6, n), (0.01 * n, 0.06, 0.01 * n))
        tissue = at_rest(mesh)
        middle = 0.005 * n + 0.0013
        stroke = strokes.upright(middle, -0.005, 0.03, middle - 0.005, middle + 0.005)
        return max(r.n_active for r in strokes.make(tissue, stroke))

    assert most_active(4) <= 60
    assert most_active(12) <= 1.2 * most_active(4)
