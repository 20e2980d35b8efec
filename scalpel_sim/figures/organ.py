"""The organ of the scenes as one picture: two moments of a cut through it, side by side."""

from pathlib import Path

import numpy as np
from PIL import Image

from scalpel_sim.figures.cuts import moments, with_scheme
from scalpel_sim.figures.figures import GAP, WITH_TOOL, Drawn, figure_file, picture, view_of
from scalpel_sim.planned_cut import PlannedCut
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed

ORGAN = PlannedCut(
    changed(SCENES["organ"], stretch=0.15, table=None),
    path=np.array([[0.55, -0.15], [0.42, 1.25]]),
    depth=1.15,
    lean=-0.15,
)
"""Clean through the organ; it leans so that one sees into the cut, which is pulled open, and
hangs between its ends: the blade passes below it."""
_MOMENTS = (0.5, 0.72)
"""Shares of the stroke: half way, and shortly before the organ falls in two."""
_COLOURS = 256
"""Colours of the file, which is then less than half as large."""


def draw_organ(path: Path, scheme: str = "stellar") -> Drawn:
    """Cut the organ, write a PNG of two moments side by side, and return what it shows.

    Args:
        path: The PNG.
        scheme: How the mesh is cut: `stellar` or `paper`.

    Raises:
        RunError: the file could not be written.
    """
    seen = moments(with_scheme(scheme, ORGAN), _MOMENTS)
    view = view_of(seen, WITH_TOOL)
    panels = [picture(view, moment, with_tool=True) for moment in seen]
    gap = np.ones((view.height, GAP, 3))
    shades = np.clip(np.concatenate([panels[0], gap, panels[1]], axis=1), 0.0, 1.0)
    image = Image.fromarray((255.0 * shades).astype(np.uint8)).quantize(_COLOURS)
    with figure_file(path) as unfinished:
        image.save(unfinished, format="PNG", optimize=True)
    counts = [len(moment.snapshot.tetrahedra) for moment in seen]
    labels = [f"{share:.0%} of the stroke" for share in _MOMENTS]
    return Drawn("the arm draws a scalpel through an organ", labels, counts)
