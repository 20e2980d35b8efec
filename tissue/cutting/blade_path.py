"""The path of the cutting edge through the material in one step, and the plane of the cut there."""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.geometry.exact_predicates import Lattice, nearest
from tissue.geometry.tetrahedron import nearest_on_segment, normalised

LEAST_ALIGNMENT = 0.7
"""Cosine of the angle between the normal of the path and that of the blade's flat; below it the
blade's is used."""

LEAST_DIRECTION = 0.5
"""Length of `Path.direction`, at least, where it shows the motion of an end of the edge."""

_FARTHEST = 1 << 62
"""Steps of the lattice beyond any of its points."""


class Path(Arrays):
    """Displacements of the n samples of the edge through the body at rest in one step."""

    t0: FloatArray = sized("samples", 3)
    """Rest positions of the samples at the start of the step [m], shape (n, 3)."""
    t1: FloatArray = sized("samples", 3)
    """Rest positions of the samples at the end of the step [m], shape (n, 3)."""
    lattice_t0: IntArray = sized("samples", 3)
    """`t0` on the lattice, shape (n, 3)."""
    lattice_t1: IntArray = sized("samples", 3)
    """`t1` on the lattice, shape (n, 3)."""
    forward: FloatArray = sized("samples", 3)
    """Unit vector in which the edge cuts, in the body at rest, shape (n, 3)."""
    sideways: FloatArray = sized("samples", 3)
    """Unit normal of the blade's flat, in the body at rest: the side +1; shape (n, 3)."""
    direction: FloatArray = sized(2, 3)
    """Direction in which the tip and the heel went last, averaged over a node size, shape (2, 3).
    It is shorter than 1 at first, and where the direction changes; 0 outside the tissue."""
    shift: FloatArray = sized("samples", 3)
    """By how much `t1` is shifted from where the edge was traced [m], shape (n, 3): the ends make
    good what opened beyond their paths (`tissue.cutting.end_depth`)."""
    aside: FloatArray = sized("samples")
    """The part of `shift` along `sideways` by which the cut follows a layer [m], shape (n,)."""
    aside_before: FloatArray = sized("samples")
    """The same in the step before [m], shape (n,)."""
    shift_t0: FloatArray = sized(2, 3)
    """By how much `t0` of the tip and of the heel are shifted [m], shape (2, 3)."""
    excess: FloatArray = sized(2)
    """Area by which the cut is beyond the paths of the tip and of the heel [m2], shape (2,)."""
    seed: IntArray = sized("samples", fill=-1)
    """Tetrahedron at or next to each sample, or -1; shape (n,)."""
    member: BoolArray = sized("samples")
    """Whether each sample is part of the chain at the end of the step, shape (n,)."""
    known: BoolArray = sized("samples")
    """Whether each sample was part of the chain in the step before, so that its `t1` is where it
    was then; shape (n,)."""
    linked: BoolArray = sized("samples")
    """Whether each sample and the next one span a piece of the cut surface, shape (n,)."""
    has_left: IntCell
    """1 if the edge has left a wall ahead in this incision, through the skin; else 0."""
    has_end_in: IntCell
    """1 if the tip or the heel has held tissue in this incision; else 0."""
    is_through: IntCell
    """1 if all tissue that the edge holds is left ahead in this step, through the skin; else 0."""
    boxes: IntArray = sized(6, "samples")
    """Lowest and highest lattice point of the quad from each sample to the next, and last those of
    all quads that are linked, coordinate by coordinate: shape (6, n). Where samples are not linked
    the lowest is above the highest."""


def new_path(n: int) -> Path:
    """Return a path of `n` samples that spans nothing yet."""
    return Path.new({"samples": n})


class Plane(NamedTuple):
    """The plane of the cut surface near a point."""

    point: Vec3
    """A point in the plane, in the body at rest [m]."""
    normal: Vec3
    """Unit normal towards side +1."""


@kernel
def plane_at(path: Path, k: int, p: Vec3) -> Plane:
    """Return the plane of the cut at the point of segment `k` of the edge nearest to `p` [m]."""
    tip = vec3(path.t1, k)
    along = sub(vec3(path.t1, k + 1), tip)
    normal = normalised(cross(vec3(path.forward, k), along))
    # Where samples have slipped past each other the normal of the path is of no use.
    sideways = vec3(path.sideways, k)
    if dot(normal, sideways) < LEAST_ALIGNMENT:
        normal = sideways
    return Plane(nearest_on_segment(tip, vec3(path.t1, k + 1), p), normal)


class Nearest(NamedTuple):
    """The point of the edge that is nearest to a given point."""

    segment: int
    """Segment of the edge, -1 where the edge spans nothing."""
    along: float
    """Foot of the given point on the segment's line: 0 at its first sample, 1 at its second.
    Outside that range the point is beyond an end of the segment."""


@kernel
def nearest_on_edge(path: Path, p: Vec3) -> Nearest:
    """Find the segment of the edge that is nearest to `p` [m] at the end of the step."""
    best = np.inf
    found = Nearest(-1, 0.0)
    for k in range(len(path.linked) - 1):
        if not path.linked[k]:
            continue
        start = vec3(path.t1, k)
        segment = sub(vec3(path.t1, k + 1), start)
        squared = dot(segment, segment)
        along = dot(sub(p, start), segment) / squared if squared > 0.0 else 0.0
        d = sub(p, axpy(min(1.0, max(0.0, along)), segment, start))
        if dot(d, d) < best:
            best = dot(d, d)
            found = Nearest(k, along)
    return found


@kernel
def is_unswept(path: Path, p: Vec3, margin: float, beyond: float) -> bool:
    """Return whether a point of the body at rest is where the edge has not been.

    It is ahead of where the edge is at the end of the step, or beyond the path of tip or heel.

    Args:
        path: Path of the edge.
        p: The point, on the cut surface or near it [m].
        margin: Distance ahead by which it is so at least [m].
        beyond: Distance beyond the path of an end by which it is so at least [m].
    """
    k = nearest_on_edge(path, p).segment
    if k < 0:
        return False
    at = nearest_on_segment(vec3(path.t1, k), vec3(path.t1, k + 1), p)
    if dot(sub(p, at), vec3(path.forward, k)) > margin:
        return True
    last = len(path.linked) - 1
    first, stop = k, k + 1
    while first > 0 and path.linked[first - 1]:
        first -= 1
    while stop < last and path.linked[stop]:
        stop += 1
    return (first == 0 and _is_beyond_end(path, 0, 0, p, beyond)) or (
        stop == last and _is_beyond_end(path, 1, last, p, beyond)
    )


@kernel
def _is_beyond_end(path: Path, end: int, sample: int, p: Vec3, margin: float) -> bool:
    """Return whether a point is beyond the path of the tip, `end` 0, or of the heel, `end` 1."""
    outwards = cross(vec3(path.direction, end), vec3(path.sideways, sample))
    if end == 1:
        outwards = scale(-1.0, outwards)
    size = norm(outwards)
    return size > LEAST_DIRECTION and dot(sub(p, vec3(path.t1, sample)), outwards) > margin * size


@kernel
def average_directions(path: Path, over: float) -> None:
    """Average the directions in which tip and heel go, over a distance `over` [m]."""
    for end in range(2):
        sample = 0 if end == 0 else len(path.member) - 1
        direction = vec3(path.direction, end)
        if not path.member[sample]:
            store(path.direction, end, scale(0.0, direction))
            continue
        step = sub(vec3(path.t1, sample), vec3(path.t0, sample))
        distance = norm(step)
        if distance > 0.0:
            share = min(distance / over, 1.0)
            turn = sub(scale(1.0 / distance, step), direction)
            store(path.direction, end, axpy(share, turn, direction))


@kernel
def plane_near(path: Path, p: Vec3) -> Plane:
    """Return the plane of the cut surface at the point of the edge that is nearest to `p` [m].

    Its normal is zero where the edge spans nothing.
    """
    segment = nearest_on_edge(path, p).segment
    return plane_at(path, segment, p) if segment >= 0 else Plane(p, Vec3(0.0, 0.0, 0.0))


@kernel
def put_on_lattice(path: Path, lattice: Lattice) -> None:
    """Round the path to the lattice and write the boxes of its quads, once a step."""
    n = len(path.linked)
    for k in range(n):
        if path.member[k] or path.linked[k] or (k > 0 and path.linked[k - 1]):
            _round_sample(path, lattice, k)
    last = n - 1
    for c in range(6):
        path.boxes[c, last] = _FARTHEST if c < 3 else -_FARTHEST
    for k in range(last):
        for c in range(3):
            low, high = _FARTHEST, -_FARTHEST
            if path.linked[k]:
                low, high = _extent(path, k, c)
                path.boxes[c, last] = min(path.boxes[c, last], low)
                path.boxes[3 + c, last] = max(path.boxes[3 + c, last], high)
            path.boxes[c, k], path.boxes[3 + c, k] = low, high


@kernel
def _round_sample(path: Path, lattice: Lattice, k: int) -> None:
    """Round both ends of the step of a sample to the lattice."""
    a = nearest(lattice, vec3(path.t0, k))
    b = nearest(lattice, vec3(path.t1, k))
    path.lattice_t0[k, 0] = a.x
    path.lattice_t0[k, 1] = a.y
    path.lattice_t0[k, 2] = a.z
    path.lattice_t1[k, 0] = b.x
    path.lattice_t1[k, 1] = b.y
    path.lattice_t1[k, 2] = b.z


@kernel
def _extent(path: Path, k: int, c: int) -> tuple[int, int]:
    """Return the least and the greatest coordinate of a quad along an axis."""
    p, q = path.lattice_t0[k, c], path.lattice_t0[k + 1, c]
    r, s = path.lattice_t1[k, c], path.lattice_t1[k + 1, c]
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@kernel
def path_travel(path: Path) -> float:
    """Return the largest displacement of a sample through the material in this step [m]."""
    longest = 0.0
    for k in range(len(path.linked) - 1):
        if path.linked[k]:
            for j in range(k, k + 2):
                longest = max(longest, norm(sub(vec3(path.t1, j), vec3(path.t0, j))))
    return longest


def resampled(rows: FloatArray, spacing: float, most: int) -> FloatArray:
    """Return polylines of shape (n_rows, n, 3) with more points, as many on a piece in each row.

    In the longest row points are at most `spacing` [m] apart, unless that takes more than `most`.
    """
    lengths = np.linalg.norm(np.diff(rows, axis=1), axis=2).max(axis=0)
    n_parts = np.maximum(np.ceil(lengths / spacing).astype(np.int64), 1)
    scale_down = min(1.0, (most - 1) / n_parts.sum())
    n_parts = np.maximum((n_parts * scale_down).astype(np.int64), 1)
    at = np.concatenate(
        [i + np.arange(n) / n for i, n in enumerate(n_parts)] + [[float(len(n_parts))]]
    )
    i = np.minimum(at.astype(np.int64), len(n_parts) - 1)
    share = (at - i)[None, :, None]
    return (1.0 - share) * rows[:, i] + share * rows[:, i + 1]
