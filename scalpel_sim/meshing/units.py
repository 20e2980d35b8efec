"""The unit of a file that does not name one, from the size of what is in it."""

import math
from pathlib import Path

from scalpel_sim.errors import UsageError

USUAL_WIDTHS = (2e-3, 1.0)
"""Widths of bodies that are cut [m], from a biopsy to a torso: a file with another number is hardly
in metres."""

POSSIBLE_WIDTHS = (1e-5, 1e3)
"""Widths that a mesh may have [m], as `tissue.read_mesh` has it."""

MILLIMETRE = 1e-3
"""[m]"""


def scale_of(path: Path, width: float, scale: float | None) -> float:
    """Return the unit of a file in metres: the one that was given, or metres where that can be.

    Args:
        path: The file, for messages.
        width: The largest side of the box around the body, in the unit of the file.
        scale: The unit that the user gave, in metres. None: none.

    Raises:
        UsageError: the unit has to be given, or the body is of an impossible size with it.
    """
    if scale is None:
        lowest, highest = USUAL_WIDTHS
        if lowest <= width <= highest:
            return 1.0
        raise UsageError(f"{path}: {_question(width)}")
    if not math.isfinite(scale) or scale <= 0.0:
        raise UsageError(f"--scale is {scale:g}; it is the unit in metres: 0.001 for millimetres")
    lowest, highest = POSSIBLE_WIDTHS
    if not lowest <= scale * width <= highest:
        raise UsageError(
            f"{path}: with --scale {scale:g} the body is {scale * width:.3g} m wide; it may have "
            f"{lowest:g} to {highest:g} m. The file has {width:.4g} of its own unit"
        )
    return scale


def _question(width: float) -> str:
    """Return what to ask about a width that is unlikely in metres."""
    start = f"the body is {width:.4g} wide, and the file does not say of what unit"
    lowest, highest = USUAL_WIDTHS
    if lowest <= MILLIMETRE * width <= highest:
        return (
            f"{start}. Millimetres? Then add --scale 0.001, which makes it {width:.4g} mm wide; "
            "metres: --scale 1"
        )
    return f"{start}. Add --scale, that unit in metres: 1 for metres, 0.001 for millimetres"
