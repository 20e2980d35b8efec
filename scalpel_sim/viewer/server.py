"""The process of the live viewer: it reads scene states from a pipe and serves them to browsers.

`viewer.Viewer` starts it and sends pickles to its standard input: first a `ViewerSettings`, then
any number of `SceneState`s. The process replies with one line on its standard output, a
`StartReply` as JSON, and ends when its input ends. A line follows where other quantities are to be
shown as colours than before, and, where the page controls the run, for each of its commands. The
pickles never leave the two processes.
"""

import asyncio
import errno
import logging
import os
import pickle
import sys
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import tornado.web
import tornado.websocket

from scalpel_sim.errors import RunError
from scalpel_sim.hands.commands import Command
from scalpel_sim.viewer.colouring import Colouring, Wanted, colour_of
from scalpel_sim.viewer.leading import Leadership, is_own_page
from scalpel_sim.viewer.limited_server import LimitedServer
from scalpel_sim.viewer.messages import (
    MOST_ROWS_OF_FORCES,
    UPDATES_PER_SECOND,
    ForceRows,
    SceneState,
    StartReply,
    ViewerSettings,
)
from scalpel_sim.viewer.scene_packets import ScenePackets
from scalpel_sim.viewer.site import FileRequest, PageRequest, Site

LOOPBACK = "127.0.0.1"
"""The only address that is listened on: no other machine can see the run or slow it down."""

OWN_NAMES = r"(127\.0\.0\.1|localhost)"
"""Host names that a browser may request. Another name that resolves to this address gets a 404."""

FIRST_PORT = 7000
"""First port that is tried, the same as meshcat's."""
LAST_PORT = 7099
"""Last port that is tried."""

DRAWN = "drawn"
"""Message of a page that has drawn a packet."""

RELOAD = '{"reload":true}'
"""Message to a page that is to be loaded again."""

LAST_STATE_TIMEOUT = 1.0
"""Time for the pages to draw the last state before the process ends [s]."""

MOST_PAGES = 16
"""Pages at most that are shown the run at once."""

MOST_UNSENT = 8
"""Messages at most that a page's socket holds because the page does not read them."""

SECONDS_TO_ANSWER = 10.0
"""Interval of pings that show whether a page reads, and time in which its browser is to answer
[s]. The browser answers for a page that is hidden, or that is stopped in a debugger."""

LARGEST_MESSAGE = 1 << 14
"""Largest message of a page [byte]: commands have some hundred."""


class NewestState:
    """The newest scene state that came through the pipe. Older states are dropped.

    Args:
        settings: Those of the first run.
    """

    def __init__(self, settings: ViewerSettings) -> None:
        self.shown: tuple[ViewerSettings, SceneState | None] = (settings, None)
        """The run that is shown, and its state."""
        self._forces: deque[tuple[float, ...]] = deque(maxlen=MOST_ROWS_OF_FORCES)
        self.has_ended = threading.Event()
        self.on_change: Callable[[], object] = lambda: None
        """Called by the thread that reads, after each state and at the end."""

    def read(self, pipe: Any) -> None:
        """Read scene states from the pipe until it ends."""
        try:
            while True:
                message = pickle.load(pipe)
                if isinstance(message, ForceRows):
                    self._forces.extend(message.rows)
                    continue
                begins = isinstance(message, ViewerSettings)
                self.shown = (message, None) if begins else (self.shown[0], message)
                self.on_change()
        except (EOFError, pickle.UnpicklingError):  # closed, or cut off inside a pickle
            self.has_ended.set()
            self.on_change()

    def take_forces(self) -> list[tuple[float, ...]]:
        """Return the rows of forces that have come since the last call."""
        return [self._forces.popleft() for _ in range(len(self._forces))]


class OpenPages:
    """The open pages, and the packets that are sent to them.

    A page gets a packet only after it has drawn the previous one. A page that is slow, asleep or
    stopped in a debugger skips states, so that no packets wait for it here.
    """

    def __init__(self, packets: ScenePackets) -> None:
        self._packets = packets
        self._opening: bytes | None = None
        self._newest: bytes | None = None
        self._shown: SceneState | None = None
        self._forces: deque[tuple[float, ...]] = deque(maxlen=MOST_ROWS_OF_FORCES)
        self._pages: set[PageSocket] = set()

    def begin(self, packets: ScenePackets) -> None:
        """Reload all pages, to show another run."""
        self._packets, self._opening, self._newest = packets, None, None
        self._forces.clear()
        for page in list(self._pages):
            page.say(RELOAD)

    def show(self, state: SceneState | None) -> None:
        """Send a scene state to every page that is ready for it, if the state is a new one."""
        if state is None or state is self._shown:
            return
        if self._opening is None:
            self._opening = self._packets.opening(state.surface, state.body_poses)
            for page in list(self._pages):  # one that is closed goes when it is sent something
                page.send(self._opening)
        self._newest = self._packets.frame(state)
        self._shown = state
        for page in list(self._pages):
            self.send_newest(page)

    def add_forces(self, rows: list[tuple[float, ...]]) -> None:
        """Add rows of forces to what each page gets with its next state."""
        self._forces.extend(rows)
        for page in self._pages:
            page.forces.extend(rows)

    @property
    def are_too_many(self) -> bool:
        """Whether there may be no more pages."""
        return len(self._pages) >= MOST_PAGES

    def add(self, page: "PageSocket") -> None:
        """Show the run to a page that was opened."""
        self._pages.add(page)
        page.forces.extend(self._forces)
        if self._opening is not None:
            page.send(self._opening)
        self.send_newest(page)

    def remove(self, page: "PageSocket") -> None:
        """Forget a page that was closed."""
        self._pages.discard(page)

    def send_newest(self, page: "PageSocket") -> None:
        """Send the newest packet to a page that has drawn all packets before it."""
        if self._newest is not None and page.n_undrawn == 0 and page.last is not self._newest:
            page.last = self._newest
            if page.forces:
                page.say(msgspec.json.encode({"forces": list(page.forces)}).decode())
                page.forces.clear()
            page.send(self._newest)

    async def wait_until_drawn(self) -> None:
        """Wait until all pages have drawn the last state, at most `LAST_STATE_TIMEOUT`."""
        for _ in range(round(LAST_STATE_TIMEOUT * UPDATES_PER_SECOND)):
            if all(page.n_undrawn == 0 for page in self._pages):
                return
            await asyncio.sleep(1.0 / UPDATES_PER_SECOND)


class PageSocket(tornado.websocket.WebSocketHandler):
    """The connection to one open page."""

    def initialize(
        self, open_pages: OpenPages, colouring: Colouring, leading: Leadership | None
    ) -> None:
        """Set the pages that this page is one of, and who of them leads; called by tornado."""
        self._open_pages = open_pages
        self._colouring = colouring
        self._leading = leading
        self.n_undrawn = 0
        self.last: bytes | None = None
        self.forces: deque[tuple[float, ...]] = deque(maxlen=MOST_ROWS_OF_FORCES)
        self._n_unsent = 0

    def open(self, *_: str, **__: str) -> None:
        """Handle a page that was opened. A page of another origin was refused by tornado."""
        if self._open_pages.are_too_many:
            self.close(reason=f"{MOST_PAGES} pages are open")
            return
        self._open_pages.add(self)
        host, origin = self.request.host, self.request.headers.get("Origin")
        if self._leading and self._leading.may_lead(host, origin, self.get_argument("token", "")):
            self.set_nodelay(True)
            self._leading.add(self)

    def on_message(self, message: str | bytes) -> None:
        """Handle a page's message: that it has drawn a packet, a choice of colour, or a command."""
        if message != DRAWN:
            colour = colour_of(message)
            if colour is not None:
                if is_own_page(self.request.host, self.request.headers.get("Origin")):
                    self._colouring.choose(self, colour)
            elif self._leading is not None:
                self._leading.receive(self, message)
            return
        self.n_undrawn = max(0, self.n_undrawn - 1)
        self._open_pages.send_newest(self)

    def on_close(self) -> None:
        """Handle a page that was closed."""
        self._open_pages.remove(self)
        self._colouring.remove(self)
        if self._leading is not None:
            self._leading.remove(self)

    def say(self, text: str) -> None:
        """Send a text, which is not drawn."""
        self._write(text)

    def send(self, packet: bytes) -> None:
        """Send a packet, and count it until the page has drawn it."""
        self.n_undrawn += 1
        self._write(packet)

    def _write(self, message: str | bytes) -> None:
        """Send a message; a page that does not read is closed."""
        if self._n_unsent >= MOST_UNSENT:
            self._open_pages.remove(self)
            self.close(reason="the page does not read")
            return
        try:
            sending = self.write_message(message, binary=isinstance(message, bytes))
        except tornado.websocket.WebSocketClosedError:
            self._open_pages.remove(self)
            return
        self._n_unsent += 1
        sending.add_done_callback(self._note_sent)

    def _note_sent(self, sending: "asyncio.Future[None]") -> None:
        self._n_unsent -= 1
        if not sending.cancelled():
            sending.exception()  # the page is gone, and `on_close` knows


async def serve(newest: NewestState) -> None:
    """Serve scene states until the input has ended. Prints the `StartReply` first."""
    settings, _ = newest.shown
    open_pages = OpenPages(_packets_of(settings))
    has_changed, loop = asyncio.Event(), asyncio.get_running_loop()
    newest.on_change = lambda: loop.call_soon_threadsafe(has_changed.set)
    has_changed.set()  # what came before it was set
    try:
        site = Site(settings, _print_line)
    except RunError as error:
        _print_line(StartReply(error=str(error)))
        return
    reply = _start(site, open_pages, settings.port)
    _print_line(reply)
    if reply.error:
        return
    while True:
        has_ended = newest.has_ended.is_set()
        begun, state = newest.shown
        if begun is not settings:
            settings = begun
            site.begin(settings)
            open_pages.begin(_packets_of(settings))
        open_pages.add_forces(newest.take_forces())
        open_pages.show(state)
        if state is not None and state.live is not None and state.live.run.results is not None:
            results = state.live.run.results
            site.files = {
                name: Path(path)
                for name, path in (("replay", results.replay), ("report", results.report))
                if path
            }
        if has_ended:
            break
        await has_changed.wait()
        has_changed.clear()
    await open_pages.wait_until_drawn()


def _packets_of(settings: ViewerSettings) -> ScenePackets:
    """Return what makes the packets of a run."""
    return ScenePackets(
        settings.shapes,
        settings.frame,
        wireframe=settings.wireframe,
        views=settings.views,
        look=settings.look,
        is_drawn_on=settings.choices is not None,
    )


def _print_line(message: StartReply | Command | Wanted) -> None:
    """Send a message to the run."""
    print(msgspec.json.encode(message).decode(), flush=True)


def _start(site: Site, open_pages: OpenPages, port: int | None) -> StartReply:
    """Start to serve the page, and return its address, or why it cannot be served."""
    application = tornado.web.Application(
        websocket_ping_interval=SECONDS_TO_ANSWER,
        websocket_ping_timeout=SECONDS_TO_ANSWER,
        websocket_max_message_size=LARGEST_MESSAGE,
    )
    application.add_handlers(
        OWN_NAMES,
        [
            (r"/", PageRequest, {"site": site}),
            (r"/(replay|report)", FileRequest, {"site": site}),
            (
                r"/frames",
                PageSocket,
                {
                    "open_pages": open_pages,
                    "colouring": Colouring(_print_line),
                    "leading": site.leading,
                },
            ),
        ],
    )
    return _listen(LimitedServer(application), port)


def _listen(server: LimitedServer, port: int | None) -> StartReply:
    """Listen on `port`, or on the first free port, and return the address."""
    candidates = range(FIRST_PORT, LAST_PORT + 1) if port is None else [port]
    for candidate in candidates:
        try:
            server.listen(candidate, address=LOOPBACK)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                return StartReply(error=f"cannot listen on port {candidate}: {error.strerror}")
        else:
            return StartReply(url=f"http://{LOOPBACK}:{candidate}/")
    if port is None:
        return StartReply(error=f"all ports from {FIRST_PORT} to {LAST_PORT} are in use")
    return StartReply(error=f"port {port} is in use; choose another port, or none for a free one")


def serve_page() -> None:
    """Run the process that `viewer.Viewer` starts."""
    logging.getLogger("tornado.access").setLevel(logging.ERROR)
    newest = NewestState(pickle.load(sys.stdin.buffer))
    threading.Thread(target=newest.read, args=(sys.stdin.buffer,), daemon=True).start()
    asyncio.run(serve(newest))
    # The thread may be reading. At its own end Python would want the lock of that, and abort.
    os._exit(0)
