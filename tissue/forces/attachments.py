"""Attachments: springs and dampers from material points to others, or to what moves from outside.

They act in every stage of a step, like the blade: what holds tissue firmly would be unstable with
forces that stay for a millisecond. Dampers of points that are held in all directions are the
exception: they act between steps (`tissue.forces.attachment_dampers`). The springs of a body's
points add to the frequencies of its nodes,

    K = sum_p k_p w_p w_p^T,   w^2 <= max_i (sum_p k_p w_pi) / m_i,

by Gershgorin's circles, since the weights w_p of a point are not negative and add up to 1. Where
both ends are in the tissue the row of a node holds the weights of the other end, too: twice as
much, at either end.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, lerp, norm, scale, store, sub, vec3

_STABLE: Final = 1.5
"""Frequency times step up to which a spring with its damper is taken: below the limit of each
method of the whole body, 2 for Verlet and 3.46 for the Nystroem method."""


STRAIGHT, CAUGHT, SEVERED = 0, 1, 2
"""State of what is between a point and its other end: STRAIGHT; CAUGHT, a fibre that goes around
the edge of the blade (`tissue.forces.fibres`); SEVERED, nothing more."""


class Attachments(Arrays):
    """The attached points of a body, n of them."""

    n_caught: IntCell
    """Number of fibres that the blade has caught."""
    work: FloatCell
    """Work of what moves from outside on springs and dampers, since it was last set to 0 [J]."""
    dissipated: FloatCell
    """Energy that the dampers took since the account of energy began [J]."""
    severing: FloatCell
    """Energy that cutting fibres took since then [J]."""
    released: FloatCell
    """Energy of springs that ended since then, less that of those that began [J]."""
    nodes: IntArray
    """Nodes around each point, shape (n, 4)."""
    weights: FloatArray
    """Their barycentric weights, shape (n, 4)."""
    is_tie: IntArray
    """1 where the other end is a point of the tissue, too, else 0; shape (n,)."""
    other_nodes: IntArray
    """Nodes around that point, shape (n, 4)."""
    other_weights: FloatArray
    """Their barycentric weights, shape (n, 4): 0 where it is none."""
    begin: FloatArray
    """Place that each is attached to, at the begin of the time step [m], shape (n, 3)."""
    end: FloatArray
    """The same at its end [m]."""
    stiffness: FloatArray
    """Stiffness of each spring [N/m], shape (n,)."""
    damping: FloatArray
    """Damping of each [N s/m], shape (n,)."""
    length: FloatArray
    """Length up to which each is slack [m], shape (n,): 0 for one that holds in all directions,
    unless it is a fibre."""
    section: FloatArray
    """Cross-section of each fibre, which the blade can cut [m2], shape (n,); 0: it is none."""
    toughness: FloatArray
    """Energy of cutting a fibre [J/m2], shape (n,)."""
    state: IntArray
    """STRAIGHT, CAUGHT or SEVERED, shape (n,)."""
    place: FloatArray
    """Where a caught fibre goes around the blade: along the edge from the tip, and behind the edge
    [m], shape (n, 2)."""
    bend: FloatArray
    """The same in space after the last step of the integrator [m], shape (n, 3)."""
    spent: FloatArray
    """Energy that was spent on cutting each [J], shape (n,)."""
    side: FloatArray
    """On which side of the edge's line each fibre passes: 1 or -1; 0 where that is not known."""
    before: FloatArray
    """Point and other end before an increment [m], shape (n, 6)."""
    impulse: FloatArray
    """Impulse of what each is attached to in the time step so far [N s], shape (n, 3)."""
    turn: FloatArray
    """Angular impulse of it about the origin [N m s], shape (n, 3)."""


def no_attachments(n: int = 0) -> Attachments:
    """Return room for that many points, which are attached to nothing yet."""
    return Attachments(
        n_caught=0,
        work=0.0,
        dissipated=0.0,
        severing=0.0,
        released=0.0,
        nodes=np.zeros((n, 4), dtype=np.int64),
        weights=np.zeros((n, 4)),
        is_tie=np.zeros(n, dtype=np.int64),
        other_nodes=np.zeros((n, 4), dtype=np.int64),
        other_weights=np.zeros((n, 4)),
        begin=np.zeros((n, 3)),
        end=np.zeros((n, 3)),
        stiffness=np.zeros(n),
        damping=np.zeros(n),
        length=np.zeros(n),
        section=np.zeros(n),
        toughness=np.zeros(n),
        state=np.zeros(n, dtype=np.int64),
        place=np.zeros((n, 2)),
        bend=np.zeros((n, 3)),
        spent=np.zeros(n),
        side=np.zeros(n),
        before=np.zeros((n, 6)),
        impulse=np.zeros((n, 3)),
        turn=np.zeros((n, 3)),
    )


@inlined
def attached_point(attachments: Attachments, p: int, of_nodes: FloatArray) -> Vec3:
    """Return what nodes have, such as positions [m], at point `p`."""
    x = Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        x = axpy(attachments.weights[p, q], vec3(of_nodes, attachments.nodes[p, q]), x)
    return x


@inlined
def other_point(attachments: Attachments, p: int, of_nodes: FloatArray) -> Vec3:
    """Return what nodes have at the other end of a tie, point `p`."""
    x = Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        node = attachments.other_nodes[p, q]
        x = axpy(attachments.other_weights[p, q], vec3(of_nodes, node), x)
    return x


@inlined
def other_end(attachments: Attachments, p: int, positions: FloatArray, when: float) -> Vec3:
    """Return where the other end of what holds point `p` is [m].

    Args:
        attachments: All of them.
        p: The point.
        positions: Positions of the nodes at that instant [m].
        when: The instant, as a fraction of the time step.
    """
    if attachments.is_tie[p] == 1:
        return other_point(attachments, p, positions)
    return lerp(when, vec3(attachments.begin, p), vec3(attachments.end, p))


@kernel
def end_after_step(attachments: Attachments, p: int, positions: FloatArray) -> Vec3:
    """Return where the other end of what holds point `p` is after a step of the integrator [m]."""
    if attachments.is_tie[p] == 1:
        return other_point(attachments, p, positions)
    return vec3(attachments.end, p)


@inlined
def other_motion(attachments: Attachments, p: int, velocities: FloatArray, dt: float) -> Vec3:
    """Return how far the other end of what holds point `p` moves in a time step `dt` [m]."""
    if attachments.is_tie[p] == 1:
        return scale(dt, other_point(attachments, p, velocities))
    return sub(vec3(attachments.end, p), vec3(attachments.begin, p))


@kernel
def pull_other_end(attachments: Attachments, p: int, force: Vec3, external: FloatArray) -> None:
    """Add a force on the other end of a tie [N] to those on the nodes around it."""
    for q in range(4):
        node, weight = attachments.other_nodes[p, q], attachments.other_weights[p, q]
        store(external, node, axpy(weight, force, vec3(external, node)))


@inlined
def spread_force(attachments: Attachments, p: int, force: Vec3, external: FloatArray) -> None:
    """Add a force on point `p` [N] to those on the nodes around it."""
    for q in range(4):
        node, weight = attachments.nodes[p, q], attachments.weights[p, q]
        store(external, node, axpy(weight, force, vec3(external, node)))


@kernel
def clear_attachment_forces(attachments: Attachments, external: FloatArray) -> None:
    """Set the forces on the nodes around attached points, and the other ends of ties, to zero."""
    nodes = attachments.nodes
    for p in range(len(nodes)):
        for q in range(4):
            store(external, nodes[p, q], Vec3(0.0, 0.0, 0.0))
            if attachments.is_tie[p] == 1:
                store(external, attachments.other_nodes[p, q], Vec3(0.0, 0.0, 0.0))


@kernel
def add_attachment_forces(
    attachments: Attachments,
    positions: FloatArray,
    velocities: FloatArray,
    when: float,
    share: float,
    dt: float,
    external: FloatArray,
) -> None:
    """Add the forces of attachments on the nodes; count impulse and work.

    The points are taken one after the other, so that the sums do not depend on threads.

    Args:
        attachments: Impulses and work are written.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        when: Instant, as a fraction of the time step.
        share: Weight of this evaluation in the integral over the time step.
        dt: Length of the time step [s].
        external: Forces on the nodes [N], shape (capacity, 3); written.
    """
    for p in range(len(attachments.nodes)):
        if attachments.state[p] != STRAIGHT:
            continue
        x = attached_point(attachments, p, positions)
        path = sub(other_end(attachments, p, positions, when), x)
        of_end = other_motion(attachments, p, velocities, dt)
        if is_held_all_round(attachments, p):
            pull = _Pull(scale(attachments.stiffness[p], path), 0.0)
        else:
            v = attached_point(attachments, p, velocities)
            pull = _pull_along(attachments, p, path, axpy(-dt, v, of_end), dt)
        seconds = share * dt
        count_impulse(attachments, p, x, scale(seconds, pull.force))
        if attachments.is_tie[p] == 1:
            pull_other_end(attachments, p, scale(-1.0, pull.force), external)
        else:
            attachments.work += share * dot(pull.force, of_end)
        attachments.dissipated += seconds * pull.lost
        spread_force(attachments, p, pull.force, external)


@inlined
def count_impulse(attachments: Attachments, p: int, at: Vec3, impulse: Vec3) -> None:
    """Count an impulse of what point `p` is attached to [N s], which acts at a place [m]."""
    store(attachments.impulse, p, add(vec3(attachments.impulse, p), impulse))
    store(attachments.turn, p, add(vec3(attachments.turn, p), cross(at, impulse)))


@kernel
def is_held_all_round(attachments: Attachments, p: int) -> bool:
    """Return whether a spring without slack holds point `p` in all directions: it is no fibre."""
    return bool(attachments.length[p] == 0.0 and attachments.section[p] == 0.0)


class _Pull(NamedTuple):
    """Force and loss of a spring, and of a damper that acts along it."""

    force: Vec3
    """Force on the point [N]."""
    lost: float
    """Power that the damper takes [W]."""


@kernel
def _pull_along(attachments: Attachments, p: int, path: Vec3, motion: Vec3, dt: float) -> _Pull:
    """Return the force of a string on point `p`, and what its damper takes.

    Args:
        attachments: Stiffness, damping and slack.
        p: The point.
        path: Vector from the point to what it is attached to [m].
        motion: How far that moves ahead of the point in the time step [m].
        dt: Length of the time step [s].
    """
    stiffness, length = attachments.stiffness[p], norm(path)
    if length <= attachments.length[p]:
        return _Pull(Vec3(0.0, 0.0, 0.0), 0.0)
    rate = dot(motion, path) / (length * dt)
    tension = tension_of(attachments, p, length, rate)
    lost = (tension - stiffness * (length - attachments.length[p])) * rate
    return _Pull(scale(tension / length, path), lost)


@kernel
def tension_of(attachments: Attachments, p: int, length: float, rate: float) -> float:
    """Return how hard what holds point `p` pulls [N]; it never pushes.

    Args:
        attachments: Stiffness, damping and slack.
        p: The point.
        length: Its length, that at rest or more [m].
        rate: How fast that grows [m/s].
    """
    spring = attachments.stiffness[p] * (length - attachments.length[p])
    tension: float = max(spring + attachments.damping[p] * rate, 0.0)
    return tension


@kernel
def holding_energy(attachments: Attachments, p: int, length: float) -> float:
    """Return the energy of what holds point `p` at a length [m], in J."""
    stretch = max(length - attachments.length[p], 0.0)
    energy: float = 0.5 * attachments.stiffness[p] * stretch * stretch
    return energy


@kernel
def attached_energy(attachments: Attachments, positions: FloatArray, begin: int, end: int) -> float:
    """Return the energy of the springs of some points at the end of a step of the integrator [J].

    Args:
        attachments: All of them.
        positions: Positions of the nodes [m].
        begin: The first of these points.
        end: One more than the last.
    """
    total = 0.0
    for p in range(begin, end):
        if attachments.state[p] == SEVERED:
            continue
        x = attached_point(attachments, p, positions)
        other = end_after_step(attachments, p, positions)
        if attachments.state[p] == CAUGHT:
            bend = vec3(attachments.bend, p)
            total += holding_energy(attachments, p, norm(sub(x, bend)) + norm(sub(other, bend)))
        else:
            total += holding_energy(attachments, p, norm(sub(other, x)))
    return total


def frequency_squared(
    attachments: Attachments, masses: FloatArray, stiffening: FloatArray | None = None
) -> float:
    """Return what attachments add to w^2 of the body at most [1/s2].

    A damper of rate r adds 2 r w at most where the step is bounded by w: it is counted as the
    spring that is as fast in a step of `_STABLE` / w. Those that act between steps add nothing.

    Args:
        attachments: Springs and dampers.
        masses: Of the nodes [kg], without what mass scaling has added and may take back; shape
            (capacity,).
        stiffening: By what factor each spring is stiffer where it is bent, shape (n,); None: 1.
    """
    if not len(attachments.nodes):
        return 0.0
    stiffness = attachments.stiffness * (1.0 if stiffening is None else stiffening)
    is_string = (attachments.length > 0.0) | (attachments.section > 0.0)
    damping = attachments.damping * is_string
    springs, dampers = (_largest_rate(attachments, each, masses) for each in (stiffness, damping))
    # h^2 springs + 2 h dampers = s^2 gives the step; its (s / h)^2 is what is added.
    s = _STABLE
    step = s * s / (dampers + math.sqrt(dampers * dampers + s * s * springs))
    return (s / step) ** 2


def _largest_rate(attachments: Attachments, each: FloatArray, masses: FloatArray) -> float:
    """Return the largest sum of a quantity of points over the mass of a node."""
    nodes, shares = attachments.nodes, each[:, None] * attachments.weights
    ties = attachments.is_tie == 1
    if ties.any():
        of_others = each[ties, None] * attachments.other_weights[ties]
        shares[ties] *= 2.0
        nodes = np.concatenate([nodes, attachments.other_nodes[ties]])
        shares = np.concatenate([shares, 2.0 * of_others])
    touched, places = np.unique(nodes, return_inverse=True)
    sums = np.bincount(places.ravel(), weights=shares.ravel())
    return float((sums / masses[touched]).max())


def fibre_boxes(attachments: Attachments, positions: FloatArray) -> FloatArray:
    """Return lowest and highest corner of each fibre after a step [m], shape (n, 2, 3).

    Args:
        attachments: Of which those with a cross-section are fibres.
        positions: Positions of the nodes [m].
    """
    rows = np.flatnonzero((attachments.section > 0.0) & (attachments.state != SEVERED))
    nodes, weights = attachments.nodes[rows], attachments.weights[rows]
    points = np.einsum("nk,nkx->nx", weights, positions[nodes])
    others, of_others = attachments.other_nodes[rows], attachments.other_weights[rows]
    inside = np.einsum("nk,nkx->nx", of_others, positions[others])
    far = np.where(attachments.is_tie[rows, None] == 1, inside, attachments.end[rows])
    is_caught = attachments.state[rows, None] == CAUGHT
    bends = np.where(is_caught, attachments.bend[rows], points)
    ends = np.stack((points, far, bends), axis=1)
    return np.stack((ends.min(axis=1), ends.max(axis=1)), axis=1)
