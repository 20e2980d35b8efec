"""Attachments: springs and dampers from material points to points that are moved from outside.

They act in every stage of a step, like the blade: what holds tissue firmly would be unstable with
forces that stay for a millisecond. The springs of a body's points add to the frequencies of its
nodes,

    K = sum_p k_p w_p w_p^T,   w^2 <= max_i (sum_p k_p w_pi) / m_i,

by Gershgorin's circles, since the weights w_p of a point are not negative and add up to 1.
"""

import math
from typing import Final

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, lerp, norm, scale, store, sub, vec3

_STABLE: Final = 1.5
"""Frequency times step up to which a spring with its damper is taken: below the limit of each
method of the whole body, 2 for Verlet and 3.46 for the Nystroem method."""


class Attachments(Arrays):
    """The attached points of a body, n of them."""

    nodes: IntArray
    """Nodes around each point, shape (n, 4)."""
    weights: FloatArray
    """Their barycentric weights, shape (n, 4)."""
    begin: FloatArray
    """What each is attached to, at the begin of the time step [m], shape (n, 3)."""
    end: FloatArray
    """The same at its end [m]."""
    stiffness: FloatArray
    """Stiffness of each spring [N/m], shape (n,)."""
    damping: FloatArray
    """Damping of each [N s/m], shape (n,)."""
    length: FloatArray
    """Length up to which each is slack [m], shape (n,): 0 for one that holds in all directions."""
    impulse: FloatArray
    """Impulse on each point in the time step so far [N s], shape (n, 3)."""
    turn: FloatArray
    """Angular impulse on each about the origin [N m s], shape (n, 3)."""
    work: FloatCell
    """Work on the tissue since it was last set to 0 [J]."""


def no_attachments(n: int = 0) -> Attachments:
    """Return room for that many points, which are attached to nothing yet."""
    return Attachments(
        nodes=np.zeros((n, 4), dtype=np.int64),
        weights=np.zeros((n, 4)),
        begin=np.zeros((n, 3)),
        end=np.zeros((n, 3)),
        stiffness=np.zeros(n),
        damping=np.zeros(n),
        length=np.zeros(n),
        impulse=np.zeros((n, 3)),
        turn=np.zeros((n, 3)),
        work=0.0,
    )


@kernel
def clear_attachment_forces(attachments: Attachments, external: FloatArray) -> None:
    """Set the forces on the nodes around attached points to zero."""
    nodes = attachments.nodes
    for p in range(len(nodes)):
        for q in range(4):
            store(external, nodes[p, q], Vec3(0.0, 0.0, 0.0))


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
        x, v = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
        for q in range(4):
            node, weight = attachments.nodes[p, q], attachments.weights[p, q]
            x = axpy(weight, vec3(positions, node), x)
            v = axpy(weight, vec3(velocities, node), v)
        begin, end = vec3(attachments.begin, p), vec3(attachments.end, p)
        way = sub(lerp(when, begin, end), x)
        force = _force(attachments, p, way, axpy(-dt, v, sub(end, begin)), dt)
        seconds = share * dt
        store(attachments.impulse, p, axpy(seconds, force, vec3(attachments.impulse, p)))
        store(attachments.turn, p, axpy(seconds, cross(x, force), vec3(attachments.turn, p)))
        attachments.work += seconds * dot(force, v)
        for q in range(4):
            node, weight = attachments.nodes[p, q], attachments.weights[p, q]
            store(external, node, axpy(weight, force, vec3(external, node)))


@kernel
def _force(attachments: Attachments, p: int, way: Vec3, motion: Vec3, dt: float) -> Vec3:
    """Return the force on point `p` [N].

    Args:
        attachments: Stiffness, damping and slack.
        p: The point.
        way: From the point to what it is attached to [m].
        motion: How far that moves ahead of the point in the time step [m].
        dt: Length of the time step [s].
    """
    stiffness, damping, slack = (
        attachments.stiffness[p],
        attachments.damping[p],
        attachments.length[p],
    )
    if slack == 0.0:
        return add(scale(stiffness, way), scale(damping / dt, motion))
    length = norm(way)
    if length <= slack:
        return Vec3(0.0, 0.0, 0.0)
    along = dot(motion, way) / length
    pull = max(stiffness * (length - slack) + damping / dt * along, 0.0)
    return scale(pull / length, way)


def frequency_squared(attachments: Attachments, masses: FloatArray) -> float:
    """Return what attachments add to w^2 of the body at most [1/s2].

    A damper of rate r adds 2 r w at most where the step is bounded by w: it is counted as the
    spring that is as fast in a step of `_STABLE` / w.

    Args:
        attachments: Springs and dampers.
        masses: Of the nodes [kg], without what mass scaling has added and may take back; shape
            (capacity,).
    """
    if not len(attachments.nodes):
        return 0.0
    springs, dampers = (
        _largest_rate(attachments, each, masses)
        for each in (attachments.stiffness, attachments.damping)
    )
    # h^2 springs + 2 h dampers = s^2 gives the step; its (s / h)^2 is what is added.
    s = _STABLE
    step = s * s / (dampers + math.sqrt(dampers * dampers + s * s * springs))
    return (s / step) ** 2


def _largest_rate(attachments: Attachments, each: FloatArray, masses: FloatArray) -> float:
    """Return the largest sum of a quantity of points over the mass of a node."""
    touched, places = np.unique(attachments.nodes, return_inverse=True)
    shares = each[:, None] * attachments.weights
    sums = np.bincount(places.ravel(), weights=shares.ravel())
    return float((sums / masses[touched]).max())
