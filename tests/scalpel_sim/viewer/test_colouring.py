import numpy as np
import pytest

from scalpel_sim.viewer.colouring import Colour, Colouring, Wanted, colour_of, wanted_of
from scalpel_sim.viewer.scene_packets import levels_of


def test_the_run_is_told_where_the_sum_of_what_pages_show_changes():
    told = []
    colouring = Colouring(told.append)
    colouring.choose("a", Colour("stress"))
    colouring.choose("b", Colour("stress"))
    colouring.choose("b", Colour("displacement"))
    colouring.remove("a")
    colouring.remove("a")
    colouring.choose("b", Colour(None))
    assert [wanted.quantities for wanted in told] == [
        ("stress",),
        ("displacement", "stress"),
        ("displacement",),
        (),
    ]


@pytest.mark.parametrize(
    "message",
    [
        "drawn",
        b"\xff",
        '{"type": "colour"}',
        '{"type": "colour", "quantity": "heat"}',
        '{"type": "move", "quantity": "stress"}',
        '{"type": "colour", "quantity": ' + 100 * " " + '"stress"}',
    ],
)
def test_what_is_no_choice_of_a_quantity_is_none(message):
    assert colour_of(message) is None


def test_a_choice_is_read_and_a_line_of_another_kind_is_none():
    assert colour_of('{"type": "colour", "quantity": "stress"}') == Colour("stress")
    assert colour_of('{"type": "colour", "quantity": null}') == Colour(None)
    assert wanted_of(b'{"type":"wanted","quantities":["strain"]}') == Wanted(("strain",))
    assert wanted_of(b'{"type":"release"}') is None


def test_levels_are_shares_of_the_top_below_which_99_in_a_hundred_are():
    values = np.arange(101.0) - 10.0
    levels, tops = levels_of({"stress": values})
    assert tops == {"stress": 89.0}
    assert levels["stress"][[0, 10, 99, 100]].tolist() == [0, 0, 255, 255]
    assert levels["stress"] / 255.0 * 89.0 == pytest.approx(np.clip(values, 0, 89), abs=89 / 510)


def test_a_body_at_rest_has_the_lowest_level():
    levels, tops = levels_of({"strain": np.zeros(5)})
    assert tops == {"strain": 0.0} and not levels["strain"].any()
