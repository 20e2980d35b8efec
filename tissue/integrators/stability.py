"""The largest steps at which each method is stable."""

import math
from typing import Final

import numpy as np

from tissue.core.jit import kernel
from tissue.core.limits import MOST_SUBSTEPS
from tissue.elasticity.internal_forces import Elastic, Surroundings, damped_frequency
from tissue.integrators.methods import METHODS, RUNGE_KUTTA, SAFETY
from tissue.laws.kernels import stiffens

_LIMITS: Final = tuple(method.limit for method in METHODS.values())
_SAFETY: Final = tuple(method.safety for method in METHODS.values())
_SAFETY_STIFFENING: Final = tuple(method.safety_stiffening for method in METHODS.values())

STABILITY_LIMIT = np.array(
    [
        # damping ratio, largest angular frequency times step
        [0.0, 2.587],
        [0.05, 2.587],
        [0.5, 2.587],
        [0.7, 1.863],
        [0.9, 1.469],
        [1.0, 1.331],
        [1.5, 0.907],
        [2.0, 0.687],
        [5.0, 0.278],
    ]
)
"""Where the Runge-Kutta method is stable for x'' = -w^2 x - 2 zeta w x', if damping acts in every
stage (the tests measure it). Between 0.05 and 0.5 the limit is higher; the table stays at its
lowest."""

DAMPING_LIMIT = 2.0
"""Largest rate of damping times its interval where damping acts between steps, with either method:
beyond it the damping turns a velocity round and makes it larger."""

_RATIOS: Final = tuple(STABILITY_LIMIT[:, 0].tolist())
_LAST_LIMIT: Final = float(STABILITY_LIMIT[-1, 1])
_INVERSES: Final = tuple((1.0 / STABILITY_LIMIT[:, 1]).tolist())
"""The limit falls nearly as 1 / ratio: a line between its entries would be above it."""


_ROUNDING = 1e-9
"""Share by which a frequency stays below that which would take another step."""

_SURELY_FEW = 0.1
"""Highest frequency and rate of decay times a time step, per step that is allowed, up to which the
longest step need not be computed. It takes some 1.3 steps at most for each of them, by
`STABILITY_LIMIT`."""


@kernel
def surely_takes_few_steps(
    elastic: Elastic, surroundings: Surroundings, squared: float, dt: float
) -> bool:
    """Return whether a time step surely takes few steps of the integrator.

    Args:
        elastic: What the forces inside the body follow from.
        surroundings: All damping.
        squared: Bound on w^2 of the body with all that holds and touches it [1/s2].
        dt: Length of the time step [s].
    """
    rate = surroundings.retardation_time * damped_frequency(elastic) + surroundings.drag
    return bool(dt * (math.sqrt(squared) + rate) <= _SURELY_FEW * MOST_SUBSTEPS)


@kernel
def stable_step(
    method: int, elastic: Elastic, frequency_squared: float, surroundings: Surroundings
) -> float:
    """Return a stable step [s] of a method; infinite where every node is fixed.

    Where damping acts between steps, the elastic motion and the damping limit it each by itself.

    Args:
        method: Number of the method (`tissue.integrators.methods`).
        elastic: What is viscous, and whether its law stiffens.
        frequency_squared: Bound on w^2 [1/s2].
        surroundings: Gravity and all damping.
    """
    if method == RUNGE_KUTTA:
        damped: float = _stage_damped_step(elastic, frequency_squared, surroundings)
        return damped
    if frequency_squared == 0.0:
        return math.inf  # every node is fixed
    rate = damping_rate(elastic, surroundings)
    step = SAFETY / max(math.sqrt(frequency_squared) / _LIMITS[method], rate / DAMPING_LIMIT)
    safety = _SAFETY_STIFFENING if stiffens(elastic.solid.law) else _SAFETY
    return safety[method] / SAFETY * step


@kernel
def _stage_damped_step(
    elastic: Elastic, frequency_squared: float, surroundings: Surroundings
) -> float:
    """Return a stable Runge-Kutta step [s] where damping acts in every stage.

    What is viscous brakes a mode by retardation_time times its own w^2. Others act besides it: the
    volume term beside dampers along edges, and the blade, contact and attachments. What is braked
    as much at a lower frequency is stable too, within `SAFETY`: over the damping ratios from 0.5
    on, braking times the largest step is 2.6 to 2.8 (`STABILITY_LIMIT`).
    """
    retardation_time = surroundings.retardation_time
    damped = damped_frequency(elastic)
    if frequency_squared > damped:
        retardation_time *= damped / frequency_squared
    frequency = math.sqrt(frequency_squared)
    largest: float = largest_stable_step(frequency, retardation_time, surroundings.drag)
    return SAFETY * largest


@kernel
def largest_stable_step(frequency: float, retardation_time: float, viscous_damping: float) -> float:
    """Return the largest stable step [s] for angular frequencies up to `frequency` [1/s].

    Stiffness-proportional damping adds w * retardation_time / 2 to the damping ratio of a mode,
    drag adds viscous_damping / (2 w).
    """
    if frequency == 0.0:
        return math.inf
    ratio = 0.5 * (frequency * retardation_time + viscous_damping / frequency)
    last = len(_RATIOS) - 1
    if ratio > _RATIOS[last]:
        limit: float = _LAST_LIMIT * _RATIOS[last] / ratio
        return limit / frequency
    i = 0
    while i < last - 1 and _RATIOS[i + 1] <= ratio:
        i += 1
    share = (ratio - _RATIOS[i]) / (_RATIOS[i + 1] - _RATIOS[i])
    inverse = _INVERSES[i] + share * (_INVERSES[i + 1] - _INVERSES[i])
    limit = 1.0 / inverse
    return limit / frequency


@kernel
def without_another_step(
    frequency_squared: float, longest: float, span: float
) -> tuple[int, float]:
    """Return how many steps a frequency takes, and up to which w^2 [1/s2] it is no more.

    Args:
        frequency_squared: A bound on w^2 [1/s2].
        longest: The longest step with it [s].
        span: Time to advance by [s].
    """
    if math.isinf(longest):
        return 1, math.inf
    n = max(1, math.ceil(span / longest))
    return n, (1.0 - _ROUNDING) * frequency_squared * (n * longest / span) ** 2


@kernel
def damping_rate(elastic: Elastic, surroundings: Surroundings) -> float:
    """Return the highest rate [1/s] at which damping stops a motion."""
    return surroundings.retardation_time * damped_frequency(elastic) + surroundings.drag
