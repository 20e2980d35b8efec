"""How a sweep reaches the tissue. The arm side cannot tell one link from another."""

from typing import Protocol

from tissue.tissue import Tissue
from tissue.types import BladeSweep, Snapshot, StepResult, Surface


class TissueLink(Protocol):
    """A tissue that is here, in another process, or on another machine."""

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Let the tissue live through `dt` [s] while the blade does `sweep` (None: no blade near)."""

    def snapshot(self) -> Snapshot:
        """Return the whole state of the body."""

    def surface(self) -> Surface:
        """Return the boundary triangles, for a picture."""

    def pieces(self) -> int:
        """Return the number of connected pieces."""

    def close(self) -> None:
        """Let go of the tissue."""


class InProcessLink:
    """A tissue in this process: a call is a call."""

    def __init__(self, tissue: Tissue) -> None:
        self._tissue = tissue

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """See `TissueLink.step`."""
        return self._tissue.step(sweep, dt)

    def snapshot(self) -> Snapshot:
        """See `TissueLink.snapshot`."""
        return self._tissue.snapshot()

    def surface(self) -> Surface:
        """See `TissueLink.surface`."""
        return self._tissue.surface()

    def pieces(self) -> int:
        """See `TissueLink.pieces`."""
        return self._tissue.pieces()

    def close(self) -> None:
        """See `TissueLink.close`."""
