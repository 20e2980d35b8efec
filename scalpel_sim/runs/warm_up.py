"""Compiles the kernels that scenes need, in several processes, and loads them.

    python -m scalpel_sim.runs.warm_up motion|cut|all KERNELS...

is one of the processes; each of KERNELS is a `KernelSet` as JSON.
"""

import gc
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bridge import TissueFrame, compiled_arithmetic
from scalpel_sim.arm.arm import Arm
from scalpel_sim.arm.collision_monitor import CollisionMonitor
from scalpel_sim.instruments.line_pursuit import pursue
from scalpel_sim.instruments.stroke_follower import NO_SHIFT, StrokeFollower
from scalpel_sim.recording.columns import COLUMNS, FrameData, WallTimes, force_parts, frame_row
from scalpel_sim.recording.recording import Recording
from scalpel_sim.recording.row_writer import RowWriter
from scalpel_sim.runs.stop_signals import SignalInterrupt, StopSignals
from scalpel_sim.scene.read import PARENCHYMA, PHANTOM
from scalpel_sim.scene.scene import Scene
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.viewer.charts import charts_of
from tissue import (
    BladeSegment,
    BladeShape,
    BladeSweep,
    Geom,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    fixed_nodes,
)
from tissue.support import LEVELS, bundled, cache_directory, is_compiling, n_compiled_kernels

_SIDE = 0.02
"""Length of the sides of the block that is cut [m]."""
N_STEPS = 40
_DT = 1e-3
_SECONDS_PER_CHECK = 0.1
"""Time between two checks of the progress of the processes [s]."""
USUAL_NUMBER = 1000
"""Number of kernels in a set, about."""
_ADDED = {
    "scheme": 44,
    "relaxation": 18,
    "precision": 190,
    "relaxes": 3,
    "is_held": 11,
    "has_table": 27,
}
"""Number of them, about, that a set lacks which differs in one field; other fields add none,
or only programs made of the same ones."""

Progress = Callable[[int, int], None]
"""Receives how many kernels are compiled, and how many there will be, about."""


class KernelSet(NamedTuple):
    """Settings on which the kernels of a run depend."""

    law: str = "neo_hookean"
    scheme: str = "stellar"
    relaxation: str = "global"
    audit: bool = True
    has_sides: bool = True
    """Whether the blade has a thickness."""
    precision: str = "single"
    relaxes: bool = False
    """Whether the stress of the material relaxes."""
    is_held: bool = False
    """Whether attachments hold the body, or graspers do in the same way."""
    has_table: bool = True
    """Whether the body touches rigid geoms: a table, or a second hand."""

    @classmethod
    def of(cls, scene: Scene) -> "KernelSet":
        """Return the set that a scene needs."""
        has_sides = scene.blade is not None
        law, solver = scene.material.law.name, scene.solver
        how = (solver.audit, has_sides, solver.precision)
        relaxes = any(material.prony for material in scene.all_materials)
        is_held = bool(scene.attachments) or any(
            grasper.holds == "attachment" for grasper in scene.graspers
        )
        has_table = scene.world.table is not None or bool(scene.graspers)
        return cls(law, solver.scheme, solver.relaxation, *how, relaxes, is_held, has_table)

    def body(self, mesh: TetrahedralMesh, fixed: str = "none") -> Tissue:
        """Return a tissue that needs this set."""
        prony = ((0.5, 1.0),) if self.relaxes else ()
        return Tissue(
            mesh,
            PHANTOM if self.law == "springs" else replace(PARENCHYMA, prony=prony),
            fixed=fixed_nodes(mesh, fixed),
            blade=BladeShape() if self.has_sides else None,
            solver=SolverSettings(
                scheme=self.scheme,
                relaxation=self.relaxation,
                precision=self.precision,
                audit=self.audit,
            ),
        )


USUAL_SETS = (KernelSet(), KernelSet(relaxation="verlet", audit=False))
"""Those of the default scene, as `run` and as `view` do it."""


def folder_of(level: str | None = None) -> Path:
    """Return the folder of kernels for a level of processors [default: for this one]."""
    return cache_directory() if level is None else LEVELS[level].folder


def kernels_are_compiled(kernels: KernelSet, level: str | None = None) -> bool:
    """Return whether there are all kernels of a set, compiled from exactly these sources.

    Args:
        kernels: The set.
        level: Level of processors whose folder to look in [default: the bundle that this process
            uses, and the folder of this processor].
    """
    folder = folder_of(level)
    for mark in (_mark(kernels), _mark(kernels._replace(has_table=True))):
        if (folder / mark).exists() or (level is None and bundled(mark) is not None):
            return True
    return False


def prepare_kernels(
    sets: Sequence[KernelSet] = USUAL_SETS, on_progress: Progress = lambda n, n_all: None
) -> None:
    """Load the kernels, or compile them where this is the first run of these sources."""
    compile_ahead(sets, on_progress)
    for kernels in sets:
        _cut(kernels)
        _move(kernels)


def compile_ahead(
    sets: Sequence[KernelSet],
    on_progress: Progress = lambda n, n_all: None,
    level: str | None = None,
) -> None:
    """Compile the kernels of some sets by all cores, where the cache does not have them.

    Two processes compile the first set, and with it most of what the others share; then as many as
    there are cores compile the others, each a share of them. The cache passes on the binaries. What
    they do not compile is compiled where it is used.

    Args:
        sets: The sets.
        on_progress: Called from time to time.
        level: Level of processors for which to compile [default: for this one].
    """
    folder = folder_of(level)
    missing = [kernels for kernels in sets if not kernels_are_compiled(kernels, level)]
    if not (missing and is_compiling()):
        return
    first, others, n_cores = missing[:1], missing[1:], os.cpu_count() or 1
    shares = [share for i in range(n_cores) if (share := others[i::n_cores])]
    n_before, n_new = _expected(missing, folder)
    are_done = True
    with StopSignals() as stop:
        for tasks in ([(job, first) for job in _JOBS], [(_EVERY_JOB, share) for share in shares]):
            with _processes(tasks, level) as processes:
                while any(process.poll() is None for process in processes):
                    if stop.reason is not None:
                        raise SignalInterrupt(stop.reason)
                    n = n_compiled_kernels(folder) - n_before
                    on_progress(n, max(n, n_new, 1))
                    time.sleep(_SECONDS_PER_CHECK)
                are_done &= not any(process.returncode for process in processes)
    if are_done:
        n = max(n_compiled_kernels(folder) - n_before, 1)
        on_progress(n, n)
        for kernels in missing:
            _note(folder / _mark(kernels))


def _expected(missing: Sequence[KernelSet], folder: Path) -> tuple[int, int]:
    """Return how many kernels of a folder are not counted, and how many will be beside those.

    Where no set is complete, those of a first run that was interrupted count, too.
    """
    there = [tuple(mark.stem.split("-")) for mark in folder.glob("*.complete")]
    n_before, n_new = n_compiled_kernels(folder) if there else 0, 0
    for kernels in missing:
        texts = tuple(map(str, kernels))
        added = [
            sum(
                _ADDED.get(name, 0)
                for name, one, other in zip(KernelSet._fields, texts, each, strict=False)
                if one not in (other, str(False))
            )
            for each in there
        ]
        n_new += min(added, default=USUAL_NUMBER)
        there.append(texts)
    return n_before, n_new


@contextmanager
def _processes(
    tasks: Sequence[tuple[str, Sequence[KernelSet]]], level: str | None
) -> Iterator[list["subprocess.Popen[bytes]"]]:
    """Start a process for each job and its sets, and end them where this one is interrupted."""
    environment = os.environ | (LEVELS[level].environment if level else {})
    started = [
        subprocess.Popen(
            [sys.executable, "-m", "scalpel_sim.runs.warm_up", job, *map(json.dumps, sets)],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for job, sets in tasks
    ]
    try:
        yield started
    finally:
        for process in started:
            process.kill()
            process.wait()


def _mark(kernels: KernelSet) -> str:
    """Return the name of the file that says that a set is complete."""
    return "-".join(map(str, kernels)) + ".complete"


def _note(mark: Path) -> None:
    """Note that a set is complete. Where nothing can be written, nothing was."""
    try:
        mark.touch()
    except OSError:
        return


def _cut(kernels: KernelSet, dt: float = _DT) -> None:
    """Settle a small block, cut it through in steps of `dt` [s], and measure it."""
    tissue = kernels.body(block((2, 2, 2), (_SIDE, _SIDE, _SIDE)), "left,right")
    if dt > 0.0:
        if kernels.is_held:
            _hold(tissue)
        if kernels.has_table:
            board = Geom("board", "box", (_SIDE, _SIDE, _SIDE), 0.5)
            tissue.collide_with([board], [[0.5 * _SIDE, 0.5 * _SIDE, -_SIDE]])
        tissue.settle()
    before = _edge(-0.1)
    for fraction in np.linspace(-0.1, 1.5, N_STEPS):
        after = _edge(fraction)
        result = tissue.step(BladeSweep(before, after), dt)
        before = after
    wrenches = (result.wrench, result.wrench)
    frame = FrameData(0.0, before, *wrenches, result, TissueFrame(), (), WallTimes(), 0.0)
    frame_row(COLUMNS.values(), frame)
    force_parts(result.contacts, before.forward)
    tissue.step(None, dt)
    tissue.chunks()
    tissue.positions_of(tissue.material_points([0]))
    surface = tissue.surface()
    charts_of(surface.rest_positions, surface.triangles, _SIDE).mesh(surface.positions)
    tissue.surface_values("strain")
    tissue.surface_values("stress")
    tissue.deformation()
    tissue.snapshot()
    tissue.n_pieces()
    tissue.cut_report()


def _hold(tissue: Tissue) -> None:
    """Attach the block, and tie it by a fibre across the way of the edge."""
    tissue.attach("right", stiffness=10.0)
    middle = _SIDE / 2.0
    beyond = (_SIDE, middle, 1.5 * _SIDE)
    tissue.tie([[0.0, middle, _SIDE]], beyond, stiffness=10.0, area=1e-6, toughness=10.0)


def _incise_and_cut(kernels: KernelSet) -> None:
    """Cut a block before its motion, which the other process compiles meanwhile.

    First a block of springs alone, for elements are also a part of motion; then one whose time
    stands still. What both processes need at once both would compile.
    """
    places = [(edge.tip, edge.heel) for edge in map(_edge, (-0.1, 0.2, 0.6))]
    of_springs = kernels._replace(law="springs", audit=False)
    of_springs.body(block((2, 2, 2), (_SIDE, _SIDE, _SIDE))).incise(places, _edge(0.0).forward)
    _cut(kernels, dt=0.0)
    _cut(kernels)


def _move(kernels: KernelSet) -> None:
    """Advance two falling pieces, which may touch, by a step, and lead an arm without any tissue.

    That compiles forces, integration and contact, and what a bridge computes in a frame.
    """
    mesh = block((2, 2, 2), (_SIDE, _SIDE, _SIDE))
    apart = np.vstack([mesh.positions, mesh.positions + 2.0 * _SIDE])
    both = np.vstack([mesh.tetrahedra, mesh.tetrahedra + len(mesh.positions)])
    kernels.body(TetrahedralMesh(apart, both)).step(None, _DT)
    compiled_arithmetic()
    RowWriter(list(COLUMNS.values()), Recording(), is_parallel=True)
    arm = Arm()
    pose = arm.blade.segment()
    stroke = Stroke((0.0, 1.0), (pose, pose))
    StrokeFollower(arm.hand, stroke, TissueFrame()).lead(0.0)
    pursue(0.0, _DT, 1.0, NO_SHIFT, _SIDE, stroke.path, stroke.times, np.zeros((2, 3)))
    CollisionMonitor(arm).check()


def _edge(fraction: float) -> BladeSegment:
    """Return an upright edge in the block's middle, `fraction` of the way from front to back."""
    x, y = _SIDE / 2.0, fraction * _SIDE
    return BladeSegment(
        tip=np.array([x, y, -_SIDE]),
        heel=np.array([x, y, 2.0 * _SIDE]),
        forward=np.array([0.0, 1.0, 0.0]),
    )


_JOBS: dict[str, Callable[[KernelSet], None]] = {"motion": _move, "cut": _incise_and_cut}
"""Jobs of two processes for a set. Each takes half of the time."""
_EVERY_JOB = "all"
"""Name of all jobs, one after the other."""


def _main(job: str, *sets: str) -> None:
    """Do a job for sets that are given as JSON."""
    gc.disable()  # the compiler makes millions of objects and few cycles
    for kernels in sets:
        for name, compile_part in _JOBS.items():
            if job in (name, _EVERY_JOB):
                compile_part(KernelSet(*json.loads(kernels)))


if __name__ == "__main__":
    _main(*sys.argv[1:])
