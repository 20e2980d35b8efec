"""What happened in each frame, as one table of numbers."""

import re
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tissue import Energies, FloatArray

ACCOUNT = (*(f"{term}_j" for term in Energies._fields[1:]), "residual_j")
"""Columns of the energy account since the start: the terms of `tissue.Energies`, and the residual.
NaN without an audit."""
N_OF_ACCOUNT = len(ACCOUNT)


def _vector(name: str, unit: str) -> tuple[str, ...]:
    return tuple(f"{name}_{axis}_{unit}" for axis in "xyz")


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
    "cd_s",
    "gc_s",
    "rx_s",
    "rd_s",
    "frame_s",
    "recording_s",
)
"""Names and units. Vectors are in the world frame. `force` and `torque` are what the arm feels,
averaged over the frame, the torque about the tip; `tissue_force` and `tissue_torque` are what the
tissue exerts, before the limits of the device. `edge_force`, `pressing_force` and `friction_force`
are what the tissue does to the blade's edge, to its faces, and along them, at the end of the frame;
`stiffness` is how fast that force changes with the blade's position. `cd_s` to `rd_s` are wall
times of the stages that the paper's Table 1 names: collision detection, geometric changes,
relaxation and rendering. `frame_s` is the wall time of the whole frame without rendering (`rd_s`)
and without the recording of its row (`recording_s`)."""


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


FRAMES_AT_FIRST = 1024


class Recording:
    """Rows of `COLUMNS`, one per frame. Grows by doubling, so that a frame allocates nothing.

    Args:
        n_frames: Room at first.
        others: Further columns: see `held_columns` and `columns_of_hand`, in this order.
    """

    def __init__(self, n_frames: int = FRAMES_AT_FIRST, others: Sequence[str] = ()) -> None:
        self.columns = (*COLUMNS, *others)
        """Names and units of all columns."""
        self.n_held = _n_held(self.columns)
        """Number of attachments."""
        self._row = struct.Struct(f"{len(self.columns)}d")
        self._n = 0
        self._take_rows(np.zeros((max(n_frames, 1), len(self.columns))))

    def _take_rows(self, rows: FloatArray) -> None:
        self._rows, self._memory = rows, rows.data.cast("B")

    def __len__(self) -> int:
        return self._n

    @property
    def rows(self) -> FloatArray:
        """All frames so far, shape (n_frames, n_columns). A view."""
        return self._rows[: self._n]

    def append(self, row: Sequence[float]) -> None:
        """Add one frame: a number for each of `columns`."""
        if self._n == len(self._rows):
            self._take_rows(np.concatenate([self._rows, np.zeros_like(self._rows)]))
        # For NumPy to look at fifty numbers of a list takes three times as long.
        self._row.pack_into(self._memory, self._n * self._row.size, *row)
        self._n += 1

    def cut_back(self, n_frames: int) -> None:
        """Forget all frames but the first `n_frames`, of which there are as many."""
        self._n = n_frames

    def column(self, name: str) -> FloatArray:
        """Return one column, shape (n_frames,). A view."""
        return self.rows[:, self.columns.index(name)]

    def vector(self, name: str) -> FloatArray:
        """Return the three columns of a vector such as `tip`, shape (n_frames, 3). A view."""
        first = next(i for i, each in enumerate(self.columns) if each.startswith(f"{name}_x_"))
        return self.rows[:, first : first + 3]

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
        return len(self) > 0 and bool(np.isfinite(self.column("residual_j")[-1]))


def read_forces(path: Path) -> Recording:
    """Return the recording that a run wrote as `forces.csv`.

    A last row without an end of line is left out: a run that was killed did not finish it.

    Raises:
        ValueError: the file is no such table.
        OSError: the file cannot be read.
    """
    with path.open(encoding="ascii") as file:
        header = file.readline().strip()
        columns = header.split(",")
        others = columns[len(COLUMNS) :]
        hands = [each.removesuffix("_opening_m") for each in others if each.endswith("_opening_m")]
        of_hands = [name for hand in hands for name in columns_of_hand(hand)]
        if columns != [*COLUMNS, *held_columns(_n_held(columns)), *of_hands]:
            raise ValueError(
                f"{path}: the first line is '{header[:200]}'; it must be the columns of a run"
            )
        lines = [line for line in file if line.endswith("\n")]
    rows = np.loadtxt(lines, delimiter=",", ndmin=2) if lines else np.zeros((0, len(columns)))
    recording = Recording(len(rows), others)
    for row in rows:
        recording.append(row)
    return recording
