"""The first run compiles in two processes; the first loads what the second compiled."""

import subprocess
import sys

import pytest

from scalpel_sim import warm_up


@pytest.fixture
def started(monkeypatch):
    """The processes that a warm-up starts, on a machine that seems to have compiled nothing."""
    processes = []

    class RecordedProcess(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            processes.append(self)

    monkeypatch.setattr(subprocess, "Popen", RecordedProcess)
    monkeypatch.setattr(warm_up, "kernels_are_compiled", lambda: False)
    return processes


def test_a_first_run_compiles_in_another_process_too_and_waits_for_it(started):
    warm_up.warm_up()
    assert [process.args for process in started] == [[sys.executable, "-m", "scalpel_sim.warm_up"]]
    assert started[0].returncode == 0


def test_a_first_run_that_is_interrupted_leaves_no_process_behind(started, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(warm_up.Tissue, "incise", interrupted)
    with pytest.raises(KeyboardInterrupt):
        warm_up.warm_up()
    assert started[0].returncode is not None


def test_a_later_run_starts_none(started, monkeypatch):
    monkeypatch.setattr(warm_up, "kernels_are_compiled", lambda: True)
    warm_up.warm_up()
    assert not started
