"""Random stellar splits: the mesh stays sound, and mass and momentum are conserved."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support import bodies, naive, soundness
from tests.tissue.kernels_of import DENSITY, cut_of, springs_of
from tissue import block
from tissue.core.vec3 import Vec3
from tissue.cutting.stellar_subdivision import (
    NO_ROOM,
    edge_split_is_good,
    face_split_is_good,
    split_edge,
    split_face,
)
from tissue.mesh.angular_momentum import return_spin

pytestmark = pytest.mark.kernel

MESHES = (block((1, 1, 1), (1.0, 1.0, 1.0)), bodies.jittered(2, 5, size=1.0))

SHARE = st.floats(0.2, 0.8)
SPLITS = st.lists(st.tuples(st.integers(0, 10**6), st.booleans(), SHARE, SHARE), max_size=8)
"""Splits: which tetrahedron, whether a face (else an edge) of it, and where."""


def split_all(cut, splits):
    """Split an edge or a face of a tetrahedron for each entry."""
    edges = list(itertools.combinations(range(4), 2))
    for which, face, s, t in splits:
        n = cut.body.n_tetrahedra
        nodes = cut.body.tetrahedra[which % n].tolist()
        if face:
            a, b, c = (nodes[(which + k) % 4] for k in range(3))
            node = split_face(cut, a, b, c, Vec3(s / 2.0, t / 2.0, 1.0 - s / 2.0 - t / 2.0))
        else:
            p, q = edges[which % 6]
            node = split_edge(cut, nodes[p], nodes[q], s)
        assert node == cut.body.n_nodes - 1


def mesh_of(cut):
    """Return the rest positions and tetrahedra in use."""
    body = cut.body
    return body.rest[: body.n_nodes], body.tetrahedra[: body.n_tetrahedra]


def perturb(cut, seed=0):
    """Give every node of the body a random displacement and velocity."""
    random = np.random.default_rng(seed)
    n = cut.body.n_nodes
    cut.body.positions[:n] += 0.1 * random.normal(size=(n, 3))
    cut.body.velocities[:n] = random.normal(size=(n, 3))


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.sampled_from(MESHES), SPLITS)
def test_splits_leave_a_sound_mesh_of_the_same_mass_and_momentum(mesh, splits):
    """A hanging node, inside a face of a neighbour, would add to the area of the boundary."""
    cut = cut_of(mesh)
    springs_of(cut.body)
    perturb(cut)
    before = cut.body.masses @ cut.body.velocities
    split_all(cut, splits)
    rest, tetrahedra = mesh_of(cut)
    np.testing.assert_array_equal(cut.body.links[: len(tetrahedra)], naive.links(tetrahedra))
    volumes = soundness.volumes(rest, tetrahedra)
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(1.0, rel=1e-13)
    faces = soundness.faces_of(tetrahedra)
    assert soundness.triangle_areas(rest, faces.boundary).sum() == pytest.approx(6.0, rel=1e-13)
    assert soundness.is_closed(faces.boundary)
    assert soundness.n_split_stars(tetrahedra) == 0
    assert soundness.n_pieces(tetrahedra) == 1
    for node in range(cut.body.n_nodes):
        assert node in tetrahedra[cut.body.node_tetrahedron[node]]
    springs_of(cut.body)
    assert cut.body.masses.sum() == pytest.approx(DENSITY, rel=1e-13)
    assert cut.body.masses @ cut.body.velocities == pytest.approx(before, abs=1e-12 * DENSITY)


def test_what_a_split_loses_of_angular_momentum_is_returned():
    cut = cut_of(MESHES[0])
    springs_of(cut.body)
    perturb(cut)

    def spin():
        body = cut.body
        moments = np.cross(body.positions[:, :3], body.velocities[:, :3])
        return body.masses @ moments

    before, nodes = spin(), cut.body.tetrahedra[0]
    split_edge(cut, nodes[0], nodes[1], 0.4)
    springs_of(cut.body)
    assert not np.allclose(spin(), before, atol=1e-3 * DENSITY)
    every = np.arange(cut.body.n_nodes)
    return_spin(cut.body, cut.change, every, len(every))
    np.testing.assert_allclose(spin(), before, atol=1e-12 * DENSITY)


def test_an_edge_split_doubles_the_tetrahedra_around_the_edge():
    cut = cut_of(MESHES[0])
    around = naive.star(MESHES[0].tetrahedra, 0) & naive.star(MESHES[0].tetrahedra, 7)
    assert len(around) == 6  # the diagonal of a cell
    split_edge(cut, 0, 7, 0.5)
    assert cut.body.n_tetrahedra == 12


def test_a_face_split_divides_each_tetrahedron_at_the_face_into_three():
    cut = cut_of(bodies.two_tetrahedra())
    node = split_face(cut, 1, 2, 3, Vec3(0.2, 0.3, 0.5))
    assert cut.body.n_tetrahedra == 6
    np.testing.assert_allclose(cut.body.rest[node], [0.2, 0.3, 0.5])


def test_position_and_velocity_of_a_new_node_are_interpolated_along_its_edge():
    cut = cut_of(bodies.unit_tetrahedron())
    perturb(cut)
    node = split_edge(cut, 0, 1, 0.25)
    for field in (cut.body.rest, cut.body.positions, cut.body.velocities):
        np.testing.assert_allclose(field[node], 0.75 * field[0] + 0.25 * field[1], atol=1e-15)


def test_a_new_node_is_fixed_only_between_fixed_nodes():
    cut = cut_of(bodies.unit_tetrahedron())
    cut.body.fixed[[0, 1]] = True
    assert cut.body.fixed[split_edge(cut, 0, 1, 0.5)]
    assert not cut.body.fixed[split_edge(cut, 0, 2, 0.5)]


def test_a_split_that_would_leave_a_flat_tetrahedron_is_not_good():
    cut = cut_of(bodies.unit_tetrahedron())
    guarded = cut.replaced(limits=cut.limits.replaced(guard=0.1))
    assert edge_split_is_good(guarded, 0, 1, 0.5)
    assert not edge_split_is_good(guarded, 0, 1, 0.05)
    assert face_split_is_good(guarded, 0, 1, 2, Vec3(1 / 3, 1 / 3, 1 / 3))
    assert not face_split_is_good(guarded, 0, 1, 2, Vec3(0.02, 0.49, 0.49))


def test_nothing_is_split_without_capacity():
    cut = cut_of(bodies.unit_tetrahedron())
    cut.body.n_nodes = len(cut.body.rest) - 1
    assert split_edge(cut, 0, 1, 0.5) == NO_ROOM
    assert cut.body.n_tetrahedra == 1
