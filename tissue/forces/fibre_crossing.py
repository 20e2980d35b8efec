"""Which fibres the edge of the blade sweeps across in an increment."""

from typing import NamedTuple

from tissue.blade.edge import LEAST_SINE, BladePose, Edge, pose_at
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, lerp, sub
from tissue.forces.attachments import STRAIGHT, Attachments, attached_point, other_end
from tissue.forces.fibres import catch_fibre


@kernel
def note_fibres(fibres: Attachments, positions: FloatArray, when: float) -> None:
    """Note where the ends of all fibres are [m], before an increment."""
    for p in range(len(fibres.nodes)):
        x = attached_point(fibres, p, positions)
        other = other_end(fibres, p, positions, when)
        for axis in range(3):
            fibres.before[p, axis], fibres.before[p, 3 + axis] = x[axis], other[axis]


@kernel
def catch_fibres(
    fibres: Attachments, positions: FloatArray, edge: Edge, begin: float, end: float
) -> None:
    """Catch the fibres that the edge has swept across in an increment, forwards.

    A fibre passes on the other side of the line of the edge than before: that is tested once in
    each increment, and the next one begins with the answer. Where edge and fibre were nearest to
    each other in between, that was within both.

    Args:
        fibres: Written.
        positions: Positions of the nodes [m].
        edge: The cutting edge over the time step.
        begin: Fraction of the time step at which the increment begins.
        end: Fraction of the time step at which it ends.
    """
    first, last = pose_at(edge, begin), pose_at(edge, end)
    for p in range(len(fibres.nodes)):
        if fibres.state[p] != STRAIGHT or fibres.section[p] == 0.0:
            continue
        row = fibres.before[p]
        x0, end0 = Vec3(row[0], row[1], row[2]), Vec3(row[3], row[4], row[5])
        x1 = attached_point(fibres, p, positions)
        end1 = other_end(fibres, p, positions, end)
        volume0, volume1 = _volume(first, x0, end0), _volume(last, x1, end1)
        side0 = fibres.side[p] if fibres.side[p] != 0.0 else _side_of(volume0)
        fibres.side[p] = _side_of(volume1)
        if fibres.side[p] == side0:
            continue
        change = volume1 - volume0
        share = min(max(-volume0 / change, 0.0), 1.0) if change != 0.0 else 0.0
        tip, heel = lerp(share, first.tip, last.tip), lerp(share, first.heel, last.heel)
        at = _crossing(sub(heel, tip), lerp(share, x0, x1), lerp(share, end0, end1), tip)
        if not at.is_within:
            continue
        on_edge = at.of_edge
        of_edge = sub(lerp(on_edge, last.tip, last.heel), lerp(on_edge, first.tip, first.heel))
        of_fibre = sub(lerp(at.of_fibre, x1, end1), lerp(at.of_fibre, x0, end0))
        if dot(sub(of_edge, of_fibre), last.forward) > 0.0:
            catch_fibre(fibres, p, last, x1, end1, at.of_fibre)


@kernel
def _volume(pose: BladePose, x: Vec3, end: Vec3) -> float:
    """Return six times the signed volume of edge and fibre [m3]: on which side it passes."""
    return dot(sub(pose.heel, pose.tip), cross(sub(x, pose.tip), sub(end, pose.tip)))


@kernel
def _side_of(volume: float) -> float:
    """Return 1 or -1; a fibre that touches the line of the edge is on the side of 1."""
    return 1.0 if volume >= 0.0 else -1.0


class _Crossing(NamedTuple):
    """Where two segments are nearest to each other."""

    is_within: bool
    """Whether that is within both; not where they are parallel."""
    of_edge: float
    """Fraction of the edge, from its tip."""
    of_fibre: float
    """Fraction of the fibre, from its point of the tissue."""


@kernel
def _crossing(along: Vec3, x: Vec3, end: Vec3, tip: Vec3) -> _Crossing:
    """Return where an edge from `tip` on and a fibre from `x` to `end` are nearest."""
    d, r = sub(end, x), sub(x, tip)
    aa, dd, ad = dot(along, along), dot(d, d), dot(along, d)
    determinant = aa * dd - ad * ad
    if determinant <= LEAST_SINE * LEAST_SINE * aa * dd:
        return _Crossing(False, 0.0, 0.0)
    ar, dr = dot(along, r), dot(d, r)
    of_edge = (dd * ar - ad * dr) / determinant
    of_fibre = (ad * ar - aa * dr) / determinant
    is_within = 0.0 <= of_edge <= 1.0 and 0.0 <= of_fibre <= 1.0
    return _Crossing(is_within, of_edge, of_fibre)
