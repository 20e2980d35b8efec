"""What browsers, and programs that are none, may do to the server of the live page."""

import base64
import contextlib
import os
import signal
import socket
import struct
import time
from collections.abc import Callable

import numpy as np
import pytest

from scalpel_sim import Viewer
from scalpel_sim.errors import RunError
from scalpel_sim.viewer.messages import PageControls
from scalpel_sim.viewer.model_shapes import body_poses
from tests.scalpel_sim.hands.driven_view import token_in
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue

NO_WAIT = 1.0
"""Longest time of a call of `show` on a busy machine [s]. Usually it is 20 microseconds; with 18
processes on two cores a call without a wait has taken 0.31 s. One that waits would not end."""

PATIENCE = 20.0
"""Longest time in which an honest page must get its pictures on a busy machine [s]."""

N_FAULTS = 20
"""Faults of a case."""

COMMANDS = (
    *('{"type":"engage"}', '{"type":"release"}', '{"type":"lead"}', '{"type":"still there"}'),
    *('{"type":"move","by":[0.001,0,0],"stamp":5}', '{"type":"colour","quantity":"strain"}'),
    *('{"type":"turn","by":[0,0.1,0],"stamp":6}', "drawn"),
)
"""What pages say."""


class FaultyBrowser:
    """Does damage to a live page's server, while a run shows pictures.

    Args:
        viewer: Whose page it is.
        show: Shows the next pictures of the run.
        random: Draws what is done.
    """

    def __init__(
        self, viewer: Viewer, show: Callable[[int], None], random: np.random.Generator
    ) -> None:
        self._viewer, self._show, self._random = viewer, show, random
        self._host = viewer.url.split("/")[2]
        self._port = int(self._host.rpartition(":")[2])
        self._sockets: list[socket.socket] = []

    def do_damage(self) -> None:
        """Do one thing."""
        faults = (
            *(self._open_tabs, self._close_a_tab, self._reset_a_tab, self._never_read),
            *(self._stay_idle, self._talk_garbage, self._damage_messages, self._damage_frames),
            self._say_drawn_without_reading,
        )
        with contextlib.suppress(OSError):
            faults[self._random.integers(len(faults))]()

    def close(self) -> None:
        """Close what is open."""
        for each in self._sockets:
            each.close()

    def open_page(self, path: str = "/frames") -> socket.socket:
        """Return the open socket of a page, from which nothing was read but the handshake."""
        page = self._connected()
        key = base64.b64encode(self._random.bytes(16)).decode()
        page.sendall(
            f"GET {path} HTTP/1.1\r\nHost: {self._host}\r\nOrigin: http://{self._host}\r\n"
            f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        return page

    def _connected(self) -> socket.socket:
        found = socket.create_connection(("127.0.0.1", self._port), PATIENCE)
        self._sockets.append(found)
        return found

    def _token_path(self) -> str:
        return f"/frames?token={token_in(self._viewer.url)}"

    def _open_tabs(self) -> None:
        for _ in range(10):
            self.open_page()

    def _close_a_tab(self) -> None:
        if self._sockets:
            self._sockets.pop(self._random.integers(len(self._sockets))).close()

    def _reset_a_tab(self) -> None:
        page = self.open_page()
        page.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        page.close()

    def _never_read(self) -> None:
        page = self.open_page()
        page.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)

    def _say_drawn_without_reading(self) -> None:
        page = self.open_page()
        page.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        for _ in range(50):
            page.sendall(masked_frame(b"drawn"))
            self._show(1)

    def _stay_idle(self) -> None:
        for _ in range(10):
            self._connected()

    def _talk_garbage(self) -> None:
        self._connected().sendall(self._random.bytes(self._random.integers(1, 40_000)))

    def _damage_messages(self) -> None:
        """Send what a page may say, with some bytes changed, as a page that may lead."""
        page = self.open_page(self._token_path())
        for _ in range(50):
            message = COMMANDS[self._random.integers(len(COMMANDS))].encode()
            page.sendall(masked_frame(self._damaged(message)))

    def _damage_frames(self) -> None:
        """Send frames of the web socket's own protocol with some bytes changed."""
        for _ in range(5):
            page = self.open_page()
            frames = b"".join(masked_frame(text.encode()) for text in COMMANDS)
            page.sendall(self._damaged(frames))

    def _damaged(self, data: bytes) -> bytes:
        changed = bytearray(data)
        for at in self._random.integers(0, len(changed), self._random.integers(0, 4)):
            changed[at] ^= self._random.integers(1, 256)
        return bytes(changed)

    def ask_for_the_port(self) -> None:
        """Start another viewer at the same port, which is an error there."""
        with pytest.raises(RunError, match=f"port {self._port} is in use"):
            Viewer(little_arm()[0], port=self._port)


def masked_frame(payload: bytes) -> bytes:
    """Return a text frame of a web socket, as browsers send them."""
    return bytes([0x81, 0x80 | len(payload), 0, 0, 0, 0]) + payload


def harass(case: int) -> float:
    """Do `N_FAULTS` things to the server of a page; the run goes on, and a good page sees it.

    Return how long the run waited for a picture at most [s].
    """
    from collections import deque

    random = np.random.default_rng(case)
    model, data = little_arm()
    commands: deque = deque()
    poses, surfaces, n_shown, longest = body_poses(data), cut_tissue(), 0, 0.0
    with Viewer(model, frame=FRAME, controls=PageControls(commands, is_led=True)) as viewer:

        def show(n: int) -> None:
            nonlocal n_shown, longest
            for _ in range(n):
                begun = time.perf_counter()
                viewer.show(surfaces[n_shown % len(surfaces)], poses, readings(n_shown / 1000))
                longest = max(longest, time.perf_counter() - begun)
                n_shown += 1

        browser = FaultyBrowser(viewer, show, random)
        try:
            for _ in range(N_FAULTS):
                show(20)
                browser.do_damage()
            browser.ask_for_the_port()
            assert viewer.is_running
        finally:
            browser.close()
        good = FaultyBrowser(viewer, show, random)
        expect_pictures(good, show)
        good.close()
        for command in commands:
            assert all(np.isfinite(x).all() for x in vars_of(command)), command
        if random.random() < 0.5:
            os.kill(viewer._process.pid, signal.SIGKILL)
        else:
            os.kill(viewer._process.pid, signal.SIGSTOP)
        show(200)
    assert not viewer.is_running
    return longest


def vars_of(command: object) -> list:
    """Return the numbers of a command."""
    values = (getattr(command, name) for name in command.__struct_fields__)
    return [np.asarray(x) for x in values if isinstance(x, int | float | tuple | list)]


def expect_pictures(browser: FaultyBrowser, show: Callable[[int], None]) -> None:
    """Open a page, as soon as there is a place for it, and expect two pictures of the run."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError):
            page = browser.open_page()
            page.settimeout(1.0)
            found = b""
            while len(found) < 20_000 and time.monotonic() < deadline:
                show(1)
                data = page.recv(1 << 16)
                if not data:
                    break
                found += data
            if len(found) >= 20_000 and b"101 Switching" in found:
                return
        time.sleep(0.1)
    raise AssertionError("a good page got no pictures")
