"""One frame as a row of `forces.csv`: see `scalpel_sim.recording.recording.COLUMNS`."""

import math
from typing import NamedTuple

import numpy as np

from bridge import TissueFrame
from scalpel_sim.recording.force_parts import add_up, force_parts
from scalpel_sim.recording.recording import N_OF_ACCOUNT
from tissue import BladeSegment, Energies, FloatArray, StepResult, Wrench
from tissue.support import kernel

NO_ACCOUNT = (math.nan,) * N_OF_ACCOUNT
"""The energies of a frame without an audit."""


class WallTimes(NamedTuple):
    """Wall times of one frame [s], in the order of the columns."""

    collision: float
    """Collision detection (CD)."""
    topology: float
    """Geometric changes (GC)."""
    relaxation: float
    """Relaxation (RX)."""
    pictures: float
    """Rendering (RD)."""
    frame: float
    """The whole frame, without pictures and without its recording."""


class FrameRows:
    """Makes the rows of a run.

    Args:
        frame: Where the tissue lies in the world.
    """

    def __init__(self, frame: TissueFrame) -> None:
        self._frame = frame
        self._at_blade = np.zeros(15)

    def row_of(
        self,
        time: float,
        blade: BladeSegment,
        felt: Wrench,
        raw: Wrench,
        result: StepResult,
        wall_times: WallTimes,
    ) -> list[float]:
        """Return the row of one frame: all columns but the last, the time that recording it takes.

        Args:
            time: Simulated time at which the frame began [s].
            blade: Where the blade is at the end of the frame, world frame.
            felt: Wrench that the arm felt in the frame, world frame.
            raw: That wrench before any limit of the device; the same object where none acted.
            result: Last result of the tissue, tissue frame.
            wall_times: Wall times of the frame and of its stages.
        """
        return [
            time,
            *blade.numbers[:3],
            *felt.numbers[:6],
            *raw.numbers[:6],
            *self._columns_at_blade(result, blade),
            result.cut_area,
            result.finished_area,
            result.n_tetrahedra,
            result.anchored_length,
            result.work_of_blade,
            *_account(result.energies),
            *wall_times,
        ]

    def _columns_at_blade(self, result: StepResult, blade: BladeSegment) -> list[float]:
        """Return the parts of the force [N], and the stiffness against displacement [N/m]."""
        frame, contacts, columns = self._frame, result.contacts.of_blade, self._at_blade
        if frame.is_rotated:
            parts = force_parts(contacts, frame.vectors_to_tissue(blade.forward))
            columns[:9] = frame.vectors_to_world(np.array(parts)).ravel()
            _write_upper(frame.matrix_to_world(result.stiffness[:3, :3]), columns)
        else:
            _write_at_blade(
                contacts.normal,
                contacts.normal_force,
                contacts.friction,
                result.stiffness,
                *blade.numbers[6:],
                columns,
            )
        return columns.tolist()


def _account(energies: Energies | None) -> tuple[float, ...]:
    """Return the terms of the energy account, and the residual [J]."""
    return NO_ACCOUNT if energies is None else (*energies[1:], energies.residual)


@kernel
def _write_at_blade(
    normal: FloatArray,
    normal_force: FloatArray,
    friction: FloatArray,
    stiffness: FloatArray,
    x: float,
    y: float,
    z: float,
    columns: FloatArray,
) -> None:
    """Write `ForceParts` and stiffness of a step, whose frame is parallel to the world.

    `x`, `y`, `z`: unit vector in which the blade cuts. As an array it would have to be made.
    """
    add_up(normal, normal_force, friction, (x, y, z), columns)
    _write_upper(stiffness, columns)


@kernel
def _write_upper(stiffness: FloatArray, columns: FloatArray) -> None:
    """Write the six different numbers of the stiffness against displacement."""
    for axis in range(3):
        columns[9 + axis] = stiffness[axis, axis]
    columns[12] = stiffness[0, 1]
    columns[13] = stiffness[0, 2]
    columns[14] = stiffness[1, 2]
