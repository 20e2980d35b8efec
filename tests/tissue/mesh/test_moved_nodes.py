"""The list of nodes that moved."""

import numpy as np
import pytest

from tissue.mesh.moved_nodes import forget_moved, none_moved, note_moved

pytestmark = pytest.mark.kernel


def nodes(moved):
    return moved.nodes[: moved.n_nodes].tolist()


def test_each_node_is_listed_once_in_the_order_in_which_it_came():
    moved = none_moved(10)
    note_moved(moved, np.array([7, 3, 7, 1]), 3)
    note_moved(moved, np.array([3, 2]), 2)
    assert nodes(moved) == [7, 3, 2]


def test_a_list_that_was_read_begins_anew():
    moved = none_moved(10)
    note_moved(moved, np.array([7, 3]), 2)
    forget_moved(moved)
    assert nodes(moved) == []
    note_moved(moved, np.array([3]), 1)
    assert nodes(moved) == [3]
