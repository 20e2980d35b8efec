"""The faces of the blade against the tissue: they part it, and drag it along by friction.

The blade is the set of points whose distance z from its plane is below a profile of their distance
s behind the edge and a from the tip: the least of the two bevels (slope s), half the thickness, the
back and the two ends, all of them planes. Open faces of the tissue (skin, and lips of cuts) are
looked at in three points each; a point that is within the blade is pressed outwards by

    U = 1/2 k A (profile(a, s) - z)^2      N = k A (profile - z)

with A the area that the point stands for, seen along the normal of the blade. The force on the
tissue is -dU/dx: outwards, and forwards where the profile rises, so that a wedge pays for what it
parts. Friction is a spring of the same stiffness along the face that yields at Coulomb's limit
(stiction below it), or above by a viscous part. Both act at one point: action is reaction.

A cut opens in the mesh up to an element behind the edge, where the blade has its full thickness. A
point that is first seen within the blade meets the bevel there and then: its profile begins with
where it is and rises with the slope of the bevel. Else the wedge would push from nothing.
"""

import numpy as np

from tissue.blade.anchors import (
    Edge,
    edge_frame,
    travel_of,
    turning_at,
)
from tissue.blade.impulse_totals import (
    WORK_OF_FRICTION,
    keep_tally,
    push_blade,
    push_node,
    tally_of,
)
from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, add, axpy, dot, lerp, scale, sub, vec3
from tissue.material import Material
from tissue.mesh.body import Body, grown
from tissue.mesh.surface import OUTWARD

FLANK_STIFFNESS = 2.0
"""Stiffness of a face of the blade, as pressure per depth, over Young's modulus per node size. It
stands for the tissue nearer to the face than the mesh resolves, as that of an anchor does. With 4
the Runge-Kutta steps of a fine mesh were half as many again."""

POINTS = 3
"""Points of a face, each for a third of its area: a quadrature exact for linear pressure."""
CORNER, OTHER = 2.0 / 3.0, 1.0 / 6.0
"""Weights of a point: of its own corner, and of the other two."""

LATE, STUCK_ALONG, STUCK_BEHIND, SPEED = 0, 1, 2, 3
"""Places in `Flanks.state`: by how much the bevel begins late [m]; where on the blade friction
would be zero [m], two of them; and how fast the point slid last [m/s]."""

CLEAR = 1e-9
"""[m] beyond the thickness of the blade from which a face is not looked at: above any rounding."""

END_SLOPE = 0.5
"""Of the blade's back and ends against its plane. Steeper ends would let go of the tissue within
one step, and take shorter ones."""


class Flanks(Arrays):
    """The points of the tissue that are near the blade."""

    half_thickness: float
    """[m]; 0 for a blade that is a line."""
    slope: float
    """Of the bevels."""
    height: float
    """[m]."""
    stiffness: float
    """Pressure per depth [Pa/m]."""
    friction: float
    """Coulomb's coefficient."""
    viscosity: float
    """Shear stress per speed [Pa s/m]."""
    face: IntArray
    """4 * tetrahedron + corner opposite, shape (capacity,)."""
    node: IntArray
    """Its nodes, shape (capacity, 3)."""
    side: FloatArray
    """On which side of the blade the tissue is, 1 along the blade's normal or -1; (capacity,)."""
    area: FloatArray
    """Seen along the normal of the blade, of each point [m2]; shape (capacity,)."""
    state: FloatArray
    """See above, shape (3 * capacity, 4)."""
    energy: FloatArray
    """Of a face against the blade, friction too [J]; shape (capacity,)."""
    place: IntArray
    """Where each face of each tetrahedron is in these rows, or -1; shape (4 * n_tets,)."""
    around: IntArray
    """Open faces in the cells of the grid that the blade's box met last, shape (capacity,)."""
    searched: IntArray
    """How many those are, -1 where they must be looked for anew; the first and the last cell along
    each axis; and what the grid listed then: see `flank_faces`; shape (9,)."""
    found: IntArray
    """Scratch of a search: the faces found, shape (capacity,)."""
    known_as: IntArray
    """Scratch: the row that each had, or -1; shape (capacity,)."""
    before: FloatArray
    """Scratch: the state before, shape (3 * capacity, 4)."""
    faces_before: FloatArray
    """Scratch: side, area and energy of each row before, shape (capacity, 3)."""
    outward: IntArray
    """`surface.OUTWARD`."""
    count: IntArray
    """Faces, shape (1,)."""


def new_flanks(
    shape: BladeShape | None, material: Material, node_size: float, n_tetrahedra: int
) -> Flanks:
    """Return the flanks of a blade that touches nothing; None is a line without any."""
    thin = shape is None
    return Flanks(
        half_thickness=0.0 if shape is None else float(0.5 * shape.thickness),
        slope=1.0 if shape is None else float(shape.slope),
        height=0.0 if shape is None else float(shape.height),
        stiffness=float(FLANK_STIFFNESS * material.young_modulus / node_size),
        friction=float(material.blade_friction),
        viscosity=float(material.blade_viscosity),
        place=np.full(0 if thin else 4 * n_tetrahedra, -1, np.int64),
        outward=OUTWARD,
        count=np.zeros(1, np.int64),
        searched=np.full(9, -1, np.int64),
        **_rows(0 if thin else 64),
    )


def _rows(capacity: int) -> dict[str, np.ndarray]:
    return {
        "face": np.zeros(capacity, np.int64),
        "node": np.zeros((capacity, 3), np.int64),
        "side": np.zeros(capacity),
        "area": np.zeros(capacity),
        "state": np.zeros((POINTS * capacity, 4)),
        "energy": np.zeros(capacity),
        "around": np.zeros(capacity, np.int64),
        "found": np.zeros(capacity, np.int64),
        "known_as": np.zeros(capacity, np.int64),
        "before": np.zeros((POINTS * capacity, 4)),
        "faces_before": np.zeros((capacity, 3)),
    }


def with_more_rows(flanks: Flanks) -> Flanks:
    """Return the flanks with twice the room."""
    rows = _rows(2 * len(flanks.face))
    return flanks.replaced(**{name: grown(getattr(flanks, name), len(rows[name])) for name in rows})


def grown_flanks(flanks: Flanks, n_tetrahedra: int) -> Flanks:
    """Return the flanks with room for that many tetrahedra."""
    if flanks.half_thickness == 0.0:
        return flanks
    return flanks.replaced(place=grown(flanks.place, 4 * n_tetrahedra, -1))


@kernel
def blade_frame(edge: Edge, when: float) -> tuple[Vec3, Vec3, Vec3, Vec3, float]:
    """The tip, unit vectors along the edge, forward and normal, and the length of the edge."""
    along, forward, normal = edge_frame(edge, when)
    tip = lerp(when, edge.tip_t0, edge.tip_t1)
    length = dot(sub(lerp(when, edge.heel_t0, edge.heel_t1), tip), along)
    return tip, along, forward, normal, length


@kernel
def in_blade(frame: tuple[Vec3, Vec3, Vec3, Vec3, float], p: Vec3) -> Vec3:
    """Coordinates of `p` on the blade: from the tip along the edge, behind it, and across [m]."""
    tip, along, forward, normal, _ = frame
    r = sub(p, tip)
    return Vec3(dot(r, along), -dot(r, forward), dot(r, normal))


@kernel
def profile(flanks: Flanks, length: float, late: float, at: Vec3) -> Vec3:
    """How far the blade reaches from its plane at `at` [m], and its slopes along a and s.

    `at` are coordinates on the blade; the result is (slope along a, slope along s, reach).
    """
    best = Vec3(0.0, flanks.slope, flanks.slope * at.y + late)
    if flanks.half_thickness < best.z:
        best = Vec3(0.0, 0.0, flanks.half_thickness)
    back = END_SLOPE * (flanks.height - at.y)
    if back < best.z:
        best = Vec3(0.0, -END_SLOPE, back)
    point = END_SLOPE * at.x
    if point < best.z:
        best = Vec3(END_SLOPE, 0.0, point)
    heel = END_SLOPE * (length - at.x)
    if heel < best.z:
        best = Vec3(-END_SLOPE, 0.0, heel)
    return best


@kernel
def face_point(flanks: Flanks, positions: FloatArray, i: int, q: int) -> Vec3:
    """Where point `q` of row `i` is, its nodes at `positions` [m]."""
    node = flanks.node
    p = scale(CORNER, vec3(positions, node[i, q]))
    p = axpy(OTHER, vec3(positions, node[i, (q + 1) % 3]), p)
    return axpy(OTHER, vec3(positions, node[i, (q + 2) % 3]), p)


@kernel
def friction_at(flanks: Flanks, i: int, q: int, at: Vec3, pressing: float) -> Vec3:
    """Slide along a and s [m] that friction holds at a point pressed with a force [N]; and how
    much longer the slide is than that [m]."""
    state = flanks.state
    row = POINTS * i + q
    da = at.x - state[row, STUCK_ALONG]
    ds = at.y - state[row, STUCK_BEHIND]
    slide = np.sqrt(da * da + ds * ds)
    limit = flanks.friction * pressing + flanks.viscosity * flanks.area[i] * state[row, SPEED]
    most = limit / (flanks.stiffness * flanks.area[i])
    if slide <= most:
        return Vec3(da, ds, 0.0)
    return Vec3(da * most / slide, ds * most / slide, slide - most)


@kernel
def press_flanks(
    flanks: Flanks,
    edge: Edge,
    positions: FloatArray,
    when: float,
    share: float,
    dt: float,
    external: FloatArray,
    totals: FloatArray,
) -> None:
    """Add what the faces of the blade do to the nodes to `external` [N]; count impulse and work.

    Arguments: see `tissue.blade.anchors.pull`; `totals` are those of the anchors.
    """
    if flanks.count[0] == 0:
        return
    frame = blade_frame(edge, when)
    turning = turning_at(edge, when)
    seconds = share * dt
    tally = tally_of(totals)
    for i in range(flanks.count[0]):
        if _is_clear(flanks, frame, positions, i):
            continue
        for q in range(POINTS):
            p = face_point(flanks, positions, i, q)
            at = in_blade(frame, p)
            force = _force(flanks, frame, i, q, at)
            if force.x == 0.0 and force.y == 0.0 and force.z == 0.0:
                continue
            for corner in range(3):
                w = CORNER if corner == q else OTHER
                tally = push_node(external, tally, flanks.node[i, corner], w, force, seconds)
            tally = push_blade(tally, p, force, travel_of(edge, turning, p), share, seconds)
    keep_tally(totals, tally)


@kernel
def _is_clear(
    flanks: Flanks,
    frame: tuple[Vec3, Vec3, Vec3, Vec3, float],
    positions: FloatArray,
    i: int,
) -> bool:
    """Whether a face is farther from the plane of the blade than the blade is thick anywhere."""
    tip, _, _, normal, _ = frame
    side = flanks.side[i]
    reach = side * dot(tip, normal) + flanks.half_thickness + CLEAR
    return (
        side * dot(vec3(positions, flanks.node[i, 0]), normal) > reach
        and side * dot(vec3(positions, flanks.node[i, 1]), normal) > reach
        and side * dot(vec3(positions, flanks.node[i, 2]), normal) > reach
    )


@kernel
def depth(flanks: Flanks, length: float, i: int, q: int, at: Vec3) -> Vec3:
    """Slopes of the profile at a point, and how deep in the blade it is [m]; see `profile`."""
    reach = profile(flanks, length, flanks.state[POINTS * i + q, LATE], at)
    return Vec3(reach.x, reach.y, reach.z - flanks.side[i] * at.z)


@kernel
def _force(
    flanks: Flanks, frame: tuple[Vec3, Vec3, Vec3, Vec3, float], i: int, q: int, at: Vec3
) -> Vec3:
    """What the blade does to the tissue at a point [N]."""
    pressed = depth(flanks, frame[4], i, q, at)
    if pressed.z <= 0.0:
        return Vec3(0.0, 0.0, 0.0)
    normal_force, friction = press_and_friction(flanks, frame, i, q, at, pressed)
    return add(normal_force, friction)


@kernel
def press_and_friction(
    flanks: Flanks,
    frame: tuple[Vec3, Vec3, Vec3, Vec3, float],
    i: int,
    q: int,
    at: Vec3,
    pressed: Vec3,
) -> tuple[Vec3, Vec3]:
    """Both forces of the blade on the tissue at a point that is within it [N]."""
    _, along, forward, normal, _ = frame
    stiffness = flanks.stiffness * flanks.area[i]
    push = stiffness * pressed.z
    outward = axpy(-pressed.x, along, scale(flanks.side[i], normal))
    outward = axpy(pressed.y, forward, outward)
    held = friction_at(flanks, i, q, at, push)
    friction = axpy(-stiffness * held.x, along, scale(stiffness * held.y, forward))
    return scale(push, outward), friction


@kernel
def slide_flanks(
    flanks: Flanks,
    edge: Edge,
    positions: FloatArray,
    when: float,
    seconds: float,
    totals: FloatArray,
) -> None:
    """Let points slide whose friction is above its limit, and count what that took.

    Args:
        flanks: State and energies are written.
        edge: The cutting edge over the time step.
        positions: Of the nodes [m].
        when: Instant, as a fraction of the time step.
        seconds: Since they slid last [s].
        totals: Of the anchors.
    """
    if flanks.count[0] == 0:
        return
    frame = blade_frame(edge, when)
    state = flanks.state
    for i in range(flanks.count[0]):
        stiffness = flanks.stiffness * flanks.area[i]
        energy = 0.0
        for q in range(POINTS):
            row = POINTS * i + q
            at = in_blade(frame, face_point(flanks, positions, i, q))
            pressed = depth(flanks, frame[4], i, q, at)
            held = friction_at(flanks, i, q, at, max(stiffness * pressed.z, 0.0))
            before = held.x * held.x + held.y * held.y
            spent = stiffness * np.sqrt(before) * held.z + 0.5 * stiffness * before
            if pressed.z <= 0.0:
                state[row, STUCK_ALONG] = at.x
                state[row, STUCK_BEHIND] = at.y
                state[row, SPEED] = 0.0
                totals[WORK_OF_FRICTION] += spent
                continue
            _slide_point(flanks, i, row, at, stiffness * pressed.z, seconds)
            left = friction_at(flanks, i, q, at, stiffness * pressed.z)
            kept = 0.5 * stiffness * (left.x * left.x + left.y * left.y)
            totals[WORK_OF_FRICTION] += spent - kept
            energy += 0.5 * stiffness * pressed.z * pressed.z + kept
        flanks.energy[i] = energy


@kernel
def _slide_point(
    flanks: Flanks, i: int, row: int, at: Vec3, pressing: float, seconds: float
) -> None:
    """Move where a point is stuck to as far as friction does not hold it, by the implicit step.

    stiffness (slide - q) = friction limit + viscosity q / seconds, solved for q.
    """
    state = flanks.state
    da = at.x - state[row, STUCK_ALONG]
    ds = at.y - state[row, STUCK_BEHIND]
    slide = np.sqrt(da * da + ds * ds)
    stiffness = flanks.stiffness * flanks.area[i]
    surplus = stiffness * slide - flanks.friction * pressing
    if surplus <= 0.0 or seconds <= 0.0:
        state[row, SPEED] = 0.0
        return
    q = surplus / (stiffness + flanks.viscosity * flanks.area[i] / seconds)
    state[row, STUCK_ALONG] += q * da / slide
    state[row, STUCK_BEHIND] += q * ds / slide
    state[row, SPEED] = q / seconds


@kernel
def clear_flanks(flanks: Flanks, external: FloatArray) -> None:
    """Set the forces on the nodes that the blade's faces may press on to zero."""
    for i in range(flanks.count[0]):
        for corner in range(3):
            node = flanks.node[i, corner]
            external[node, 0] = external[node, 1] = external[node, 2] = 0.0


@kernel
def add_flank_stiffness(flanks: Flanks, stiffness: FloatArray) -> None:
    """Add the rows of the flanks to `stiffness` [N/m]: see `tissue.blade.anchors.add_stiffness`.

    Across the face and along it a point has one stiffness; a slope adds its share.
    """
    more = 1.0 + max(flanks.slope, END_SLOPE) ** 2
    for i in range(flanks.count[0]):
        for corner in range(3):
            # The weights of the three points on a corner add up to 1.
            stiffness[flanks.node[i, corner], 0] += more * flanks.stiffness * flanks.area[i]


@kernel
def highest_flank_frequency(
    flanks: Flanks, body: Body, frequency_squared: FloatArray, stiffness: FloatArray
) -> float:
    """Bound on w^2 [1/s2] over the nodes near the blade: see
    `tissue.blade.anchors.highest_frequency`."""
    worst = 0.0
    for i in range(flanks.count[0]):
        for corner in range(3):
            node = flanks.node[i, corner]
            if not body.fixed[node]:
                own = frequency_squared[node] + stiffness[node, 0] / body.masses[node]
                worst = max(worst, own)
    return worst


@kernel
def flanks_energy(flanks: Flanks) -> float:
    """Stored between the faces of the blade and the tissue, when it gave way last [J]."""
    energy = 0.0
    for i in range(flanks.count[0]):
        energy += flanks.energy[i]
    return energy
