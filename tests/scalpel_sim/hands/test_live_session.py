"""One page shows run after run, as it asks for them; without a browser."""

import asyncio
import json
import time

import pytest

from scalpel_sim import SavedRun, read_scene
from scalpel_sim.runs.file_names import SCENE, STROKE, SUMMARY
from tests.scalpel_sim.hands.driven_view import DrivenView, LiveView, document, page_of, token_in
from tissue import MATERIALS

pytestmark = pytest.mark.end_to_end

PATIENCE = 60.0
"""How long a run may take to begin [s]: the machine may be busy."""


async def say(view, *messages):
    """Say something as the page of a view does."""
    page = await page_of(view.url, view.url.rstrip("/"), token_in(view.url))
    for message in messages:
        await page.write_message(json.dumps(message))
    await asyncio.sleep(0.5)
    page.close()


def until_titled(view, title):
    """Wait until the page is that of another run."""
    deadline = time.monotonic() + PATIENCE
    while f"<h1>{title}</h1>" not in document(view.url):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def begin(**others):
    return {"type": "begin"} | others


def summary(folder):
    return json.loads((folder / SUMMARY).read_text())


def test_the_page_begins_a_run_of_another_scene_material_and_blade_in_its_own_folder(
    tmp_path,
):
    first, second = tmp_path / "out", tmp_path / "out-2"
    with LiveView("grid2", first) as view:
        view.wait_for_files()
        asked = begin(scene="grid7", material="gelatin", toughness=20.0, blade_thickness=3e-4)
        asyncio.run(say(view, asked))
        view.wait_for_files()
    assert summary(first)["scene"] == "grid2" and summary(second)["scene"] == "grid7"
    scene = read_scene(second / SCENE)
    assert scene.material.toughness == 20.0
    assert scene.blade.thickness == 3e-4
    assert scene.material.young_modulus == MATERIALS["gelatin"].young_modulus.value


def test_each_run_of_a_page_is_recorded_to_a_file_of_its_own(tmp_path):
    record = ("--record", str(tmp_path / "cut.vtkhdf"))
    with LiveView("grid2", tmp_path / "out", *record) as view:
        view.wait_for_files()
        asyncio.run(say(view, begin(is_led=True)))
        until_titled(view, "grid2: led by hand")
        move = {"type": "move", "by": [0.0, 0.01, 0.0], "stamp": 1}
        asyncio.run(say(view, {"type": "engage"}, move, {"type": "release"}, {"type": "end"}))
        view.wait_for_files()
    for end in ("", "-2"):
        done = summary(tmp_path / f"out{end}")
        with SavedRun(tmp_path / f"cut{end}.vtkhdf") as run:
            assert run.times[-1] == pytest.approx(done["simulated_seconds"])
            assert len(run.rows) == done["frames"] and run.title.startswith("grid2")


def test_a_script_that_is_watched_gives_way_to_a_hand(tmp_path):
    with LiveView("grid2", tmp_path / "out", "--seconds", "1000") as view:
        asyncio.run(say(view, begin(is_led=True)))
        view.wait_for_files()
        assert summary(tmp_path / "out")["status"] == "ended in the page"
        until_titled(view, "grid2: led by hand")
        move = {"type": "move", "by": [0.0, 0.01, 0.0], "stamp": 1}
        asyncio.run(say(view, {"type": "engage"}, move, {"type": "release"}, {"type": "end"}))
        view.wait_for_files()
    assert (tmp_path / "out-2" / STROKE).exists()
    assert summary(tmp_path / "out-2")["status"] == "complete"


def test_a_run_that_nobody_has_led_leaves_no_files(tmp_path):
    with DrivenView("grid2", tmp_path / "out") as view:
        asyncio.run(say(view, begin(scene="grid7")))
        view.wait_for_files()
    assert (
        not (tmp_path / "out" / SUMMARY).exists() or summary(tmp_path / "out")["scene"] == "grid7"
    )
