"""How many pages and connections the live page's server has, and for how long it waits for one."""

import socket
import time

import numpy as np
import pytest

from scalpel_sim import Viewer
from scalpel_sim.viewer import viewer as viewer_module
from scalpel_sim.viewer.limited_server import LARGEST_BODY, LARGEST_HEAD, MOST_CONNECTIONS
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses, shapes_of
from scalpel_sim.viewer.scene_packets import ScenePackets
from scalpel_sim.viewer.server import MOST_PAGES, OpenPages
from tests.long.viewer_faults import FaultyBrowser, masked_frame
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.scalpel_sim.viewer.test_viewer import Run

pytestmark = pytest.mark.end_to_end

PATIENCE = 20.0
CLOSE = 0x88
"""First byte of the frame by which a web socket is closed."""


@pytest.fixture
def viewer():
    with Viewer(little_arm()[0], frame=FRAME) as viewer:
        yield viewer


@pytest.fixture
def opened(viewer):
    run = Run(viewer)
    browser = FaultyBrowser(viewer, run.show_pictures, np.random.default_rng(0))
    yield browser
    browser.close()


def received(page, n=1 << 20):
    """Return what comes until nothing comes for a while, or the other side closes."""
    page.settimeout(0.5)
    found = b""
    try:
        while len(found) < n and (data := page.recv(1 << 16)):
            found += data
    except TimeoutError:
        pass
    except ConnectionResetError:
        found += b"reset"
    return found


def is_closed(connection):
    """Return whether the other side closes a connection, on which it had nothing to send."""
    connection.settimeout(1.0)
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False


@pytest.fixture
def impatient(monkeypatch):
    """A browser of a page whose server waits for half a second."""
    module = "scalpel_sim.viewer.limited_server"
    sooner = f"import {module} as server; server.IDLE_SECONDS_OF_HTTP = 0.5; "
    monkeypatch.setattr(viewer_module, "_PROGRAM", sooner + viewer_module._PROGRAM)
    with Viewer(little_arm()[0], frame=FRAME) as viewer:
        browser = FaultyBrowser(viewer, lambda n: None, np.random.default_rng(0))
        yield browser
        browser.close()


def ask(browser, method="GET", **headers):
    """Return the connection on which a request was sent, of a body that is still to come."""
    lines = [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    connection = browser._connected()
    head = "\r\n".join([f"{method} / HTTP/1.1", f"Host: {browser._host}", *lines, "\r\n"])
    connection.sendall(head.encode())
    return connection


class ClosedPage:
    """A page that was closed, which is noticed when it is sent something."""

    def __init__(self, pages):
        self._pages, self.n_undrawn, self.last, self.forces = pages, 0, None, []
        pages.add(self)

    def send(self, packet):
        self._pages.remove(self)


def test_pages_that_were_closed_before_the_first_picture_do_not_end_the_viewer():
    model, data = little_arm()
    pages = OpenPages(ScenePackets(shapes_of(model), FRAME))
    closed = [ClosedPage(pages) for _ in range(3)]
    pages.show(SceneState(cut_tissue()[0], body_poses(data), readings(0.0)))
    assert not pages._pages and len(closed) == 3


def test_connections_beyond_the_limit_are_closed_and_free_their_places(viewer, opened):
    idle = [opened._connected() for _ in range(MOST_CONNECTIONS)]
    time.sleep(0.5)
    assert is_closed(opened._connected())
    assert not is_closed(idle[0])
    for each in idle:
        each.close()
    time.sleep(0.5)
    assert b"101 Switching Protocols" in received(opened.open_page())


def test_connections_on_which_nothing_comes_are_closed_and_free_their_places(impatient):
    silent = [impatient._connected() for _ in range(MOST_CONNECTIONS)]
    assert received(silent[-1]) == b"" and is_closed(silent[-1])
    assert b"101 Switching Protocols" in received(impatient.open_page())


def test_a_page_that_says_nothing_is_no_idle_connection(impatient):
    page = impatient.open_page()
    assert b"101 Switching Protocols" in received(page)
    assert not is_closed(page)


def test_a_request_whose_body_does_not_come_is_closed(impatient):
    page = ask(impatient, "POST", Content_Length=LARGEST_BODY)
    assert received(page) == b"" and is_closed(page)


def test_a_head_beyond_the_limit_is_not_answered(viewer, opened):
    assert b"200 OK" in received(ask(opened, Cookie="a" * (LARGEST_HEAD // 2)))
    assert b"HTTP" not in received(ask(opened, Cookie="a" * 2 * LARGEST_HEAD))
    assert b"200 OK" in received(ask(opened))


def test_a_body_beyond_the_limit_is_refused_before_it_comes(viewer, opened):
    assert received(ask(opened, "POST", Content_Length=LARGEST_BODY)) == b""
    assert b"400 Bad Request" in received(ask(opened, "POST", Content_Length=LARGEST_BODY + 1))


def test_pages_beyond_the_limit_are_closed_and_free_their_places(viewer, opened):
    pages = [opened.open_page() for _ in range(MOST_PAGES)]
    assert b"101 Switching Protocols" in received(pages[-1])
    _, _, frame = received(opened.open_page()).partition(b"\r\n\r\n")
    assert frame[0] == CLOSE and b"16 pages are open" in frame
    pages[0].close()
    time.sleep(0.5)
    _, _, frame = received(opened.open_page()).partition(b"\r\n\r\n")
    assert frame == b""  # nothing to show yet


def test_a_page_that_says_it_has_drawn_and_reads_nothing_is_closed(viewer, opened):
    page = opened.open_page()
    page.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    deadline = time.monotonic() + 3.0 * PATIENCE
    with pytest.raises(ConnectionError):
        while time.monotonic() < deadline:
            opened._show(1)
            page.sendall(masked_frame(b"drawn"))
            time.sleep(0.01)
    assert viewer.is_running


def test_a_page_whose_browser_does_not_answer_is_closed(monkeypatch):
    sooner = "from scalpel_sim.viewer import server; server.SECONDS_TO_ANSWER = 0.5; "
    monkeypatch.setattr(viewer_module, "_PROGRAM", sooner + viewer_module._PROGRAM)
    with Viewer(little_arm()[0], frame=FRAME) as viewer:
        browser = FaultyBrowser(viewer, lambda n: None, np.random.default_rng(0))
        page = browser.open_page()
        begun = time.monotonic()
        page.settimeout(PATIENCE)
        while page.recv(1 << 16):
            pass
        assert 0.4 < time.monotonic() - begun < 0.5 * PATIENCE
        browser.close()


def test_too_long_a_message_closes_its_page(viewer, opened):
    page = opened.open_page()
    long = bytes([0x81, 0xFF]) + (1 << 20).to_bytes(8, "big") + bytes(4) + bytes(1 << 20)
    with pytest.raises(ConnectionError):
        page.sendall(long)
        while page.recv(1 << 16):
            pass
        raise ConnectionResetError  # it was closed in good order
    assert viewer.is_running


def test_the_process_of_a_page_that_cannot_be_served_ends_without_a_word(viewer, capfd):
    FaultyBrowser(viewer, lambda n: None, np.random.default_rng(0)).ask_for_the_port()
    assert capfd.readouterr().err == ""
