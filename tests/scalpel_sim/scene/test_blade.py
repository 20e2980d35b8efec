import math

import pytest

from scalpel_sim import SCALPEL
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.blade import chosen_blade
from tissue import BladeShape


def test_without_measures_the_usual_blade_stays():
    assert chosen_blade(SCALPEL) is SCALPEL
    assert chosen_blade(None) is None


def test_a_thickness_of_zero_is_a_line():
    assert chosen_blade(SCALPEL, thickness=0.0) is None


def test_a_measure_given_for_a_line_makes_it_a_scalpel_of_that_measure():
    assert chosen_blade(None, bevel=15.0) == BladeShape(bevel_angle=math.radians(15.0))


def test_measures_are_in_metres_and_degrees():
    blade = chosen_blade(SCALPEL, thickness=1e-3, bevel=20.0, height=8e-3, edge_radius=5e-6)
    assert blade == BladeShape(1e-3, math.radians(20.0), 8e-3, 5e-6)


@pytest.mark.parametrize("measure", ["bevel", "height", "edge_radius"])
def test_a_line_has_no_other_measures(measure):
    with pytest.raises(UsageError, match=f"--blade-{measure.replace('_', '-')} is about a blade"):
        chosen_blade(SCALPEL, thickness=0.0, **{measure: 1e-3})
