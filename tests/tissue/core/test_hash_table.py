"""A hash table finds the keys that were inserted, and no others."""

import numpy as np
import pytest

from tissue.core.hash_table import (
    clear_table,
    fill_slot,
    first_slot,
    hash_of,
    is_filled,
    new_hash_table,
    next_slot,
)

pytestmark = pytest.mark.kernel

N_NUMBERS = 40


def slot_of(table, keys, key):
    """Return the slot of a key, or the free one where it belongs."""
    slot = first_slot(table, hash_of(*key))
    while is_filled(table, slot) and keys[table.item[slot]] != key:
        slot = next_slot(table, slot)
    return slot


def some_keys(n, seed=0):
    """Return distinct random keys, some with negative numbers."""
    random = np.random.default_rng(seed)
    rows = {tuple(row) for row in random.integers(-N_NUMBERS, N_NUMBERS, (2 * n, 4)).tolist()}
    return sorted(rows)[:n]


def filled_table(keys, n_slots):
    table = new_hash_table(n_slots)
    for i, key in enumerate(keys):
        fill_slot(table, slot_of(table, keys, key), i)
    return table


@pytest.mark.parametrize("n_slots", [200, 1024])
def test_every_key_is_found_and_no_other(n_slots):
    keys = some_keys(100)
    table = filled_table(keys, n_slots)
    for i, key in enumerate(keys):
        slot = slot_of(table, keys, key)
        assert is_filled(table, slot) and table.item[slot] == i
    others = set(some_keys(200, 1)) - set(keys)
    assert not any(is_filled(table, slot_of(table, keys, key)) for key in others)


def test_a_cleared_table_is_empty_and_can_be_filled_again():
    keys = some_keys(100)
    table = filled_table(keys, 256)
    clear_table(table)
    assert not any(is_filled(table, slot) for slot in range(len(table.item)))
    fill_slot(table, slot_of(table, keys, keys[7]), 7)
    assert sum(is_filled(table, slot) for slot in range(len(table.item))) == 1
    assert table.item[slot_of(table, keys, keys[7])] == 7


def test_keys_that_follow_each_other_are_spread_over_the_table():
    """Nodes of an edge or a face have similar numbers; long runs of filled slots are slow."""
    table = new_hash_table(4096)
    slots = {first_slot(table, hash_of(a, a + b, 0, 0)) for a in range(256) for b in range(1, 5)}
    assert len(slots) > 700
