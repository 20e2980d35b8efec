"""Files of an interrupted run, and how a run continues from there."""

import json
import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.run_outcome import COMPLETE
from scalpel_sim.recording.columns import WALL_TIMES
from scalpel_sim.recording.growing_file import FileSum, sum_of, sums_that_hold
from scalpel_sim.recording.recording import Recording, read_forces
from scalpel_sim.runs.checkpoints import Checkpoint, Checkpoints, RunMark, RunPlan, read_journal
from scalpel_sim.runs.file_names import (
    FORCES,
    INITIAL,
    JOURNAL,
    PASSING_FILES,
    REPLAY_FRAMES,
    SCENE,
    SUMMARY,
)
from scalpel_sim.simulation import Simulation
from scalpel_sim.state import SimulationState
from tissue import FloatArray, StateError
from tissue.support import whole_file

CHANGED_SCENE = "scene.changed.toml"
"""Name of a `scene.toml` that was not the one of the run."""

_log = logging.getLogger(__name__)


class Resumption(NamedTuple):
    """Files of a run that was interrupted, as far as their checksums hold."""

    plan: RunPlan | None
    """Request of the run; None: no note of it is whole."""
    last: RunMark | None
    """Progress by the last note."""
    recorded: Recording
    """The rows of `forces.csv`."""
    forces: FileSum
    """Their length, with the first line."""
    n_journal: int
    """Length of the journal until there [bytes]."""
    checkpoint: Checkpoint | None
    """Where the run continues; None: at its start."""

    @property
    def n_frames(self) -> int:
        """Number of frames that are not done again."""
        return 0 if self.checkpoint is None else self.checkpoint.mark.n_frames

    @property
    def seconds(self) -> float | None:
        """Time that the run is to last [s]; None: as its scene says, or what a hand did."""
        return None if self.plan is None else self.plan.seconds

    @property
    def replay(self) -> FileSum:
        """Progress of the frames of the replay."""
        checkpoint = self.checkpoint
        return FileSum() if checkpoint is None else checkpoint.mark.written[REPLAY_FRAMES]

    def put_back_scene(self, folder: Path) -> None:
        """Write `scene.toml` as it was, if it is another one now, which then has another name.

        Raises:
            OSError: the system refuses.
        """
        path = folder / SCENE
        text = None if self.plan is None else self.plan.scene
        if text is None or (path.exists() and path.read_bytes() == text.encode()):
            return
        kept = ""
        if path.exists():
            path.replace(folder / CHANGED_SCENE)
            kept = f", and what was there is {CHANGED_SCENE}"
        with whole_file(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8")
        _log.warning("%s was changed, damaged or removed; it is as it was again%s", path, kept)

    def load_into(self, simulation: Simulation) -> None:
        """Put a simulation, which is at its start, to where the run continues.

        Raises:
            StateError: it was made otherwise than the one that was interrupted.
        """
        if len(self.recorded) and self.recorded.columns != simulation.recording.columns:
            raise StateError(
                f"{FORCES} has other columns than this program records: do the run again"
            )
        if self.checkpoint is None:
            return
        for row, _ in zip(self.recorded.rows_from(0), range(self.n_frames), strict=False):
            simulation.recording.append(row.tolist())
        simulation.load_state(SimulationState.from_bytes(self.checkpoint.state))


def resumption_of(folder: Path) -> Resumption:
    """Return what is there of the run whose files are in a folder. What is damaged is logged.

    Raises:
        UsageError: there is nothing to continue; the message says why.
        OSError: a file cannot be read.
    """
    if not folder.is_dir():
        raise UsageError(f"--resume {folder}: there is no such folder")
    has_ended = not any((folder / name).exists() for name in PASSING_FILES)
    if has_ended and _status_in(folder) == COMPLETE:
        raise UsageError(f"--resume {folder}: that run is complete; there is nothing to continue")
    with Checkpoints(folder) as checkpoints:
        found = checkpoints.read()
    plan, noted = read_journal(folder / JOURNAL)
    plan = found[0].plan if plan is None and found else plan
    if not (folder / SCENE).exists() and (plan is None or plan.scene is None):
        raise UsageError(f"--resume {folder}: {_why_no_scene(folder, plan)}")
    if plan is None:
        _log.warning(
            "%s: no note of what was requested of the run is whole; it is done as %s says, without "
            "--export unless that is given again",
            folder,
            SCENE,
        )
    marks = [*(each.mark for each in reversed(found)), *(mark for mark, _ in noted)]
    last = max(reversed(marks), key=lambda mark: mark.written[FORCES].n_bytes, default=None)
    if last is not None:
        _expect_recorded(folder, plan, last)
    whole = sums_that_hold(folder / FORCES, (mark.written[FORCES] for mark in marks))
    forces = max(whole, default=FileSum())
    n_journal = [end for mark, end in noted if mark.written[FORCES] in whole]
    recorded = read_forces(folder / FORCES, forces.n_bytes) if forces.n_bytes else Recording()
    _warn_of_rows(folder / FORCES, marks, recorded, forces)
    checkpoint = _last_that_holds(folder, found, whole)
    return Resumption(plan, last, recorded, forces, max(n_journal, default=0), checkpoint)


def _why_no_scene(folder: Path, plan: RunPlan | None) -> str:
    """Return why a folder without a `scene.toml` has no run that can continue."""
    if plan is not None or (folder / INITIAL).exists():
        return (
            f"it has no {SCENE}: the tissue of its run was in another process, or the file was "
            "removed. A run with --connect cannot be resumed; what its folder has of it stays"
        )
    if (folder / FORCES).exists():
        return f"its run ended before it wrote its {SCENE}: nothing was done yet. Begin it again"
    return "it holds no run"


def _expect_recorded(folder: Path, plan: RunPlan | None, last: RunMark) -> None:
    """Refuse to continue if what a hand did, which the run repeats, is not what it was.

    Raises:
        UsageError: it is not; the message names the file.
        OSError: it cannot be read.
    """
    is_led = plan is None or plan.seconds is None
    done = last.written if is_led else {}
    led = {name: each for name, each in done.items() if name not in (FORCES, REPLAY_FRAMES)}
    other = [name for name, each in led.items() if not sums_that_hold(folder / name, [each])]
    for name, each in ({} if plan is None else plan.read).items():
        if not (folder / name).exists() or sum_of(folder / name) != each:
            other.append(name)
    if other:
        raise UsageError(
            f"--resume {folder}: {folder / other[0]} was changed, damaged or removed, and nothing "
            "else holds the motion that the run repeats. Put back what it was"
        )


def _warn_of_rows(
    path: Path, marks: Sequence[RunMark], recorded: Recording, forces: FileSum
) -> None:
    """Warn that rows of `forces.csv` are done again which were written, if there are any."""
    n_bytes = max((mark.written[FORCES].n_bytes for mark in marks), default=0)
    if path.exists():
        n_bytes = max(n_bytes, path.stat().st_size)
    if n_bytes > forces.n_bytes:
        _log.warning(
            "%s: what follows after frame %d was changed, damaged or removed, or has no checksum; "
            "it is done again",
            path,
            len(recorded),
        )


def _last_that_holds(
    folder: Path, found: Sequence[Checkpoint], whole: set[FileSum]
) -> Checkpoint | None:
    """Return the last checkpoint for which the other files are as they were; None: there is none.

    Args:
        folder: Where the files are.
        found: The checkpoints, the last one first.
        whole: Checksums that hold for `forces.csv`.
    """
    sums = (each.mark.written[REPLAY_FRAMES] for each in found)
    frames = sums_that_hold(folder / REPLAY_FRAMES, sums)
    for each in found:
        written = each.mark.written
        damaged = [
            name
            for name, held in ((FORCES, whole), (REPLAY_FRAMES, frames))
            if written[name] not in held
        ]
        if not damaged:
            return each
        _log.warning(
            "%s: the checkpoint after frame %d is left out, since %s was changed, damaged or "
            "removed",
            folder,
            each.mark.n_frames,
            " and ".join(damaged),
        )
    _log.warning("%s: no checkpoint is whole; the run begins again at its start", folder)
    return None


class RepeatedFrames:
    """Frames that are done again, and must be what was recorded.

    Args:
        resumption: What was recorded, and where the run continues.
        folder: Where `forces.csv` is, for messages.
    """

    def __init__(self, resumption: Resumption, folder: Path) -> None:
        self._folder = folder
        self._columns = resumption.recorded.columns
        self._kept = [i for i, name in enumerate(self._columns) if name not in WALL_TIMES]
        self._rows: Iterator[FloatArray] = resumption.recorded.rows_from(resumption.n_frames)

    def check(self, recording: Recording) -> None:
        """Compare the last frame with its row, which it takes: the wall times are of then.

        Raises:
            RunError: they differ.
        """
        then = next(self._rows, None)
        if then is None:
            return
        now = recording.since(len(recording) - 1)[0]
        # Zeros are compared by their sign, too.
        same = (now == then) & (np.signbit(now) == np.signbit(then)) | np.isnan(now) & np.isnan(
            then
        )
        differs = [i for i in self._kept if not same[i]]
        if differs:
            name = self._columns[differs[0]]
            raise RunError(
                f"{self._folder / FORCES}: frame {len(recording)} is done again, and {name} is "
                f"{float(now[differs[0]])!r}, not {float(then[differs[0]])!r} as it was: the run "
                "continued with another version of the program or its libraries, on another "
                f"machine, or with another mesh or model. Do it again from its {SCENE}"
            )
        recording.cut_back(len(recording) - 1)
        recording.append(then.tolist())


def _status_in(folder: Path) -> str | None:
    """Return how the run ended, by its summary; None where there is none."""
    try:
        return str(json.loads((folder / SUMMARY).read_text("utf-8"))["status"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
