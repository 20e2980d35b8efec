"""The interface of a scheme of cutting, which brings the path of the blade into the mesh."""

from typing import Protocol

from tissue.cutting.blade_path import Path
from tissue.mesh.body import Body
from tissue.mesh.changes import Change
from tissue.mesh.star import Visits
from tissue.types import SchemeStatistics

_SCHEMES = ("stellar", "paper")
"""Names of the schemes: ours, and that of Bielser, Maiwald and Gross."""


def checked_scheme(name: str) -> str:
    """Return the name of a scheme.

    Raises:
        ValueError: there is no such scheme.
    """
    if name not in _SCHEMES:
        raise ValueError(f"there is no scheme {name!r} of cutting. Schemes: {', '.join(_SCHEMES)}")
    return name


class Scheme(Protocol):
    """A method of cutting a mesh. It owns the arrays of the incision, not those of the body.

    A cut step is `detect` (CD), then `cut` (GC). Where `cut` runs out of room (`change.is_full`),
    `grow`, `detect` and `cut` follow until one pass is complete.
    """

    change: Change
    """What the last pass changed, and the area cut since the body was made."""

    @property
    def n_active(self) -> int:
        """Number of active tetrahedra (paper, section 3)."""
        ...

    def detect(self, body: Body, visits: Visits, path: Path) -> None:
        """Detect collisions: the active tetrahedra, and what the edge crossed along `path`."""
        ...

    def cut(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what was detected, in one pass."""
        ...

    def cut_to_edge(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut up to the edge itself, which rests, in one pass."""
        ...

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what remains when the blade has left the incision, in one pass."""
        ...

    def finish(self, body: Body, visits: Visits, path: Path) -> None:
        """Part small bridges that the blade passed over, in one pass; nothing may be left to do."""
        ...

    def forget(self) -> None:
        """Forget the incision: what is detected next belongs to another."""
        ...

    def statistics(self, body: Body) -> SchemeStatistics | None:
        """Return counts of what was done so far; None where the scheme keeps none."""
        ...

    @property
    def doubled_nodes(self) -> int:
        """For how many times as many doubled nodes as usual a pass is to have room."""
        ...

    def make_room(self, lacking: int) -> None:
        """Make twice the room for what lacked it: `LISTS`, or `NODES` by `doubled_nodes`."""
        ...

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        ...
