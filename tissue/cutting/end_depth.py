"""Depth of the ends of a cut: those of the edge, in the mean along its path.

A cut ends at nodes of the mesh, and takes one that lies within the distance of snapping. Where tip
or heel go along a plane of the mesh, all nodes there lie to one side, and the cut was up to 1.13
times as deep as the edge, or 0.9 times. So the area is counted by which the crack front is beyond
the path of the end, and the next part of the path is shifted to the other side, as errors are
diffused where colours are rounded (Floyd and Steinberg 1976, Proc. SID 17:75).
"""

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.cutting.blade_path import LEAST_DIRECTION, Path
from tissue.mesh.body import Body, walk

SHIFTED_SAMPLES = 6
"""Samples that are shifted with an end of the edge, less the further they are from it."""

LARGEST_SHIFT = 0.5
"""Shift of an end per mean node size, at most: beyond the distance of snapping (`CutSettings`)."""

MADE_GOOD_OVER = 1.0
"""Distance over which an end makes good what opened beyond its path, per mean node size."""

MOST_EXCESS = 0.5
"""Area that an end makes good, per square of the mean node size, at most: with more, it was not the
mesh that led the cut elsewhere."""


@kernel
def outwards(path: Path, end: int) -> Vec3:
    """Return the direction beyond the path of the tip, `end` 0, or of the heel, 1; 0 if none."""
    sample = 0 if end == 0 else len(path.member) - 1
    normal = cross(vec3(path.direction, end), vec3(path.sideways, sample))
    size = norm(normal)
    if size <= LEAST_DIRECTION:
        return Vec3(0.0, 0.0, 0.0)
    return scale((1.0 if end == 0 else -1.0) / size, normal)


@kernel
def take_back_shifts(path: Path) -> None:
    """Put the samples where the edge was traced at the end of the last step."""
    last = len(path.member) - 1
    store(path.shift_t0, 0, vec3(path.shift, 0))
    store(path.shift_t0, 1, vec3(path.shift, last))
    for k in range(len(path.member)):
        store(path.t1, k, sub(vec3(path.t1, k), vec3(path.shift, k)))


@kernel
def shift_ends(path: Path, body: Body, node_size: float) -> None:
    """Shift the ends of the path to where the cut is to end.

    Args:
        path: As traced in this step; its samples are shifted.
        body: The tissue: an end stays in it.
        node_size: Mean node size of the body [m].
    """
    n = len(path.member)
    for k in range(n):  # the path begins where it ended
        store(path.t0, k, axpy(1.0, vec3(path.shift, k), vec3(path.t0, k)))
        store(path.shift, k, Vec3(0.0, 0.0, 0.0))
    for end in range(2):
        sample, inwards = (0, 1) if end == 0 else (n - 1, -1)
        shift = _shift_of_end(path, body, end, sample, node_size)
        k = sample
        for i in range(SHIFTED_SAMPLES):
            if not 0 <= k < n:
                break
            store(path.shift, k, axpy(1.0 - i / SHIFTED_SAMPLES, shift, vec3(path.shift, k)))
            link = k if end == 0 else k - 1
            if link < 0 or not path.linked[link]:
                break
            k += inwards
    for k in range(n):
        store(path.t1, k, axpy(1.0, vec3(path.shift, k), vec3(path.t1, k)))


@kernel
def _shift_of_end(path: Path, body: Body, end: int, sample: int, node_size: float) -> Vec3:
    """Return by how much an end of the path is to be shifted [m]."""
    nothing = Vec3(0.0, 0.0, 0.0)
    if not (path.member[sample] and path.known[sample] and path.seed[sample] >= 0):
        path.excess[end] = 0.0
        return nothing
    direction, at = outwards(path, end), vec3(path.t1, sample)
    most, bound = LARGEST_SHIFT * node_size, MOST_EXCESS * node_size**2
    path.excess[end] = min(max(path.excess[end], -bound), bound)
    wanted = -path.excess[end] / (MADE_GOOD_OVER * node_size)
    # Not steeper than the path may turn sideways, or the front folds.
    before = dot(vec3(path.shift_t0, end), direction)
    moved = norm(sub(sub(at, vec3(path.t0, sample)), vec3(path.shift_t0, end)))
    wanted = min(max(wanted, before - moved), before + moved)
    shift = scale(min(max(wanted, -most), most), direction)
    return shift if walk(body, axpy(1.0, shift, at), path.seed[sample]).inside else nothing


@kernel
def count_front(path: Path, end: int, start: Vec3, stop: Vec3) -> None:
    """Count the area between the path of an end and a piece of its crack front.

    Args:
        path: Its excess is written.
        end: 0 for the tip, 1 for the heel.
        start: Start of the piece [m].
        stop: End of the piece [m].
    """
    sample = 0 if end == 0 else len(path.member) - 1
    direction = outwards(path, end)
    traced = sub(vec3(path.t1, sample), vec3(path.shift, sample))
    beyond = dot(sub(start, traced), direction) + dot(sub(stop, traced), direction)
    ahead = vec3(path.direction, end)
    length = norm(ahead)
    if length > 0.0:
        along = dot(sub(stop, start), ahead) / length
        path.excess[end] += 0.5 * beyond * along
