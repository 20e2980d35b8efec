"""Forces that act on a body from outside in its last step, one by one: why a force is what it is.

The forces of the blade are those at the end of the step, as in `StepResult.contacts`: they add up
to `StepResult.wrench_t1`. So are those of contacts of the body with itself and the floor, without
their damping, of loads, and of supports. Those of geoms and attachments are means over the step.
"""

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from tissue.blade.blade_state import BladeState
from tissue.blade.edge import BladePose, Edge, blade_coordinates, pose_at
from tissue.blade.edge_anchors import (
    ANCHORED,
    RETRACTED,
    Anchors,
    anchor_position,
    held_toughness,
    pulling_point,
    surplus_stretch,
)
from tissue.blade.faces_contact import POINTS, contact_point, penetration
from tissue.blade.spine_contact import (
    HEEL_END,
    PIERCING,
    PRESSING,
    TIP_END,
    SpineContacts,
    press_of,
    spine_side,
    tip_toughness,
    touched_point,
)
from tissue.contact.response.contacts import PenaltyForces
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, norm, sub
from tissue.loads.attachment import Attachment, Ligament
from tissue.mesh.body import Body
from tissue.mesh.pieces import components
from tissue.stepping.stages import StepStages
from tissue.types import RigidContacts

AT_LIMIT = 1.0 - 1e-9
"""Share of the limit of friction above which a contact slides: the rest is rounding."""

_EDGE: Final = 0
_FACE: Final = 1
_BLUNT: Final = 2


class ActingForce(NamedTuple):
    """One force from outside on a body."""

    kind: str
    """edge, face, back, end, fibre, self-contact, floor, geom, attachment, ligament, load or
    support."""
    name: str
    """Its name among those of its kind."""
    point: FloatArray
    """Where it acts [m], shape (3,)."""
    force: FloatArray
    """Force on the tissue [N], shape (3,); of a contact of the body with itself, on one side."""
    friction: float
    """The part of it across the normal of the contact [N]; at the edge also elastic force."""
    depth: float
    """Depth of a contact, or stretch of an anchor [m]; negative: a gap; nan where it has none."""
    limit: float
    """Force at which an anchor slips or a tip pierces, or at which a contact slides [N]; nan where
    there is none."""
    state: str
    """State of an anchor, a contact or what is held, in words."""


def acting_forces(stages: StepStages) -> list[ActingForce]:
    """Return each force from outside on a body in its last step, those of the blade first."""
    return [
        *_forces_of_blade(stages),
        *_forces_of_contact(stages.model.contact.forces, stages.model.body),
        *_forces_of_geoms(stages),
        *_forces_of_handles(stages),
        *_forces_of_supports(stages),
    ]


def _forces_of_blade(stages: StepStages) -> Iterator[ActingForce]:
    """Yield the contacts of the blade in the order in which `StepResult.contacts` has them."""
    interaction, body = stages.model.interaction, stages.model.body
    contacts, blade, edge = interaction.contacts, interaction.state, interaction.edge_now[0]
    n = len(contacts.point)
    sources, amounts = np.zeros((n, 2), np.int64), np.full((n, 2), math.nan)
    n_found = write_sources(blade, body, edge, sources, amounts)
    for row in range(n):
        part, index = sources[row].tolist() if row < n_found else (-1, row - n_found)
        depth, limit = amounts[row].tolist()
        friction = float(np.linalg.norm(contacts.friction[row]))
        if part == _EDGE:
            kind, name = "edge", f"sample {index}"
            state = _state_of_anchor(blade.anchors, index)
        elif part == _FACE:
            face, q = divmod(index, POINTS)
            kind, name = "face", f"face {blade.sides.face[face]}, point {q}"
            limit = float(blade.sides.friction[face] * contacts.normal_force[row])
            state = "slides" if blade.sides.states.sliding_speed[face, q] > 0.0 else "sticks"
        elif part == _BLUNT:
            side = blade.spine.side[index]
            kind = "end" if side in (HEEL_END, TIP_END) else "back"
            name, state, limit = _spine_sample(blade.spine, index, contacts, row, limit)
        else:
            kind, name, state = "fibre", f"fibre {index}", "caught by the edge"
        yield ActingForce(
            kind,
            name,
            contacts.point[row].copy(),
            _force(contacts, row),
            friction,
            depth,
            limit,
            state,
        )
    yield from _retracted(blade, body, edge)


def _force(contacts: RigidContacts, row: int) -> FloatArray:
    """Return the whole force of a contact on the tissue [N], shape (3,)."""
    press = contacts.normal_force[row] * contacts.normal[row]
    return np.asarray(press + contacts.friction[row])


def _state_of_anchor(anchors: Anchors, k: int) -> str:
    """Return the state of an anchor in words."""
    if anchors.at_core[k]:
        return "anchored, at a rigid core"
    state = "slips" if anchors.slips[k] else "anchored"
    return f"{state}, at the skin" if anchors.at_skin[k] else state


def _spine_sample(
    spine: SpineContacts, k: int, contacts: RigidContacts, row: int, limit: float
) -> tuple[str, str, float]:
    """Return name, state and limit [N] of a sample of the back or an end."""
    name = ("back", "end at the heel", "end at the tip")[spine.side[k]]
    if spine.state[k] == PIERCING:
        return f"{name}, sample {k}", "pierces", limit
    most = float(spine.friction[k] * contacts.normal_force[row])
    slides = np.linalg.norm(contacts.friction[row]) >= AT_LIMIT * most
    return f"{name}, sample {k}", "slides" if slides else "sticks", most


def _retracted(blade: BladeState, body: Body, edge: Edge) -> Iterator[ActingForce]:
    """Yield the samples of the edge that are in the tissue and do not act on it."""
    anchors, pose = blade.anchors, pose_at(edge, 1.0)
    for k in np.flatnonzero(anchors.state == RETRACTED).tolist():
        point = np.array(pulling_point(anchors, pose, k))
        yield ActingForce(
            "edge", f"sample {k}", point, np.zeros(3), 0.0, math.nan, math.nan, "retracted"
        )


@kernel
def write_sources(
    blade: BladeState, body: Body, edge: Edge, sources: IntArray, amounts: FloatArray
) -> int:
    """Write what each contact of the blade is, in the order of its report; return how many.

    Args:
        blade: Anchors and contacts at the end of a step.
        body: The tissue.
        edge: The cutting edge over that step.
        sources: Part of the blade, and the number of the sample or contact point in it, shape
            (n, 2); written.
        amounts: Depth [m], and force at which it slips or pierces [N], shape (n, 2); written.
    """
    pose = pose_at(edge, 1.0)
    n = _write_edge(blade, body, pose, sources, amounts)
    n = _write_faces(blade, body, pose, n, sources, amounts)
    spine = blade.spine
    for k in range(len(spine.state)):
        if spine.state[k] < PRESSING:
            continue
        side = spine_side(spine, pose, k)
        p = touched_point(spine, body, body.positions, k)
        press = press_of(spine, k, side, pose.normal, p, blade.toughness)
        if press.depth > 0.0:
            sources[n, 0], sources[n, 1] = _BLUNT, k
            amounts[n, 0] = press.depth
            amounts[n, 1] = tip_toughness(spine, k, blade.toughness) * spine.length[k]
            n += 1
    return n


@kernel
def _write_edge(
    blade: BladeState, body: Body, pose: BladePose, sources: IntArray, amounts: FloatArray
) -> int:
    """Write the anchors that pull; return how many there are."""
    anchors, n = blade.anchors, 0
    for k in range(len(anchors.state)):
        if anchors.state[k] != ANCHORED:
            continue
        b = pulling_point(anchors, pose, k)
        stretch = sub(b, anchor_position(anchors, body, body.positions, k))
        if dot(stretch, pose.forward) >= 0.0:
            surplus = surplus_stretch(anchors, k, stretch, pose, blade.toughness)
            sources[n, 0], sources[n, 1] = _EDGE, k
            amounts[n, 0] = norm(sub(stretch, surplus))
            amounts[n, 1] = held_toughness(anchors, k, blade.toughness) * anchors.length[k]
            n += 1
    return n


@kernel
def _write_faces(
    blade: BladeState,
    body: Body,
    pose: BladePose,
    n: int,
    sources: IntArray,
    amounts: FloatArray,
) -> int:
    """Write the contact points that faces press, from row `n` on; return the row after them."""
    sides = blade.sides
    for i in range(sides.n_faces):
        for q in range(POINTS):
            at = blade_coordinates(pose, contact_point(sides, body.positions, i, q))
            depth = penetration(sides, pose.length, i, q, at).depth
            if depth > 0.0:
                sources[n, 0], sources[n, 1] = _FACE, POINTS * i + q
                amounts[n, 0] = depth
                n += 1
    return n


def _forces_of_contact(forces: PenaltyForces, body: Body) -> Iterator[ActingForce]:
    """Yield the contacts of the body with itself and the floor that press."""
    rows = np.arange(forces.first, forces.first + forces.n_contacts)
    for c in rows[forces.push[rows] > 0.0].tolist():
        nodes, weights, normal = forces.node[c], forces.weight[c], forces.normal[c]
        push, stiffness = float(forces.push[c]), float(forces.stiffness[c])
        apart = weights @ body.positions[nodes]
        stretch = apart - (apart @ normal) * normal - forces.anchor[c]
        limit = float(forces.friction[c]) * push
        pull = stiffness * float(np.linalg.norm(stretch))
        force = (
            push * normal - stiffness * min(limit / pull, 1.0) * stretch
            if pull
            else (push * normal)
        )
        is_floor = nodes[0] == nodes[1]
        side = np.maximum(weights, 0.0)
        yield ActingForce(
            "floor" if is_floor else "self-contact",
            "node " + "-".join(map(str, dict.fromkeys(nodes.tolist()))),
            side @ body.positions[nodes] / side.sum(),
            force,
            min(pull, limit),
            push / stiffness,
            limit,
            "slides" if pull >= AT_LIMIT * limit else "sticks",
        )


def _forces_of_geoms(stages: StepStages) -> Iterator[ActingForce]:
    """Yield the contacts with rigid geoms, means over the step."""
    geoms = stages.model.geoms
    if not geoms.act:
        return
    arrays, contacts = geoms.arrays, geoms.contacts()
    rows = np.arange(arrays.first, arrays.first + arrays.n_contacts)
    for i, c in enumerate(rows[arrays.impulse[rows].any(axis=1)].tolist()):
        g = int(arrays.geom[c])
        yield ActingForce(
            "geom",
            geoms.geoms[g].name,
            contacts.point[i],
            _force(contacts, i),
            float(np.linalg.norm(contacts.friction[i])),
            -float(arrays.gap[c]),
            float(arrays.friction[c]) * float(contacts.normal_force[i]),
            "sticks" if arrays.sticks[c] else "slides" if arrays.touches[c] else "is released",
        )


def _forces_of_handles(stages: StepStages) -> Iterator[ActingForce]:
    """Yield attachments and ligaments, means over the step, and loads."""
    body, handles = stages.model.body, stages.handles
    for each in handles.attachments.all:
        kind = "ligament" if isinstance(each, Ligament) else "attachment"
        yield ActingForce(
            kind,
            f"{kind} {each.number}",
            each.points.positions(body).mean(axis=0),
            -each.wrench.force,
            math.nan,
            math.nan,
            each.breaks_at,
            _state_of_attachment(each),
        )
    for load in handles.loads.all:
        at = load.points.shares @ load.points.positions(body)
        name = f"load {load.number}"
        yield ActingForce(
            "load", name, at, load.force, math.nan, math.nan, math.nan, f"{len(load.points)} points"
        )


def _state_of_attachment(attachment: Attachment) -> str:
    """Return how much of an attachment holds, in words."""
    return f"{attachment.n_points} of {len(attachment.points)} points hold"


def _forces_of_supports(stages: StepStages) -> Iterator[ActingForce]:
    """Yield the forces of supports, one for each connected region of fixed nodes."""
    body = stages.model.body
    fixed = np.flatnonzero(body.fixed[: body.n_nodes])
    if not len(fixed):
        return
    forces, corners = stages.handles.support_forces(), body.tetrahedra[: body.n_tetrahedra]
    pairs = np.concatenate([corners[:, [a, b]] for a in range(4) for b in range(a)])
    _, region = components(body.n_nodes, pairs[body.fixed[pairs].all(axis=1)])
    for each in dict.fromkeys(region[fixed].tolist()):
        nodes = fixed[region[fixed] == each]
        yield ActingForce(
            "support",
            f"{len(nodes)} fixed nodes",
            body.positions[nodes].mean(axis=0),
            forces[nodes].sum(axis=0),
            math.nan,
            math.nan,
            math.nan,
            "moves" if body.velocities[nodes].any() else "holds",
        )
