"""Motions that a hand may make with a blade in the tissue, one claim for each.

The bodies are cubes of 0.05 m with elements of 10 mm; the blade moves at 0.1 m/s unless stated.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest

from tests.support import bodies, soundness, strokes
from tests.support.strokes import Stroke, Y, Z, pose
from tissue import BladeSegment, FloatArray, TetrahedralMesh, Tissue, block

EDGE = 0.05
SIDE = EDGE**2
"""Area of a side of the cube [m2]."""

X = 0.0262
"""The x at which the blade cuts along y, between planes of nodes [m]."""

MESHES = {
    "grid": block((5, 5, 5), (EDGE,) * 3),
    "jittered grid": bodies.jittered_grid(5, 1, EDGE),
    "Delaunay": bodies.body_centred(4, 1, EDGE),
}

TRAVEL = 1e-4
"""Distance that the blade moves in a frame [m]."""


class Outcome(NamedTuple):
    """The body after one or more motions of the blade."""

    n_tetrahedra: int
    n_pieces: int
    area: float
    """Area that was cut [m2]."""


@pytest.fixture(params=["jittered grid", "Delaunay"])
def mesh(request) -> TetrahedralMesh:
    return MESHES[request.param]


def path(*corners: Sequence[float], travel: float = TRAVEL) -> FloatArray:
    """Return points on the lines between corners, at most `travel` [m] apart, shape (n, 3)."""
    points = [np.array(corners[0], dtype=np.float64)]
    for start, stop in itertools.pairwise(corners):
        a, b = np.array(start, dtype=np.float64), np.array(stop, dtype=np.float64)
        n = max(1, int(np.ceil(np.linalg.norm(b - a) / travel)))
        points += [a + (b - a) * i / n for i in range(1, n + 1)]
    return np.array(points)


def upright(points: FloatArray, length: float = 0.08) -> Stroke:
    """Return the stroke of an upright blade, its tip at those points, facing along y."""
    return [pose(tip, tip + length * Z, Y) for tip in points]


def along_y(*ys: float, x: float = X, low: float = -0.01, length: float = 0.08) -> Stroke:
    """Return the stroke of an upright blade that moves from each y to the next [m]."""
    return upright(path(*((x, y, low) for y in ys)), length)


def perform(mesh: TetrahedralMesh, *motions: Stroke, lips_match: bool = True) -> Outcome:
    """Perform motions with the blade removed in between, on a body held at its bottom."""
    on_bottom = mesh.positions[:, 2] < 1e-9
    tissue = Tissue(mesh, fixed=on_bottom, gravity=(0.0, 0.0, 0.0))
    before = tissue.snapshot()
    area = 0.0
    for motion in motions:
        strokes.make(tissue, motion)
        for _ in range(100 if len(motions) > 1 else 3):
            area = tissue.step(None, strokes.DT).cut_area
    after = tissue.snapshot()
    assert soundness.faults(before, after, volume=1e-12, lips_match=lips_match) == []
    assert soundness.link_faults(tissue._body) == []
    return Outcome(tissue.n_tetrahedra, tissue.n_pieces(), area)


def rotated_about(point: FloatArray, angle: float, axis: int, p: BladeSegment) -> BladeSegment:
    """Return the blade turned by an angle [rad] about an axis through a point [m]."""
    i, j = (k for k in range(3) if k != axis)
    turn = np.eye(3)
    turn[[i, j], [i, j]] = np.cos(angle)
    turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
    return pose(turn @ (p.tip - point) + point, turn @ (p.heel - point) + point, turn @ p.forward)


@pytest.fixture(scope="module")
def straight() -> Outcome:
    return perform(MESHES["grid"], along_y(-0.01, 0.09))


@pytest.mark.parametrize("turns", [(0.03, 0.01), (0.03, -0.01), (0.03, 0.025, 0.035, 0.02)])
def test_a_blade_that_goes_back_and_forth_cuts_no_more_than_one_that_goes_straight_through(
    turns, straight
):
    there_and_back = perform(MESHES["grid"], along_y(-0.01, *turns, 0.09))
    assert there_and_back.n_pieces == straight.n_pieces == 2
    # Not always the same: the tissue oscillates, and how depends on the time step.
    assert there_and_back.n_tetrahedra <= 1.01 * straight.n_tetrahedra
    assert there_and_back.area == pytest.approx(straight.area, rel=1e-3)


def test_a_hand_that_trembles_cuts_the_body_in_two(mesh):
    """By 0.2 mm sideways and 0.5 mm along the path."""
    random = np.random.default_rng(0)
    straight_path = path((X, -0.01, -0.01), (X, 0.09, -0.01))
    tremor = straight_path + random.normal(size=straight_path.shape) * [2e-4, 5e-4, 0.0]
    assert perform(mesh, upright(tremor)).n_pieces == 2


@pytest.mark.parametrize("axis", [0, 2], ids=["in its plane", "about its edge"])
def test_a_blade_that_rotates_in_place_and_continues_cuts_the_body_in_two(mesh, axis):
    there = along_y(-0.01, 0.025)
    centre = np.array([X, 0.025, 0.025])
    swing = np.concatenate(
        [np.linspace(0, 0.35, 60), np.linspace(0.35, -0.35, 120), np.linspace(-0.35, 0, 60)]
    )
    turning = [rotated_about(centre, angle, axis, there[-1]) for angle in swing]
    assert perform(mesh, there + turning + along_y(0.025, 0.09)).n_pieces == 2


def test_a_tip_that_leaves_and_comes_in_again_leaves_two_slits_in_one_piece(mesh):
    points = path(
        (X, -0.01, 0.03), (X, 0.02, 0.03), (X, 0.03, 0.055), (X, 0.035, 0.03), (X, 0.09, 0.03)
    )
    outcome = perform(mesh, upright(points, length=0.09))
    assert outcome.n_pieces == 1
    assert 0.2 * SIDE < outcome.area < 0.6 * SIDE


def test_a_blade_with_both_ends_inside_leaves_a_tunnel_in_one_piece(mesh):
    outcome = perform(mesh, along_y(-0.01, 0.09, low=0.012, length=0.024))
    assert outcome.n_pieces == 1
    assert outcome.area == pytest.approx(0.024 * EDGE, rel=0.25)


@pytest.mark.parametrize(
    "exit_point",
    [(X, -0.02, 0.02), (X, 0.03, 0.12)],
    ids=["back along its path", "upwards through the slit"],
)
def test_a_blade_that_is_withdrawn_leaves_the_slit_that_it_made(mesh, exit_point):
    """It was 30 mm deep and 30 mm far in the body, part of which was deformation."""
    points = path((X, -0.01, 0.02), (X, 0.03, 0.02), exit_point)
    outcome = perform(mesh, upright(points))
    assert outcome.n_pieces == 1
    assert 0.6 * 0.03**2 < outcome.area < 1.2 * 0.03**2


def test_a_blade_that_backs_off_and_goes_deeper_cuts_below_its_slit(mesh):
    """The area is that of one deep pass, less the part below where the blade backed off."""
    shallow = path((X, -0.01, 0.03), (X, 0.03, 0.03))
    deeper = path((X, 0.03, 0.03), (X, 0.01, 0.03), (X, 0.01, 0.01), (X, 0.09, 0.01))
    in_two_passes = perform(mesh, upright(np.vstack([shallow, deeper])))
    in_one_pass = perform(mesh, along_y(-0.01, 0.09, low=0.01))
    assert in_two_passes.n_pieces == in_one_pass.n_pieces == 1
    assert in_two_passes.area == pytest.approx(in_one_pass.area - 0.01 * 0.02, rel=0.15)


def test_a_blade_driven_in_from_above_and_drawn_out_at_the_side_leaves_one_piece(mesh):
    points = path((X, 0.025, 0.06), (X, 0.025, 0.01), (X, 0.09, 0.01))
    outcome = perform(mesh, upright(points))
    assert outcome.n_pieces == 1
    assert outcome.area > 0.3 * 0.025 * 0.04


def test_a_blade_pressed_in_with_its_middle_first_cuts_the_body_in_two(mesh):
    down = [
        pose((X, -0.02, z), (X, 0.07, z), (0.0, 0.0, -1.0)) for z in np.arange(600, -201, -1) * 1e-4
    ]
    assert perform(mesh, down).n_pieces == 2


def test_a_blade_that_also_moves_sideways_leaves_two_pieces(mesh):
    points = path(
        (X, -0.01, -0.01), (X, 0.03, -0.01), (X + 0.012, 0.06, -0.01), (X + 0.012, 0.1, -0.01)
    )
    assert perform(mesh, upright(points)).n_pieces == 2


def test_the_cut_advances_to_a_blade_that_rests(mesh):
    tissue = Tissue(mesh, fixed=mesh.positions[:, 2] < 1e-9, gravity=(0.0, 0.0, 0.0))
    arrives = along_y(-0.01, 0.0262)
    area_at_arrival = strokes.make(tissue, arrives)[-1].cut_area
    area_after_rest = strokes.make(tissue, [arrives[-1]] * 400)[-1].cut_area
    in_tissue = tissue._stages.incision.path.t1[
        tissue._stages.incision.path.member
    ]  # in the rest shape, where it lags behind the blade
    swept = float(np.trapezoid(in_tissue[:, 1].clip(0.0), in_tissue[:, 2].clip(0.0, EDGE)))
    assert area_at_arrival < 0.9 * swept
    assert area_after_rest == pytest.approx(swept, rel=0.1)


def along_x(stop: float) -> Stroke:
    """Return the stroke of an upright blade along x, across the other cuts, from x = -10 mm."""
    points = path((-0.01, X, -0.01), (stop, X, -0.01))
    return [pose(tip, tip + 0.08 * Z, (1.0, 0.0, 0.0)) for tip in points]


APART = MESHES["Delaunay"]
"""A coarse mesh for several cuts: separate pieces touch, and contact is slow."""


@pytest.mark.parametrize("name", ["grid", "Delaunay"])
def test_a_blade_that_follows_an_earlier_incision_cuts_nothing(name):
    there = along_y(-0.01, 0.09)
    once, twice = perform(MESHES[name], there), perform(MESHES[name], there, there)
    assert twice.n_tetrahedra == once.n_tetrahedra
    assert twice.area == pytest.approx(once.area, rel=1e-9)


def test_two_cuts_that_cross_leave_four_pieces():
    assert perform(APART, along_y(-0.01, 0.09), along_x(0.09), lips_match=False).n_pieces == 4


def test_a_cut_that_ends_beyond_an_earlier_one_cuts_off_a_quarter():
    assert perform(APART, along_y(-0.01, 0.09), along_x(0.043), lips_match=False).n_pieces == 3
