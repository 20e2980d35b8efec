"""The line of a plan as a pen draws it on the skin before a cut: ink for cameras to see."""

import numpy as np

from scalpel_sim.scoring.score import Score
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.judged import plan_marks
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray

_WIDTH = 1.5e-3
"""Width of the line [m]: pens for skin draw 1 to 2 mm."""

_RIDGE = 0.5e-3
"""Height of its middle above the places of the line [m], which are up to some tenths of a
millimetre below a skin of triangles that bends."""

_WIDEST_GAP = 3.0
"""Distance of two places, over that of the first two, beyond which another line begins."""


def pen_mark(simulation: Simulation) -> TriangleMesh:
    """Return the line of the plan on the skin as it is now, tissue frame; empty without one."""
    marks, score = plan_marks(simulation), simulation.score
    if marks is None or len(marks.places) < 2:
        return TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros((0, 3)))
    assert isinstance(score, Score) and score.plan is not None
    return drawn_line(marks.places, -score.plan.into)


def drawn_line(places: FloatArray, up: FloatArray) -> TriangleMesh:
    """Return a line as a low roof along it.

    Args:
        places: Of the line, in order [m], shape (n, 3), two at least.
        up: Unit vector out of the body.
    """
    ways = np.diff(places, axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    aside = np.cross(up, np.gradient(places, axis=0))
    aside /= np.maximum(np.linalg.norm(aside, axis=1), 1e-12)[:, None]  # [m]: none doubles back
    half = 0.5 * _WIDTH * aside
    rows = np.stack([places - half, places + _RIDGE * up, places + half], axis=1)
    first = 3 * np.flatnonzero(lengths <= _WIDEST_GAP * lengths[0])
    # Two faces of the roof for each piece of the line, of two triangles each.
    corners = np.array([[0, 4, 1], [0, 3, 4], [1, 5, 2], [1, 4, 5]])
    triangles = (first[:, None, None] + corners).reshape(-1, 3)
    points = rows.reshape(-1, 3)
    return TriangleMesh(points, triangles, np.broadcast_to(up, points.shape).copy())
