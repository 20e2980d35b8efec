"""Terms of the faces that a cut has opened, in the body at rest: nothing of them counts twice."""

import numpy as np

from scalpel_sim.scoring.plan import STATION
from scalpel_sim.scoring.sampled_surface import parts_of_triangles, places_on_edges
from scalpel_sim.scoring.yardstick import Yardstick
from tissue import BoolArray, CutFaces, FloatArray

FACE_SPACING = 3e-3
"""Longest side of the parts of a face whose middles are compared with the plan [m]."""

EDGE_SPACING = 0.5 * STATION
"""Distance between places on the edges of a face, by which depths are found [m]."""

N_CAUSES = 3
"""Causes of a cut face: see `tissue.CutFaces`."""


class CutTerms:
    """Cuts along the plan, and beside it, so far.

    Args:
        yardstick: The plan, and parts to be spared.
    """

    def __init__(self, yardstick: Yardstick) -> None:
        self._yardstick = yardstick
        plan = yardstick.plan
        self._is_covered = np.zeros(0 if plan is None else len(plan.surface.points), bool)
        self._area_covered, self._planned = 0.0, 0.0 if plan is None else plan.area
        self._reached = np.zeros(0 if plan is None else len(plan.stations))
        self._squares = 0.0
        self.covered = None if plan is None else 0.0
        """Share of the plan with a cut within the tolerance; None without a plan."""
        self.area = 0.0
        """Area of all cuts [m2]."""
        self.off_plan = 0.0
        """Area farther than the tolerance from the plan [m2]."""
        self.largest_error = 0.0
        """Greatest distance of a cut from the plan [m]."""
        self.area_of_cause = np.zeros(N_CAUSES)
        """Area by cause [m2]: blade, finished bridges, given."""
        self.spared_area = np.zeros(len(yardstick.spared))
        """Area cut within each part that is to be spared [m2]."""
        self.spared_distance = np.full(len(yardstick.spared), np.inf)
        """Nearest distance of a cut from each of them [m]."""

    def take(self, faces: CutFaces) -> None:
        """Count new faces."""
        if faces.n == 0:
            return
        self.area += float(faces.areas.sum())
        self.area_of_cause += np.bincount(faces.causes, faces.areas, N_CAUSES)
        corners = faces.corners.reshape(-1, 3)
        middles, _, areas = parts_of_triangles(corners, FACE_SPACING)
        on_edges = places_on_edges(corners, EDGE_SPACING)
        self._compare_with_plan(corners, middles, areas)
        if self._yardstick.station_search is not None:
            self._yardstick.station_search.deepen(on_edges, self._reached)
        for i, part in enumerate(self._yardstick.spared):
            is_within = np.isin(faces.labels, part.labels).all(axis=1)
            if is_within.any():
                self.spared_area[i] += float(faces.areas[is_within].sum())
                self.spared_distance[i] = 0.0
            for places in (on_edges, middles):
                least = float(self.spared_distance[i])
                self.spared_distance[i] = part.search.least_distance(places, least)

    def _compare_with_plan(
        self, corners: FloatArray, middles: FloatArray, areas: FloatArray
    ) -> None:
        """Compare faces with the plan.

        Args:
            corners: Corners of the faces one after the other [m], shape (3 n, 3).
            middles: Middles of their parts [m], shape (n_parts, 3).
            areas: Areas of their parts [m2], shape (n_parts,).
        """
        search = self._yardstick.plan_search
        if search is None:
            return
        tolerance, distances = self._yardstick.task.tolerance, search.distances(middles)
        self.off_plan += float(areas @ (distances > tolerance))
        self._squares += float(areas @ distances**2)
        self.largest_error = max(self.largest_error, float(search.distances(corners).max()))
        self._area_covered += search.mark_near(corners, tolerance, self._is_covered)
        self.covered = 1.0 if self._is_covered.all() else self._area_covered / self._planned

    @property
    def is_covered(self) -> BoolArray:
        """Which places of the plan have a cut within the tolerance, shape (n,). A copy."""
        return self._is_covered.copy()

    @property
    def path_error(self) -> float:
        """Root mean square of the distance of the cut from the plan [m]; 0 without a cut."""
        return float((self._squares / self.area) ** 0.5) if self.area > 0.0 else 0.0

    @property
    def depth_error(self) -> float | None:
        """Mean error of depth [m]; None without stations."""
        plan = self._yardstick.plan
        if plan is None or len(plan.stations) == 0:
            return None
        return float(np.abs(self._reached - plan.depths).mean())

    @property
    def is_spared(self) -> bool:
        """Whether all that is to be spared is whole, and no cut is within its margin."""
        margins = np.array([part.margin for part in self._yardstick.spared])
        is_whole = not self.spared_area.any()
        return bool(is_whole and (self.spared_distance >= margins).all())
