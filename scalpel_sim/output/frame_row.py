"""One frame as a row of `forces.csv`: see `scalpel_sim.output.recording.COLUMNS`."""

import math
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import NamedTuple

from bridge import TissueFrame
from scalpel_sim.output.force_parts import force_rows
from scalpel_sim.output.recording import N_OF_ACCOUNT
from tissue import BladeContacts, BladeSegment, Energies, FloatArray, StepResult, Wrench

_UPPER: Callable[[list[float]], tuple[float, ...]] = itemgetter(0, 4, 8, 1, 2, 5)
"""Takes the six different numbers of a symmetric 3 x 3 matrix, in the order of the columns."""

_UPPER_OF_SIX: Callable[[list[float]], tuple[float, ...]] = itemgetter(0, 7, 14, 1, 2, 8)
"""Takes the same of the first three rows and columns of a 6 x 6 matrix."""

NO_ACCOUNT = (math.nan,) * N_OF_ACCOUNT
"""The energies of a frame without an audit."""

_NO_FORCES = (0.0,) * 9


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

    def row_of(
        self,
        time: float,
        blade: BladeSegment,
        felt: Wrench,
        raw: Wrench,
        result: StepResult,
        wall_times: WallTimes,
    ) -> tuple[float, ...]:
        """Return the row of one frame: all columns but the last, the time that recording it takes.

        Args:
            time: Simulated time at which the frame began [s].
            blade: Where the blade is at the end of the frame, world frame.
            felt: Wrench that the arm felt in the frame, world frame.
            raw: That wrench before any limit of the device; the same object where none acted.
            result: Last result of the tissue, tissue frame.
            wall_times: Wall times of the frame and of its stages.
        """
        six = (*felt.force.tolist(), *felt.torque.tolist())
        return (
            time,
            *blade.tip.tolist(),
            *six,
            *(six if raw is felt else (*raw.force.tolist(), *raw.torque.tolist())),
            *self._parts(result.contacts, blade.forward),
            *self._stiffness(result.stiffness),
            result.cut_area,
            result.finished_area,
            result.n_tetrahedra,
            result.anchored_length,
            result.work_of_blade,
            *_account(result.energies),
            *wall_times,
        )

    def _parts(self, contacts: BladeContacts, forward: FloatArray) -> Sequence[float]:
        """Return the rows of `ForceParts`, in the world, one after the other [N]."""
        if not len(contacts.normal_force):
            return _NO_FORCES
        frame = self._frame
        if not frame.is_rotated:
            return force_rows(contacts, forward).ravel().tolist()
        parts = force_rows(contacts, frame.vectors_to_tissue(forward))
        return frame.vectors_to_world(parts).ravel().tolist()

    def _stiffness(self, stiffness: FloatArray) -> Sequence[float]:
        """Return the different numbers of the stiffness against displacement, in the world."""
        if not self._frame.is_rotated:
            return _UPPER_OF_SIX(stiffness.ravel().tolist())
        return _UPPER(self._frame.matrix_to_world(stiffness[:3, :3]).ravel().tolist())


def _account(energies: Energies | None) -> tuple[float, ...]:
    """Return the terms of the energy account, and the residual [J]."""
    return NO_ACCOUNT if energies is None else (*energies[1:], energies.residual)
