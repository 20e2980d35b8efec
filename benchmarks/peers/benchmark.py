"""Other engines in the same rounds as this one: one process each, on one core, with one thread.

Like is compared with like: springs with springs, and tetrahedra under a hyperelastic law with the
same number of force evaluations.
"""

import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import msgspec
import numpy as np
from cyclopts import Parameter

from benchmarks.engine import jittered_block, sizes_up_to
from benchmarks.peers.process import (
    NotInstalledError,
    PeerError,
    PeerProcess,
    PeerTurn,
    body_file,
    last_core,
    start_peer,
)
from benchmarks.timing import Largest, Rounds, TurnWatch
from scalpel_sim.errors import UsageError
from scalpel_sim.validate.speed.measurements import HIGHER, BenchmarkResult, Clock
from scalpel_sim.validate.speed.tables import Rows, compact_table, print_notes, three_digits
from scalpel_sim.validate.speed.watch import SILENT, Watch

if TYPE_CHECKING:
    from rich.console import Console

_SIZES = (5_400, 20_250, 60_000)
"""Sizes of the blocks [tetrahedra]."""
_TURN = 0.25
"""CPU time that a case steps for in each round [s]."""
_NOT_FINITE = "its positions are no longer finite: what it computed is not a motion"
_CLOCK = Clock("CPU of the process", time.process_time)


class EngineCase(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A case of this engine or of another."""

    case: str
    """The case, as the adapter names it."""
    law: str
    """Law of elasticity, damping, and method."""
    evaluations: str
    """Force evaluations in a step; `-` where the method solves a system instead."""
    differs: str
    """Precision, and other differences."""
    engine: str = "ours"
    adapter: str = "ours"
    """Name of the adapter."""


_CASES = msgspec.toml.decode(
    Path(__file__).with_name("cases.toml").read_bytes(), type=dict[str, dict[str, EngineCase]]
)
OURS, PEERS = _CASES["ours"], _CASES["peers"]
OURS_SPRINGS, OURS_SOLID = "springs, Runge-Kutta", "plain neo-Hookean, 1 evaluation"
"""Names of the cases that others are compared with: damped with damped, undamped with undamped."""
UNDAMPED = ", undamped"
"""End of the name of a case without dampers."""
_PACKAGES = {"MuJoCo": "mujoco", "Newton": "newton", "Rapier": "rapier3d"}
"""Package of each engine, as pip names it."""
LIKE_FOR_LIKE = ("MuJoCo flex, Euler", "Newton neo-Hookean")
"""Cases with one evaluation of a hyperelastic law on tetrahedra, as `OURS_SOLID`."""


_ABOUT = (
    "CPU time of the process on one core with one thread, median over all samples. Forces: force "
    f"evaluations in a step. x springs: how many times as long as our '{OURS_SPRINGS}'; x solid: "
    f"as our '{OURS_SOLID}', which is like for like with {' and '.join(map(repr, LIKE_FOR_LIKE))}. "
    "Both are medians of the ratios of each round, damped cases to ours damped, others to ours "
    "undamped. Implicit methods could take longer steps than 1 ms; accuracy for the same cost is "
    "not compared here."
)


class PeerRun(NamedTuple):
    """A case in one body: its turns, in the order of the rounds."""

    name: str
    case: EngineCase
    version: str
    tetrahedra: int
    turns: list[PeerTurn]


def peers(
    *,
    runs: Rounds = 5,
    watch: TurnWatch = SILENT,
    largest: Largest = None,
    python: Path | None = None,
    sizes: Annotated[Sequence[int], Parameter(parse=False)] = _SIZES,
) -> BenchmarkResult:
    """Time MuJoCo flex, Newton and Rapier in turns with this engine, where they are installed.

    Args:
        runs: Rounds; every case has a turn in each.
        watch: Receives the progress.
        largest: Omit larger bodies [tetrahedra].
        python: The Python of an environment that has the engines that this one lacks.
        sizes: Sizes of the bodies [tetrahedra].

    Raises:
        UsageError: there is no such Python, or no body of such a size.
    """
    wanted = sizes_up_to(tuple(sizes), largest)
    pythons = _pythons(python)
    done: list[PeerRun] = []
    rows = Rows("peers", _CLOCK)
    watch.begin(len(wanted) * runs * len(OURS | PEERS))
    for size in wanted:
        done += _run_in_one_body(size, runs, pythons, rows, watch)
    for each in done:
        _add(rows, each, done)
    return BenchmarkResult(rows.measured, rows.skipped, partial(_print, done, rows))


def _print(runs: Sequence[PeerRun], rows: Rows, console: "Console") -> None:
    """Print a table for each size: time of a step, ratios to ours, and what differs."""
    times = {(m.case, m.tetrahedra, m.quantity): m for m in rows.measured}
    for size in sorted({each.tetrahedra for each in runs}):
        title = f"{size:,} tetrahedra: CPU time in ms for a step of 1 ms"
        right = ("forces", "ms", "p95", "p99", "x springs", "x solid")
        table = compact_table(title, ("engine", "what differs"), right)
        for each in (one for one in runs if one.tetrahedra == size):
            step = times[each.name, size, "time"]
            ratios = (times.get((each.name, size, ratio_to(o))) for o in (OURS_SPRINGS, OURS_SOLID))
            table.add_row(
                each.name if each.case.engine != "ours" else f"ours: {each.name}",
                f"{each.case.law}; {each.case.differs}",
                each.case.evaluations,
                *(f"{value:.3g}" for value in (step.median, step.p95, step.p99)),
                *("" if ratio is None else three_digits(ratio.median) for ratio in ratios),
            )
        console.print(table)
    versions = ", ".join(sorted({f"{one.case.engine} {one.version}" for one in runs}))
    print_notes(f"{versions}. {_ABOUT}", rows.skipped, console)


def ratio_to(name: str) -> str:
    """Return the name of the quantity: how many times as long as ours a case takes."""
    return f"times as long as {name}"


def _pythons(python: Path | None) -> list[Path]:
    """Return the Pythons to look for engines in, the given one first."""
    here = Path(sys.executable)
    if python is None:
        return [here]
    if not python.is_file():
        raise UsageError(f"--python is {python}, and there is no such file")
    return [python.absolute(), here]


def _run_in_one_body(
    size: int, n_rounds: int, pythons: Sequence[Path], rows: Rows, watch: Watch
) -> list[PeerRun]:
    """Start every case, and run them in turns; `rows` get what did not run."""
    running: list[tuple[PeerProcess, PeerRun]] = []
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        body = body_file(Path(folder), jittered_block(size))
        for name, case in (OURS | PEERS).items():
            started = _started(name, case, body, pythons)
            if isinstance(started, str):
                rows.skip(name, size, started)
                continue
            stack.enter_context(closing(started))
            running.append((started, PeerRun(name, case, started.version, size, [])))
        for _ in range(n_rounds):
            for process, run in list(running):
                failure = _take_turn(process, run)
                if failure:
                    rows.skip(run.name, size, failure)
                    running.remove((process, run))
                watch.tick(f"{run.name}, {size:,}")
            running.reverse()
    order = list(OURS | PEERS)
    return sorted((run for _, run in running), key=lambda run: order.index(run.name))


def _started(name: str, case: EngineCase, body: Path, pythons: Sequence[Path]) -> PeerProcess | str:
    """Return the process of a case, or why there is none."""
    where = [Path(sys.executable)] if name in OURS else pythons
    try:
        return start_peer(case.adapter, case.case, body, where, last_core())
    except NotInstalledError:
        return (
            f"{case.engine} is not installed here: pip install {_PACKAGES[case.engine]}, or name a "
            "Python that has it with --python FILE"
        )
    except PeerError as error:
        return str(error)


def _take_turn(process: PeerProcess, run: PeerRun) -> str:
    """Run one turn and keep its times; return why it failed, or nothing."""
    try:
        turn = process.turn(_TURN)
    except PeerError as error:
        return str(error)
    if not np.isfinite(turn.moved):
        return _NOT_FINITE
    run.turns.append(turn)
    return ""


def _add(rows: Rows, run: PeerRun, all_runs: Sequence[PeerRun]) -> None:
    """Add the time of a step, and its ratios to our times in the same rounds."""
    case = run.case
    note = f"{case.law}; force evaluations: {case.evaluations}; {case.differs}"
    rows.times(run.name, run.tetrahedra, [turn.seconds for turn in run.turns], note=note)
    damping = UNDAMPED if run.name.endswith(UNDAMPED) else ""
    for name in (OURS_SPRINGS, OURS_SOLID) if case.engine != "ours" else ():
        for ours in all_runs:
            if (ours.name, ours.tetrahedra) != (name + damping, run.tetrahedra):
                continue
            ratios = [
                float(np.median(theirs.seconds) / np.median(of_ours.seconds))
                for theirs, of_ours in zip(run.turns, ours.turns, strict=True)
            ]
            rows.values(
                run.name, run.tetrahedra, ratios, "x", quantity=ratio_to(name), better=HIGHER,
                clock=_CLOCK.name,
            )  # fmt: skip
