"""Two blocks, one on the other, and the pairs that a search keeps of them."""

import numpy as np

from tests.support.overlaps import joined
from tissue import block
from tissue.contact.geometry.faces import new_faces, update_normals, with_found_pieces
from tissue.contact.search.edge_pairs import new_edge_pairs, pair_edges
from tissue.contact.search.feature_edges import new_feature_edges
from tissue.contact.search.near_pairs import new_near_pairs
from tissue.contact.search.node_motion import IN_BALL, measure_motion, new_node_motion, note_places
from tissue.contact.search.pair_update import update_pairs
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
        self.motion = new_node_motion(self.body.n_nodes, SIZE)
        self.pairs = new_near_pairs(self.body.n_nodes, len(self.faces.face), 4096)
        self.edges = new_feature_edges(len(self.faces.face))
        self.edge_pairs = new_edge_pairs(4096)
        self.n_updates = 0

    def update(self):
        """Update the pairs if a node has left its ball."""
        where = measure_motion(self.motion, self.body, self.pairs.nodes, self.pairs.n_nodes)
        if where != IN_BALL or self.n_updates == 0:
            inverted = np.zeros(self.body.n_nodes, np.int64)
            update_normals(self.faces, self.body, self.normal, inverted, 1)
            of_faces = (self.pairs, self.motion, self.edges, self.faces, self.body, self.normal)
            assert update_pairs(*of_faces)
            found, edges = self.edge_pairs, self.edges
            assert pair_edges(found, edges, self.pairs, self.motion, self.faces)
            self.n_updates += 1
        note_places(self.motion, self.body)
