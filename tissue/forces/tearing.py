"""Fibres between two bodies that tear as those are pulled apart."""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import norm, sub
from tissue.forces.attachments import (
    SEVERED,
    STRAIGHT,
    Attachments,
    attached_point,
    end_after_step,
    holding_energy,
)


@kernel
def tear_fibres(fibres: Attachments, positions: FloatArray) -> None:
    """Sever the ties that are stretched until their energy is what cutting them costs.

    That energy is then spent on parting them, as the blade spends it: peeling a layer of ties costs
    toughness times area.
    """
    for p in range(len(fibres.nodes)):
        if fibres.state[p] != STRAIGHT or fibres.is_tie[p] == 0 or fibres.section[p] == 0.0:
            continue
        x, end = attached_point(fibres, p, positions), end_after_step(fibres, p, positions)
        energy = holding_energy(fibres, p, norm(sub(end, x)))
        cutting = fibres.toughness[p] * fibres.section[p]
        left = cutting - fibres.spent[p]
        if energy >= left:
            fibres.severing += left
            fibres.released += energy - left
            fibres.spent[p], fibres.state[p] = cutting, SEVERED
