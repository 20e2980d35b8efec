"""What is at rest is left alone; the contacts are those of tests of all pairs in every search."""

from functools import partial

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.system.contact.test_contact import pressed_blocks
from tissue import Material, SolverSettings, Tissue, block
from tissue.contact.narrow.edge_edge import (
    crossing_pairs,
    edge_touch_of,
    note_ends,
    note_tips,
    pushing_pairs,
)
from tissue.core.simd import WIDTH


def wake_all(tissue: Tissue) -> None:
    """Make the next search test all nodes and all pairs of edges."""
    search = tissue._model.contact.search
    search.all_resting_until = search.edge_pairs.resting_until = -np.inf
    search.resting_until[:] = -np.inf


PLAIN = SolverSettings(element="plain")


def cut_block() -> Tissue:
    """Return a block that a stroke has cut in two, one part of which falls on the floor."""
    mesh = block((4, 3, 3), (0.04, 0.03, 0.03))
    fixed = mesh.positions[:, 0] <= 0.02
    tissue = Tissue(mesh, Material(toughness=0.5), fixed=fixed, floor=-0.02, solver=PLAIN)
    strokes.make(tissue, strokes.straight(mesh, 0.75))
    return tissue


def squeezed_block() -> Tissue:
    """Return a block with a ragged cut whose lips press on each other under gravity."""
    mesh = bodies.jittered(3, 0)
    fixed = mesh.positions[:, 2] < 1e-3
    tissue = Tissue(mesh, Material(viscous_damping=5.0), fixed=fixed)
    edges = [[(-0.01, y, 0.0207), (0.05, y, 0.0187)] for y in (-0.01, 0.02, 0.06)]
    assert tissue.incise(edges, (0.0, 1.0, 0.0)) > 0.0
    return tissue


@pytest.mark.parametrize("make", [pressed_blocks, cut_block, squeezed_block])
def test_contacts_are_the_same_to_the_bit_as_if_all_were_tested(make):
    tissue, other = make(), make()
    n_contacts = 0
    for _ in range(200):
        result = tissue.step(None, strokes.DT)
        wake_all(other)
        wanted = other.step(None, strokes.DT)
        assert result.body_contacts.n_contacts == wanted.body_contacts.n_contacts
        assert result.body_contacts.force == wanted.body_contacts.force
        n_contacts += result.body_contacts.n_contacts
    for one, same in zip(tissue.snapshot(), other.snapshot(), strict=True):
        np.testing.assert_array_equal(one, same)
    assert n_contacts > 200


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


@pytest.mark.parametrize("make", [cut_block, partial(pressed_blocks, PLAIN)])
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
