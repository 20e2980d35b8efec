"""`Guide`: how far a blade is from what of a plan is to be cut next."""

import numpy as np

from scalpel_sim.recording.observations import farthest_points
from scalpel_sim.scoring.plan import Plan
from scalpel_sim.simulation import Simulation
from tissue import BoolArray, FloatArray, IntArray

MOST_PLACES = 64
"""Places that stand for a plan without a line."""


class Guide:
    """Finds the way of a blade to what of a plan is to be cut next.

    A plan with a line is represented by the bottom of the cut below each station of it, so that
    the way leads into the depth, and from the first to the last. The nearest one would hold a
    blade that has cut too little where it is: pressing does not cut. Another plan is represented
    by places spread over it, of which the nearest is next.

    Args:
        simulation: At its start.
        plan: The plan.
    """

    def __init__(self, simulation: Simulation, plan: Plan) -> None:
        self.plan = plan
        """The plan."""
        points = plan.surface.points
        self._has_order = len(plan.stations) > 0
        if self._has_order:
            wanted = plan.stations + np.outer(plan.depths, plan.into)
        else:
            wanted = farthest_points(points, min(MOST_PLACES, len(points)))
        self._places = _nearest(points, wanted)
        self._link, self._rest = simulation.link, points[self._places]
        self._holders: IntArray = np.full(len(self._places), -1)
        self._link.positions_of(self._rest, self._holders)
        self._first_holders = self._holders.copy()

    def begin(self) -> None:
        """Begin another episode with this plan."""
        self._holders[:] = self._first_holders

    @property
    def holders(self) -> IntArray:
        """The tetrahedron that held each place when it was looked up last, or -1."""
        return self._holders

    def way(self, tip: FloatArray, is_covered: BoolArray) -> float:
        """Return the distance from the tip to the place that is cut next [m]; 0: all are cut.

        Args:
            tip: The tip [m], tissue frame.
            is_covered: Which places of the plan are cut.
        """
        at = self._link.positions_of(self._rest, self._holders)
        is_left = ~is_covered[self._places]
        if not is_left.any():
            return 0.0
        ways = np.linalg.norm(at[is_left] - tip, axis=1)
        return float(ways[0] if self._has_order else ways.min())


def _nearest(points: FloatArray, wanted: FloatArray) -> IntArray:
    """Return the points that are nearest to some places, each once, in the order of these."""
    # |p - w|^2 without |w|^2, which is the same for all points.
    squares = (points**2).sum(axis=1) - 2.0 * wanted @ points.T
    return np.array(list(dict.fromkeys(squares.argmin(axis=1).tolist())))
