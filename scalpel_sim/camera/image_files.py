"""Files of images: colours and numbers as PNG, depth as PNG or as an array of NumPy."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from scalpel_sim.camera.camera import CameraImage
from scalpel_sim.errors import UsageError, writing
from scalpel_sim.output.export import check_file
from tissue import IntArray
from tissue.support import whole_file

DEPTH_UNIT = 1e-4
"""Depth that a step of a 16-bit PNG stands for [m]: 0.1 mm, so that it reaches 6.5 m."""

_PNG, _NPY = ".png", ".npy"

_PALETTE = (
    *("000000", "d98880", "c0392b", "dfe4e8", "f4d03f", "48c9b0", "5dade2", "af7ac5", "eb984e"),
    *("a9dfbf", "f5b7b1", "7fb3d5", "d7bde2", "fad7a0", "73c6b6", "85929e"),
)
"""Colours of numbers in a PNG, in turn; 0, nothing, is black."""


def check_image_file(path: Path, option: str) -> None:
    """Make sure before the work that an image can be written to a file.

    Args:
        path: The file; one that is there will be overwritten.
        option: The option that chose it, for the message.

    Raises:
        UsageError: another suffix than .png or .npy, or a folder that is not there.
        RunError: the system refuses.
    """
    suffix = path.suffix.lower()
    if suffix not in (_PNG, _NPY):
        raise UsageError(
            f"{option} is {path}; its name must end in .png, for a picture, or in .npy, for an "
            "array of NumPy"
        )
    check_file(path, suffix, option)


def write_colours(path: Path, image: np.ndarray) -> None:
    """Write red, green and blue of an image.

    Raises:
        RunError: the file cannot be written.
    """
    if path.suffix.lower() == _NPY:
        _write_array(path, image)
    else:
        _write_png(path, Image.fromarray(image))


def write_depth(path: Path, depth: np.ndarray, far: float) -> None:
    """Write a depth: as an array in metres; or as a PNG of 16 bits.

    In the PNG a step is `DEPTH_UNIT`, and 0 is where nothing is, or beyond 6.5 m.

    Args:
        path: The file.
        depth: The depth [m].
        far: Depth where nothing is [m].

    Raises:
        RunError: the file cannot be written.
    """
    if path.suffix.lower() == _NPY:
        return _write_array(path, depth)
    steps = np.rint(depth.astype(np.float64) / DEPTH_UNIT)
    steps[(depth >= far) | (steps > np.iinfo(np.uint16).max)] = 0
    _write_png(path, Image.fromarray(steps.astype(np.uint16)))


def write_segmentation(path: Path, picture: IntArray, ids: Mapping[str, int]) -> None:
    """Write a segmentation: as an array; or as a PNG whose values are the numbers, in colours.

    The PNG has the table of names as the text `ids`, in JSON.

    Args:
        path: The file.
        picture: Numbers of the pixels.
        ids: Numbers by name.

    Raises:
        RunError: the file cannot be written.
    """
    if path.suffix.lower() == _NPY:
        return _write_array(path, picture)
    image = Image.fromarray(picture.astype(np.uint8)).convert("L")
    image.putpalette(bytes.fromhex("".join(_PALETTE[_of_palette(i)] for i in range(256))))
    texts = PngInfo()
    texts.add_text("ids", json.dumps(dict(ids)))
    _write_png(path, image, texts)


def write_image(
    image: CameraImage, files: Mapping[str, Path], *, far: float, ids: Mapping[str, int]
) -> list[str]:
    """Write what is wanted of an image; return the names of the files.

    Args:
        image: The image.
        files: Files by what they are for: `output`, the colours, `depth` and `segmentation`.
        far: Depth where nothing is [m].
        ids: Numbers of the segmentation by name.

    Raises:
        RunError: a file cannot be written.
    """
    if "output" in files:
        write_colours(files["output"], image.rgb)
    if "depth" in files:
        write_depth(files["depth"], image.depth, far)
    if "segmentation" in files:
        write_segmentation(files["segmentation"], image.segmentation, ids)
    return [str(path) for path in files.values()]


def _of_palette(number: int) -> int:
    """Return the place in the palette of the colour of a number."""
    return number if number == 0 else 1 + (number - 1) % (len(_PALETTE) - 1)


def _write_png(path: Path, image: Image.Image, texts: PngInfo | None = None) -> None:
    with writing(path, "another file"), whole_file(path) as unfinished:
        image.save(unfinished, "PNG", pnginfo=texts)


def _write_array(path: Path, array: np.ndarray) -> None:
    with writing(path, "another file"), whole_file(path) as unfinished, open(unfinished, "wb") as f:
        np.save(f, array)
