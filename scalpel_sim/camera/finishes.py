"""Looks of meshes: pictures, colours, gloss."""

import functools
import io
from typing import NamedTuple

import numpy as np
from PIL import Image


class Finish(NamedTuple):
    """Look of a mesh."""

    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Red, green, blue (sRGB) and opacity from 0 to 1; a factor of the picture."""
    picture: bytes | None = None
    """PNG that repeats over the mesh by its texture coordinates; None: an even colour."""
    gloss: float = 0.4
    """Strength of highlights, from 0 to 1."""
    shininess: float = 0.6
    """Sharpness of highlights, from 0 to 1."""
    glow: float = 0.0
    """Light that it gives off, as a factor of its colour."""
    is_ink: bool = False
    """Whether it is colour alone: depth and numbers of pixels are of what is behind it."""


POLISHED_STEEL = Finish((0.8, 0.82, 0.85, 1.0), gloss=1.0, shininess=0.9)
"""Look of a blade."""

PEN_INK = Finish((0.2, 0.11, 0.55, 1.0), gloss=0.0, glow=0.3, is_ink=True)
"""Look of a line that a pen has drawn on the skin: gentian violet, as the page has it."""


class Picture(NamedTuple):
    """Pixels of a picture as OpenGL takes them: the lowest row first."""

    width: int
    height: int
    pixels: bytes
    """Red, green and blue of each pixel."""


@functools.lru_cache(maxsize=32)
def picture_of(png: bytes) -> Picture:
    """Return the pixels of a PNG."""
    with Image.open(io.BytesIO(png)) as image:
        array = np.asarray(image.convert("RGB"))
    height, width, _ = array.shape
    return Picture(width, height, array[::-1].tobytes())
