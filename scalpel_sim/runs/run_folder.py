"""The folder of a run's files, which stays readable when the run ends early."""

import contextlib
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Self

import numpy as np

from scalpel_sim.errors import RunError, UsageError, writing
from scalpel_sim.file_lock import take_lock
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.report_page import RunReport, report_html
from scalpel_sim.output.summary import Summary, summary_json
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.recording.growing_file import FileSum, GrowingFile
from scalpel_sim.recording.recording import Recording, lines_of_rows
from scalpel_sim.runs.checkpoints import RunMark, RunPlan, line_of
from scalpel_sim.runs.file_names import (
    ENERGY_PLOT,
    FORCES,
    INITIAL,
    JOURNAL,
    PASSING_FILES,
    PLAN,
    PLOT,
    REPLAY,
    REPLAY_FRAMES,
    REPORT,
    RUN_FILES,
    SCENE,
    SUMMARY,
)
from scalpel_sim.runs.resumption import Resumption
from scalpel_sim.scoring.plan import Plan
from scalpel_sim.viewer.frame_log import FrameLog
from scalpel_sim.viewer.replay import ReplayWriter
from tissue import Deformation, Snapshot, write_vtu
from tissue.support import remove_unfinished, whole_file

FRAMES_PER_FLUSH = 25
"""Number of rows of `forces.csv` that are written together, which takes 0.1 ms: a kill loses a
fortieth of a second."""

LAST_FILES = 28_000_000
"""Size of the last files of a run without the body, at most [bytes]: the replay (its frames have a
limit of 18 MB, and the page around them 2 MB), two plots, the summary, the last rows."""

MOST_GROWTH = 2
"""Size of `final.vtu` over that of `initial.vtu`, at most: a cut adds tetrahedra where it is. A
larger one is written where the disk has room for it."""

LOCK = ".lock"
"""Name of the file that is locked. It stays when the run has ended, and means nothing then."""

RESERVE = ".reserve"
"""Name of the file that takes the space for the last files."""

_OPTION = "--out"
_INSTEAD = f"another {_OPTION}"


class Outputs:
    """A folder with the files of one run. Files of an earlier run are removed, and no others.

    The folder is locked until `close`; the system releases it where the run is killed. Each file
    appears when it is whole; `forces.csv` and the files of what a hand did grow by whole rows.
    Every method that writes raises RunError where the system refuses.

    Args:
        folder: The folder; it is made if there is none.
        plotter: Draws the plots. The caller closes it.
        columns: Columns of `forces.csv`; None: those that each run has.
        resumption: Files of the run, if it continues from there: then those files stay.

    Raises:
        UsageError: the path is a file, or lies below one.
        RunError: another run writes there, or the folder cannot be made or written.
    """

    def __init__(
        self,
        folder: Path,
        plotter: Plotter,
        columns: Sequence[str] | None = None,
        resumption: Resumption | None = None,
    ) -> None:
        self.folder, self.resumption = folder, resumption
        self._plotter = plotter
        make_folder(folder)
        with ExitStack() as stack:
            stack.callback(take_lock(folder / LOCK, folder, _OPTION))
            if resumption is None:
                self.remove_earlier_files()
            kept = FileSum() if resumption is None else resumption.forces
            self._forces = self._growing(FORCES, columns or shared_columns(), kept)
            self._release = stack.pop_all().close
        self._n_written = 0 if resumption is None else len(resumption.recorded)
        self._driven: dict[str, GrowingFile] = {}
        self._journal: GrowingFile | None = None

    def path(self, name: str) -> Path:
        """Return where a file of this run lies."""
        return self.folder / name

    def remove_earlier_files(self) -> None:
        """Remove the files that were there; what a run continues from stays."""
        kept = () if self.resumption is None else (SCENE, INITIAL, FORCES, *PASSING_FILES)
        for name in (*PASSING_FILES, *RUN_FILES):
            self._remove(name, is_kept=name in kept)

    def remove_passing_files(self) -> None:
        """Remove what only a run needs that continues."""
        for name in PASSING_FILES:
            self._remove(name)

    def _remove(self, name: str, *, is_kept: bool = False) -> None:
        """Remove a file, unless it is kept, and what is left of a run that was killed at it."""
        path = self.path(name)
        with writing(path, _INSTEAD):
            if not is_kept:
                path.unlink(missing_ok=True)
            remove_unfinished(path)

    def keep_reserve(self) -> None:
        """Keep space on the disk for the last files, once `initial.vtu` is written.

        Raises:
            RunError: there is not as much.
        """
        n_bytes = LAST_FILES + MOST_GROWTH * self.path(INITIAL).stat().st_size
        try:
            with self.path(RESERVE).open("wb") as file:
                _allocate(file.fileno(), n_bytes)
        except OSError as error:
            self.free_reserve()
            instead = ", or choose another --out" if self.resumption is None else ""
            raise RunError(
                f"{self.folder}: no room for {n_bytes / 1e6:.0f} MB, which are kept for the last "
                f"files of the run ({error.strerror or error}); make room{instead}"
            ) from error

    def free_reserve(self) -> None:
        """Give back the space that was kept, before the last files are written."""
        with writing(self.folder, _INSTEAD):
            self.path(RESERVE).unlink(missing_ok=True)

    def write_scene(self, text: str) -> None:
        """Write `scene.toml`."""
        self._write_whole(SCENE, lambda path: path.write_text(text, encoding="utf-8"))

    def write_plan(self, plan: Plan) -> None:
        """Write the plan by which a run is scored."""
        self._write_whole(PLAN, plan.write)

    def write_mesh(
        self,
        name: str,
        snapshot: Snapshot,
        deformation: Deformation,
        label_names: Mapping[int, str],
    ) -> None:
        """Write the body as `initial.vtu` or `final.vtu`, with its stress, strain and labels."""
        with writing(self.path(name), _INSTEAD):
            write_vtu(self.path(name), snapshot, deformation, label_names=label_names)

    def write_replay(self, replay: ReplayWriter) -> None:
        """Write `replay.html`."""
        self._write_whole(REPLAY, replay.write)

    def write_summary(self, summary: Summary) -> None:
        """Write `summary.json`."""
        text = summary_json(summary) + "\n"
        self._write_whole(SUMMARY, lambda path: path.write_text(text, encoding="utf-8"))

    def write_report(self, report: RunReport) -> None:
        """Write `report.html`."""
        text = report_html(report)
        self._write_whole(REPORT, lambda path: path.write_text(text, encoding="utf-8"))

    def _write_whole(self, name: str, write: Callable[[Path], object]) -> None:
        """Write a file that appears when it is whole."""
        path = self.path(name)
        with writing(path, _INSTEAD), whole_file(path) as unfinished:
            write(unfinished)

    def begin_journal(self, plan: RunPlan) -> None:
        """Begin the notes that `--resume` needs; from now on they grow with `forces.csv`.

        They are written after the files that they are about.
        """
        kept = FileSum(0 if self.resumption is None else self.resumption.n_journal)
        with writing(self.path(JOURNAL), _INSTEAD):
            self._journal = GrowingFile(self.path(JOURNAL), b"", kept)
        _append(self._journal, line_of(plan))
        self._note_rows()

    def written(self) -> dict[str, FileSum]:
        """Return how far `forces.csv` and the files of what a hand did have got."""
        return {file.path.name: file.sum for file in (self._forces, *self._driven.values())}

    def _note_rows(self) -> None:
        """Note the rows that are written."""
        if self._journal is not None:
            _append(self._journal, line_of(RunMark(self._n_written, self.written())))

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

    def write_driven(
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

    def mark(self) -> RunMark:
        """Return how far the files that grow have got."""
        return RunMark(self._n_written, {f.path.name: f.sum for f in self._growing_files})

    def cut_back(self, mark: RunMark) -> None:
        """Take off what was written to these files after a mark."""
        self._n_written = mark.n_frames
        for file in self._growing_files:
            with writing(file.path, _INSTEAD):
                file.cut_back(mark.written.get(file.path.name))

    @property
    def _growing_files(self) -> list[GrowingFile]:
        """The files that grow: first the journal, which is never to note more than they hold."""
        noted = [] if self._journal is None else [self._journal]
        return [*noted, self._forces, *self._driven.values()]

    def _growing(self, name: str, columns: Sequence[str], kept: FileSum = FileSum()) -> GrowingFile:
        """Begin a file that grows, or continue with what is kept of it."""
        head = (",".join(columns) + "\n").encode("ascii")
        with writing(self.path(name), _INSTEAD):
            return GrowingFile(self.path(name), head, kept)

    def replay_log(self) -> FrameLog:
        """Return the file of the replay's frames; those of a run that continues are in it."""
        kept = FileSum() if self.resumption is None else self.resumption.replay
        with writing(self.path(REPLAY_FRAMES), _INSTEAD):
            return FrameLog(self.path(REPLAY_FRAMES), kept)

    def start_plots(self, title: str) -> None:
        """Start to draw `force.png`, and with an audit `energy.png`, from `forces.csv`."""
        self._plotter.start(self.path(FORCES), title, self.path(PLOT), self.path(ENERGY_PLOT))

    def finish_plots(self) -> None:
        """Wait until the plots are drawn."""
        self._plotter.finish()

    def close(self) -> None:
        """Close the files that grow, and release the folder. May be called twice."""
        for file in self._growing_files:
            file.close()
        with contextlib.suppress(RunError):
            self.free_reserve()
        self._release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def check_folder(folder: Path) -> None:
    """Make sure that a run can write there, making the folder where there is none.

    Raises:
        UsageError: the path is a file, or lies below one.
        RunError: another run writes there, or the folder cannot be made or written.
    """
    make_folder(folder)
    take_lock(folder / LOCK, folder, _OPTION)()


def make_folder(folder: Path) -> None:
    """Make a folder where there is none, and make sure that it can be written.

    Raises:
        UsageError: the path is a file, or lies below one.
        RunError: the folder cannot be made or written.
    """
    blocking = next((p for p in (folder, *folder.parents) if p.exists() and not p.is_dir()), None)
    if blocking is not None:
        raise UsageError(f"{blocking}: is a file, where a folder is needed; choose another --out")
    with writing(folder, _INSTEAD):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"can this folder be written?")


def _append(file: GrowingFile, rows: bytes) -> None:
    """Add rows to a file that grows."""
    with writing(file.path, _INSTEAD):
        file.append(rows)


def _allocate(file: int, n_bytes: int) -> None:
    """Take blocks on the disk for so many bytes of a new file."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file, 0, n_bytes)
        return
    os.write(file, bytes(n_bytes))  # where the system cannot
