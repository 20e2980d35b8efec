"""Images: what a camera costs beside the simulation that it sees."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.timing import Rounds, TurnWatch
from scalpel_sim import Camera, prepare
from scalpel_sim.scene.read import scene_called
from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.measurements import CPU, LOWER, BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows
from scalpel_sim.validate.speed.watch import SILENT

_CONTROL_FRAMES = 20
"""Frames of a control step: an image is taken after each."""

_FIRST, _LAST = 0.4, 1.2
"""Time in which images are taken [s]: as the organ is cut."""

_CASES = ("20 ms of simulation", "image", "a further camera", "depth", "all three")


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
    taken: dict[str, list[list[float]]] = {case: [] for case in _CASES}
    watch.begin(runs)
    size = 0
    for _ in range(runs):
        simulation = prepare(scene_called(scene), records=False)
        camera = Camera(simulation, "overview", width=side, height=side)
        further = camera.another("endoscope")
        simulation.run(_FIRST)
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
            while simulation.time < _LAST:
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
    for case in _CASES[1:]:
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
