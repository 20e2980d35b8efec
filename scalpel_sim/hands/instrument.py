"""What a person may lead: the blade, or a grasper."""

from typing import Protocol

from scalpel_sim.hands.limited_pose import LimitedPose
from tissue import FloatArray


class Instrument(Protocol):
    """An instrument that a person leads when they have chosen it, and which rests else."""

    name: str
    """What the page calls it."""
    pose: LimitedPose
    """Where it is, and where it is wanted."""

    @property
    def is_closed(self) -> bool | None:
        """Whether its jaws are closed, or on their way there; None: it has none."""

    @property
    def numbers(self) -> list[float]:
        """Where it is led, tissue frame, and how far its jaws are open."""

    @property
    def tip(self) -> FloatArray:
        """What of it is led, in the world [m], shape (3,)."""

    def close_jaws(self, closed: bool) -> None:
        """Close or open its jaws, if it has any."""

    def advance(self, t: float, *, is_engaged: bool, moves: bool) -> None:
        """Go on to time `t` [s], and record where it is.

        Args:
            t: A frame after the last one [s].
            is_engaged: Whether a person leads it.
            moves: Whether it goes on; else it rests where it is.
        """

    def finish(self, t: float) -> None:
        """End its record at time `t` [s]."""

    def take_rows(self) -> list[list[float]]:
        """Return the rows that were recorded since the last call."""
