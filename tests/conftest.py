"""Fixtures and options shared by the tests of several packages."""

import signal

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

# A shell that starts the tests in the background has Ctrl-C ignored, by their children too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

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
