"""Two blocks, one on the other, and the pairs that a search keeps of them."""

import numpy as np

from tests.overlaps import joined
from tissue import block
from tissue.contact.faces import new_faces, with_found_pieces
from tissue.contact.node_normals import update_normals
from tissue.contact.penalty.near_pairs import new_near_pairs
from tissue.contact.penalty.node_ways import IN_BALL, measure_ways, new_node_ways, note_places
from tissue.contact.penalty.pair_update import update_pairs
from tissue.contact.penalty.ridge_pairs import new_ridge_pairs, pair_ridges
from tissue.contact.penalty.ridges import new_ridges
from tissue.mesh.body import build_body

SIZE = 0.01
"""Size of a node [m]."""


class TwoBlocks:
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
        self.ridges = new_ridges(len(self.faces.face))
        self.ridge_pairs = new_ridge_pairs(4096)
        self.n_updates = 0

    def look(self):
        """Update the pairs if a node has left its ball."""
        where = measure_ways(self.ways, self.body, self.pairs.nodes, self.pairs.n_nodes)
        if where != IN_BALL or self.n_updates == 0:
            inverted = np.zeros(self.body.n_nodes, np.int64)
            update_normals(self.faces, self.body, self.normal, inverted, 1)
            of_faces = (self.pairs, self.ways, self.ridges, self.faces, self.body, self.normal)
            assert update_pairs(*of_faces)
            found, ridges = self.ridge_pairs, self.ridges
            assert pair_ridges(found, ridges, self.pairs, self.ways, self.faces)
            self.n_updates += 1
        note_places(self.ways, self.body)
