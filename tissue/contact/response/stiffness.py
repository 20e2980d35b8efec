"""Stiffness of the contacts by mass splitting, and offsets by which their forces continue.

A node of mass m_i whose share in all contacts is S_i = sum_c |w_ci| may bear the stiffness
m_i W_i^2. With

    1 / k_c = sum_i |w_ci| S_i / (m_i W_i^2)

the contacts together stay below it, K_contact <= diag(m_i W_i^2), however many a node has: the
inequality of Cauchy and Schwarz with shares |w_ci| / S_i. So the stable step is known before any
contact is. W_i^2 is what contact adds for every node, and half of what the node itself leaves of
the frequency that the step is chosen for. Where that would take another step, nodes in contact get
mass instead (`tissue.forces.contact_frequencies`): few are as fast as the fastest of the body.

Source: Tonge et al. (2012), Mass splitting for jitter-free parallel rigid body simulation, for the
shares.
"""

import math

from tissue.contact.response.contacts import (
    PenaltyForces,
    list_touching_nodes,
    weighted_sum,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import axpy, dot, scale, store, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.node_means import friction_of_row

_ROOM_SHARE = 0.5
"""Share of the room between a node's own bound on w^2 and the highest that its contacts may use.
Larger: stiffer contact; at 1 nothing is left for what strain adds."""

_LEAST_SHARE = 0.35
"""Least share to which the w^2 that contact adds is lowered where that saves a step. Lower: what
is pressed against slivers sinks in; 1: a step more in each time step of a body cut often."""

_LEAST_OWN = 0.5
"""Least w^2 to which nodes in contact are slowed by mass where that saves a step, as a share of the
highest of the body: they get at most twice their mass. Lower: more mass, in a soft body that
contact makes much faster."""

_ROOM_FOR_STRAIN = 1.05
"""Ratio of the w^2 that steps allow to that of such a node with its contacts: as much as counts as
unstrained (`tissue.elasticity.frequency.quick.UNNOTICED`)."""

_FASTEST_DAMPING = 0.45
"""Highest rate at which contacts together stop a motion, over the highest frequency of the body
with contact. Damping acts at the velocity before the step: Verlet is stable up to h rate =
2 - (w h)^2 / 2, so that its steps allow 0.45 where w is that of contacts alone, and 0.85 where they
have half of w^2. Without the limit two contacts on nodes of 21 and 42 mg, in a cut block of springs
with stiff slivers elsewhere, turned an approach of 0.7 m/s into a rebound of 1.2 every 2 ms:
contact gave the body 12 % of the work of the blade."""

_LARGEST_DEPTH = 0.2
"""Depth above which a force grows no more, per node size. Larger: what was pinched and is released
is thrown; smaller: it sinks in deeper."""

_LARGEST_ACCELERATION = 0.03
"""Acceleration that one contact may give its sides at once, in node sizes times W^2: 2,000 m/s2 in
an organ of liver, 40 mN on a node of it. Larger: slivers of a thousandth of the usual mass are
thrown at several metres a second; smaller: what is pressed hard sinks in."""

_GROWTH = 1.05
"""Factor by which that grows in each time step in which a contact gives all of it. Larger: as if
there were no such limit; 1: a sliver that was pinched once stays where it is."""

_SLACK = 0.01
"""Gap up to which a contact keeps its force as its normal turns, per node size. Larger: sides are
held apart, and nodes flutter to and fro; 0: forces jump whenever a normal turns outwards."""

_ROUNDING = 1e-9
"""Relative difference of forces that counts as none."""

_RECOVERY = 1.0
"""Speed at which an overlap comes out that had no force as it was found, in node sizes a second.
Larger: more work on the springs behind; 0: what overlaps does so for good."""

_MOST_RECOVERY = 0.5
"""Distance by which the contacts of a node come out in all between incisions, per node size: the
deepest overlap that is tested. More: where contacts of slivers contradict each other they continue
pushing, and the slivers snap to and fro without end; less: deep overlaps stay."""

_RECOVERY_FROM_SLACK = 4.0
"""Speed at which slack is taken back, over that of recovery."""


class Limits(Arrays):
    """Bounds on the stiffness and the recovery of contacts."""

    is_listed: IntCell
    """1 from a list of contacts until what they add to w^2 of each node is known, else 0."""
    highest: FloatCell
    """Bound on w^2 of a node in contact, without it, that the step is chosen for [1/s2]."""
    added: FloatCell
    """Largest part of contact in w^2 of every node [1/s2]."""
    adds_mass: IntCell
    """1 where nodes in contact may get mass, else 0."""
    most_added: float
    """Largest part where steps allow [1/s2]."""
    largest_depth: float
    """Depth above which a force grows no more [m]."""
    largest_acceleration: float
    """Acceleration that one contact may give its sides [m/s2]."""
    slack: float
    """Gap up to which a contact keeps its force [m]."""
    recovery: float
    """Speed at which an overlap comes out that had no force as it was found [m/s]."""
    most_recovery: float
    """Distance by which the contacts of a node come out in all between incisions [m]."""


def new_limits(node_size: float, added: float, *, adds_mass: bool = False) -> Limits:
    """Return the limits for a body of that mean node size [m].

    Args:
        node_size: Mean node size of the body [m].
        added: What contact may add to w^2 of every node [1/s2].
        adds_mass: Whether nodes in contact may get mass.
    """
    return Limits(
        is_listed=0,
        highest=0.0,
        added=float(added),
        adds_mass=int(adds_mass),
        most_added=float(added),
        largest_depth=float(_LARGEST_DEPTH * node_size),
        largest_acceleration=float(_LARGEST_ACCELERATION * node_size * added),
        slack=float(_SLACK * node_size),
        recovery=float(_RECOVERY * node_size),
        most_recovery=float(_MOST_RECOVERY * node_size),
    )


@kernel
def limit_stiffness(limits: Limits, highest: float, room: float) -> None:
    """Limit what contact adds to w^2 to what steps allow, or less where that saves a step.

    Where that would be far less, and mass saves the step, it is the nodes that are limited.

    Args:
        limits: Written.
        highest: Bound on w^2 of the body without contact [1/s2].
        room: What may be added to that without another step [1/s2].
    """
    most = limits.most_added
    limits.highest, limits.added = highest, most
    if room >= _LEAST_SHARE * most:
        limits.added = min(most, room)
    elif limits.adds_mass == 1:
        own = (highest + room) / _ROOM_FOR_STRAIN - most
        if own >= _LEAST_OWN * highest:
            limits.highest = own
    limits.is_listed = 1


@kernel
def frequency_of_contact(limits: Limits, own: float) -> float:
    """Return what contact may add to w^2 of a node [1/s2] that has `own` without it [1/s2]."""
    added: float = limits.added + _ROOM_SHARE * max(limits.highest - own, 0.0)
    return added


@kernel
def split_masses(
    forces: PenaltyForces,
    limits: Limits,
    body: Body,
    frequency_squared: FloatArray,
    share: FloatArray,
) -> None:
    """Write the stiffness of each contact; one with force continues by its offset (`_keep_force`).

    Where materials differ in friction, that of each contact is written as well.

    Args:
        forces: Stiffness, friction, damping, offset, greatest depth, push, anchors and masses are
            written. `stiffness` is as it was in the last list, or 0.
        limits: How stiff contact may be.
        body: Masses, positions and friction.
        frequency_squared: Bound on w^2 of each node without contact [1/s2], shape (capacity,).
        share: Scratch, shape (capacity,).
    """
    rows = range(forces.first, forces.first + forces.n_contacts)
    list_touching_nodes(forces, share)
    fastest = _FASTEST_DAMPING * math.sqrt(limits.highest + limits.added)
    if body.materials.has_one_friction == 0:
        for c in rows:
            forces.friction[c] = friction_of_row(body, forces.node, forces.weight, c)
    for c in rows:
        softness, mobility, squared = 0.0, 0.0, 0.0
        for q in range(4):
            node, weight = forces.node[c, q], abs(forces.weight[c, q])
            forces.balance.mass[c, q] = body.masses[node]
            added = frequency_of_contact(limits, frequency_squared[node])
            squared = max(squared, added)
            softness += weight * share[node] / (body.masses[node] * added)
            mobility += weight * weight / body.masses[node]
        before = forces.stiffness[c]
        k = 1.0 / softness
        forces.stiffness[c] = k
        # Shares as above: the rates at a node add up to that of its stiffest contact at most.
        forces.damping_time[c] = min(forces.retardation_time, fastest / squared)
        most = max(limits.largest_acceleration / mobility, forces.push[c])
        forces.largest_depth[c] = min(limits.largest_depth, most / k)
        _keep_force(forces, limits, body, c, before)


@kernel
def _keep_force(
    forces: PenaltyForces, limits: Limits, body: Body, c: int, stiffness_before: float
) -> None:
    """Set offset and anchor so that contact `c` pushes and rubs as before; a new one not at all.

    Where it is softer than it was it has less force, so that its springs hold no more energy than
    they did.
    """
    across = weighted_sum(forces, c, body.positions)
    normal = vec3(forces.normal, c)
    along = dot(normal, across)
    gap = along - forces.height[c]
    tangential = axpy(-along, normal, across)
    if forces.push[c] > 0.0:
        k = forces.stiffness[c]
        share = math.sqrt(min(k / stiffness_before, 1.0))
        forces.push[c] *= share
        forces.offset[c] = min(gap + forces.push[c] / k, limits.slack)
        stretch = sub(tangential, vec3(forces.anchor, c))
        stretch = scale(share * stiffness_before / k, stretch)
        store(forces.anchor, c, sub(tangential, stretch))
    else:
        forces.offset[c] = min(gap, 0.0)
        store(forces.anchor, c, tangential)


@kernel
def recover(
    forces: PenaltyForces, limits: Limits, body: Body, recovered: FloatArray, seconds: float
) -> None:
    """Move offsets towards zero by what they may in a time step, and raise limits of forces.

    Args:
        forces: Offsets and greatest depths are written.
        limits: How fast, and how far.
        body: Where the nodes are.
        recovered: How far the contacts of each node have come out [m], shape (capacity,); written.
        seconds: Length of the time step [s].
    """
    back = limits.recovery * seconds
    for c in range(forces.first, forces.first + forces.n_contacts - forces.n_fading):
        most = forces.largest_depth[c]
        if forces.push[c] >= (1.0 - _ROUNDING) * forces.stiffness[c] * most:
            forces.largest_depth[c] = min(_GROWTH * most, limits.largest_depth)
        offset = forces.offset[c]
        if offset == 0.0:
            continue
        if forces.push[c] == 0.0:
            # What has come out on its own does not go in again.
            along = dot(vec3(forces.normal, c), weighted_sum(forces, c, body.positions))
            offset = min(max(offset, along - forces.height[c]), 0.0)
        if offset > 0.0:
            forces.offset[c] = max(offset - _RECOVERY_FROM_SLACK * back, 0.0)
        else:
            node = forces.node[c, 0]
            step = min(back, limits.most_recovery - recovered[node])
            recovered[node] += min(step, -offset)
            forces.offset[c] = min(offset + step, 0.0)


@kernel
def fade(forces: PenaltyForces, limits: Limits, body: Body, seconds: float) -> bool:
    """Fade the forces of contacts that were given up, as slowly as overlaps come out.

    They press with less from time step to time step, however their nodes move.

    Args:
        forces: Offsets and greatest depths are written.
        limits: How fast.
        body: Where the nodes are.
        seconds: Length of the time step [s].

    Returns:
        Whether any has ended, and is to be listed no more.
    """
    end, has_ended = forces.first + forces.n_contacts, False
    for c in range(end - forces.n_fading, end):
        along = dot(vec3(forces.normal, c), weighted_sum(forces, c, body.positions))
        depth = forces.push[c] / forces.stiffness[c] - limits.recovery * seconds
        has_ended = has_ended or depth <= 0.0
        forces.largest_depth[c] = max(depth, 0.0)
        forces.offset[c] = along - forces.height[c] + depth
    return has_ended
