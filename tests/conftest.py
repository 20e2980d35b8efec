"""Fixtures and options shared by the tests of several packages."""

from tests.battery import (
    pytest_addoption,
    pytest_collection_modifyitems,
    pytest_generate_tests,
    pytest_pyfunc_call,
    pytest_terminal_summary,
)
from tests.browser import browser, tab

__all__ = [
    "browser",
    "tab",
    "pytest_addoption",
    "pytest_collection_modifyitems",
    "pytest_generate_tests",
    "pytest_pyfunc_call",
    "pytest_terminal_summary",
]
