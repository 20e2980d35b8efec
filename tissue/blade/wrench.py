"""The wrench of the tissue on the blade: mean of a step, and at its end with its derivatives.

The wrench at the end, its stiffness and the contacts follow from the same points as the forces
(`tissue.blade.forces`). Each force acts at one point on tissue and blade, so that forces and
torques cancel but for rounding.
"""

import numpy as np

from tissue.blade.anchors import ANCHORED, anchor_position, surplus_stretch
from tissue.blade.blade_state import BladeState
from tissue.blade.edge import BladePose, Edge, blade_coordinates, pose_at, sample_point
from tissue.blade.impulse_totals import ImpulseTotals
from tissue.blade.side_contact import POINTS, contact_forces, contact_point, penetration
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub
from tissue.mesh.body import Body
from tissue.types import BladeContacts, Wrench


class WrenchReport(Arrays):
    """Wrench, stiffness and contacts at one instant."""

    n_contacts: IntCell
    """Number of contacts."""
    point: FloatArray
    """Where each contact acts [m], shape (capacity, 3)."""
    normal: FloatArray
    """Unit normal of each contact, shape (capacity, 3)."""
    normal_force: FloatArray
    """Force on the tissue along the normal [N], shape (capacity,)."""
    friction: FloatArray
    """Force on the tissue across the normal [N], shape (capacity, 3)."""
    cut_area: FloatArray
    """Area that each anchor cut in the step [m2], shape (capacity,); 0 for side contacts."""
    wrench: FloatArray
    """Force on the blade [N], then torque on it about the tip [N m]; shape (6,)."""
    stiffness: FloatArray
    """Change of the wrench with a displacement and rotation of the blade, shape (6, 6)."""


def new_report(blade: BladeState) -> WrenchReport:
    """Return a report without contacts, with room for as many as the blade may have."""
    capacity = len(blade.anchors.state) + POINTS * len(blade.sides.face)
    return WrenchReport(
        n_contacts=0,
        point=np.zeros((capacity, 3)),
        normal=np.zeros((capacity, 3)),
        normal_force=np.zeros(capacity),
        friction=np.zeros((capacity, 3)),
        cut_area=np.zeros(capacity),
        wrench=np.zeros(6),
        stiffness=np.zeros((6, 6)),
    )


def contacts_of(report: WrenchReport) -> BladeContacts:
    """Return views of the contacts that were reported last."""
    n = report.n_contacts
    return BladeContacts(*(getattr(report, name)[:n] for name in BladeContacts._fields))


def wrench_of(report: WrenchReport, point: FloatArray) -> Wrench:
    """Return a copy of the wrench that was reported last, at the tip [m]."""
    return Wrench(report.wrench[:3].copy(), report.wrench[3:].copy(), point)


def mean_wrench(totals: ImpulseTotals, point: FloatArray, dt: float) -> Wrench:
    """Return the mean wrench on the blade in a step of `dt` [s], about a point [m]."""
    per_second = _per_second(dt)
    force, torque = totals.impulse * per_second, totals.angular_impulse * per_second
    (x, y, z), (fx, fy, fz) = point.tolist(), force.tolist()  # np.cross would cost 20 us
    torque -= np.array([y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
    return Wrench(force, torque, point)


def mean_force_on_tissue(totals: ImpulseTotals, dt: float) -> FloatArray:
    """Return the mean force of the blade on the nodes in a step of `dt` [s], summed [N]."""
    return totals.impulse_on_tissue * _per_second(dt)


def _per_second(dt: float) -> float:
    return 1.0 / dt if dt > 0.0 else 0.0


@kernel
def write_report(report: WrenchReport, blade: BladeState, body: Body, edge: Edge) -> None:
    """Write wrench, stiffness and contacts at the end of the time step."""
    report.n_contacts = 0
    for i in range(6):
        report.wrench[i] = 0.0
        for j in range(6):
            report.stiffness[i, j] = 0.0
    pose = pose_at(edge, 1.0)
    _report_edge(report, blade, body, pose, edge.tip_t1)
    _report_sides(report, blade, body, pose, edge.tip_t1)
    for i in range(6):
        for j in range(i):
            mean = 0.5 * (report.stiffness[i, j] + report.stiffness[j, i])
            report.stiffness[i, j] = report.stiffness[j, i] = mean


@kernel
def _report_edge(
    report: WrenchReport, blade: BladeState, body: Body, pose: BladePose, about: Vec3
) -> None:
    """Add the anchors of the edge to the report; torques are about a point [m]."""
    anchors, forward = blade.anchors, pose.forward
    n = len(anchors.state)
    for k in range(n):
        if anchors.state[k] != ANCHORED:
            continue
        b = sample_point(pose, k, n)
        stretch = sub(b, anchor_position(anchors, body, body.positions, k))
        if dot(stretch, forward) < 0.0:
            continue
        surplus = surplus_stretch(anchors, k, stretch, pose, blade.toughness)
        force = scale(anchors.stiffness[k], sub(stretch, surplus))
        lever = sub(sub(b, surplus), about)
        _add_force(report, lever, force)
        # An anchor that slips pulls no harder when it is pulled farther.
        in_plane = axpy(-dot(stretch, pose.normal), pose.normal, stretch)
        free = scale(1.0 if anchors.slips[k] else 0.0, in_plane)
        _add_stiffness(report, lever, anchors.stiffness[k], free)
        across = dot(force, forward)
        at = sub(b, surplus)  # where the force acts: torques of the contacts add up too
        _add_contact(report, at, forward, across, axpy(-across, forward, force), anchors.cut[k])


@kernel
def _report_sides(
    report: WrenchReport, blade: BladeState, body: Body, pose: BladePose, about: Vec3
) -> None:
    """Add the side contacts to the report; torques are about a point [m]."""
    sides = blade.sides
    for i in range(sides.n_faces):
        stiffness = sides.stiffness * sides.states.area[i]
        for q in range(POINTS):
            p = contact_point(sides, body.positions, i, q)
            at = blade_coordinates(pose, p)
            inside = penetration(sides, pose.length, i, q, at)
            if inside.depth <= 0.0:
                continue
            push, friction = contact_forces(sides, pose, i, q, at, inside)
            lever = sub(p, about)
            size = norm(push)
            normal = scale(1.0 / size, push)
            _add_force(report, lever, add(push, friction))
            _add_stiffness_along(report, lever, stiffness, normal)
            _add_contact(report, p, normal, size, friction, 0.0)


@kernel
def _add_contact(
    report: WrenchReport,
    point: Vec3,
    normal: Vec3,
    normal_force: float,
    friction: Vec3,
    area: float,
) -> None:
    """Append a contact."""
    row = report.n_contacts
    report.n_contacts = row + 1
    store(report.point, row, point)
    store(report.normal, row, normal)
    report.normal_force[row] = normal_force
    store(report.friction, row, friction)
    report.cut_area[row] = area


@kernel
def _add_force(report: WrenchReport, lever: Vec3, force: Vec3) -> None:
    """Add the reaction to a force on the tissue [N], at `lever` [m] from the tip."""
    torque = cross(lever, force)
    wrench = report.wrench
    wrench[0] -= force.x
    wrench[1] -= force.y
    wrench[2] -= force.z
    wrench[3] -= torque.x
    wrench[4] -= torque.y
    wrench[5] -= torque.z


@kernel
def _add_stiffness(report: WrenchReport, lever: Vec3, stiffness: float, free: Vec3) -> None:
    """Add a spring at `lever` [m] from the tip, the same in all directions but along `free`."""
    square = dot(free, free)
    for axis in range(3):
        e = Vec3(1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
        if square > 0.0:
            e = axpy(-dot(e, free) / square, free, e)
        _add_stiffness_along(report, lever, stiffness, e)


@kernel
def _add_stiffness_along(report: WrenchReport, lever: Vec3, stiffness: float, axis: Vec3) -> None:
    """Add a spring that acts along `axis` alone: stiffness g g^T with g = (axis, lever x axis)."""
    turn = cross(lever, axis)
    g = (axis.x, axis.y, axis.z, turn.x, turn.y, turn.z)
    for i in range(6):
        for j in range(6):
            report.stiffness[i, j] += stiffness * g[i] * g[j]
