"""Relaxation (RX) of an increment stage by stage, for integrators that do more between stages."""

from typing import TYPE_CHECKING

from tissue.blade.blade_context import BladeContext
from tissue.integrators.step_context import Increment
from tissue.integrators.system import System
from tissue.integrators.unstable import not_finite
from tissue.mesh.bounding_boxes import widen_bounds, write_bounds

if TYPE_CHECKING:
    from tissue.integrators.integrator import Integrator


def relax_in_stages(
    integrator: "Integrator",
    system: System,
    blade: BladeContext,
    increment: Increment,
    has_blade: bool,
) -> int:
    """Relax by an increment; return the steps taken. See `Integrator.relax`.

    Args:
        integrator: Advances the motion.
        system: Body, forces and contact.
        blade: What searches of the blade work on.
        increment: The part of a time step to advance by.
        has_blade: Whether there is a blade.

    Raises:
        TissueError: the motion became unstable.
    """
    interaction, edge = system.interaction, increment.edge
    faces_of = edge if has_blade else None
    interaction.update_faces(blade, integrator.moved, faces_of, increment.begin)
    n = integrator.advance(system, increment) if increment.span > 0.0 else 0
    if n > 0:
        system.relax_stress(increment.span)
        if integrator.moving is None:
            system.find_new_loose_pieces()
        if not _update_bounds(integrator, system, blade):
            raise not_finite()
    if has_blade:
        external, blade = system.stages.external, interaction.renewed(blade)
        interaction.update_anchors(blade, external, integrator.moved, edge, increment.end)
    return n


def _update_bounds(integrator: "Integrator", system: System, blade: BladeContext) -> bool:
    """Update the box around the body; return whether all positions are finite."""
    moving, body = integrator.moving, system.body
    if moving is None or 2 * moving[1] > body.n_nodes:
        return write_bounds(body, blade.bounds)
    return widen_bounds(body, *moving, blade.bounds)
