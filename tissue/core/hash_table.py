"""A hash table with open addressing, for kernels.

A slot holds one number: a key, or where the caller keeps the key. The caller compares keys:

    slot = first_slot(table, hash_of(a, b, 0, 0))
    while is_filled(table, slot) and not <the key of table.item[slot] is the key searched>:
        slot = next_slot(table, slot)

The slot is then that of the key, or the free one where it belongs. Items are removed all at once.
"""

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell


class HashTable(Arrays):
    """The slots of a table."""

    epoch: IntCell
    """Number of times that the table was cleared, plus one."""
    item: IntArray = sized("slots")
    """Number in each slot, shape (n_slots,); `n_slots` is a power of two."""
    stamp: IntArray = sized("slots")
    """Epoch in which each slot was filled, shape (n_slots,). In any other epoch it is free."""


def new_hash_table(n_slots: int) -> HashTable:
    """Return an empty table of `n_slots` slots or more: twice the items, so that searches end."""
    n_slots = 1 << (n_slots - 1).bit_length()
    return HashTable.new({"slots": n_slots}, epoch=1)


@kernel
def clear_table(table: HashTable) -> None:
    """Remove all items."""
    table.epoch += 1


@kernel
def hash_of(a: int, b: int, c: int, d: int) -> int:
    """Mix four numbers into one, of which the lowest bits are used."""
    mixed = a * 73856093 ^ b * 19349663 ^ c * 83492791 ^ d * 15485863
    return mixed ^ mixed >> 15


@kernel
def first_slot(table: HashTable, hashed: int) -> int:
    """Return the slot in which the search for a key of that hash begins."""
    return hashed & (len(table.item) - 1)


@kernel
def next_slot(table: HashTable, slot: int) -> int:
    """Return the slot in which a search continues."""
    return (slot + 1) & (len(table.item) - 1)


@kernel
def is_filled(table: HashTable, slot: int) -> bool:
    """Whether there is an item in `slot`."""
    return bool(table.stamp[slot] == table.epoch)


@kernel
def fill_slot(table: HashTable, slot: int, item: int) -> None:
    """Write an item into a free slot."""
    table.item[slot] = item
    table.stamp[slot] = table.epoch
