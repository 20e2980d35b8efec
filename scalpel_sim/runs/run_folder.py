"""The folder of a run's files, which stays readable when the run ends early."""

import contextlib
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, Self, TypeVar, cast

import numpy as np

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.summary import Summary, summary_json
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.recording.growing_file import FileSum, GrowingFile
from scalpel_sim.recording.recording import Recording, lines_of_rows
from scalpel_sim.runs.file_names import (
    ENERGY_PLOT,
    FORCES,
    INITIAL,
    JOURNAL,
    PASSING_FILES,
    PLOT,
    REPLAY,
    REPLAY_FRAMES,
    RUN_FILES,
    SCENE,
    STROKE,
    SUMMARY,
    grasp_file,
)
from scalpel_sim.runs.journal import RunJournal, RunMark, RunPlan, line_of
from scalpel_sim.runs.reserved_folder import DiskReserve, FolderLock
from scalpel_sim.runs.resumption import Resumption
from scalpel_sim.strokes.grasp_motion import GRASP_COLUMNS
from scalpel_sim.strokes.stroke import LED_COLUMNS
from scalpel_sim.viewer.frame_log import FrameLog
from scalpel_sim.viewer.replay import ReplayWriter
from tissue import Snapshot, write_vtu
from tissue.support import remove_unfinished, whole_file

T = TypeVar("T")

FRAMES_PER_FLUSH = 25
"""Number of rows of `forces.csv` that are written together, which takes 0.1 ms: a kill loses a
fortieth of a second."""

LAST_FILES = 28_000_000
"""Size of the last files of a run without the body, at most [bytes]: the replay (its frames have a
limit of 18 MB, and the page around them 2 MB), two plots, the summary, the last rows."""

MOST_GROWTH = 2
"""Size of `final.vtu` over that of `initial.vtu`, at most: a cut adds tetrahedra where it is. A
larger one is written where the disk has room for it."""


class FilesMark(NamedTuple):
    """How far the files of a run have got that grow with it."""

    n_rows: int
    """Rows of `forces.csv`."""
    grown: dict[str, FileSum]
    """How far each file has got, by name."""


class Outputs:
    """A folder with the files of one run. Files of an earlier run are removed, and no others.

    The folder is locked until `close`. Each file appears when it is whole; `forces.csv` and the
    files of what a hand did grow by whole rows. Every `write_` method raises RunError where the
    system refuses.

    Args:
        folder: The folder; it is made if there is none.
        plotter: Draws the plots. The caller closes it.
        columns: Columns of `forces.csv`; None: those that each run has.
        exports: Files beside the folder for the body's surface after the run; see `export`.
        checkpoint_seconds: Simulated time between two checkpoints [s]; 0: there are none.
        resumption: What is there of the run, if it goes on from there: then those files stay.

    Raises:
        UsageError: the path is a file, or lies below one.
        RunError: another run writes there, or the folder cannot be made or written.
    """

    def __init__(
        self,
        folder: Path,
        plotter: Plotter,
        columns: Sequence[str] | None = None,
        exports: Sequence[Path] = (),
        checkpoint_seconds: float = 0.0,
        resumption: Resumption | None = None,
    ) -> None:
        self.folder, self.exports = folder, tuple(exports)
        self.checkpoint_seconds, self.resumption = checkpoint_seconds, resumption
        self._plotter = plotter
        make_folder(folder)
        self._lock = _naming_path(folder, FolderLock)
        self._reserve: DiskReserve | None = None
        try:
            if resumption is None:
                self.remove_earlier_files()
            kept = FileSum() if resumption is None else resumption.forces
            self._forces = self._growing(FORCES, columns or shared_columns(), kept)
        except BaseException:
            self._lock.release()
            raise
        self._n_written = 0 if resumption is None else len(resumption.recorded)
        self._driven: dict[str, GrowingFile] = {}
        self._journal: RunJournal | None = None

    def path(self, name: str) -> Path:
        """Return where a file of this run lies."""
        return self.folder / name

    def remove_earlier_files(self) -> None:
        """Remove the files that were there; what a run goes on from stays.

        Raises:
            RunError: the system refuses.
        """
        kept = () if self.resumption is None else (SCENE, INITIAL, FORCES, *PASSING_FILES)
        for name in (*PASSING_FILES, *RUN_FILES):
            removed = remove_unfinished if name in kept else _remove
            _naming_path(self.folder / name, removed)

    def keep_reserve(self) -> None:
        """Keep space on the disk for the last files, once `initial.vtu` is written.

        Raises:
            RunError: there is not as much.
        """
        n_bytes = LAST_FILES + MOST_GROWTH * self.path(INITIAL).stat().st_size
        try:
            self._reserve = DiskReserve(self.folder, n_bytes)
        except OSError as error:
            instead = ", or choose another --out" if self.resumption is None else ""
            raise RunError(
                f"{self.folder}: no room for {n_bytes / 1e6:.0f} MB, which are kept for the last "
                f"files of the run ({error.strerror or error}); make room{instead}"
            ) from error

    def free_reserve(self) -> None:
        """Give back the space that was kept, before the last files are written."""
        if self._reserve is not None:
            _naming_path(self.folder, lambda _: cast(DiskReserve, self._reserve).give_back())

    def write_scene(self, text: str) -> None:
        """Write `scene.toml`."""
        self._write_whole(SCENE, lambda path: path.write_text(text, encoding="utf-8"))

    def begin_journal(
        self, plan: RunPlan, seconds: float | None, read: Mapping[str, FileSum]
    ) -> None:
        """Begin the notes that `--resume` needs; from now on they grow with `forces.csv`.

        Args:
            plan: See `RunJournal`, as the others.
            seconds: How long the run is to last [s].
            read: Files of recorded motions.
        """
        n_kept = 0 if self.resumption is None else self.resumption.n_journal
        self._journal = _naming_path(
            self.path(JOURNAL), lambda path: RunJournal(path, plan, seconds, read, n_kept)
        )
        self._note_rows()

    def checkpoint_notes(self, n_frames: int, replay: FileSum) -> tuple[RunPlan, RunMark]:
        """Return what a checkpoint notes of the run after so many frames.

        Args:
            n_frames: Frames that were done, of which all rows are written.
            replay: How far the file of the replay's frames has got.
        """
        assert self._journal is not None
        written = self._written() | {REPLAY_FRAMES: replay}
        return self._journal.plan, self._journal.mark(n_frames, written)

    def _written(self) -> dict[str, FileSum]:
        """Return how far `forces.csv` and the files of what a hand did have got."""
        return {file.path.name: file.sum for file in (self._forces, *self._driven.values())}

    def _note_rows(self) -> None:
        """Note the rows that are written."""
        if self._journal is not None:
            mark = self._journal.mark(self._n_written, self._written())
            _append(self._journal.file, line_of(mark))

    def write_mesh(self, name: str, snapshot: Snapshot) -> None:
        """Write the body as `initial.vtu` or `final.vtu`."""
        _naming_path(self.path(name), lambda path: write_vtu(path, snapshot))

    def are_rows_due(self, recording: Recording) -> bool:
        """Return whether the recording has so many new rows that they are to be written."""
        return len(recording) - self._n_written >= FRAMES_PER_FLUSH

    def write_forces(self, recording: Recording, *, all_rows: bool = False) -> None:
        """Add the recording's new rows to `forces.csv`, once there are enough of them.

        Numbers are written so that reading them gives the same bits.
        """
        has_new = len(recording) > self._n_written
        if not (self.are_rows_due(recording) or (all_rows and has_new)):
            return
        rows = lines_of_rows(recording.since(self._n_written))
        self._n_written = len(recording)
        _append(self._forces, rows)
        self._note_rows()

    def write_stroke(self, rows: Sequence[Sequence[float]]) -> None:
        """Add rows of `LED_COLUMNS` to `stroke.csv`; the first call begins it again."""
        self._write_driven(STROKE, LED_COLUMNS, rows)

    def write_grasp(self, name: str, rows: Sequence[Sequence[float]]) -> None:
        """Add rows of `GRASP_COLUMNS` to the file of a grasper; the first call begins it again."""
        self._write_driven(grasp_file(name), GRASP_COLUMNS, rows)

    def _write_driven(
        self, name: str, columns: Sequence[str], rows: Sequence[Sequence[float]]
    ) -> None:
        """Add rows to a file of what a hand did; the first call begins it again.

        Numbers are written so that reading them gives the same bits.
        """
        if name not in self._driven:
            self._driven[name] = self._growing(name, columns)
        _append(self._driven[name], lines_of_rows(np.array(rows)) if rows else b"")

    def write_pending(self) -> None:
        """Add what the system refused before to `forces.csv` and the files of what a hand did."""
        for file in (self._forces, *self._driven.values()):
            _append(file, b"")

    def mark(self) -> FilesMark:
        """Return how far the files that grow have got."""
        return FilesMark(self._n_written, {f.path.name: f.sum for f in self._growing_files})

    @property
    def _growing_files(self) -> list[GrowingFile]:
        """The files that grow: first the journal, which is never to note more than they hold."""
        noted = [] if self._journal is None else [self._journal.file]
        return [*noted, self._forces, *self._driven.values()]

    def cut_back(self, mark: FilesMark) -> None:
        """Take off what was written to these files after a mark.

        Raises:
            RunError: the system refuses.
        """
        self._n_written = mark.n_rows
        for file in self._growing_files:
            _naming_path(file.path, partial(_cut_back, file, mark.grown.get(file.path.name)))

    def start_plots(self, title: str) -> None:
        """Start to draw `force.png`, and with an audit `energy.png`, from `forces.csv`."""
        self._plotter.start(self.path(FORCES), title, self.path(PLOT), self.path(ENERGY_PLOT))

    def finish_plots(self) -> None:
        """Wait until the plots are drawn."""
        self._plotter.finish()

    def replay_log(self) -> FrameLog:
        """Return the file of the replay's frames; those of a run that goes on are in it."""
        kept = FileSum() if self.resumption is None else self.resumption.replay
        return _naming_path(self.path(REPLAY_FRAMES), lambda path: FrameLog(path, kept))

    def remove_passing_files(self) -> None:
        """Remove what only a run needs that goes on."""
        for name in PASSING_FILES:
            _naming_path(self.path(name), _remove)

    def write_replay(self, replay: ReplayWriter) -> None:
        """Write `replay.html`."""
        self._write_whole(REPLAY, replay.write)

    def write_summary(self, summary: Summary) -> None:
        """Write `summary.json`."""
        text = summary_json(summary) + "\n"
        self._write_whole(SUMMARY, lambda path: path.write_text(text, encoding="utf-8"))

    def close(self) -> None:
        """Close the files that grow, and let another run have the folder. May be called twice."""
        for file in self._growing_files:
            file.close()
        if self._reserve is not None:
            with contextlib.suppress(OSError):
                self._reserve.give_back()
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _growing(self, name: str, columns: Sequence[str], kept: FileSum = FileSum()) -> GrowingFile:
        """Begin a file that grows, or go on with what is kept of it."""
        head = (",".join(columns) + "\n").encode("ascii")
        return _naming_path(self.path(name), lambda path: GrowingFile(path, head, kept))

    def _write_whole(self, name: str, write: Callable[[Path], object]) -> None:
        """Write a file that appears when it is whole."""

        def write_aside(path: Path) -> None:
            with whole_file(path) as unfinished:
                write(unfinished)

        _naming_path(self.path(name), write_aside)


def _append(file: GrowingFile, rows: bytes) -> None:
    """Add rows to a file that grows."""
    _naming_path(file.path, lambda _: file.append(rows))


def _cut_back(file: GrowingFile, mark: FileSum | None, _: Path) -> None:
    """Take off what was added to a file after a mark."""
    file.cut_back(mark)


def _remove(path: Path) -> None:
    """Remove a file of an earlier run, and what is left of one that was killed while it wrote."""
    path.unlink(missing_ok=True)
    remove_unfinished(path)


def check_folder(folder: Path) -> None:
    """Make sure that a run can write there, making the folder where there is none.

    Raises:
        UsageError: the path is a file, or lies below one.
        RunError: another run writes there, or the folder cannot be made or written.
    """
    make_folder(folder)
    _naming_path(folder, FolderLock).release()


def make_folder(folder: Path) -> None:
    """Make a folder where there is none, and make sure that it can be written.

    Raises:
        UsageError: the path is a file, or lies below one.
        RunError: the folder cannot be made or written.
    """
    blocking = next((p for p in (folder, *folder.parents) if p.exists() and not p.is_dir()), None)
    if blocking is not None:
        raise UsageError(f"{blocking}: is a file, where a folder is needed; choose another --out")

    def try_to_write(path: Path) -> None:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path) as file:
            file.write(b"can this folder be written?")

    _naming_path(folder, try_to_write)


def _naming_path(path: Path, action: Callable[[Path], T]) -> T:
    """Do `action`, and turn an error of the system into one line that names the path."""
    try:
        return action(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RunError(f"{path}: cannot be written ({reason}); choose another --out") from error
