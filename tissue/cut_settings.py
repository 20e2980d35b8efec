"""Path against time step: what a user asks of a cut, and what the body has become by it.

A cut that follows the blade closely leaves small tetrahedra, and the smallest one bounds the time
step. Snapping and the guard trade the one against the other; the report says what it came to.
"""

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

MOST_SNAP = 1.0
"""Beyond a node's own size a crossing would move past its neighbours."""
MOST_GUARD = 0.5
"""At half the mean node size no edge of an ordinary mesh can be split any more: every cut would run
along faces that are there, and its path could miss the blade's by an element."""


@dataclass(frozen=True)
class CutSettings:
    """How closely the cut follows the blade, against how small the elements get that it makes.

    In units of the mesh's mean node size (the smallest altitude of the tetrahedra around a node).
    Larger values give larger elements and time steps, and a rougher cut.

    Raises:
        ValueError: a share is not finite, or out of its range.
    """

    snap: float = 0.3
    """A crossing nearer to a node than this share of that node's size uses the node."""
    floor: float = 0.3
    """... or nearer than this share of the mean node size."""
    guard: float = 0.15
    """No altitude of a new tetrahedron is smaller than this share of the mean node size."""
    crumb: float = 1.0
    """A piece smaller than this share of the mean tetrahedron is not cut loose."""

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


class MeshMeasures(NamedTuple):
    """What bounds the time step of a body, at one instant."""

    n_tetrahedra: int
    altitude: float
    """Smallest altitude of a tetrahedron, at rest [m]."""
    frequency: float
    """Bound on the body's angular frequencies [rad/s]."""
    time_step: float
    """Longest stable Runge-Kutta step of the body alone, without a blade [s]."""


class CutReport(NamedTuple):
    """Path error of the cuts so far, and what they did to elements and time step."""

    n_cut_nodes: int
    """Nodes on cut faces."""
    path_error_mean: float
    """Distance of the nodes on cut faces from where the blade truly passed, in the body at rest,
    mean [m]; 0 where there is no cut."""
    path_error_largest: float
    """The largest [m]."""
    node_size: float
    """Mean node size of the body as it was given [m]: what snapping and guard are shares of."""
    guard: float
    """Altitude that no split may go below [m]."""
    initial: MeshMeasures
    """Before the first cut."""
    now: MeshMeasures

    @property
    def growth(self) -> float:
        """Tetrahedra now for each one before."""
        return self.now.n_tetrahedra / self.initial.n_tetrahedra

    @property
    def frequency_growth(self) -> float:
        """Frequency bound now over before; 1 where nothing can move."""
        return self.now.frequency / self.initial.frequency if self.initial.frequency > 0.0 else 1.0

    @property
    def substep_growth(self) -> float:
        """Runge-Kutta steps that a second takes now for each one before."""
        before, now = self.initial.time_step, self.now.time_step
        return before / now if math.isfinite(before) else 1.0
