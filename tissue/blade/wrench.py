"""The wrench of the tissue on the blade: mean of a step, and at its end with its derivatives.

The wrench at the end, its stiffness and the contacts follow from the same points as the forces
(`tissue.blade.forces`). Each force acts at one point on tissue and blade, so that forces and
torques cancel but for rounding.
"""

from typing import NamedTuple

import numpy as np

from tissue.blade.blade_state import BladeState, ImpulseTotals
from tissue.blade.edge import BladePose, Edge, blade_coordinates, pose_at
from tissue.blade.edge_anchors import ANCHORED, anchor_position, pulling_point, surplus_stretch
from tissue.blade.faces_contact import (
    POINTS,
    contact_forces,
    contact_point,
    corners_of,
    is_clear,
    penetration,
)
from tissue.blade.spine_contact import (
    PRESSING,
    press_force,
    press_of,
    spine_side,
    touched_point,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub
from tissue.mesh.body import Body
from tissue.types import N_OF_ADDED_MASS, RigidContacts


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
    mean_wrench: FloatArray
    """Their means over the time step, shape (2, 3)."""
    mean_force_on_tissue: FloatArray
    """Mean force on the nodes in the time step, summed [N], shape (3,)."""
    tip: FloatArray
    """The tip [m], shape (3,)."""
    bounds: FloatArray
    """Lowest and highest corner of a box around the tissue [m], shape (2, 3)."""
    stiffness: FloatArray
    """Change of the wrench with a displacement and rotation of the blade, shape (6, 6)."""
    amounts: FloatArray
    """The numbers of `Amounts`."""
    added: FloatArray
    """The numbers of `AddedMass`, shape (13,)."""
    of_labels: FloatArray
    """Of each label of the body: work of cutting since the start [J], and force on the edge against
    its motion [N]; shape (2, n_labels), no numbers where there is one label."""
    plain: FloatArray
    """All but the contacts in plain numbers: mean wrench, tip, wrench, mean force, amounts, bounds,
    stiffness, added mass, and what is of labels."""


class Amounts(NamedTuple):
    """Single numbers of a report."""

    n_contacts: float
    """Number of contacts, as `WrenchReport.n_contacts`."""
    n_nodes: float
    """Number of nodes of the body."""
    n_tetrahedra: float
    """Number of its tetrahedra."""
    tip_tetrahedron: float
    """The tetrahedron in which the path of the tip ended, or -1."""
    anchored_length: float
    """Length of edge that pulls on the tissue [m]."""
    work_of_blade: float
    """Work of the blade on the tissue since the start [J]."""
    work_of_cutting: float
    """Toughness times area cut since the start [J]."""


AMOUNTS = slice(18, 18 + len(Amounts._fields))
BOUNDS = slice(AMOUNTS.stop, AMOUNTS.stop + 6)
STIFFNESS = slice(BOUNDS.stop, BOUNDS.stop + 36)
ADDED = slice(STIFFNESS.stop, STIFFNESS.stop + N_OF_ADDED_MASS)
"""Places in `WrenchReport.plain`."""


def new_report(blade: BladeState, n_more: int = 0) -> WrenchReport:
    """Return a report without contacts, with room for all of the blade, and `n_more`."""
    capacity = (
        n_more + len(blade.anchors.state) + POINTS * len(blade.sides.face) + len(blade.spine.state)
    )
    n_labels = len(blade.totals.cutting_of_labels)
    plain = np.zeros(ADDED.stop + 2 * n_labels)
    return WrenchReport(
        n_contacts=0,
        point=np.zeros((capacity, 3)),
        normal=np.zeros((capacity, 3)),
        normal_force=np.zeros(capacity),
        friction=np.zeros((capacity, 3)),
        cut_area=np.zeros(capacity),
        wrench=plain[9:15],
        mean_wrench=plain[0:6].reshape(2, 3),
        mean_force_on_tissue=plain[15:18],
        tip=plain[6:9],
        bounds=plain[BOUNDS].reshape(2, 3),
        stiffness=plain[STIFFNESS].reshape(6, 6),
        amounts=plain[AMOUNTS],
        added=plain[ADDED],
        of_labels=plain[ADDED.stop :].reshape(2, n_labels),
        plain=plain,
    )


def contacts_of(report: WrenchReport, n: int) -> RigidContacts:
    """Return views of the first `n` contacts of a report."""
    return RigidContacts(
        report.point[:n],
        report.normal[:n],
        report.normal_force[:n],
        report.friction[:n],
        report.cut_area[:n],
        np.full(n, -1),
    )


@kernel
def write_means(report: WrenchReport, totals: ImpulseTotals, tip: Vec3, dt: float) -> None:
    """Write the tip [m], and the mean wrench and force in a time step of `dt` [s]."""
    per_second = 1.0 / dt if dt > 0.0 else 0.0
    impulse, angular_impulse = totals.impulse, totals.angular_impulse
    force = scale(per_second, Vec3(impulse[0], impulse[1], impulse[2]))
    torque = scale(per_second, Vec3(angular_impulse[0], angular_impulse[1], angular_impulse[2]))
    store(report.mean_wrench, 0, force)
    store(report.mean_wrench, 1, sub(torque, cross(tip, force)))
    for axis in range(3):
        report.mean_force_on_tissue[axis] = totals.impulse_on_tissue[axis] * per_second
        report.tip[axis] = tip[axis]


@kernel
def write_report(report: WrenchReport, blade: BladeState, body: Body, edge: Edge) -> None:
    """Write wrench, stiffness and contacts at the end of the time step."""
    report.n_contacts = 0
    for i in range(6):
        report.wrench[i] = 0.0
        for j in range(6):
            report.stiffness[i, j] = 0.0
    for i in range(report.of_labels.shape[1]):
        report.of_labels[0, i] = blade.totals.cutting_of_labels[i]
        report.of_labels[1, i] = 0.0
    pose = pose_at(edge, 1.0)
    _report_edge(report, blade, body, pose, edge.tip_t1)
    _report_faces(report, blade, body, pose, edge.tip_t1)
    _report_spine(report, blade, body, pose, edge.tip_t1)
    for i in range(6):
        for j in range(i):
            mean = 0.5 * (report.stiffness[i, j] + report.stiffness[j, i])
            report.stiffness[i, j] = report.stiffness[j, i] = mean


@kernel
def report_fibre(
    report: WrenchReport, pose: BladePose, at: Vec3, force: Vec3, stiffness: float
) -> None:
    """Add a fibre that goes around the edge to the report.

    Args:
        report: Written, the number of contacts among its amounts too.
        pose: The blade at the end of the time step.
        at: Where the fibre is bent [m].
        force: Force of the blade on it [N].
        stiffness: How that grows as the blade moves along it [N/m].
    """
    lever, size = sub(at, pose.tip), norm(force)
    _add_force(report, lever, force)
    if size > 0.0:
        _add_stiffness_along(report, lever, stiffness, scale(1.0 / size, force))
    across = dot(force, pose.forward)
    friction = axpy(-across, pose.forward, force)
    _add_contact(report, at, pose.forward, across, friction, 0.0)
    report.amounts[0] = report.n_contacts


@kernel
def _report_edge(
    report: WrenchReport, blade: BladeState, body: Body, pose: BladePose, about: Vec3
) -> None:
    """Add the anchors of the edge to the report; torques are about a point [m]."""
    anchors, forward = blade.anchors, pose.forward
    n = len(anchors.state)
    for k in range(n):
        b, holds = pulling_point(anchors, pose, k), anchors.state[k] == ANCHORED
        if holds:
            stretch = sub(b, anchor_position(anchors, body, body.positions, k))
            holds = dot(stretch, forward) >= 0.0
        if not holds:
            if anchors.cut[k] > 0.0:  # it cut, and left the tissue since
                none = Vec3(0.0, 0.0, 0.0)
                _add_contact(report, b, forward, 0.0, none, anchors.cut[k])
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
        if report.of_labels.shape[1] > 0:
            label = blade.toughness.label[body.material[anchors.tetrahedron[k]]]
            report.of_labels[1, label] += across
        at = sub(b, surplus)  # where the force acts: torques of the contacts add up too
        _add_contact(report, at, forward, across, axpy(-across, forward, force), anchors.cut[k])


@kernel
def _report_faces(
    report: WrenchReport, blade: BladeState, body: Body, pose: BladePose, about: Vec3
) -> None:
    """Add the side contacts to the report; torques are about a point [m]."""
    sides = blade.sides
    for i in range(sides.n_faces):
        if is_clear(sides, pose, corners_of(sides, body.positions, i), i):
            continue
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
def _report_spine(
    report: WrenchReport, blade: BladeState, body: Body, pose: BladePose, about: Vec3
) -> None:
    """Add the contacts of the blunt sides to the report; torques are about a point [m]."""
    spine = blade.spine
    if spine.n_pressing == 0:
        return
    for k in range(len(spine.state)):
        if spine.state[k] < PRESSING:
            continue
        side = spine_side(spine, pose, k)
        p = touched_point(spine, body, body.positions, k)
        press = press_of(spine, k, side, pose.normal, p, blade.toughness)
        if press.depth <= 0.0:
            continue
        force = press_force(spine, k, side, pose.normal, press)
        lever = sub(p, about)
        push = dot(force, side.outward)
        _add_force(report, lever, force)
        # A sample that pierces presses no harder when it is pressed farther.
        if press.surplus == 0.0:
            _add_stiffness_along(report, lever, spine.stiffness[k], side.outward)
        friction = axpy(-push, side.outward, force)
        _add_contact(report, p, side.outward, push, friction, 0.0)


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
