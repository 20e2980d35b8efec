"""The order of hits does not depend on the order in which they are found."""

import numpy as np
import pytest

from tissue.contact.hits import add_hit, new_hits, sort_hits

pytestmark = pytest.mark.kernel


def test_hits_are_sorted_by_their_nodes():
    random = np.random.default_rng(0)
    rows = [tuple(row) for row in random.integers(0, 6, (100, 4)).tolist()]
    hits = new_hits(100)
    for row in rows:
        add_hit(hits, row, row[0], row[3])
    sort_hits(hits)
    assert [tuple(row) for row in hits.node.tolist()] == sorted(rows)
    np.testing.assert_array_equal(hits.face, hits.node[:, [0, 3]])
