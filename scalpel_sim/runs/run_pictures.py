"""Pictures of a run that has ended, for its report: the cut with its plan, and the arm."""

import io
import itertools
import logging
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from scalpel_sim.camera.camera import Camera
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.report_page import ReportPicture
from scalpel_sim.scene.schema import ENDOSCOPE, OVERVIEW
from scalpel_sim.scoring.plan_marks import PlanMarks
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.judged import plan_marks
from tissue import FloatArray

_log = logging.getLogger(__name__)

_WIDTH, _HEIGHT = 640, 480
"""Size of the pictures [pixels]."""

_SAMPLES = 4
"""Samples of each pixel: smooth edges."""

_PLANNED, _OPEN, _HALO = "#6a4ae0", "#3ddc84", "#ffffff"
"""Colours of the plan, of what is open of it, and around both: those of the live page."""

_LINE, _AROUND = 3, 6
"""Widths of the line, and of that around it [pixels]."""

_WIDEST_GAP = 3.0
"""Distance between two places of a line, over that of the first two: farther on is another line."""


def pictures_of(simulation: Simulation) -> list[ReportPicture]:
    """Return pictures of a simulation now; none where nothing draws, which the log says."""
    scene = simulation.scene
    name = scene.views[0].name if scene is not None and scene.views else ENDOSCOPE
    try:
        with Camera(simulation, name, width=_WIDTH, height=_HEIGHT, samples=_SAMPLES) as camera:
            near = Image.fromarray(camera.rgb())
            marks = plan_marks(simulation)
            if marks is not None:
                _draw_plan(near, camera, marks)
            far = Image.fromarray(camera.another(OVERVIEW).rgb())
    except (RunError, UsageError) as error:
        _log.info("the report has no pictures: %s", error)
        return []
    caption = "The cut at the end"
    if marks is not None:
        caption += ": the plan is violet, and green where the cut is open"
    return [
        ReportPicture(_png(near), f"{caption}."),
        ReportPicture(_png(far), "The arm and the body at the end."),
    ]


def _draw_plan(image: Image.Image, camera: Camera, marks: PlanMarks) -> None:
    """Draw the line of a plan into an image of a camera."""
    world = camera.theatre.frame.points_to_world(marks.places)
    places = camera.pixels_of(world)
    draw = ImageDraw.Draw(image)
    pieces = list(_pieces(world, places, marks.is_open.tolist()))
    for ends, _ in pieces:
        draw.line(ends, fill=_HALO, width=_AROUND)
    for ends, is_open in pieces:
        draw.line(ends, fill=_OPEN if is_open else _PLANNED, width=_LINE)


def _pieces(
    world: FloatArray, places: FloatArray, is_open: Sequence[bool]
) -> list[tuple[list[tuple[float, float]], bool]]:
    """Return the ends of the pieces of a line in an image, and whether the cut is open there."""
    found = []
    steps = np.linalg.norm(np.diff(world, axis=0), axis=1)
    for i, (start, end) in enumerate(itertools.pairwise(places)):
        if steps[i] > _WIDEST_GAP * steps[0]:
            continue
        middle = 0.5 * (start + end)
        found.append(([tuple(start), tuple(middle)], is_open[i]))
        found.append(([tuple(middle), tuple(end)], is_open[i + 1]))
    return found


def _png(image: Image.Image) -> bytes:
    """Return an image as a PNG."""
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True)
    return file.getvalue()
