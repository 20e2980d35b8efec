"""The list of cut faces: each area that a cut opens, once, in the body at rest."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.support import bodies, strokes
from tissue import BladeShape, Material, SolverSettings, Tissue, TissueState, block
from tissue.blade.prescribed_cut import cut_along
from tissue.support import mark_near_triangles, place_tree

ROUNDING = 1e-9
"""Relative difference of two sums of the same areas."""


def held(mesh, **settings):
    """Return a body between two sides, without gravity."""
    fixed, free = bodies.sides(mesh), (0.0, 0.0, 0.0)
    return Tissue(mesh, Material(), fixed=fixed, gravity=free, **settings)


def areas_of(corners):
    """Return the areas of triangles."""
    sides = corners[:, 1:] - corners[:, :1]
    return 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)


@pytest.mark.parametrize("kind", strokes.THROUGH)
def test_areas_add_up_to_the_area_that_was_cut(kind):
    mesh = bodies.jittered(4, 0)
    tissue = held(mesh, blade=BladeShape())
    last = strokes.make(tissue, strokes.THROUGH[kind](mesh))[-1]
    faces = tissue.cut_faces()
    assert last.cut_area > 0.04**2
    assert faces.areas.sum() == pytest.approx(last.cut_area, rel=ROUNDING)
    np.testing.assert_allclose(faces.areas, areas_of(faces.corners), rtol=ROUNDING)


def test_areas_of_the_paper_s_scheme_add_up_too():
    mesh = block((3, 3, 3), (0.04, 0.04, 0.04))
    springs = Material(law="springs", poisson_ratio=0.25)
    tissue = Tissue(mesh, springs, fixed=bodies.sides(mesh), solver=SolverSettings(scheme="paper"))
    last = strokes.make(tissue, strokes.straight(mesh, 0.47))[-1]
    assert last.cut_area > 0.0
    assert tissue.cut_faces().areas.sum() == pytest.approx(last.cut_area, rel=ROUNDING)


def test_a_face_that_a_second_cut_divides_is_listed_once():
    """The second crosses the first at right angles, and leaves four pieces."""
    size = 0.04
    tissue = held(bodies.jittered_grid(5, 1, size))
    low, high, middle = -0.01, 0.05, 0.5 * size
    for a, b, forward in (
        ((middle, low), (middle, high), (0.0, 1.0, 0.0)),
        ((low, middle), (high, middle), (1.0, 0.0, 0.0)),
    ):
        tissue.incise([[[*at, z] for z in (low, high)] for at in (a, b)], forward)
    assert tissue.n_pieces() == 4
    total = tissue.cut_faces().areas.sum()
    opened = tissue.surface()
    in_surface = 0.5 * areas_of(opened.rest_positions[opened.triangles[opened.is_cut]]).sum()
    assert total == pytest.approx(in_surface, rel=ROUNDING)
    assert total == pytest.approx(2.0 * size**2, rel=0.05)  # cuts go through nodes near them


def test_new_faces_are_read_from_a_number_on():
    mesh = bodies.jittered(4, 0)
    tissue, n, found = held(mesh), 0, []
    for sweep in strokes.sweeps(strokes.straight(mesh)):
        tissue.step(sweep, strokes.DT)
        found.append(tissue.cut_faces(since=n))
        n = tissue.n_cut_faces
    whole = tissue.cut_faces()
    for part in range(5):
        np.testing.assert_array_equal(np.concatenate([each[part] for each in found]), whole[part])
    with pytest.raises(ValueError, match="no face number"):
        tissue.cut_faces(since=n + 1)


def test_a_face_knows_its_step_its_cause_and_the_tissue_on_both_sides():
    """The blade goes along the border of two labels; before, a slit was given."""
    mesh = block((4, 4, 4), (0.04, 0.04, 0.04))
    x = mesh.positions[mesh.tetrahedra].mean(axis=1)[:, 0]
    labels = np.where(x < 0.02, 3, 7)
    tissue = held(mesh._replace(labels=labels))
    tissue.incise([[[0.02, y, z] for z in (0.02, 0.05)] for y in (-0.01, 0.021)], (0.0, 1.0, 0.0))
    n = tissue.n_cut_faces
    given = tissue.cut_faces()
    assert n > 0
    assert (given.causes == 2).all()
    assert (given.times == 0.0).all()
    cut_at = []
    for i, sweep in enumerate(strokes.sweeps(strokes.straight(mesh))):
        tissue.step(sweep, strokes.DT)
        cut_at += [strokes.DT * (i + 1)] * (tissue.n_cut_faces - n - len(cut_at))
    faces = tissue.cut_faces(since=n)
    assert (faces.causes == 0).all()
    np.testing.assert_allclose(faces.times, cut_at, rtol=ROUNDING)
    assert (np.sort(faces.labels, axis=1) == (3, 7)).all()


def test_finished_bridges_are_named_as_such():
    """Of 60 mm the edge cuts 55; the rest is a bridge that is finished."""
    tissue = Tissue(block(), gravity=(0.0, 0.0, 0.0))
    stages, forward = tissue._stages, np.tile([0.0, 1.0, 0.0], (2, 1))
    rows = np.array([[[0.02, y, z] for z in (-0.01, 0.05)] for y in (-0.01, 0.055)])
    cut_along(stages.incision, stages.hooks, rows, forward, tissue.node_size)
    stages.incision.path.has_left = 1
    stages.end_incision()
    faces = tissue.cut_faces()
    assert faces.areas[faces.causes == 1].sum() == pytest.approx(0.005 * 0.04, rel=ROUNDING)
    assert faces.areas[faces.causes == 0].sum() == pytest.approx(0.055 * 0.04, rel=ROUNDING)


@pytest.mark.parametrize("as_bytes", [False, True])
def test_a_state_has_the_faces(as_bytes):
    mesh = bodies.jittered(4, 0)
    sweeps = list(strokes.sweeps(strokes.straight(mesh)))
    tissue = held(mesh)
    for sweep in sweeps[:150]:
        tissue.step(sweep, strokes.DT)
    state, then = tissue.save_state(), tissue.cut_faces()
    assert then.n > 0
    for sweep in sweeps[150:]:
        tissue.step(sweep, strokes.DT)
    whole = tissue.cut_faces()
    assert whole.n > then.n
    if as_bytes:
        tissue, state = held(mesh), TissueState.from_bytes(state.to_bytes())
    tissue.load_state(state)
    for found, expected in zip(tissue.cut_faces(), then, strict=True):
        np.testing.assert_array_equal(found, expected)
    for sweep in sweeps[150:]:
        tissue.step(sweep, strokes.DT)
    for found, expected in zip(tissue.cut_faces(), whole, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_material_points_are_marked_where_the_tissue_is_stretched_too_far():
    """One half is stretched by 20 %: a strain of 0.22; the other turns, which is none."""
    mesh = block((2, 2, 2), (0.04, 0.04, 0.04))
    positions = mesh.positions.copy()
    positions[:, 1] *= np.where(mesh.positions[:, 0] > 0.03, 1.2, 1.0)
    tissue = Tissue(mesh, Material(), positions=positions, gravity=(0.0, 0.0, 0.0))
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    points, largest = tissue.material_points(middles), tissue.deformation().strain
    largest = np.linalg.eigvalsh(largest).max(axis=1)
    for limit in (0.01, 0.1, 0.3):
        marked = np.zeros(len(middles), bool)
        tissue.mark_strained(points, limit, marked)
        np.testing.assert_array_equal(marked, largest > limit)


def test_a_point_that_was_marked_stays_so():
    tissue = held(block((1, 1, 1), (0.04, 0.04, 0.04)))
    points = tissue.material_points([[0.01, 0.02, 0.02], [0.03, 0.02, 0.02]])
    marked = np.array([True, False])
    tissue.mark_strained(points, 0.1, marked)
    assert marked.tolist() == [True, False]


def test_a_material_point_is_looked_for_among_what_a_cut_has_made():
    tissue = held(block((4, 6, 4), (0.04, 0.06, 0.04)))
    before = tissue.snapshot()
    middles = before.rest_positions[before.tetrahedra].mean(axis=1)
    points = tissue.material_points(middles)
    ends, forward = [(0.013, -0.01), (0.021, 0.07)], np.array([0.1, 1.0, 0.0]) / 1.01**0.5
    tissue.incise([[(*at, z) for z in (0.013, 0.05)] for at in ends], forward)
    assert tissue.n_tetrahedra > len(middles)
    tissue.mark_strained(points, 0.5, np.zeros(len(middles), bool))
    after = tissue.snapshot()
    corners = after.rest_positions[after.tetrahedra[points.last_holders]]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    weights = np.linalg.solve(edges, (middles - corners[:, 0])[..., None])[..., 0]
    assert weights.min() > -1e-8
    assert weights.sum(axis=1).max() < 1.0 + 1e-8
    assert (points.last_holders != np.arange(len(middles))).any()


def test_points_near_a_triangle_are_marked():
    """Against the nearest of 200,000 places on the triangle."""
    random = np.random.default_rng(3)
    points, corners = random.uniform(-0.3, 1.3, (300, 3)), random.uniform(0.0, 1.0, (3, 3))
    shares = random.dirichlet(np.ones(3), 200_000)
    distances, _ = cKDTree(shares @ corners).query(points)
    clear = np.abs(distances - 0.5) > 0.01
    marked = np.zeros(len(points), bool)
    tree = place_tree(points)
    areas = random.uniform(0.0, 1.0, len(points))
    marked[:9] = True
    area = mark_near_triangles(tree, areas[tree.number], corners, 0.5, marked)
    assert area == pytest.approx(areas[9:][marked[9:]].sum())
    marked[:9] = distances[:9] < 0.5
    np.testing.assert_array_equal(marked[clear], distances[clear] < 0.5)
    assert 30 < marked.sum() < 270
