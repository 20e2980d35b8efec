"""Answers of the live viewer by HTTP: the page, and the replay of a run that has ended."""

import hmac
import secrets
from collections.abc import Callable
from pathlib import Path

import tornado.web

from scalpel_sim.hands.commands import Command
from scalpel_sim.viewer.leading import Leadership
from scalpel_sim.viewer.messages import ViewerSettings
from scalpel_sim.viewer.page import PAGE_HEADERS, live_page, policy_of

_COLOURS = "Bright red: faces of the cut. "
_CAPTION = "Arrow: force on the blade. Blue lines: contact forces, magnified thirty times. "
_HOW_TO_LOOK = "Drag to turn the view, scroll to zoom."
_HOW_TO_LEAD = "Drag with the right button to turn the view."
"""Text below the heading of the live page."""

N_BYTES_OF_TOKEN = 32
"""Random bytes in the token of a page that controls its run: nobody guesses it."""

POLICY_OF_FILES = "sandbox allow-scripts allow-downloads; frame-ancestors 'none'"
"""Policy of replay and report, besides that in the file: it is of no origin, so that no script that
somebody puts into the file can lead a run."""


class Site:
    """The document of the page, and who may control the run that it shows.

    Args:
        settings: Those of the first run.
        pass_on: Receives the commands of the page that leads.

    Raises:
        RunError: meshcat's viewer was not found.
    """

    def __init__(self, settings: ViewerSettings, pass_on: Callable[[Command], None]) -> None:
        self._token: str | None = None
        self.files: dict[str, Path] = {}
        """The replay and the report of the run, once that has ended."""
        self.leading: Leadership | None = None
        """Which page controls the run; None: none does."""
        if settings.has_controls:
            self._token = secrets.token_urlsafe(N_BYTES_OF_TOKEN)
            self.leading = Leadership(self._token, pass_on)
        self.begin(settings)

    def begin(self, settings: ViewerSettings) -> None:
        """Serve the page of a run."""
        self.files = {}
        how = _HOW_TO_LEAD if settings.is_led else _HOW_TO_LOOK
        self.document = live_page(
            settings.title,
            ("" if settings.look.labels else _COLOURS) + _CAPTION + how,
            self._token,
            is_led=settings.is_led,
            choices=settings.choices,
        )

    def knows(self, token: str) -> bool:
        """Return whether a token is that of the page."""
        return self._token is not None and hmac.compare_digest(self._token.encode(), token.encode())


class SiteRequest(tornado.web.RequestHandler):
    """A browser's request for a document of the site."""

    def initialize(self, site: Site) -> None:
        """Set the site that has the document; called by tornado."""
        self._site = site

    def set_default_headers(self) -> None:
        """Set the headers of every answer; called by tornado."""
        for name, value in PAGE_HEADERS.items():
            self.set_header(name, value)


class PageRequest(SiteRequest):
    """A browser's request for the page."""

    def get(self) -> None:
        """Send the page."""
        # Not every browser takes 'self' for a web socket. Another page must not show this one in a
        # frame, and have its visitor click there.
        policy = policy_of(self._site.document, f"'self' ws://{self.request.host}")
        self.set_header("Content-Security-Policy", f"{policy}; frame-ancestors 'none'")
        self.write(self._site.document)


class FileRequest(SiteRequest):
    """A browser's request for replay or report: for who has the token of the page."""

    def get(self, name: str) -> None:
        """Send the file.

        Args:
            name: Which of them.
        """
        if not self._site.knows(self.get_argument("token", "")):
            raise tornado.web.HTTPError(403)
        try:
            path = self._site.files.get(name)
            content = b"" if path is None else path.read_bytes()
        except OSError:  # it was moved since
            content = b""
        if not content:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.set_header("Content-Security-Policy", POLICY_OF_FILES)
        self.write(content)
