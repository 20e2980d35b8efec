"""What a benchmark found, as a file that another run can be compared with."""

import json
import os
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scalpel_sim.errors import RunError
from scalpel_sim.summary import versions


def results_json(benchmark: str, n_runs: int, rows: Sequence[dict[str, Any]]) -> str:
    """Return the figures with what they depend on, as JSON text."""
    found = {
        "benchmark": benchmark,
        "runs": n_runs,
        "rows": list(rows),
        "machine": {"processor": processor(), "cores": os.cpu_count()},
        "versions": versions(),
    }
    return json.dumps(found, indent=2, allow_nan=False)


def save(path: Path, text: str) -> None:
    """Write a results file.

    Raises:
        RunError: the system refuses.
    """
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose another --save"
        ) from error


def processor() -> str:
    """Return what the processor calls itself."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or platform.machine())
