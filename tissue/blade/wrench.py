"""What the tissue does to the blade at one instant: wrench, stiffness, and the contacts behind it.

All follow from the same points, those of `tissue.blade.forces`. Force and torque of each contact
act at one point on both sides, so that they cancel to the last bit but rounding.
"""

import numpy as np

from tissue.blade.anchors import (
    ANCHORED,
    Edge,
    anchor_position,
    edge_frame,
    sample_point,
    surplus_of,
)
from tissue.blade.forces import Tool
from tissue.blade.side_contact import (
    POINTS,
    blade_frame,
    depth,
    face_point,
    in_blade,
    press_and_friction,
)
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub
from tissue.mesh.body import Body
from tissue.types import BladeContacts, Wrench


class Report(Arrays):
    """Room for what is reported of one instant."""

    point: FloatArray
    normal: FloatArray
    normal_force: FloatArray
    friction: FloatArray
    cut_area: FloatArray
    wrench: FloatArray
    """Force and torque about the tip [N], [N m]; shape (6,)."""
    stiffness: FloatArray
    """Shape (6, 6)."""
    count: IntArray
    """Contacts, shape (1,)."""


def new_report(capacity: int) -> Report:
    """Return a report without contacts, with room for that many."""
    return Report(
        point=np.zeros((capacity, 3)),
        normal=np.zeros((capacity, 3)),
        normal_force=np.zeros(capacity),
        friction=np.zeros((capacity, 3)),
        cut_area=np.zeros(capacity),
        wrench=np.zeros(6),
        stiffness=np.zeros((6, 6)),
        count=np.zeros(1, np.int64),
    )


def most_contacts(tool: Tool) -> int:
    """Return how many contacts there can be at most with the room that the tool has now."""
    return len(tool.anchors.state) + POINTS * len(tool.flanks.face)


def contacts_of(report: Report) -> BladeContacts:
    """Return views of what was reported last."""
    n = int(report.count[0])
    return BladeContacts(*(getattr(report, name)[:n] for name in BladeContacts._fields))


def wrench_of(report: Report, point: FloatArray) -> Wrench:
    """Return a copy of the wrench that was reported last, at the tip [m]."""
    return Wrench(report.wrench[:3].copy(), report.wrench[3:].copy(), point)


@kernel
def write_report(report: Report, tool: Tool, body: Body, edge: Edge) -> None:
    """Write what acts at the end of the step."""
    report.count[0] = 0
    for i in range(6):
        report.wrench[i] = 0.0
        for j in range(6):
            report.stiffness[i, j] = 0.0
    _report_edge(report, tool, body, edge)
    _report_flanks(report, tool, body, edge)
    for i in range(6):
        for j in range(i):
            mean = 0.5 * (report.stiffness[i, j] + report.stiffness[j, i])
            report.stiffness[i, j] = report.stiffness[j, i] = mean


@kernel
def _report_edge(report: Report, tool: Tool, body: Body, edge: Edge) -> None:
    anchors = tool.anchors
    n = len(anchors.state)
    frame = edge_frame(edge, 1.0)
    forward = frame[1]
    for k in range(n):
        if anchors.state[k] != ANCHORED:
            continue
        b = sample_point(edge, k, n, 1.0)
        d = sub(b, anchor_position(anchors, body, body.positions, k))
        if dot(d, forward) < 0.0:
            continue
        surplus = surplus_of(anchors, k, d, frame, tool.resistance)
        force = scale(anchors.stiffness[k], sub(d, surplus))
        lever = sub(sub(b, surplus), edge.tip_t1)
        _add_force(report, lever, force)
        # What slips pulls no harder when it is pulled farther.
        gives = scale(1.0 if anchors.slips[k] else 0.0, axpy(-dot(d, frame[2]), frame[2], d))
        _add_stiffness(report, lever, anchors.stiffness[k], gives)
        across = dot(force, forward)
        at = sub(b, surplus)  # where the force acts: the contacts add up to the torque as well
        _add_contact(report, at, forward, across, axpy(-across, forward, force), anchors.cut[k])


@kernel
def _report_flanks(report: Report, tool: Tool, body: Body, edge: Edge) -> None:
    flanks = tool.flanks
    if flanks.count[0] == 0:
        return
    frame = blade_frame(edge, 1.0)
    for i in range(flanks.count[0]):
        stiffness = flanks.stiffness * flanks.area[i]
        for q in range(POINTS):
            p = face_point(flanks, body.positions, i, q)
            at = in_blade(frame, p)
            pressed = depth(flanks, frame[4], i, q, at)
            if pressed.z <= 0.0:
                continue
            push, friction = press_and_friction(flanks, frame, i, q, at, pressed)
            lever = sub(p, edge.tip_t1)
            size = norm(push)
            normal = scale(1.0 / size, push)
            _add_force(report, lever, add(push, friction))
            _add_stiffness_along(report, lever, stiffness, normal)
            _add_contact(report, p, normal, size, friction, 0.0)


@kernel
def _add_contact(
    report: Report, point: Vec3, normal: Vec3, normal_force: float, friction: Vec3, area: float
) -> None:
    row = report.count[0]
    report.count[0] = row + 1
    store(report.point, row, point)
    store(report.normal, row, normal)
    report.normal_force[row] = normal_force
    store(report.friction, row, friction)
    report.cut_area[row] = area


@kernel
def _add_force(report: Report, lever: Vec3, force: Vec3) -> None:
    """Add the reaction to a force on the tissue."""
    torque = cross(lever, force)
    wrench = report.wrench
    wrench[0] -= force.x
    wrench[1] -= force.y
    wrench[2] -= force.z
    wrench[3] -= torque.x
    wrench[4] -= torque.y
    wrench[5] -= torque.z


@kernel
def _add_stiffness(report: Report, lever: Vec3, stiffness: float, gives: Vec3) -> None:
    """Add a spring at `lever` from the tip, the same in all directions but along `gives`."""
    square = dot(gives, gives)
    for axis in range(3):
        e = Vec3(1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
        if square > 0.0:
            e = axpy(-dot(e, gives) / square, gives, e)
        _add_stiffness_along(report, lever, stiffness, e)


@kernel
def _add_stiffness_along(report: Report, lever: Vec3, stiffness: float, way: Vec3) -> None:
    """Add a spring that acts along `way` alone: stiffness g g^T with g = (way, lever x way)."""
    turn = cross(lever, way)
    g = (way.x, way.y, way.z, turn.x, turn.y, turn.z)
    for i in range(6):
        for j in range(6):
            report.stiffness[i, j] += stiffness * g[i] * g[j]
