"""How samples of the edge come to hold the tissue: by meeting it, or beside one that does."""

from tissue.blade.anchors import (
    ANCHORED,
    FREE,
    RETRACTED,
    Anchors,
    Edge,
    anchor_position,
    edge_frame,
    sample_point,
    stored_energy,
)
from tissue.blade.impulse_totals import RELEASED
from tissue.blade.material_frame import mean_rotation, turned_back
from tissue.blade.return_mapping import find, put
from tissue.blade.slit import behind_edge, in_slit
from tissue.blade.toughness import Resistance
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, norm, sub, vec3
from tissue.cutting.blade_path import Path
from tissue.geometry.tetrahedron import (
    Matrix3,
    barycentric_in,
    interpolate,
)
from tissue.mesh.body import Body
from tissue.mesh.point_location import TetrahedronGrid, tetrahedron_at
from tissue.mesh.star import Visits


@kernel
def offset_from(edge: Edge, rotation: Matrix3, when: float, n: int, k: int, beside: int) -> Vec3:
    """The way from sample `beside` to sample `k` of `n` [m], in the body at rest."""
    offset = sub(sample_point(edge, k, n, when), sample_point(edge, beside, n, when))
    return turned_back(rotation, offset)


@kernel
def let_go(
    anchors: Anchors,
    body: Body,
    visits: Visits,
    path: Path,
    edge: Edge,
    when: float,
    queue: IntArray,
) -> None:
    """Free the samples that backed off and then went elsewhere: into tissue not cut yet.

    A blade that backs off, goes deeper and then forward again cuts below its old slit: the path of
    its samples begins anew. That of a sample beside one that holds goes on from where it was, or
    the tissue between would stay whole.
    """
    n = len(anchors.state)
    any_retracted = False
    for k in range(n):
        any_retracted = any_retracted or anchors.state[k] == RETRACTED
    if not any_retracted:
        return
    rotation = mean_rotation(anchors, body)
    for k in range(n):
        if anchors.state[k] != RETRACTED:
            continue
        a = anchor_position(anchors, body, body.positions, k)
        way = turned_back(rotation, sub(sample_point(edge, k, n, when), a))
        p = add(vec3(anchors.rest, k), way)
        if behind_edge(path, p):
            continue
        if find(body, visits, p, anchors.tetrahedron[k], queue).inside:
            anchors.state[k] = FREE
            path.known[k] = _is_beside_anchored(anchors, k)


@kernel
def _is_beside_anchored(anchors: Anchors, k: int) -> bool:
    """Whether the sample before or behind sample `k` is anchored."""
    state = anchors.state
    return (k > 0 and state[k - 1] == ANCHORED) or (k + 1 < len(state) and state[k + 1] == ANCHORED)


@kernel
def hold_on(
    anchors: Anchors,
    body: Body,
    visits: Visits,
    path: Path,
    edge: Edge,
    when: float,
    far: float,
    resistance: Resistance,
    low: Vec3,
    high: Vec3,
    queue: IntArray,
) -> bool:
    """Let go and seize; return whether a free sample is in the box of the tissue and may `meet` it.

    The tissue lies between `low` and `high` [m]. One call in place of three, which would take
    longer to make than the work in them.
    """
    let_go(anchors, body, visits, path, edge, when, queue)
    seize(anchors, body, visits, edge, when, far, resistance, queue)
    return any_free_in_box(anchors, edge, when, low, high)


@kernel
def seize(
    anchors: Anchors,
    body: Body,
    visits: Visits,
    edge: Edge,
    when: float,
    far: float,
    resistance: Resistance,
    queue: IntArray,
) -> None:
    """Anchor the free samples beside an anchored one that are in the tissue too.

    The edge trails behind the blade by the same distance along its length: a sample is in the
    tissue if the point that far behind it is. `far` [m]: from further away no tissue is taken
    hold of.
    """
    n = len(anchors.state)
    rotation = mean_rotation(anchors, body)
    frame = edge_frame(edge, when)
    for sweep in range(2):
        for i in range(n):
            k = i if sweep == 0 else n - 1 - i
            beside = k - 1 if sweep == 0 else k + 1
            if anchors.state[k] != FREE or not 0 <= beside < n:
                continue
            if anchors.state[beside] != ANCHORED:
                continue
            offset = offset_from(edge, rotation, when, n, k, beside)
            p = add(vec3(anchors.rest, beside), offset)
            place = find(body, visits, p, anchors.tetrahedron[beside], queue)
            if not place.inside:
                continue
            w = barycentric_in(p, body.rest, body.tetrahedra, place.tetrahedron)
            here = interpolate(w, body.positions, body.tetrahedra, place.tetrahedron)
            d = sub(sample_point(edge, k, n, when), here)
            if norm(d) > far:  # the tissue there is turned otherwise than what the edge holds
                continue
            put(anchors, body, k, place.tetrahedron, p)
            anchors.slipped[k] = False
            anchors.at_skin[k] = False
            anchors.totals[RELEASED] -= stored_energy(anchors, k, d, frame, resistance)


@kernel
def meet(
    anchors: Anchors,
    body: Body,
    grid: TetrahedronGrid,
    edge: Edge,
    when: float,
    reach: float,
    low: Vec3,
    high: Vec3,
) -> None:
    """Anchor the free samples that have come into the tissue by themselves.

    `reach` [m]: see `in_slit`. The tissue lies between `low` and `high` [m].
    """
    n = len(anchors.state)
    along, forward, _ = edge_frame(edge, when)
    for k in range(n):
        if anchors.state[k] != FREE:
            continue
        b = sample_point(edge, k, n, when)
        if not _in_box(b, low, high):
            continue
        t = tetrahedron_at(body, grid, body.positions, b)
        if t >= 0:
            w = barycentric_in(b, body.positions, body.tetrahedra, t)
            p = interpolate(w, body.rest, body.tetrahedra, t)
            if not in_slit(body, t, p, along, forward, reach):
                put(anchors, body, k, t, p)
                anchors.slipped[k] = False
                anchors.at_skin[k] = True


@kernel
def any_free_in_box(anchors: Anchors, edge: Edge, when: float, low: Vec3, high: Vec3) -> bool:
    """Whether a free sample lies in the box from `low` to `high` [m]."""
    n = len(anchors.state)
    for k in range(n):
        if anchors.state[k] == FREE and _in_box(sample_point(edge, k, n, when), low, high):
            return True
    return False


@kernel
def _in_box(p: Vec3, low: Vec3, high: Vec3) -> bool:
    return low.x <= p.x <= high.x and low.y <= p.y <= high.y and low.z <= p.z <= high.z
