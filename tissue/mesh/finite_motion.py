"""Whether the motion of a body is made of finite numbers."""

import math

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, lanes
from tissue.core.simd_blocks import sum_of_lanes
from tissue.core.simd_rows import rows_of_three
from tissue.core.vec3 import vec3
from tissue.mesh.body import Body


@kernel
def is_motion_finite(body: Body) -> bool:
    """Return whether all positions and velocities are finite numbers."""
    n = body.n_nodes
    return _are_finite(body.positions, n) and _are_finite(body.velocities, n)


@kernel
def _are_finite(points: FloatArray, n: int) -> bool:
    """Return whether the first `n` points are finite, of an array of shape (capacity, 3)."""
    # The difference of a number from itself is 0 where it is finite, else nan, as is the sum then.
    sums = lanes(0.0)
    n_in_lanes = n // WIDTH * WIDTH
    for i in range(0, n_in_lanes, WIDTH):
        x, y, z = rows_of_three(points, i)
        sums = sums + ((x - x) + (y - y) + (z - z))
    rest = 0.0
    for i in range(n_in_lanes, n):
        p = vec3(points, i)
        rest += (p.x - p.x) + (p.y - p.y) + (p.z - p.z)
    return math.isfinite(sum_of_lanes(sums) + rest)
