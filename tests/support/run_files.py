"""The files of a run, as a user sees them, and what of them two equal runs share."""

from pathlib import Path

import numpy as np

from scalpel_sim.recording.columns import WALL_TIMES
from scalpel_sim.recording.recording import Recording, read_forces
from scalpel_sim.runs.file_names import FINAL, FORCES, PASSING_FILES
from tissue import FloatArray


def names_in(folder: str | Path) -> list[str]:
    """Return the names of the files in a folder, sorted, without hidden ones such as its lock.

    Files with which an interrupted run could go on are left out, too.
    """
    names = [path.name for path in Path(folder).iterdir()]
    return sorted(each for each in names if not each.startswith(".") and each not in PASSING_FILES)


def untimed(recording: Recording) -> FloatArray:
    """Return a copy of the rows of a recording without wall times."""
    rows: FloatArray = recording.rows[:, [name not in WALL_TIMES for name in recording.columns]]
    return rows


def assert_same_rows(one: Recording, other: Recording) -> None:
    """Fail unless two recordings have the same bits but for wall times; NaN equals NaN."""
    np.testing.assert_array_equal(untimed(one), untimed(other))


def assert_same_run(one: Path, other: Path) -> None:
    """Fail unless two folders have the same bits: rows but for wall times, and final mesh."""
    assert_same_rows(read_forces(one / FORCES), read_forces(other / FORCES))
    assert (one / FINAL).read_bytes() == (other / FINAL).read_bytes()
