"""Splits of tetrahedra by given crossings, without a blade."""

from typing import NamedTuple

import numpy as np

from tests.tissue.kernels_of import DENSITY
from tissue import FloatArray, IntArray, TetrahedralMesh
from tissue.cutting.bielser_1998.mesh_records import cut_edge_code, edge_between, with_room_to_hang
from tissue.cutting.bielser_1998.scheme import PaperScheme
from tissue.cutting.bielser_1998.subdivision import split_tetrahedron
from tissue.mesh.body import Body, build_body, grown_body


class Splits(NamedTuple):
    """A body and the scheme that splits it."""

    body: Body
    scheme: PaperScheme

    def cross(self, a: int, b: int, at: float = 0.5) -> None:
        """Mark the edge from node `a` to node `b` as crossed, at a fraction of its length."""
        records = self.scheme._records
        edge = edge_between(records, min(a, b), max(a, b))
        records.crossed_at[edge] = at if a < b else 1.0 - at

    def split(self, t: int) -> int:
        """Split tetrahedron `t`; return its cut-edge code."""
        code = cut_edge_code(self.scheme._records, t)
        assert split_tetrahedron(self.scheme._split(self.body), t, code)
        return code

    @property
    def tetrahedra(self) -> IntArray:
        return self.body.tetrahedra[: self.body.n_tetrahedra]

    @property
    def rest(self) -> FloatArray:
        return self.body.rest[: self.body.n_nodes]

    @property
    def momentum(self) -> FloatArray:
        """Return the linear momentum of the body [kg m/s]."""
        n = self.body.n_nodes
        return self.body.masses[:n] @ self.body.velocities[:n]


def splits_of(mesh: TetrahedralMesh) -> Splits:
    """Return an uncut body with its masses, and a scheme to split it."""
    body = with_room_to_hang(build_body(mesh, None, None))
    n_nodes, n_tetrahedra = body.n_nodes, body.n_tetrahedra
    body = grown_body(body, n_nodes + 512, 32 * n_tetrahedra + 512)
    corners = mesh.positions[mesh.tetrahedra]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    np.add.at(body.masses, mesh.tetrahedra, 0.25 * DENSITY * volume[:, None])
    return Splits(body, PaperScheme(body, 1.0))
