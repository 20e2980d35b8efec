"""What a run was before each stroke of its hand, and how it goes back there."""

from typing import Any, NamedTuple, Protocol

from bridge import InProcessLink
from scalpel_sim.simulation import Simulation
from scalpel_sim.state import SimulationState

MOST_STROKES = 50
"""Strokes that can be undone. Each keeps a state of the body in memory, some megabytes."""


class Follower(Protocol):
    """What has a part of the run so far: a file, a replay."""

    def mark(self) -> Any:
        """Return how far it has got."""

    def cut_back(self, mark: Any) -> None:
        """Forget what came after a mark."""


class _Moment(NamedTuple):
    """A run at the end of a frame."""

    state: SimulationState
    marks: list[Any]
    """Of each follower."""


class History:
    """What a run was at its start, and before each of its last strokes.

    Args:
        simulation: The run, at its start.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._followers: list[Follower] = []
        self._start: _Moment | None = None
        self._moments: list[_Moment] = []

    @property
    def can_go_back(self) -> bool:
        """Whether the run can go back: the state of a tissue in another process is out of reach."""
        return isinstance(self._simulation.link, InProcessLink)

    @property
    def n_strokes(self) -> int:
        """How many strokes can be undone."""
        return len(self._moments)

    def begin(self, *followers: Follower) -> None:
        """Keep the start.

        Args:
            followers: What goes back with the simulation.
        """
        self._followers += followers
        if self.can_go_back:
            self._start = self._now()

    def add(self) -> None:
        """Keep the present as that before a stroke."""
        if self.can_go_back:
            self._moments = [*self._moments[-(MOST_STROKES - 1) :], self._now()]

    def drop(self) -> None:
        """Forget the moment before the last stroke: that was none."""
        del self._moments[-1:]

    def undo(self) -> bool:
        """Go back to before the last stroke; return whether there was one."""
        return bool(self._moments) and self._go_to(self._moments.pop())

    def reset(self) -> bool:
        """Go back to the start; return whether it is known."""
        self._moments.clear()
        return self._start is not None and self._go_to(self._start)

    def _now(self) -> _Moment:
        marks = [each.mark() for each in self._followers]
        return _Moment(self._simulation.save_state(), marks)

    def _go_to(self, moment: _Moment) -> bool:
        self._simulation.load_state(moment.state)
        for follower, mark in zip(self._followers, moment.marks, strict=True):
            follower.cut_back(mark)
        return True
