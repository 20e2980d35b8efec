import numpy as np
import pytest

from tests.tissue.geometry_of_meshes import dihedral_angles
from tissue.mesh.faces import boundary_faces
from tissue.mesh.validation import checked, signed_volumes
from tissue.shapes.isosurface_stuffing import (
    ALPHA_LONG,
    ALPHA_SHORT,
    bisected,
    checked_box,
    edges_between,
    lattice_of,
    moved_to_surface,
    stuff,
)

BOX = [[-0.05] * 3, [0.05] * 3]


def ball(centre=(0.0, 0.0, 0.0), radius=0.03):
    return lambda points: radius - np.linalg.norm(points - np.array(centre), axis=1)


def stretched_ball(stretch):
    return lambda points: 0.04 - np.linalg.norm(points * stretch, axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_the_angles_are_within_the_bounds_that_labelle_and_shewchuk_prove(seed):
    rng = np.random.default_rng(seed)
    shape = ball(rng.uniform(-0.005, 0.005, 3), rng.uniform(0.02, 0.04))
    angles = dihedral_angles(stuff(shape, BOX, rng.uniform(0.006, 0.009)))
    assert angles.min() >= 10.78
    assert angles.max() <= 164.74


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (1.0, 1.5, 2.0), (2.0, 1.0, 1.2)])
def test_neighbours_agree_on_every_face(stretch):
    mesh = stuff(stretched_ball(stretch), BOX, 0.006)
    assert checked(mesh).warnings == ()
    triangles = boundary_faces(mesh.tetrahedra)
    directed = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    assert {tuple(e) for e in directed} == {tuple(e) for e in directed[:, ::-1]}


def test_all_surface_nodes_are_on_the_surface():
    mesh = stuff(ball(), BOX, 0.007)
    on_surface = mesh.positions[np.unique(boundary_faces(mesh.tetrahedra))]
    assert np.linalg.norm(on_surface, axis=1) == pytest.approx(0.03, abs=1e-12)


def test_the_volume_converges_with_the_square_of_the_spacing():
    missing = []
    for spacing in (0.008, 0.004):
        volume = signed_volumes(*stuff(ball(), BOX, spacing)[:2]).sum()
        missing.append(1.0 - volume / (4.0 / 3.0 * np.pi * 0.03**3))
    assert missing[1] < 0.35 * missing[0] < 0.02


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((ball(radius=0.1), BOX, 0.01), "not within the bounds"),
        ((ball(radius=-1.0), BOX, 0.01), "holds no point"),
        ((ball(), BOX, 0.0), "positive"),
        ((ball(), BOX, 1e-6), "make it larger"),
        ((ball(), BOX[::-1], 0.01), "bounds"),
        ((lambda points: np.full(len(points), np.nan), BOX, 0.01), "not finite"),
    ],
)
def test_an_impossible_shape_is_refused_with_the_reason(arguments, message):
    with pytest.raises(ValueError, match=message):
        stuff(*arguments)


@pytest.mark.parametrize("seed", range(3))
def test_points_are_moved_as_if_in_turn(seed):
    rng = np.random.default_rng(seed)
    shape = stretched_ball(rng.uniform(1.0, 1.5, 3))
    lattice = lattice_of(*checked_box(BOX, 0.008), 0.008)
    signs = np.sign(shape(lattice.points)).astype(np.int64)
    edges = edges_between(lattice.tetrahedra(), signs)
    ends = lattice.points[np.where((signs[edges[:, 0]] > 0)[:, None], edges, edges[:, ::-1])]
    cuts = bisected(shape, ends[:, 0], ends[:, 1])
    moved = moved_to_surface(lattice.points, signs, edges, cuts)
    points, is_cut = moved_in_turn(lattice.points, edges, cuts)
    np.testing.assert_array_equal(moved.points, points)
    np.testing.assert_array_equal(moved.is_cut, is_cut)


def moved_in_turn(points, edges, cuts):
    points, before, is_cut = points.copy(), points, np.ones(len(edges), dtype=bool)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    limits = np.where(lengths > 0.95 * lengths.max(), ALPHA_LONG, ALPHA_SHORT) * lengths
    for node in np.unique(edges):
        of_node = np.flatnonzero((edges == node).any(axis=1) & is_cut)
        ways = np.linalg.norm(cuts[of_node] - before[node], axis=1)
        near = ways < limits[of_node]
        if near.any():
            points[node] = cuts[of_node[near][np.argmin(ways[near])]]
            is_cut[of_node] = False
    return points, is_cut
