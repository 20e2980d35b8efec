"""Loads: forces on material points, spread on the nodes around them."""

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray
from tissue.loads.material_points import MaterialPoints
from tissue.mesh.body import Body


class Load:
    """A force on material points of a tissue, constant in direction, until it is released.

    Args:
        points: What it acts on.
        force: See `force`.

    Raises:
        ValueError: the force has another shape, or is not finite.
    """

    def __init__(self, points: MaterialPoints, force: npt.ArrayLike) -> None:
        self.points = points
        self.force = force
        self.number = -1
        """Its number among all loads of its tissue; -1 where it never acted."""

    @property
    def force(self) -> FloatArray:
        """The total force [N], shape (3,).

        Set it to a total, which is divided among the points by their shares, or to one force for
        each of them, shape (n, 3). It acts from the next step on.
        """
        return np.asarray(self.forces.sum(axis=0))

    @force.setter
    def force(self, force: npt.ArrayLike) -> None:
        array = np.array(force, dtype=np.float64)
        n = len(self.points)
        if array.shape not in ((3,), (n, 3)) or not np.isfinite(array).all():
            raise ValueError(
                f"force is {force!r}; it is three finite numbers in N, or three for each of "
                f"the {n} points"
            )
        each = array if array.shape == (n, 3) else self.points.shares[:, None] * array
        self.forces: FloatArray = each

    def virtual_work(self, body: Body) -> float:
        """Return the force on each point times its position, summed [J]; its change is work."""
        return float((self.forces * self.points.positions(body)).sum())


class Loads:
    """All loads of a body."""

    def __init__(self) -> None:
        self._loads: list[Load] = []
        self._n_added = 0

    @property
    def act(self) -> bool:
        """Whether there are any."""
        return bool(self._loads)

    @property
    def all(self) -> tuple[Load, ...]:
        """Those that act, in the order in which they were made."""
        return tuple(self._loads)

    @property
    def forces(self) -> tuple[FloatArray, ...]:
        """The forces of each load on its points [N], in their order."""
        return tuple(load.forces for load in self._loads)

    @forces.setter
    def forces(self, forces: tuple[FloatArray, ...]) -> None:
        for load, each in zip(self._loads, forces, strict=True):
            load.forces = each

    def add(self, load: Load) -> None:
        """Add a load, which acts from now on."""
        load.number = self._n_added
        self._n_added += 1
        self._loads.append(load)

    def remove(self, load: Load, nodal_forces: FloatArray) -> None:
        """End a load.

        Raises:
            ValueError: it does not act on this body, or was released before.
        """
        if load not in self._loads:
            raise ValueError("the load does not act on this tissue, or was released before")
        self._loads.remove(load)
        nodal_forces[:] = 0.0

    def spread(self, body: Body, nodal_forces: FloatArray) -> None:
        """Write the loads to the nodes around their points [N], shape (capacity, 3)."""
        if not self._loads:
            return
        nodal_forces[:] = 0.0
        for load in self._loads:
            nodes, weights = load.points.nodes_and_weights(body)
            np.add.at(nodal_forces, nodes, weights[:, :, None] * load.forces[:, None, :])

    def virtual_work(self, body: Body) -> float:
        """Return the sum of `Load.virtual_work` [J]."""
        return sum(load.virtual_work(body) for load in self._loads)
