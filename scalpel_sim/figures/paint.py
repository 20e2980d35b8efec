"""A lit, textured picture of triangles: the light of `light`, wet highlights, a little relief."""

import io
from collections.abc import Sequence
from typing import NamedTuple

import matplotlib.image
import numpy as np

from scalpel_sim.figures.camera import View
from scalpel_sim.figures.light import Lights, light_on, lights
from scalpel_sim.figures.rasterise import Raster, rasterise
from scalpel_sim.viewer.triangle_mesh import TriangleMesh
from tissue import FloatArray, IntArray

GAMMA = 2.2
"""Of the screen, nearly sRGB's: colours are mixed as light, and shown through this."""
ENOUGH = 0.96
"""Share of all light at which what only catches shadows is as bright as the background: the body
takes a little of the sky away as far as one can see."""
EXPOSURE = 1.25
"""Light on a surface that faces all of it: a little more than its colour, as in a bright room."""


class Texture(NamedTuple):
    """A picture that repeats."""

    colours: FloatArray
    """As light, from 0 to 1; shape (height, width, 3)."""
    slope: FloatArray
    """Change of brightness along u and v for each tile, shape (height, width, 2): the relief."""


class Thing(NamedTuple):
    """A mesh and what it is made of."""

    mesh: TriangleMesh
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """sRGB, 0 to 1; multiplied with the texture."""
    texture: Texture | None = None
    relief: float = 0.0
    """Depth of the texture's relief over the length of a tile."""
    gloss: float = 0.0
    """Strength of the highlight."""
    shininess: float = 60.0
    """Sharpness of the highlight (Blinn and Phong's exponent)."""
    glow: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Light that it gives by itself: what scatters inside living tissue."""
    is_slender: bool = False
    """It throws shadows of the lamp only; see `lights`."""
    catches_shadows_only: bool = False
    """It is seen only where it is darker than `colour`, which is then the background: a table."""


class _Soup(NamedTuple):
    """All triangles of all things that lie before the eye."""

    positions: FloatArray
    """Shape (n, 3, 3)."""
    normals: FloatArray
    uv: FloatArray
    """Shape (n, 3, 2)."""
    tints: FloatArray
    thing: IntArray
    """Shape (n,)."""


def texture_of(png: bytes) -> Texture:
    """Return a PNG as a texture."""
    colours = matplotlib.image.imread(io.BytesIO(png))[:, :, :3].astype(np.float64) ** GAMMA
    bright = colours.mean(axis=2)
    height, width = bright.shape
    along_u = (np.roll(bright, -1, axis=1) - np.roll(bright, 1, axis=1)) * width / 2.0
    along_v = (np.roll(bright, -1, axis=0) - np.roll(bright, 1, axis=0)) * height / 2.0
    return Texture(colours, np.stack([along_u, along_v], axis=2))


def paint(
    view: View,
    things: Sequence[Thing],
    *,
    lamp: FloatArray,
    background: tuple[float, float, float],
    samples: int = 2,
) -> FloatArray:
    """Return a picture, sRGB from 0 to 1, shape (view.height, view.width, 3).

    Args:
        view: What is seen.
        things: What there is.
        lamp: Direction towards the lamp, shape (3,).
        background: sRGB where there is nothing.
        samples: Along each side of a pixel, against steps.
    """
    fine = view._replace(
        width=samples * view.width, height=samples * view.height, scale=samples * view.scale
    )
    soup = _before(fine, _soup(things))
    raster = rasterise(fine.project(soup.positions), fine.width, fine.height)
    opaque = ~np.array([thing.catches_shadows_only for thing in things])[soup.thing]
    in_sky = ~np.array([thing.is_slender for thing in things])[soup.thing]
    shining = lights(lamp, soup.positions[opaque], in_sky[opaque])
    image = np.empty((fine.height, fine.width, 3))
    image[:] = np.array(background) ** GAMMA
    of_pixel = np.where(raster.triangle >= 0, soup.thing[raster.triangle], -1)
    for i, thing in enumerate(things):
        where = of_pixel == i
        if where.any():
            image[where] = _shade(thing, fine, soup, raster, where, shining)
    coarse = image.reshape(view.height, samples, view.width, samples, 3).mean(axis=(1, 3))
    return coarse.clip(0.0, 1.0) ** (1.0 / GAMMA)


def _soup(things: Sequence[Thing]) -> _Soup:
    """Return the triangles of all things in one heap."""
    parts = []
    for i, thing in enumerate(things):
        mesh, n = thing.mesh, len(thing.mesh.positions)
        uv = np.zeros((n, 2)) if mesh.uv is None else mesh.uv
        tints = np.ones((n, 3)) if mesh.tints is None else mesh.tints
        of_corners = [array[mesh.triangles] for array in (mesh.positions, mesh.normals, uv, tints)]
        parts.append((*of_corners, np.full(len(mesh.triangles), i)))
    return _Soup(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _before(view: View, soup: _Soup) -> _Soup:
    """Return the triangles with all corners before the eye: others have no place on a picture."""
    ahead = ((soup.positions - view.eye) @ view.forward > 0.0).all(axis=1)
    return _Soup(
        soup.positions[ahead],
        soup.normals[ahead],
        soup.uv[ahead],
        soup.tints[ahead],
        soup.thing[ahead],
    )


def _shade(
    thing: Thing,
    view: View,
    soup: _Soup,
    raster: Raster,
    where: np.ndarray,
    shining: Lights,
) -> FloatArray:
    """Return the colours of the pixels that show a thing, as light, shape (n, 3)."""
    triangle = raster.triangle[where]
    weights = _in_space(view, soup.positions[triangle], raster.weights[where])
    points = np.einsum("nc,ncx->nx", weights, soup.positions[triangle])
    normals = _unit(np.einsum("nc,ncx->nx", weights, soup.normals[triangle]))
    colour = np.array(thing.colour) ** GAMMA * np.einsum(
        "nc,ncx->nx", weights, soup.tints[triangle]
    )
    if thing.texture is not None:
        uv = np.einsum("nc,ncx->nx", weights, soup.uv[triangle])
        colour = colour * _sampled(thing.texture.colours, uv)
        slope = thing.relief * _sampled(thing.texture.slope, uv)
        normals = _unit(normals - _rise(soup, triangle, slope))
    to_eye = _unit(view.eye - points)
    flat = _unit(_flat_normals(soup.positions[triangle]))
    flat *= np.sign(_dot(flat, to_eye))[:, None]  # of closed bodies, the outside
    normals = np.where(_dot(normals, flat)[:, None] > 0.0, normals, flat)  # where it folds sharply
    lit = light_on(shining, points, normals, flat, to_eye, thing.shininess)
    if thing.catches_shadows_only:
        full = ENOUGH * (shining.strength * shining.towards[:, 2]).sum()
        return colour * (lit.diffuse / full).clip(0.0, 1.0)[:, None]
    coloured = colour * (lit.diffuse[:, None] + np.array(thing.glow))
    return EXPOSURE * (coloured + thing.gloss * lit.mirrored[:, None])


def _in_space(view: View, corners: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the weights in space of places given by weights on the picture."""
    nearness = (corners - view.eye) @ view.forward
    weights = weights / nearness
    return weights / weights.sum(axis=1, keepdims=True)


def _sampled(picture: FloatArray, uv: FloatArray) -> FloatArray:
    """Return a repeating picture at places in tiles, shape (n, 2), between its pixels linearly."""
    height, width = picture.shape[:2]
    places = uv * [width, height] - 0.5
    corner = np.floor(places).astype(np.int64)
    part = places - corner
    x, y = corner[:, 0] % width, corner[:, 1] % height
    right, below = (x + 1) % width, (y + 1) % height
    u, v = part[:, :1], part[:, 1:]
    return (1 - v) * ((1 - u) * picture[y, x] + u * picture[y, right]) + v * (
        (1 - u) * picture[below, x] + u * picture[below, right]
    )


def _rise(soup: _Soup, triangle: IntArray, slope: FloatArray) -> FloatArray:
    """Return the gradient in space of a relief that rises by `slope` along u and v."""
    a, b, c = (soup.positions[triangle, k] for k in range(3))
    ua, ub, uc = (soup.uv[triangle, k] for k in range(3))
    e1, e2, d1, d2 = b - a, c - a, ub - ua, uc - ua
    turn = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    turn = np.where(np.abs(turn) > 1e-12, turn, np.inf)[:, None]
    along_u = _unit((e1 * d2[:, 1:] - e2 * d1[:, 1:]) / turn)
    along_v = _unit((e2 * d1[:, :1] - e1 * d2[:, :1]) / turn)
    return slope[:, :1] * along_u + slope[:, 1:] * along_v


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.einsum("nx,nx->n", a, b)


def _flat_normals(corners: FloatArray) -> FloatArray:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _unit(vectors: FloatArray) -> FloatArray:
    """Return vectors of length one, shape (n, 3); zero stays zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
