"""Pairs that are updated as nodes move are the same as if all were listed anew."""

import numpy as np
import pytest

from tests.test_contact import joined
from tissue import block
from tissue.contact.faces import new_faces, with_found_pieces
from tissue.contact.node_normals import update_normals
from tissue.contact.penalty.near_pairs import new_near_pairs
from tissue.contact.penalty.node_ways import IN_BALL, measure_ways, new_node_ways, note_places
from tissue.contact.penalty.pair_update import CONTACT_REACH, update_pairs
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

SIZE = 0.01


class Search:
    """Two blocks, one on the other, and the pairs between them."""

    def __init__(self):
        upper = block((2, 2, 1), (0.017, 0.017, 0.01))
        mesh = joined(block((2, 2, 1), (0.02, 0.02, 0.01)), upper, (0.003, 0.002, 0.0102))
        self.body = build_body(mesh, None, None)
        self.is_upper = np.arange(self.body.n_nodes) >= 18
        self.faces = with_found_pieces(new_faces(self.body.n_tetrahedra), self.body)
        self.normal = np.zeros((self.body.n_nodes, 3))
        self.ways = new_node_ways(self.body.n_nodes, SIZE)
        self.pairs = new_near_pairs(self.body.n_nodes, len(self.faces.face), 4096)
        self.n_updates = 0

    def look(self):
        """Update the pairs where a node has left its ball."""
        where = measure_ways(self.ways, self.body, self.pairs.nodes, self.pairs.n_nodes)
        if where != IN_BALL or self.n_updates == 0:
            inverted = np.zeros(self.body.n_nodes, np.int64)
            update_normals(self.faces, self.body, self.normal, inverted, 1)
            assert update_pairs(self.pairs, self.ways, self.faces, self.body, self.normal)
            self.n_updates += 1
        note_places(self.ways, self.body)

    def listed(self):
        """Return the pairs in the list."""
        rows = slice(self.pairs.first, self.pairs.first + self.pairs.n_pairs)
        return list(zip(self.pairs.node[rows], self.pairs.face[rows], strict=True))

    def touching(self):
        """Return the pairs of a node and a face of the other block that are within reach."""
        x, pairs = self.body.positions, self.pairs
        for face in np.flatnonzero(pairs.is_active):
            corners = pairs.triangle[face]
            a, b, c = x[corners]
            area = np.cross(b - a, c - a)
            outward = area / np.linalg.norm(area)
            for node in np.flatnonzero(self.is_upper != self.is_upper[corners[0]]):
                height = (x[node] - a) @ outward
                foot = x[node] - height * outward
                is_over = all(
                    np.cross(q - p, foot - p) @ outward > 0.0 for p, q in ((a, b), (b, c), (c, a))
                )
                is_facing = self.normal[node] @ outward < 0.0
                if is_over and is_facing and abs(height) < CONTACT_REACH * SIZE:
                    yield node, face


@pytest.mark.parametrize("seed", range(3))
def test_no_pair_within_reach_is_missing_as_nodes_move(seed):
    search, random = Search(), np.random.default_rng(seed)
    n_touching = 0
    for _ in range(12):
        move = random.normal(scale=2e-4, size=search.body.positions.shape)
        drift = random.normal(scale=3e-4, size=3) * [1.0, 1.0, 0.3]
        search.body.positions[:] += move * (random.random() < 0.5)
        search.body.positions[search.is_upper] += drift
        search.look()
        listed = set(search.listed())
        touching = set(search.touching())
        assert touching <= listed
        n_touching += len(touching)
    assert n_touching > 20 and search.n_updates > 2


def test_no_pair_is_listed_twice_and_they_are_sorted_by_nodes():
    search, random = Search(), np.random.default_rng(0)
    for _ in range(6):
        which = random.random(search.body.n_nodes) < 0.3
        search.body.positions[which] += random.normal(scale=1e-3, size=(which.sum(), 3))
        search.look()
    listed, pairs = search.listed(), search.pairs
    assert search.n_updates > 3
    assert len(listed) == len(set(listed)) > 0
    for node in pairs.nodes[: pairs.n_nodes]:
        own = slice(pairs.first + pairs.begin[node], pairs.first + pairs.end[node])
        assert (pairs.node[own] == node).all()
        assert pairs.end[node] - pairs.begin[node] == sum(n == node for n, _ in listed)
