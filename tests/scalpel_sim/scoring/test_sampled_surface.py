"""Places on triangles, and distances from surfaces, against sums over all places and corners."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from scalpel_sim.scoring.sampled_surface import (
    SampledSurface,
    SurfaceSearch,
    parts_of_triangles,
    places_on_edges,
    sampled_triangles,
)

SPACING = 2.5e-3
RANDOM = np.random.default_rng(5)
TRIANGLES = RANDOM.uniform(0.0, 0.02, (40, 3, 3))


def wavy(n):
    """Return a surface of n x n places that is not flat, and has a hole."""
    x, y = (each.ravel() for each in np.meshgrid(*(np.arange(n) * SPACING,) * 2))
    kept = np.hypot(x - 0.03, y - 0.04) > 0.012
    x, y = x[kept], y[kept]
    places = np.column_stack([x, y, 5e-3 * np.sin(80.0 * x)])
    normals = np.column_stack([-0.4 * np.cos(80.0 * x), np.zeros_like(x), np.ones_like(x)])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return SampledSurface(places, normals, np.full(len(x), SPACING**2))


@pytest.mark.parametrize("n", [4, 9, 40])
def test_distances_are_those_of_the_nearest_places(n):
    surface = wavy(n)
    points = RANDOM.uniform(-0.05, 0.12, (500, 3))
    _, nearest = cKDTree(surface.points).query(points)
    offsets = points - surface.points[nearest]
    across = np.einsum("nx,nx->n", offsets, surface.normals[nearest])
    along = np.linalg.norm(offsets - across[:, None] * surface.normals[nearest], axis=1)
    expected = np.hypot(across, np.maximum(along - SPACING / 2.0**0.5, 0.0))
    search = SurfaceSearch(surface, SPACING)
    np.testing.assert_allclose(search.distances(points), expected, rtol=1e-12, atol=1e-15)
    assert search.least_distance(points, np.inf) == pytest.approx(expected.min(), rel=1e-12)
    assert search.least_distance(points, 1e-9) == 1e-9


def test_parts_of_triangles_are_small_and_add_up_to_them():
    middles, normals, areas = parts_of_triangles(TRIANGLES.reshape(-1, 3), SPACING)
    sides = np.linalg.norm(TRIANGLES - np.roll(TRIANGLES, -1, axis=1), axis=2).max(axis=1)
    counts = np.ceil(sides / SPACING).astype(int) ** 2
    assert len(middles) == counts.sum()
    first = 0
    for corners, n in zip(TRIANGLES, counts, strict=True):
        mine = slice(first, first + n)
        cross = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        np.testing.assert_allclose(areas[mine] * n, 0.5 * np.linalg.norm(cross))
        np.testing.assert_allclose(normals[mine], [cross / np.linalg.norm(cross)] * n)
        np.testing.assert_allclose(middles[mine].mean(axis=0), corners.mean(axis=0))
        apart, _ = cKDTree(middles[mine]).query(middles[mine], k=2)
        assert n == 1 or (apart[:, 1] > 0.0).all()
        first += n


def test_places_on_edges_are_on_them_and_near_each_other():
    places = places_on_edges(TRIANGLES.reshape(-1, 3), SPACING)
    first = 0
    for corners in TRIANGLES:
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            n = int(np.ceil(np.linalg.norm(end - start) / SPACING))
            shares = np.arange(n)[:, None] / n
            np.testing.assert_allclose(places[first : first + n], start + shares * (end - start))
            first += n
    assert first == len(places)


def test_triangles_of_a_surface_are_sampled_by_area():
    sampled = sampled_triangles(TRIANGLES, SPACING)
    crossed = np.cross(TRIANGLES[:, 1] - TRIANGLES[:, 0], TRIANGLES[:, 2] - TRIANGLES[:, 0])
    assert sampled.areas.sum() == pytest.approx(0.5 * np.linalg.norm(crossed, axis=1).sum())
