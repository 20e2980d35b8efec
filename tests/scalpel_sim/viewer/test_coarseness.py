"""How coarsely a page draws: coarser where pictures take long, finer where they are quick."""

import numpy as np
import pytest

from scalpel_sim.viewer.looks import LOOKS
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import ReplayWriter
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.support.browser import UNTIL_DRAWN, local_file, new_tab, pixels

pytestmark = pytest.mark.browser

LEVELS_OF = """([first, times]) => {
    const levels = new Levels(first);
    return times.map((time) => { levels.note(time, 40); return levels.level; });
}"""
"""The level after each picture that took so long [ms], where 40 ms are the most."""

LEVELS_ON = """([full, same, first]) => {
    const levels = new Levels(first);
    return Array.from({ length: 400 }, () => {
        levels.note(full * LEVELS[levels.level].cost + same, 40);
        return levels.level;
    });
}"""
"""The level after each picture: a full one takes so long [ms], and some of it at all levels."""

AS_WITH_A_CARD = """
    const get = WebGL2RenderingContext.prototype.getParameter;
    WebGL2RenderingContext.prototype.getParameter = function (name) {
        return name === 0x9246 || name === 0x1F01 ? "a graphics card" : get.call(this, name);
    };
"""
"""Names the software that draws otherwise."""


def replay_of_gelatin(folder):
    """Write a replay of a cut block of gelatin; return its path."""
    model, data = little_arm()
    replay = ReplayWriter(model, frame=FRAME, look=LOOKS["gelatin"])
    replay.add(0.0, SceneState(cut_tissue()[2], body_poses(data), readings(0.0)))
    replay.write(folder / "gelatin.html")
    return folder / "gelatin.html"


@pytest.fixture(scope="module")
def tab(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("coarseness") / "replay.html"
    model, data = little_arm()
    replay = ReplayWriter(model, frame=FRAME)
    replay.add(0.0, SceneState(cut_tissue()[2], body_poses(data), readings(0.0)))
    replay.write(path)
    tab = new_tab(browser)
    tab.goto(local_file(path))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    tab.evaluate("player.pause()")
    yield tab
    assert tab.failures == []
    tab.close()


def test_pictures_that_take_long_make_the_next_ones_coarser_but_not_the_first_two(tab):
    first, second, *others = tab.evaluate(LEVELS_OF, [0, [9000, 9000, 50, 50, 50, 50]])
    assert [first, second, *others[:3]] == [0] * 5
    assert others[3] == 1


def test_pictures_that_take_very_long_make_the_next_ones_as_coarse_as_will_do(tab):
    assert tab.evaluate(LEVELS_OF, [0, [500] * 6])[-1] == 4


@pytest.mark.parametrize(("full", "same"), [(3.0, 2.0), (60.0, 5.0), (300.0, 8.0), (900.0, 15.0)])
def test_from_either_end_a_machine_comes_to_levels_next_to_each_other_and_stays(tab, full, same):
    last = len(tab.evaluate("LEVELS")) - 1
    ends = []
    for first in (0, last):
        levels = tab.evaluate(LEVELS_ON, [full, same, first])
        assert len(set(levels[200:])) == 1
        ends.append(levels[-1])
    coarser, finer = ends[1], ends[0]
    assert 0 <= coarser - finer <= 1
    if full < 40.0:
        assert ends == [0, 0]


def test_a_machine_that_is_too_slow_at_all_levels_draws_the_coarsest(tab):
    assert tab.evaluate(LEVELS_ON, [5000.0, 50.0, 0])[-1] == len(tab.evaluate("LEVELS")) - 1


def test_what_moves_is_drawn_as_coarsely_as_needed_and_what_rests_in_full(tab):
    drawn = """[sceneView.lights.lamp.castShadow, viewer.renderer.getPixelRatio(),
        sceneView.tissue.get("skin").mesh.material.type]"""
    tab.wait_for_function("coarseness.drawn === 0")
    fine = tab.evaluate(drawn)
    in_full = pixels(tab)
    tab.evaluate("coarseness.levels.level = LEVELS.length - 1, coarseness.onChange()")
    assert tab.evaluate(drawn) == [False, 0.25, "MeshLambertMaterial"]
    tab.wait_for_function("coarseness.drawn === 0")
    assert tab.evaluate(drawn) == fine and fine[:2] == [True, 1]
    tab.evaluate(UNTIL_DRAWN)
    assert np.array_equal(pixels(tab), in_full)


@pytest.mark.parametrize("has_card", [True, False])
def test_gelatin_lets_light_through_where_a_card_draws_it_finely(browser, tmp_path, has_card):
    tab = new_tab(browser)
    if has_card:
        tab.add_init_script(AS_WITH_A_CARD)
    tab.goto(local_file(replay_of_gelatin(tmp_path)))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    tab.evaluate("player.pause()")
    passes = "sceneView.tissue.get('skin').mesh.material.transmission > 0"
    tab.wait_for_function("coarseness.drawn === 0")
    assert tab.evaluate(passes) == has_card
    tab.evaluate("coarseness.draw(LEVELS.length - 1)")
    assert not tab.evaluate(passes)
    tab.evaluate("coarseness.draw(0), setShown('cut')")
    assert not tab.evaluate(passes), "a faint skin is faint"
    assert tab.failures == []
    tab.close()
