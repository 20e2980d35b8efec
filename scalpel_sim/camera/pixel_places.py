"""From places of an image to the places of the body that they show."""

import numpy as np
import numpy.typing as npt

from scalpel_sim.camera.camera import Camera
from scalpel_sim.errors import UsageError
from scalpel_sim.strokes.skin import BodySkin
from tissue import FloatArray, Surface

_SAME_DEPTH = 1e-3
"""Difference of depths [m] from which something else stands before the skin: the depth of an image
is right to 0.05 mm, and jumps by more at the rim of an instrument."""


def pixels_to_points(
    camera: Camera, pixels: npt.ArrayLike, depth: np.ndarray | None = None
) -> FloatArray:
    """Return the places of the body at rest that an image shows [m], tissue frame, shape (n, 3).

    They mean the same material wherever the body has moved since: give them to a stroke of kind
    `traced` as its points.

    Args:
        camera: The camera, now as it was when the image was taken.
        pixels: Places of the image as columns and rows, from its upper left corner, shape (n, 2):
            the middle of the first pixel is (0.5, 0.5).
        depth: Depth of that image [m], which says what instruments hide; None: the skin behind them
            counts as seen.

    Raises:
        UsageError: a place is outside the image, or shows no skin; the message says which.
    """
    places = np.array(pixels, np.float64)
    if places.ndim != 2 or places.shape[1] != 2 or not np.isfinite(places).all():
        raise UsageError("pixels are rows of two numbers, a column and a row of the image")
    link, frame = camera.theatre.link, camera.theatre.frame
    if link is None:
        raise UsageError("the camera sees no tissue: its theatre has none")
    eye, directions = camera.lines_of_sight(places)
    ways = frame.vectors_to_tissue(directions)
    middle = camera.lines_of_sight(np.array([[0.5 * camera.width, 0.5 * camera.height]]))[1][0]
    surface, start = link.surface(), frame.points_to_tissue(eye)
    found = np.empty((len(places), 3))
    for i, (place, way) in enumerate(zip(places, ways, strict=True)):
        limit = np.inf
        if not (0.0 <= place[0] <= camera.width and 0.0 <= place[1] <= camera.height):
            raise UsageError(
                f"{_named(i, place)} is outside the image of {camera.width} x {camera.height}"
            )
        if depth is not None:
            row, column = (
                int(min(place[1], camera.height - 1)),
                int(min(place[0], camera.width - 1)),
            )
            limit = float(depth[row, column]) / float(directions[i] @ middle) + _SAME_DEPTH
        found[i] = _seen(surface, start, way, limit, _named(i, place))
    return found


def _seen(
    surface: Surface, start: FloatArray, way: FloatArray, limit: float, name: str
) -> FloatArray:
    """Return the place at rest of the skin that a line of sight meets first [m], shape (3,).

    Args:
        surface: Surface of the body now, tissue frame.
        start: Where the line begins [m].
        way: Unit vector along it.
        limit: Distance beyond which nothing is seen [m].
        name: Name of the place of the image, for messages.
    """
    skin = BodySkin(surface.rest_positions[surface.triangles], surface.positions[surface.triangles])
    place = skin.seen_from(start, way)
    if place is None:
        raise UsageError(f"{name} shows no tissue")
    if surface.is_cut[place.face]:
        raise UsageError(f"{name} shows a face of a cut, where a line on the skin cannot begin")
    if float((skin.lying_place(place) - start) @ way) > limit:
        raise UsageError(f"{name} shows something that stands before the tissue")
    return skin.rest_place(place)


def _named(i: int, place: FloatArray) -> str:
    """Return the name of a place of the image, for messages."""
    return f"pixel {i + 1}, ({place[0]:g}, {place[1]:g}),"
