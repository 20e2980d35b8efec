"""Fixtures and options shared by the tests of several packages."""

import gc
import signal
import sys

import pytest

from tests.support.battery import (
    pytest_addoption,
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_generate_tests,
    pytest_pyfunc_call,
    pytest_sessionfinish,
    pytest_terminal_summary,
    tally,
)
from tests.support.browser import browser, tab
from tests.support.bytecode import keep_bytecode
from tests.support.egl import renderer
from tests.support.small_disk import small_disks

# A shell that starts the tests in the background has Ctrl-C ignored, by their children too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

KERNELS_AT_IMPORT = pytest.StashKey[list[str]]()
"""Names of the kernels that were called while tests were collected."""

__all__ = [
    "browser",
    "renderer",
    "small_disks",
    "tab",
    "tally",
    "pytest_addoption",
    "pytest_collection_modifyitems",
    "pytest_configure",
    "pytest_generate_tests",
    "pytest_pyfunc_call",
    "pytest_sessionfinish",
    "pytest_terminal_summary",
]


def called_kernels() -> list[str]:
    """Return the names of the kernels that this process has called."""
    parts = sys.modules.get("tissue.core.kernel_parts")
    kernels = [] if parts is None else list(parts._PARTS)
    found = [(getattr(sys.modules[f.__module__], f.__name__, None), f) for f in kernels]
    return [f.__qualname__ for kernel, f in found if getattr(kernel, "overloads", None)]


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile kernels before all tests are run; a part of them compiles what it calls."""
    config = session.config
    are_all = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    is_worker = hasattr(config, "workerinput")
    if are_all and not is_worker and not config.option.collectonly:
        from tests.kernels_ahead import compile_for_all_tests

        keep_bytecode(config)
        compile_for_all_tests(config)


def pytest_collection_finish(session: pytest.Session) -> None:
    """Keep the collected tests and all loaded modules out of Python's search for cycles.

    They live as long as the process; each full search of a million objects takes 0.15 s.
    """
    session.config.stash[KERNELS_AT_IMPORT] = called_kernels()
    gc.collect()
    gc.freeze()


@pytest.fixture
def kernels_at_import(request: pytest.FixtureRequest) -> list[str]:
    """Return the kernels that the import of the tests has called."""
    return request.config.stash[KERNELS_AT_IMPORT]
