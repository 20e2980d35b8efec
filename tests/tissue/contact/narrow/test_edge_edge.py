"""The prefilter of eight pairs of edges leaves out none that touch."""

import numpy as np
import pytest

from tests.support import strokes
from tests.system.contact.test_contact import pressed_blocks
from tests.tissue.contact.test_search_stages import cut_block
from tissue.contact.narrow.edge_edge import (
    crossing_pairs,
    edge_touch_of,
    note_ends,
    note_tips,
    pushing_pairs,
)
from tissue.core.simd import WIDTH


def kept(search, body):
    """Return which pairs the prefilter keeps, and the slack of those that are apart [m]."""
    found, n = search.edge_pairs, search.edge_pairs.n_pairs
    found.due[:n] = np.arange(n)
    note_ends(found, search.edges, n)
    note_tips(found, search.edges, n)
    bits, slack = [], []
    for k in range(0, n, WIDTH):
        near = crossing_pairs(found, body, search.motion.node_size, k)
        slack += list(found.slack)
        bits += [(near & pushing_pairs(found, body, k)) >> q & 1 for q in range(WIDTH)]
    return np.array(bits[:n], np.bool_), np.array(slack[:n])


@pytest.mark.parametrize("make", [cut_block, pressed_blocks])
def test_pairs_that_touch_are_kept_and_the_others_have_their_slack(make):
    tissue = make()
    contact, body = tissue._model.contact, tissue._body
    n_touching, n_left_out = 0, 0
    for _ in range(100):
        tissue.step(None, strokes.DT)
        search = contact.search
        is_kept, slack = kept(search, body)
        for k in range(search.edge_pairs.n_pairs):
            touch = edge_touch_of(search, body, k)
            if is_kept[k]:
                n_touching += touch.is_touching
                continue
            assert not touch.is_touching
            assert slack[k] == pytest.approx(touch.slack, rel=1e-9)
            n_left_out += 1
    assert n_touching > 0 and n_left_out > 500
