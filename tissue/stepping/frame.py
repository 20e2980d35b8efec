"""The begin of a time step in one call: checks, edge, number of increments; and its end in another.

Each call from Python costs 1 to 4 us. Where the begin needs something, a call returns; the next one
continues behind it.
"""

import math
from typing import Final

from tissue.blade.blade_context import report_step
from tissue.blade.edge import Edge, is_other_length
from tissue.blade.forces import begin_blade_step
from tissue.contact.search_stages import added_frequency, begin_contacts
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import norm, sub
from tissue.cutting.incision import TOO_MANY, count_increments
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.mass_scaling import N_MOMENTA, add_momentum
from tissue.integrators.driver import Relaxation
from tissue.integrators.stability import surely_takes_few_steps
from tissue.mesh.body import Body
from tissue.mesh.node_motion import is_motion_finite
from tissue.stepping.energy_audit import Account, write_energies

BEGUN: Final = 0
"""The time step has begun."""
NOT_FINITE_BEFORE: Final = 1
"""A position or a velocity is not a finite number; nothing was changed."""
MANY_STEPS: Final = 2
"""It may take too many steps of the integrator."""
TOO_FAR: Final = 3
"""The edge moves too far."""
OTHER_EDGE: Final = 4
"""The edge has another length than the one that holds the tissue."""
UNSOUND_EDGE: Final = 5
"""No blade can move so, as far as the squares of its numbers are finite."""


class FrameContext(Arrays, two_precisions=True):
    """Everything that the kernels of a time step read and write."""

    n_increments: IntCell
    """Number of increments of the time step."""
    travel: FloatCell
    """Distance that the edge moves in the time step [m]."""
    relaxation: Relaxation
    """Everything that the relaxation of an increment reads and writes."""
    account: Account
    """The account of energy."""
    node_size: float
    """Mean node size [m]."""


@kernel
def begin_frame(
    frame: FrameContext,
    edge: Edge,
    has_blade: bool,
    dt: float,
    edge_length: float,
    held: float,
    after: int,
) -> int:
    """Begin a time step; return BEGUN, or what is wrong or needed.

    Args:
        frame: Written.
        edge: The cutting edge over the time step.
        has_blade: Whether there is one.
        dt: Length of the time step [s].
        edge_length: Length of the edge that holds the tissue [m]; 0 for none.
        held: Largest part of attachments in w^2 of the body [1/s2].
        after: What the last call of this step returned, and was settled; at first BEGUN.
    """
    step = frame.relaxation.step
    if after < NOT_FINITE_BEFORE and not is_motion_finite(step.body):
        return NOT_FINITE_BEFORE
    if after < MANY_STEPS:
        search, limits = frame.relaxation.contacts, frame.relaxation.limits
        squared = step.elastic.highest + held + added_frequency(search, limits)
        around = frame.relaxation.choice.surroundings
        if not surely_takes_few_steps(step.elastic, around, squared, dt):
            return MANY_STEPS
    # In each call: what was settled may have made another struct.
    is_near = _divide_travel(frame, edge, has_blade)
    if after < TOO_FAR and not is_near:
        return TOO_FAR
    length = norm(sub(edge.tip_t1, edge.heel_t1)) if has_blade else 0.0
    if after < OTHER_EDGE and is_other_length(length, edge_length):
        return OTHER_EDGE
    is_checked = not has_blade or after == UNSOUND_EDGE
    if not begin_blade_step(step.blade, step.body, edge, dt, is_checked):
        return UNSOUND_EDGE
    begin_contacts(frame.relaxation.contacts, step.contacts)
    return BEGUN


@kernel
def _divide_travel(frame: FrameContext, edge: Edge, has_blade: bool) -> bool:
    """Write into how many increments the travel of the edge divides the step.

    Returns:
        Whether they are few enough: see `count_increments`.
    """
    frame.n_increments, frame.travel = 1, 0.0
    if has_blade:
        tip = norm(sub(edge.tip_t1, edge.tip_t0))
        frame.travel = max(tip, norm(sub(edge.heel_t1, edge.heel_t0)))
    n = count_increments(frame.travel, frame.node_size)
    frame.n_increments = max(1, n)
    return bool(n != TOO_MANY)


@kernel
def end_frame(frame: FrameContext, edge: Edge, dt: float, known: int) -> None:
    """Write the report of a time step, and the account of energy if one is kept.

    Args:
        frame: The report and the account are written.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        known: What of the account is known: see `write_energies`.
    """
    relaxation = frame.relaxation
    report_step(relaxation.blade, edge, dt)
    _report_added_mass(relaxation.blade.report.added, relaxation.step.elastic, relaxation.step.body)
    if frame.account.is_kept == 1:
        write_energies(frame.account, relaxation.step, edge, 1.0, known)


@kernel
def _report_added_mass(added: FloatArray, elastic: Elastic, body: Body) -> None:
    """Write the numbers of `tissue.types.AddedMass`; they stay 0 where no node gets mass."""
    scaling = elastic.scaling
    if scaling.allowed < math.inf:
        for i in range(N_MOMENTA):
            added[1 + i], added[7 + i] = 0.0, scaling.impulse[i]
        added[0] = add_momentum(body, elastic.solid.every, body.n_nodes, 1.0, added[1:7])
