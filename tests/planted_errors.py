"""Plant the errors of `mutants.toml` one by one, and tell which the tests catch.

    python -m tests.planted_errors [name ...]

Each error is a text of one file that is replaced in a copy of the sources. There the tests that
must catch it are run, without the compiler. They must pass before any error is planted.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
COPIED = ("bridge", "scalpel_sim", "tests", "tissue", "pyproject.toml", "README.md")
N_COPIES = 2
"""Errors that are tried at a time, each in a copy of its own."""
LONGEST_PASS = 600.0
"""Seconds after which tests of sources without an error have failed; some 15 s are usual."""
FAILED = 1
"""Exit code of pytest where tests were run, and some failed; others are errors of this list."""


@dataclass(frozen=True)
class Mutant:
    """A planted error."""

    name: str
    """Name of the error."""
    file: str
    """Its file, from the root of the repository."""
    old: str
    """Text that is in the file exactly once."""
    new: str
    """Text in its place."""
    tests: tuple[str, ...]
    """The tests that must catch it, as pytest has them."""
    hangs_after: float = 0.0
    """Seconds after which tests that have not ended have caught it; 0: they must end."""


class Outcome(NamedTuple):
    """Outcome of tests with an error planted."""

    is_caught: bool
    """Whether a test failed."""
    by: str
    """The first test that failed, or why none did."""
    seconds: float
    """Wall time [s]."""


def read_mutants() -> list[Mutant]:
    """Return the list, in its order."""
    rows = tomllib.loads((ROOT / "tests/mutants.toml").read_text("utf-8"))["mutant"]
    return [Mutant(**{**row, "tests": tuple(row["tests"])}) for row in rows]


def planted(mutant: Mutant, source: str) -> str:
    """Return a source with the error in it.

    Raises:
        ValueError: the text to be replaced is not there exactly once.
    """
    n = source.count(mutant.old)
    if n != 1 or mutant.old == mutant.new:
        raise ValueError(f"{mutant.name}: the old text is {n} times in {mutant.file}, not once")
    return source.replace(mutant.old, mutant.new)


def run_tests(copy: Path, tests: tuple[str, ...], limit: float) -> tuple[int, str]:
    """Return the exit code of pytest, and the first test that failed, or its last line.

    Raises:
        subprocess.TimeoutExpired: the tests have not ended within `limit` seconds.
    """
    # No bytecode: it is taken for current where time and size of a source are the same.
    switches = {"NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(copy)}
    command = [sys.executable, "-m", "pytest", "-n0", "-q", "-x", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, "--tb=no", *tests],
        cwd=copy,
        env=os.environ | switches,
        capture_output=True,
        text=True,
        timeout=limit,
    )
    lines = done.stdout.strip().splitlines() or done.stderr.strip().splitlines() or [""]
    failed = [line.split(" - ")[0] for line in lines if line.startswith("FAILED ")]
    return done.returncode, failed[0].split("::", 1)[-1] if failed else lines[-1]


def outcome_of(mutant: Mutant, copy: Path) -> Outcome:
    """Plant an error in a copy of the sources, run its tests, and take it out again."""
    path, began = copy / mutant.file, time.monotonic()
    source = path.read_text("utf-8")
    path.write_text(planted(mutant, source), "utf-8")
    try:
        code, by = run_tests(copy, mutant.tests, mutant.hangs_after or LONGEST_PASS)
        return Outcome(code == FAILED, by, time.monotonic() - began)
    except subprocess.TimeoutExpired:
        by = f"no end within {time.monotonic() - began:.0f} s"
        return Outcome(mutant.hangs_after > 0.0, by, time.monotonic() - began)
    finally:
        path.write_text(source, "utf-8")


def try_all(mutants: list[Mutant], folder: Path) -> list[Outcome]:
    """Return what came of each error, and print it.

    Raises:
        RuntimeError: a test fails without any error.
    """
    free: SimpleQueue[Path] = SimpleQueue()
    for i in range(N_COPIES):
        for name in COPIED:
            of, to = ROOT / name, folder / str(i) / name
            to.parent.mkdir(exist_ok=True)
            copied = shutil.copytree if of.is_dir() else shutil.copy2
            copied(of, to)
        free.put(folder / str(i))

    def tried(mutant: Mutant) -> Outcome:
        copy = free.get()
        try:
            outcome = outcome_of(mutant, copy)
        finally:
            free.put(copy)
        word = "caught" if outcome.is_caught else "SURVIVED"
        print(f"| {mutant.name} | {word} | {outcome.by} | {outcome.seconds:.0f} |", flush=True)
        return outcome

    every = tuple(dict.fromkeys(test for mutant in mutants for test in mutant.tests))
    code, last = run_tests(folder / "0", every, LONGEST_PASS)
    if code != 0:
        raise RuntimeError(f"without an error the tests must pass: {last}")
    print("| error | | by | s |\n|---|---|---|---|")
    with ThreadPoolExecutor(N_COPIES) as pool:
        return list(pool.map(tried, mutants))


def main(names: list[str]) -> int:
    """Try the errors of these names, or all; return how many were not caught."""
    mutants = [each for each in read_mutants() if not names or each.name in names]
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        outcomes = try_all(mutants, Path(folder))
    n = sum(outcome.is_caught for outcome in outcomes)
    print(f"{n} of {len(mutants)} caught, in {time.monotonic() - began:.0f} s")
    return len(mutants) - n


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
