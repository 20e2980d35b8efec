"""Whether a point of the blade is in a slit that is there already, where nothing is left to cut."""

from tissue.blade.material_frame import to_material
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, norm, sub, vec3
from tissue.cutting.blade_path import Path, nearest_on_edge
from tissue.geometry.tetrahedron import nearest_on_segment, nearest_on_triangle, normalised
from tissue.mesh.body import CUT, Body

_BESIDE = 0.7
"""Cosine of the angle between the flat's normal and the way to the nearest cut face, from which the
point is beside that face, in the slit. Below, it is ahead of the rim, or under the bottom."""


@kernel
def in_slit(body: Body, t: int, p: Vec3, along: Vec3, forward: Vec3, reach: float) -> bool:
    """Whether rest point `p` [m] of tetrahedron `t` is beside a cut face that the blade is along.

    A sheet so near to a cut would be brought into the mesh as that cut: there is nothing to add,
    and no tissue ahead that resists.

    Args:
        body: The tissue.
        t: The tetrahedron that holds `p`.
        p: In the body at rest [m].
        along: Unit vector along the edge, in the body as it is.
        forward: Unit vector in which the edge cuts.
        reach: Distance within which a crossing moves to nodes that are there [m].
    """
    if not _near_cut(body, t):
        return False
    flat = normalised(cross(to_material(body, t, forward), to_material(body, t, along)))
    if _is_beside(body, t, p, flat, reach):
        return True
    for f in range(4):
        link = body.links[t, f]
        if link < 0:
            continue
        other = link // 4
        if _is_beside(body, other, p, flat, reach):
            return True
        for g in range(4):
            further = body.links[other, g]
            if further >= 0 and _is_beside(body, further // 4, p, flat, reach):
                return True
    return False


@kernel
def _near_cut(body: Body, t: int) -> bool:
    """Whether a tetrahedron with a face of `t` has a node that a cut doubled."""
    for f in range(4):
        if body.twin[body.tetrahedra[t, f]] != body.tetrahedra[t, f]:
            return True
    for f in range(4):
        link = body.links[t, f]
        if link >= 0:
            node = body.tetrahedra[link // 4, link % 4]
            if body.twin[node] != node:
                return True
    return False


@kernel
def _is_beside(body: Body, t: int, p: Vec3, flat: Vec3, reach: float) -> bool:
    """Whether a cut face of `t` is within `reach` of `p`, in the direction of `flat`."""
    for f in range(4):
        if body.links[t, f] != CUT:
            continue
        d = sub(
            p,
            nearest_on_triangle(
                p,
                vec3(body.rest, body.tetrahedra[t, (f + 1) % 4]),
                vec3(body.rest, body.tetrahedra[t, (f + 2) % 4]),
                vec3(body.rest, body.tetrahedra[t, (f + 3) % 4]),
            ),
        )
        distance = norm(d)
        if distance <= reach and abs(dot(d, flat)) >= _BESIDE * distance:
            return True
    return False


@kernel
def behind_edge(path: Path, p: Vec3) -> bool:
    """Whether rest point `p` [m] is where the edge has been: behind it, between tip and heel."""
    k, along = nearest_on_edge(path, p)
    if k < 0:
        return False
    is_first = k == 0 or not path.linked[k - 1]
    is_last = k + 2 == len(path.linked) or not path.linked[k + 1]
    if (is_first and along < 0.0) or (is_last and along > 1.0):
        return False
    at = nearest_on_segment(vec3(path.t1, k), vec3(path.t1, k + 1), p)
    return dot(sub(p, at), vec3(path.forward, k)) <= 0.0
