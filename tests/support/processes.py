"""The program in a process of its own."""

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import sleep
from typing import Any

from scalpel_sim.runs.stop_signals import SIGNALS

PROGRAM = (sys.executable, "-m", "scalpel_sim")


def environment() -> dict[str, str]:
    """Return an environment in which Python finds what this process finds."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}


def start(
    *words: str, stdin: int = subprocess.DEVNULL, program: Sequence[str] = PROGRAM
) -> subprocess.Popen[str]:
    """Start `scalpel-sim` with these words; its output is read by the caller.

    It hears signals also where these tests do not: under `nohup`, in the background of a shell.
    """
    ignored = [each for each in SIGNALS if signal.getsignal(each) is signal.SIG_IGN]
    for each in ignored:
        signal.signal(each, signal.SIG_DFL)
    try:
        return subprocess.Popen(
            [*program, *words],
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(),
        )
    finally:
        for each in ignored:
            signal.signal(each, signal.SIG_IGN)


def free_port() -> int:
    """Return a port at which nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port


@contextmanager
def started_first(example: Path, port: int) -> Iterator[subprocess.Popen[str]]:
    """Start an example before the server that it needs, and yield it once it waits for it."""
    command = [sys.executable, "-I", str(example), str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        try:
            assert "waiting for" in program.stdout.readline()
            yield program
        finally:
            program.kill()


def wait_for_rows(program: subprocess.Popen[str], forces: Path) -> None:
    """Wait until a run has written its first rows."""
    while not (forces.exists() and forces.stat().st_size > 20_000):
        assert program.poll() is None, program.communicate()
        sleep(0.02)


def wait_until_heard(program: subprocess.Popen[Any]) -> None:
    """Wait until the program that was just started handles signals; Python knows SIGINT before."""
    status, bit = Path(f"/proc/{program.pid}/status"), 1 << (signal.SIGTERM - 1)
    while True:
        (mask,) = re.findall(r"^SigCgt:\s*(\w+)", status.read_text(), re.M)
        if int(mask, 16) & bit:
            return
        assert program.poll() is None
        sleep(0.002)
