"""The scenes of two hands as one picture: two moments of each, side by side."""

from pathlib import Path

import numpy as np
from PIL import Image

from scalpel_sim.figures.cuts import Moment, tool_of
from scalpel_sim.figures.figures import GAP, WITH_TOOL, Drawn, figure_file, picture, view_of
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.scene.read import SCENES
from scalpel_sim.simulation import Simulation

TWO_HANDS = {"retract": (3.6, 4.2), "excise": (1.75, 3.3), "taut_incision": (2.4, 3.2)}
"""Scenes that have such a picture, and its moments [s]: as the blade cuts, and when the left hand
has what came off; or as the blade is in, and when it is out."""


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
    panels = [picture(view, moment, with_tool=True) for moment in seen]
    gap = np.ones((view.height, GAP, 3))
    shades = np.clip(np.concatenate([panels[0], gap, panels[1]], axis=1), 0.0, 1.0)
    image = Image.fromarray((255.0 * shades).astype(np.uint8))
    with figure_file(path) as unfinished:
        image.save(unfinished, format="PNG", optimize=True)
    labels = [f"after {seconds:g} s" for seconds in TWO_HANDS[name]]
    return Drawn(scene.about, labels, [len(moment.snapshot.tetrahedra) for moment in seen])


def _at(simulation: Simulation, seconds: float) -> Moment:
    """Return the moment after so many seconds."""
    simulation.run(seconds)
    link = simulation.link
    return Moment(link.snapshot(), link.surface(), tool_of(simulation))
