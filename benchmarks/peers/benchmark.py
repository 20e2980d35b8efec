"""Other engines in the same rounds as this one: one process each, on one core, with one thread.

`peer_cases` lists what runs, `peer_process` runs it.
"""

import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from benchmarks.blocks import held_nodes, jittered_block, measured_edges, sizes_up_to
from benchmarks.engine import (
    DENSITY,
    FRAME_DT,
    POISSON_RATIO,
    YOUNG_MODULUS,
    block_material,
)
from benchmarks.peers.cases import (
    LIKE_FOR_LIKE,
    OURS,
    OURS_SOLID,
    OURS_SPRINGS,
    PEERS,
    UNDAMPED,
    EngineCase,
)
from benchmarks.peers.process import (
    NotInstalledError,
    PeerError,
    PeerProcess,
    PeerTurn,
    last_core,
    start_peer,
)
from scalpel_sim.bench.peers.protocol import PeerBody, write_body
from scalpel_sim.errors import UsageError
from scalpel_sim.validate.speed.measurements import (
    HIGHER,
    BenchmarkResult,
    Measurement,
    Quantity,
    Skipped,
    summarise_times,
    summarise_values,
)
from scalpel_sim.validate.speed.tables import compact_table, print_skipped, three_digits
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import TetrahedralMesh

if TYPE_CHECKING:
    from rich.console import Console

_SIZES = (5_400, 20_250, 60_000)
"""Sizes of the blocks [tetrahedra]."""
_TURN = 0.25
"""CPU time that a case steps for in each round [s]."""
_NOT_FINITE = "its positions are no longer finite: what it computed is not a motion"
_MS_PER_S = 1e3
_CLOCK = "CPU of the process"


class PeerRun(NamedTuple):
    """A case in one body: its turns, in the order of the rounds."""

    name: str
    case: EngineCase
    version: str
    tetrahedra: int
    turns: list[PeerTurn]


def measure_peers(
    n_rounds: int,
    largest: int | None = None,
    python: Path | None = None,
    watch: Watch = SILENT,
    sizes: Sequence[int] = _SIZES,
) -> BenchmarkResult:
    """Run all cases in turns, in each body up to the largest.

    Args:
        n_rounds: Rounds; every case has a turn in each.
        largest: Largest body [tetrahedra]; None: all sizes.
        python: The Python of an environment with engines that this one lacks.
        watch: Receives the progress.
        sizes: Sizes of the bodies [tetrahedra].

    Raises:
        UsageError: there is no such Python, or no body of such a size.
    """
    wanted = sizes_up_to(tuple(sizes), largest)
    pythons = _pythons(python)
    runs: list[PeerRun] = []
    skipped: list[Skipped] = []
    watch.begin(len(wanted) * n_rounds * len(OURS | PEERS))
    for size in wanted:
        runs_of_size, skipped_of_size = _run_in_one_body(size, n_rounds, pythons, watch)
        runs += runs_of_size
        skipped += skipped_of_size
    measured = [measurement for each in runs for measurement in _measurements(each, runs)]
    return BenchmarkResult(measured, skipped, partial(print_peers, runs, measured, skipped))


def print_peers(
    runs: Sequence[PeerRun],
    measured: Sequence[Measurement],
    skipped: Sequence[Skipped],
    console: "Console",
) -> None:
    """Print a table for each size: time of a step, ratios to ours, and what differs."""
    times = {(m.case, m.tetrahedra, m.quantity): m for m in measured}
    for size in sorted({each.tetrahedra for each in runs}):
        table = compact_table(f"{size:,} tetrahedra: CPU time in ms for a step of 1 ms")
        table.add_column("engine")
        table.add_column("what differs")
        for heading in ("forces", "ms", "p95", "p99", "x springs", "x solid"):
            table.add_column(heading, justify="right")
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
    print_skipped(skipped, console)
    versions = ", ".join(sorted({f"{one.case.engine} {one.version}" for one in runs}))
    console.print(
        f"{versions}. CPU time of the process on one core with one thread, median over all "
        "samples. Forces: force evaluations in a step. x springs: how many times as long as our "
        f"'{OURS_SPRINGS}'; x solid: as our '{OURS_SOLID}', which is like for like with "
        f"{' and '.join(map(repr, LIKE_FOR_LIKE))}. Both are medians of the ratios of each "
        "round, damped cases to ours damped, others to ours undamped. Implicit methods could take "
        "longer steps than 1 ms; accuracy for the same cost is not compared here.",
        style="dim",
    )


def ratio_to(name: str) -> str:
    """Return the name of the quantity: how many times as long as ours a case takes."""
    return f"times as long as {name}"


def body_file(folder: Path, mesh: TetrahedralMesh) -> Path:
    """Write a block for the other processes; return the file."""
    edges = measured_edges(mesh)
    file = folder / "body.npz"
    body = PeerBody(
        positions=mesh.positions,
        tetrahedra=mesh.tetrahedra.astype(np.int32),
        edges=edges.nodes,
        stiffness=YOUNG_MODULUS * edges.volumes / edges.lengths**2,
        masses=DENSITY * edges.node_volumes,
        held=np.flatnonzero(held_nodes(mesh)),
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO["neo_hookean"],
        retardation_time=block_material("springs").retardation_time,
        dt=FRAME_DT,
    )
    write_body(str(file), body)
    return file


def _pythons(python: Path | None) -> list[Path]:
    """Return the Pythons to look for engines in, the given one first."""
    here = Path(sys.executable)
    if python is None:
        return [here]
    if not python.is_file():
        raise UsageError(f"--python is {python}, and there is no such file")
    return [python.absolute(), here]


def _run_in_one_body(
    size: int, n_rounds: int, pythons: Sequence[Path], watch: Watch
) -> tuple[list[PeerRun], list[Skipped]]:
    """Start every case, and run them in turns; return the runs, and what did not run."""
    skipped: list[Skipped] = []
    running: list[tuple[PeerProcess, PeerRun]] = []
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        body = body_file(Path(folder), jittered_block(size))
        for name, case in (OURS | PEERS).items():
            started = _started(name, case, body, pythons)
            if isinstance(started, str):
                skipped.append(Skipped("peers", name, size, started))
                continue
            stack.enter_context(closing(started))
            running.append((started, PeerRun(name, case, started.version, size, [])))
        for _ in range(n_rounds):
            for process, run in list(running):
                failure = _take_turn(process, run)
                if failure:
                    skipped.append(Skipped("peers", run.name, size, failure))
                    running.remove((process, run))
                watch.tick(f"{run.name}, {size:,}")
            running.reverse()
    order = list(OURS | PEERS)
    return sorted((run for _, run in running), key=lambda run: order.index(run.name)), skipped


def _started(name: str, case: EngineCase, body: Path, pythons: Sequence[Path]) -> PeerProcess | str:
    """Return the process of a case, or why there is none."""
    where = [Path(sys.executable)] if name in OURS else pythons
    try:
        return start_peer(case.adapter, case.case, body, where, last_core())
    except NotInstalledError:
        return (
            f"{case.engine} is not installed here: {case.install}, or name a Python that has it "
            "with --python FILE"
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


def _measurements(run: PeerRun, all_runs: Sequence[PeerRun]) -> list[Measurement]:
    """Return the time of a step, and its ratios to our times in the same rounds."""
    case = run.case
    note = f"{case.law}; force evaluations: {case.evaluations}; {case.differs}"
    time = Quantity("peers", run.name, run.tetrahedra, "time", "ms", _CLOCK, note=note)
    seconds = [turn.seconds for turn in run.turns]
    measured = [summarise_times(time, seconds, lambda s: _MS_PER_S * s)]
    if case.engine == "ours":
        return measured
    damping = UNDAMPED if run.name.endswith(UNDAMPED) else ""
    for name in (OURS_SPRINGS, OURS_SOLID):
        for ours in all_runs:
            if (ours.name, ours.tetrahedra) != (name + damping, run.tetrahedra):
                continue
            ratios = [
                float(np.median(theirs.seconds) / np.median(of_ours.seconds))
                for theirs, of_ours in zip(run.turns, ours.turns, strict=True)
            ]
            ratio = Quantity(
                "peers", run.name, run.tetrahedra, ratio_to(name), "x", _CLOCK, better=HIGHER
            )
            measured.append(summarise_values(ratio, ratios))
    return measured
