"""Local time stepping: small elements take substeps, their neighbours do not (heir of section 5.2).

Leap-frog with steps of H for the whole body, and p substeps for the fine nodes: those whose
frequency bound, with what the blade adds, is too high for H; and the rings around the blade that
the options ask for. It differs from the paper's hierarchy in that both ends of a spring see each
other
at the same times: linear momentum is kept to rounding, the equilibrium is that of all nodes moved
together, the order is 2.

    V <- V + 2 e_p / H,   x <- x + H V                       V: velocity half a step ago

where e is found by the recursion of `chebyshev` for the fine nodes and those that share a force
with one; for the others 2 e_p = H^2 r(0).

Drag acts exactly, half before the kick and half after. Dampers between nodes that are not fine are
evaluated once a step with the velocities of half a step ago; those at a fine node, where such a
damper could be unstable, follow the kick one by one (Shardlow 2003): each takes from the relative
velocity of its two ends what it would in that time if it were alone, by equal and opposite
impulses.

Within a step the blade is where it is at its begin: the recursion stands for a motion that runs to
both sides of that instant alike, so that a steady motion of the blade cancels.
"""

import math
from typing import NamedTuple

import numpy as np

from tissue.blade.edge import Edge
from tissue.blade.forces import apply_blade_forces, apply_slip, clear_blade_forces
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd import Point, point, point_of, store_point, times
from tissue.core.structs import Arrays
from tissue.core.vec3 import axpy, dot, scale, store, sub, vec3
from tissue.elasticity.internal_forces import Surroundings, internal_force
from tissue.elasticity.mass_scaling import free_fall
from tissue.elasticity.spring_forces import damping_force
from tissue.elasticity.springs import Springs
from tissue.integrators.local.chebyshev import Chebyshev
from tissue.integrators.local.element_subsets import Patch, deform_patch, new_patch
from tissue.integrators.local.sleeping import AWAKE, Activity, wake_pulled
from tissue.integrators.node_rings import (
    UNREACHED,
    Rings,
    grown_rings,
    new_rings,
    ring_of,
)
from tissue.integrators.step_context import StepContext
from tissue.mesh.body import Body, grown


class Zone(Arrays):
    """The fine nodes and their neighbours; scratch of shape (capacity, 3) each."""

    rings: Rings
    """Ring 0: fine nodes; further out, up to `reach_of`: nodes whose forces depend on one."""
    patch: Patch
    """Tetrahedra to evaluate where fine nodes have moved."""
    fine: IntArray
    """Scratch for the list of fine nodes, shape (capacity,)."""
    bound: FloatArray
    """Bound on w^2 of every listed node, with what the blade adds [1/s2]; shape (capacity,)."""
    start: FloatArray
    """Positions of the fine nodes at the begin of the step [m]."""
    displacement: FloatArray
    """Displacement e_m [m]."""
    displacement_before: FloatArray
    """Displacement e_{m-1} [m]."""
    steady: FloatArray
    """Share of the acceleration that is the same in all substeps [m/s2]."""
    accelerations: FloatArray
    """Acceleration of every listed node at the begin of the step [m/s2]."""


def new_zone(n_nodes: int, n_tetrahedra: int) -> Zone:
    """Return a zone without nodes, with room for that many nodes and tetrahedra."""
    of_nodes = ("start", "displacement", "displacement_before", "steady", "accelerations")
    return Zone(
        rings=new_rings(n_nodes),
        patch=new_patch(n_nodes, n_tetrahedra),
        fine=np.zeros(n_nodes, np.int64),
        bound=np.zeros(n_nodes),
        **{name: np.zeros((n_nodes, 3)) for name in of_nodes},
    )


def grown_zone(zone: Zone, n_nodes: int, n_tetrahedra: int) -> Zone:
    """Return the zone with room for that many nodes and tetrahedra, its patch empty."""
    of_nodes = (
        "fine",
        "bound",
        "start",
        "displacement",
        "displacement_before",
        "steady",
        "accelerations",
    )
    larger = {name: grown(getattr(zone, name), n_nodes) for name in of_nodes}
    patch = new_patch(n_nodes, n_tetrahedra)
    return zone.replaced(rings=grown_rings(zone.rings, n_nodes), patch=patch, **larger)


class LocalState(Arrays):
    """What local time stepping remembers of a body."""

    activity: Activity
    """The nodes that are listed: awake, or watched. Only awake nodes move."""
    listed: Patch
    """Tetrahedra to evaluate for the forces on all listed nodes."""
    zone: Zone
    """The fine nodes."""


class MacroStep(NamedTuple):
    """Macro steps that divide an increment evenly."""

    dt: float
    """Length of the time step [s]."""
    begin: float
    """Fraction of the time step at which the first one begins."""
    share: float
    """Length of each, as a fraction of the time step."""
    kick: float
    """1, or 0.5 where the velocities are those of this instant: the first step of all."""


@kernel
def macro_steps(
    context: StepContext,
    edge: Edge,
    state: LocalState,
    chebyshev: Chebyshev,
    step: MacroStep,
    first: int,
    end: int,
    is_free: bool,
) -> int:
    """Take macro steps from `first` to before `end`; return the next one.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        state: Written. Where the list of nodes changes, the steps end: `state.listed` must be found
            again before another one.
        chebyshev: Coefficients for the substeps.
        step: Times of the steps.
        first: Number of the first step.
        end: Number behind the last one.
        is_free: Whether nothing touches: then the blade slips after each step, and nodes that are
            pulled wake.
    """
    body, activity, zone = context.body, state.activity, state.zone
    springs, external = context.elastic.springs, context.stages.external
    version = activity.version
    for i in range(first, end):
        at = step.begin + i * step.share
        macro_step(context, edge, state, chebyshev, step, at)
        if is_free:
            now, seconds = at + step.share, step.share * step.dt
            apply_slip(context.blade, body, context.visits, edge, external, now, seconds)
            wake_pulled(activity, body, springs, zone.accelerations)
            if activity.version != version:
                return i + 1
    return end


@kernel
def macro_step(
    context: StepContext,
    edge: Edge,
    state: LocalState,
    chebyshev: Chebyshev,
    step: MacroStep,
    at: float,
) -> None:
    """Advance the listed nodes by one macro step.

    Args:
        context: What takes part. The blade acts in every substep.
        edge: The cutting edge over the time step.
        state: The nodes that move, those that are fine, and the tetrahedra around them.
        chebyshev: Coefficients for the substeps.
        step: Length of the step, and its kick.
        at: Fraction of the time step at which it begins.
    """
    body, elastic, blade = context.body, context.elastic, context.blade
    activity, zone, surroundings = state.activity, state.zone, context.surroundings
    external, share, kick, dt = context.stages.external, step.share, step.kick, step.dt
    h = share * dt
    springs = elastic.springs
    deform_patch(state.listed, elastic, body, body.positions)
    for m in range(len(chebyshev.push)):
        part = kick * share * chebyshev.weight[m]
        apply_blade_forces(blade, body, edge, body.positions, at, part, dt, external)
        if m == 0:
            _accelerate_coarse(context, activity, zone)
            _begin_fine(body, springs, zone, surroundings)
        else:
            deform_patch(zone.patch, elastic, body, body.positions)
        _substep(context, state, chebyshev, h, m)
    clear_blade_forces(blade, body, external)
    _kick(body, activity, zone, surroundings.drag, h, kick)
    if surroundings.retardation_time > 0.0:
        _damp_fine(body, springs, activity, zone.rings, surroundings.retardation_time * h)
    _drift(body, activity, zone, h)


@kernel
def _accelerate_coarse(context: StepContext, activity: Activity, zone: Zone) -> None:
    """Find the accelerations that no fine node changes: they are the same in all substeps."""
    body, elastic, external = context.body, context.elastic, context.stages.external
    surroundings = context.surroundings
    time = surroundings.retardation_time
    for k in range(activity.n_listed):
        node = activity.listed[k]
        if body.fixed[node] or ring_of(zone.rings, node) != UNREACHED:
            continue
        force = internal_force(elastic, node, body.positions, body.velocities, time)
        force = force + point(external, node)
        fall = free_fall(body, node, surroundings.gravity)
        store_point(zone.accelerations, node, fall + times(1.0 / body.masses[node], force))


@kernel
def _begin_fine(body: Body, springs: Springs, zone: Zone, surroundings: Surroundings) -> None:
    rings = zone.rings
    nowhere = point_of(0.0, 0.0, 0.0)
    time = surroundings.retardation_time
    for k in range(rings.n_found):
        node = rings.order[k]
        steady = free_fall(body, node, surroundings.gravity)
        if rings.ring[node] == 0:
            store_point(zone.start, node, point(body.positions, node))
        elif time > 0.0:
            if rings.ring[node] > 1:  # no neighbour is fine
                force = damping_force(springs, node, body.positions, body.velocities, 1.0)
            else:
                force = _coarse_damping(springs, body, rings, node)
            steady = steady + times(time / body.masses[node], force)
        store_point(zone.steady, node, steady)
        store_point(zone.displacement, node, nowhere)
        store_point(zone.displacement_before, node, nowhere)


@kernel
def _substep(
    context: StepContext, state: LocalState, chebyshev: Chebyshev, h: float, m: int
) -> None:
    """Advance the displacement of the fine nodes from e_m to e_{m+1}."""
    body, elastic, external = context.body, context.elastic, context.stages.external
    activity, zone = state.activity, state.zone
    rings, e_m, e_before = zone.rings, zone.displacement, zone.displacement_before
    onward, back, push = chebyshev.onward[m], chebyshev.back[m], chebyshev.push[m] * h * h
    for k in range(rings.n_found):
        node = rings.order[k]
        if body.fixed[node]:
            continue
        force = internal_force(elastic, node, body.positions, body.velocities, 0.0)
        force = force + point(external, node)
        r = point(zone.steady, node) + times(1.0 / body.masses[node], force)
        if m == 0:
            store_point(zone.accelerations, node, r)
        if activity.state[node] != AWAKE:
            continue
        e = point(e_m, node)
        moved = times(onward, e) - times(back, point(e_before, node)) + times(push, r)
        store_point(e_before, node, e)
        store_point(e_m, node, moved)
    # Only now: until here the nodes saw each other at e_m.
    for k in range(rings.n_found):
        node = rings.order[k]
        if rings.ring[node] > 0:
            break
        store_point(body.positions, node, point(zone.start, node) + point(e_m, node))


@kernel
def _kick(body: Body, activity: Activity, zone: Zone, drag: float, h: float, kick: float) -> None:
    half = math.exp(-0.5 * drag * h)
    for k in range(activity.n_listed):
        node = activity.listed[k]
        if activity.state[node] != AWAKE:
            continue
        gain = scale(kick * h, vec3(zone.accelerations, node))
        if ring_of(zone.rings, node) != UNREACHED:
            gain = scale(2.0 * kick / h, vec3(zone.displacement, node))
        v = axpy(half * half, vec3(body.velocities, node), scale(half, gain))
        store(body.velocities, node, v)


@kernel
def _damp_fine(
    body: Body, springs: Springs, activity: Activity, rings: Rings, seconds: float
) -> None:
    """Apply the dampers at fine nodes one after the other; `seconds` is h times retardation."""
    x, v = body.positions, body.velocities
    for i in range(rings.n_found):
        a = rings.order[i]
        if rings.ring[a] > 0:
            break
        inverse_a = 1.0 / body.masses[a]
        for slot in range(springs.first[a], springs.first[a] + springs.count[a]):
            b = springs.neighbour[slot]
            if b < a and ring_of(rings, b) == 0:
                continue  # its turn was, or will be, in the row of b
            is_free = activity.state[b] == AWAKE
            inverse_b = 1.0 / body.masses[b] if is_free else 0.0
            d = sub(vec3(x, b), vec3(x, a))
            inverse = inverse_a + inverse_b
            taken = -math.expm1(-seconds * springs.stiffness[slot] * inverse)
            approach = dot(sub(vec3(v, b), vec3(v, a)), d)
            impulse = taken * approach / (inverse * dot(d, d))
            store(v, a, axpy(impulse * inverse_a, d, vec3(v, a)))
            if is_free:
                store(v, b, axpy(-impulse * inverse_b, d, vec3(v, b)))


@kernel
def _drift(body: Body, activity: Activity, zone: Zone, h: float) -> None:
    for k in range(activity.n_listed):
        node = activity.listed[k]
        if activity.state[node] == AWAKE:
            is_fine = ring_of(zone.rings, node) == 0
            x = vec3(zone.start, node) if is_fine else vec3(body.positions, node)
            store(body.positions, node, axpy(h, vec3(body.velocities, node), x))


@kernel
def _coarse_damping(springs: Springs, body: Body, rings: Rings, node: int) -> Point:
    """Force per retardation time [N/s] of the dampers to nodes that are not fine."""
    x, v = body.positions, body.velocities
    here, speed = vec3(x, node), vec3(v, node)
    fx = fy = fz = 0.0
    first = springs.first[node]
    for slot in range(first, first + springs.count[node]):
        other = springs.neighbour[slot]
        if ring_of(rings, other) == 0:
            continue
        d = sub(vec3(x, other), here)
        along = springs.stiffness[slot] * dot(sub(vec3(v, other), speed), d) / dot(d, d)
        fx += along * d.x
        fy += along * d.y
        fz += along * d.z
    return point_of(fx, fy, fz)
