"""A process that does work which may crash or hang: a test then says so and goes on."""

import faulthandler
import json
import os
import subprocess
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


class Child:
    """A process that answers questions; after a crash, or a hang, the next has another process.

    Args:
        module: A module that calls `answer` when it is run.
        limit: Longest time that an answer may take [s].
    """

    def __init__(self, module: str, limit: float) -> None:
        self._module = module
        self._limit = limit
        self._process: subprocess.Popen[str] | None = None

    def ask(self, **question: Any) -> dict[str, Any]:
        """Return the answer.

        Raises:
            AssertionError: the process raised an exception, crashed, or took too long.
        """
        process = self._process or self._start()
        is_late = threading.Event()
        timer = threading.Timer(self._limit, lambda: (is_late.set(), process.kill()))
        timer.start()
        try:
            process.stdin.write(json.dumps(question) + "\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except BrokenPipeError:
            line = ""
        finally:
            timer.cancel()
        if not line:
            self._process = None
            why = f"took over {self._limit} s" if is_late.is_set() else "crashed"
            self._errors.seek(0)
            raise AssertionError(f"it {why}: exit code {process.wait()}\n{self._errors.read()}")
        reply = json.loads(line)
        assert reply["exception"] is None, reply["exception"]
        return reply["answer"]

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.stdin.close()
            self._process.wait()
            self._process = None

    def _start(self) -> subprocess.Popen[str]:
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115
        self._process = subprocess.Popen(
            [sys.executable, "-m", self._module],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
        )
        return self._process


def answer(function: Callable[..., Any]) -> None:
    """Answer questions from standard input by calling a function, until it ends."""
    faulthandler.enable()
    replies = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what is printed is no reply
    for line in sys.stdin:
        reply: dict[str, Any] = {"answer": None, "exception": None}
        try:
            reply["answer"] = function(**json.loads(line))
        except Exception:
            reply["exception"] = traceback.format_exc()
        replies.write(json.dumps(reply) + "\n")
