"""The unit of a file that does not name one, from the size of what is in it."""

import math
from pathlib import Path

from scalpel_sim.errors import UsageError

POSSIBLE_WIDTHS = (1e-5, 1e3)
"""Widths that a mesh may have [m], as `tissue.read_mesh` has it."""

METRE, MILLIMETRE = 1.0, 1e-3
"""[m]"""

_QUESTIONS = {
    MILLIMETRE: "Millimetres? Then add --scale 0.001, which makes it {:.4g} mm wide; metres: "
    "--scale 1",
    1e-6: "Micrometres? Then add --scale 1e-6, which makes it {:.4g} um wide; millimetres: "
    "--scale 0.001",
}


def scale_of(path: Path, width: float, scale: float | None) -> float:
    """Return the unit of a file in metres: the one that was given, or metres where that is likely.

    What is likely is what `scalpel-sim check` says; another unit than metres is asked about.

    Args:
        path: The file, for messages.
        width: The largest side of the box around the body, in the unit of the file.
        scale: The unit that the user gave, in metres. None: none.

    Raises:
        UsageError: the unit has to be given, or the body is of an impossible size with it.
    """
    if scale is None:
        from tissue.support import likely_unit

        unit = likely_unit(width)
        if unit == METRE:
            return METRE
        start = f"the body is {width:.4g} wide, and the file does not say of what unit. "
        other = "Add --scale, that unit in metres: 1 for metres, 0.001 for millimetres"
        question = other if unit is None else _QUESTIONS[unit].format(width)
        raise UsageError(f"{path}: {start}{question}")
    if not math.isfinite(scale) or scale <= 0.0:
        raise UsageError(f"--scale is {scale:g}; it is the unit in metres: 0.001 for millimetres")
    lowest, highest = POSSIBLE_WIDTHS
    if not lowest <= scale * width <= highest:
        raise UsageError(
            f"{path}: with --scale {scale:g} the body is {scale * width:.3g} m wide; it may have "
            f"{lowest:g} to {highest:g} m. The file has {width:.4g} of its own unit"
        )
    return scale
