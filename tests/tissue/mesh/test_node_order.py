"""Renumbering that gives neighbouring nodes similar numbers."""

import numpy as np

from tests.support import bodies
from tests.tissue.io import mesh_writers
from tissue import TetrahedralMesh, read_mesh
from tissue.io import mesh_io
from tissue.io.mesh_io import renumbered


def shuffled(mesh):
    """Return a mesh with its nodes and tetrahedra in random order."""
    random = np.random.default_rng(0)
    order = random.permutation(len(mesh.positions))
    place = np.argsort(order)
    tetrahedra = random.permutation(place[mesh.tetrahedra])
    return TetrahedralMesh(mesh.positions[order], tetrahedra)


def spread(mesh):
    """Return the mean range of the node numbers of a tetrahedron."""
    return np.ptp(mesh.tetrahedra, axis=1).mean()


def test_renumbering_does_not_change_the_geometry():
    mesh = shuffled(bodies.jittered(4, 0))
    other, place = renumbered(mesh)
    np.testing.assert_array_equal(other.positions[place], mesh.positions)

    def corners(m):
        return sorted(map(tuple, m.positions[m.tetrahedra].reshape(-1, 12).tolist()))

    assert corners(other) == corners(mesh)


def test_numbers_of_neighbours_are_about_as_close_as_in_a_grid():
    mesh = bodies.jittered(6, 0)
    assert spread(renumbered(shuffled(mesh))[0]) < 1.3 * spread(mesh) < 0.4 * spread(shuffled(mesh))


def test_a_large_body_is_renumbered_as_it_is_read(tmp_path, monkeypatch):
    mesh = shuffled(bodies.jittered(4, 0))
    (tmp_path / "body.vtu").write_bytes(mesh_writers.vtu(mesh))
    np.testing.assert_array_equal(read_mesh(tmp_path / "body.vtu").tetrahedra, mesh.tetrahedra)
    monkeypatch.setattr(mesh_io, "RENUMBER_FROM", len(mesh.tetrahedra))
    read = read_mesh(tmp_path / "body.vtu")
    np.testing.assert_array_equal(read.tetrahedra, renumbered(mesh)[0].tetrahedra)


def test_tetrahedra_are_sorted_by_their_nodes():
    lowest = renumbered(shuffled(bodies.jittered(4, 0)))[0].tetrahedra.min(axis=1)
    assert (np.diff(lowest) >= 0).all()
