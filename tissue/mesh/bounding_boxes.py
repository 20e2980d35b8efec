"""Where the body is."""

import math
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, vec3
from tissue.mesh.body import Body


class Survey(NamedTuple):
    """One look at all nodes."""

    low: Vec3
    """Lowest corner of the body [m]."""
    high: Vec3
    """Highest corner [m]."""
    is_finite: bool
    """Whether all positions are; where one is not, the motion became unstable."""


@kernel
def survey(body: Body) -> Survey:
    """Look at all nodes."""
    box = Survey(Vec3(np.inf, np.inf, np.inf), Vec3(-np.inf, -np.inf, -np.inf), True)
    x = body.positions
    for node in range(body.n_nodes):
        box = _with(box, vec3(x, node))
    return box


@kernel
def survey_of(body: Body, nodes: IntArray, n: int, before: Survey) -> Survey:
    """Look at the first `n` of `nodes`, which are all that moved since the survey `before`.

    The box may be larger than the body: what moved inwards may have left its corner.
    """
    now = before
    for i in range(n):
        now = _with(now, vec3(body.positions, nodes[i]))
    return now


@inlined
def _with(box: Survey, p: Vec3) -> Survey:
    low = Vec3(min(box.low.x, p.x), min(box.low.y, p.y), min(box.low.z, p.z))
    high = Vec3(max(box.high.x, p.x), max(box.high.y, p.y), max(box.high.z, p.z))
    # A comparison with nan is false: min and max would overlook it.
    is_finite = box.is_finite and math.isfinite(p.x + p.y + p.z)
    return Survey(low, high, is_finite)


def boxes_meet(one: tuple[Vec3, Vec3], other: tuple[Vec3, Vec3]) -> bool:
    """Whether two boxes, of lowest and highest corner each, have a point in common."""
    lows, highs = zip(one[0], other[0], strict=True), zip(one[1], other[1], strict=True)
    return all(max(low) <= min(high) for low, high in zip(lows, highs, strict=True))
