"""Other engines in the same rounds as this one: one process each, on one core, with one thread.

Like is compared with like: springs with springs, and tetrahedra under a hyperelastic law with the
same number of force evaluations. Then each engine is taken at its best: the case that takes the
least time among those whose first swing stays near the converged motion.
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
from benchmarks.peers.motion import converged_sag, error_of
from benchmarks.peers.process import (
    NotInstalledError,
    PeerError,
    PeerProcess,
    PeerTurn,
    body_file,
    last_core,
    start_peer,
)
from benchmarks.peers.serving import read_body
from benchmarks.timing import Largest, Rounds, TurnWatch
from scalpel_sim.errors import UsageError
from scalpel_sim.validate.speed.measurements import HIGHER, LOWER, BenchmarkResult, Clock
from scalpel_sim.validate.speed.tables import Rows, compact_table, print_notes, three_digits
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import FloatArray

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

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
    motion: str
    """Law of the converged motion that its sag is compared with."""
    evaluations: str
    """Force evaluations in a step; `-` where the method solves a system instead."""
    differs: str
    """Precision, and other differences."""
    engine: str = "ours"
    adapter: str = "ours"
    """Name of the adapter."""
    steps: tuple[float, ...] = (1.0,)
    """Time steps [ms]."""

    @property
    def is_springs(self) -> bool:
        """Whether the body is one of springs, and not of tetrahedra."""
        return self.motion == "springs"

    @property
    def is_damped(self) -> bool:
        """Whether there are dampers."""
        return "no damping" not in self.law


def _cases() -> dict[str, dict[str, EngineCase]]:
    """Return the cases of this engine and of others, one for each time step, by their names."""
    file = Path(__file__).with_name("cases.toml")
    read = msgspec.toml.decode(file.read_bytes(), type=dict[str, dict[str, EngineCase]])
    return {
        whose: {
            name if step == 1.0 else f"{name}, {step:g} ms": msgspec.structs.replace(
                case, steps=(step,)
            )
            for name, case in cases.items()
            for step in case.steps
        }
        for whose, cases in read.items()
    }


_CASES = _cases()
OURS, PEERS = _CASES["ours"], _CASES["peers"]
OURS_SPRINGS, OURS_SOLID = "springs, Runge-Kutta", "plain neo-Hookean, 1 evaluation"
"""Names of the cases that others are compared with: damped with damped, undamped with undamped."""
UNDAMPED = ", undamped"
"""End of the names of our cases without dampers that others are compared with."""
_PACKAGES = {
    "MuJoCo": "mujoco",
    "Newton": "newton",
    "Rapier": "rapier3d",
    "Genesis": "genesis-world",
}
"""Package of each engine, as pip names it."""
LIKE_FOR_LIKE = ("MuJoCo flex, Euler", "Newton neo-Hookean")
"""Cases with one evaluation of a hyperelastic law on tetrahedra, as `OURS_SOLID`."""

MOST_OFF = 0.1
"""Largest error of the sag of a best case, at any instant of the first swing, over the largest sag:
implicit methods reach it with steps of 1 ms, and not with 2."""

_ABOUT = (
    "CPU time of the process on one core with one thread, median over all samples. Forces: force "
    f"evaluations in a step. x springs: how many times as long as our '{OURS_SPRINGS}'; x solid: "
    f"as our '{OURS_SOLID}', which is like for like with {' and '.join(map(repr, LIKE_FOR_LIKE))}. "
    "Both are medians of the ratios of each round, damped cases to ours damped, others to ours "
    "undamped. off: largest error of the mean sag in the first swing, over its largest, against "
    "the converged motion of the same law."
)


class PeerRun(NamedTuple):
    """A case in one body: its turns, in the order of the rounds."""

    name: str
    case: EngineCase
    version: str
    tetrahedra: int
    off: float
    """Largest error of the sag, over the largest one."""
    turns: list[PeerTurn]

    @property
    def rounds(self) -> list[FloatArray]:
        """Times of a simulated millisecond [s], an array for each round."""
        return [turn.seconds / self.case.steps[0] for turn in self.turns]


def peers(
    *,
    runs: Rounds = 5,
    watch: TurnWatch = SILENT,
    largest: Largest = None,
    python: Path | None = None,
    sizes: Annotated[Sequence[int], Parameter(parse=False)] = _SIZES,
) -> BenchmarkResult:
    """Time MuJoCo flex, Newton, Rapier and Genesis in turns with this engine, where installed.

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
        title = f"{size:,} tetrahedra: CPU time in ms for 1 ms"
        right = ("forces", "ms", "p95", "p99", "x springs", "x solid", "off")
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
                f"{each.off:.1%}",
            )
        console.print(table)
        console.print(_best_table([one for one in runs if one.tetrahedra == size]))
    versions = ", ".join(sorted({f"{one.case.engine} {one.version}" for one in runs}))
    print_notes(f"{versions}. {_ABOUT}", rows.skipped, console)


def best_of(runs: Sequence[PeerRun]) -> list[PeerRun]:
    """Return the fastest accurate case of each engine with springs, and with tetrahedra."""
    best: dict[tuple[str, bool], PeerRun] = {}
    for run in runs:
        what = run.case.engine, run.case.is_springs
        if run.off <= MOST_OFF and (what not in best or _median(run) < _median(best[what])):
            best[what] = run
    return list(best.values())


def _median(run: PeerRun) -> float:
    return float(np.median(np.concatenate(run.rounds)))


def _best_table(runs: Sequence[PeerRun]) -> "Table":
    """Return the table of the best cases, with ratios to our best ones in the same rounds."""
    best = best_of(runs)
    ours = {run.case.is_springs: run for run in best if run.case.engine == "ours"}
    right = ("ms", "off", *(f"x our {kind}" for kind in ("springs", "solid")))
    about = f"each at its best: the least time with at most {MOST_OFF:.0%} off"
    table = compact_table(about, ("engine", "what differs"), right)
    for run in best:
        ratios = (_ratios(run, ours[key]) if key in ours else [] for key in (True, False))
        table.add_row(
            run.name if run.case.engine != "ours" else f"ours: {run.name}",
            f"{run.case.law}; {run.case.differs}",
            f"{1e3 * _median(run):.3g}",
            f"{run.off:.1%}",
            *(three_digits(float(np.median(each))) if each else "" for each in ratios),
        )
    return table


def _ratios(theirs: PeerRun, ours: PeerRun) -> list[float]:
    """Return how many times as long as ours a case took, in each round."""
    rounds = zip(theirs.rounds, ours.rounds, strict=True)
    return [float(np.median(of_them) / np.median(of_us)) for of_them, of_us in rounds]


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
        motions = {case.motion for case in (OURS | PEERS).values()}
        converged = {law: converged_sag(read_body(str(body)), law) for law in motions}
        for name, case in (OURS | PEERS).items():
            started = _started(name, case, body, pythons)
            if isinstance(started, str):
                rows.skip(name, size, started)
                continue
            stack.enter_context(closing(started))
            off = error_of(started.sag, converged[case.motion])
            running.append((started, PeerRun(name, case, started.version, size, off, [])))
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
        dt = 1e-3 * case.steps[0]
        return start_peer(case.adapter, case.case, dt, body, where, last_core())
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
    rows.times(run.name, run.tetrahedra, run.rounds, note=note)
    rows.values(
        run.name, run.tetrahedra, [100.0 * run.off], "%", quantity="error of the sag", better=LOWER
    )
    damping = "" if case.is_damped else UNDAMPED
    for name in (OURS_SPRINGS, OURS_SOLID) if case.engine != "ours" else ():
        for ours in all_runs:
            if (ours.name, ours.tetrahedra) != (name + damping, run.tetrahedra):
                continue
            rows.values(
                run.name, run.tetrahedra, _ratios(run, ours), "x", quantity=ratio_to(name),
                better=HIGHER, clock=_CLOCK.name,
            )  # fmt: skip
