"""How a sweep reaches the tissue. The arm side cannot tell one link from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

from tissue import (
    BladeShape,
    BladeSweep,
    Chunks,
    CutReport,
    FloatArray,
    Material,
    Snapshot,
    StepResult,
    Surface,
)

if TYPE_CHECKING:  # the side without the tissue starts without its compiler
    from tissue import Tissue


class LinkError(ConnectionError):
    """The tissue cannot be reached, does not answer, or answers what nobody can read."""


class TissueDescription(NamedTuple):
    """What the arm side must know of a body that it does not hold."""

    scene: str
    """What was built, as the command line names it."""
    material: Material
    bounds: FloatArray
    """Lowest and highest corner now [m], shape (2, 3)."""
    n_tetrahedra: int
    n_nodes: int
    blade: BladeShape | None = None
    """The body of the blade that cuts it; None for the paper's blade, a line."""
    floor: float | None = None
    """Height of the floor that pieces land on [m]; None for no floor."""


class TissueLink(Protocol):
    """A tissue that is here, or in another process."""

    def describe(self) -> TissueDescription:
        """Return what the arm side must know of the body now."""

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Let the tissue live through `dt` [s] while the blade does `sweep` (None: no blade near).

        Raises:
            LinkError: the tissue is in another process and did not answer.
        """

    def snapshot(self) -> Snapshot:
        """Return the whole state of the body."""

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body, and how fast its nodes are now."""

    def surface(self) -> Surface:
        """Return the boundary triangles, for a picture."""

    def n_pieces(self) -> int:
        """Return the number of connected pieces; `tissue.mesh.pieces.pieces_of` tells more."""

    def quality(self) -> CutReport:
        """Return the path error of the cuts so far, and what they did to elements and time step."""

    def close(self) -> None:
        """Let go of the tissue."""


class InProcessLink:
    """A tissue in this process: a call is a call."""

    def __init__(self, tissue: Tissue, scene: str = "") -> None:
        self._tissue = tissue
        self._scene = scene

    def describe(self) -> TissueDescription:
        """See `TissueLink.describe`."""
        return TissueDescription(
            self._scene,
            self._tissue.material,
            self._tissue.bounds,
            self._tissue.n_tetrahedra,
            self._tissue.n_nodes,
            self._tissue.blade,
            self._tissue.floor,
        )

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """See `TissueLink.step`."""
        return self._tissue.step(sweep, dt)

    def snapshot(self) -> Snapshot:
        """See `TissueLink.snapshot`."""
        return self._tissue.snapshot()

    def chunks(self) -> Chunks:
        """See `TissueLink.chunks`."""
        return self._tissue.chunks()

    def surface(self) -> Surface:
        """See `TissueLink.surface`."""
        return self._tissue.surface()

    def n_pieces(self) -> int:
        """See `TissueLink.n_pieces`."""
        return self._tissue.n_pieces()

    def quality(self) -> CutReport:
        """See `TissueLink.quality`."""
        return self._tissue.cut_report()

    def close(self) -> None:
        """See `TissueLink.close`."""
