"""One run, from a simulation at its start to a folder of files, however it ends."""

import logging
from collections.abc import Callable, Sequence
from contextlib import nullcontext

from bridge import InProcessLink, LinkError, TcpLink
from scalpel_sim.errors import Interrupted, RunError, one_line
from scalpel_sim.hands.run_controls import RunControls
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.output.run_outcome import COMPLETE
from scalpel_sim.output.summary import Summary
from scalpel_sim.runs.checkpoints import Checkpoint, Checkpoints, RunMark, RunPlan
from scalpel_sim.runs.console import progress
from scalpel_sim.runs.file_names import (
    FORCES,
    INITIAL,
    REPLAY_FRAMES,
    SCENE,
    STROKE,
    grasp_file,
)
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.repeated_scene import repeated_scene, sums_of_recorded
from scalpel_sim.runs.resumption import RepeatedFrames, Resumption
from scalpel_sim.runs.run_end import OpenRun, write_driven, write_end
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.runs.stop_signals import StopSignals
from scalpel_sim.scene.checks import LONGEST_RUN
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.write import scene_text
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.looks import look_of_scene
from scalpel_sim.viewer.pictures import into_replay
from scalpel_sim.viewer.replay import ReplayWriter

_log = logging.getLogger(__name__)

REST_AFTER_STROKE = 0.3
"""Time for which a run continues after the stroke's end [s]: the tissue swings out, and the cut
gapes."""

ENDED_IN_PAGE = "ended in the page"
"""The status of a run of a script that somebody has ended in the live page."""

LONGEST_WAIT = 2.0
"""Time for which a run that is to end waits for a tissue in another process [s]."""


class RunCheckpoints(Checkpoints):
    """Checkpoints of a run. Where the tissue is in another process there are none.

    Args:
        run: The run, whose files have begun.
        plan: Request of the run.
    """

    def __init__(self, run: OpenRun, plan: RunPlan) -> None:
        self._run, self._plan = run, plan
        outputs, simulation, every = run.outputs, run.simulation, 0
        seconds = run.prepared.checkpoint_seconds
        if seconds > 0.0 and isinstance(simulation.link, InProcessLink):
            every = max(1, round(seconds / simulation.dt))
        grown = (FORCES, REPLAY_FRAMES, STROKE, *(grasp_file(g.name) for g in simulation.graspers))
        super().__init__(outputs.folder, every, grown)
        if outputs.resumption is not None:
            self.read(is_said=True)
            self.cut_back(outputs.resumption.n_frames)

    def mark(self) -> int:
        """Return how many frames were done."""
        return len(self._run.simulation.recording)

    def write_now(self) -> None:
        """Write a checkpoint of the present. All rows must be written before."""
        self.write(self._now)

    def _now(self) -> Checkpoint:
        """Return the run as it is."""
        written = self._run.outputs.written() | {REPLAY_FRAMES: self._run.replay.mark()}
        state = self._run.simulation.save_state().to_bytes()
        return Checkpoint(self._plan, RunMark(self.mark(), written), state)


def perform(
    prepared: PreparedRun,
    *,
    every_frame: Callable[[Simulation], None] | None = None,
    controls: RunControls | None = None,
    resumption: Resumption | None = None,
    before_frames: Callable[[], None] | None = None,
) -> Summary:
    """Do a run, by its script or by a hand, and write its files.

    A run that ends early, by the user, the system or an error, leaves the files of the part that
    was done, and its summary's `status` says what ended it. A script has a progress bar on a
    terminal.

    Args:
        prepared: The run.
        every_frame: Called after each frame; None: the run waits until the frame is due, where
            there are controls.
        controls: Requests of a page or a device. If they have a hand, that leads blade and
            graspers; what it does is written, as `stroke.csv` and a file for each grasper, and the
            run ends with a rest after the hand has ended.
        resumption: Files of the run, if it continues from there.
        before_frames: Called once the first files are written: what it waits for finds all ready.
            If it raises, they are removed.

    Raises:
        StateError: a run that continues is made otherwise than it was.
        Interrupted: the user or the system ended the run.
        RunError: another run writes there, the run failed, or a file could not be written. The
            other files are.
    """
    simulation, settings = prepared.simulation, prepared.settings
    hand = None if controls is None else controls.hand
    if resumption is not None and resumption.plan is not None:
        settings = resumption.plan.settings
    if hand is not None:
        settings = settings | {"stroke": simulation.stroke.name}
    if controls is not None:
        every_frame = every_frame or (lambda now: controls.pace.wait(now.dt))
    seconds = _length_of(prepared, hand, resumption)
    simulation.recording.keep_in(prepared.folder)
    with (
        progress(seconds, prepared.printing) if hand is None else nullcontext() as advance,
        Outputs(
            prepared.folder, prepared.plotter, simulation.recording.columns, resumption
        ) as outputs,
        StopSignals() as stop,
        outputs.replay_log() as log,
    ):
        replay = ReplayWriter(
            simulation.arm.model,
            title=simulation.title,
            frame=simulation.frame,
            views=prepared.scene.views,
            log=log,
            look=look_of_scene(prepared.scene),
        )
        run = OpenRun(prepared, outputs, replay, settings, hand)
        # Of a tissue elsewhere nobody says how it is held or solved.
        scene = prepared.scene if prepared.is_here else None
        plan = _begin(run, scene, None if hand is not None else seconds)
        simulation.pictures.append(into_replay(replay))
        with RunCheckpoints(run, plan) as checkpoints:
            if controls is not None:
                controls.history.begin(checkpoints, outputs, replay)
            run.begin_recording(None if hand is not None else seconds)
            _wait(before_frames, run)
            if controls is not None:
                controls.pace.go_on()
            calls = [each for each in (advance, every_frame) if each is not None]
            run.failure = _run_frames(run, seconds, calls, controls, stop, checkpoints)
        stopped, stop.is_writing = stop.reason, True
        run.status = stopped or _status_of(run.failure, controls)
        summary = write_end(run)
        is_done = run.status in (COMPLETE, ENDED_IN_PAGE) and not run.attempts.unwritten
        if is_done or not checkpoints.are_there:
            outputs.remove_passing_files()
    _raise_what_ended_it(run, stop, stopped, can_continue=checkpoints.are_there and not is_done)
    return summary


def _raise_what_ended_it(
    run: OpenRun, stop: StopSignals, stopped: str | None, *, can_continue: bool
) -> None:
    """Raise the first error of a run, or the signal that came, if there was one.

    Args:
        run: The run, whose last files were written.
        stop: The signals until the last file was written.
        stopped: The signal that ended the frames.
        can_continue: Whether `--resume` continues from there.

    Raises:
        Interrupted: the user or the system ended the run, or wanted to when it had ended.
        RunError: the run failed, or a file could not be written.
    """
    time, folder, attempts = run.simulation.time, run.outputs.folder, run.attempts
    kept = f"{folder} holds what was done"
    if attempts.unwritten:
        kept += f", but not {', '.join(dict.fromkeys(attempts.unwritten))}"
    further = f"; --resume {folder} continues from there" if can_continue else ""
    if run.failure is not None:
        is_of_files = isinstance(run.failure.__cause__, OSError)  # what diverged would do so again
        raise RunError(
            f"after {time:.3f} s: {one_line(run.failure)}; {kept}{further if is_of_files else ''}"
        ) from run.failure
    if stopped is not None:
        raise Interrupted(f"{stopped} after {time:.3f} s; {kept}{further}")
    if attempts.errors:
        raise RunError(f"{one_line(attempts.errors[0])}; {kept}{further}") from attempts.errors[0]
    if stop.reason is not None:
        raise Interrupted(f"{stop.reason} when the run was complete; {kept}")


def _wait(before_frames: Callable[[], None] | None, run: OpenRun) -> None:
    """Call what is to be done before the first frame; remove the first files where it fails."""
    if before_frames is None:
        return
    try:
        before_frames()
    except BaseException:
        if run.recorder is not None:
            run.recorder.close()
            run.recorder.path.unlink()
        run.outputs.free_reserve()
        run.outputs.remove_earlier_files()
        raise


def _begin(run: OpenRun, scene: Scene | None, seconds: float | None) -> RunPlan:
    """Write what is known before the first frame, and keep space for what comes after the last.

    A run that continues is put where it was first: what is refused leaves its folder as it is.

    Args:
        run: At its start.
        scene: What `scene.toml` is to hold, if its body is in a table; None: no such file.
        seconds: How long the run is to last [s]; None: as long as the hand leads.

    Raises:
        StateError: a run that continues is made otherwise than it was.
        RunError: the system refuses, or there is no room for a run.
    """
    simulation, outputs, hand = run.simulation, run.outputs, run.hand
    if hand is not None:
        hand.take_over(simulation)
    if outputs.resumption is not None:
        outputs.resumption.load_into(simulation)
        _write_initial(run)  # its size: the space kept
        outputs.keep_reserve()
        outputs.remove_earlier_files()
    if scene is not None and hand is not None:
        scene = repeated_scene(scene, simulation, outputs)
    text = None if scene is None else scene_text(scene, outputs.path(SCENE))
    if text is not None:
        outputs.write_scene(text)
    exports = [str(path.absolute()) for path in run.prepared.exports]
    read = {} if scene is None or hand is not None else sums_of_recorded(scene, outputs)
    record = run.prepared.record
    path = None if record is None else str(record.absolute())
    plan = RunPlan(simulation.dt, text, exports, run.settings, seconds, path, read)
    outputs.begin_journal(plan)
    if outputs.resumption is None:
        _write_initial(run)
        outputs.keep_reserve()
    return plan


def _run_frames(
    run: OpenRun,
    seconds: float,
    every_frame: Sequence[Callable[[Simulation], None]],
    controls: RunControls | None,
    stop: StopSignals,
    checkpoints: RunCheckpoints,
) -> Exception | None:
    """Do the frames, and return the error that ended them early.

    Args:
        run: At its start, or where it continues.
        seconds: How long to simulate [s].
        every_frame: Functions that are called after each frame.
        controls: See `perform`.
        stop: The signals.
        checkpoints: Checkpoints of the run.
    """
    simulation, outputs, hand = run.simulation, run.outputs, run.hand
    resumption = outputs.resumption
    repeated = None if resumption is None else RepeatedFrames(resumption, outputs.folder)

    def obey() -> None:
        while controls is not None and controls.obey() and stop.reason is None:
            pass

    def write_rows() -> None:
        if hand is not None:
            write_driven(outputs, hand)  # first: from it the rows can be made again
        outputs.write_forces(simulation.recording, all_rows=True)

    def after_frame(now: Simulation) -> bool:
        if repeated is not None:
            repeated.check(now.recording)
        is_due = checkpoints.is_due(len(now.recording))
        if is_due or outputs.are_rows_due(now.recording):
            write_rows()
        if is_due:
            checkpoints.write_now()
        for call in every_frame:
            call(now)
        obey()
        if hand is not None:
            return stop.reason is not None or _has_rested(now, hand)
        if stop.reason is not None or (controls is not None and controls.has_ended):
            return True
        is_free = run.prepared.scene.seconds is None and now.blade.progress is not None
        return is_free and now.time >= run_time(now, None)

    def give_up() -> None:
        if stop.seconds > LONGEST_WAIT:
            raise LinkError(f"{stop.reason}, and the tissue, in another process, does not answer")

    link = simulation.link
    try:
        if isinstance(link, TcpLink):
            link.while_waiting = give_up
        obey()
        if stop.reason is None:
            if checkpoints.is_due(len(simulation.recording)):
                checkpoints.write_now()
            simulation.run(seconds, after_frame)
        if stop.reason is not None:
            write_rows()
            if checkpoints.are_wanted:
                checkpoints.write_now()
            checkpoints.finish()
        if isinstance(link, TcpLink):  # what it answers for the last files may be long
            link.while_waiting = lambda: None
    except Exception as error:
        return error
    except KeyboardInterrupt:  # a frame that hangs, as where the tissue is elsewhere
        _log.warning("%s in the middle of a frame", stop.reason)
    return None


def _status_of(failure: Exception | None, controls: RunControls | None) -> str:
    """Return how a run ended without a signal, for its summary."""
    if failure is not None:
        return f"failed: {one_line(failure)}"
    is_cut_short = controls is not None and controls.hand is None and controls.has_ended
    return ENDED_IN_PAGE if is_cut_short else COMPLETE


def _has_rested(simulation: Simulation, hand: Teleoperation) -> bool:
    """Return whether a run has gone on for `REST_AFTER_STROKE` after its hand has ended."""
    if hand.ended_at is None:
        return False
    # The very number of frames of a run that repeats the stroke.
    n_frames = round((hand.ended_at + REST_AFTER_STROKE) / simulation.dt)
    return len(simulation.recording) >= n_frames


def _write_initial(run: OpenRun) -> None:
    """Write the body as it was at first."""
    names = run.simulation.link.label_names
    run.outputs.write_mesh(INITIAL, run.first, run.first_deformation, names)


def _length_of(
    prepared: PreparedRun, hand: Teleoperation | None, resumption: Resumption | None
) -> float:
    """Return how long to simulate [s], at most."""
    if hand is not None:
        return LONGEST_RUN + REST_AFTER_STROKE
    if resumption is not None and resumption.seconds is not None:
        return resumption.seconds
    return run_time(prepared.simulation, prepared.scene.seconds)


def run_time(simulation: Simulation, seconds: float | None) -> float:
    """Return how long to simulate [s]: `seconds`, else all motions and `REST_AFTER_STROKE`."""
    return simulation.duration + REST_AFTER_STROKE if seconds is None else seconds
