"""Nodes inside another part without a contact are those that NumPy finds, and come out."""

import numpy as np
import pytest

from tests.tissue.contact.test_self_contact import SIZE, overlapping, rows_of, searched


def inside(body, t):
    """Return the nodes with barycentric weights above 0.02 in a tetrahedron that is not theirs."""
    corners = body.positions[body.tetrahedra[t]]
    matrix = np.vstack([corners.T, np.ones(4)])
    x = np.vstack([body.positions[: body.n_nodes].T, np.ones(body.n_nodes)])
    weights = np.linalg.solve(matrix, x)
    found = np.flatnonzero(weights.min(axis=0) > 0.02)
    return set(map(int, found)) - set(map(int, body.tetrahedra[t]))


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(3))
def test_nodes_in_tetrahedra_of_another_part_are_found(seed):
    body, _ = overlapping(0.4 * SIZE, seed)
    contact = searched(body, n=1)
    wanted = set().union(*(inside(body, t) for t in range(body.n_tetrahedra)))
    has_contact = set(map(int, contact.forces.node[rows_of(contact), 0]))
    contact = searched(body, n=4)
    pairs = contact.search.pairs
    found = set(map(int, np.flatnonzero(pairs.is_penetrating)))
    assert found == wanted - has_contact
    assert found
