"""One frame as a row of `forces.csv`: see `scalpel_sim.output.recording.COLUMNS`."""

from operator import itemgetter
from typing import NamedTuple

import numpy as np

from bridge import TissueFrame
from scalpel_sim.output.force_parts import force_rows
from scalpel_sim.output.recording import N_OF_ACCOUNT
from tissue import BladeSegment, Energies, StepResult, Wrench

UPPER = itemgetter(0, 4, 8, 1, 2, 5)
"""Takes the six different numbers of a symmetric 3 x 3 matrix, in the order of the columns."""

NO_ACCOUNT = (np.nan,) * N_OF_ACCOUNT
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


def row_of(
    time: float,
    blade: BladeSegment,
    felt: Wrench,
    raw: Wrench,
    result: StepResult,
    frame: TissueFrame,
    wall_times: WallTimes,
) -> tuple[float, ...]:
    """Return the row of one frame: all columns but the last, the time that recording it takes.

    Args:
        time: Simulated time at which the frame began [s].
        blade: Where the blade is at the end of the frame, world frame.
        felt: Wrench that the arm felt in the frame, world frame.
        raw: That wrench before any limit of the device.
        result: Last result of the tissue, tissue frame.
        frame: Where the tissue lies in the world.
        wall_times: Wall times of the frame and of its stages.
    """
    parts = force_rows(result.contacts, frame.vectors_to_tissue(blade.forward))
    stiffness = frame.matrix_to_world(result.stiffness[:3, :3])
    return (
        time,
        *blade.tip.tolist(),
        *felt.force.tolist(),
        *felt.torque.tolist(),
        *raw.force.tolist(),
        *raw.torque.tolist(),
        *frame.vectors_to_world(parts).ravel().tolist(),
        *UPPER(stiffness.ravel().tolist()),
        result.cut_area,
        result.finished_area,
        result.n_tetrahedra,
        result.anchored_length,
        result.work_of_blade,
        *_account(result.energies),
        *wall_times,
    )


def _account(energies: Energies | None) -> tuple[float, ...]:
    """Return the terms of the energy account, and the residual [J]."""
    return NO_ACCOUNT if energies is None else (*energies[1:], energies.residual)
