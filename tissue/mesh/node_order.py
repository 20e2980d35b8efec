"""Number nodes and tetrahedra so that neighbours are near each other in memory."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from tissue.core.array_types import IntArray
from tissue.types import TetrahedralMesh


def renumbered(mesh: TetrahedralMesh) -> tuple[TetrahedralMesh, IntArray]:
    """Return the mesh in the order of reverse Cuthill and McKee, and the new number of each node.

    Node `i` of `mesh` is node `place[i]` of the mesh returned. Tetrahedra are in the order of their
    lowest nodes.
    """
    n = len(mesh.positions)
    pairs = mesh.tetrahedra[:, [0, 0, 0, 1, 1, 2, 1, 2, 3, 2, 3, 3]]
    ends = pairs.reshape(-1, 2, 6)
    a, b = ends[:, 0].ravel(), ends[:, 1].ravel()
    edges = csr_array((np.ones(2 * len(a), np.int8), (np.r_[a, b], np.r_[b, a])), shape=(n, n))
    order = np.asarray(reverse_cuthill_mckee(edges, symmetric_mode=True), dtype=np.int64)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    tetrahedra = place[mesh.tetrahedra]
    tetrahedra = tetrahedra[np.argsort(tetrahedra.min(axis=1), kind="stable")]
    return TetrahedralMesh(mesh.positions[order], tetrahedra), place
