"""Which quantities the open pages show as colours, so that a run computes no others."""

from collections.abc import Callable, Hashable

import msgspec

from tissue import SurfaceQuantity

LONGEST_CHOICE = 64
"""Longest message of a page that chooses a quantity [bytes]."""


class Colour(msgspec.Struct, frozen=True, tag="colour", forbid_unknown_fields=True):
    """A page's message: what it shows as colours from now on."""

    quantity: SurfaceQuantity | None
    """None: the tissue as it looks."""


class Wanted(msgspec.Struct, frozen=True, tag="wanted"):
    """A message of the viewer's process to the run: what any page shows."""

    quantities: tuple[SurfaceQuantity, ...]
    """In alphabetical order."""


_colours: msgspec.json.Decoder[Colour] = msgspec.json.Decoder(Colour)
_wanted: msgspec.json.Decoder[Wanted] = msgspec.json.Decoder(Wanted)


def colour_of(message: str | bytes) -> Colour | None:
    """Return the choice in a page's message; None where it is none."""
    if len(message) > LONGEST_CHOICE:
        return None
    try:
        return _colours.decode(message)
    except (msgspec.MsgspecError, UnicodeError, RecursionError):
        return None


def wanted_of(line: bytes) -> Wanted | None:
    """Return what pages show by a line of the viewer's process; None where it says other things."""
    try:
        return _wanted.decode(line)
    except (msgspec.MsgspecError, UnicodeError):
        return None


class Colouring:
    """Keeps what each page shows, and reports to the run where the sum of it changes.

    Args:
        report: Reports it to the run.
    """

    def __init__(self, report: Callable[[Wanted], None]) -> None:
        self._report = report
        self._chosen: dict[Hashable, SurfaceQuantity] = {}
        self._told = Wanted(())

    def choose(self, page: Hashable, colour: Colour) -> None:
        """Note what a page shows."""
        self._chosen.pop(page, None)
        if colour.quantity is not None:
            self._chosen[page] = colour.quantity
        wanted = Wanted(tuple(sorted(set(self._chosen.values()))))
        if wanted != self._told:
            self._told = wanted
            self._report(wanted)

    def remove(self, page: Hashable) -> None:
        """Forget a page that was closed."""
        self.choose(page, Colour(None))
