"""Collision detection against a test of every edge and every tetrahedron."""

import itertools

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.kernels_of import cut_of
from tissue import block
from tissue.cutting.blade_path import path_travel, put_on_lattice
from tissue.cutting.collision_detection import find_active_tetrahedra, find_crossings

pytestmark = [
    pytest.mark.kernel,
    # The hash of an edge overflows on purpose; with the JIT off NumPy warns of it.
    pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning"),
]

MESHES = {
    "grid": block((3, 3, 3), (0.03, 0.03, 0.03)),
    "jittered": bodies.jittered(3, 7, size=0.03),
}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]


def swept(mesh, x, y, z, n_samples=4):
    """Return a cut step of an upright edge at `x` between z[0] and z[1], from y[0] to y[1] [m]."""
    cut = cut_of(mesh, n_samples)
    path = cut.path
    heights = np.linspace(*z, n_samples)
    for array, at in ((path.t0, y[0]), (path.t1, y[1])):
        array[:] = np.stack([np.full(n_samples, x), np.full(n_samples, at), heights], axis=1)
    centres = mesh.positions[mesh.tetrahedra].mean(axis=1)
    for k in range(n_samples):
        path.seed[k] = np.linalg.norm(centres - path.t1[k], axis=1).argmin()
    path.member[:] = True
    path.linked[:-1] = True
    put_on_lattice(path, cut.body.lattice)
    find_active_tetrahedra(cut)
    find_crossings(cut)
    return cut


def crossed(cut):
    """Return the crossed edges that were found, with the fraction at which each is crossed."""
    scratch = cut.scratch
    rows = range(scratch.n_crossings)
    return {
        (int(scratch.crossing[i, 0]), int(scratch.crossing[i, 1])): scratch.crossing_at[i, 0]
        for i in rows
    }


def through_window(mesh, x, y, z):
    """Return the edges that cross the plane at `x` within y[0]..y[1] and z[0]..z[1], and where."""
    found = {}
    for nodes in mesh.tetrahedra.tolist():
        for a, b in itertools.combinations(sorted(nodes), 2):
            p, q = mesh.positions[a], mesh.positions[b]
            if (p[0] - x) * (q[0] - x) < 0.0:
                at = (x - p[0]) / (q[0] - p[0])
                _, here_y, here_z = p + at * (q - p)
                if y[0] < here_y < y[1] and z[0] < here_z < z[1]:
                    found[a, b] = at
    return found


WINDOWS = {
    "a long step": ((0.0021, 0.0277), (-0.001, 0.031)),
    "a short step": ((0.0141, 0.0153), (-0.001, 0.031)),
    "the tip inside": ((0.0021, 0.0277), (0.0117, 0.031)),
}


@pytest.mark.parametrize("window", WINDOWS)
def test_the_crossed_edges_are_those_that_cross_the_swept_area(mesh, window):
    y, z = WINDOWS[window]
    expected = through_window(mesh, 0.0137, y, z)
    found = crossed(swept(mesh, 0.0137, y, z))
    assert found.keys() == expected.keys()
    for edge, at in found.items():
        assert at == pytest.approx(expected[edge], abs=1e-4)  # to the lattice spacing, 0.1 um


def test_two_steps_cross_the_same_edges_as_one_long_step(mesh):
    z = (-0.001, 0.031)
    once = crossed(swept(mesh, 0.0137, (0.0021, 0.0277), z))
    first = crossed(swept(mesh, 0.0137, (0.0021, 0.0149), z))
    second = crossed(swept(mesh, 0.0137, (0.0149, 0.0277), z))
    assert first.keys() | second.keys() == once.keys()
    assert not first.keys() & second.keys()


def test_all_tetrahedra_with_a_crossed_edge_are_active(mesh):
    cut = swept(mesh, 0.0137, (0.0021, 0.0277), (-0.001, 0.031))
    active = set(cut.scratch.active[: cut.scratch.n_active].tolist())
    for t, nodes in enumerate(mesh.tetrahedra.tolist()):
        edges = set(itertools.combinations(sorted(nodes), 2))
        if edges & crossed(cut).keys():
            assert t in active
    assert len(active) < len(mesh.tetrahedra)


def test_an_edge_that_does_not_move_crosses_nothing(mesh):
    cut = swept(mesh, 0.0137, (0.0141, 0.0141), (-0.001, 0.031))
    assert crossed(cut) == {}
    assert path_travel(cut.path) == 0.0
