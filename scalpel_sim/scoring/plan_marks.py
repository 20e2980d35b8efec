"""The line of a plan on the skin as it is now, and what of it is open: for drawing."""

from typing import NamedTuple

import numpy as np

from scalpel_sim.scoring.plan import Plan
from scalpel_sim.strokes.asked import tetrahedra_at
from tissue import BoolArray, FloatArray, Tissue

_OPEN = 0.8
"""Share of the planned depth below a station that is cut where the line counts as open: a cut ends
a tolerance short, and the tip of a blade rounds its bottom."""


_ASIDE = 2e-3
"""Distance from the plan, and below the skin, of the material that a line follows [m]: on one side
of any cut that is near the plan. Material in the plan itself would go with either lip, in turn."""


class PlanMarks(NamedTuple):
    """The line of a plan now."""

    places: FloatArray
    """Places of the line in order [m], tissue frame, shape (n, 3)."""
    is_open: BoolArray
    """Whether the cut is open there, shape (n,)."""


class MarkedPlan:
    """Follows the stations of a plan with the material.

    Args:
        plan: A plan with stations.
        tissue: The body.
    """

    def __init__(self, plan: Plan, tissue: Tissue) -> None:
        from scipy.spatial import cKDTree  # 0.2 s, and only here

        self.plan = plan
        """The plan."""
        into, points = plan.into, plan.surface.points
        flat_stations, flat_points = (
            each - np.outer(each @ into, into) for each in (plan.stations, points)
        )
        _, self._station = cKDTree(flat_stations).query(flat_points)
        depths = (points - plan.stations[self._station]) @ into
        by_depth = np.lexsort((depths, self._station))
        stations, first = np.unique(self._station[by_depth], return_index=True)
        self._n = len(plan.stations)
        self._shown = stations
        # Those of the plan that are nearest to the skin: stations may be outside by rounding.
        self._highest = points[by_depth[first]]
        normals = plan.surface.normals[by_depth[first]]
        turns = np.sign(np.einsum("ni,ni->n", normals[1:], normals[:-1]))
        sides = np.cumprod(np.append(1.0, np.where(turns == 0.0, 1.0, turns)))
        self._beside = _ASIDE * (sides[:, None] * normals + into)
        self._areas = plan.surface.areas
        self._planned = np.bincount(self._station, self._areas, self._n)
        self.locate(tissue)

    def locate(self, tissue: Tissue) -> None:
        """Look the stations up anew, where the body has gone back to an earlier state."""
        body = tissue.snapshot()
        followed = self._highest + self._beside
        holders, _ = tetrahedra_at(followed, body._replace(positions=body.rest_positions))
        self._kept = holders >= 0
        if not self._kept.any():  # in a body that is thinner
            self._kept[:], self._beside[:] = True, 0.0
        self._points = tissue.material_points((self._highest + self._beside)[self._kept])

    def now(self, tissue: Tissue, is_covered: BoolArray) -> PlanMarks:
        """Return the line as it is.

        Args:
            tissue: The body.
            is_covered: Which places of the plan are cut, shape (n_places,).
        """
        cut = np.bincount(self._station, self._areas * is_covered, self._n)
        is_open = (cut >= _OPEN * self._planned)[self._shown][self._kept]
        return PlanMarks(tissue.positions_of(self._points) - self._beside[self._kept], is_open)
