"""Figures as PNG files: cuts are done, drawn at some moments, and laid out.

They are the figures of the paper, and two moments of the organ and of scenes of two hands.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from bridge import TissueFrame
from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.camera.viewpoints import Viewpoint, viewpoint_of
from scalpel_sim.errors import RunError
from scalpel_sim.figures.cuts import (
    FIGURE_10,
    FIGURE_10_MOMENTS,
    FIGURE_12,
    Moment,
    moment_of,
    moments,
    with_scheme,
)
from scalpel_sim.figures.framing import Margins, fitted
from scalpel_sim.figures.mesh_drawing import draw_mesh
from scalpel_sim.figures.studio import picture
from scalpel_sim.planned_cut import PlannedCut
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.looks import ORGAN_LOOK, Look, look_of_scene
from tissue import FloatArray
from tissue.support import whole_file

TOWARDS_EYE = np.array([0.9, -2.0, 1.9])
"""Position of the eye from the body's centre, in diagonals of the body: it looks into the cut."""
PANEL_SIZE = PixelSize(640, 520)
"""PixelSize of each panel."""
WITH_TOOL = Margins(side=0.05, top=0.21, bottom=0.04)
"""Margins around the body in a picture that also shows the scalpel above it."""
BODY_ALONE = Margins(side=0.05, top=0.05, bottom=0.05)
"""Margins around the body in a picture without the scalpel."""
GAP = 12
"""Distance between panels [pixels]."""
LINE = 26
"""Height of a line of text [pixels]."""
_DOTS_PER_INCH = 150
"""Pixels per inch of a figure, on which only the size of its text depends."""


ORGAN = PlannedCut(
    changed(SCENES["organ"], stretch=0.15, table=None),
    path=np.array([[0.55, -0.15], [0.42, 1.25]]),
    depth=1.15,
    lean=-0.15,
)
"""Clean through the organ; it leans so that one sees into the cut, which is pulled open, and
hangs between its ends: the blade passes below it."""
_ORGAN_MOMENTS = (0.5, 0.72)
"""Shares of the stroke: half way, and shortly before the organ falls in two."""
_ORGAN_COLOURS = 256
"""Colours of the file, which is then less than half as large."""
MOMENTS = {
    "retract": (3.6, 4.2),
    "excise": (1.75, 3.3),
    "taut_incision": (2.4, 3.2),
    "gallbladder": (2.0, 3.2),
    "layers": (0.64, 1.6),
    "tumour": (1.4, 2.7),
}
"""Scenes that have a picture of two moments, and these [s]: as the blade cuts, and when a left hand
has what came off, or when the blade is out."""


class Drawn(NamedTuple):
    """Description of a figure that was drawn."""

    caption: str
    """Content of the figure, in one line."""
    labels: list[str]
    """Label of each panel."""
    n_tetrahedra: list[int]
    """Number of tetrahedra in each panel."""


def draw_figure(number: int | str, path: Path, scheme: str = "stellar") -> Drawn:
    """Do the cuts of a figure, write its PNG, and return what it shows.

    Args:
        number: 10, 11 or 12; organ; or one of `MOMENTS`, which are cut as their scenes say.
        path: File to write.
        scheme: How the mesh is cut: `stellar` or `paper`.

    Raises:
        RunError: the file could not be written.
    """
    of_paper = {10: _figure_10, 11: _figure_11, 12: _figure_12}
    write: Callable[[Path], object]
    if isinstance(number, int):
        panels, drawn = of_paper[number](scheme)
        how = "" if scheme == "stellar" else ", cut by the paper's own scheme"
        figure = _lay_out(panels, drawn.labels, f"Figure {number}: {drawn.caption}{how}")
        canvas = FigureCanvasAgg(figure)
        write = partial(canvas.print_figure, dpi=_DOTS_PER_INCH, format="png")
    else:
        panels, drawn = _organ(scheme) if number == "organ" else _scene(number)
        image = _side_by_side(panels)
        image = image.quantize(_ORGAN_COLOURS) if number == "organ" else image
        write = partial(image.save, format="PNG", optimize=True)
    try:
        with whole_file(path) as unfinished:
            write(unfinished)
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose another --output"
        ) from error
    return drawn


def _figure_10(scheme: str) -> tuple[list[FloatArray], Drawn]:
    seen = moments(with_scheme(scheme, FIGURE_10), FIGURE_10_MOMENTS)
    caption = "four frames of a cut through a grid of 4 × 6 × 4 cells, pulled apart left and right"
    return _pictures(seen), _drawn(caption, seen, ["", "", "", ""])


def _figure_11(scheme: str) -> tuple[list[FloatArray], Drawn]:
    seen = moments(with_scheme(scheme, FIGURE_10), FIGURE_10_MOMENTS)
    view = view_of(seen, BODY_ALONE)
    ends = [seen[0], seen[-1]]
    panels = [draw_mesh(view, PANEL_SIZE, moment.snapshot, moment.surface) for moment in ends]
    caption = "mesh structures of the first and the last frame of Figure 10"
    return panels, _drawn(caption, ends, ["", ""])


def _figure_12(scheme: str) -> tuple[list[FloatArray], Drawn]:
    seen = [moments(with_scheme(scheme, cut))[-1] for cut in FIGURE_12]
    panels = [
        picture(view_of([moment], BODY_ALONE), PANEL_SIZE, moment, ORGAN_LOOK, with_tool=False)
        for moment in seen
    ]
    cells = ["2 × 2 × 2 cells, ", "7 × 7 × 7 cells, "]
    return panels, _drawn("cuts along arbitrary paths through coarse grids", seen, cells)


def _organ(scheme: str) -> tuple[list[FloatArray], Drawn]:
    seen = moments(with_scheme(scheme, ORGAN), _ORGAN_MOMENTS)
    labels = [f"{share:.0%} of the stroke" for share in _ORGAN_MOMENTS]
    caption = "the arm draws a scalpel through an organ"
    return _pictures(seen), Drawn(caption, labels, _sizes(seen))


def _scene(name: str) -> tuple[list[FloatArray], Drawn]:
    scene = SCENES[name]
    simulation = prepare(scene)
    seen = []
    for seconds in MOMENTS[name]:
        simulation.run(seconds)
        seen.append(moment_of(simulation))
    labels = [f"after {seconds:g} s" for seconds in MOMENTS[name]]
    look = look_of_scene(scene)
    pictures = _pictures(seen, scene.views, look if look.labels else ORGAN_LOOK)
    return pictures, Drawn(scene.about, labels, _sizes(seen))


def _pictures(
    seen: Sequence[Moment], cameras: Sequence[ViewTable] = (), look: Look = ORGAN_LOOK
) -> list[FloatArray]:
    """Return a picture of each moment with the instruments, all in one view."""
    view = view_of(seen, WITH_TOOL, cameras)
    return [picture(view, PANEL_SIZE, moment, look, with_tool=True) for moment in seen]


def _sizes(seen: Sequence[Moment]) -> list[int]:
    """Return the number of tetrahedra at each moment."""
    return [len(moment.snapshot.tetrahedra) for moment in seen]


def _drawn(caption: str, seen: Sequence[Moment], prefixes: Sequence[str]) -> Drawn:
    counts = _sizes(seen)
    labels = [f"{a}{n:,} tetrahedra" for a, n in zip(prefixes, counts, strict=True)]
    return Drawn(caption, labels, counts)


def view_of(
    seen: Sequence[Moment], margins: Margins, cameras: Sequence[ViewTable] = ()
) -> Viewpoint:
    """Return the view of the first camera; without one, that in which the body always fills it."""
    if cameras:
        return viewpoint_of(cameras[0], TissueFrame())
    points = np.concatenate([moment.surface.positions for moment in seen])
    return fitted(points, _diagonal(seen[0]) * TOWARDS_EYE, PANEL_SIZE, margins)


def _diagonal(moment: Moment) -> float:
    """Return the diagonal of the body's bounding box at rest [m]."""
    return float(np.linalg.norm(np.ptp(moment.surface.rest_positions, axis=0)))


def _lay_out(panels: list[FloatArray], labels: list[str], title: str) -> Figure:
    """Return the panels, two in a row, each above its letter and label, and the title below all."""
    n_rows = math.ceil(len(panels) / 2)
    width = 2 * PANEL_SIZE.width + 3 * GAP
    height = n_rows * (PANEL_SIZE.height + LINE + GAP) + 2 * LINE + 2 * GAP
    figure = Figure(figsize=(width / _DOTS_PER_INCH, height / _DOTS_PER_INCH), facecolor="white")
    for i, (panel, label) in enumerate(zip(panels, labels, strict=True)):
        left = GAP + (i % 2) * (PANEL_SIZE.width + GAP)
        bottom = height - (i // 2 + 1) * (PANEL_SIZE.height + LINE + GAP) + LINE
        axes = figure.add_axes(
            (left / width, bottom / height, PANEL_SIZE.width / width, PANEL_SIZE.height / height)
        )
        axes.imshow(panel, interpolation="none", aspect="auto")
        axes.set_axis_off()
        figure.text(
            (left + PANEL_SIZE.width / 2) / width,
            (bottom - LINE / 2) / height,
            f"{'abcd'[i]})  {label}",
            ha="center",
            va="center",
            fontsize=8,
        )
    figure.text(
        0.5,
        (GAP + LINE) / height,
        f"{title}\n(after Bielser, Maiwald, Gross 1998)",
        ha="center",
        va="center",
        fontsize=8.5,
        style="italic",
    )
    return figure


def _side_by_side(panels: Sequence[FloatArray]) -> Image.Image:
    """Return two pictures side by side."""
    left, right = panels
    gap = np.ones((len(left), GAP, 3))
    shades = np.clip(np.concatenate([left, gap, right], axis=1), 0.0, 1.0)
    return Image.fromarray((255.0 * shades).astype(np.uint8))
