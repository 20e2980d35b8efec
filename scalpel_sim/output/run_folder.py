"""The folder of a run's files, which stays readable when the run ends early."""

import json
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import IO, NamedTuple, TypeVar

import msgspec
import numpy as np

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.recording import COLUMNS, Recording
from scalpel_sim.output.summary import Summary
from scalpel_sim.strokes.stroke import LED_COLUMNS
from scalpel_sim.viewer.replay import ReplayWriter
from tissue import FloatArray, Snapshot, write_vtu

T = TypeVar("T")

SUMMARY = "summary.json"
FORCES = "forces.csv"
PLOT = "force.png"
ENERGY_PLOT = "energy.png"
INITIAL = "initial.vtu"
FINAL = "final.vtu"
REPLAY = "replay.html"
SCENE = "scene.toml"
STROKE = "stroke.csv"
"""What a hand did. A scripted run leaves it: it may be the very stroke that is done again."""
RUN_FILES = (SCENE, SUMMARY, FORCES, PLOT, ENERGY_PLOT, INITIAL, FINAL, REPLAY)
"""Names of all files that a run can write, beside `STROKE`."""

_HEAD_OF_STROKE = (",".join(LED_COLUMNS) + "\n").encode("ascii")

FRAMES_PER_FLUSH = 25
"""Number of rows of `forces.csv` that are written together, which takes 0.1 ms: a kill loses a
fortieth of a second."""


class FilesMark(NamedTuple):
    """How far the files of a run have got that grow with it."""

    n_rows: int
    """Rows of `forces.csv`."""
    forces: int
    """Length of `forces.csv` [bytes]."""
    stroke: int
    """Length of `stroke.csv` [bytes]."""


class Outputs:
    """A folder with the files of one run. Files of an earlier run are removed, and no others.

    Every `write_` method raises RunError where the system refuses.

    Args:
        folder: The folder; it is made if there is none.
        plotter: Draws the plots. The caller closes it.
        columns: Columns of `forces.csv`.
        exports: Files beside the folder for the body's surface after the run; see `export`.

    Raises:
        UsageError: the path is a file, or lies below one.
        RunError: the folder cannot be made or written.
    """

    def __init__(
        self,
        folder: Path,
        plotter: Plotter,
        columns: Sequence[str] = COLUMNS,
        exports: Sequence[Path] = (),
    ) -> None:
        self.folder, self.exports = folder, tuple(exports)
        self._plotter = plotter
        check_folder(folder)
        for name in RUN_FILES:
            _naming_path(folder / name, lambda path: path.unlink(missing_ok=True))
        self._forces = _naming_path(folder / FORCES, lambda path: path.open("ab", buffering=0))
        self._append((",".join(columns) + "\n").encode("ascii"))
        self._n_written = 0
        self._stroke: IO[bytes] | None = None

    def path(self, name: str) -> Path:
        """Return where a file of this run lies."""
        return self.folder / name

    def write_scene(self, text: str) -> None:
        """Write `scene.toml`."""
        _naming_path(self.path(SCENE), lambda path: path.write_text(text, encoding="utf-8"))

    def write_mesh(self, name: str, snapshot: Snapshot) -> None:
        """Write the body as `initial.vtu` or `final.vtu`."""
        _naming_path(self.path(name), lambda path: write_vtu(path, snapshot))

    def write_forces(self, recording: Recording, *, all_rows: bool = False) -> None:
        """Add the recording's new rows to `forces.csv`, once there are enough of them.

        Numbers are written so that reading them gives the same bits.
        """
        n_new = len(recording) - self._n_written
        if n_new < (1 if all_rows else FRAMES_PER_FLUSH):
            return
        self._append(_csv(recording.rows[self._n_written :]))
        self._n_written = len(recording)

    def write_stroke(self, rows: Sequence[Sequence[float]]) -> None:
        """Add rows of `LED_COLUMNS` to `stroke.csv`; the first call begins it anew.

        Numbers are written so that reading them gives the same bits.
        """
        text = _csv(np.array(rows)) if rows else b""
        if self._stroke is None:
            self._stroke = _naming_path(self.path(STROKE), lambda p: p.open("wb", buffering=0))
            text = _HEAD_OF_STROKE + text
        stroke = self._stroke
        _naming_path(self.path(STROKE), lambda _: stroke.write(text))

    def mark(self) -> FilesMark:
        """Return how far `forces.csv` and `stroke.csv` have got."""
        stroke = len(_HEAD_OF_STROKE) if self._stroke is None else self._stroke.tell()
        return FilesMark(self._n_written, self._forces.tell(), stroke)

    def cut_back(self, mark: FilesMark) -> None:
        """Take off what was written to `forces.csv` and `stroke.csv` after a mark.

        Raises:
            RunError: the system refuses.
        """
        self._n_written = mark.n_rows
        ends = {FORCES: (self._forces, mark.forces), STROKE: (self._stroke, mark.stroke)}
        for name, (file, end) in ends.items():
            if file is not None:
                _naming_path(self.path(name), partial(_cut_off, file, end))

    def start_plots(self, title: str) -> None:
        """Have `force.png`, and with an audit `energy.png`, drawn from `forces.csv`."""
        self._plotter.start(self.path(FORCES), title, self.path(PLOT), self.path(ENERGY_PLOT))

    def finish_plots(self) -> None:
        """Wait until the plots are drawn."""
        self._plotter.finish()

    def write_replay(self, replay: ReplayWriter) -> None:
        """Write `replay.html`."""
        _naming_path(self.path(REPLAY), replay.write)

    def write_summary(self, summary: Summary) -> None:
        """Write `summary.json`."""
        text = summary_json(summary) + "\n"
        _naming_path(self.path(SUMMARY), lambda path: path.write_text(text, encoding="utf-8"))

    def close(self) -> None:
        """Close `forces.csv` and `stroke.csv`. May be called twice."""
        self._forces.close()
        if self._stroke is not None:
            self._stroke.close()

    def _append(self, text: bytes) -> None:
        _naming_path(self.path(FORCES), lambda _: self._forces.write(text))


def _cut_off(file: IO[bytes], end: int, path: Path) -> None:
    """Make an open file that long [bytes], and go on writing there; `path` is its name."""
    file.truncate(end)
    file.seek(end)


def _csv(rows: FloatArray) -> bytes:
    """Return rows as lines of text with the fewest digits that give the same bits again.

    JSON's numbers are those digits, and its encoder takes a fifth of the time of `repr`; it has no
    word for what is not finite.
    """
    if np.isinf(rows).any():
        return "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()).encode("ascii")
    lines = msgspec.json.encode(rows.tolist())[2:-2].replace(b"],[", b"\n")
    return lines.replace(b"null", b"nan") + b"\n"


def check_folder(folder: Path) -> None:
    """Make sure that a run can write there, making the folder where there is none.

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


def check_file(path: Path, suffix: str, option: str) -> None:
    """Make sure that a file can be written, before the work whose result it is for.

    Args:
        path: The file; one that is there will be overwritten.
        suffix: What its name must end in.
        option: The option that chose it, for the message.

    Raises:
        UsageError: another suffix, a folder, or a file in a folder that does not exist.
        RunError: the system refuses.
    """
    if path.suffix.lower() != suffix:
        raise UsageError(f"{option} is {path}; its name must end in {suffix}")
    if path.is_dir() or not path.parent.is_dir():
        reason = "it is a folder" if path.is_dir() else f"there is no folder {path.parent}"
        raise UsageError(f"{option} is {path}, and {reason}; choose another file")
    is_new = not path.exists()
    try:
        with path.open("ab"):
            pass
        if is_new:
            path.unlink()
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose another {option}"
        ) from error


def summary_json(summary: Summary) -> str:
    """Return the summary as JSON text."""
    return json.dumps(summary._asdict(), indent=2, allow_nan=False)


def _naming_path(path: Path, action: Callable[[Path], T]) -> T:
    """Do `action`, and turn an error of the system into one line that names the path."""
    try:
        return action(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RunError(f"{path}: cannot be written ({reason}); choose another --out") from error
