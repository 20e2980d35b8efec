"""Lists of the tetrahedra around each node of a nonconforming mesh."""

import numpy as np
import pytest

from tests.support import bodies, naive
from tissue import block
from tissue.mesh.body import build_body, is_open
from tissue.mesh.nonconforming import (
    HANGING,
    grown_hanging,
    join_list,
    leave_list,
    may_hang,
    nothing_hanging,
)
from tissue.mesh.star import no_visits, star

pytestmark = pytest.mark.kernel

BLOCK = block((2, 1, 1), (2.0, 1.0, 1.0))


def listed(hanging, node):
    mesh = BLOCK
    body = build_body(mesh, None, None).replaced(hanging=hanging)
    out = np.zeros(64, np.int64)
    n = star(body, no_visits(len(mesh.positions), 64), node, 0, out)
    return sorted(out[:n].tolist())


def block():
    return may_hang(0, len(BLOCK.positions), BLOCK.tetrahedra)


def test_the_star_of_a_node_is_its_list():
    hanging = block()
    for node in range(len(BLOCK.positions)):
        assert listed(hanging, node) == sorted(naive.star(BLOCK.tetrahedra, node))


def test_a_tetrahedron_leaves_and_joins_the_list_of_a_node():
    hanging = grown_hanging(block(), len(BLOCK.positions) + 1, 64)
    around = naive.star(BLOCK.tetrahedra, 0)
    for t in around:
        leave_list(hanging, 0, t)
        assert t not in listed(hanging, 0)
        leave_list(hanging, 0, t)  # removing it again has no effect
        join_list(hanging, 0, t, 0)
        assert listed(hanging, 0) == sorted(around)


def test_lists_of_spare_nodes_are_empty():
    hanging = grown_hanging(block(), len(BLOCK.positions) + 3, 64)
    assert listed(hanging, len(BLOCK.positions) + 2) == []


def test_a_conforming_body_keeps_no_lists():
    assert len(grown_hanging(nothing_hanging(), 100, 100).first) == 0
    assert len(build_body(bodies.unit_tetrahedron(), None, None).hanging.next) == 0


def test_only_faces_on_the_skin_or_on_a_cut_are_open():
    assert [is_open(link) for link in (-1, -2, HANGING, HANGING - 5, 0, 7)] == [
        True, True, False, False, False, False,
    ]  # fmt: skip
