"""Which contacts there are, by their nodes: a hash table with open addressing."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays


class KnownContacts(Arrays):
    """The table. It is emptied by counting up, and nothing is ever taken out."""

    contact: IntArray
    """The contact in each slot; a power of two of them, at least twice the contacts."""
    stamp: IntArray
    """The time at which each slot was filled, by `now`."""
    now: IntArray
    """Shape (1,)."""


def new_known_contacts(capacity: int) -> KnownContacts:
    """Return an empty table with room for that many contacts."""
    n_slots = 1 << (4 * capacity - 1).bit_length()
    return KnownContacts(
        contact=np.zeros(n_slots, np.int64),
        stamp=np.zeros(n_slots, np.int64),
        now=np.ones(1, np.int64),
    )


@kernel
def forget_known(known: KnownContacts) -> None:
    """Empty the table."""
    known.now[0] += 1


@kernel
def _slot_of(known: KnownContacts, nodes: tuple[int, int, int, int]) -> int:
    a, b, c, d = nodes
    mixed = a * 73856093 ^ b * 19349663 ^ c * 83492791 ^ d * 15485863
    return (mixed ^ mixed >> 15) & (len(known.contact) - 1)


@kernel
def is_known(known: KnownContacts, node: IntArray, nodes: tuple[int, int, int, int]) -> bool:
    """Whether there is a contact between these nodes, in this order.

    Args:
        known: The table.
        node: Nodes of all contacts, shape (capacity, 4).
        nodes: Those asked for.
    """
    slot = _slot_of(known, nodes)
    while known.stamp[slot] == known.now[0]:
        k = known.contact[slot]
        if (node[k, 0], node[k, 1], node[k, 2], node[k, 3]) == nodes:
            return True
        slot = (slot + 1) & (len(known.contact) - 1)
    return False


@kernel
def know(known: KnownContacts, node: IntArray, k: int) -> None:
    """Put contact `k` in."""
    slot = _slot_of(known, (node[k, 0], node[k, 1], node[k, 2], node[k, 3]))
    while known.stamp[slot] == known.now[0]:
        slot = (slot + 1) & (len(known.contact) - 1)
    known.contact[slot] = k
    known.stamp[slot] = known.now[0]
