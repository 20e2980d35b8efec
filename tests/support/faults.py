"""Faults that are injected into a running simulation: numbers that no motion would have written."""

from typing import Any

import numpy as np

from tissue import Tissue

VALUES = (np.nan, np.inf, -np.inf, 1e3, -1e3, 1e9, -1e9)
"""What is written: not finite, or far from anything that tissue does."""

IN_TISSUE = ("positions", "velocities", "stiffness")
"""Where in a body."""


def inject(tissue: Tissue, where: str, value: float, random: np.random.Generator) -> None:
    """Write a value into one number of the body: of a free node, or of an element or spring.

    Args:
        tissue: Changed, as by a fault of memory.
        where: One of `IN_TISSUE`. A stiffness is multiplied by the value.
        value: In m, in m/s, or a factor.
        random: Chooses the number.
    """
    body = tissue._model.body
    free = np.flatnonzero(~body.fixed[: body.n_nodes])
    if where == "stiffness":
        _spoil_stiffness(tissue, random.choice(free), value, random)
        return
    array = getattr(body, where)
    array[random.choice(free), random.integers(3)] = value


def _spoil_stiffness(tissue: Tissue, node: int, factor: float, random: np.random.Generator) -> None:
    """Multiply the stiffness of a spring of a node, or a gradient of a tetrahedron around it."""
    elastic: Any = tissue._model.elasticity.arrays
    if elastic.has_springs:
        springs = elastic.springs
        slot = springs.first[node] + random.integers(springs.count[node])
        springs.stiffness[slot] *= factor
        return
    solid = elastic.solid
    width = 64 // solid.shape.itemsize
    tetrahedra = tissue._model.body.tetrahedra[: tissue.n_tetrahedra]
    t = random.choice(np.flatnonzero((tetrahedra == node).any(axis=1)))
    rows = solid.shape.reshape(-1)[10 * width * (t // width) :][: 10 * width].reshape(10, width)
    with np.errstate(over="ignore", invalid="ignore"):
        rows[random.integers(10), t % width] *= factor
