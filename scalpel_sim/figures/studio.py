"""Pictures of wet tissue and instruments on a white table, under a soft lamp and a bright sky.

Light is summed linearly: the same view is drawn once for each direction of light, with the hard
shadow of that direction. What no lamp reaches is lit by the sky. Highlights are drawn by
themselves: MuJoCo's renderer would give them the colour of the tissue, and what is wet mirrors
white.
"""

import functools
import io
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image

from scalpel_sim.camera.canvas import Canvas, PixelSize
from scalpel_sim.camera.finishes import Finish
from scalpel_sim.camera.lights import Light, Rgb
from scalpel_sim.camera.tissue_parts import TissueParts, part_finishes
from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.figures.cuts import Moment
from scalpel_sim.figures.relief import with_relief
from scalpel_sim.viewer.looks import Look
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray

GAMMA = 2.2
"""Exponent between sRGB and linear light, close to the standard."""

LAMP = np.array([-0.6, -0.5, 1.2])
"""Direction towards the lamp, above and to the left of the eye: the light falls into the cut."""

LAMP_WIDTH = 0.12
"""Angular radius of the lamp seen from the body [rad]: it makes the edges of shadows soft."""

LAMP_SHARE = 0.5
"""Share of the lamp in the light on a surface that faces it; the rest comes from the sky."""

N_LAMP, N_SKY = 24, 48
"""Number of directions that stand for the lamp and for the sky. With fewer, shadows have steps."""

N_MIRRORED = 6
"""Number of directions of each lamp that wet surfaces mirror."""

LOWEST_SKY = 0.1
"""Height of the lowest light of the sky over its distance. Shadows of lower ones would be longer
than the table."""

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Angle [rad] that spreads points evenly over a disc or a sphere."""

BLACK: Rgb = (0.0, 0.0, 0.0)
WHITE: Rgb = (1.0, 1.0, 1.0)

LIGHT: Rgb = (0.8, 0.8, 0.8)
"""Light of each direction on a white surface that faces it: less than 1, for bytes end there."""

FULL_LIGHT = 0.96
"""Share of all light at which the table is white: the body hides a little of the sky everywhere."""

TABLE_REACH = 8.0
"""Half width of the table in diagonals of the body: as far as a shadow can be seen."""

WET, SHARPNESS = 0.2, 0.5
"""Strength and sharpness of highlights on tissue, see `Finish`."""

FINE = 2
"""Samples along each side of a pixel, against jagged edges."""

PIXELS_OF_TRIANGLE = 8
"""Samples of a picture for each triangle, at least: smaller ones are not seen, and take time."""

_ASIDE = 0.25
"""Place of the lamp behind the body, which only wet surfaces mirror, over its distance: to the left
of where level ones mirror it into the eye. A highlight in the middle would hide the cut."""

_STEEL = (0.80, 0.82, 0.85)
"""Colour of a blade (sRGB)."""

_TABLE = "table"


class _Ray(NamedTuple):
    """A direction of light and what it counts."""

    light: Light
    weight: float


def picture(
    view: Viewpoint, size: PixelSize, moment: Moment, look: Look, *, with_tool: bool
) -> FloatArray:
    """Return a picture of the body on a table, with the instruments or without.

    Args:
        view: Where from, tissue frame.
        size: PixelSize of the picture.
        moment: Body and instruments.
        look: Look of the body's material, or of its labels.
        with_tool: Whether the instruments are in the picture.

    Returns:
        Red, green and blue in sRGB from 0 to 1, shape (height, width, 3).

    Raises:
        RenderError: OpenGL is missing.
    """
    meshes, finishes = _tissue(moment, look, size)
    for i, (mesh, shape) in enumerate(moment.tool if with_tool else ()):
        red, green, blue = _STEEL if shape.is_blade else shape.colour[:3].tolist()
        name, gloss = f"tool {i}", 1.0 if shape.is_blade else 0.5
        meshes[name] = mesh
        finishes[name] = Finish((red, green, blue, 1.0), gloss=gloss, shininess=0.7)
    bounds = np.stack([moment.surface.positions.min(axis=0), moment.surface.positions.max(axis=0)])
    meshes[_TABLE], finishes[_TABLE] = table_below(bounds), Finish(gloss=0.0)
    matte = {name: _linear(finish)._replace(gloss=0.0) for name, finish in finishes.items()}
    wet = {
        name: Finish((0.0, 0.0, 0.0, 1.0), gloss=finish.gloss, shininess=finish.shininess)
        for name, finish in finishes.items()
    }
    colours = _lit(meshes, matte, view, size, _lamp_and_sky(), background=WHITE)
    light = colours + _lit(meshes, wet, view, size, _mirrored(view), background=BLACK)
    shares: FloatArray = (light / (FULL_LIGHT * _on_level_ground(_lamp_and_sky()))).clip(0.0, 1.0)
    return shares ** (1.0 / GAMMA)


def _tissue(
    moment: Moment, look: Look, size: PixelSize
) -> tuple[dict[str, TriangleMesh], dict[str, Finish]]:
    """Return the parts of the body with their relief, and the look of each."""
    names = {each.label: each.title for each in look.labels}
    finishes = part_finishes(names, look)
    parts = TissueParts(names)
    parts.show(moment.surface)
    meshes, most = {}, FINE**2 * size.width * size.height // PIXELS_OF_TRIANGLE
    for name, mesh in parts.meshes.items():
        picture_of_part = finishes[name].picture
        if len(mesh.triangles) and picture_of_part is not None:
            meshes[name] = with_relief(mesh, picture_of_part, most)
        finishes[name] = finishes[name]._replace(gloss=WET, shininess=SHARPNESS)
    return meshes, finishes


def _lit(
    meshes: Mapping[str, TriangleMesh],
    finishes: Mapping[str, Finish],
    view: Viewpoint,
    size: PixelSize,
    rays: Sequence[_Ray],
    background: Rgb,
) -> FloatArray:
    """Return the sum of what is seen under each ray, in linear light."""
    fine = PixelSize(FINE * size.width, FINE * size.height)
    total = np.zeros((fine.height, fine.width, 3))
    canvas = Canvas(finishes=finishes, shadows=True, background=background)
    try:
        table = meshes[_TABLE].positions
        canvas.middle = table.mean(axis=0)
        canvas.extent = float(np.linalg.norm(np.ptp(table, axis=0))) / TABLE_REACH
        for name, mesh in meshes.items():
            canvas.put(name, mesh)
        for light, weight in rays:
            canvas.look(view, lights=[light])
            total += weight / 255.0 * canvas.colours(fine)
    finally:
        canvas.close()
    mean: FloatArray = total.reshape(size.height, FINE, size.width, FINE, 3).mean(axis=(1, 3))
    return mean


def _lamp_and_sky() -> list[_Ray]:
    """Return the light that colours show."""
    lamp = [_Ray(Light(-to, LIGHT, BLACK), LAMP_SHARE / N_LAMP) for to in _disc(LAMP, N_LAMP)]
    share = (1.0 - LAMP_SHARE) / N_SKY
    return lamp + [_Ray(Light(-to, LIGHT, BLACK), share) for to in _dome(N_SKY)]


def _on_level_ground(rays: Sequence[_Ray]) -> float:
    """Return how bright a white table is under rays that nothing stops."""
    heights = [-light.towards[2] / float(np.linalg.norm(light.towards)) for light, _ in rays]
    shares = [weight * light.colour[0] for light, weight in rays]
    return float(np.maximum(heights, 0.0) @ shares)


def _mirrored(view: Viewpoint) -> list[_Ray]:
    """Return the light that wet surfaces mirror: of the lamp, and of one behind the body."""
    forward, _ = view.axes
    behind = forward * [1.0, 1.0, -1.0] + _ASIDE * np.array([-forward[1], forward[0], 0.0])
    return [
        _Ray(Light(-to, BLACK, WHITE), 1.0 / N_MIRRORED)
        for lamp in (LAMP, behind)
        for to in _disc(lamp, N_MIRRORED)
    ]


def _disc(middle: FloatArray, n: int) -> FloatArray:
    """Return directions spread evenly over the disc of a lamp, shape (n, 3)."""
    axis = middle / np.linalg.norm(middle)
    across = np.cross(axis, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    place = np.arange(n)
    radius, angle = LAMP_WIDTH * np.sqrt((place + 0.5) / n), GOLDEN_ANGLE * place
    offset = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    directions: FloatArray = axis + offset @ np.stack([across, np.cross(axis, across)])
    return directions


def _dome(n: int) -> FloatArray:
    """Return unit vectors spread over the sky as its light on level ground is, shape (n, 3)."""
    place = np.arange(n)
    height = np.maximum(np.sqrt((place + 0.5) / n), LOWEST_SKY)
    level, angle = np.sqrt(1.0 - height**2), GOLDEN_ANGLE * place
    return np.stack([level * np.cos(angle), level * np.sin(angle), height], axis=1)


def _linear(finish: Finish) -> Finish:
    """Return a look in linear light."""
    red, green, blue = (share**GAMMA for share in finish.colour[:3])
    png = None if finish.picture is None else _linear_picture(finish.picture)
    return finish._replace(colour=(red, green, blue, finish.colour[3]), picture=png)


@functools.lru_cache(maxsize=32)
def _linear_picture(png: bytes) -> bytes:
    """Return a PNG in linear light."""
    with Image.open(io.BytesIO(png)) as image:
        shares = np.asarray(image.convert("RGB")) / 255.0
    file = io.BytesIO()
    Image.fromarray(np.round(255.0 * shares**GAMMA).astype(np.uint8)).save(file, format="PNG")
    return file.getvalue()


def table_below(bounds: FloatArray) -> TriangleMesh:
    """Return a level square under the middle of a body with these bounds [m], shape (2, 3)."""
    reach = TABLE_REACH * float(np.linalg.norm(bounds[1] - bounds[0]))
    x, y, _ = bounds.mean(axis=0)
    corners = reach * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) + [x, y]
    positions = np.column_stack([corners, np.full(4, bounds[0, 2])])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return TriangleMesh(positions, triangles, np.tile([0.0, 0.0, 1.0], (4, 1)))
