"""Other engines in the same rounds as ours: one process each, on one core, with one thread.

The peers are files in `benchmarks/peers` of the repository, one an engine; what an engine does
differently is said beside its figures. Like is compared with like: springs with springs, and
tetrahedra under a hyperelastic law with the same number of force evaluations.
"""

import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.bench.blocks import block_mesh, edges_of, held, up_to
from scalpel_sim.bench.engine import DENSITY, DT, LAWS, POISSON_RATIO, STIFFNESS, material
from scalpel_sim.bench.peer_process import (
    FOLDER,
    Failed,
    NotInstalled,
    PeerProcess,
    Turn,
    core_to_use,
    started,
)
from scalpel_sim.bench.results import HIGHER, Figure, Findings, Skipped, of_times, of_values
from scalpel_sim.bench.tables import compact, number, print_skipped
from scalpel_sim.bench.watch import SILENT, Watch
from scalpel_sim.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

_SIZES = (5_400, 20_250, 60_000)
"""Of the blocks [tetrahedra]."""
_TURN = 0.25
"""How long a case steps in each round [s of CPU time]."""
NOT_FINITE = "its positions are no longer finite: what it computed is not a motion"
_MS_PER_S = 1e3
CLOCK = "CPU of the process"


class _Entry(NamedTuple):
    """A case of ours or of a peer."""

    engine: str
    script: str
    case: str
    """As the script knows it."""
    law: str
    """Law and method."""
    evaluations: str
    """Of forces in a step; `-` where it solves a system."""
    differs: str
    """Precision, and what else to know."""
    install: str = ""
    """What brings it."""


OURS_SPRINGS, OURS_SOLID = "springs, Runge-Kutta", "plain neo-Hookean, 1 evaluation"
"""What others are compared with: damped with damped, undamped with undamped."""
_UNDAMPED = ", undamped"
"""End of the name of a case without dampers."""

_RKN, _EULER = "Runge-Kutta-Nystroem", "symplectic Euler"
_AVERAGED = "f64; averaged dilatation"

OURS = {
    OURS_SPRINGS: _Entry(
        "ours", "ours.py", "springs:runge_kutta:damped", f"springs, damped; {_RKN}", "3",
        "f64; dampers four times a step",
    ),
    OURS_SPRINGS + _UNDAMPED: _Entry(
        "ours", "ours.py", "springs:runge_kutta:undamped", f"springs, no damping; {_RKN}", "3",
        "f64",
    ),
    "springs, 1 evaluation": _Entry(
        "ours", "ours.py", "springs:euler:damped", f"springs, damped; {_EULER}", "1",
        "f64; for comparison only",
    ),
    OURS_SOLID: _Entry(
        "ours", "ours.py", "neo_hookean:euler:damped:plain", f"neo-Hookean, damped; {_EULER}", "1",
        "f64; for comparison only",
    ),
    OURS_SOLID + _UNDAMPED: _Entry(
        "ours", "ours.py", "neo_hookean:euler:undamped:plain",
        f"neo-Hookean, no damping; {_EULER}", "1", "f64; for comparison only",
    ),
    "neo-Hookean, 1 evaluation": _Entry(
        "ours", "ours.py", "neo_hookean:euler:damped", f"neo-Hookean, damped; {_EULER}", "1",
        f"{_AVERAGED}; for comparison only",
    ),
    "neo-Hookean, Runge-Kutta": _Entry(
        "ours", "ours.py", "neo_hookean:runge_kutta:damped", f"neo-Hookean, damped; {_RKN}", "3",
        f"{_AVERAGED}; dampers four times a step",
    ),
}  # fmt: skip

_MUJOCO, _NEWTON, _RAPIER = (f"pip install {name}" for name in ("mujoco", "newton", "rapier3d"))
_KIRCHHOFF = "St. Venant-Kirchhoff"

PEERS = {
    "MuJoCo flex, Euler": _Entry(
        "MuJoCo", "mujoco_flex.py", "Euler:damped", f"{_KIRCHHOFF}, damped; Euler", "1",
        "f64; the whole of mj_step, contact off", _MUJOCO,
    ),
    "MuJoCo flex, Euler" + _UNDAMPED: _Entry(
        "MuJoCo", "mujoco_flex.py", "Euler:undamped", f"{_KIRCHHOFF}, no damping; Euler", "1",
        "f64; the whole of mj_step, contact off", _MUJOCO,
    ),
    "MuJoCo flex, RK4": _Entry(
        "MuJoCo", "mujoco_flex.py", "RK4:damped", f"{_KIRCHHOFF}, damped; Runge-Kutta 4", "4",
        "f64; the whole of mj_step, contact off", _MUJOCO,
    ),
    "MuJoCo flex, discrete": _Entry(
        "MuJoCo", "mujoco_flex.py", "discrete:damped", f"{_KIRCHHOFF}, damped; implicit", "-",
        "f64; could take longer steps; contact off", _MUJOCO,
    ),
    "Newton springs": _Entry(
        "Newton", "newton_semi_implicit.py", "springs:damped", f"springs, damped; {_EULER}", "1",
        "f32; contact and particle grid off", _NEWTON,
    ),
    "Newton springs" + _UNDAMPED: _Entry(
        "Newton", "newton_semi_implicit.py", "springs:undamped", f"springs, no damping; {_EULER}",
        "1", "f32; contact and particle grid off", _NEWTON,
    ),
    "Newton neo-Hookean": _Entry(
        "Newton", "newton_semi_implicit.py", "neo_hookean:damped",
        f"neo-Hookean, damped; {_EULER}", "1", "f32; contact and particle grid off", _NEWTON,
    ),
    "Rapier springs": _Entry(
        "Rapier", "rapier_soft.py", "springs", "distance constraints; 1 iteration", "-",
        "f32; its softness; 1 iteration: its default is 4; collision off", _RAPIER,
    ),
    "Rapier constraints": _Entry(
        "Rapier", "rapier_soft.py", "constraints", "neo-Hookean; 1 iteration", "-",
        "f32; could take longer steps; 1 iteration: its default is 4; collision off", _RAPIER,
    ),
    "Rapier finite elements": _Entry(
        "Rapier", "rapier_soft.py", "fem", "neo-Hookean; conjugate gradient", "-",
        "f32; could take longer steps; 1 substep: its default is 4; collision off", _RAPIER,
    ),
}  # fmt: skip

LIKE_FOR_LIKE = ("MuJoCo flex, Euler", "Newton neo-Hookean")
"""One evaluation of a hyperelastic law on tetrahedra, as OURS_SOLID."""


class Ran(NamedTuple):
    """A case in one body: its turns, in the order of the rounds."""

    name: str
    entry: _Entry
    version: str
    tetrahedra: int
    turns: list[Turn]

    @property
    def median(self) -> float:
        """Of a step [s]."""
        return float(np.median(np.concatenate([turn.seconds for turn in self.turns])))


def measure(
    n_rounds: int,
    largest: int | None = None,
    python: Path | None = None,
    watch: Watch = SILENT,
    sizes: Sequence[int] = _SIZES,
) -> Findings:
    """Let all cases step in turns, in each body up to the largest.

    Args:
        n_rounds: Rounds; every case has a turn in each.
        largest: Body to stop at [tetrahedra].
        python: Of an environment that has the peers that this one has not.
        watch: Is told.
        sizes: Of the bodies.

    Raises:
        UsageError: there is no such Python, or the peers' files are not there.
    """
    sizes = up_to(tuple(sizes), largest)
    pythons = _pythons(python)
    if not (FOLDER / "protocol.py").is_file():
        raise UsageError(
            f"the peers are files of the repository, and there is no {FOLDER}: run this from a "
            "clone of it"
        )
    ran: list[Ran] = []
    skipped: list[Skipped] = []
    watch.begin(len(sizes) * n_rounds * len(OURS | PEERS))
    for size in sizes:
        of_size, left_out = _in_one_body(size, n_rounds, pythons, watch)
        ran += of_size
        skipped += left_out
    figures = [figure for each in ran for figure in _figures(each, ran)]
    return Findings(figures, skipped, partial(print_peers, ran, figures, skipped))


def print_peers(
    ran: Sequence[Ran],
    figures: Sequence[Figure],
    skipped: Sequence[Skipped],
    console: "Console",
) -> None:
    """Print a table for each size: ours, theirs, how many times as long, and what differs."""
    times = {(f.case, f.tetrahedra, f.quantity): f for f in figures}
    for size in sorted({each.tetrahedra for each in ran}):
        table = compact(f"{size:,} tetrahedra: ms of CPU for a step of 1 ms")
        table.add_column("engine")
        table.add_column("what differs")
        for heading in ("forces", "ms", "p95", "p99", "x springs", "x solid"):
            table.add_column(heading, justify="right")
        for each in (one for one in ran if one.tetrahedra == size):
            step = times[each.name, size, "time"]
            ratios = (times.get((each.name, size, ratio_to(o))) for o in (OURS_SPRINGS, OURS_SOLID))
            table.add_row(
                each.name if each.entry.engine != "ours" else f"ours: {each.name}",
                f"{each.entry.law}; {each.entry.differs}",
                each.entry.evaluations,
                *(f"{value:.3g}" for value in (step.median, step.p95, step.p99)),
                *("" if ratio is None else number(ratio.median) for ratio in ratios),
            )
        console.print(table)
    print_skipped(skipped, console)
    versions = ", ".join(sorted({f"{one.entry.engine} {one.version}" for one in ran}))
    console.print(
        f"{versions}. CPU time of the process, one core, one thread, median over all samples. "
        f"Forces: evaluations in a step. x springs: times as long as our '{OURS_SPRINGS}'; x "
        f"solid: as our '{OURS_SOLID}', like for like with {' and '.join(LIKE_FOR_LIKE)}; medians "
        "of the ratios of each round, damped cases to ours damped, others to ours undamped. "
        "Implicit peers could take longer steps than 1 ms; accuracy for the cost is not compared "
        "here.",
        style="dim",
    )


def _pythons(python: Path | None) -> list[Path]:
    """Return the environments to look in, the given one first."""
    here = Path(sys.executable)
    if python is None:
        return [here]
    if not python.is_file():
        raise UsageError(f"--python is {python}, and there is no such file")
    return [python.absolute(), here]


def _in_one_body(
    size: int, n_rounds: int, pythons: Sequence[Path], watch: Watch
) -> tuple[list[Ran], list[Skipped]]:
    """Start every case, and let them step in turns; return what they did, and what did not run."""
    skipped = [
        Skipped("peers", name, size, "the engine does not have this law yet")
        for name, entry in OURS.items()
        if entry.case.partition(":")[0] not in LAWS
    ]
    left_out = {each.case for each in skipped}
    running: list[tuple[PeerProcess, Ran]] = []
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        body = _body_file(Path(folder), size)
        for name, entry in (OURS | PEERS).items():
            if name in left_out:
                continue
            is_ours = entry.engine == "ours"
            environments = [Path(sys.executable)] if is_ours else pythons
            try:
                process = started(entry.script, entry.case, body, environments, core_to_use())
            except NotInstalled:
                reason = f"{entry.engine} is not installed here: {entry.install}, or --python FILE"
                skipped.append(Skipped("peers", name, size, reason))
                continue
            except Failed as error:
                skipped.append(Skipped("peers", name, size, str(error)))
                continue
            stack.enter_context(closing(process))
            running.append((process, Ran(name, entry, process.version, size, [])))
        for _ in range(n_rounds):
            for process, ran in list(running):
                try:
                    turn = process.turn(_TURN)
                    failure = "" if np.isfinite(turn.moved) else NOT_FINITE
                except Failed as error:
                    failure = str(error)
                if failure:
                    skipped.append(Skipped("peers", ran.name, size, failure))
                    running.remove((process, ran))
                else:
                    ran.turns.append(turn)
                watch.tick(f"{ran.name}, {size:,}")
            running.reverse()
    order = list(OURS | PEERS)
    return sorted((ran for _, ran in running), key=lambda ran: order.index(ran.name)), skipped


def _figures(ran: Ran, all_of_them: Sequence[Ran]) -> list[Figure]:
    """Return the time of a step, and its ratios to ours in the same rounds."""
    entry = ran.entry
    note = f"{entry.law}; evaluations of forces: {entry.evaluations}; {entry.differs}"
    figures = [
        of_times(
            "peers", ran.name, ran.tetrahedra, "time", "ms", [t.seconds for t in ran.turns],
            clock=CLOCK, convert=lambda s: _MS_PER_S * s, note=note,
        )
    ]  # fmt: skip
    damping = _UNDAMPED if ran.name.endswith(_UNDAMPED) else ""
    for name in (OURS_SPRINGS, OURS_SOLID):
        for ours in all_of_them:
            if (ours.name, ours.tetrahedra) != (name + damping, ran.tetrahedra):
                continue
            ratios = [
                float(np.median(theirs.seconds) / np.median(of_ours.seconds))
                for theirs, of_ours in zip(ran.turns, ours.turns, strict=True)
            ]
            if entry.engine != "ours":
                figures.append(
                    of_values(
                        "peers", ran.name, ran.tetrahedra, ratio_to(name), "x", ratios,
                        clock=CLOCK, better=HIGHER,
                    )
                )  # fmt: skip
    return figures


def ratio_to(name: str) -> str:
    """Return the quantity that tells how many times as long as ours a case takes."""
    return f"times as long as {name}"


def _body_file(folder: Path, size: int) -> Path:
    """Write the block for the other processes."""
    mesh = block_mesh(size)
    edges = edges_of(mesh)
    file = folder / "body.npz"
    np.savez(
        file,
        positions=mesh.positions,
        tetrahedra=mesh.tetrahedra.astype(np.int32),
        edges=edges.nodes,
        stiffness=STIFFNESS * edges.volumes / edges.lengths**2,
        masses=DENSITY * edges.node_volumes,
        held=np.flatnonzero(held(mesh)),
        young_modulus=STIFFNESS,
        poisson_ratio=POISSON_RATIO["neo_hookean"],
        retardation_time=material("springs").retardation_time,
        dt=DT,
    )
    return file
