"""Fixtures and options shared by the tests of several packages."""

from tests.battery import (
    pytest_addoption,
    pytest_collection_modifyitems,
    pytest_generate_tests,
    pytest_pyfunc_call,
    pytest_sessionfinish,
    pytest_terminal_summary,
    tally,
)
from tests.browser import browser, tab

__all__ = [
    "browser",
    "tab",
    "tally",
    "pytest_addoption",
    "pytest_collection_modifyitems",
    "pytest_generate_tests",
    "pytest_pyfunc_call",
    "pytest_sessionfinish",
    "pytest_terminal_summary",
]
