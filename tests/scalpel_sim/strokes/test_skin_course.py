"""Places on the skin are found again in a body that has moved, and whose mesh has changed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scalpel_sim.strokes.skin_course import SkinCourse
from tissue import Tissue, block

MESH = block((3, 2, 2), (0.03, 0.02, 0.02))
BODY = Tissue(MESH).snapshot()

ROUNDING = 1e-12
"""Of places of 0.03 m [m]."""


def course_at(at_rest):
    return SkinCourse(np.arange(len(at_rest), dtype=float), at_rest, at_rest.copy(), 0.03)


@given(
    st.lists(st.tuples(st.floats(0.0, 0.03), st.floats(0.0, 0.02)), min_size=1, max_size=9),
    st.lists(st.floats(-0.5, 0.5), min_size=9, max_size=9),
    st.randoms(use_true_random=False),
)
def test_places_move_with_the_body_whatever_the_order_of_its_tetrahedra(places, shear, random):
    at_rest = np.array([(x, y, 0.02) for x, y in places])
    course, holders = course_at(at_rest), np.full(len(at_rest), -1)
    gradient = np.eye(3) + np.reshape(shear, (3, 3))
    moved = BODY._replace(positions=BODY.rest_positions @ gradient.T)
    order = list(range(len(BODY.tetrahedra)))
    random.shuffle(order)
    for body in (moved, moved._replace(tetrahedra=moved.tetrahedra[order])):
        found = course.displacements(body, holders)
        np.testing.assert_allclose(found, at_rest @ gradient.T - at_rest, atol=ROUNDING)


def test_places_are_found_in_the_parts_of_tetrahedra_that_were_cut():
    tissue = Tissue(MESH)
    course = course_at(np.array([(x, 0.013, 0.02) for x in np.linspace(0.001, 0.029, 15)]))
    holders = np.full(15, -1)
    course.displacements(tissue.snapshot(), holders)
    before = holders.copy()
    edges = [[[0.014, y, z] for z in (-0.01, 0.03)] for y in (-0.01, 0.03)]
    assert tissue.incise(edges, forward=(0.0, 1.0, 0.0)) == pytest.approx(4e-4, rel=0.1)
    found = course.displacements(tissue.snapshot(), holders)
    assert (holders != before).any()
    np.testing.assert_allclose(found, 0.0, atol=ROUNDING)
