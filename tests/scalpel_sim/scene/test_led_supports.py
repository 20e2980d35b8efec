"""Held sides of a scene that are led over time."""

import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.errors import UsageError
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.schema import LedSupportTable
from tissue import fixed_nodes

GRID2 = SCENES["grid2"]
TWIST = {"where": "right", "times": [0.02], "rotations_degrees": [(90.0, 0.0, 0.0)]}


def with_support(**keys):
    return changed(GRID2, supports=(LedSupportTable(**keys),))


def test_a_side_turns_about_its_middle_after_the_body_has_settled():
    tissue = make_tissue(with_support(**TWIST))
    right = fixed_nodes(GRID2.mesh(), "right")
    before = tissue.snapshot().positions[right]
    for _ in range(20):
        tissue.step(None, 1e-3)
    middle = 0.5 * (before.min(axis=0) + before.max(axis=0))
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    expected = middle + (before - middle) @ turn.T
    np.testing.assert_allclose(tissue.snapshot().positions[right], expected, atol=1e-15)


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"rotations_degrees": None}, "has no displacements, rotations_degrees or stretches"),
        ({"times": [0.1, 0.2]}, "has 2 times and 1 rows of a key"),
        ({"times": [0.0]}, "begin above 0 and increase"),
    ],
)
def test_rows_that_do_not_fit_are_refused(keys, why):
    with pytest.raises(UsageError, match=why):
        with_support(**(TWIST | keys))


def test_what_is_not_held_cannot_be_led():
    free = with_support(**(TWIST | {"where": "sphere:0.02,0.02,0.02,0.005"}))
    with pytest.raises(UsageError, match=r"\[\[support\]\] number 1: no node of the region"):
        make_tissue(free)
