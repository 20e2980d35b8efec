"""What a scheme of cutting does for `Tissue`: it brings the path of the blade into the mesh."""

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
    """A way to cut a mesh. It owns the arrays of the current incision, not those of the body.

    A cut step is `detect`, then passes of `cut`, each after `grow` and another `detect`, until one
    no longer ends for want of room (`change.is_full`).
    """

    change: Change
    """What the last pass did; and the area cut since the body was made."""

    @property
    def n_active(self) -> int:
        """Number of active tetrahedra (paper, section 3)."""
        ...

    def detect(self, body: Body, visits: Visits, path: Path) -> None:
        """Find the active tetrahedra, and what the edge crossed on its way along `path`."""
        ...

    def cut(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what was detected: one pass."""
        ...

    def rest(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut up to the edge itself, which rests: one pass."""
        ...

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what is left when the blade has left the incision: one pass."""
        ...

    def forget(self) -> None:
        """Forget the incision; the next one is another."""
        ...

    def statistics(self, body: Body) -> SchemeStatistics | None:
        """Return counts of what was done so far, if the scheme keeps any."""
        ...

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        ...
