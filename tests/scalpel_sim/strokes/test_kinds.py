"""The registry of strokes, and the one that docs/extend.md adds to it."""

import re
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim import SCENES, STROKES, StrokeTable, changed
from scalpel_sim.errors import UsageError
from tests.support.planned_strokes import plan_stroke

PAGE = Path(__file__).parents[3] / "docs" / "extend.md"
CIRCLE = StrokeTable(kind="circle", points=[(0.02, 0.03, 0.0), (0.025, 0.03, 0.0)], length=0.05)


@pytest.fixture
def with_circle(monkeypatch):
    """Add the stroke of the page, for one test."""
    before = dict(STROKES)
    _, _, section = PAGE.read_text(encoding="utf-8").partition("## A stroke\n")
    exec(re.search(r"```python\n(.*?)```", section, re.DOTALL)[1], {"__name__": "circle"})
    yield
    STROKES.clear()
    STROKES.update(before)


def test_the_kinds_of_each_module_are_found():
    folder = Path(__file__).parents[3] / "scalpel_sim" / "strokes" / "kinds"
    modules = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    assert {kind.plan.__module__.rpartition(".")[2] for kind in STROKES.values()} == modules


@pytest.mark.usefixtures("with_circle")
def test_a_stroke_that_is_added_is_planned_and_checked_as_the_others():
    scene = changed(SCENES["slab"], strokes=(CIRCLE,))
    stroke = plan_stroke("circle", scene.mesh(), points=CIRCLE.points, length=CIRCLE.length)
    tips = np.array([pose.tip for pose in stroke.poses(100)])
    radii = np.linalg.norm(tips - [0.02, 0.03, 0.0], axis=1)
    np.testing.assert_allclose(radii, 5e-3, rtol=1e-3)
    with pytest.raises(UsageError, match='of kind "circle" has 1 points; it has a centre'):
        changed(scene, strokes=(StrokeTable(kind="circle", points=[(0, 0, 0)], length=0.05),))
    with pytest.raises(UsageError, match='has the key depth, which belongs to kind "incision"'):
        changed(scene, depth=0.01)
