"""Which of the open pages leads the blade, and what it may say."""

import hmac
import time
from collections.abc import Callable
from typing import Protocol

import msgspec

from scalpel_sim.hands.commands import (
    LONGEST_SILENCE,
    Command,
    Engage,
    Lead,
    Release,
    command_of,
)

MESSAGES_PER_SECOND = 300.0
"""Number of messages that a page may send in a second, on average: a mouse sends at most 125, a
page that draws sixty pictures a second some sixty of each kind."""

MOST_AT_ONCE = 100.0
"""Number of messages that may come at once, after the page's thread has hung for a moment."""


def is_own_page(host: str, origin: str | None) -> bool:
    """Return whether a page came from this server, by what its browser says.

    Args:
        host: Name and port by which it requested this server.
        origin: Where its browser says that the page came from; None where it says nothing.
    """
    return origin is not None and hmac.compare_digest(
        origin.lower().encode(), f"http://{host}".lower().encode()
    )


class LeadingPage(Protocol):
    """A page that may lead."""

    def say(self, text: str) -> None:
        """Send a text to the page."""


class Leadership:
    """Passes on what the page that leads says, and drops all else.

    The first page that comes leads. Another may take over once that one has released the blade or
    has been closed.

    Args:
        token: What a page must know to lead; it is in the document that this server sends.
        pass_on: Receives the commands.
        clock: Wall time [s].
    """

    def __init__(
        self,
        token: str,
        pass_on: Callable[[Command], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.n_dropped = 0
        """Number of messages that were dropped: no commands, too large, too many, or of a page that
        does not lead."""
        self._token, self._pass_on, self._clock = token, pass_on, clock
        self._pages: dict[LeadingPage, _Allowance] = {}
        self._leader: LeadingPage | None = None
        self._is_engaged, self._heard_at = False, 0.0

    def may_lead(self, host: str, origin: str | None, token: str) -> bool:
        """Return whether a page came from this server: by what its browser says, and by its token.

        Args:
            host: Name and port by which it requested this server.
            origin: Where its browser says that the page came from; None where it says nothing.
            token: What it gave as the token.
        """
        is_ours = is_own_page(host, origin)
        return is_ours and hmac.compare_digest(token.encode(), self._token.encode())

    def add(self, page: LeadingPage) -> None:
        """Add a page."""
        self._pages[page] = _Allowance(self._clock())
        self._leader = self._leader or page
        self._tell()

    def remove(self, page: LeadingPage) -> None:
        """Forget a page that was closed; if it led, the hand releases."""
        if self._pages.pop(page, None) is None:
            return
        if page is self._leader:
            self._pass_on(Release())
            self._leader, self._is_engaged = None, False
        self._tell()

    def receive(self, page: LeadingPage, message: str | bytes) -> None:
        """Obey a message of a page, if the page may send it."""
        allowance = self._pages.get(page)
        command = None
        if allowance is not None and allowance.has_room(self._clock()):
            command = command_of(message)
        if isinstance(command, Lead) and self._is_free:
            self._pass_on(Release())
            self._leader, self._is_engaged = page, False
            self._tell()
        elif command is None or page is not self._leader or isinstance(command, Lead):
            self.n_dropped += 1
        else:
            self._heard_at = self._clock()
            if isinstance(command, Engage | Release):
                self._is_engaged = isinstance(command, Engage)
            self._pass_on(command)

    @property
    def _is_free(self) -> bool:
        """Whether another page may take over."""
        is_silent = self._clock() - self._heard_at > LONGEST_SILENCE
        return self._leader is None or not self._is_engaged or is_silent

    def _tell(self) -> None:
        """Inform all pages whether they lead."""
        for page in list(self._pages):
            page.say(msgspec.json.encode({"leads": page is self._leader}).decode())


class _Allowance:
    """Number of messages that a page may still send: a bucket that fills at a constant rate."""

    def __init__(self, now: float) -> None:
        self._room, self._at = MOST_AT_ONCE, now

    def has_room(self, now: float) -> bool:
        """Return whether a message may come now, and count it."""
        self._room = min(MOST_AT_ONCE, self._room + (now - self._at) * MESSAGES_PER_SECOND)
        self._at = now
        if self._room < 1.0:
            return False
        self._room -= 1.0
        return True
