"""One frame, seen from inside: the files that it enters, and what its parts cost."""

import importlib
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter_ns
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from cyclopts import Parameter

from benchmarks.timing import TurnWatch
from scalpel_sim import SCENES
from scalpel_sim.errors import UsageError
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.runs.options import Flag
from scalpel_sim.scene.read import scene_called
from scalpel_sim.scene.scene import changed
from scalpel_sim.simulation import Simulation, no_garbage_collection
from scalpel_sim.validate.speed.measurements import LOWER, BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows, compact_table, print_notes
from scalpel_sim.validate.speed.watch import SILENT
from tissue import BladeShape

if TYPE_CHECKING:
    from rich.console import Console

_ROOT = Path(__file__).parents[1]
_PACKAGES = tuple(str(_ROOT / package) + "/" for package in ("tissue", "bridge", "scalpel_sim"))
_NTH = 10
"""Number of the frame that is traced, among those that cut: earlier ones load, make room, and
begin a cut."""

_ABOUT_FRAME = (
    "Files: distinct Python files of tissue, bridge and scalpel_sim in which a call of Python "
    "begins in one frame. Returns: calls into a file that the frame had entered before and left "
    "since. Calls within a file, returns from calls, and what compiled kernels call are not "
    f"counted. The frame is number {_NTH} of those that cut, with an account of the energy."
)
_ABOUT_FIXED = (
    "A block of 48 tetrahedra, in frames in which the blade holds tissue and cuts no mesh: what a "
    "frame costs where the body costs next to nothing. Whole frames are timed first, then the "
    "parts by stopwatches around them: each part without the parts listed that it calls. A "
    "stopwatch costs some 0.2 us, which a profiler does not: that takes several times as long for "
    "each call of Python, and nothing longer for a kernel."
)

TIMED_PARTS = (
    "scalpel_sim.simulation:Simulation.step",
    "scalpel_sim.recording.row_writer:RowWriter.append",
    "scalpel_sim.arm.arm:Arm.step1",
    "scalpel_sim.arm.arm:Arm.step2",
    "scalpel_sim.arm.arm:Arm.check",
    "scalpel_sim.instruments.stroke_follower:StrokeFollower.lead",
    "scalpel_sim.arm.blade:Blade.segment",
    "scalpel_sim.arm.blade:Blade.apply",
    "scalpel_sim.arm.collision_monitor:CollisionMonitor.check",
    "bridge.bridge:Bridge.step",
    "tissue.tissue:Tissue.step",
    "tissue.stepping.stages:StepStages._begin",
    "tissue.stepping.stages:StepStages._relax",
    "tissue.integrators.global_stepper:GlobalStepper.relax",
    "tissue.stepping.stages:StepStages._detect",
    "tissue.cutting.incision:Incision.detect",
    "tissue.stepping.stages:StepStages._result",
    "tissue.stepping.energy_audit:Audit.update",
)
"""Modules, and functions or methods in them."""


class Trace(NamedTuple):
    """Files that a frame enters by calls of Python."""

    scene: str
    tetrahedra: int
    entered: list[str]
    """The file of each call, paths from the root of the repository; neighbours differ."""
    calls: Counter[str]
    """Number of calls into each file or within it, in the order in which files are entered."""

    @property
    def n_returns(self) -> int:
        """Number of calls into a file that the frame had entered before and left since."""
        return len(self.entered) - len(self.calls)


def frame(
    *scenes: str, list_files: Annotated[bool, Parameter(name="--list", negative="")] = False
) -> BenchmarkResult:
    """Count the files that a frame that cuts enters, and its returns to files it had left.

    A call is a `call` event of `sys.setprofile` in a file of tissue, bridge or scalpel_sim. The
    files of all calls of a frame, in order, are a sequence; calls in the file of the call before
    are left out of it. `files` is the number of different files in the sequence; `returns` is the
    number of its entries whose file is in it already. The frame is the tenth that opens faces in
    the run of a scene, by when all kernels are loaded; an account of the energy is kept.

    Args:
        scenes: Scenes [default: slab, organ].
        list_files: Print the files in the order entered, with their calls and entries.
    """
    names = [scene_called(name).name for name in scenes or ("slab", "organ")]
    traces = [trace_frame(name) for name in names]
    rows = Rows("frame")
    for each in traces:
        for what, n in (("files", len(each.calls)), ("returns", each.n_returns)):
            case = f"{each.scene}: {what}"
            rows.values(case, each.tetrahedra, [n], "", quantity=what, better=LOWER)

    def show(console: "Console") -> None:
        table = compact_table("a frame that cuts", ("scene",), ("files", "returns", "calls"))
        for each in traces:
            numbers = (len(each.calls), each.n_returns, each.calls.total())
            table.add_row(each.scene, *map(str, numbers))
        console.print(table)
        for each in traces if list_files else ():
            files = compact_table(each.scene, ("file",), ("calls", "entries"))
            for file, calls in each.calls.items():
                files.add_row(file, str(calls), str(each.entered.count(file)))
            console.print(files)
        print_notes(_ABOUT_FRAME, (), console)

    return BenchmarkResult(rows.measured, [], show)


def trace_frame(name: str, nth: int = _NTH) -> Trace:
    """Run a scene until the n-th frame that cuts; return what that frame entered.

    Raises:
        UsageError: the stroke of the scene ends before.
    """
    simulation = prepare(changed(SCENES[name], audit=True))
    simulation.step()
    n_cuts = 0
    while n_cuts < nth:
        if simulation.time > simulation.duration:
            raise UsageError(f"{name} cuts in {n_cuts} frames; choose slab or organ")
        before = simulation.result.cut_area
        files = _files_of_calls(simulation.step)
        n_cuts += simulation.result.cut_area > before
    entered = [file for i, file in enumerate(files) if i == 0 or files[i - 1] != file]
    return Trace(name, simulation.result.n_tetrahedra, entered, Counter(files))


def _files_of_calls(do: Callable[[], object]) -> list[str]:
    """Return the file of each call of Python into the product, in order."""
    files: list[str] = []

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(_PACKAGES):
            files.append(frame.f_code.co_filename)

    sys.setprofile(note)
    try:
        do()
    finally:
        sys.setprofile(None)
    return [str(Path(file).relative_to(_ROOT)) for file in files]


class Stopwatches:
    """Times the parts of a frame, each without the parts inside it.

    Args:
        now: Returns the time since some fixed moment [ns].
    """

    def __init__(self, now: Callable[[], int] = perf_counter_ns) -> None:
        self._now = now
        self.spent: defaultdict[str, int] = defaultdict(int)
        """Time of each part in this frame so far [ns]."""
        self._inner = [0]

    def around(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, timed."""

        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._inner.append(0)
            begin = self._now()
            try:
                return function(*arguments, **keywords)
            finally:
                spent = self._now() - begin
                self.spent[name] += spent - self._inner.pop()
                self._inner[-1] += spent

        return timed

    def attach(self, parts: Sequence[str] = TIMED_PARTS) -> Callable[[], None]:
        """Time the parts; return a function that takes the stopwatches off."""
        owners: list[tuple[Any, str, Any]] = []
        for part in parts:
            module, name = part.split(":")
            owner: Any = importlib.import_module(module)
            *path, last = name.split(".")
            for step in path:
                owner = getattr(owner, step)
            owners.append((owner, last, getattr(owner, last)))
            setattr(owner, last, self.around(name, getattr(owner, last)))

        def detach() -> None:
            for owner, last, function in owners:
                setattr(owner, last, function)

        return detach


def fixed_cost(
    *, watch: TurnWatch = SILENT, frames: int = 2000, audit: Flag = False
) -> BenchmarkResult:
    """Time a frame of 48 tetrahedra, whole and part by part: what every frame costs.

    Args:
        watch: Receives the progress.
        frames: Number of frames that are timed.
        audit: Keep an account of the energy.
    """
    organ = SCENES["organ"].material
    scene = changed(SCENES["grid2"], material=organ, blade=BladeShape(), audit=audit, speed=0.02)
    watches = Stopwatches()
    watch.begin(2)
    timed = {"": _steady_frames(prepare(scene), frames, watches)}
    watch.tick("without stopwatches")
    detach = watches.attach()
    try:
        timed[", with stopwatches"] = _steady_frames(prepare(scene), frames, watches)
    finally:
        detach()
    watch.tick("with stopwatches")
    rows = Rows("fixed-cost")
    for title, found in timed.items():
        for name in found[-1]:
            case = f"{name}{title}" if name == "whole frame" else name
            rows.times(case, 48, [np.array([1e-9 * row.get(name, 0) for row in found])], "µs")
    return rows.table("fixed cost of a frame", _ABOUT_FIXED)


def _steady_frames(simulation: Simulation, n: int, watches: Stopwatches) -> list[dict[str, int]]:
    """Return the times [ns] of at most `n` frames that hold tissue and cut none, by part."""
    rows: list[dict[str, int]] = []
    end = simulation.stroke.duration
    with no_garbage_collection():
        for _ in range(20):
            simulation.step()
        while len(rows) < n and simulation.time < end:
            before = simulation.result.n_tetrahedra
            watches.spent.clear()
            begin = perf_counter_ns()
            simulation.step()
            whole = perf_counter_ns() - begin
            result = simulation.result
            if result.anchored_length > 0.0 and result.n_tetrahedra == before:
                rows.append({**watches.spent, "whole frame": whole})
    return rows
