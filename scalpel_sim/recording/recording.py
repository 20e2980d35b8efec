"""One row of numbers for each frame, and the terms of the energy account."""

import math
import re
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec
import numpy as np

from scalpel_sim.recording.row_store import RowStore
from tissue import Energies, FloatArray

ACCOUNT = (*(f"{term}_j" for term in Energies._fields[1:]), "residual_j")
"""Columns of the energy account since the start: the terms of `tissue.Energies`, and the residual.
NaN without an audit."""

N_OF_ACCOUNT = len(ACCOUNT)


def _vector(name: str, unit: str) -> tuple[str, ...]:
    return tuple(f"{name}_{axis}_{unit}" for axis in "xyz")


WALL_TIMES = ("cd_s", "gc_s", "rx_s", "rd_s", "frame_s", "recording_s")
"""Columns that differ from run to run: what frames took."""

COLUMNS = (
    "time_s",
    *_vector("tip", "m"),
    *_vector("force", "n"),
    *_vector("torque", "nm"),
    *_vector("tissue_force", "n"),
    *_vector("tissue_torque", "nm"),
    *_vector("edge_force", "n"),
    *_vector("pressing_force", "n"),
    *_vector("friction_force", "n"),
    *(f"stiffness_{axes}_n_m" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")),
    "cut_area_m2",
    "finished_area_m2",
    "tetrahedra",
    "anchored_length_m",
    "work_of_blade_j",
    *ACCOUNT,
    *WALL_TIMES,
)
"""Names and units. Vectors are in the world frame. `force` and `torque` are what the arm feels,
averaged over the frame, the torque about the tip; `tissue_force` and `tissue_torque` are what the
tissue exerts, before the limits of the device. `edge_force`, `pressing_force` and `friction_force`
are what the tissue does to the blade's edge, to its faces, and along them, at the end of the frame;
`stiffness` is how fast that force changes with the blade's position. `cd_s` to `rd_s` are wall
times of the stages that the paper's Table 1 names: collision detection, geometric changes,
relaxation and rendering. `frame_s` is the wall time of the whole frame without rendering (`rd_s`)
and without the recording of its row (`recording_s`)."""


class Term(NamedTuple):
    """A term of the energy account: a field of `tissue.Energies`."""

    name: str
    label: str
    colour: str


# Paul Tol's muted palette, which colour-blind readers can distinguish too.
TERMS = (
    Term("cutting", "cutting: toughness x area", "#cc6677"),
    Term("breaking", "breaking the skin", "#882255"),
    Term("friction", "friction on the blade", "#ddcc77"),
    Term("damping", "damping", "#88ccee"),
    Term("contact", "impacts of the tissue", "#44aa99"),
    Term("topology", "change of the mesh", "#999933"),
    Term("released", "released by the blade, net", "#aa4499"),
    Term("elastic", "stored: elastic", "#117733"),
    Term("held", "stored: at the blade", "#77cc77"),
    Term("kinetic", "stored: motion", "#332288"),
    Term("potential", "stored: height", "#bbbbbb"),
)
"""The terms in the order of the table: first what is dissipated, then what is stored."""


def held_columns(n: int) -> tuple[str, ...]:
    """Return the columns of a run with `n` attachments: the force of the tissue on each, world.

    They come after `COLUMNS`, averaged over the frame.
    """
    return tuple(name for i in range(n) for name in _vector(f"held_{i}", "n"))


def columns_of_hand(name: str) -> tuple[str, ...]:
    """Return the columns of a grasper, which follow after all others.

    Force and torque of the tissue on it in the frame, about the middle between the pads, world
    frame; the distance between the pads; and how many points of the tissue are tied to it.
    """
    vectors = (*_vector(f"{name}_force", "n"), *_vector(f"{name}_torque", "nm"))
    return (*vectors, f"{name}_opening_m", f"{name}_points")


def _n_held(columns: Sequence[str]) -> int:
    """Return the number of attachments that have columns."""
    return sum(re.fullmatch(r"held_\d+_x_n", name) is not None for name in columns)


_LINES_PER_READ = 1024
"""Lines of `forces.csv` that are read together: some megabytes of text."""


class Recording:
    """Rows of `COLUMNS`, one per frame. Some seconds are in memory; see `RowStore`.

    Args:
        others: Further columns: see `held_columns` and `columns_of_hand`, in this order.
    """

    def __init__(self, others: Sequence[str] = ()) -> None:
        self.columns = (*COLUMNS, *others)
        """Names and units of all columns."""
        self.n_held = _n_held(self.columns)
        """Number of attachments."""
        self._store = RowStore(len(self.columns))
        self.append = self._store.append
        """Add one frame: a number for each of `columns`."""
        self.cut_back = self._store.cut_back
        """Forget all frames but the first so many, of which there are as many."""
        self.since = self._store.since
        """Return the frames after the first so many. A view, until the next frame."""

    def __len__(self) -> int:
        return len(self._store)

    def keep_in(self, folder: Path) -> None:
        """Put the file of what memory does not hold into a folder, if there is none yet."""
        self._store.folder = folder

    @property
    def rows(self) -> FloatArray:
        """All frames so far, shape (n_frames, n_columns). A view.

        Raises:
            RunError: there are more than memory holds, and the disk is full.
        """
        return self._store.rows()

    def rows_from(self, first: int) -> Iterator[FloatArray]:
        """Yield the frames after so many, one by one: a view, until the next."""
        for part in self._store.parts(first):
            yield from part

    def column(self, name: str) -> FloatArray:
        """Return one column, shape (n_frames,). A view where memory holds all frames."""
        return self._columns(slice(self.columns.index(name), self.columns.index(name) + 1))[:, 0]

    def vector(self, name: str) -> FloatArray:
        """Return the three columns of a vector such as `tip`, shape (n_frames, 3), alike."""
        return self._columns(self._place_of(name))

    def sizes(self, name: str) -> FloatArray:
        """Return the magnitude of a vector such as `force` in each frame, shape (n_frames,)."""
        place = self._place_of(name)
        sizes = [np.linalg.norm(part[:, place], axis=1) for part in self._store.parts()]
        return np.concatenate([np.zeros(0), *sizes])

    def at_end(self, name: str) -> float:
        """Return a number of the last frame; 0 where there is none."""
        last = self.since(max(0, len(self) - 1))
        return float(last[-1, self.columns.index(name)]) if len(last) else 0.0

    def _place_of(self, name: str) -> slice:
        """Return which columns a vector has."""
        first = next(i for i, each in enumerate(self.columns) if each.startswith(f"{name}_x_"))
        return slice(first, first + 3)

    def _columns(self, place: slice) -> FloatArray:
        """Return some columns."""
        if self._store.are_in_memory:
            return self.rows[:, place]
        found = np.empty((len(self), place.stop - place.start))
        done = 0
        for part in self._store.parts():
            found[done : done + len(part)] = part[:, place]
            done += len(part)
        return found

    @property
    def hands(self) -> tuple[str, ...]:
        """Names of the graspers."""
        return tuple(
            each.removesuffix("_opening_m")
            for each in self.columns[len(COLUMNS) :]
            if each.endswith("_opening_m")
        )

    @property
    def is_audited(self) -> bool:
        """Whether the energy account was kept."""
        return len(self) > 0 and bool(np.isfinite(self.at_end("residual_j")))


def read_forces(path: Path, n_bytes: int | None = None) -> Recording:
    """Return the recording that a run wrote as `forces.csv`.

    A last row without an end of line is left out: a run that was killed did not finish it.

    Args:
        path: The file.
        n_bytes: How much of it is read [bytes]; None: all.

    Raises:
        ValueError: the file is no such table.
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        text = _text_lines(file, n_bytes)
        header = next(text, "").strip()
        columns = header.split(",")
        others = columns[len(COLUMNS) :]
        hands = [each.removesuffix("_opening_m") for each in others if each.endswith("_opening_m")]
        of_hands = [name for hand in hands for name in columns_of_hand(hand)]
        if columns != [*COLUMNS, *held_columns(_n_held(columns)), *of_hands]:
            raise ValueError(
                f"{path}: the first line is '{header[:200]}'; it must be the columns of a run"
            )
        recording = Recording(others)
        while lines := list(islice(text, _LINES_PER_READ)):
            if whole := [line for line in lines if line.endswith("\n")]:
                for row in np.loadtxt(whole, delimiter=",", ndmin=2):
                    recording.append(row)
    return recording


def _text_lines(file: BinaryIO, n_bytes: int | None) -> Iterator[str]:
    """Yield the lines of the first bytes of a file."""
    rest = math.inf if n_bytes is None else n_bytes
    while rest > 0 and (line := file.readline()):
        rest -= len(line)
        yield line.decode("ascii")


def lines_of_rows(rows: FloatArray) -> bytes:
    """Return rows as lines of text with the fewest digits that give the same bits again.

    JSON's numbers are those digits, and its encoder takes a fifth of the time of `repr`; it has no
    word for what is not finite.
    """
    if np.isinf(rows).any():
        return "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()).encode("ascii")
    lines = msgspec.json.encode(rows.tolist())[2:-2].replace(b"],[", b"\n")
    return lines.replace(b"null", b"nan") + b"\n"
