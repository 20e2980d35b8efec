"""Fixtures that tests of several packages share."""

from tests.browser import browser, tab

__all__ = ["browser", "tab"]
