"""Checks of the motion of a blade: each error names the offending value."""

import math

import numpy as np
import numpy.typing as npt

from tissue.blade.edge import LEAST_SINE, Edge
from tissue.core.array_types import FloatArray
from tissue.core.three_vectors import BladeSweep
from tissue.core.vec3 import Vec3


def edge_of(sweep: BladeSweep) -> Edge:
    """Return the cutting edge over a step; `begin_blade_step` checks what it is.

    Raises:
        ValueError: tip, heel or forward are not three numbers each.
    """
    try:
        return Edge.of_numbers(sweep.t0.numbers + sweep.t1.numbers)
    except (AttributeError, TypeError, ValueError):
        return edge_or_error(sweep)


def edge_or_error(sweep: BladeSweep) -> Edge:
    """Return the cutting edge over a step, where a blade can move so.

    Raises:
        ValueError: a number is not finite, the blade has no length, it would cut along itself, or
            it turns by more than a right angle.
    """
    points, ways = [], []
    for when, segment in (("start", sweep.t0), ("end", sweep.t1)):
        tip, heel, forward = map(_three_numbers, segment)
        if tip is None or heel is None or forward is None:
            rows = [np.asarray(part, dtype=np.float64).tolist() for part in segment]
            raise ValueError(
                f"the blade at the {when} of the step is {rows}; tip, heel and forward are three "
                "finite numbers each"
            )
        x, y, z = heel.x - tip.x, heel.y - tip.y, heel.z - tip.z
        u, v, w = forward
        length = math.hypot(x, y, z)
        if not length > 0.0:
            raise ValueError(
                f"the blade at the {when} of the step has no length: {[[*tip], [*heel]]}"
            )
        across = math.hypot(y * w - z * v, z * u - x * w, x * v - y * u)
        if not across > LEAST_SINE * length * math.hypot(u, v, w):
            raise ValueError(
                f"the blade at the {when} of the step cuts along its own edge: forward is "
                f"{[*forward]}, from tip to heel is {[x, y, z]}"
            )
        points += [tip, heel, forward]
        ways.append((x, y, z))
    edge = Edge(*points)
    (x, y, z), (u, v, w) = ways
    (a, b, c), (f, g, h) = edge.forward_t0, edge.forward_t1
    if not (x * u + y * v + z * w > 0.0 and a * f + b * g + c * h > 0.0):
        expect_small_turn(np.array(ways), np.array([edge.forward_t0, edge.forward_t1]))
    return edge


def _three_numbers(part: npt.ArrayLike) -> Vec3 | None:
    """Return three finite numbers as plain floats; None where they are not that."""
    array = np.asarray(part, dtype=np.float64)
    if array.shape != (3,):
        return None
    x, y, z = array.tolist()
    # A sum is finite only where all are, and is faster to ask.
    is_finite = math.isfinite(x + y + z) or all(map(math.isfinite, (x, y, z)))
    return Vec3(x, y, z) if is_finite else None


def expect_small_turn(along: FloatArray, forward: FloatArray) -> None:
    """Check that the blade turns by less than a right angle from each place to the next.

    Between two places it is interpolated; halfway round it would have no direction.

    Args:
        along: From tip to heel, shape (n_places, 3).
        forward: Where it faces, shape (n_places, 3).

    Raises:
        ValueError: it turns further.
    """
    for what, way in (("edge", along), ("forward", forward)):
        wrong = np.flatnonzero(~((way[1:] * way[:-1]).sum(axis=1) > 0.0))
        if len(wrong):
            i = int(wrong[0])
            raise ValueError(
                f"the blade's {what} turns by a right angle or more in one step, from "
                f"{way[i].tolist()} to {way[i + 1].tolist()}; turn it in smaller steps"
            )
