"""Places on the skin are found again in a body that has moved, and whose mesh has changed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge import InProcessLink
from scalpel_sim.strokes.skin_course import SkinCourse
from tissue import Material, Tissue, block

MESH = block((3, 2, 2), (0.03, 0.02, 0.02))

ROUNDING = 1e-12
"""Of places of 0.03 m [m]."""


def body(**fixed):
    return Tissue(MESH, Material(young_modulus=3e3, toughness=20.0), **fixed)


@pytest.fixture(scope="module")
def sagging():
    """A body that hangs from one side, in the middle of its swing, and has been cut."""
    tissue = body(fixed=MESH.positions[:, 0] < 1e-6, gravity=(0.0, 0.0, -9.81))
    edges = [[[0.014, y, z] for z in (-0.01, 0.03)] for y in (-0.01, 0.012)]
    assert tissue.incise(edges, forward=(0.0, 1.0, 0.0)) > 1e-4
    for _ in range(30):
        tissue.step(None, 1e-3)
    return tissue


def course_at(at_rest):
    return SkinCourse(np.arange(len(at_rest), dtype=float), at_rest, at_rest.copy(), 0.03)


def moved_in(snapshot, place):
    """Return the displacement of a place by its coordinates in each tetrahedron in turn."""
    corners = snapshot.rest_positions[snapshot.tetrahedra]
    rows = np.concatenate([corners, np.ones((*corners.shape[:2], 1))], axis=2)
    weights = np.linalg.solve(np.swapaxes(rows, 1, 2), np.array([*place, 1.0])[:, None])[..., 0]
    held = int(np.argmax(weights.min(axis=1)))
    return weights[held] @ snapshot.positions[snapshot.tetrahedra[held]] - place


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.0, 0.03), st.floats(0.0, 0.02)), min_size=1, max_size=9),
    st.lists(st.integers(-1, 50), min_size=9, max_size=9),
)
def test_places_move_with_the_body_wherever_they_are_looked_for_first(sagging, places, held_by):
    at_rest = np.array([(x, y, 0.02) for x, y in places if abs(x - 0.014) > 1e-6] or [(0, 0, 0.02)])
    holders = np.array(held_by[: len(at_rest)])
    found = course_at(at_rest).displacements(InProcessLink(sagging), holders)
    snapshot = sagging.snapshot()
    expected = [moved_in(snapshot, place) for place in at_rest]
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.abs(expected).max() < 0.02


def test_places_are_found_in_the_parts_of_tetrahedra_that_were_cut():
    tissue = body()
    link = InProcessLink(tissue)
    course = course_at(np.array([(x, 0.013, 0.02) for x in np.linspace(0.001, 0.029, 15)]))
    holders = np.full(15, -1)
    course.displacements(link, holders)
    before = holders.copy()
    edges = [[[0.014, y, z] for z in (-0.01, 0.03)] for y in (-0.01, 0.03)]
    assert tissue.incise(edges, forward=(0.0, 1.0, 0.0)) == pytest.approx(4e-4, rel=0.1)
    found = course.displacements(link, holders)
    assert (holders != before).any()
    np.testing.assert_allclose(found, 0.0, atol=ROUNDING)
