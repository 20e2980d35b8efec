"""Up to which frequency nodes get mass between cuts, by the steps that are taken in any case."""

from tissue.core.jit import kernel
from tissue.elasticity.frequency.changes import return_all_mass
from tissue.elasticity.frequency.strained import limit_touching
from tissue.elasticity.internal_forces import Elastic
from tissue.forces.step_context import StepContext
from tissue.integrators.stability import stable_step, without_another_step
from tissue.integrators.step_choice import StepChoice
from tissue.laws.kernels import stiffens

_LEAST_RETURNED = 0.5
"""Share of the mass that the body may get which nodes got between cuts where they give it back as
it is used up. Lower: where cuts need most of it, it would be given back in each increment."""

_SOON = 100
"""Increments within which mass that is used up again calls for another step: a blade moves by an
element in as many."""


@kernel
def limit_mass(choice: StepChoice, context: StepContext) -> None:
    """Set the limit above which nodes get mass between cuts; they give it back where it is used up.

    Where one step suffices for the increment without it, they get none. Where what was given back
    is used up again soon, tissue that stiffens may take another step; other tissue keeps what it
    has, as it would only lose momentum.
    """
    elastic, scaling, solid = context.elastic, context.elastic.scaling, context.elastic.solid
    scaling.increments += 1
    if scaling.is_used_up == 1:
        scaling.is_used_up = 0
        is_soon, may_step = scaling.increments < _SOON, stiffens(solid.law)
        if scaling.between_cuts >= _LEAST_RETURNED * scaling.most and (may_step or not is_soon):
            if is_soon:
                scaling.steps = max(scaling.steps, choice.last_steps) + 1
            return_all_mass(elastic, context.body, solid.every)
    limit_touching(elastic, context.body)
    at_rest = max(elastic.highest, elastic.highest_touching) + choice.of_contact
    longest = stable_step(choice.method, elastic, at_rest, choice.surroundings)
    n, highest = without_another_step(at_rest, longest, choice.span)
    scaling.allowed_between_cuts = max(scaling.allowed, highest) if n == 1 else scaling.allowed


@kernel
def limit_mass_for_strain(choice: StepChoice, elastic: Elastic) -> None:
    """Set the limit above which nodes get mass where strain makes them fast.

    Tissue that stiffens as it is stretched gets as little as the steps need that contact and blade
    take in any case.
    """
    scaling = elastic.scaling
    scaling.allowed_where_strained = scaling.allowed_between_cuts
    if stiffens(elastic.solid.law):
        longest = stable_step(choice.method, elastic, choice.least, choice.surroundings)
        n, highest = without_another_step(choice.least, longest, choice.span)
        choice.last_steps = n
        more = max(n, scaling.steps) / n
        allowed = more * more * highest - choice.added
        scaling.allowed_where_strained = max(scaling.allowed_between_cuts, allowed)
