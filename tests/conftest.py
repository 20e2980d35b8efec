"""Fixtures shared by the tests of several packages."""

from tests.browser import browser, tab

__all__ = ["browser", "tab"]
