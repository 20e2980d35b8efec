"""Splits of single tetrahedra: nodes, links, masses and momentum."""

import numpy as np
import pytest

from tests.support import bodies, naive, soundness
from tests.tissue.cutting.bielser_1998.splits import splits_of
from tests.tissue.kernels_of import DENSITY
from tissue.blade.blade_state import SEARCH
from tissue.blade.return_mapping import locate
from tissue.core.vec3 import Vec3
from tissue.cutting.bielser_1998.case_table import TABLE
from tissue.cutting.bielser_1998.subdivision import split_tetrahedron
from tissue.cutting.bielser_1998.template_1_to_17 import EDGES, is_edge_cut
from tissue.mesh.body import OUTER, behind, n_behind
from tissue.mesh.nonconforming import HANGING
from tissue.mesh.pieces import label_pieces
from tissue.mesh.star import no_visits

pytestmark = pytest.mark.kernel

COPIES = {"A": 6, "B": 8, "C": 1, "D": 3, "E": 5}
PIECES = {"A": 2, "B": 2, "C": 1, "D": 1, "E": 1}


def n_pieces(splits):
    piece, queue = np.zeros((2, len(splits.tetrahedra)), np.int64)
    return label_pieces(splits.body, piece, queue)


def split_by(code, mesh=None, at=0.4):
    """Return a tetrahedron split by a cut-edge code."""
    splits = splits_of(mesh or bodies.unit_tetrahedron())
    for e, (a, b) in enumerate(EDGES):
        if is_edge_cut(code, e):
            splits.cross(*splits.tetrahedra[0, [a, b]].tolist(), at)
    assert splits.split(0) == code
    return splits


def set_random_velocities(splits, seed=0):
    """Give every node a random velocity."""
    random = np.random.default_rng(seed)
    n = splits.body.n_nodes
    splits.body.velocities[:n] = random.normal(size=(n, 3))


@pytest.mark.parametrize("code", TABLE)
def test_a_tetrahedron_falls_apart_by_its_code(code):
    splits = split_by(code)
    case = TABLE[code].case
    assert len(splits.tetrahedra) == 17
    assert len(splits.rest) == 14 + COPIES[case]
    assert n_pieces(splits) == soundness.n_pieces(splits.tetrahedra) == PIECES[case]
    assert soundness.n_split_stars(splits.tetrahedra) == 0
    assert soundness.is_closed(soundness.faces_of(splits.tetrahedra).boundary)
    volumes = soundness.volumes(splits.rest, splits.tetrahedra)
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(1.0 / 6.0, rel=1e-14)


@pytest.mark.parametrize("code", TABLE)
def test_mass_and_momentum_are_conserved(code):
    splits = splits_of(bodies.unit_tetrahedron())
    set_random_velocities(splits)
    before = splits.momentum
    for e, ends in enumerate(EDGES):
        if is_edge_cut(code, e):
            splits.cross(*ends, 0.3)
    splits.split(0)
    assert splits.body.masses.sum() == pytest.approx(DENSITY / 6.0, rel=1e-13)
    assert splits.momentum == pytest.approx(before, rel=1e-12)
    expected = naive.masses(splits.rest, splits.tetrahedra, DENSITY)
    np.testing.assert_allclose(splits.body.masses[: len(expected)], expected, rtol=1e-12)


def two_split(order=(0, 1)):
    """Return tetrahedra on either side of face 1 2 3 with nodes 0 and 4 cut off, split in order."""
    splits = splits_of(bodies.two_tetrahedra())
    for edge in ((0, 1), (1, 4), (1, 2), (1, 3)):
        splits.cross(*edge, 0.4)
    for t in order:
        splits.split(t)
    return splits


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_two_neighbours_share_the_nodes_between_them(order):
    splits = two_split(order)
    assert len(splits.tetrahedra) == 34
    np.testing.assert_array_equal(
        np.where(splits.body.links[:34] < 0, OUTER, splits.body.links[:34]),
        naive.links(splits.tetrahedra),
    )
    assert soundness.n_split_stars(splits.tetrahedra) == 0
    assert n_pieces(splits) == 2
    shared = 3 + 2 + 2 + 1 + 2  # corners, nodes of cut edges, of the other edge, and of the face
    assert len(splits.rest) == 2 * 20 - shared


def test_an_uncut_neighbour_has_six_small_faces_behind_its_large_one():
    splits = two_split(order=(0,))
    body = splits.body
    link = int(body.links[1, 0])
    assert link <= HANGING
    small = [behind(body, 1, link, i) for i in range(n_behind(body, 1, link))]
    assert len(set(small)) == 6
    for t in small:
        face = list(body.links[t]).index(link)
        assert n_behind(body, t, link) == 1
        assert behind(body, t, link, 0) == 1
        on_plane = np.delete(body.tetrahedra[t], face)
        assert body.rest[on_plane].sum(axis=1) == pytest.approx(1.0)
    statistics = splits.scheme.statistics(body)
    assert statistics.n_hanging_face_nodes == 1
    assert statistics.n_hanging_edge_nodes == 3


def test_an_uncut_neighbour_connects_the_body():
    assert n_pieces(two_split(order=(0,))) == 1


def test_every_child_is_found_from_an_uncut_neighbour_and_vice_versa():
    splits = splits_of(bodies.two_tetrahedra())
    splits.cross(1, 2)
    splits.split(0)
    visits, queue = no_visits(64, 1024), np.zeros(SEARCH, np.int64)
    for t in range(len(splits.tetrahedra)):
        centroid = Vec3(*splits.rest[splits.tetrahedra[t]].mean(axis=0))
        for start in (0, 1, t):
            assert locate(splits.body, visits, centroid, start, queue)[:2] == (t, True)


def test_momentum_is_conserved_when_mass_joins_a_hanging_node():
    splits = two_split(order=(0,))
    set_random_velocities(splits)
    before = splits.momentum
    splits.split(1)
    assert splits.momentum == pytest.approx(before, rel=1e-12)
    assert splits.body.masses.sum() == pytest.approx(DENSITY * 0.5, rel=1e-13)


def test_an_edge_that_a_split_neighbour_has_uncut_is_not_separated():
    splits = splits_of(bodies.two_tetrahedra())
    splits.cross(0, 1)
    splits.split(0)
    n = len(splits.rest)
    splits.cross(1, 2)
    splits.split(1)
    records = splits.scheme._records
    edge = next(e for e in range(len(records.edges)) if records.edges[e].tolist() == [1, 2])
    assert records.edge_nodes[edge, 0] == records.edge_nodes[edge, 1]
    assert len(splits.rest) == n + 3 + 3  # only nodes on the edges and in the faces at node 4


def test_new_nodes_between_fixed_nodes_are_fixed():
    splits = splits_of(bodies.unit_tetrahedron())
    splits.body.fixed[[0, 1]] = True
    splits.cross(0, 1)
    splits.split(0)
    midpoints = np.flatnonzero(splits.body.fixed[: len(splits.rest)])
    assert len(midpoints) == 4  # two corners, two nodes on the edge between them
    np.testing.assert_array_equal(splits.body.velocities[midpoints], 0.0)


def test_nothing_is_split_without_capacity():
    splits = splits_of(bodies.unit_tetrahedron())
    splits.cross(0, 1)
    splits.body.n_tetrahedra = len(splits.body.tetrahedra) - 15
    assert not split_tetrahedron(splits.scheme._split(splits.body), 0, 0b100000)
    assert splits.scheme.change.is_full == 1
    assert splits.body.n_nodes == 4
