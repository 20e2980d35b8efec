"""Meshes with bad tetrahedra are repaired, and their surface stays where it was."""

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import Delaunay, cKDTree

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
    report_on_mesh,
    write_mesh,
)
from tissue.mesh.faces import sorted_faces
from tissue.mesh.validation import quality, signed_volumes

needs_mesher = pytest.mark.skipif(
    importlib.util.find_spec("pytetwild") is None, reason="the extra `mesh` is not installed"
)
REAL_MESHES = os.environ.get("SCALPEL_SIM_TEST_MESHES")
"""Folder of meshes that others have made."""
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


def of_a_grid(seed=0):
    """Delaunay tetrahedra of a grid that is a little off: many are flat, as four corners are."""
    random, n = np.random.default_rng(seed), 7
    points = np.stack(np.meshgrid(*[np.linspace(0.0, 0.05, n)] * 3, indexing="ij"), -1)
    points = points.reshape(-1, 3)
    is_inner = (points > 1e-9) & (points < 0.05 - 1e-9)
    points = points + is_inner * random.normal(0.0, 1e-6, points.shape)
    return TetrahedralMesh(points, Delaunay(points).simplices)


def with_flat_ones(share=0.1, seed=0):
    """A liver lobe with inner nodes moved onto a face beside them."""
    random, mesh = np.random.default_rng(seed), liver_lobe()
    positions = mesh.positions.copy()
    inner = np.setdiff1d(np.arange(len(positions)), boundary_faces(mesh.tetrahedra))
    for node in random.permutation(inner)[: int(share * len(inner))]:
        around = mesh.tetrahedra[(mesh.tetrahedra == node).any(axis=1)]
        tet = around[random.integers(len(around))]
        positions[node] = positions[tet[tet != node]].mean(axis=0)
    return TetrahedralMesh(positions, mesh.tetrahedra)


@pytest.mark.parametrize("make", [of_a_grid, with_flat_ones])
def test_flat_tetrahedra_of_other_meshers_are_mended_in_place(make):
    before, _ = distinct(make(), 1e-9)
    size = float(np.linalg.norm(np.ptp(before.positions, axis=0)))
    assert shape_of(before).min() < 1e-3
    after = mended_mesh(before, size).mesh
    assert shape_of(after).min() >= 0.1
    assert max(farthest(after, before), farthest(before, after)) <= 0.01 * size


@needs_mesher
@pytest.mark.skipif(REAL_MESHES is None, reason="SCALPEL_SIM_TEST_MESHES names no folder")
def test_real_meshes_have_a_quality_of_a_tenth_and_keep_their_skin():
    files = sorted(Path(REAL_MESHES or "").glob("*.[mv][st][hk]"))
    assert files
    for file in files:
        unit = report_on_mesh(file).scale
        before, made = read_mesh(file, unit), repaired(file, scale=unit).mesh
        size = float(np.linalg.norm(np.ptp(before.positions, axis=0)))
        assert shape_of(made).min() >= 0.1, file
        assert max(farthest(made, before), farthest(before, made)) <= 0.01 * size, file


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


@needs_mesher
def test_a_mesh_that_is_filled_anew_keeps_its_labels(tmp_path):
    mesh = shaken(0.004)
    middle = liver_lobe().positions[mesh.tetrahedra].mean(axis=1)[:, 0]
    half = np.median(middle)
    names = {2: "near", 5: "far"}
    labels = np.where(middle > half, 5, 2)
    write_mesh(tmp_path / "before.vtu", mesh._replace(labels=labels))
    made = repaired(tmp_path / "before.vtu")
    assert "filled the skin anew" in made.notes
    assert set(np.unique(made.mesh.labels)) == set(names)
    at = made.mesh.positions[made.mesh.tetrahedra].mean(axis=1)[:, 0]
    far = np.abs(at - half) > 0.012  # nodes were moved by 4 mm, and an element is 4 mm wide
    np.testing.assert_array_equal(made.mesh.labels[far], np.where(at > half, 5, 2)[far])
    assert "volumes of them changed by 2 " in made.notes[-1]
