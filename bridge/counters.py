"""The counters of a bridge: frames, answers, and every change of the tissue's wrench."""

from typing import Any, NamedTuple, Self

from bridge.coupling.coupling import Coupling
from bridge.coupling.passivity import PassivityCounters


class Counters(NamedTuple):
    """Counts since the start, in frames of the arm. `summary.json` has them under these names."""

    frames: int
    """Calls of `Bridge.step`."""
    answers: int
    """Answers of the tissue: one per frame, or one in every few."""
    rejected: int
    """Queries in which the broad phase found that the blade could not touch the tissue."""
    force_limited: int
    """Frames in which the force was above the device's limit."""
    torque_limited: int
    """Frames in which the torque was above the device's limit."""
    slew_limited: int
    """Frames in which the force changed faster than the device can."""
    not_finite: int
    """Frames in which the wrench had a NaN or an infinity."""
    absurd: int
    """Frames in which the wrench was implausible, as of a simulation that diverges."""
    silent: int
    """Frames in which the tissue had not answered for 10 ms or more."""
    faded: int
    """Frames in which less than the full wrench was felt, during or after a silence."""
    passivity: PassivityCounters
    """Energy that went in and out at the arm's blade, and the part that was dissipated."""
    impulse_written_off: float
    """Impulse of the tissue that the arm had not felt when contacts ended [N s]; zero where the
    tissue is queried in each frame. See `ImpulseCompensation`."""

    @classmethod
    def of(
        cls, frames: int, answers: int, rejected: int, coupling: Coupling, written_off: float
    ) -> Self:
        """Return the counts of a bridge and of its coupling.

        Args:
            frames: Calls of `Bridge.step`.
            answers: Answers of the tissue.
            rejected: Queries in which the blade could not touch the tissue.
            coupling: Coupling of the bridge, which counts its changes of the wrench.
            written_off: Impulse that was written off [N s].
        """
        return cls(
            frames,
            answers,
            rejected,
            coupling.n_force_limited,
            coupling.n_torque_limited,
            coupling.n_slew_limited,
            coupling.n_not_finite,
            coupling.n_implausible,
            coupling.n_silent,
            coupling.n_faded,
            coupling.passivity,
            written_off,
        )

    def as_numbers(self) -> dict[str, Any]:
        """Return the counts by name, for a report."""
        return self._asdict() | {"passivity": self.passivity._asdict()}
