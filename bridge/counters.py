"""What a bridge counts: frames, and everything that came between the tissue and the arm."""

from typing import Any, NamedTuple

from bridge.coupling.passivity import PassivityCounters


class Counters(NamedTuple):
    """What happened since the start, in frames of the arm."""

    frames: int
    """Calls of `Bridge.step`."""
    answers: int
    """Steps of the tissue: as many, or one in every few frames."""
    rejected: int
    """Steps in which the broad phase saw that the blade could not touch the tissue."""
    force_limited: int
    """The force was above the device's limit."""
    torque_limited: int
    """The torque was above the device's limit."""
    slew_limited: int
    """The force changed faster than the device can."""
    not_finite: int
    """The tissue answered with a NaN or an infinity."""
    absurd: int
    """The tissue answered with a wrench that only a simulation that blows up gives."""
    silent: int
    """The tissue had not answered for 10 ms or more."""
    faded: int
    """Less than the tissue's wrench was felt: it was silent for too long, or is just back."""
    passivity: PassivityCounters
    """The energy that went in and out at the arm's blade, and what was damped of it."""
    impulse_written_off: float
    """What the tissue felt and the arm did not when contacts ended [N s]: see `ImpulseDebt`. Zero
    where the tissue is asked in each frame."""

    def as_numbers(self) -> dict[str, Any]:
        """Return them by name, for a report."""
        return self._asdict() | {"passivity": self.passivity._asdict()}
