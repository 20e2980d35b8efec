"""What follows each step of every integrator: contact is resolved, and the blade slips."""

from tissue.blade.forces import apply_slip
from tissue.integrators.step_context import Increment
from tissue.integrators.system import System


def end_step(system: System, increment: Increment, seconds: float, when: float) -> None:
    """Resolve contact, then let the blade slip.

    Args:
        system: What took the step.
        increment: The increment that the step is a part of.
        seconds: Length of the step [s].
        when: End of the step, as a fraction of the time step.
    """
    resolve_contact(system, seconds)
    slip_blade(system, increment, seconds, when)


def resolve_contact(system: System, seconds: float) -> None:
    """Do what contact does after a step of that length [s]."""
    system.contact.end_substep(system.body, system.stages.external, seconds)


def slip_blade(system: System, increment: Increment, seconds: float, when: float) -> None:
    """Apply plastic slip at the edge and frictional sliding on the faces; see `end_step`."""
    blade, body, visits = system.interaction.state, system.body, system.visits
    apply_slip(blade, body, visits, increment.edge, system.stages.external, when, seconds)
