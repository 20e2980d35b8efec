"""`Instrument`: what a hand leads, and what acts on the tissue: see `docs/extend.md`."""

from typing import Protocol

from scalpel_sim.recording.columns import ColumnGroup


class Controller(Protocol):
    """Leads an instrument in each frame: along a script, or as a person does."""

    def lead(self, t: float) -> None:
        """Lead it to its pose at time `t` [s], a step after the last one."""


class CoupledBody(Protocol):
    """A body that acts on the tissue in each frame, and on which the tissue acts."""

    def follow(self) -> None:
        """Move to where the model is, before the tissue's step: between MuJoCo's two halves."""

    def apply(self) -> None:
        """Apply to the model what the tissue did in its step."""


class Instrument(CoupledBody, Protocol):
    """A coupled body that is led, and recorded.

    A frame is `lead` of each instrument, MuJoCo's `mj_step1`, `follow` of each body, the tissue's
    step, `apply` of each body, `mj_step2`, and the columns of each instrument.
    """

    name: str
    """Name, with which those of its quantities begin: no other instrument has it."""

    @property
    def columns(self) -> ColumnGroup:
        """Quantities that are recorded of it."""

    @property
    def duration(self) -> float:
        """Simulated time at which its script ends [s]."""

    def lead(self, t: float) -> None:
        """Lead it to its pose at time `t` [s], a step after the last one."""
