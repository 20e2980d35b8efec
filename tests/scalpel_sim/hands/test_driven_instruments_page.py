"""A visitor leads a grasper and the blade in the live page: by gamepad, touch and controls."""

from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.file_names import FORCES
from tests.scalpel_sim.hands.driven_view import DrivenView, assert_a_run_repeats
from tests.scalpel_sim.hands.test_driven_page import (
    end,
    opened,
    tip,
    until_it_rests,
    until_the_tip_rests,
)

pytestmark = pytest.mark.end_to_end

SHEET = str(Path(__file__).parent / "sheet.toml")

B, X, RIGHT_TRIGGER = 1, 2, 7
"""Buttons of a gamepad."""

TIME_TO_CLOSE = 0.4
"""Simulated time in which jaws close [s]: 9 mm at 30 mm/s take 0.3 s."""

LEAST_STEP = 1e-3
"""What any control moves the instrument by, at least [m]."""

GAMEPAD = """() => {
    // A gamepad at rest, which tests replace.
    window.pad = (axes, pressed = -1) => [{
        connected: true, index: 0, axes,
        buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: i === pressed })),
    }];
    navigator.getGamepads = () => pad([0, 0, 0, 0]);
}"""

PRESS = """(button) => new Promise((done) => {
    let polls = 0;
    navigator.getGamepads = () => {
        polls += 1;
        if (polls < 4) return pad([0, 0, 0, 0], polls === 2 ? button : -1);
        navigator.getGamepads = () => pad([0, 0, 0, 0]);
        done();
        return pad([0, 0, 0, 0]);
    };
})"""

STEER = """(way) => new Promise((done) => {
    // Tilt the sticks until the page has asked for that way in the world [m], less near its end.
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => hand.inWorld(axis));
    const left = axes.map((axis) => axis[0] * way[0] + axis[1] * way[1] + axis[2] * way[2]);
    const most = STICK_SPEED * LONGEST_PAUSE;
    const tilt = (part) => Math.sign(part) * (DEAD_ZONE + (1 - DEAD_ZONE) * Math.abs(part));
    hand.move = (by, stamp) => {
        by.forEach((part, axis) => { left[axis] -= part; });
        Hand.prototype.move.call(hand, by, stamp);
    };
    navigator.getGamepads = () => {
        const size = Math.hypot(...left);
        if (size > 2e-4) {
            const [right, up, away] = left.map((part) => tilt(part / Math.max(size, most)));
            return pad([right, -up, 0, -away]);
        }
        delete hand.move;
        navigator.getGamepads = () => pad([0, 0, 0, 0]);
        done();
        return pad([0, 0, 0, 0]);
    };
})"""

TILT = """([axis, deflection, least]) => new Promise((done) => {
    // Tilt one stick along an axis until the page has asked for that much [m, or rad].
    const axes = [0, 0, 0, 0];
    axes[axis] = deflection;
    let asked = 0;
    hand.lead = (message) => {
        asked += Math.hypot(...message.by);
        Hand.prototype.lead.call(hand, message);
    };
    navigator.getGamepads = () => {
        if (asked < least) return pad(axes);
        delete hand.lead;
        navigator.getGamepads = () => pad([0, 0, 0, 0]);
        done();
        return pad([0, 0, 0, 0]);
    };
})"""


@pytest.fixture
def view(tmp_path):
    with DrivenView(SHEET, tmp_path / "led") as led:
        yield led


@pytest.fixture
def tab(browser, view):
    """A tab that shows the start and leads, with a gamepad at rest."""
    tab = opened(browser, view)
    tab.wait_for_function("run.leads")
    tab.evaluate(GAMEPAD)
    yield tab
    tab.close()  # else it would lead the next run


def lead(tab, sticks, asked):
    """Lead by the sticks; let go once the picture shows all that was asked.

    On a busy machine the tissue is behind, and a blade that is let go stops where it is.
    """
    tab.evaluate("hand.hold('test')")
    tab.evaluate(sticks, asked)
    until_the_tip_rests(tab)
    tab.evaluate("hand.letGo('test')")
    until_it_rests(tab)


def time_in(tab):
    """Return the simulated time in the picture [s]."""
    return float(tab.inner_text("#time").removesuffix(" s") or 0.0)


def wait_for_jaws(tab):
    """Wait until jaws that have begun to move are where they are wanted."""
    tab.wait_for_function(
        "(until) => parseFloat(element('time').textContent) > until",
        arg=time_in(tab) + TIME_TO_CLOSE,
    )


def chooses(tab, number):
    tab.wait_for_function("(number) => hand.instruments.chosen === number", arg=number)


@pytest.mark.browser
def test_a_gamepad_holds_with_the_grasper_and_cuts_with_the_blade_and_the_record_repeats_it(
    view, tab, tmp_path
):
    tab.evaluate(PRESS, X)
    chooses(tab, 1)
    lead(tab, STEER, [0.0, -0.034, 0.0])
    tab.evaluate(PRESS, B)
    tab.wait_for_function("hand.instruments.isClosed")
    wait_for_jaws(tab)
    lead(tab, STEER, [0.0, 0.0, 0.01])
    tab.evaluate(PRESS, X)
    chooses(tab, 0)
    lead(tab, STEER, [0.0, -0.035, 0.0])
    tab.screenshot(path=str(tmp_path / "cut.png"))
    end(tab, view)
    forces = read_forces(view.folder / FORCES)
    last = dict(zip(forces.columns, forces.rows[-1], strict=True))
    assert last["left_points"] > 0
    assert last["left_force_z_n"] < 0.0, "the sheet hangs from the jaws"
    assert last["cut_area_m2"] > 1e-4
    assert_a_run_repeats(view.folder, tmp_path / "again")


@pytest.mark.browser
def test_the_controls_of_the_page_choose_an_instrument_and_say_what_the_jaws_will_do(view, tab):
    names = tab.eval_on_selector_all("#instrument option", "all => all.map((each) => each.text)")
    assert names == ["scalpel", "left"]
    assert tab.is_hidden("#jaws")
    tab.select_option("#instrument", "1")
    tab.wait_for_function("element('clutch').textContent === 'lead the left grasper'")
    assert tab.inner_text("#hint") == (
        "Press on the picture and drag: the left grasper goes there, in the plane of its jaws"
    )
    assert tab.inner_text("#jaws") == "close the jaws"

    def says(action, label):
        action()
        tab.wait_for_function("(label) => element('jaws').textContent === label", arg=label)

    says(lambda: tab.click("#jaws"), "open the jaws")
    says(lambda: tab.keyboard.press("j"), "close the jaws")
    says(lambda: tab.evaluate(PRESS, RIGHT_TRIGGER), "open the jaws")
    says(lambda: tab.evaluate(PRESS, B), "close the jaws")
    before = tip(tab)
    tab.keyboard.press("ArrowUp")
    tab.keyboard.press("ArrowUp")
    until_it_rests(tab)
    assert np.linalg.norm(tip(tab) - before) > 0.9 * LEAST_STEP, "the keys lead, not the list"
    tab.keyboard.press("x")
    chooses(tab, 0)
    assert tab.input_value("#instrument") == "0"
    tab.wait_for_selector("#jaws", state="hidden")
    end(tab, view)


@pytest.mark.browser
def test_the_right_stick_leads_in_depth_and_turns(view, tab):
    away = np.array(tab.evaluate("hand.inWorld([0, 0, 1])"))
    before = tip(tab)
    lead(tab, TILT, [3, 1.0, 3 * LEAST_STEP])  # towards the eye, where the workspace is wide
    way = tip(tab) - before
    assert way @ away < -LEAST_STEP
    assert way == pytest.approx((way @ away) * away, abs=0.05 * LEAST_STEP)

    before = tip(tab)  # the blade turns about the middle of its edge, which stands upright
    lead(tab, TILT, [2, 1.0, 0.3])
    assert np.linalg.norm(tip(tab) - before) > LEAST_STEP
    end(tab, view)
