"""What a program does when signals come."""

import os
import signal
import time

import pytest

from scalpel_sim.runs import stop_signals
from scalpel_sim.runs.stop_signals import SignalInterrupt, StopSignals

SAME_WISH = 0.2


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    monkeypatch.setattr(stop_signals, "SAME_WISH", SAME_WISH)


def press():
    os.kill(os.getpid(), signal.SIGINT)


def press_later():
    time.sleep(1.5 * SAME_WISH)
    press()


def test_the_first_signal_is_noted_and_a_later_one_is_raised():
    with StopSignals() as stop:
        press()
        assert stop.reason == "interrupted by SIGINT"
        with pytest.raises(SignalInterrupt):
            press_later()


def test_signals_in_a_row_are_one_wish_however_long_the_row():
    with StopSignals() as stop:
        for _ in range(4):
            press()
            time.sleep(0.5 * SAME_WISH)
        assert stop.reason == "interrupted by SIGINT"


def test_a_second_wish_that_comes_twice_is_raised_once():
    with StopSignals():
        press()
        with pytest.raises(SignalInterrupt):
            press_later()
        press()


def test_no_signal_stops_the_writing_of_files_and_the_user_reads_how_to(capfd):
    with StopSignals() as stop:
        stop.is_writing = True
        press()
        press_later()
    assert f"kill -9 {os.getpid()}" in capfd.readouterr().err
