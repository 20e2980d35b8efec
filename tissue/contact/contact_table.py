"""The contact table: which contacts there are, by their nodes."""

from tissue.contact.pairs import Nodes, nodes_of
from tissue.core.array_types import IntArray
from tissue.core.hash_table import (
    HashTable,
    fill_slot,
    first_slot,
    hash_of,
    is_filled,
    next_slot,
)
from tissue.core.jit import kernel


@kernel
def has_contact(table: HashTable, node: IntArray, nodes: Nodes) -> bool:
    """Whether there is a contact between `nodes`, in this order.

    Args:
        table: Numbers of contacts.
        node: Nodes of all contacts, shape (capacity, 4).
        nodes: Nodes searched for.
    """
    a, b, c, d = nodes
    slot = first_slot(table, hash_of(a, b, c, d))
    while is_filled(table, slot):
        if nodes_of(node, table.item[slot]) == nodes:
            return True
        slot = next_slot(table, slot)
    return False


@kernel
def insert_contact(table: HashTable, node: IntArray, k: int) -> None:
    """Insert contact `k`, between the nodes in row `k` of `node`."""
    slot = first_slot(table, hash_of(node[k, 0], node[k, 1], node[k, 2], node[k, 3]))
    while is_filled(table, slot):
        slot = next_slot(table, slot)
    fill_slot(table, slot, k)
