"""The plan of a task on the tissue, and the score beside the picture."""

import numpy as np
import pytest

from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import ReplayWriter
from scalpel_sim.viewer.scene3d import JudgedState
from tests.scalpel_sim.cut_block import cut_block
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.support.browser import local_file

PLACES = np.column_stack([np.full(41, 0.02), np.linspace(0.01, 0.05, 41), np.full(41, 0.04)])
"""A line along the middle of the upper side of the block [m]."""

IS_OPEN = PLACES[:, 1] < 0.03

PIECES = """(name) => {
    const { array } = planLine.bands[name].geometry.attributes.position;
    const along = Array.from(array).filter((_, i) => i % 3 === 1);
    return [Math.min(...along), Math.max(...along)];
}"""
"""Returns from where to where the bands of a colour go along y [m], world frame."""


@pytest.fixture
def judged(tab, tmp_path):
    """A tab that shows a replay with a plan that is half open."""
    model, data = little_arm()
    replay = ReplayWriter(model, frame=FRAME)
    rows = [("Planned cut that is open", "50%", False), ("Error of depth", "0.40 mm", None)]
    state = SceneState(cut_block(0.0), body_poses(data), readings(0.0))
    replay.add(0.0, state._replace(judged=JudgedState(PLACES, IS_OPEN, rows)))
    replay.write(tmp_path / "replay.html")
    tab.goto(local_file(tmp_path / "replay.html"))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    return tab


@pytest.mark.browser
def test_the_part_of_the_plan_that_is_open_has_another_colour(judged):
    offset, width = FRAME.origin[1], 2e-3  # of a band, which the eye sees aslant
    low, high = judged.evaluate(PIECES, "open")
    np.testing.assert_allclose([low, high], [offset + 0.01, offset + 0.0295], atol=width)
    low, high = judged.evaluate(PIECES, "planned")
    np.testing.assert_allclose([low, high], [offset + 0.0295, offset + 0.05], atol=width)


@pytest.mark.browser
def test_the_terms_of_the_score_stand_beside_the_picture_by_sign_and_not_by_colour_alone(judged):
    assert judged.locator("#score dt").all_inner_texts() == [
        "planned cut that is open",
        "error of depth",
    ]
    assert judged.locator("#score dd").all_inner_texts() == ["50% \u2717", "0.40 mm"]
