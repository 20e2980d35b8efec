"""Meshes with bad tetrahedra are repaired, and their surface stays where it was."""

import importlib.util

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from scalpel_sim.errors import UsageError
from scalpel_sim.meshing.distinct import distinct
from scalpel_sim.meshing.local_repair import mended
from scalpel_sim.meshing.mended_mesh import mended_mesh
from scalpel_sim.meshing.repair import repaired
from tests.support import bodies
from tissue import (
    TetrahedralMesh,
    boundary_faces,
    liver_lobe,
    read_mesh,
    write_mesh,
)
from tissue.mesh.faces import sorted_faces
from tissue.mesh.validation import quality, signed_volumes

needs_mesher = pytest.mark.skipif(
    importlib.util.find_spec("pytetwild") is None, reason="the extra `mesh` is not installed"
)
LOBE_SIZE = float(np.linalg.norm(np.ptp(liver_lobe().positions, axis=0)))


def shaken(way, seed=0):
    """A liver lobe whose inner nodes are moved at random: half-flat, flat and inverted elements."""
    mesh = liver_lobe()
    inner = np.setdiff1d(np.arange(len(mesh.positions)), boundary_faces(mesh.tetrahedra))
    positions = mesh.positions.copy()
    positions[inner] += np.random.default_rng(seed).normal(0.0, way, (len(inner), 3))
    return TetrahedralMesh(positions, mesh.tetrahedra)


def shape_of(mesh):
    return quality(mesh.positions, mesh.tetrahedra)


def farthest(mesh, other):
    """How far the skin of a mesh is from that of another [m]: from its nodes to their faces."""
    skin = trimesh.Trimesh(other.positions, boundary_faces(other.tetrahedra), process=False)
    points = mesh.positions[np.unique(boundary_faces(mesh.tetrahedra))]
    _, near = cKDTree(skin.triangles_center).query(points, k=50)
    at = np.repeat(points, 50, axis=0)
    closest = trimesh.triangles.closest_point(skin.triangles[near.ravel()], at)
    return np.linalg.norm(at - closest, axis=1).reshape(-1, 50).min(axis=1).max()


@pytest.mark.parametrize(("way", "lowest"), [(0.001, -0.2), (0.0015, -0.5), (0.002, -0.8)])
def test_flat_and_inverted_tetrahedra_are_mended_in_place(way, lowest):
    before = shaken(way)
    assert shape_of(before).min() < lowest
    after = mended_mesh(before, LOBE_SIZE).mesh
    assert shape_of(after).min() >= 0.1
    assert max(farthest(after, before), farthest(before, after)) <= 0.01 * LOBE_SIZE
    volumes = [signed_volumes(m.positions, m.tetrahedra).sum() for m in (before, after)]
    assert volumes[1] == pytest.approx(volumes[0], rel=2e-3)


def test_a_good_mesh_stays_as_it_is_to_the_bit():
    local = mended(liver_lobe(), 0.1, 0.001)
    np.testing.assert_array_equal(local.mesh.positions, liver_lobe().positions)
    np.testing.assert_array_equal(local.mesh.tetrahedra, liver_lobe().tetrahedra)


def test_mending_keeps_the_volumes_of_labels_and_the_faces_between_them():
    before = shaken(0.001)
    middle = liver_lobe().positions[before.tetrahedra].mean(axis=1)[:, 0]
    before = before._replace(labels=np.where(middle > np.median(middle), 5, 2))
    after = mended(before, 0.1, 0.003 * LOBE_SIZE).mesh
    assert shape_of(after).min() >= 0.1
    for label in (2, 5):
        own = [
            signed_volumes(m.positions, m.tetrahedra)[m.labels == label].sum()
            for m in (before, after)
        ]
        assert own[1] == pytest.approx(own[0], rel=5e-3)
    assert sorted_faces(after.tetrahedra).counts.max() == 2


def test_what_is_there_twice_or_not_used_goes_and_what_winds_otherwise_is_turned():
    mesh = bodies.jittered(3, 0)
    apart = mesh.positions[mesh.tetrahedra].reshape(-1, 3)  # no tetrahedron shares a node
    tets = np.arange(len(apart)).reshape(-1, 4)
    tets[::3] = tets[::3][:, [1, 0, 2, 3]]
    tets = np.vstack([tets, tets[:2], [[0, 1, 2, 2]]])
    given = TetrahedralMesh(np.vstack([[[9.0, 9.0, 9.0]], apart])[1:], tets)
    given = TetrahedralMesh(np.vstack([given.positions, [[9.0] * 3]]), tets)
    after, notes = distinct(given, 1e-9)
    assert len(after.positions) == len(mesh.positions)
    assert len(after.tetrahedra) == len(mesh.tetrahedra)
    assert signed_volumes(after.positions, after.tetrahedra).min() > 0.0
    assert [note.split()[0] for note in notes] == ["dropped", "merged", "dropped", "dropped", "put"]


@needs_mesher
def test_a_mesh_of_a_median_quality_of_0_18_is_filled_anew(tmp_path):
    before = shaken(0.004)
    assert np.median(shape_of(before)) < 0.18
    write_mesh(tmp_path / "before.vtu", before)
    made = repaired(tmp_path / "before.vtu")
    assert "filled the skin anew" in made.notes
    assert shape_of(made.mesh).min() >= 0.1
    assert max(farthest(made.mesh, before), farthest(before, made.mesh)) <= 0.01 * LOBE_SIZE


@needs_mesher
def test_a_mesh_that_run_refuses_is_repaired_and_taken(tmp_path):
    bad = shaken(0.002)
    write_mesh(tmp_path / "bad.vtu", TetrahedralMesh(1e3 * bad.positions, bad.tetrahedra))
    with pytest.raises(ValueError, match=r"bad\.vtu"):
        read_mesh(tmp_path / "bad.vtu", 1e-3)
    with pytest.raises(UsageError, match=r"Millimetres\? Then add --scale 0\.001"):
        repaired(tmp_path / "bad.vtu")
    made = repaired(tmp_path / "bad.vtu", scale=1e-3)
    write_mesh(tmp_path / "good.vtu", made.mesh)
    assert shape_of(read_mesh(tmp_path / "good.vtu")).min() >= 0.1
    assert any("mended from a quality of -0.9" in note for note in made.notes)
