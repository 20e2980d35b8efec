"""Mass scaling: nodes that would limit the time step by their high frequency get mass.

A cut leaves slivers, whose nodes have next to no mass and whose fastest modes live on one or two of
them. Explicit dynamics slows such modes by added mass where they are faster than the motion that is
requested (selective mass scaling; Belytschko, Liu and Moran, Nonlinear Finite Elements, 6.3). The
added mass is moved and has no weight: equilibrium is the same.

It has momentum of its own: forces change the sum of this and the momentum of the tissue. Where a
node keeps its velocity as its mass changes, that sum changes by an impulse, which is counted.
"""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point_of, times
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, axpy, cross, vec3
from tissue.elasticity.finite_elements import Solid
from tissue.elasticity.stars import tetrahedron_of_slot
from tissue.geometry.tetrahedron import tetrahedron_volume
from tissue.mesh.body import Body

LARGEST_ADDED_MASS = 0.02
"""Added mass at most, as a share of the body's own. Beyond it the limit of frequencies is raised:
where a mesh is coarse a cut passes through most of its elements, and what it leaves of them is no
sliver. At 0.02 the lowest frequencies of the body are at most 1 % lower."""

LIMIT_STEP = 1.02
"""Factor by which the limit of frequencies is raised at once."""


N_MOMENTA = 6
"""Numbers of a momentum and an angular momentum."""


class MassScaling(Arrays):
    """Up to which frequency nodes get mass, and what they got."""

    allowed: FloatCell
    """Bound on w^2 above which a node gets mass [1/s2]; infinite where none does."""
    allowed_between_cuts: FloatCell
    """The same between two cuts: where a time step is one step without it, nodes get no mass."""
    added: FloatCell
    """Mass that all nodes have got [kg]."""
    largest: FloatCell
    """The most that they had so far [kg]."""
    most: FloatCell
    """The most that they may get [kg]."""
    impulse: FloatArray
    """Momentum [N s], and angular momentum about the origin [N m s], that nodes got with mass, or
    lost with it, where they kept their velocities; shape (`N_MOMENTA`,)."""
    lost: FloatCell
    """Kinetic energy that nodes lost where their mass changed between two cuts [J]."""
    is_used_up: IntCell
    """1 if a node got no mass between two cuts, as the body had all that it may get, else 0."""
    allowed_where_strained: FloatCell
    """The same for what strain makes faster: as much as the steps that are taken in any case."""
    steps: IntCell
    """Steps that strain may take in an increment, if others do not take more: the limit is that
    high."""
    increments: IntCell
    """Increments since nodes gave back mass."""
    between_cuts: FloatCell
    """Mass that nodes got between two cuts since then [kg]."""


def no_mass_scaling() -> MassScaling:
    """Return that no node gets mass."""
    return MassScaling.new(
        {},
        allowed=np.inf,
        allowed_between_cuts=np.inf,
        allowed_where_strained=np.inf,
        impulse=np.zeros(N_MOMENTA),
    )


@kernel
def write_masses(body: Body, solid: Solid, nodes: IntArray, n: int) -> None:
    """Write the masses of the first `n` of `nodes`, whose rows are up to date.

    Args:
        body: Masses are written.
        solid: The tetrahedra around them.
        nodes: The nodes.
        n: How many of them.
    """
    density, row = body.materials.density, body.material
    for i in range(n):
        node, mass = nodes[i], 0.0
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            t = tetrahedron_of_slot(solid, slot)
            mass += density[row[t]] * tetrahedron_volume(body.rest, body.tetrahedra, t) / 4.0
        body.masses[node] = mass
        body.added_masses[node] = 0.0


@kernel
def scale_masses(
    body: Body,
    solid: Solid,
    nodes: IntArray,
    n: int,
    allowed: float,
    of_contact: FloatArray,
) -> float:
    """Give the first `n` of `nodes` the mass with which their bound on w^2 is at most `allowed`.

    Nodes get no more than that, and none if their own mass suffices.

    Args:
        body: Masses are written.
        solid: The bounds of the nodes are up to date for their masses now, and are written.
        nodes: The nodes.
        n: How many of them.
        allowed: Bound on w^2 [1/s2].
        of_contact: What contact adds to w^2 of each node [1/s2]; written.

    Returns:
        By how much the added mass has changed [kg].
    """
    change = 0.0
    for i in range(n):
        node = nodes[i]
        if body.fixed[node]:
            continue
        before = body.masses[node]
        own = before - body.added_masses[node]
        stiffness = solid.frequency_squared[node] * before  # [N/m]
        after = max(own, stiffness / allowed)
        if after == before:
            continue
        change += after - before
        body.masses[node] = after
        body.added_masses[node] = after - own
        solid.frequency_squared[node] = stiffness / after
        solid.shear_frequency_squared[node] *= before / after
        of_contact[node] *= before / after
    return change


@kernel
def add_momentum(body: Body, nodes: IntArray, n: int, factor: float, momenta: FloatArray) -> float:
    """Add the momentum of the mass that was added to nodes; return that mass [kg].

    Args:
        body: Masses, positions and velocities.
        nodes: The nodes.
        n: How many of them.
        factor: By which it is multiplied.
        momenta: Momentum [N s], then angular momentum about the origin [N m s], shape
            (`N_MOMENTA`,); written.
    """
    mass, linear, angular = 0.0, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    for i in range(n):
        added = body.added_masses[nodes[i]]
        if added == 0.0:  # of most
            continue
        v = vec3(body.velocities, nodes[i])
        mass += added
        linear = axpy(added, v, linear)
        angular = axpy(added, cross(vec3(body.positions, nodes[i]), v), angular)
    for axis in range(3):
        momenta[axis] += factor * linear[axis]
        momenta[3 + axis] += factor * angular[axis]
    return mass


@inlined
def free_fall(body: Body, node: int, gravity: Vec3) -> Point:
    """Acceleration of a node in gravity [m/s2]: the mass that was added has no weight."""
    added, own = body.added_masses[node], 1.0
    if added != 0.0:  # of few nodes: most need no division
        own = 1.0 - added / body.masses[node]
    fall: Point = times(own, point_of(*gravity))
    return fall


class AddedMassShares(NamedTuple):
    """Mass that mass scaling has added, as a share of the body's own."""

    now: float
    """Mass and stiffness of nodes."""
    largest: float
    """The most that they had so far."""


def added_mass_shares(scaling: MassScaling, body: Body) -> AddedMassShares:
    """Return the mass that nodes have got, as shares of the body's own."""
    added = float(body.added_masses[: body.n_nodes].sum())
    own = float(body.masses[: body.n_nodes].sum()) - added
    return AddedMassShares(added / own, max(added, scaling.largest) / own)
