"""Whether a body can come to rest, and what to say where it did not."""

import logging

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


def warn_of_motion(system: System, n_steps: int, accelerations: FloatArray, settled: float) -> None:
    """Log a warning that a body did not come to rest.

    Args:
        system: The body.
        n_steps: Steps that it took.
        accelerations: Accelerations of its nodes [m/s2], shape (n_nodes, 3).
        settled: Acceleration at which it counts as settled [m/s2].
    """
    sizes = np.abs(accelerations).max(axis=1)
    node = int(sizes.argmax())
    x, y, z = system.body.positions[node]
    _log.warning(
        "the body has not come to rest in %s steps: node %d, at (%.3g, %.3g, %.3g) m, is still "
        "accelerated by %.2g m/s2, and less than %.2g counts as rest. It moves on from there. "
        "What helps: settling once more; a mesh without small or flat tetrahedra, whose steps are "
        "short; a lower Poisson's ratio; less gravity, load or stretch where the body buckles",
        f"{n_steps:,}",
        node,
        x,
        y,
        z,
        sizes[node],
        settled,
    )
