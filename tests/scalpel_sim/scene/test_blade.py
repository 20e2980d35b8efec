import math

import pytest

from scalpel_sim import SCALPEL
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.blade import blade_of, table_of_blade
from scalpel_sim.scene.schema import BladeTable
from tissue import BladeShape


def test_without_measures_the_blade_is_a_scalpel_and_without_a_thickness_a_line():
    assert blade_of(BladeTable()) == SCALPEL
    assert blade_of(BladeTable(thickness=0.0)) is None


def test_measures_are_in_metres_and_degrees():
    assert blade_of(BladeTable(bevel_degrees=15.0)) == BladeShape(bevel_angle=math.radians(15.0))
    table = BladeTable(thickness=1e-3, bevel_degrees=20.0, height=8e-3, edge_radius=5e-6)
    assert blade_of(table) == BladeShape(1e-3, math.radians(20.0), 8e-3, 5e-6)
    assert table_of_blade(blade_of(table)) == table


@pytest.mark.parametrize("measure", ["bevel_degrees", "height", "edge_radius"])
def test_a_line_has_no_other_measures(measure):
    with pytest.raises(UsageError, match="thickness 0, a line, on which its other measures"):
        blade_of(BladeTable(thickness=0.0, **{measure: 1e-3}))
