"""How far a body sags under its own weight, by an estimate that costs nothing."""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray
from tissue.integrators.model import TissueModel
from tissue.material import Material
from tissue.mesh.validation import USUAL_EXTENT
from tissue.types import TissueError

HEAVY = 0.5
"""Weight over stiffness, rho g L / E, from which it is given as the reason why a body does not come
to rest. Cubes on a floor settle at 0.3 and not at 1; held ones settle up to 10 or more."""

HOPELESS = 60.0
"""Weight over stiffness from which a body is refused before it is moved. Of 75 cubes of springs and
of tetrahedra, held at one side or two, none settled above 50. Less: a body that settles would be
refused. More: who reads millimetres as metres waits for seconds, and is told then."""

NODES_LOOKED_AT = 1000
"""Free nodes whose distance to the supports is found, at most: every k-th of them."""


class OwnWeight(NamedTuple):
    """The weight of a body against its stiffness."""

    extent: float
    """Longest side of the box around the body at rest [m]."""
    length: float
    """How far its material is from what holds it, at most [m]."""
    pressure: float
    """Weight of that length, per area [Pa]."""
    young_modulus: float
    """Stiffness of the material [Pa]."""

    @property
    def ratio(self) -> float:
        """Weight over stiffness, rho g L / E."""
        return self.pressure / self.young_modulus

    @property
    def described(self) -> str:
        """By how much the body sags, as a column of that length does, and what helps."""
        sag = 0.5 * self.ratio * self.length
        share = "more than itself" if sag > self.length else f"{sag / self.length:.0%} of itself"
        remedy = "a stiffer material (young_modulus is in Pa), or less gravity, helps"
        if self.extent > USUAL_EXTENT:
            remedy = (
                f"if its mesh is in millimetres, read it with scale 0.001 (--scale 0.001); else "
                f"{remedy}"
            )
        return (
            f"a body of {self.extent:.4g} m in a material of {self.young_modulus:.3g} Pa sags "
            f"under its own weight by some {sag:.3g} m, {share}: {remedy}"
        )


def own_weight(system: TissueModel, material: Material, floor: float | None) -> OwnWeight | None:
    """Return the weight of a body against its stiffness; None where it is no matter.

    Args:
        system: The body, and what holds it.
        material: What it is made of.
        floor: Height of the floor below it [m], or None.
    """
    body, n = system.body, system.body.n_nodes
    per_length = material.density * float(np.linalg.norm(system.surroundings.gravity))
    extent = float(np.ptp(body.rest[:n], axis=0).max())
    if not per_length * extent >= HEAVY * material.young_modulus:
        return None
    length = _farthest_from_support(system, floor)
    weight = OwnWeight(extent, length, per_length * length, material.young_modulus)
    return weight if weight.ratio >= HEAVY else None


def expect_bearable(weight: OwnWeight | None) -> None:
    """Refuse a body that cannot carry its own weight, before it is moved.

    Raises:
        TissueError: its weight is `HOPELESS`.
    """
    if weight is not None and weight.ratio > HOPELESS:
        raise TissueError(f"the body cannot come to rest: {weight.described}")


def _farthest_from_support(system: TissueModel, floor: float | None) -> float:
    """Return how far a node is from what holds the body, at most [m].

    Fixed nodes, what is attached and the floor hold it; geoms may, and then as a floor at its
    lowest node does.
    """
    body, n = system.body, system.body.n_nodes
    positions, is_support = body.positions[:n], _is_support(system)
    free = positions[~is_support]
    free = free[:: 1 + len(free) // NODES_LOOKED_AT]
    if not len(free):
        return 0.0
    distances: FloatArray = np.full(len(free), np.inf)
    gravity = np.array(system.surroundings.gravity)
    if floor is not None:
        distances = np.minimum(distances, free[:, 2] - floor)
    if system.geoms.geoms:
        heights = -(free @ gravity) / np.linalg.norm(gravity)
        distances = np.minimum(distances, heights - heights.min())
    for support in positions[is_support]:
        distances = np.minimum(distances, np.linalg.norm(free - support, axis=1))
    farthest = float(distances.max())
    return farthest if np.isfinite(farthest) else float(np.ptp(positions, axis=0).max())


def _is_support(system: TissueModel) -> BoolArray:
    """Return which nodes are fixed or attached, shape (n_nodes,)."""
    found: BoolArray = system.body.fixed[: system.body.n_nodes].copy()
    found[system.attachments.nodes] = True
    return found
