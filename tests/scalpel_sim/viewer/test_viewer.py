import asyncio
import os
import signal
import socket
import threading
import time
import urllib.error
import urllib.request

import pytest
from tornado.httpclient import HTTPClientError
from tornado.websocket import websocket_connect

from scalpel_sim import Viewer
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.viewer import viewer as viewer_module
from scalpel_sim.viewer.model_shapes import body_poses
from tests.scalpel_sim.hands.driven_view import page_of
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.support.browser import WINDOW, new_tab, pixels_of

NO_WAIT = 0.25
"""Longest time of a call of `show` on a busy machine [s]. Usually it is 20 microseconds; if it
waited for a viewer that does not read, it would wait for ever."""

PATIENCE = 20.0
"""Longest time that a test waits for anything on a busy machine [s]."""


@pytest.fixture
def viewer():
    with Viewer(little_arm()[0], frame=FRAME) as viewer:
        yield viewer


class Run:
    """A run that shows pictures of a cut, as fast as it can."""

    def __init__(self, viewer: Viewer) -> None:
        self.surfaces = cut_tissue()
        self.poses = body_poses(little_arm()[1])
        self.viewer = viewer
        self.longest = 0.0
        self.n_shown = 0

    def show_pictures(self, n: int = 200) -> None:
        """Show the next `n` pictures, and remember the longest wait."""
        for _ in range(n):
            surface = self.surfaces[self.n_shown % len(self.surfaces)]
            start = time.perf_counter()
            self.viewer.show(surface, self.poses, readings(self.n_shown / 1000))
            self.longest = max(self.longest, time.perf_counter() - start)
            self.n_shown += 1


def until(condition, what: str) -> None:
    """Wait for a condition."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"waited {PATIENCE} s for {what}"
        time.sleep(0.02)


def port_of(viewer: Viewer) -> int:
    return int(viewer.url.rstrip("/").rsplit(":", 1)[1])


def status(url: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers)) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_the_page_is_served_on_loopback_only(viewer):
    assert viewer.url.startswith("http://127.0.0.1:")
    assert status(viewer.url) == 200
    with pytest.raises(ConnectionRefusedError):  # another address of this machine
        socket.create_connection(("127.0.0.2", port_of(viewer)), timeout=PATIENCE)


def test_a_foreign_name_that_points_here_is_not_served(viewer):
    assert status(viewer.url, Host="evil.example") == 404


def test_without_a_given_port_the_next_free_one_is_taken(viewer):
    with Viewer(little_arm()[0]) as second:
        assert port_of(second) != port_of(viewer)
        assert status(second.url) == 200


def test_a_port_that_does_not_exist_is_wrong_use():
    with pytest.raises(UsageError, match="ports go from 1 to 65535"):
        Viewer(little_arm()[0], port=70000)


def test_a_page_that_cannot_be_made_is_an_error_with_the_reason(monkeypatch):
    broken = "from scalpel_sim.viewer import page; page._BUNDLE = 'gone.js'; "
    monkeypatch.setattr(viewer_module, "_PROGRAM", broken + viewer_module._PROGRAM)
    with pytest.raises(RunError, match=r"did not start: meshcat's viewer.* is not at .*gone\.js"):
        Viewer(little_arm()[0])


def test_a_killed_viewer_does_not_disturb_the_run(viewer):
    run = Run(viewer)
    run.show_pictures()
    os.kill(viewer._process.pid, signal.SIGKILL)
    until(lambda: not viewer.is_running, "the process to be gone")
    run.show_pictures()
    assert not viewer.is_due()
    assert run.longest < NO_WAIT


def test_a_viewer_that_has_stopped_reading_does_not_disturb_the_run(viewer):
    run = Run(viewer)
    os.kill(viewer._process.pid, signal.SIGSTOP)
    run.show_pictures(2000)
    assert run.longest < NO_WAIT
    start = time.monotonic()
    viewer.close()
    assert time.monotonic() - start < 10.0
    assert not viewer.is_running


def test_closing_ends_the_process_and_frees_the_port(viewer):
    viewer.close()
    assert not viewer.is_running
    with Viewer(little_arm()[0], port=port_of(viewer)) as again:
        assert again.url == viewer.url


def test_the_process_ends_with_the_run_however_that_ended(viewer):
    viewer._pipe.close()  # as when the run was killed
    until(lambda: not viewer.is_running, "the process to end")
    assert not viewer.is_running


def test_pictures_are_due_at_most_thirty_times_a_second(viewer):
    run = Run(viewer)
    assert viewer.is_due()
    run.show_pictures(1)
    assert not viewer.is_due()
    time.sleep(1 / 20)
    assert viewer.is_due()


def test_a_page_that_does_not_draw_gets_no_more_pictures(viewer):
    run = Run(viewer)
    run.show_pictures(1)
    received = []

    async def sleepy_page():
        socket_url = viewer.url.replace("http", "ws") + "frames"
        page = await websocket_connect(socket_url, on_message_callback=received.append)
        deadline = time.monotonic() + 1.0
        while time.monotonic() < deadline:
            run.show_pictures(1)
            await asyncio.sleep(0.02)
        page.close()

    in_a_thread(sleepy_page)
    packets = [message for message in received if message is not None]
    assert 1 <= len(packets) <= 2, "the opening and at most one picture"


def test_only_pages_of_this_server_make_the_run_compute_what_they_show(viewer):
    own = viewer.url.rstrip("/")

    async def pages():
        no_page, page, other = [
            await page_of(viewer.url, origin, "") for origin in (None, own, own)
        ]
        with pytest.raises(HTTPClientError, match="403"):
            await page_of(viewer.url, "http://evil.example", "")
        await no_page.write_message('{"type": "colour", "quantity": "displacement"}')
        await page.write_message('{"type": "colour", "quantity": "heat"}')
        await page.write_message('{"type": "colour", "quantity": "strain"}')
        await other.write_message('{"type": "colour", "quantity": "stress"}')
        until(lambda: viewer.wanted == {"strain", "stress"}, "both choices")
        await page.write_message('{"type": "colour", "quantity": null}')
        until(lambda: viewer.wanted == {"stress"}, "one to show none")
        other.close()
        async with asyncio.timeout(PATIENCE):
            while viewer.wanted:
                await asyncio.sleep(0.02)

    in_a_thread(pages)


def in_a_thread(coroutine) -> None:
    """Run a coroutine where no other event loop is running."""
    failures = []

    def run() -> None:
        try:
            asyncio.run(coroutine())
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert failures == []


@pytest.mark.browser
def test_the_live_page_follows_the_run_and_tabs_come_and_go(viewer, browser):
    run = Run(viewer)
    run.show_pictures(21)  # ends with the block cut in two
    tab, other = new_tab(browser), new_tab(browser)
    for page in (tab, other):
        page.goto(viewer.url)
        page.wait_for_function("document.getElementById('time').textContent === '0.02 s'")
    tab.wait_for_function(
        "sceneView.appearances.get('skin').map.image && sceneView.appearances.get('cut').map.image"
    )
    n_pixels = WINDOW["width"] * WINDOW["height"]
    assert len(pixels_of(tab, "tissue/skin")) > n_pixels / 30
    assert len(pixels_of(tab, "tissue/cut")) > n_pixels / 300

    other.close()
    run.show_pictures(1000)
    tab.wait_for_function("document.getElementById('time').textContent === '1.02 s'")
    tab.close()
    run.show_pictures(1000)
    assert viewer.is_running
    assert run.longest < NO_WAIT
    assert tab.failures == other.failures == []


@pytest.mark.browser
def test_the_live_page_shows_the_forces_of_all_hands_and_plots_them(viewer, browser):
    surface, poses = cut_tissue()[2], body_poses(little_arm()[1])
    tab = new_tab(browser)
    tab.goto(viewer.url)
    for time_now, newtons in ((1.0, 0.2), (2.0, 0.4), (1.5, 0.3)):  # after an undo it is earlier
        now = readings(time_now)._replace(hands=[("left", newtons)])
        viewer.show(surface, poses, now)
        tab.wait_for_function(f"lastReadings !== null && lastReadings.time === {time_now}")
    assert tab.inner_text("#readings .hand") == "force on the grasper left\n0.30 N"
    assert tab.evaluate("forcePlot.rows.map(([time, , grasper]) => [time, grasper])") == [
        [1.0, 0.2],
        [1.5, 0.3],
    ]
    tab.close()
    assert tab.failures == []


def values(top):
    """Return a quantity that grows from one side of the cut block to the other."""
    surface = cut_tissue()[2]
    return top * surface.rest_positions[:, 0] / surface.rest_positions[:, 0].max()


@pytest.mark.browser
def test_a_live_page_asks_the_run_for_what_it_shows_as_colours(viewer, browser):
    poses = body_poses(little_arm()[1])
    viewer.show(cut_tissue()[2], poses, readings(0.0))
    tab, other = new_tab(browser), new_tab(browser)
    for page in (tab, other):
        page.goto(viewer.url)
        page.wait_for_function("sceneView.tissue.size === 2 && openSocket !== null")
    for page in (tab, other):
        page.click("#display summary")
    tab.keyboard.press("q")
    tab.select_option("#quantity", "stress")
    other.select_option("#quantity", "strain")
    assert tab.inner_text("#scale-title").endswith("not in this picture yet")
    until(lambda: viewer.wanted == {"strain", "stress"}, "both choices")
    assert viewer.lacks_values
    both = {"strain": values(0.4), "stress": values(1500.0)}
    viewer.show(cut_tissue()[2], poses, readings(0.0), values=both)
    assert not viewer.lacks_values
    for page, ticks, title in (
        (tab, ["0", "1", "\u2265 2"], "stress, von Mises [kPa]"),
        (other, ["0", "0.25", "\u2265 0.5"], "strain, largest principal"),
    ):
        page.wait_for_function("sceneView.colours.isThere")
        assert page.inner_text("#scale-ticks").split("\n") == ticks
        assert page.inner_text("#scale-title") == title
    tab.reload()
    until(lambda: viewer.wanted == {"strain"}, "the page to be gone")
    for page in (tab, other):
        page.close()
        assert page.failures == []
