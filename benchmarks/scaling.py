"""The cost of a step, of a cut, and of a frame near a blade, in bodies of very different size.

A step of the whole body grows with the body; its time per tetrahedron shows where the mesh outgrows
each cache. A cut does not: the same slit is cut into blocks of three sizes. `cut` holds every node,
so that the blade meets the same tetrahedra in each block, and times the paper's CD and GC alone:
collision detection, subdivision, separation, and the springs and masses that change. A local frame
is a whole one, in which the paper's hierarchy relaxes what is near the blade and freezes the rest.
`kernels` times the loops of a step one by one, and those of contact.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.engine import (
    BLOCKS,
    CELL,
    FRAME_DT,
    LAW_NAMES,
    N_STAGES,
    PRECISION_OF_LAW,
    BlockCells,
    EngineLoops,
    TouchingBlocks,
    block_material,
    held_nodes,
    jittered_block,
    sizes_up_to,
)
from benchmarks.timing import Case, Largest, Rounds, TurnWatch, time_in_turns
from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.machine import memory_bytes
from scalpel_sim.validate.speed.measurements import CPU, BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import (
    BladeSegment,
    BladeSweep,
    FloatArray,
    Hierarchical,
    Material,
    SolverSettings,
    Tissue,
    block,
)

_SIZES = (576, 6_000, 60_000, 199_800, 600_000, 1_000_188)
"""Sizes of the blocks in which steps are timed [tetrahedra]."""
_LOCAL_SIZES = (6_000, 60_000, 1_000_188)
"""Sizes of the blocks in which local frames are timed [tetrahedra]."""
_KERNEL_SIZES = (576, 5_400, 20_250, 60_000)
"""Sizes of the blocks in which loops are timed [tetrahedra]."""
_TOUCHING_SIZE = 5_400
"""Size of each of the two blocks that touch [tetrahedra]."""
SMALLEST_CUT = 1_080
_CUT_BLOCKS: dict[int, BlockCells] = {
    SMALLEST_CUT: (5, 6, 6),
    10_296: (11, 12, 13),
    101_400: (25, 26, 26),
}
"""Cells of the blocks that are cut, by their number of tetrahedra."""

_ABOVE = 2.0
"""Height of the edge above the upper side [cells]."""
_ASIDE = 0.37
"""Distance of the slit from the planes of the grid [cells]: no part of it runs along existing
faces."""
_TOUGHNESS = 1.0
"""Toughness [J/m2], so low that the blade barely drags the tissue along and cuts where it
passes."""
_MATERIAL = Material(law="springs", poisson_ratio=0.25, toughness=_TOUGHNESS)
_RELAXATION = Hierarchical(updates=64, rings=6, far="frozen")
"""The paper's rings; nodes beyond them do not move."""
RELAXATION_NAME = "hierarchical (I 64, s_max 6)"
"""Name of that relaxation in the tables."""

BYTES_PER_TETRAHEDRON = 2_000
"""Memory that a body takes while it is made; measured, and rounded up."""
SHARE_OF_MEMORY = 0.6
"""Share of the free memory that all bodies together may take: other programs need some too."""

_WHOLE_STEP = "whole step, damped"
"""Name of a Runge-Kutta-Nystroem step of three evaluations and stages, with viscosity."""

_ABOUT = (
    "A whole step evaluates forces three times and viscosity once. Single, double: precision "
    "of the forces. Blocks of jittered cells of 10 mm, held on four sides; one thread; sizes take "
    "turns. CPU: CPU time. A step of the whole body costs the same per tetrahedron until the body "
    "outgrows a cache."
)
_ABOUT_KERNELS = (
    "ns/tet: ns per tetrahedron. Single, double: precision of the forces, as `run` takes it under "
    "the law. Evaluation and stage: a third of a Runge-Kutta-Nystroem step, without viscosity. "
    "Damped: with viscosity; a whole step evaluates forces three times and viscosity "
    "once. Evaluation alone: forces and accelerations in one call, without the stage that "
    "would use them at once. The time step is all that is done in 1 ms without a blade: next to "
    "nothing once the block rests. Blocks of jittered cells of 10 mm, held on four sides; one "
    "thread. CPU: CPU time."
)
_ABOUT_LOCAL = (
    "Whole frames of 1 ms: detection, cut, relaxation, the force on the blade, and the work of "
    "Python. In other frames the blade moves on and splits nothing. CPU time of the thread. "
    "Hierarchical: the paper's relaxation by rings, whose far nodes stay fixed."
)
_ABOUT_CUT = (
    "The same slit in each block: 3.5 x 3.37 cells of 5 mm, 0.25 mm a step. A cut step splits "
    "tetrahedra; its time is CD + GC: collision detection, subdivision, separation, masses and "
    "springs, without relaxation. A split adds one tetrahedron. In other steps the blade moves on "
    "in the tissue and splits nothing."
)


class Slit(NamedTuple):
    """A slit in the middle of the upper side of a block."""

    cell: float
    """Side of a cell of the block [m]."""
    step: float
    """Displacement of the blade in a frame [m]."""
    n_frames: int
    n_entry: int
    """First frames, which are not counted: the edge enters the body."""
    depth: float
    """Depth of the edge below the upper side [cells]."""

    def edge(self, cells: BlockCells, frame: int) -> BladeSegment:
        """Return the upright edge in a frame."""
        x = self.cell * (cells[0] // 2 + _ASIDE)
        y = 0.5 * (self.cell * cells[1] - self.step * self.n_frames) + self.step * frame
        top = self.cell * cells[2]
        return BladeSegment(
            np.array([x, y, top - self.depth * self.cell]),
            np.array([x, y, top + _ABOVE * self.cell]),
            np.array([0.0, 1.0, 0.0]),
        )


CUT_SLIT = Slit(5e-3, 2.5e-4, 70, 0, 3.37)
"""0.25 m/s at 1 kHz, fast for a hand."""
LOCAL_SLIT = Slit(CELL, 7e-4, 40, 3, 1.4)
"""A frame that splits any tetrahedra splits about a dozen."""


class SlitFrames(NamedTuple):
    """Cost of the frames that cut a slit into one block."""

    cut: FloatArray
    """Time of each frame that split tetrahedra [s]."""
    splits: FloatArray
    """Number of tetrahedra that each of those frames split: each split adds one tetrahedron."""
    other: FloatArray
    """Time of each other frame with the blade in the tissue [s]."""


def scaling(
    *, runs: Rounds = 5, watch: TurnWatch = SILENT, largest: Largest = None
) -> list[BenchmarkResult]:
    """Time a step, and a local frame, in bodies of 576 to 1,000,000 tetrahedra."""
    sizes, local_sizes = (sizes_up_to(each, largest) for each in (_SIZES, _LOCAL_SIZES))
    return [measure_steps(runs, sizes, watch), measure_local_frames(runs, local_sizes, watch)]


def kernels(
    *, runs: Rounds = 5, watch: TurnWatch = SILENT, largest: Largest = None
) -> BenchmarkResult:
    """Time forces, steps, a cut step and contact detection in 576 to 60,000 tetrahedra."""
    sizes = sizes_up_to(_KERNEL_SIZES, largest)
    timed = [each for size in sizes for law in LAW_NAMES for each in _loops_of_law(size, law)]
    touching_size = min(_TOUCHING_SIZE, sizes[-1])
    touching = TouchingBlocks(touching_size)
    cases = [case for case, _ in timed] + [
        Case("contact: new search", touching.new_searches, 2 * touching_size),
        Case("contact: search", touching.searches, 2 * touching_size),
        Case("contact: forces of a step", touching.forces, 2 * touching_size),
    ]
    rows = Rows("kernels", CPU)
    taken = time_in_turns(cases, runs, clock=CPU, watch=watch)
    for (case, per), rounds in zip(timed, taken, strict=False):
        rows.times(case.name, case.size, rounds, "ns/tet", per=per)
    for case, rounds in zip(cases[len(timed) :], taken[len(timed) :], strict=True):
        rows.times(case.name, case.size, rounds, "µs")
    rows.measured += cut(runs=runs, watch=watch, largest=SMALLEST_CUT).measurements
    return rows.table("kernels", _ABOUT_KERNELS)


def _loops_of_law(size: int, law: str) -> list[tuple[Case, float]]:
    """Return the loops of a law in the precision of `run`, and by what their times are divided."""
    mesh, precision = jittered_block(size), PRECISION_OF_LAW[law]
    plain = EngineLoops(mesh, law, is_damped=False, precision=precision)
    damped = EngineLoops(mesh, law, precision=precision)
    name = f"{LAW_NAMES[law]}, {precision}"
    return [
        (Case(f"{name}: evaluation and stage", plain.runge_kutta_steps, size), N_STAGES * size),
        (Case(f"{name}: evaluation alone, damped", damped.forces, size), size),
        (Case(f"{name}: {_WHOLE_STEP}", damped.runge_kutta_steps, size), size),
        (Case(f"{name}: time step of 1 ms", damped.frames, size), size),
    ]


def cut(*, runs: Rounds = 5, watch: TurnWatch = SILENT, largest: Largest = None) -> BenchmarkResult:
    """Time a cut step in bodies of 1,000, 10,000 and 100,000 tetrahedra."""
    sizes = sizes_up_to(tuple(_CUT_BLOCKS), largest)
    cut_block(sizes[0])  # loads the kernels and wakes the processor
    rows = Rows("cut")
    for size, slits in _in_turns(sizes, runs, cut_block, watch).items():
        note = f"{slits[0].splits.sum():.0f} split in {len(slits[0].splits)} steps"
        for case, samples in (
            ("cut step", [each.cut for each in slits]),
            ("split tetrahedron", [each.cut / each.splits for each in slits]),
            ("blade moves, nothing split", [each.other for each in slits]),
        ):
            rows.times(case, size, samples, "µs", note=note)
    return rows.table("cost of a cut step", _ABOUT_CUT)


def _in_turns(
    sizes: Sequence[int], n_rounds: int, cut: Callable[[int], SlitFrames], watch: Watch
) -> dict[int, list[SlitFrames]]:
    """Cut a slit into a new block of each size in each round; return the cuts by size."""
    watch.begin(n_rounds * len(sizes))
    rounds: dict[int, list[SlitFrames]] = {size: [] for size in sizes}
    for _ in range(n_rounds):
        for size in sizes:
            rounds[size].append(cut(size))
            watch.tick(f"cut in {size:,} tetrahedra")
    return rounds


def cut_block(n_tetrahedra: int) -> SlitFrames:
    """Cut the slit into a new block whose nodes are all held; return the wall times of CD + GC."""
    cells = _CUT_BLOCKS[n_tetrahedra]
    mesh = block(cells, [CUT_SLIT.cell * n for n in cells])
    held = np.ones(len(mesh.positions), dtype=bool)
    tissue = Tissue(mesh, _MATERIAL, fixed=held, gravity=(0.0, 0.0, 0.0))
    return _cut_slit(CUT_SLIT, tissue, cells, is_whole=False)


def measure_local_frames(
    n_rounds: int, sizes: Sequence[int], watch: Watch = SILENT
) -> BenchmarkResult:
    """Cut a slit into each body in turns, and time whole frames."""
    rows = Rows("local frame", CPU)
    fitting = sizes_that_fit(sizes, memory_bytes(), rows)
    _local_frames(fitting[0])  # loads the kernels
    for size, slits in _in_turns(fitting, n_rounds, _local_frames, watch).items():
        splits = np.mean([each.splits.mean() for each in slits])
        for case, samples, note in (
            ("cut frame", [each.cut for each in slits], f"{splits:.1f} split in a cut frame"),
            ("blade moves, nothing split", [each.other for each in slits], ""),
        ):
            rows.times(f"{RELAXATION_NAME}: {case}", size, samples, "µs", note=note)
    return rows.table("local frame", _ABOUT_LOCAL)


def _local_frames(n_tetrahedra: int) -> SlitFrames:
    """Cut the slit into a new body at rest; return the CPU times of whole frames."""
    mesh = jittered_block(n_tetrahedra)
    tissue = Tissue(
        mesh,
        replace(block_material("springs"), toughness=_TOUGHNESS),
        fixed=held_nodes(mesh),
        gravity=(0.0, 0.0, 0.0),
        solver=SolverSettings(relaxation=_RELAXATION),
    )
    return _cut_slit(LOCAL_SLIT, tissue, BLOCKS[n_tetrahedra], is_whole=True)


def _cut_slit(slit: Slit, tissue: Tissue, cells: BlockCells, *, is_whole: bool) -> SlitFrames:
    """Cut a slit; return the CPU times of whole frames, or the wall times of CD + GC in them."""
    seconds = np.zeros(slit.n_frames)
    sizes = np.full(slit.n_frames + 1, tissue.n_tetrahedra)
    before = slit.edge(cells, 0)
    with no_garbage_collection():
        for i in range(slit.n_frames):
            after = slit.edge(cells, i + 1)
            start = CPU.now()
            result = tissue.step(BladeSweep(before, after), FRAME_DT)
            stages = result.stage_times.collision + result.stage_times.topology
            seconds[i] = CPU.now() - start if is_whole else stages
            sizes[i + 1] = result.n_tetrahedra
            before = after
    splits = np.diff(sizes).astype(np.float64)[slit.n_entry :]
    seconds = seconds[slit.n_entry :]
    return SlitFrames(seconds[splits > 0], splits[splits > 0], seconds[splits == 0])


def measure_steps(n_rounds: int, sizes: Sequence[int], watch: Watch = SILENT) -> BenchmarkResult:
    """Time a Runge-Kutta step at each size, under each law, in the precision of `run`."""
    rows = Rows("scaling", CPU)
    cases: list[Case] = []
    for n in sizes_that_fit(sizes, memory_bytes(), rows, len(LAW_NAMES)):
        for law, name in LAW_NAMES.items():
            precision = PRECISION_OF_LAW[law]
            loops = EngineLoops(jittered_block(n), law, precision=precision)
            cases.append(Case(f"{name}, {precision}: {_WHOLE_STEP}", loops.runge_kutta_steps, n))
    taken = time_in_turns(cases, n_rounds, clock=CPU, watch=watch)
    for (name, _, size), rounds in zip(cases, taken, strict=True):
        rows.times(name, size, rounds, "ns/tet", per=size or 1.0, quantity="time per tetrahedron")
        rows.times(name, size, rounds)
    rows.measured.sort(key=lambda each: (each.case, each.unit, each.tetrahedra))
    return rows.table("scaling", _ABOUT)


def sizes_that_fit(
    sizes: Sequence[int], available: int | None, rows: Rows, n_of_each: int = 1
) -> tuple[int, ...]:
    """Return the sizes whose bodies fit together into the free memory.

    Args:
        sizes: Numbers of tetrahedra, from small to large.
        available: Free memory [bytes]; None where it is unknown: then all sizes fit.
        rows: Rows of the benchmark that makes the bodies; they get why other sizes do not fit.
        n_of_each: Bodies of each size.
    """
    fit: list[int] = []
    for size in sizes:
        needed = BYTES_PER_TETRAHEDRON * n_of_each * (sum(fit) + size)
        if available is None or needed <= SHARE_OF_MEMORY * available:
            fit.append(size)
        else:
            reason = (
                f"together with the smaller bodies it needs {needed / 1e9:.1f} GB, and "
                f"{SHARE_OF_MEMORY:.0%} of the {available / 1e9:.1f} GB of free memory may be used"
            )
            rows.skip(rows.benchmark, size, reason)
    return tuple(fit)
