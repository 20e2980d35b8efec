"""Quantities at the vertices of a surface as levels from 0 to 255, which pages show as colours."""

from collections.abc import Mapping

import numpy as np

from tissue import FloatArray, IntArray, SurfaceQuantity

HIGHEST_LEVEL = 255
"""Level of the top, and of all above it."""

TOP_PERCENTILE = 99.0
"""Share of the vertices whose values are below the top [%]. In a few around the edge of the blade
they are so high that all others would have one colour."""


def levels_of(
    values: Mapping[SurfaceQuantity, FloatArray],
) -> tuple[dict[str, IntArray], dict[str, float]]:
    """Return the levels of quantities, and the value of each for which the highest level stands.

    Values below 0 have level 0, those above the top the highest.
    """
    levels: dict[str, IntArray] = {}
    tops: dict[str, float] = {}
    for name, array in values.items():
        top = max(float(np.percentile(array, TOP_PERCENTILE)), 0.0)
        shares = array / top if top > 0.0 else np.zeros_like(array)
        levels[name] = np.rint(HIGHEST_LEVEL * np.clip(shares, 0.0, 1.0)).astype(np.int64)
        tops[name] = top
    return levels, tops
