"""Whether a body can come to rest, and what to say where it did not."""

import logging
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.integrators.system import System
from tissue.types import TissueError

BALANCED = 1e-9
"""Sum of the forces on the nodes, over the sum of their sizes, up to which they balance: that of
rounding."""

_log = logging.getLogger("tissue")


def expect_support(system: System, floor: float | None) -> None:
    """Refuse a body that nothing can hold against its weight and its loads.

    Args:
        system: The body, and the loads in its stages.
        floor: Height of the floor below it [m], or None.

    Raises:
        TissueError: no node is fixed, and the forces do not balance or press on the floor.
    """
    body, n = system.body, system.body.n_nodes
    if body.fixed[:n].any():
        return
    weighing = (body.masses[:n] - body.added_masses[:n])[:, None]
    forces = weighing * np.array(system.surroundings.gravity) + system.stages.loads[:n]
    total = forces.sum(axis=0)
    if np.linalg.norm(total) <= BALANCED * np.linalg.norm(forces, axis=1).sum():
        return
    if floor is not None and total[2] < 0.0:
        return
    raise TissueError(
        f"the body cannot come to rest: nothing holds it against ({total[0]:.3g}, {total[1]:.3g}, "
        f"{total[2]:.3g}) N of weight and loads. Fix some of its nodes, put a floor below it, or "
        "take gravity and loads away"
    )


class FastestNode(NamedTuple):
    """The node of a body that is accelerated most."""

    node: int
    """Its number."""
    position: FloatArray
    """Where it is [m], shape (3,)."""
    acceleration: float
    """The largest part of its acceleration [m/s2]."""

    def described(self, n_steps: int) -> str:
        """Return what it does after so many steps, and what helps."""
        x, y, z = self.position
        return (
            f"after {n_steps:,} steps node {self.node}, at ({x:.3g}, {y:.3g}, {z:.3g}) m, is still "
            f"accelerated by {self.acceleration:.2g} m/s2. What helps: a mesh without small or "
            "flat tetrahedra, whose steps are short; a softer material; a lower Poisson's ratio; "
            "less gravity, load or stretch where the body buckles"
        )


def fastest_node(system: System, accelerations: FloatArray) -> FastestNode:
    """Return the node of a body that is accelerated most.

    Args:
        system: The body.
        accelerations: Accelerations of its nodes [m/s2], shape (n_nodes, 3).
    """
    sizes = np.abs(accelerations).max(axis=1)
    node = int(sizes.argmax())
    return FastestNode(node, system.body.positions[node], float(sizes[node]))


def warn_of_motion(system: System, n_steps: int, accelerations: FloatArray, settled: float) -> None:
    """Log a warning that a body has not come to rest yet.

    Args:
        system: The body.
        n_steps: Steps that it took.
        accelerations: Accelerations of its nodes [m/s2], shape (n_nodes, 3).
        settled: Acceleration at which it counts as settled [m/s2].
    """
    _log.warning(
        "the body has not come to rest, and moves on from here: %s; settling once more. Less than "
        "%.2g m/s2 counts as rest",
        fastest_node(system, accelerations).described(n_steps),
        settled,
    )
