"""Snapping: at each crossing of the cut surface use a node that is there, or insert one.

The rule is one of distance, not of the fraction along the edge, so that the result does not depend
on the order of crossings and no thin tetrahedron has its four nodes on the cut surface.
"""

import math

import numpy as np

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, lerp, norm, sub, vec3
from tissue.cutting.blade_path import LEAST_ALIGNMENT, nearest_on_edge, plane_at, plane_near
from tissue.cutting.cut_surface import note_side, on_cut_surface, past_offset
from tissue.cutting.stellar_subdivision import (
    edge_split_is_good,
    face_split_is_good,
    is_edge_of_core,
    split_edge,
    split_face,
)
from tissue.cutting.workspace import Cut, flag
from tissue.geometry.tetrahedron import normalised
from tissue.mesh.body import CUT
from tissue.mesh.star import node_size, star

EXPLAINED = 1.5
"""An on-surface end of an edge explains its crossing if it is at most this many times as far from
the cut surface as when it was put there. With less, the same cut again adds elements."""

EXPLAINED_SHARE = 0.05
"""Share of the edge's length within which an on-surface end explains a crossing in any case."""


@kernel
def snap_distance(cut: Cut, node: int) -> float:
    """Return the distance within which a crossing moves to `node` [m].

    A node on an earlier cut may lie further from that cut surface than its smaller neighbours now
    allow. It takes crossings from that distance too, so that the same cut again adds nothing.
    """
    size = node_size(cut.body, cut.visits, node, cut.scratch.around)
    distance = max(cut.limits.snap * size, cut.limits.floor)
    past = EXPLAINED * past_offset(cut.surface, node)
    if past > distance and _is_on_parallel_cut(cut, node):
        return past
    return distance


@kernel
def _is_on_parallel_cut(cut: Cut, node: int) -> bool:
    """Return whether a cut face at `node` is parallel to the cut surface, or none is known."""
    body, around = cut.body, cut.scratch.around
    segment = nearest_on_edge(cut.path, vec3(body.rest, node)).segment
    if segment < 0:
        return True
    sideways = vec3(cut.path.sideways, segment)
    n = star(body, cut.visits, node, body.node_tetrahedron[node], around)
    any_face = False
    for i in range(n):
        t = around[i]
        for f in range(4):
            if body.links[t, f] != CUT or body.tetrahedra[t, f] == node:
                continue
            any_face = True
            a = vec3(body.rest, body.tetrahedra[t, (f + 1) % 4])
            b = vec3(body.rest, body.tetrahedra[t, (f + 2) % 4])
            c = vec3(body.rest, body.tetrahedra[t, (f + 3) % 4])
            normal = normalised(cross(sub(b, a), sub(c, a)))
            if abs(dot(normal, sideways)) >= LEAST_ALIGNMENT:
                return True
    return not any_face


@kernel
def sort_crossings(cut: Cut) -> None:
    """Sort the crossings by how near they are to the middle of their edge, then by its nodes.

    The best-conditioned come first. Rounded, so that a rotated body is cut in the same order.
    """
    scratch = cut.scratch
    for i in range(scratch.n_crossings):
        scratch.crossing_at[i, 1] = math.floor(abs(scratch.crossing_at[i, 0] - 0.5) * 1e7 + 0.5)
        j = i
        while j > 0 and _comes_first(cut, i, scratch.order[j - 1]):
            scratch.order[j] = scratch.order[j - 1]
            j -= 1
        scratch.order[j] = i


@kernel
def _comes_first(cut: Cut, i: int, j: int) -> bool:
    ranks, nodes = cut.scratch.crossing_at, cut.scratch.crossing
    is_first: bool = nodes[i, 1] < nodes[j, 1]
    if ranks[i, 1] != ranks[j, 1]:
        is_first = ranks[i, 1] < ranks[j, 1]
    elif nodes[i, 0] != nodes[j, 0]:
        is_first = nodes[i, 0] < nodes[j, 0]
    return is_first


@kernel
def insert_crossings(cut: Cut) -> None:
    """Put on every crossed edge a node on the cut surface, and each of its ends a side."""
    sort_crossings(cut)
    scratch = cut.scratch
    for i in range(scratch.n_crossings):
        row = scratch.order[i]
        insert_crossing(
            cut,
            scratch.crossing[row, 0],
            scratch.crossing[row, 1],
            scratch.crossing[row, 2],
            scratch.crossing_at[row, 0],
        )
        if cut.change.is_full != 0:
            return


@kernel
def insert_crossing(cut: Cut, a: int, b: int, segment: int, t: float) -> None:
    """Put a node of edge ab on the cut surface, and set the sides of its ends.

    Args:
        cut: Read and written.
        a: First node of the edge.
        b: Second node.
        segment: Segment of the cutting edge that crossed it.
        t: Fraction along ab at which it did.
    """
    surface, body = cut.surface, cut.body
    if on_cut_surface(surface, a) and on_cut_surface(surface, b):
        return  # the edge lies in the cut surface; on a lip it must stay equal to its twin
    if is_edge_of_core(cut, a, b):
        return
    pa = vec3(body.rest, a)
    pb = vec3(body.rest, b)
    normal = plane_at(cut.path, segment, lerp(t, pa, pb)).normal
    edge = sub(pa, pb)
    height = abs(dot(edge, normal))
    length = norm(edge)
    side = 1 if dot(edge, normal) >= 0.0 else -1
    explained_by_a = on_cut_surface(surface, a) and _explained(cut, a, t * height, length)
    explained_by_b = on_cut_surface(surface, b) and _explained(cut, b, (1.0 - t) * height, length)
    if explained_by_a or explained_by_b:
        if not on_cut_surface(surface, a):
            note_side(surface, a, side, False)
        if not on_cut_surface(surface, b):
            note_side(surface, b, -side, False)
        return
    note_side(surface, a, side, True)
    note_side(surface, b, -side, True)
    near_a = t * height / snap_distance(cut, a)
    near_b = (1.0 - t) * height / snap_distance(cut, b)
    if min(near_a, near_b) < 1.0 or not edge_split_is_good(cut, a, b, t):
        flag(cut, a if near_a <= near_b else b)
        return
    node = split_edge(cut, a, b, t)
    if node >= 0:
        flag(cut, node)


@kernel
def _explained(cut: Cut, node: int, distance: float, length: float) -> bool:
    """Return whether a node on the surface, that far from it, explains a crossing of its edge."""
    allowance = max(EXPLAINED_SHARE * length, snap_distance(cut, node))
    is_near: bool = distance <= EXPLAINED * cut.surface.offset[node] + allowance
    return is_near


@kernel
def insert_in_face(cut: Cut, a: int, b: int, c: int, w: Vec3) -> int:
    """Return a node on the cut surface in face abc: a corner, a node on a side, or one inside.

    Args:
        cut: Read and written.
        a: First corner.
        b: Second corner.
        c: Third corner.
        w: Barycentric weights of the point; slightly negative ones count as 0.

    Returns:
        The node; NO_ROOM where the arrays must grow first.
    """
    rest = cut.body.rest
    pa = vec3(rest, a)
    pb = vec3(rest, b)
    pc = vec3(rest, c)
    total = max(w.x, 0.0) + max(w.y, 0.0) + max(w.z, 0.0)
    w = Vec3(max(w.x, 0.0) / total, max(w.y, 0.0) / total, max(w.z, 0.0) / total)
    p = Vec3(
        w.x * pa.x + w.y * pb.x + w.z * pc.x,
        w.x * pa.y + w.y * pb.y + w.z * pc.y,
        w.x * pa.z + w.y * pb.z + w.z * pc.z,
    )
    snap_a = snap_distance(cut, a)
    snap_b = snap_distance(cut, b)
    snap_c = snap_distance(cut, c)
    near_a = norm(sub(p, pa)) / snap_a
    near_b = norm(sub(p, pb)) / snap_b
    near_c = norm(sub(p, pc)) / snap_c
    nearest = min(near_a, min(near_b, near_c))
    lies_in_surface = (
        on_cut_surface(cut.surface, a)
        and on_cut_surface(cut.surface, b)
        and on_cut_surface(cut.surface, c)
    )
    if nearest < 1.0 or lies_in_surface:
        corner = a if near_a == nearest else (b if near_b == nearest else c)
        flag(cut, corner)
        return corner
    twice_area = norm(cross(sub(pb, pa), sub(pc, pa)))
    near_bc = w.x * twice_area / norm(sub(pc, pb)) / min(snap_b, snap_c)
    near_ca = w.y * twice_area / norm(sub(pa, pc)) / min(snap_c, snap_a)
    near_ab = w.z * twice_area / norm(sub(pb, pa)) / min(snap_a, snap_b)
    if min(near_bc, min(near_ca, near_ab)) >= 1.0 and face_split_is_good(cut, a, b, c, w):
        node = split_face(cut, a, b, c, w)
        if node >= 0:
            flag(cut, node)
        return node
    return _insert_at_rim(cut, a, b, c, w, p)


@kernel
def _insert_at_rim(cut: Cut, a: int, b: int, c: int, w: Vec3, p: Vec3) -> int:
    """Return a node on the cut surface at the rim of face abc, as near to `p` as may be.

    Args:
        cut: Read and written.
        a: First corner.
        b: Second corner.
        c: Third corner.
        w: Barycentric weights of `p`.
        p: Where the node is wanted [m].
    """
    normal = plane_near(cut.path, p).normal
    best, best_node, best_a, best_b, best_t = np.inf, a, a, b, 0.0
    for i in range(3):
        first = a if i == 0 else (b if i == 1 else c)
        second = b if i == 0 else (c if i == 1 else a)
        w_first = w.x if i == 0 else (w.y if i == 1 else w.z)
        w_second = w.y if i == 0 else (w.z if i == 1 else w.x)
        pf, ps = vec3(cut.body.rest, first), vec3(cut.body.rest, second)
        cost = _distance(sub(pf, p), normal)
        if cost < best:
            best, best_node, best_a = cost, first, -1
        if w_first + w_second == 0.0:
            continue
        t = w_second / (w_first + w_second)
        cost = _distance(sub(lerp(t, pf, ps), p), normal)
        if cost < best and _may_split(cut, first, second, t):
            best, best_a, best_b, best_t = cost, first, second, t
    if best_a >= 0:
        best_node = split_edge(cut, best_a, best_b, best_t)
    if best_node >= 0:
        flag(cut, best_node)
    return best_node


@kernel
def _may_split(cut: Cut, a: int, b: int, t: float) -> bool:
    """Return whether edge ab may get a node at fraction `t`: no end of it is near, nor a sliver."""
    if on_cut_surface(cut.surface, a) and on_cut_surface(cut.surface, b):
        return False
    length = norm(sub(vec3(cut.body.rest, a), vec3(cut.body.rest, b)))
    near = min(t * length / snap_distance(cut, a), (1.0 - t) * length / snap_distance(cut, b))
    return near >= 1.0 and edge_split_is_good(cut, a, b, t)


@kernel
def _distance(offset: Vec3, normal: Vec3) -> float:
    """Return the length of an offset in which what is across the cut counts double."""
    return norm(axpy(dot(offset, normal), normal, offset))
