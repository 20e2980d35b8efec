"""Pictures of two moments side by side: of a cut through the organ, and of scenes of two hands."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from scalpel_sim.figures.camera import View
from scalpel_sim.figures.cuts import Moment, moments, tool_of, with_scheme
from scalpel_sim.figures.figures import GAP, WITH_TOOL, Drawn, figure_file, picture, view_of
from scalpel_sim.planned_cut import PlannedCut
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from scalpel_sim.simulation import Simulation

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
TWO_HANDS = {"retract": (3.6, 4.2), "excise": (1.75, 3.3), "taut_incision": (2.4, 3.2)}
"""Scenes that have such a picture, and its moments [s]: as the blade cuts, and when the left hand
has what came off; or as the blade is in, and when it is out."""


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
    _write_pair(path, view, seen, colours=_COLOURS)
    counts = [len(moment.snapshot.tetrahedra) for moment in seen]
    labels = [f"{share:.0%} of the stroke" for share in _MOMENTS]
    return Drawn("the arm draws a scalpel through an organ", labels, counts)


def draw_two_hands(name: str, path: Path) -> Drawn:
    """Do a scene of two hands, write a PNG of two moments, and return what it shows.

    Args:
        name: One of `TWO_HANDS`.
        path: The PNG.

    Raises:
        RunError: the file could not be written.
    """
    scene = SCENES[name]
    simulation = prepare(scene)
    seen = [_at(simulation, seconds) for seconds in TWO_HANDS[name]]
    view = view_of(seen, WITH_TOOL, scene.views)
    _write_pair(path, view, seen)
    labels = [f"after {seconds:g} s" for seconds in TWO_HANDS[name]]
    return Drawn(scene.about, labels, [len(moment.snapshot.tetrahedra) for moment in seen])


def _at(simulation: Simulation, seconds: float) -> Moment:
    """Return the moment after so many seconds."""
    simulation.run(seconds)
    link = simulation.link
    return Moment(link.snapshot(), link.surface(), tool_of(simulation))


def _write_pair(path: Path, view: View, seen: Sequence[Moment], colours: int | None = None) -> None:
    """Write a PNG of two moments side by side, of so many colours at most."""
    left, right = (picture(view, moment, with_tool=True) for moment in seen)
    gap = np.ones((view.height, GAP, 3))
    shades = np.clip(np.concatenate([left, gap, right], axis=1), 0.0, 1.0)
    image = Image.fromarray((255.0 * shades).astype(np.uint8))
    with figure_file(path) as unfinished:
        chosen = image if colours is None else image.quantize(colours)
        chosen.save(unfinished, format="PNG", optimize=True)
