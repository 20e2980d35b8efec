"""Costs around the frames of a scene: states, checks, surfaces, images, undo."""

import itertools
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, get_args

import numpy as np
from msgspec import structs

from benchmarks.frame import Stopwatches
from benchmarks.timing import Rounds, TurnWatch, time_calls
from bridge import InProcessLink
from scalpel_sim import Camera, Simulation, prepare
from scalpel_sim.hands.commands import Engage, Move, Release, Undo
from scalpel_sim.hands.run_controls import History, Pace, RunControls
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.runs.options import Flag
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.scene.read import scene_called
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.task_table import LimitTable, TaskTable
from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.measurements import CPU, LOWER, WALL, BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows
from scalpel_sim.validate.speed.watch import SILENT
from tissue import (
    BladeSweep,
    SurfaceQuantity,
    Tissue,
    TissueState,
)

_CONTROL_FRAMES = 20
"""Frames of a control step: an image is taken after each."""

_IMAGES_FROM, _IMAGES_TO = 0.4, 1.2
"""Time in which images are taken [s]: as the organ is cut."""

_OF_IMAGES = ("20 ms of simulation", "image", "a further camera", "depth", "all three")

_TASK = TaskTable(limits=(LimitTable(strain=0.5),))
"""Task of a scene without one: its plan is that of the strokes, and strain counts everywhere."""

_ABOUT_SCORE = (
    "CPU time of Score.after_frame over that of Simulation.step with it, in the second of two "
    "whole runs; a control step is 20 frames. Plan, forces, strain everywhere, and pieces are in "
    "it. The stopwatches cost some 2 us a frame, of which half is counted. In one call: the tissue "
    "alone, of which the blade is led where the stroke is, goes 20 ms in one step, and then the "
    "score looks; the share is of both."
)

_DRAWN = 0.035
"""Distance by which a hand draws the blade in each stroke [m]."""


def checked_steps(scene: str = "organ", /, *, no_audit: Flag = False) -> BenchmarkResult:
    """Time the checks of each step, and the states that are saved to go back to.

    CPU time of each step of a whole stroke without the stages in it: what remains is checked and
    saved.

    Args:
        scene: Scene.
        no_audit: Keep no account of the energy.
    """
    simulation = prepare(changed(scene_called(scene), audit=not no_audit))
    tissue = _tissue_of(simulation)
    simulation.step()
    taken: dict[str, list[float]] = {"stages": [], "checks and a save": [], "checks, no save": []}
    watches = Stopwatches(time.thread_time_ns)
    detach = watches.attach(
        ("tissue.tissue:Tissue.step", "tissue.stepping.stages:StepStages.advance")
    )
    try:
        for _ in range(round(simulation.duration / simulation.dt)):
            watches.spent.clear()
            simulation.step()
            kind = "checks, no save" if tissue._steps.inputs else "checks and a save"
            taken[kind].append(1e-9 * watches.spent["Tissue.step"])
            taken["stages"].append(1e-9 * watches.spent["StepStages.advance"])
    finally:
        detach()
    share = 100.0 * sum(map(sum, list(taken.values())[1:])) / sum(taken["stages"])
    size = tissue.n_tetrahedra
    rows = Rows("checked-steps", CPU)
    for case, seconds in taken.items():
        if seconds:
            rows.times(case, size, [np.array(seconds)])
    rows.values(
        "checks over stages", size, [share], "%", quantity="share", better=LOWER, clock=CPU.name
    )
    return rows.table(
        "checked steps", f"Steps of {scene}; {tissue.n_repeated_steps} were repeated."
    )


def saved_state(scene: str = "organ", /, *, times: int = 50) -> BenchmarkResult:
    """Time saving and loading the state of a scene: at rest, in the middle of its cut, after it.

    Args:
        scene: Scene.
        times: Number of samples.
    """
    simulation = prepare(scene_called(scene))
    tissue = _tissue_of(simulation)
    rows = Rows("saved-state")
    for when, share in (("at rest", 0.0), ("in mid-cut", 0.5), ("after", 1.0)):
        simulation.run(share * simulation.duration + simulation.dt)
        state, whole = tissue.save_state(), simulation.save_state()
        states: list[TissueState] = []
        cases: dict[str, Callable[[], object]] = {
            "save, new memory": partial(_keep, states, tissue),
            "save": tissue.save_state,
            "load": partial(tissue.load_state, state),
            "to bytes": state.to_bytes,
            "save, with arm": simulation.save_state,
            "load, with arm": partial(simulation.load_state, whole),
            "save to bytes, with arm": lambda: simulation.save_state().to_bytes(),
        }
        for case, do in cases.items():
            rows.times(f"{when}: {case}", tissue.n_tetrahedra, [time_calls(do, times)])
        n_bytes = len(state.to_bytes())
        rows.values(
            f"{when}: size", tissue.n_tetrahedra, [1e-6 * n_bytes], "MB", quantity="size",
            better=LOWER,
        )  # fmt: skip
    about = (
        "A state in new memory is one of those that are kept for undo; else a state takes the "
        "memory of an earlier one. A checkpoint takes `save to bytes, with arm` of the frame loop."
    )
    return rows.table(f"state of {scene}", about)


def _keep(states: list[TissueState], tissue: Tissue) -> None:
    """Save a state whose memory is new, since others are kept."""
    states.append(tissue.save_state())


def surface_values(scene: str = "organ", /, *, times: int = 100) -> BenchmarkResult:
    """Time the surface of a picture, and what colours it: displacement, strain and stress.

    Args:
        scene: Scene; it is in the middle of its cut.
        times: Number of samples.
    """
    simulation = prepare(scene_called(scene))
    simulation.run(0.6 * simulation.duration)
    tissue = _tissue_of(simulation)
    cases: dict[str, Callable[[], object]] = {"surface": tissue.surface}
    for quantity in get_args(SurfaceQuantity):
        cases[quantity] = partial(tissue.surface_values, quantity)
    rows = Rows("surface-values")
    for case, do in cases.items():
        rows.times(case, tissue.n_tetrahedra, [time_calls(do, times)])
    return rows.table(f"surface of {scene}", "In mid-cut.")


def images(
    scene: str = "organ",
    /,
    *,
    side: int = 128,
    runs: Rounds = 5,
    watch: TurnWatch = SILENT,
) -> BenchmarkResult:
    """Time images of a cut, and the simulation between them, in turns: CPU time, all threads.

    Args:
        scene: Scene.
        side: Width and height of the images [pixels].
        runs: Number of times that the same part of the cut is done.
        watch: Receives the progress.
    """
    taken: dict[str, list[list[float]]] = {case: [] for case in _OF_IMAGES}
    watch.begin(runs)
    size = 0
    for _ in range(runs):
        simulation = prepare(scene_called(scene), records=False)
        camera = Camera(simulation, "overview", width=side, height=side)
        further = camera.another("endoscope")
        simulation.run(_IMAGES_FROM)
        for each in (camera, further):
            each.image()
        for samples in taken.values():
            samples.append([])

        def timed(case: str, do: Callable[[], Any]) -> None:
            begin = time.process_time()
            do()
            taken[case][-1].append(time.process_time() - begin)

        def control_step(now: Any = simulation) -> None:
            for _ in range(_CONTROL_FRAMES):
                now.step()

        with camera, no_garbage_collection():
            while simulation.time < _IMAGES_TO:
                timed("20 ms of simulation", control_step)
                timed("image", camera.rgb)
                timed("a further camera", further.rgb)
                timed("20 ms of simulation", control_step)
                timed("all three", camera.image)
                timed("depth", further.depth)
        size = simulation.result.n_tetrahedra
        watch.tick(scene)
    rows = Rows("images", CPU)
    for case, rounds in taken.items():
        rows.times(case, size, [np.array(samples) for samples in rounds])
    simulated = np.array([np.median(samples) for samples in taken["20 ms of simulation"]])
    for case in _OF_IMAGES[1:]:
        shares = 100.0 * np.array([np.median(samples) for samples in taken[case]]) / simulated
        title = f"{case}, over 20 ms of simulation"
        rows.values(
            title, size, shares.tolist(), "%", quantity="share", better=LOWER, clock=CPU.name
        )
    about = (
        f"{scene} as it is cut, {side} x {side} pixels, by {camera.renderer}. `image` is colours "
        "of the first camera of an instant, with the surface and its upload; `a further camera` "
        "sees the same instant; `all three` is colours, depth and segmentation."
    )
    camera.close()
    return rows.table("images", about)


def undo(scene: str = "organ", /, *, times: int = 10) -> BenchmarkResult:
    """Time the undo of a cut: state, files, and the surface of the picture that shows it.

    Args:
        scene: Scene.
        times: Number of cuts.
    """
    simulation = prepare(scene_called(scene), is_led=True)
    hand = LiveHand(simulation)
    hand.take_over(simulation)
    controls = RunControls(Pace(), History(simulation), hand)
    undone, drawn, areas = np.empty(times), np.empty(times), []
    with Plotter() as plotter, tempfile.TemporaryDirectory() as folder:
        outputs = Outputs(Path(folder), plotter)
        controls.history.begin(outputs)
        for i in range(times):
            controls.commands += [Engage(), Move([0.0, _DRAWN, 0.0], 0.0)]
            for _ in range(400):
                controls.obey()
                simulation.step()
                outputs.write_forces(simulation.recording)
            areas.append(simulation.result.cut_area)
            size = simulation.result.n_tetrahedra
            controls.commands += [Release(), Undo()]
            start = WALL.now()
            controls.obey()
            undone[i] = WALL.now() - start
            simulation.link.surface()
            drawn[i] = WALL.now() - start
        outputs.close()
    rows = Rows("undo")
    for case, seconds in (("state and files", undone), ("with the surface", drawn)):
        rows.times(case, size, [seconds])
    return rows.table("undo", f"Cuts of {1e6 * median(areas):.0f} mm2 in {scene}.")


def _tissue_of(simulation: Simulation) -> Tissue:
    """Return the tissue of a simulation, which is in this process."""
    assert isinstance(simulation.link, InProcessLink)
    return simulation.link.tissue


def score(scenes: Sequence[str] = ("slab", "organ", "incision", "tumour"), /) -> BenchmarkResult:
    """Measure the share of the CPU time of a run that its score takes.

    Args:
        scenes: Scenes; one without a task gets one.
    """
    rows = Rows("score", CPU)
    for name in scenes:
        scene = scene_called(name)
        task = structs.replace(scene.task or _TASK, limits=_TASK.limits)
        simulation = prepare(structs.replace(scene, task=task), records=False)
        simulation.run(simulation.duration)  # loads and compiles
        simulation.reset()
        watches = Stopwatches(time.thread_time_ns)
        detach = watches.attach(
            (
                "scalpel_sim.simulation:Simulation.step",
                "scalpel_sim.scoring.score:Score.after_frame",
            )
        )
        try:
            simulation.run(simulation.duration)
        finally:
            detach()
        own, rest = (watches.spent[each] for each in ("Score.after_frame", "Simulation.step"))
        each = 1e-9 * own / simulation.n_frames * _CONTROL_FRAMES
        size = simulation.link.describe().n_tetrahedra
        in_one, step_in_one = _in_one_call(simulation)
        for case, figure, unit in (
            ("share", 100.0 * own / (own + rest), "%"),
            ("a control step", 1e3 * each, "ms"),
            ("share, in one call", 100.0 * in_one / (in_one + step_in_one), "%"),
            ("a control step, in one call", 1e3 * in_one, "ms"),
        ):
            rows.values(
                f"{name}: {case}", size, [figure], unit, quantity=case, better=LOWER, clock=CPU.name
            )
    return rows.table("score", _ABOUT_SCORE)


def _in_one_call(simulation: Simulation) -> tuple[float, float]:
    """Return the mean CPU time of the score of a control step [s], and of its step of the tissue.

    Of the second of two whole strokes.
    """
    tissue, score, stroke = _tissue_of(simulation), simulation.score, simulation.stroke
    assert score is not None
    length = _CONTROL_FRAMES * simulation.dt
    poses = [stroke.pose(i * length) for i in range(int(stroke.duration / length) + 1)]
    with no_garbage_collection():
        for _ in range(2):
            simulation.reset()
            spent = np.zeros(2)
            for i, ends in enumerate(itertools.pairwise(poses)):
                begin = time.thread_time()
                simulation.bridge.result = tissue.step(BladeSweep(*ends), length)
                done = time.thread_time()
                simulation.n_frames = _CONTROL_FRAMES * (i + 1)
                score.after_frame(simulation)
                spent += time.thread_time() - done, done - begin
    own, of_tissue = spent / (len(poses) - 1)
    return float(own), float(of_tissue)
