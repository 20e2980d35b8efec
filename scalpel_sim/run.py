"""One run, from a simulation at its start to a folder of files, however it ends."""

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from bridge import LinkError, TissueDescription
from scalpel_sim.errors import Interrupted, RunError, one_line
from scalpel_sim.hands.led_hand import LedHand
from scalpel_sim.hands.run_controls import RunControls
from scalpel_sim.output.export import export_surface
from scalpel_sim.output.run_folder import (
    FINAL,
    FRAMES_PER_FLUSH,
    INITIAL,
    SCENE,
    STROKE,
    Outputs,
)
from scalpel_sim.output.summary import COMPLETE, RunFacts, Summary, summarise
from scalpel_sim.scene_file.writing import scene_text
from scalpel_sim.scene_parts.scene import Scene
from scalpel_sim.simulation import Simulation
from scalpel_sim.stop_signals import StopSignals
from scalpel_sim.strokes.asked_area import asked_area
from scalpel_sim.tables.stroke import StrokeTable
from scalpel_sim.tables.view import ViewTable
from scalpel_sim.viewer.pictures import add_to, into_replay
from scalpel_sim.viewer.replay import ReplayWriter
from tissue import pieces_of

_log = logging.getLogger(__name__)

REST_AFTER_STROKE = 0.3
"""How long a run continues after the stroke's end [s]: the tissue swings out, and the cut gapes."""

ENDED_IN_PAGE = "ended in the page"
"""The status of a run of a script that somebody has ended in the live page."""

MANY_SUBSTEPS = 200
"""Runge-Kutta steps in a frame above which there is a warning. The scenes take 1 to 20."""


class _Attempts:
    """Attempts to write files, one a `with`: a failed one is logged, and the next is made."""

    def __init__(self) -> None:
        self.errors: list[Exception] = []

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> bool:
        if not isinstance(error, (RunError, LinkError)):
            return False
        self.errors.append(error)
        _log.warning("%s", error)
        return True


def perform(
    simulation: Simulation,
    outputs: Outputs,
    *,
    settings: dict[str, Any],
    scene: Scene | None = None,
    views: Sequence[ViewTable] = (),
    seconds: float | None = None,
    every_frame: Callable[[Simulation], None] | None = None,
    controls: RunControls | None = None,
) -> Summary:
    """Do the run, and write its files.

    A run that ends early, by the user, the system or an error, leaves the files of the part that
    was done, and its summary's `status` says what ended it.

    Args:
        simulation: At its start.
        outputs: The folder of the files.
        settings: Settings to keep in the summary.
        scene: What `scene.toml` is to hold, if its body is in a table; None: no such file.
        views: Cameras that the replay offers; it begins with the first.
        seconds: How long to simulate [s]; None for the stroke and `REST_AFTER_STROKE`.
        every_frame: Called after each frame.
        controls: What a page asks of the run. If it has a hand, that leads the blade; what it does
            is written as `stroke.csv`, and the run ends with a rest after the hand has ended.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: the run failed, or a file could not be written. The other files are.
    """
    seconds = run_time(simulation, seconds)
    hand = None if controls is None else controls.hand
    body, title = simulation.link.describe(), simulation.title  # the link may be lost on the way
    at_first = simulation.link.snapshot()
    simulation.leader = hand or simulation.leader
    if scene is not None and hand is not None:
        scene = _led_scene(scene, outputs)
    text = None if scene is None else scene_text(scene, outputs.path(SCENE))
    if text is not None:
        outputs.write_scene(text)
    outputs.write_mesh(INITIAL, at_first)
    # What graspers move is elsewhere when the blade comes.
    asked = None if simulation.graspers else asked_area(simulation.stroke, at_first)
    replay = ReplayWriter(
        simulation.arm.model,
        title=title,
        frame=simulation.frame,
        views=views,
    )
    simulation.pictures.append(into_replay(replay))
    if controls is not None:
        controls.history.begin(outputs, replay)
    _warn_if_slow(simulation)
    stopped, failure = _run_frames(simulation, outputs, seconds, every_frame, controls)
    status = _status_of(stopped, failure, controls)
    unwritten = _Attempts()
    with unwritten:
        outputs.write_forces(simulation.recording, all_rows=True)
    if hand is not None:
        hand.finish(simulation.time)
        with unwritten:
            outputs.write_stroke(hand.take_rows())
    summary = summarise(
        simulation.recording,
        _facts(simulation, body, status, settings, outputs, unwritten, asked),
    )
    with unwritten:
        outputs.write_summary(summary)
    outputs.start_plots(title)  # by another process, while this one writes the replay
    with unwritten:
        add_to(replay, simulation)
    with unwritten:
        outputs.write_replay(replay)
    for path in outputs.exports:
        with unwritten:
            export_surface(simulation.link.surface(), path)
    with unwritten:
        outputs.finish_plots()
    outputs.close()

    kept = f"{outputs.folder} holds what was done"
    if failure is not None:
        raise RunError(f"after {simulation.time:.3f} s: {one_line(failure)}; {kept}") from failure
    if stopped is not None:
        raise Interrupted(f"{stopped} after {simulation.time:.3f} s; {kept}")
    if unwritten.errors:
        raise unwritten.errors[0]
    return summary


def _run_frames(
    simulation: Simulation,
    outputs: Outputs,
    seconds: float,
    every_frame: Callable[[Simulation], None] | None,
    controls: RunControls | None,
) -> tuple[str | None, Exception | None]:
    """Do the frames, and return the signal that ended them early, and the error that did."""
    hand = None if controls is None else controls.hand
    with StopSignals() as stop:

        def obey() -> None:
            while controls is not None and controls.obey() and stop.reason is None:
                pass

        def after_frame(now: Simulation) -> bool:
            outputs.write_forces(now.recording)
            if hand is not None and len(now.recording) % FRAMES_PER_FLUSH == 0:
                outputs.write_stroke(hand.take_rows())
            if every_frame is not None:
                every_frame(now)
            obey()
            if hand is not None:
                return stop.reason is not None or _has_rested(now, hand)
            return stop.reason is not None or (controls is not None and controls.has_ended)

        failure = None
        try:
            obey()
            simulation.run(seconds, after_frame)
        except Exception as error:
            failure = error
    return stop.reason, failure


def _status_of(stopped: str | None, failure: Exception | None, controls: RunControls | None) -> str:
    """Return how a run ended, for its summary."""
    if stopped is not None:
        return stopped
    if failure is not None:
        return f"failed: {one_line(failure)}"
    is_cut_short = controls is not None and controls.hand is None and controls.has_ended
    return ENDED_IN_PAGE if is_cut_short else COMPLETE


def _has_rested(simulation: Simulation, hand: LedHand) -> bool:
    """Return whether a run has gone on for `REST_AFTER_STROKE` after its hand has ended."""
    if hand.ended_at is None:
        return False
    # The very number of frames of a run that repeats the stroke.
    n_frames = round((hand.ended_at + REST_AFTER_STROKE) / simulation.dt)
    return len(simulation.recording) >= n_frames


def _led_scene(scene: Scene, outputs: Outputs) -> Scene:
    """Return the scene that repeats what the hand will have done."""
    recorded = StrokeTable(kind="recorded", file=str(outputs.path(STROKE)))
    return replace(scene, strokes=(recorded,), seconds=None)


def _facts(
    simulation: Simulation,
    body: TissueDescription,
    status: str,
    settings: dict[str, Any],
    outputs: Outputs,
    unwritten: _Attempts,
    asked: float | None,
) -> RunFacts:
    """Write the final mesh, and return the facts of the run; `body` is as it was at the start."""
    link, bridge = simulation.link, simulation.bridge
    pieces = quality = None
    with unwritten:
        end = link.snapshot()
        pieces = pieces_of(end)
        quality = link.cut_report()
        outputs.write_mesh(FINAL, end)
    return RunFacts(
        scene=body.scene,
        status=status,
        dt=simulation.dt,
        wall_seconds=simulation.wall_seconds,
        tetrahedra_initial=body.n_tetrahedra,
        tetrahedra_final=(bridge.result or body).n_tetrahedra,
        pieces=pieces,
        quality=quality,
        asked_area=asked,
        counters=bridge.counters.as_numbers(),
        touched=simulation.touching.frames,
        settings=settings,
        held_points=[load.n_points for load in bridge.frame_loads],
    )


def _warn_if_slow(simulation: Simulation) -> None:
    """Log a warning where a frame takes so many Runge-Kutta steps that the run seems to hang."""
    n_steps = math.ceil(simulation.dt / simulation.link.cut_report().now.time_step)
    if n_steps > MANY_SUBSTEPS:
        _log.warning(
            "a frame takes %s Runge-Kutta steps, because the tissue's elements are small, stiff or "
            "light: the run will take long. Check --scale, or lower --young, or raise --density",
            f"{n_steps:,}",
        )


def run_time(simulation: Simulation, seconds: float | None) -> float:
    """Return how long to simulate [s]: `seconds`, else all motions and `REST_AFTER_STROKE`."""
    return simulation.duration + REST_AFTER_STROKE if seconds is None else seconds
