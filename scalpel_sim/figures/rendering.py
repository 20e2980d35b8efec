"""Rendering of textured triangle meshes with shadows, highlights and a little relief."""

import io
from collections.abc import Sequence
from typing import NamedTuple

import matplotlib.image
import numpy as np

from scalpel_sim.figures.camera import View, mean_of_samples
from scalpel_sim.figures.light import Lights, SurfacePoints, illuminate, make_lights
from scalpel_sim.figures.rasterise import Raster, rasterise
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import BoolArray, FloatArray, IntArray

GAMMA = 2.2
"""Exponent between sRGB and linear light, close to the standard. Light is summed linearly."""
FULL_LIGHT = 0.96
"""Share of all light at which a table is as bright as the background: the body hides a little of
the sky everywhere in the picture."""
EXPOSURE = 1.25
"""Brightness of a surface in full light, as a factor of its colour: slightly bright, as in a room
with much light."""
_REACH = 6.0
"""Half width of the table in diagonals of the body: as far as its shadow can be seen."""
N_SQUARES = 48
"""Number of squares along each side. Squares that reach behind the eye are left out, so they must
be small."""


class Texture(NamedTuple):
    """A picture that repeats on a surface."""

    colours: FloatArray
    """Colours in linear light from 0 to 1, shape (height, width, 3)."""
    slope: FloatArray
    """Slope of the relief: change of brightness along u and v per repeat, (height, width, 2)."""


class SceneObject(NamedTuple):
    """A mesh and its appearance."""

    mesh: TriangleMesh
    """Triangles, in the frame of the picture's view."""
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Colour in sRGB from 0 to 1, which is multiplied by the texture."""
    texture: Texture | None = None
    """Texture; None for an even colour."""
    relief: float = 0.0
    """Depth of the texture's relief, in repeats of the texture."""
    gloss: float = 0.0
    """Strength of the highlight."""
    shininess: float = 60.0
    """Sharpness of the highlight (Blinn and Phong's exponent)."""
    glow: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Emitted red, green and blue light, as a factor of the colour: light scattered in tissue."""
    is_slender: bool = False
    """Whether the object casts shadows of the lamp only; see `make_lights`."""
    catches_shadows_only: bool = False
    """Whether only shadows on the object are visible: a table in the colour of the background."""


class _Soup(NamedTuple):
    """The triangles of all objects, each with corners of its own (a triangle soup)."""

    positions: FloatArray
    """Corners of the triangles [m], shape (n, 3, 3)."""
    normals: FloatArray
    """Unit normals at the corners, shape (n, 3, 3)."""
    uv: FloatArray
    """Texture coordinates at the corners, shape (n, 3, 2)."""
    tints: FloatArray
    """Factors of the colour at the corners, shape (n, 3, 3)."""
    item: IntArray
    """Index of the object that each triangle belongs to, shape (n,)."""


def texture_of(png: bytes) -> Texture:
    """Return the texture that a PNG holds."""
    colours = matplotlib.image.imread(io.BytesIO(png))[:, :, :3].astype(np.float64) ** GAMMA
    bright = colours.mean(axis=2)
    height, width = bright.shape
    along_u = (np.roll(bright, -1, axis=1) - np.roll(bright, 1, axis=1)) * width / 2.0
    along_v = (np.roll(bright, -1, axis=0) - np.roll(bright, 1, axis=0)) * height / 2.0
    return Texture(colours, np.stack([along_u, along_v], axis=2))


def render(
    view: View,
    objects: Sequence[SceneObject],
    *,
    lamp: FloatArray,
    background: tuple[float, float, float],
    samples: int = 2,
) -> FloatArray:
    """Return a picture, sRGB from 0 to 1, shape (view.height, view.width, 3).

    Args:
        view: Projection to the picture.
        objects: Objects to draw.
        lamp: Direction towards the lamp, shape (3,).
        background: Colour in sRGB where there is no object.
        samples: Number of samples along each side of a pixel, against aliasing.
    """
    fine = view.sampled(samples)
    soup = _in_front(fine, _soup(objects))
    raster = rasterise(fine.project(soup.positions), fine.width, fine.height)
    opaque = ~np.array([item.catches_shadows_only for item in objects])[soup.item]
    blocks_sky = ~np.array([item.is_slender for item in objects])[soup.item]
    lights = make_lights(lamp, soup.positions[opaque], blocks_sky[opaque])
    image = np.empty((fine.height, fine.width, 3))
    image[:] = np.array(background) ** GAMMA
    of_pixel = np.where(raster.triangle >= 0, soup.item[raster.triangle], -1)
    for i, item in enumerate(objects):
        where = of_pixel == i
        if where.any():
            image[where] = _shade(item, fine, soup, raster, where, lights)
    picture: FloatArray = mean_of_samples(image, samples).clip(0.0, 1.0) ** (1.0 / GAMMA)
    return picture


def _soup(objects: Sequence[SceneObject]) -> _Soup:
    """Return the triangles of all objects."""
    parts = []
    for i, item in enumerate(objects):
        mesh, n = item.mesh, len(item.mesh.positions)
        uv = np.zeros((n, 2)) if mesh.uv is None else mesh.uv
        tints = np.ones((n, 3)) if mesh.tints is None else mesh.tints
        of_corners = [array[mesh.triangles] for array in (mesh.positions, mesh.normals, uv, tints)]
        parts.append((*of_corners, np.full(len(mesh.triangles), i)))
    return _Soup(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _in_front(view: View, soup: _Soup) -> _Soup:
    """Return the triangles with all corners in front of the eye; others cannot be projected."""
    ahead = ((soup.positions - view.eye) @ view.forward > 0.0).all(axis=1)
    return _Soup._make(column[ahead] for column in soup)


def _shade(
    item: SceneObject,
    view: View,
    soup: _Soup,
    raster: Raster,
    where: BoolArray,
    lights: Lights,
) -> FloatArray:
    """Return the colours of the pixels that show an object, in linear light, shape (n, 3).

    Args:
        item: The object.
        view: Projection to the picture.
        soup: Triangles of all objects.
        raster: Triangle that is visible at each pixel.
        where: Whether a pixel shows the object, shape (height, width).
        lights: Lamp and sky.
    """
    triangle = raster.triangle[where]
    weights = _perspective_weights(view, soup.positions[triangle], raster.weights[where])
    positions = np.einsum("nc,ncx->nx", weights, soup.positions[triangle])
    normals = _unit(np.einsum("nc,ncx->nx", weights, soup.normals[triangle]))
    colour = np.array(item.colour) ** GAMMA * np.einsum("nc,ncx->nx", weights, soup.tints[triangle])
    if item.texture is not None:
        uv = np.einsum("nc,ncx->nx", weights, soup.uv[triangle])
        colour = colour * _sampled(item.texture.colours, uv)
        slope = item.relief * _sampled(item.texture.slope, uv)
        normals = _unit(normals - _relief_gradient(soup, triangle, slope))
    to_eye = _unit(view.eye - positions)
    flat = _unit(_flat_normals(soup.positions[triangle]))
    flat *= np.sign(_dot(flat, to_eye))[:, None]  # the outside of a closed body
    normals = np.where(_dot(normals, flat)[:, None] > 0.0, normals, flat)  # at sharp folds
    points = SurfacePoints(positions, normals, flat, to_eye)
    light = illuminate(lights, points, item.shininess)
    if item.catches_shadows_only:
        full = FULL_LIGHT * (lights.strength * lights.towards[:, 2]).sum()
        shaded: FloatArray = colour * (light.diffuse / full).clip(0.0, 1.0)[:, None]
        return shaded
    coloured = colour * (light.diffuse[:, None] + np.array(item.glow))
    shaded = EXPOSURE * (coloured + item.gloss * light.specular[:, None])
    return shaded


def _perspective_weights(view: View, corners: FloatArray, weights: FloatArray) -> FloatArray:
    """Return barycentric coordinates in space, shape (n, 3), given those on the picture."""
    nearness = (corners - view.eye) @ view.forward
    weights = weights / nearness
    weights /= weights.sum(axis=1, keepdims=True)
    return weights


def _sampled(picture: FloatArray, uv: FloatArray) -> FloatArray:
    """Return a repeating picture at texture coordinates, shape (n, 2), interpolated bilinearly."""
    height, width = picture.shape[:2]
    pixels = uv * [width, height] - 0.5
    corner = np.floor(pixels).astype(np.int64)
    part = pixels - corner
    x, y = corner[:, 0] % width, corner[:, 1] % height
    right, below = (x + 1) % width, (y + 1) % height
    u, v = part[:, :1], part[:, 1:]
    sampled: FloatArray = (1 - v) * ((1 - u) * picture[y, x] + u * picture[y, right]) + v * (
        (1 - u) * picture[below, x] + u * picture[below, right]
    )
    return sampled


def _relief_gradient(soup: _Soup, triangle: IntArray, slope: FloatArray) -> FloatArray:
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
    """Return the scalar products of vectors, shape (n,)."""
    products: FloatArray = np.einsum("nx,nx->n", a, b)
    return products


def _flat_normals(corners: FloatArray) -> FloatArray:
    """Return the normals of triangles, twice the area long, shape (n, 3)."""
    normals: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals


def _unit(vectors: FloatArray) -> FloatArray:
    """Return the vectors at unit length, shape (n, 3); a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: FloatArray = vectors / np.where(length > 0.0, length, 1.0)
    return unit


def table_below(bounds: FloatArray) -> TriangleMesh:
    """Return a level square under the middle of a body with these bounds [m], shape (2, 3)."""
    centre = bounds.mean(axis=0)
    reach = _REACH * float(np.linalg.norm(bounds[1] - bounds[0]))
    line = np.linspace(-reach, reach, N_SQUARES + 1)
    x, y = np.meshgrid(centre[0] + line, centre[1] + line, indexing="ij")
    positions = np.stack([x, y, np.full_like(x, bounds[0, 2])], axis=-1).reshape(-1, 3)
    row = np.arange(N_SQUARES)
    corner = (row[:, None] * (N_SQUARES + 1) + row).ravel()
    across, along = corner + N_SQUARES + 1, corner + 1
    triangles = np.concatenate(
        [np.stack([corner, across, across + 1], 1), np.stack([corner, across + 1, along], 1)]
    )
    return TriangleMesh(positions, triangles, np.tile([0.0, 0.0, 1.0], (len(positions), 1)))
