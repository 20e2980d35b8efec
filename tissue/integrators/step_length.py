"""How long a time step may be: what takes too many steps of the integrator has no end."""

import math

from tissue.core.limits import MANY_SUBSTEPS, MOST_SUBSTEPS
from tissue.cut_settings import undamped_steps
from tissue.integrators.model import TissueModel
from tissue.integrators.stability import stable_step

_SURELY_FEW = 0.1
"""Highest frequency and rate of decay times a time step, per step that is allowed, up to which the
longest step need not be computed. It takes some 1.3 steps at most for each of them, by
`stability.STABILITY_LIMIT`."""


def expect_few_steps(system: TissueModel, method: int, dt: float) -> None:
    """Refuse a time step that takes more than `MOST_SUBSTEPS` steps of the integrator.

    Args:
        system: The body before the step, which is not changed.
        method: What limits its steps: a constant of `tissue.integrators.stability`.
        dt: Length of the step [s].

    Raises:
        ValueError: it does; the message says why, and how long a step may be.
    """
    elastic, surroundings = system.elasticity.arrays, system.surroundings
    of_body = system.elasticity.frequency_squared
    of_holds = system.added_by_attachments
    squared = of_body + of_holds + system.contact.added_frequency_squared
    rate = surroundings.retardation_time * elastic.highest_of_dampers + surroundings.drag
    if dt * (math.sqrt(squared) + rate) <= _SURELY_FEW * MOST_SUBSTEPS:
        return
    step = stable_step(method, elastic, squared, surroundings)
    if dt <= MOST_SUBSTEPS * step:
        return
    reason = "its elements are small, stiff or light"
    if undamped_steps(math.sqrt(squared), dt) <= MANY_SUBSTEPS:
        reason = "damping in it is strong"
    elif of_holds > of_body:
        reason = "what is attached to it is held stiffly, or damped strongly"
    raise ValueError(
        f"a time step of {dt:.3g} s takes some {dt / step:.3g} steps of the integrator in this "
        f"tissue, because {reason}; at most {MOST_SUBSTEPS:,} are done. Take time steps of at most "
        f"{MOST_SUBSTEPS * step:.2g} s"
    )
