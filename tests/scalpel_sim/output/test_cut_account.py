"""Energy that is released, and area that nobody pays for, are found where they are along a cut."""

import numpy as np
import pytest

from scalpel_sim.output.cut_account import area_unpaid, energy_released
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.recording.recording import Recording

J = 20.0
DEPTH, LENGTH, NODE_SIZE = 0.01, 0.06, 0.0035
N = 600
"""Frames of the cut; the tip goes 0.1 mm in each."""
AIR = 50
"""Frames before it, and after it."""

ALL = np.arange(N)
MIDDLE = (ALL >= 200) & (ALL < 400)
"""The frames of the cut from 20 to 40 mm."""


def cut(opened=None, paid=1.0, released=0.0, held=0.0):
    """Return a recording of a cut at an even speed, all of whose energy goes into it.

    Args:
        opened: Share of the area that the mesh has opened by the end of each frame; None: evenly.
        paid: Area that is paid for in each frame, as a share of what the edge passes.
        released: Energy that is released in each frame, as a share of what the area there costs.
        held: Energy that the blade holds after each frame, as a share of what 1 mm costs.
    """
    area, step = DEPTH * LENGTH, J * DEPTH * LENGTH / N
    columns = {
        "tip_y_m": np.linspace(LENGTH / N, LENGTH, N),
        "anchored_length_m": np.full(N, DEPTH),
        "cut_area_m2": area * (np.arange(1, N + 1) / N if opened is None else opened),
        "cutting_j": np.cumsum(step * np.broadcast_to(paid, N)),
        "released_j": np.cumsum(step * np.broadcast_to(released, N)),
        "held_j": 1e-3 * J * DEPTH * np.broadcast_to(held, N),
    }
    columns["work_of_blade_j"] = columns["cutting_j"] + columns["released_j"] + columns["held_j"]
    rows = np.zeros((N + 2 * AIR, len(shared_columns())))
    for name, values in columns.items():
        at = shared_columns().index(name)
        rows[AIR:-AIR, at], rows[-AIR:, at] = values, values[-1]
    rows[-AIR:, shared_columns().index("anchored_length_m")] = 0.0
    recording = Recording()
    for row in rows:
        recording.append(row.tolist())
    return recording


def unpaid_in(recording, toughness=J):
    return area_unpaid(recording, np.full(len(recording), toughness), NODE_SIZE)


def in_cells(ahead):
    """Return the share of area that is opened cell by cell, each when the edge is so far in it."""
    cell = np.sqrt(2.0) * NODE_SIZE / LENGTH
    passed = np.arange(1, N + 1) / N
    return np.minimum(np.floor(passed / cell + ahead) * cell, 1.0)


def test_a_cut_that_is_paid_for_and_releases_nothing_is_in_order():
    assert unpaid_in(cut()) is None
    assert energy_released(cut()) is None


def test_area_that_costs_nothing_is_found_where_it_is():
    stretch = unpaid_in(cut(paid=np.where(MIDDLE, 0.0, 1.0)))
    assert (stretch.first, stretch.last) == pytest.approx((AIR + 200, AIR + 400), abs=2)
    assert stretch.amount == pytest.approx(0.02 * DEPTH, rel=0.01)
    everywhere = unpaid_in(cut(paid=0.0))
    assert everywhere.share == 1.0
    assert everywhere.of == pytest.approx(DEPTH * LENGTH, rel=0.01)


def test_a_tenth_that_is_not_paid_for_is_no_matter_however_long_the_cut():
    assert unpaid_in(cut(paid=0.91)) is None
    assert unpaid_in(cut(paid=0.75)).share == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize("ahead", [0.0, 0.5, 0.99])
def test_a_mesh_that_opens_cell_by_cell_is_in_order(ahead):
    assert unpaid_in(cut(in_cells(ahead))) is None


def test_what_was_paid_ahead_excuses_no_more_than_the_mesh_opens_at_once():
    twice_then_nothing = np.where(ALL < 300, 2.0, 0.0)
    assert unpaid_in(cut(paid=twice_then_nothing)).amount == pytest.approx(0.03 * DEPTH, rel=0.01)


def test_a_higher_toughness_at_speed_makes_the_same_work_pay_for_less():
    assert unpaid_in(cut(paid=1.4), toughness=1.4 * J) is None
    assert unpaid_in(cut(), toughness=1.4 * J).share == pytest.approx(1.0 - 1.0 / 1.4, abs=0.01)


def test_energy_that_is_released_is_found_where_it_is():
    stretch = energy_released(cut(released=np.where(MIDDLE, 0.5, 0.0)))
    assert stretch.share == pytest.approx(1 / 3, abs=0.01)
    assert AIR + 199 <= stretch.first < stretch.last <= AIR + 400
    assert stretch.last - stretch.first == pytest.approx(50, abs=2)  # 5 mm


def test_energy_released_is_a_share_of_the_work_where_more_goes_into_the_body():
    assert energy_released(cut(released=0.12)).share == pytest.approx(0.12 / 1.12, abs=0.01)
    assert energy_released(cut(released=0.1)) is None


def test_what_the_blade_held_and_lets_go_where_it_leaves_is_no_loss():
    held = np.where(ALL < N - 20, 1.0, 0.0)
    leaving = np.where(ALL == N - 20, 10.0, 0.0)  # 1 mm of cut
    assert energy_released(cut(released=leaving, held=held)) is None
    assert energy_released(cut(released=leaving)).share > 0.1


def test_a_burst_of_the_mesh_is_not_five_millimetres_of_cut():
    burst = np.where(ALL < 300, 0.2, 0.4)  # 12 mm at once
    released = np.where((ALL > 297) & (ALL < 303), 0.5, 0.0)
    assert energy_released(cut(burst, released=released)) is None


def test_a_shorter_cut_than_five_millimetres_is_not_judged():
    short = cut(np.minimum(np.arange(1, N + 1) / N, 4.9e-3 / LENGTH), paid=0.0, released=1.0)
    assert unpaid_in(short) is None
    assert energy_released(short) is None
    assert energy_released(Recording()) is None
