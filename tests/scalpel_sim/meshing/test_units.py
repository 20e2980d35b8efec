"""The unit of a file: `check` and `mesh` have one rule."""

import re

import pytest

from scalpel_sim.errors import UsageError
from scalpel_sim.meshing.units import METRE, scale_of
from tissue import block, report_on_mesh, write_mesh


@pytest.mark.parametrize("width", [1e-3, 2.1e-3, 0.9, 1.5, 2.5, 90.0, 999.0, 1500.0, 9e5, 2e6])
def test_the_unit_that_check_guesses_is_the_one_that_mesh_asks_about(width, tmp_path):
    file = tmp_path / "body.vtu"
    write_mesh(file, block((1, 1, 1), (width, width, 0.5 * width)))
    guessed = report_on_mesh(file).scale
    if 2e-3 <= width <= 1.0:
        assert scale_of(file, width, None) == guessed == METRE
        return
    with pytest.raises(UsageError) as error:
        scale_of(file, width, None)
    found = re.search(r"--scale,? (?:that unit in metres: )?([\d.e-]+)", str(error.value))
    assert float(found[1]) == guessed


def test_a_unit_that_is_given_is_taken_where_such_a_body_can_be(tmp_path):
    file = tmp_path / "body.stl"
    assert scale_of(file, 90.0, 1e-3) == 1e-3
    with pytest.raises(UsageError, match=r"the body is 9e\+04 m wide; it may have"):
        scale_of(file, 90.0, 1e3)
    with pytest.raises(UsageError, match="--scale is nan; it is the unit in metres"):
        scale_of(file, 90.0, float("nan"))
