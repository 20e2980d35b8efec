"""Closeness of cuts to the blade, against the time step: settings, and a report of the result.

A cut that follows the blade closely leaves small tetrahedra, and the smallest one limits the time
step. Snapping and the guard trade the one against the other.
"""

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

SCHEMES = ("stellar", "paper")
"""Names of the schemes: ours, and that of Bielser, Maiwald and Gross."""

MOST_SNAP = 1.0
"""Largest snap: beyond a node's own size a crossing would move past its neighbours."""
MOST_GUARD = 0.5
"""Largest guard: at half the mean node size no edge of an ordinary mesh can be split. Every cut
would run along existing faces, up to an element off the blade's path."""


@dataclass(frozen=True)
class CutSettings:
    """Closeness of cuts to the path of the blade, against the size of new elements.

    Lengths are shares of the mesh's mean node size; the size of a node is the smallest altitude of
    the tetrahedra around it. Larger values give larger elements and time steps, and a rougher cut.

    Raises:
        ValueError: a share is not finite, or out of its range.
    """

    snap: float = 0.3
    """Distance, as a share of a node's own size, within which a crossing uses the node."""
    floor: float = 0.3
    """Distance, as a share of the mean node size, within which a crossing uses a node in any
    case."""
    guard: float = 0.15
    """Least altitude of a new tetrahedron, as a share of the mean node size."""
    crumb: float = 3.0
    """Volume, in mean tetrahedra, below which a piece is not cut loose. The default is half a cube
    in a mesh of cubes. In a body of few elements it is an eighth of the body, if less."""

    def __post_init__(self) -> None:
        most = {"snap": MOST_SNAP, "floor": MOST_SNAP, "guard": MOST_GUARD, "crumb": math.inf}
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and 0.0 <= value <= most[field.name]):
                limit = "" if math.isinf(most[field.name]) else f" and at most {most[field.name]:g}"
                raise ValueError(
                    f"{field.name} is {value}; it is a share of the mesh's mean element, finite, "
                    f"at least 0{limit}"
                )


LEAST_UNDAMPED = 1.6
"""Least frequency times step of the methods where nothing is damped: Verlet's 2, with its safety of
0.8."""


def undamped_steps(frequency: float, seconds: float) -> float:
    """Return how many steps a body of an angular frequency [1/s] takes at most without damping."""
    return frequency * seconds / LEAST_UNDAMPED


class MeshMeasures(NamedTuple):
    """Size of a mesh and what limits its time step, at one instant."""

    n_tetrahedra: int
    """Number of tetrahedra."""
    altitude: float
    """Smallest altitude of a tetrahedron, at rest [m]."""
    frequency: float
    """Bound on the body's angular frequencies [rad/s]."""
    time_step: float
    """Longest stable step of the body alone, without a blade [s]."""
    added_mass: float
    """Mass that mass scaling has added, as a share of the body's own."""
    most_added_mass: float
    """The most that it had added so far, as a share of the body's own."""
    inverted: float
    """Tetrahedra that are inside out, as a share of all: forces around them mean little."""

    def undamped_steps(self, seconds: float) -> float:
        """Return how many steps such a time [s] takes at most if nothing is damped."""
        return undamped_steps(self.frequency, seconds)


class CutReport(NamedTuple):
    """Path error of all cuts so far, and the elements and the time step before and after them."""

    n_cut_nodes: int
    """Number of nodes on cut faces."""
    path_error_mean: float
    """Mean distance of the nodes on cut faces from where the blade passed, in the body at rest [m];
    0 where there is no cut."""
    path_error_largest: float
    """Largest distance of a node on a cut face from where the blade passed [m]."""
    node_size: float
    """Mean node size of the body as it was given [m], the unit of `CutSettings`."""
    guard: float
    """Least altitude that a split may leave [m]."""
    initial: MeshMeasures
    """Measures before the first cut."""
    now: MeshMeasures
    """Measures now."""

    @property
    def growth(self) -> float:
        """Number of tetrahedra now over that before."""
        return self.now.n_tetrahedra / self.initial.n_tetrahedra

    @property
    def frequency_growth(self) -> float:
        """Frequency bound now over that before; 1 where no node can move."""
        return self.now.frequency / self.initial.frequency if self.initial.frequency > 0.0 else 1.0

    @property
    def substep_growth(self) -> float:
        """Steps of a second now over those before."""
        before, now = self.initial.time_step, self.now.time_step
        return before / now if math.isfinite(before) else 1.0
