"""Random strokes across a body: whether its motion stays stable, and what each frame costs.

Each stroke crosses the organ at a random position, direction, lean, depth and speed, at steps of
1 ms; loose pieces land on a floor.
"""

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from benchmarks.timing import TurnWatch
from scalpel_sim import SCENES
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.runs.options import Flag
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.validate.speed.measurements import CPU, BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows, compact_table, print_notes
from scalpel_sim.validate.speed.watch import SILENT
from tissue import (
    BladeSegment,
    BladeSweep,
    Energies,
    Tissue,
    TissueError,
)

if TYPE_CHECKING:
    from rich.console import Console

STROKE_DT = 1e-3
"""Time step of the strokes [s]."""
STROKE_FLOOR = -0.02
"""Height of the floor on which pieces land that the strokes cut off [m]."""
_FASTEST = 5.0
"""Speed of a node above which the motion counts as unstable [m/s]; the blade moves at 0.3."""
_AT_REST = 0.02
"""Speed below which the body counts as at rest [m/s]."""
_CLOSED = 0.01
"""Largest residual of an account that closes, as a share of the work of the blade."""
N_AFTER, N_LAST = 50, 1000
"""Frames without a blade after each stroke, and after the last."""

_ABOUT = (
    "Body and motion after each stroke: the most substeps of a frame, contacts that press and the "
    "deepest of them in um, CPU time of a simulated millisecond, the fastest node in m/s, and the "
    "residual of the account of energy as a share of the work of the blade. Stable: every number "
    "finite, no node much faster than the blade, all at rest within a second of the last stroke."
)


class DoneStroke(NamedTuple):
    """The body after a stroke."""

    tetrahedra: int
    pieces: int
    substeps: int
    """Most substeps of a frame."""
    contacts: int
    """Number of contacts that press."""
    penetration: float
    """Depth of the deepest contact [m]."""
    seconds: float
    """CPU time of a frame, mean over the stroke and the frames after it [s]."""
    fastest: float
    """Largest speed of a node in the stroke [m/s]."""
    energies: Energies | None


def random_strokes(
    *,
    watch: TurnWatch = SILENT,
    strokes: int = 50,
    seed: int = 0,
    relaxation: Literal["global", "verlet", "hierarchical"] | None = None,
    law: Literal["springs", "neo_hookean"] | None = None,
    audit: Flag = False,
) -> BenchmarkResult:
    """Cut the organ by random strokes: stability, contacts, CPU time, account of energy.

    Args:
        watch: Receives the progress.
        strokes: Number of strokes.
        seed: Of their random numbers.
        relaxation: Method of integration [default: that of the scene].
        law: Law of elasticity [default: that of the scene].
        audit: Keep an account of the energy, which must close within 1 % of the work of the blade.
    """
    scene = SCENES["organ"]
    material = scene.material
    if law:
        ratio = 0.45 if law == "neo_hookean" else 0.25
        material = replace(material, law=law, poisson_ratio=ratio)
    scene = changed(
        scene,
        material=material,
        relaxation=relaxation or scene.solver.relaxation,
        audit=audit,
        floor=STROKE_FLOOR,
        table=None,  # strokes come from all sides
    )
    tissue = make_tissue(scene)
    random = np.random.default_rng(seed)
    done: list[DoneStroke] = []
    notes: list[str] = []
    watch.begin(strokes)
    try:
        for i in range(strokes):
            done.append(_stroke(tissue, random))
            watch.tick(f"stroke {i + 1}")
        for _ in range(N_LAST):
            tissue.step(None, STROKE_DT)
        is_stable = max(each.fastest for each in done) < _FASTEST and fastest(tissue) < _AT_REST
    except TissueError as error:
        notes.append(str(error))
        is_stable = False
    motion = "stable" if is_stable else "NOT STABLE"
    notes.append(f"{motion}; fastest node at the end {fastest(tissue):.4f} m/s")
    accounts = [(each.energies, _shares(each.energies)) for each in done if each.energies]
    residual = max((abs(shares["residual"]) for _, shares in accounts), default=0.0)
    for energies, shares in accounts[-1:]:
        terms = ", ".join(f"{name} {1e2 * share:.3f} %" for name, share in shares.items())
        closes = "the account closes" if residual <= _CLOSED else "the account DOES NOT CLOSE"
        notes.append(f"of {1e3 * energies.work_of_blade:.1f} mJ of work of the blade: {terms}")
        notes.append(f"{closes}: within {1e2 * residual:.3f} %")
    return _result(scene, done, notes, is_right=is_stable and residual <= _CLOSED)


def random_stroke(tissue: Tissue, random: np.random.Generator) -> list[BladeSegment]:
    """Return a stroke across the body at a random position, direction, lean, depth and speed.

    One pose of the edge for each time step.
    """
    low, high = tissue.bounds
    centre, extent = (low + high) / 2.0, high - low
    yaw, lean = random.uniform(0.0, 2.0 * np.pi), random.uniform(-0.5, 0.5)
    direction = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    side = np.array([-direction[1], direction[0], 0.0])
    up = np.cos(lean) * np.array([0.0, 0.0, 1.0]) + np.sin(lean) * side
    middle = centre + side * random.uniform(-0.35, 0.35) * extent[:2].min()
    middle[2] = high[2] - random.uniform(0.1, 0.6) * extent[2]
    half = 0.5 * float(np.linalg.norm(extent[:2])) + 0.01
    speed = random.uniform(0.1, 0.3)
    along = np.arange(-half, half, speed * STROKE_DT)
    return [
        BladeSegment(tip, tip + (extent[2] + 0.02) * up, direction)
        for tip in (middle + s * direction for s in along)
    ]


def fastest(tissue: Tissue) -> float:
    """Return the largest speed of a node [m/s]."""
    return float(np.linalg.norm(tissue.snapshot().velocities, axis=1).max())


def _stroke(tissue: Tissue, random: np.random.Generator) -> DoneStroke:
    """Make a random stroke, and the frames after it."""
    began, substeps, speed = CPU.now(), 0, 0.0
    sweeps: list[BladeSweep | None] = [
        BladeSweep(*pair) for pair in itertools.pairwise(random_stroke(tissue, random))
    ]
    sweeps += [None] * N_AFTER
    for i, sweep in enumerate(sweeps, start=1):
        result = tissue.step(sweep, STROKE_DT)
        if sweep is not None:
            substeps = max(substeps, result.n_substeps)
            if i % 20 == 0:
                speed = max(speed, fastest(tissue))
    return DoneStroke(
        tetrahedra=tissue.n_tetrahedra,
        pieces=tissue.n_pieces(),
        substeps=substeps,
        contacts=result.body_contacts.n_contacts,
        penetration=result.body_contacts.penetration,
        seconds=(CPU.now() - began) / len(sweeps),
        fastest=speed,
        energies=result.energies,
    )


def _shares(energies: Energies) -> dict[str, float]:
    """Return the terms of an account and its residual as shares of the work of the blade."""
    terms = {name: getattr(energies, name) for name in (*energies._fields[3:], "residual")}
    return {name: term / energies.work_of_blade for name, term in terms.items()}


def _result(
    scene: Scene, done: list[DoneStroke], notes: list[str], *, is_right: bool
) -> BenchmarkResult:
    """Return the outcome: a row for each stroke, and the judgement."""
    right = (
        "stroke",
        "tetrahedra",
        "pieces",
        "substeps",
        "contacts",
        "deepest",
        "CPU ms",
        "fastest",
    )

    def show(console: "Console") -> None:
        title = f"organ, law {scene.material.law.name}, relaxation {scene.solver.relaxation}"
        table = compact_table(title, (), (*right, *("residual %",) * scene.solver.audit))
        for i, each in enumerate(done, start=1):
            row = [*map(str, (i, *each[:4])), f"{1e6 * each.penetration:.0f}"]
            row += [f"{1e3 * each.seconds:.2f}", f"{each.fastest:.2f}"]
            if each.energies is not None:
                row.append(f"{1e2 * _shares(each.energies)['residual']:.3f}")
            table.add_row(*row)
        console.print(table)
        for note in notes:
            console.print(note, highlight=False)
        print_notes(_ABOUT, (), console)

    rows = Rows("random-strokes", CPU)
    if done:
        rows.times("mean frame", done[0].tetrahedra, [np.array([each.seconds for each in done])])
    return BenchmarkResult(rows.measured, [], show, is_right)
