"""Textures of living tissue, and the surface of a body that is mapped to them.

Every texture repeats without a seam in both directions, because its noise is made in Fourier
space. A colour ramp turns a height field into colours, so that the same picture serves as a bump
map: dark parts lie deep.

Texture coordinates come from the rest position, so that the pattern moves with the material. A tint
that varies in space without charts hides the seams between the charts of the surface.
"""

import functools
import io
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image

from scalpel_sim.scene.label_colours import TissueColours
from scalpel_sim.viewer.charts import charts_of
from scalpel_sim.viewer.looks import ORGAN_LOOK, Look, Ramp
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray, IntArray, Surface

TEXTURE_PIXELS = 512
"""Pixels along each side of a texture; a power of two, as mipmaps need it."""

N_COLOURS = 64
"""Number of colours of a ramp. More cannot be seen, and cost bytes in every replay."""

GREYS: Ramp = ((0.0, "000000"), (1.0, "ffffff"))
"""Ramp of what is no colour."""

N_WAVES = 10
"""Number of plane waves that add up to the slow variation of the tint."""

TINT_DEPTH = 0.22
"""Standard deviation of the tint. Without the tint one sees that the texture repeats."""

NO_LEVELS: Mapping[str, IntArray] = {}
"""No quantities."""


@functools.cache
def skin(look: Look = ORGAN_LOOK) -> bytes:
    """Return the texture of a skin as a PNG: mottled, with fine branching vessels."""
    mottling = _standardized(_noise(seed=1, wavelength=90.0, spread=0.9))
    grain = _standardized(_noise(seed=2, wavelength=9.0, spread=0.5))
    vessels = np.maximum(
        _ridges(seed=3, wavelength=150.0, width=0.045),
        0.7 * _ridges(seed=4, wavelength=70.0, width=0.06),
    )
    fading = np.clip(0.55 + 0.5 * _standardized(_noise(seed=5, wavelength=200.0, spread=0.5)), 0, 1)
    patches = look.variation * (0.11 * mottling + 0.05 * grain)
    height = 0.54 + patches - 0.42 * look.vessels * vessels * fading
    return _png(height, look.skin)


@functools.cache
def cut_face(look: Look = ORGAN_LOOK) -> bytes:
    """Return the texture of cut faces as a PNG: striated along u, brighter and redder than skin."""
    fibres = _standardized(_noise(seed=11, wavelength=11.0, spread=0.7, stretch=6.0))
    bundles = _standardized(_noise(seed=12, wavelength=70.0, spread=0.6, stretch=3.5))
    grain = _standardized(_noise(seed=13, wavelength=5.0, spread=0.4))
    lobules = _ridges(seed=14, wavelength=110.0, width=0.05)
    striation = look.fibres * (0.09 * fibres + 0.06 * bundles - 0.12 * lobules)
    return _png(0.50 + striation + 0.03 * look.variation * grain, look.inside)


@functools.cache
def cloth() -> bytes:
    """Return the texture of a cloth as a PNG: woven, a little crumpled, with the crease of a fold.

    Its mean is bright: it is a factor of the colour.
    """
    size = TEXTURE_PIXELS // 2
    crumple = _standardized(_noise(seed=21, wavelength=170.0, spread=0.5)[::2, ::2])
    across, along = np.meshgrid(np.arange(size), np.arange(size))
    weave = np.where((across + along) % 2 == 0, 1.0, -1.0) * np.cos(np.pi * across / 2.0)
    crease = sum(np.exp(-(((each - size / 2) / 2.5) ** 2)) for each in (across, along))
    return _png(0.88 + 0.025 * crumple + 0.03 * weave - 0.08 * np.minimum(crease, 1.0), GREYS)


@functools.cache
def fading_disc() -> bytes:
    """Return the opacity of a table as a PNG that fades from white in the middle to black."""
    axis = np.linspace(-1.0, 1.0, 256)
    radius = np.hypot(axis[:, None], axis[None, :])
    fade = np.clip((1.0 - radius) / 0.75, 0.0, 1.0)
    return _png(fade * fade * (3.0 - 2.0 * fade), GREYS)


def _noise(seed: int, wavelength: float, spread: float, stretch: float = 1.0) -> FloatArray:
    """Return periodic noise of about one wavelength [pixels], shape (TEXTURE_PIXELS,) * 2.

    White noise is filtered in Fourier space by a Gaussian over the logarithm of the wavelength.

    Args:
        seed: Seed of the white noise.
        wavelength: Wavelength at the peak of the filter [pixels].
        spread: Standard deviation of the filter over the natural logarithm of the wavelength.
        stretch: Factor by which the noise is longer along u than along v.
    """
    white = np.random.default_rng(seed).standard_normal((TEXTURE_PIXELS, TEXTURE_PIXELS))
    along_v = np.fft.fftfreq(TEXTURE_PIXELS)[:, None]
    along_u = np.fft.rfftfreq(TEXTURE_PIXELS)[None, :]
    frequency = np.hypot(along_v, along_u * stretch)
    frequency[0, 0] = 1.0
    bell = np.exp(-0.5 * (np.log(frequency * wavelength) / spread) ** 2) / frequency
    bell[0, 0] = 0.0
    noise: FloatArray = np.fft.irfft2(np.fft.rfft2(white) * bell, s=white.shape)
    return noise


def _standardized(field: FloatArray) -> FloatArray:
    """Return the field scaled and shifted to mean 0 and standard deviation 1."""
    standardized: FloatArray = (field - field.mean()) / field.std()
    return standardized


def _ridges(seed: int, wavelength: float, width: float) -> FloatArray:
    """Return winding, closed lines where noise passes through zero: 1 on a line, 0 away from it."""
    field = _standardized(_noise(seed, wavelength, spread=0.35))
    return np.exp(-((field / width) ** 2))


def _png(height: FloatArray, ramp: Ramp) -> bytes:
    """Return heights between 0 and 1 as a PNG with a palette, coloured by a ramp."""
    knots = [position for position, _ in ramp]
    colours = np.array([list(bytes.fromhex(colour)) for _, colour in ramp], dtype=float)
    steps = np.linspace(0.0, 1.0, N_COLOURS)
    palette = np.stack([np.interp(steps, knots, colours[:, channel]) for channel in range(3)], 1)
    indices = np.round(np.clip(height, 0.0, 1.0) * (N_COLOURS - 1)).astype(np.uint8)
    image = Image.fromarray(indices).convert("P")
    image.putpalette(np.round(palette).astype(np.uint8).tobytes())
    file = io.BytesIO()
    image.save(file, format="PNG")
    return file.getvalue()


class TexturedSurface(NamedTuple):
    """A body's surface as two meshes, one for each texture."""

    skin: TriangleMesh
    """Triangles of the skin."""
    cut: TriangleMesh
    """Triangles of the cut faces."""


def map_texture(
    surface: Surface,
    tile: float,
    levels: Mapping[str, IntArray] = NO_LEVELS,
    look: Look = ORGAN_LOOK,
) -> TexturedSurface:
    """Return the skin and the cut faces of a body with texture coordinates, normals and tints.

    Args:
        surface: Boundary triangles of the body.
        tile: Length of the material that one repeat of the texture covers [m].
        levels: Quantities at the vertices of the surface, see `TriangleMesh.levels`.
        look: Look of its material, or of its labels.
    """
    skin, cut = (
        _textured_triangles(surface, surface.triangles[chosen], tile, levels, look.variation)
        for chosen in (~surface.is_cut, surface.is_cut)
    )
    if look.labels and surface.labels is not None:
        place = np.searchsorted([each.label for each in look.labels], surface.labels)
        outside, inside = factors_of_labels(look)
        skin = _in_colours(skin, place[~surface.is_cut], outside)
        cut = _in_colours(cut, place[surface.is_cut], inside)
    if cut.tints is not None:
        of_skin = np.zeros(len(surface.positions), dtype=bool)
        of_skin[surface.triangles[~surface.is_cut]] = True
        is_at_rim = of_skin[_nodes_of(surface.triangles[surface.is_cut], cut.triangles)]
        is_dark = is_at_rim if look.rim < 0.0 else ~is_at_rim
        shades = np.where(is_dark, 1.0 - abs(look.rim), 1.0)
        cut = cut._replace(tints=cut.tints * shades[:, None])
    return TexturedSurface(skin, cut)


@functools.cache
def factors_of_labels(look: Look) -> tuple[FloatArray, FloatArray]:
    """Return the tints that give a labelled texture the colours of its labels, outside and inside.

    Linear light, shape (n_labels, 3) each. Where a colour is brighter than the middle of the
    texture, the brightest channel is 1 and the hue stays.
    """
    names = [each.skin for each in look.labels], [each.inside for each in look.labels]
    outside, inside = (
        _linear(colours) / _linear([colour_at(ramp, 0.5)])
        for colours, ramp in zip(names, (look.skin, look.inside), strict=True)
    )
    return tuple(
        each / np.maximum(each.max(axis=1, keepdims=True), 1.0) for each in (outside, inside)
    )


_EVEN = 0.55
"""Position on a ramp of the colour of tissue without its texture."""


def even_colours(look: Look) -> TissueColours:
    """Return the colours of a look without its texture."""
    skin, inside = (colour_at(ramp, _EVEN) for ramp in (look.skin, look.inside))
    return TissueColours(skin, inside, look.labels)


def colour_at(ramp: Ramp, position: float) -> str:
    """Return the colour of a ramp at a position on it."""
    knots = [knot for knot, _ in ramp]
    colours = np.array([list(bytes.fromhex(colour)) for _, colour in ramp], dtype=float)
    return bytes(round(np.interp(position, knots, channel)) for channel in colours.T).hex()


def _linear(colours: Sequence[str]) -> FloatArray:
    """Return colours in sRGB as linear light, shape (n, 3)."""
    shares = np.array([list(bytes.fromhex(colour)) for colour in colours]) / 255.0
    return np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)


def _in_colours(mesh: TriangleMesh, place: IntArray, tints: FloatArray) -> TriangleMesh:
    """Return a mesh in colours of its triangles: a vertex where they meet is there once for each.

    Args:
        mesh: The mesh, which has tints.
        place: Place of the colour of each triangle in `tints`, shape (n_triangles,).
        tints: Factors of the tints of the mesh, shape (n, 3).
    """
    n = len(tints)
    keys, triangles = _unique(n * mesh.triangles + place[:, None], n * len(mesh.positions))
    vertex, colour = keys // n, keys % n
    assert mesh.uv is not None and mesh.tints is not None
    return TriangleMesh(
        positions=mesh.positions[vertex],
        triangles=triangles,
        normals=mesh.normals[vertex],
        uv=mesh.uv[vertex],
        tints=mesh.tints[vertex] * tints[colour],
        levels={name: values[vertex] for name, values in mesh.levels.items()},
        rest=None if mesh.rest is None else mesh.rest[vertex],
    )


def _nodes_of(triangles: IntArray, corners: IntArray) -> IntArray:
    """Return the node of each vertex, from triangles between nodes and between vertices."""
    nodes = np.zeros(corners.max(initial=-1) + 1, dtype=np.int64)
    nodes[corners] = triangles
    return nodes


def _textured_triangles(
    surface: Surface,
    triangles: IntArray,
    tile: float,
    levels: Mapping[str, IntArray],
    variation: float,
) -> TriangleMesh:
    """Return some triangles of the surface as a mesh of its own."""
    charts = charts_of(surface.rest_positions, triangles, tile)
    return charts.mesh(surface.positions)._replace(
        tints=_tints(surface.rest_positions[charts.nodes] / tile, variation),
        levels={name: values[charts.nodes] for name, values in levels.items()},
        rest=surface.rest_positions[charts.nodes],
    )


def _unique(keys: IntArray, n_keys: int) -> tuple[IntArray, IntArray]:
    """Return the keys that occur, ascending, and the index of each key among them."""
    occurs = np.zeros(n_keys, dtype=bool)
    occurs[keys] = True
    index = np.cumsum(occurs) - 1
    found: IntArray = index[keys]
    return np.flatnonzero(occurs), found


def _tints(points: FloatArray, variation: float) -> FloatArray:
    """Return a slowly varying tint at points given in tiles, shape (n, 3), between 0 and 1.

    The tint is a sum of plane waves in random directions, so that it has no charts and no seams.
    """
    random = np.random.default_rng(7)
    waves = random.standard_normal((3, N_WAVES)) * 4.0
    phases = random.uniform(0.0, 2.0 * np.pi, N_WAVES)
    height = np.sin(points @ waves + phases).sum(axis=1) / np.sqrt(N_WAVES / 2.0)
    tint = 0.80 + variation * TINT_DEPTH * height[:, None] * np.array([0.55, 0.9, 1.0])
    clipped: FloatArray = np.clip(tint, 0.0, 1.0)
    return clipped
