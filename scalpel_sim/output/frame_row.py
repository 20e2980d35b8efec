"""One frame as a row of `forces.csv`: see `scalpel_sim.output.recording.COLUMNS`."""

from operator import itemgetter

import numpy as np

from bridge import TissueFrame
from scalpel_sim.output.force_parts import force_parts
from scalpel_sim.output.recording import N_OF_ACCOUNT
from tissue import BladeSegment, Energies, StageTimes, StepResult, Wrench

UPPER = itemgetter(0, 4, 8, 1, 2, 5)
"""Of a symmetric matrix of nine numbers, in the order of the columns."""

NO_ACCOUNT = (np.nan,) * N_OF_ACCOUNT
"""What is not known without an audit."""


def row_of(
    time: float,
    blade: BladeSegment,
    felt: Wrench,
    raw: Wrench,
    result: StepResult,
    profile: StageTimes,
    frame: TissueFrame,
    *,
    picture_seconds: float,
    frame_seconds: float,
) -> tuple[float, ...]:
    """Return the row of one frame.

    Args:
        time: Simulated time at which it began [s].
        blade: Where the blade is at its end, world frame.
        felt: What the arm felt in it, world frame.
        raw: The same before any limit of the device.
        result: What the tissue said last, tissue frame.
        profile: Wall times of its stages in this frame.
        frame: Where the tissue lies in the world.
        picture_seconds: Wall time of pictures [s].
        frame_seconds: Wall time of all else [s].
    """
    parts = force_parts(result.contacts, frame.vectors_to_tissue(blade.forward))
    stiffness = frame.matrix_to_world(result.stiffness[:3, :3])
    return (
        time,
        *blade.tip.tolist(),
        *felt.force.tolist(),
        *felt.torque.tolist(),
        *raw.force.tolist(),
        *raw.torque.tolist(),
        *(frame.vectors_to_world(np.array(parts)).ravel().tolist()),
        *UPPER(stiffness.ravel().tolist()),
        result.cut_area,
        result.n_tetrahedra,
        result.anchored_length,
        result.work_of_blade,
        *_account(result.energies),
        profile.collision,
        profile.topology,
        profile.relaxation,
        picture_seconds,
        frame_seconds,
    )


def _account(energies: Energies | None) -> tuple[float, ...]:
    """Return where the work of the blade went, and what is not accounted for [J]."""
    return NO_ACCOUNT if energies is None else (*energies[1:], energies.residual)
