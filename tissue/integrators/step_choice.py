"""`StepChoice`: the steps of an increment, and what they depend on."""

import math

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.elasticity.internal_forces import Surroundings


class StepChoice(Arrays):
    """The steps of one increment: what they depend on, and the part that is taken next."""

    method: IntCell
    """Whose steps they are: its number in `tissue.integrators.methods`."""
    done: IntCell
    """Steps of the increment taken so far."""
    last_steps: IntCell
    """Steps that contact and blade needed in the last increment, without strain."""
    n_steps: IntCell
    """Steps of the part that is taken next."""
    refinement: IntCell
    """Steps that are taken over those that motion and stability require."""
    is_at_rest: IntCell
    """1 while the body is not moved, as it was nearly at rest and nothing touches it, else 0."""
    is_unstable: IntCell
    """1 if the motion became unstable: it would take too many steps: see `MOST_STEPS`."""
    dt: FloatCell
    """Length of the time step [s]."""
    begin: FloatCell
    """Fraction of the time step at which the part begins."""
    part_seconds: FloatCell
    """Length of the last part [s]."""
    part_end: FloatCell
    """Fraction of the time step at which the part ends."""
    end: FloatCell
    """Fraction of the time step at which the increment ends."""
    span: FloatCell
    """Length of the increment [s]."""
    of_contact: FloatCell
    """Largest part of contact and attachments in w^2 of every node [1/s2]; written before an
    increment begins. Contact of tetrahedra is in the bounds of their nodes instead."""
    room: FloatCell
    """Room for contact in w^2 of the body without another step [1/s2]."""
    least: FloatCell
    """Bound on w^2 with the body at rest, the blade and contact [1/s2]."""
    added: FloatCell
    """Part of contact in w^2, and of the blade where tissue stiffens [1/s2]."""
    needed: FloatCell
    """Steps that the motion needs in the rest of the increment."""
    at_rest: FloatCell
    """Steps that the body at rest would take for it."""
    strained: FloatCell
    """The last bound on w^2 of the tetrahedra as they are deformed [1/s2]."""
    allowed: FloatCell
    """Up to which w^2 it was not brought near the truth [1/s2]."""
    moved: FloatCell
    """Farthest that a node has moved since [m]."""
    resting: FloatCell
    """Time for which the body has been nearly at rest, and nothing has touched it [s]."""
    resting_positions: FloatArray
    """Where the nodes were when that began [m], shape (n_nodes, 3)."""
    speed: FloatCell
    """Speed of the fastest node at the begin of the part [m/s]."""
    node_size: float
    """Mean node size of the body [m]."""
    surroundings: Surroundings
    """Gravity and all damping."""
    no_frequency: FloatArray
    """Zeros, shape (node capacity,)."""


def new_step_choice(
    method: int, node_size: float, surroundings: Surroundings, n_nodes: int
) -> StepChoice:
    """Return that no increment has begun, with room for that many nodes."""
    return StepChoice(
        method=method,
        done=0,
        last_steps=1,
        n_steps=0,
        refinement=1,
        is_at_rest=0,
        is_unstable=0,
        dt=0.0,
        begin=0.0,
        part_seconds=0.0,
        part_end=0.0,
        end=0.0,
        span=0.0,
        of_contact=0.0,
        room=0.0,
        least=0.0,
        added=0.0,
        needed=0.0,
        at_rest=0.0,
        strained=0.0,
        allowed=0.0,
        moved=math.inf,
        resting=0.0,
        resting_positions=np.zeros((n_nodes, 3)),
        speed=0.0,
        node_size=node_size,
        surroundings=surroundings,
        no_frequency=np.zeros(n_nodes),
    )


@kernel
def wake(choice: StepChoice) -> None:
    """Move the body again, which may have been at rest."""
    choice.resting = 0.0
    choice.is_at_rest = 0
