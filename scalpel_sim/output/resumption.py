"""What the folder of an interrupted run has, and how a run goes on from there."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import RunError, UsageError, one_line
from scalpel_sim.output.checkpoints import Checkpoints
from scalpel_sim.output.recording import WALL_TIMES, Recording, read_forces
from scalpel_sim.output.run_folder import FORCES, REPLAY_FRAMES, SCENE, SUMMARY
from scalpel_sim.output.summary import COMPLETE
from scalpel_sim.simulation import Simulation
from scalpel_sim.state.checkpoint import Checkpoint
from scalpel_sim.state.simulation_state import SimulationState
from tissue import FloatArray

_BYTES_PER_LOOK = 4096
"""How much of a text is looked through at once for the end of a line [bytes]."""


class Resumption(NamedTuple):
    """What is there of a run that was interrupted."""

    recorded: Recording
    """The whole rows of `forces.csv`."""
    n_bytes: int
    """Their length, with the first line [bytes]; 0 where there is no such file."""
    checkpoint: Checkpoint | None
    """Where the run goes on; None: at its start."""

    @property
    def n_frames(self) -> int:
        """Number of frames that are not done again."""
        return 0 if self.checkpoint is None else self.checkpoint.head.n_frames

    @property
    def seconds(self) -> float | None:
        """How long the run is to last [s]; None: as its scene says, or what a hand did."""
        return None if self.checkpoint is None else self.checkpoint.head.seconds

    @property
    def replay(self) -> int:
        """How far the frames of the replay had got [bytes]."""
        return 0 if self.checkpoint is None else self.checkpoint.head.replay

    def load_into(self, simulation: Simulation) -> None:
        """Put a simulation, which is at its start, to where the run goes on.

        Raises:
            StateError: it was made otherwise than the one that was interrupted.
        """
        if self.checkpoint is None:
            return
        for row, _ in zip(self.recorded.rows_from(0), range(self.n_frames), strict=False):
            simulation.recording.append(row.tolist())
        simulation.load_state(SimulationState.from_bytes(self.checkpoint.state))


def resumption_of(folder: Path) -> Resumption:
    """Return what is there of the run whose files are in a folder.

    Raises:
        UsageError: there is nothing to go on with; the message says why.
    """
    if not (folder / SCENE).is_file():
        why = "it holds no run, or one without a scene.toml: its tissue was in another process"
        reason = why if folder.is_dir() else "there is no such folder"
        raise UsageError(
            f"--resume {folder}: {reason}. A run with --connect cannot be resumed; what its folder "
            "has of it, forces.csv and replay.html, stays"
        )
    if _status_in(folder) == COMPLETE and not (folder / REPLAY_FRAMES).exists():
        raise UsageError(f"--resume {folder}: that run is complete; there is nothing to go on with")
    forces = folder / FORCES
    n_forces = _whole_lines(forces) if forces.exists() else 0
    if n_forces == 0:  # it was killed before it wrote one
        return Resumption(Recording(), 0, None)
    try:
        recorded = read_forces(forces)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"--resume {folder}: {FORCES} was changed or damaged ({one_line(error)}). Put back "
            f"what it was, or do the run again from its {SCENE}, with another --out"
        ) from error
    with Checkpoints(folder) as checkpoints:
        found = checkpoints.read()
    replay = folder / REPLAY_FRAMES
    n_bytes = replay.stat().st_size if replay.exists() else 0
    whole = (c for c in found if c.head.n_frames <= len(recorded) and c.head.replay <= n_bytes)
    return Resumption(recorded, n_forces, next(whole, None))


class RepeatedFrames:
    """Frames that are done again, and must be what was recorded.

    Args:
        resumption: What was recorded, and where the run goes on.
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
        differs = [i for i in self._kept if not _is_same(now[i], then[i])]
        if differs:
            name = self._columns[differs[0]]
            raise RunError(
                f"{self._folder / FORCES}: frame {len(recording)} is done again, and {name} is "
                f"{float(now[differs[0]])!r}, not {float(then[differs[0]])!r} as it was: the run "
                "went on with another version of the program or its libraries, or on another "
                f"machine, or the file was changed. Do it again from its {SCENE}"
            )
        recording.cut_back(len(recording) - 1)
        recording.append(then.tolist())


def _is_same(one: float, other: float) -> bool:
    """Return whether two numbers are the same, zeros by their sign too."""
    if np.isnan(one) or np.isnan(other):
        return bool(np.isnan(one) and np.isnan(other))
    return bool(one == other and np.signbit(one) == np.signbit(other))


def _whole_lines(path: Path) -> int:
    """Return the length of a text up to the end of its last whole line [bytes]."""
    with path.open("rb") as file:
        end = file.seek(0, 2)
        while end > 0:
            begin = max(0, end - _BYTES_PER_LOOK)
            file.seek(begin)
            place = file.read(end - begin).rfind(b"\n")
            if place >= 0:
                return begin + place + 1
            end = begin
    return 0


def _status_in(folder: Path) -> str | None:
    """Return how the run ended, by its summary; None where there is none."""
    try:
        return str(json.loads((folder / SUMMARY).read_text("utf-8"))["status"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
