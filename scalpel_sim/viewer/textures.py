"""Pictures of living tissue, made of noise: skin, and the inside that a blade lays open.

Every picture repeats without a seam in both directions, because its noise is made in Fourier
space. Colours come from one height field through a colour ramp, so that the same picture serves
as a bump map: what is dark lies deep.
"""

import functools
import struct
import zlib

import numpy as np

from tissue import FloatArray

SIZE = 512
"""Pixels along each side; a power of two, as mipmaps want it."""

N_COLOURS = 64
"""Entries of the colour ramp. More are not seen, and cost bytes in every replay."""

SKIN_RAMP = ((0.0, "4d1613"), (0.3, "7d2a22"), (0.55, "9c3f32"), (0.8, "b3574a"), (1.0, "cc7d6c"))
"""Deep vessels to thin capsule: dark red-brown to pink, position along the ramp and sRGB colour."""

CUT_RAMP = ((0.0, "7a0f14"), (0.35, "b01f22"), (0.65, "d4423c"), (0.9, "ea7a6a"), (1.0, "f6b3a0"))
"""Blood between the fibres to bare fibre: wet red to pale pink."""


@functools.cache
def skin() -> bytes:
    """Return the outside of an organ as a PNG: mottled, with fine branching vessels."""
    mottling = _standardized(_noise(seed=1, wavelength=90.0, spread=0.9))
    grain = _standardized(_noise(seed=2, wavelength=9.0, spread=0.5))
    vessels = np.maximum(
        _ridges(seed=3, wavelength=150.0, width=0.045),
        0.7 * _ridges(seed=4, wavelength=70.0, width=0.06),
    )
    fading = np.clip(0.55 + 0.5 * _standardized(_noise(seed=5, wavelength=200.0, spread=0.5)), 0, 1)
    height = 0.54 + 0.11 * mottling + 0.05 * grain - 0.42 * vessels * fading
    return _encode_png(height, SKIN_RAMP)


@functools.cache
def cut_face() -> bytes:
    """Return freshly cut tissue as a PNG: striated along u, brighter and redder than skin."""
    fibres = _standardized(_noise(seed=11, wavelength=11.0, spread=0.7, stretch=6.0))
    bundles = _standardized(_noise(seed=12, wavelength=70.0, spread=0.6, stretch=3.5))
    grain = _standardized(_noise(seed=13, wavelength=5.0, spread=0.4))
    lobules = _ridges(seed=14, wavelength=110.0, width=0.05)
    height = 0.50 + 0.09 * fibres + 0.06 * bundles + 0.03 * grain - 0.12 * lobules
    return _encode_png(height, CUT_RAMP)


@functools.cache
def fading_disc() -> bytes:
    """Return a PNG that is white in the middle and black at the rim: where a table ends, softly."""
    axis = np.linspace(-1.0, 1.0, 256)
    radius = np.hypot(axis[:, None], axis[None, :])
    fade = np.clip((1.0 - radius) / 0.75, 0.0, 1.0)
    return _encode_png(fade * fade * (3.0 - 2.0 * fade), ((0.0, "000000"), (1.0, "ffffff")))


def _noise(seed: int, wavelength: float, spread: float, stretch: float = 1.0) -> FloatArray:
    """Return noise of about one wavelength [pixels], `stretch` times longer along u; (SIZE, SIZE).

    White noise, filtered in Fourier space by a bell over log wavelength of width `spread`, which
    makes it periodic.
    """
    white = np.random.default_rng(seed).standard_normal((SIZE, SIZE))
    along_v = np.fft.fftfreq(SIZE)[:, None]
    along_u = np.fft.rfftfreq(SIZE)[None, :]
    frequency = np.hypot(along_v, along_u * stretch)
    frequency[0, 0] = 1.0
    bell = np.exp(-0.5 * (np.log(frequency * wavelength) / spread) ** 2) / frequency
    bell[0, 0] = 0.0
    return np.fft.irfft2(np.fft.rfft2(white) * bell, s=(SIZE, SIZE))


def _standardized(field: FloatArray) -> FloatArray:
    """Return the field with mean 0 and standard deviation 1."""
    return (field - field.mean()) / field.std()


def _ridges(seed: int, wavelength: float, width: float) -> FloatArray:
    """Return winding, closed lines where noise passes through zero: 1 on a line, 0 away from it."""
    field = _standardized(_noise(seed, wavelength, spread=0.35))
    return np.exp(-((field / width) ** 2))


def _encode_png(height: FloatArray, ramp: tuple[tuple[float, str], ...]) -> bytes:
    """Return heights between 0 and 1, seen through a colour ramp, as a palette PNG.

    Source: PNG specification, ISO/IEC 15948, chunks IHDR, PLTE, IDAT and IEND.
    """
    knots = [position for position, _ in ramp]
    colours = np.array([list(bytes.fromhex(colour)) for _, colour in ramp], dtype=float)
    steps = np.linspace(0.0, 1.0, N_COLOURS)
    palette = np.stack([np.interp(steps, knots, colours[:, channel]) for channel in range(3)], 1)
    indices = np.round(np.clip(height, 0.0, 1.0) * (N_COLOURS - 1)).astype(np.uint8)
    rows = np.pad(indices, ((0, 0), (1, 0)))  # each row starts with its filter: 0, none
    header = struct.pack(">IIBBBBB", height.shape[1], height.shape[0], 8, 3, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        (
            _chunk(b"IHDR", header),
            _chunk(b"PLTE", np.round(palette).astype(np.uint8).tobytes()),
            _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(kind: bytes, body: bytes) -> bytes:
    """Return one PNG chunk: length, kind, body, checksum."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
