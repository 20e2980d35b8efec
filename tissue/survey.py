"""Where the body is."""

from typing import NamedTuple

import numpy as np

from tissue.body import NODES, Body
from tissue.jit import kernel
from tissue.vec3 import Vec3


class Survey(NamedTuple):
    """One look at all nodes."""

    low: Vec3
    """Lowest corner of the body [m]."""
    high: Vec3
    """Highest corner [m]; not finite where the motion became unstable."""
    is_finite: bool
    """Whether all positions are."""


@kernel
def survey(body: Body) -> Survey:
    """Look at all nodes."""
    x = body.positions
    n = body.counts[NODES]
    low_x = low_y = low_z = np.inf
    high_x = high_y = high_z = -np.inf
    total = 0.0
    for i in range(n):
        low_x = min(low_x, x[i, 0])
        low_y = min(low_y, x[i, 1])
        low_z = min(low_z, x[i, 2])
        high_x = max(high_x, x[i, 0])
        high_y = max(high_y, x[i, 1])
        high_z = max(high_z, x[i, 2])
        total += x[i, 0] + x[i, 1] + x[i, 2]
    is_finite = np.isfinite(total)
    if not is_finite:  # a comparison with nan is false: min and max would overlook it
        high_x = total
    return Survey(Vec3(low_x, low_y, low_z), Vec3(high_x, high_y, high_z), is_finite)
