"""Rigid cores of a scene."""

import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.errors import UsageError
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.schema import CoreTable
from tissue import block

HANGING = changed(
    SCENES["grid2"],
    law="neo_hookean",
    mesh=lambda: block((4, 4, 4), (0.04, 0.04, 0.04)),
    fixed="top",
)
MIDDLE = "sphere:0.02,0.02,0.02,0.0175"


def with_core(**keys):
    return changed(HANGING, cores=(CoreTable(**keys),))


def test_a_stone_sinks_deeper_than_the_tissue_that_it_replaces():
    light, heavy = (make_tissue(with_core(where=MIDDLE, density=d)) for d in (None, 3000.0))
    (above,), (below,) = light.cores, heavy.cores
    assert above.centre[2] - below.centre[2] > 1e-5
    assert below.mass > 1.5 * above.mass
    np.testing.assert_allclose(below.rotation, np.eye(3), atol=0.1)


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"where": "sphere:0.02,0.02,0.02,0.001"}, "no tetrahedron has all its nodes"),
        ({"where": "0,0,0.02:0.04,0.04,0.04"}, "is fixed, and cannot be in a core"),
        ({"where": MIDDLE, "density": 500.0}, "at least as dense as the tissue"),
    ],
)
def test_a_core_that_cannot_be_is_named(keys, why):
    with pytest.raises(UsageError, match=rf"\[\[core\]\] number 1: .*{why}"):
        make_tissue(with_core(**keys))
