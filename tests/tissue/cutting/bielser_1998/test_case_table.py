"""The generic 1:17 split, and the lookup table: 37 oriented subcases of the five cases."""

import itertools
from collections import Counter

import numpy as np
import pytest

from tissue.cutting.bielser_1998.case_table import (
    CASES,
    LOOKUP,
    TABLE,
    corner_of,
    reference,
    triangle_of,
)
from tissue.cutting.bielser_1998.template_1_to_17 import (
    CORNERS,
    EDGE_NODE,
    EDGES,
    FACE_NODE,
    FACES,
    N_CHILDREN,
    N_LOCAL_NODES,
    PRESPLIT,
    code_of,
    generic_weights,
    is_edge_cut,
)

pytestmark = pytest.mark.kernel

FIGURE_7 = """splitEdge(AB)
splitEdge(BC)
splitFace(ABC1)
insertFace(BC1, ABC1, BCD2)
insertFace(AB2, ABC1, ABD2)
insertFace(ABC1, BCD2, ABD2)
insertFace(BC2, ABC2, BCD2)
insertFace(AB1, ABC3, ABD2)
insertFace(ABC2, BCD2, ABD2)"""

CODES = {
    "A": "111000 100101 010110 001011",
    "B": "110011 101110 011101",
    "C": "100000 010000 001000 000100 000010 000001",
    "D": "110000 101000 100100 100001 011000 010100 010010 001010 001001 000110 000101 000011",
    "E": "110010 110001 101100 101010 100110 100011 011100 011001 010101 010011 001110 001101",
}

WHOLE, TIP, FULL = 0, 1, 2
"""State of a face by its cut edges: not cut; cut up to a point inside it; cut across."""

SIGNATURES = {
    # opened triangles, corners in each piece, copies of edge nodes and of face nodes, face states
    "A": (4, (1, 3), 3, 3, {FULL: 3, WHOLE: 1}),
    "B": (6, (2, 2), 4, 4, {FULL: 4}),
    "C": (1, (4,), 1, 0, {TIP: 2, WHOLE: 2}),
    "D": (3, (4,), 2, 1, {FULL: 1, TIP: 2, WHOLE: 1}),
    "E": (5, (4,), 3, 2, {FULL: 2, TIP: 2}),
}


def groups(members, code, node=None):
    """Return groups of tetrahedra connected by closed triangles, those at `node` if given."""
    left, found = set(members), []
    while left:
        queue = [left.pop()]
        group = set(queue)
        while queue:
            c = queue.pop()
            for f, link in enumerate(PRESPLIT.inner[c].tolist()):
                triangle = PRESPLIT.triangle[c, f]
                is_open = triangle >= 0 and LOOKUP.opened[code] >> triangle & 1
                at_node = node is None or PRESPLIT.children[c, f] != node
                if link >= 0 and not is_open and at_node and link // 4 in left:
                    left.remove(link // 4)
                    group.add(link // 4)
                    queue.append(link // 4)
        found.append(group)
    return found


def groups_at(node, code):
    return groups([c for c in range(N_CHILDREN) if node in PRESPLIT.children[c]], code, node)


def corners_of(group):
    return {int(PRESPLIT.part[c]) for c in group} & set(range(4))


def test_figure_7_is_the_entry_of_110000():
    assert code_of("AB", "BC") == 0b110000 == 48
    assert "\n".join(map(str, TABLE[48].actions)) == FIGURE_7
    assert TABLE[48].case == "D"


def test_the_table_has_the_37_codes_of_the_five_cases():
    of_case = {case: set() for case in CASES}
    for entry in TABLE.values():
        of_case[entry.case].add(f"{entry.code:06b}")
    assert of_case == {case: set(codes.split()) for case, codes in CODES.items()}
    assert len(TABLE) == 37


def test_codes_that_no_single_plane_can_cut_are_not_in_the_table():
    outside = [code for code in range(64) if LOOKUP.case[code] < 0]
    assert len(outside) == 64 - 37
    assert {0, code_of("AB", "CD"), code_of("AB", "BC", "AC"), 63} <= set(outside)


@pytest.mark.parametrize("code", TABLE)
def test_each_case_has_one_signature(code):
    opened = int(LOOKUP.opened[code]).bit_count()
    pieces = tuple(sorted(len(corners_of(g)) for g in groups(range(N_CHILDREN), code)))
    edge_copies = sum(len(groups_at(EDGE_NODE + e, code)) - 1 for e in range(6))
    face_copies = sum(len(groups_at(FACE_NODE + k, code)) - 1 for k in range(4))
    states = Counter(
        sum(is_edge_cut(code, e) for e, ends in enumerate(EDGES) if k not in ends) for k in range(4)
    )
    signature = (opened, pieces, edge_copies, face_copies, states)
    assert signature == SIGNATURES[TABLE[code].case]


@pytest.mark.parametrize("code", TABLE)
def test_a_node_is_split_where_the_tetrahedra_around_it_are_separated(code):
    """The actions against connected components: a node has one copy for each group at it."""
    for e in range(6):
        assert len(groups_at(EDGE_NODE + e, code)) == (2 if is_edge_cut(code, e) else 1)
    for k in range(4):
        at_node = groups_at(FACE_NODE + k, code)
        detached = int(LOOKUP.detached[code, k])
        sides = [{detached}, set(FACES[k]) - {detached}] if detached >= 0 else [set(FACES[k])]
        assert sorted(map(sorted, map(corners_of, at_node))) == sorted(map(sorted, sides))
        with_centre = next(g for g in at_node if N_CHILDREN - 1 in g)
        assert LOOKUP.of_centre[code, k] in corners_of(with_centre)


@pytest.mark.parametrize("code", TABLE)
def test_every_cut_face_is_inserted_from_both_sides(code):
    inserted = [a for a in TABLE[code].actions if a.operator == "insertFace"]
    opened = {i: 2 for i in range(10) if LOOKUP.opened[code] >> i & 1}
    assert Counter(map(triangle_of, inserted)) == opened
    assert len(set(inserted)) == len(inserted)


def test_references_are_numbered_as_in_the_paper():
    assert [reference("AB", c) for c in "AB"] == ["AB1", "AB2"]
    assert [reference("ABC", c) for c in "ABC"] == ["ABC3", "ABC1", "ABC2"]
    for name in ("CD", "ACD"):
        assert [corner_of(reference(name, c)) for c in name] == list(name)


def test_the_bits_are_in_the_order_of_the_paper():
    names = ["".join(CORNERS[i] for i in ends) for ends in EDGES]
    assert names == ["AB", "BC", "BD", "AC", "CD", "AD"]
    assert [code_of(name) for name in names] == [32, 16, 8, 4, 2, 1]


VOLUMES = np.linalg.det(generic_weights()[PRESPLIT.children])
"""Volumes of the children, as shares of that of the tetrahedron."""


def test_the_template_has_17_tetrahedra_of_14_nodes():
    assert PRESPLIT.children.shape == (17, 4)
    assert set(PRESPLIT.children.ravel()) == set(range(N_LOCAL_NODES)) == set(range(14))


def test_cores_are_2_27ths_parts_along_edges_an_18th_and_the_centre_a_27th():
    assert Counter(VOLUMES.round(12)) == {
        round(2 / 27, 12): 4,
        round(1 / 18, 12): 12,
        round(1 / 27, 12): 1,
    }
    assert VOLUMES.sum() == pytest.approx(1.0, abs=1e-12)


def test_inner_links_are_symmetric_and_share_a_triangle():
    for c, f in itertools.product(range(N_CHILDREN), range(4)):
        if PRESPLIT.inner[c, f] >= 0:
            other, g = divmod(int(PRESPLIT.inner[c, f]), 4)
            assert PRESPLIT.inner[other, g] == 4 * c + f
            mine = set(np.delete(PRESPLIT.children[c], f))
            assert mine == set(np.delete(PRESPLIT.children[other], g))
