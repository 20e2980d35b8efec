"""Textures of living tissue, made of noise: its skin, and the inside that a cut exposes.

Every texture repeats without a seam in both directions, because its noise is made in Fourier
space. A colour ramp turns a height field into colours, so that the same picture serves as a bump
map: dark parts lie deep.
"""

import functools
import io

import numpy as np
from PIL import Image

from tissue import FloatArray

TEXTURE_PIXELS = 512
"""Pixels along each side of a texture; a power of two, as mipmaps need it."""

N_COLOURS = 64
"""Number of colours of a ramp. More cannot be seen, and cost bytes in every replay."""

SKIN_RAMP = ((0.0, "4d1613"), (0.3, "7d2a22"), (0.55, "9c3f32"), (0.8, "b3574a"), (1.0, "cc7d6c"))
"""Colours of skin from deep vessels, dark red-brown, to the thin capsule, pink: position along the
ramp and sRGB colour."""

CUT_RAMP = ((0.0, "7a0f14"), (0.35, "b01f22"), (0.65, "d4423c"), (0.9, "ea7a6a"), (1.0, "f6b3a0"))
"""Colours of cut faces from the blood between fibres, red, to bare fibres, pale pink."""


@functools.cache
def skin() -> bytes:
    """Return the texture of an organ's skin as a PNG: mottled, with fine branching vessels."""
    mottling = _standardized(_noise(seed=1, wavelength=90.0, spread=0.9))
    grain = _standardized(_noise(seed=2, wavelength=9.0, spread=0.5))
    vessels = np.maximum(
        _ridges(seed=3, wavelength=150.0, width=0.045),
        0.7 * _ridges(seed=4, wavelength=70.0, width=0.06),
    )
    fading = np.clip(0.55 + 0.5 * _standardized(_noise(seed=5, wavelength=200.0, spread=0.5)), 0, 1)
    height = 0.54 + 0.11 * mottling + 0.05 * grain - 0.42 * vessels * fading
    return _png(height, SKIN_RAMP)


@functools.cache
def cut_face() -> bytes:
    """Return the texture of cut faces as a PNG: striated along u, brighter and redder than skin."""
    fibres = _standardized(_noise(seed=11, wavelength=11.0, spread=0.7, stretch=6.0))
    bundles = _standardized(_noise(seed=12, wavelength=70.0, spread=0.6, stretch=3.5))
    grain = _standardized(_noise(seed=13, wavelength=5.0, spread=0.4))
    lobules = _ridges(seed=14, wavelength=110.0, width=0.05)
    height = 0.50 + 0.09 * fibres + 0.06 * bundles + 0.03 * grain - 0.12 * lobules
    return _png(height, CUT_RAMP)


@functools.cache
def fading_disc() -> bytes:
    """Return the opacity of a table as a PNG that fades from white in the middle to black."""
    axis = np.linspace(-1.0, 1.0, 256)
    radius = np.hypot(axis[:, None], axis[None, :])
    fade = np.clip((1.0 - radius) / 0.75, 0.0, 1.0)
    return _png(fade * fade * (3.0 - 2.0 * fade), ((0.0, "000000"), (1.0, "ffffff")))


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


def _png(height: FloatArray, ramp: tuple[tuple[float, str], ...]) -> bytes:
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
