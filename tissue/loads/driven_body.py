"""`DrivenBody`: the methods of `Tissue` that push it and move its supports."""

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.simd import room_for_points
from tissue.integrators.options import Hierarchical
from tissue.integrators.supports import write_support_forces
from tissue.integrators.system import System
from tissue.loads.load import Load, Loads
from tissue.loads.material_points import MaterialPoints, points_of, region_mask
from tissue.mesh.body import Body
from tissue.mesh.body_queries import BodyQueries
from tissue.solver_settings import SolverSettings

HOLDS = "nodes are supports where `Tissue(fixed=...)` says so"


class DrivenBody(BodyQueries):
    """A body that is pushed by loads and by supports that move."""

    _system: System
    _loads: Loads
    solver: SolverSettings

    @property
    def _body(self) -> Body:
        return self._system.body

    def material_points(self, where: str | npt.ArrayLike) -> MaterialPoints:
        """Return points of the material, which move with it and survive cuts.

        Args:
            where: A region as text (`fixed_nodes`) or as a mask of nodes, shape (n_nodes,): the
                centroids of the faces of the skin in it, each with its share of their area; or
                numbers of nodes, shape (n,); or places in the body at rest [m], shape (n, 3).

        Raises:
            ValueError: no point is there, or one is outside the body.
        """
        return points_of(self._body, where)

    def positions_of(self, points: MaterialPoints) -> FloatArray:
        """Return where material points are now [m], shape (n, 3)."""
        return points.positions(self._body)

    def push(self, where: str | npt.ArrayLike | MaterialPoints, force: npt.ArrayLike) -> Load:
        """Push material points with a force, until `release`; return the load.

        Its force can be changed between steps (`Load.force`). Its work is in the account of energy.
        Nodes that `Hierarchical(far="frozen")` freezes do not feel it.

        Args:
            where: Material points, or what `material_points` takes. On a region the force is a
                traction, the same on each area of the skin at rest.
            force: Total force [N], shape (3,); or one on each point, shape (n, 3).

        Raises:
            ValueError: no point is there, one is outside the body, or the force has another shape
                or is not finite.
        """
        points = where if isinstance(where, MaterialPoints) else self.material_points(where)
        load = Load(points, force)
        self._loads.add(load)
        return load

    def release(self, load: Load) -> None:
        """End a load of `push`.

        Raises:
            ValueError: it does not act on this tissue, or was released before.
        """
        self._loads.remove(load, self._system.stages.loads)

    def move_supports(self, where: str | npt.ArrayLike, velocity: npt.ArrayLike) -> None:
        """Move fixed nodes at a velocity, from the next step on until it is given anew.

        Their displacement in a step is the velocity times its length. Nodes that a cut puts between
        them move with them. `settle` stops them. Their work is in the account of energy, but for
        what they do in contacts that correct the motion (`contact="impulses"`).

        Args:
            where: A region as text (`fixed_nodes`) or as a mask, shape (n_nodes,), of which the
                fixed nodes are moved; or numbers of nodes, shape (n,), all fixed.
            velocity: [m/s], shape (3,), or one for each of these nodes, shape (n, 3).

        Raises:
            ValueError: no node there is fixed, one of a list is not, the velocity has another shape
                or is not finite, or the relaxation is `hierarchical`, which moves no fixed node.
        """
        if self.solver.relaxation == "hierarchical" or isinstance(
            self.solver.relaxation, Hierarchical
        ):
            raise ValueError(
                "supports do not move with relaxation='hierarchical'; use 'global' or 'verlet'"
            )
        system, body = self._system, self._body
        nodes = self._supports_at(where)
        array = np.array(velocity, dtype=np.float64)
        if array.shape not in ((3,), (len(nodes), 3)) or not np.isfinite(array).all():
            raise ValueError(
                f"velocity is {velocity!r}; it is three finite numbers in m/s, or three for each "
                f"of the {len(nodes)} nodes"
            )
        body.velocities[nodes] = array
        n = body.n_nodes
        system.supports.is_moving = int(body.velocities[:n][body.fixed[:n]].any())

    def support_forces(self) -> FloatArray:
        """Return the force of the supports on each fixed node now [N], shape (n_nodes, 3).

        Zero for nodes that are not fixed. It balances the elastic and viscous forces, the weight of
        the node, loads, the blade, and contacts that act as forces (`contact="penalty"`).
        """
        system, n = self._system, self.n_nodes
        self._loads.spread(system.body, system.stages.loads)
        out = room_for_points(len(system.body.rest))
        write_support_forces(system.context, out)
        return out[:n].copy()

    def _supports_at(self, where: str | npt.ArrayLike) -> IntArray:
        """Return the fixed nodes of a region, or of a list."""
        body = self._body
        fixed: BoolArray = body.fixed[: body.n_nodes]
        array = np.asarray(where)
        if array.dtype.kind in "iu":
            nodes = np.atleast_1d(array).astype(np.int64)
            wrong = nodes[(nodes < 0) | (nodes >= body.n_nodes)]
            if wrong.size:
                raise ValueError(f"there is no node {wrong[0]}; the last is {body.n_nodes - 1}")
            free = nodes[~fixed[nodes]]
            if free.size:
                raise ValueError(f"node {free[0]} is not fixed and cannot be moved; {HOLDS}")
            return nodes
        region = where if isinstance(where, str) else np.asarray(where, dtype=np.bool_)
        found: IntArray = np.flatnonzero(region_mask(body, region) & fixed)
        if not found.size:
            raise ValueError(f"no node of the region {where!r} is fixed; {HOLDS}")
        return found
