"""The process behind the live viewer: takes pictures from a pipe, serves them to browsers.

Started by `viewer.Viewer`, which sends pickles down its standard input: first a `Setting`, then
`Picture`s without end. It answers with one line on its standard output, a `Greeting` as JSON, and
ends when its input ends. The pickles never leave the two processes.
"""

import asyncio
import errno
import logging
import pickle
import sys
import threading
from typing import Any

import msgspec
import tornado.web
import tornado.websocket

from scalpel_sim.viewer.messages import UPDATES_PER_SECOND, Greeting, Picture, Setting
from scalpel_sim.viewer.page import live_page
from scalpel_sim.viewer.scene_packets import Stage

LOOPBACK = "127.0.0.1"
"""The only address that is listened at: nobody else on the network is to see or slow the run."""

OWN_NAMES = r"(127\.0\.0\.1|localhost)"
"""Names under which a browser may ask. A web site that makes its own name point here gets a 404."""

FIRST_PORT = 7000
"""Where meshcat begins to look for a free port, too."""
LAST_PORT = 7099

FAREWELL = 1.0
"""How long the last picture may take to reach the pages [s] before the process ends."""

_CAPTION = (
    "Bright red: what the blade has laid open. Blue: the force of each contact. Drag to turn, "
    "scroll to zoom."
)


class Inbox:
    """The newest picture that came down the pipe. Older ones are forgotten unseen."""

    def __init__(self) -> None:
        self.newest: Picture | None = None
        self.has_ended = threading.Event()

    def read(self, pipe: Any) -> None:
        """Take pictures off the pipe until it ends."""
        try:
            while True:
                self.newest = pickle.load(pipe)
        except (EOFError, pickle.UnpicklingError):  # closed, or torn off in the middle
            self.has_ended.set()


class Audience:
    """The open pages, and the packets that each of them is due.

    A page gets a packet only after it has drawn the one before. One that is slow, asleep or stopped
    in a debugger skips pictures; it never makes anything pile up here.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._opening: bytes | None = None
        self._packet: bytes | None = None
        self._seen: Picture | None = None
        self._pages: set[FrameSocket] = set()

    def show(self, picture: Picture | None) -> None:
        """Send a picture to every page that is ready for it, if it is a new one."""
        if picture is None or picture is self._seen:
            return
        if self._opening is None:
            self._opening = self._stage.opening(picture.surface, picture.body_poses)
            for page in self._pages:
                page.send(self._opening)
        self._packet = self._stage.frame(picture.surface, picture.body_poses, picture.readings)
        self._seen = picture
        for page in list(self._pages):
            self.serve(page)

    def admit(self, page: "FrameSocket") -> None:
        """Let a page see the run from now on."""
        self._pages.add(page)
        if self._opening is not None:
            page.send(self._opening)
        self.serve(page)

    def serve(self, page: "FrameSocket") -> None:
        """Send the newest packet to a page that has drawn what it had."""
        if self._packet is not None and page.n_undrawn == 0 and page.last is not self._packet:
            page.last = self._packet
            page.send(self._packet)

    async def farewell(self) -> None:
        """Wait until all pages have drawn the last picture, but not for ever."""
        for _ in range(round(FAREWELL * UPDATES_PER_SECOND)):
            if all(page.n_undrawn == 0 for page in self._pages):
                return
            await asyncio.sleep(1.0 / UPDATES_PER_SECOND)

    def dismiss(self, page: "FrameSocket") -> None:
        """Forget a page that was closed."""
        self._pages.discard(page)


class FrameSocket(tornado.websocket.WebSocketHandler):
    """The connection to one open page."""

    def initialize(self, audience: Audience) -> None:
        """Take part in `audience`."""
        self._audience = audience
        self.n_undrawn = 0
        self.last: bytes | None = None

    def open(self, *_: str, **__: str) -> None:
        """A page was opened."""
        self._audience.admit(self)

    def on_message(self, message: str | bytes) -> None:
        """A page has drawn a packet."""
        self.n_undrawn = max(0, self.n_undrawn - 1)
        self._audience.serve(self)

    def on_close(self) -> None:
        """A page was closed."""
        self._audience.dismiss(self)

    def send(self, packet: bytes) -> None:
        """Send a packet, and remember that the page owes an answer."""
        self.n_undrawn += 1
        try:
            self.write_message(packet, binary=True).add_done_callback(lambda sent: sent.exception())
        except tornado.websocket.WebSocketClosedError:
            self._audience.dismiss(self)


class Page(tornado.web.RequestHandler):
    """The page itself."""

    def initialize(self, document: str) -> None:
        """Serve `document`."""
        self._document = document

    def get(self) -> None:
        """Answer a browser that asks for the page."""
        self.set_header("Cache-Control", "no-store")
        self.write(self._document)


async def serve(setting: Setting, inbox: Inbox) -> None:
    """Serve pictures until the inbox has ended. Prints the greeting first."""
    audience = Audience(Stage(setting.shapes, setting.frame, wireframe=setting.wireframe))
    application = tornado.web.Application()
    document = live_page(setting.title, _CAPTION)
    application.add_handlers(
        OWN_NAMES,
        [(r"/", Page, {"document": document}), (r"/frames", FrameSocket, {"audience": audience})],
    )
    greeting = _listen(application, setting.port)
    print(msgspec.json.encode(greeting).decode(), flush=True)
    if greeting.error:
        return
    while not inbox.has_ended.is_set():
        audience.show(inbox.newest)
        await asyncio.sleep(1.0 / UPDATES_PER_SECOND)
    audience.show(inbox.newest)
    await audience.farewell()


def _listen(application: tornado.web.Application, port: int | None) -> Greeting:
    """Listen at `port`, or at the first free one, and say where."""
    candidates = range(FIRST_PORT, LAST_PORT + 1) if port is None else [port]
    for candidate in candidates:
        try:
            application.listen(candidate, address=LOOPBACK)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                return Greeting(error=f"cannot listen at port {candidate}: {error.strerror}")
        else:
            return Greeting(url=f"http://{LOOPBACK}:{candidate}/")
    if port is None:
        return Greeting(error=f"all ports from {FIRST_PORT} to {LAST_PORT} are in use")
    return Greeting(error=f"port {port} is in use; choose another one, or none to get a free one")


def serve_page() -> None:
    """Be the process that `viewer.Viewer` starts."""
    logging.getLogger("tornado.access").setLevel(logging.ERROR)
    setting = pickle.load(sys.stdin.buffer)
    inbox = Inbox()
    threading.Thread(target=inbox.read, args=(sys.stdin.buffer,), daemon=True).start()
    asyncio.run(serve(setting, inbox))
