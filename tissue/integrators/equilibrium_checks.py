"""Whether a body can come to rest, and the reason where it did not.

How far it sags under its own weight is an estimate that costs nothing.
"""

import logging
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.integrators.model import TissueModel
from tissue.material import Material
from tissue.mesh.pieces import loose_pieces_of
from tissue.mesh.validation import USUAL_EXTENT
from tissue.types import TissueError

BALANCED = 1e-9
"""Sum of the forces on the nodes, over the sum of their sizes, up to which they balance: that of
rounding."""

HEAVY = 0.5
"""Weight over stiffness, rho g L / E, from which it is given as the reason why a body does not come
to rest. Cubes on a floor settle at 0.3 and not at 1; held ones settle up to 10 or more."""

HOPELESS = 60.0
"""Weight over stiffness from which a body is refused before it is moved. Of 75 cubes of springs and
of tetrahedra, held at one side or two, none settled above 50. Less: a body that settles would be
refused. More: who reads millimetres as metres waits for seconds,."""

NODES_MEASURED = 1000
"""Free nodes whose distance to the supports is found, at most: every k-th of them."""

_log = logging.getLogger("tissue")


class OwnWeight(NamedTuple):
    """The weight of a body against its stiffness."""

    extent: float
    """Longest side of the box around the body at rest [m]."""
    length: float
    """Largest distance of its material from what holds it [m]."""
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


class SupportConditions(NamedTuple):
    """Support of a body that comes to rest, and its weight."""

    floor: float | None
    """Height of the floor below it [m], or None."""
    weight: OwnWeight | None
    """Its weight against its stiffness; None where that is no matter."""

    @property
    def remedy(self) -> str:
        """Reason why the body yields, where that is its weight, else what may help."""
        if self.weight is not None:
            return self.weight.described
        return "less gravity, load or stretch, or a stiffer material, may help"


def support_of(system: TissueModel, material: Material, floor: float | None) -> SupportConditions:
    """Return what a body comes to rest on, once it is plain that it can.

    What is attached, and what touches geoms, is not checked: only motion shows whether they hold.

    Args:
        system: The body, and the loads in its stages.
        material: What it is made of.
        floor: Height of the floor below it [m], or None.

    Raises:
        TissueError: no node is fixed, and the forces do not balance or press on the floor; or the
            material cannot carry its weight.
    """
    support = SupportConditions(floor, own_weight(system, material, floor))
    if not ((system.attachments.is_tie == 0).any() or system.geoms.geoms):
        _expect_held(system, floor)
        expect_bearable(support.weight)
    return support


def _expect_held(system: TissueModel, floor: float | None) -> None:
    """Refuse a body that nothing can hold against its weight and its loads.

    Raises:
        TissueError: see `support_of`.
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
    found = f"({total[0]:.3g}, {total[1]:.3g}, {total[2]:.3g}) N of weight and loads"
    if floor is not None:
        raise TissueError(
            f"the body cannot come to rest: nothing holds it against {found}, which do not press "
            "it on the floor. Fix some of its nodes, or take gravity and loads away"
        )
    raise TissueError(
        f"the body cannot come to rest: nothing holds it against {found}. Fix some of its nodes, "
        "put a floor below it, or take gravity and loads away"
    )


def gone_too_far(
    system: TissueModel, node: int, begin: FloatArray, support: SupportConditions
) -> TissueError:
    """Return the error that says why a node has gone far away, as far as can be seen.

    Args:
        system: The body.
        node: Number of the node.
        begin: Where it began [m], shape (3,).
        support: What the body should have come to rest on.
    """
    distance = float(np.linalg.norm(system.body.positions[node] - begin))
    x, y, z = begin
    found = (
        f"the body cannot come to rest: node {node}, at ({x:.3g}, {y:.3g}, {z:.3g}) m, has gone "
        f"{distance:.3g} m and continues."
    )
    piece = _loose_piece(system, node)
    if not len(piece):
        return TissueError(
            f"{found} The piece that it belongs to is held, and gives way: {support.remedy}"
        )
    if np.isin(system.attachments.nodes, piece).any():
        return TissueError(
            f"{found} No node of its piece is fixed; attachments hold it, and give way: stiffer or "
            "more of them, fixed nodes, or less gravity and load may help"
        )
    if support.floor is None and not system.geoms.geoms:
        return TissueError(
            f"{found} Nothing holds the piece that it belongs to against its weight and its loads: "
            "fix nodes of it, put a floor below it, or take gravity and loads away"
        )
    return TissueError(
        f"{found} No node of its piece is fixed or attached, and what it touches does not keep it "
        f"there: {support.remedy}"
    )


def _loose_piece(system: TissueModel, node: int) -> IntArray:
    """Return the nodes of the piece that a node belongs to; none if one of them is fixed."""
    loose = loose_pieces_of(system.body)
    for begin, end in pairwise(loose.begin.tolist()):
        nodes = loose.node[begin:end]
        if (nodes == node).any():
            return nodes
    return loose.node[:0]


class FastestNode(NamedTuple):
    """The node of a body that is accelerated most."""

    node: int
    """Its number."""
    position: FloatArray
    """Where it is [m], shape (3,)."""
    acceleration: float
    """The largest part of its acceleration [m/s2]."""

    def described(self, n_steps: int, support: SupportConditions) -> str:
        """Return what it does after so many steps, and what may help."""
        x, y, z = self.position
        found = (
            f"after {n_steps:,} steps node {self.node}, at ({x:.3g}, {y:.3g}, {z:.3g}) m, is still "
            f"accelerated by {self.acceleration:.2g} m/s2."
        )
        if support.weight is not None:
            return f"{found} Its weight is much: {support.weight.described}"
        return (
            f"{found} What may help: a mesh without small or flat tetrahedra, whose steps are "
            "short; a softer material; a lower Poisson's ratio; less gravity, load or stretch "
            "where the body buckles"
        )


def fastest_node(system: TissueModel, accelerations: FloatArray) -> FastestNode:
    """Return the node of a body that is accelerated most.

    Args:
        system: The body.
        accelerations: Accelerations of its nodes [m/s2], shape (n_nodes, 3).
    """
    sizes = np.abs(accelerations).max(axis=1)
    node = int(sizes.argmax())
    return FastestNode(node, system.body.positions[node], float(sizes[node]))


def restless(
    system: TissueModel,
    fastest: FastestNode,
    begin: FloatArray,
    n_steps: int,
    support: SupportConditions,
) -> TissueError:
    """Return the error of a body that is accelerated as if it fell, after many steps.

    Args:
        system: The body.
        fastest: The node that is accelerated most.
        begin: Where that was at first [m], shape (3,).
        n_steps: Steps that it took.
        support: What the body should have come to rest on.
    """
    if len(_loose_piece(system, fastest.node)):
        return gone_too_far(system, fastest.node, begin, support)
    return TissueError(f"the body cannot come to rest: {fastest.described(n_steps, support)}")


def warn_of_motion(
    system: TissueModel,
    n_steps: int,
    accelerations: FloatArray,
    support: SupportConditions,
    settled: float,
) -> None:
    """Log a warning that a body has not come to rest yet.

    Args:
        system: The body.
        n_steps: Steps that it took.
        accelerations: Accelerations of its nodes [m/s2], shape (n_nodes, 3).
        support: What it comes to rest on.
        settled: Acceleration at which it counts as settled [m/s2].
    """
    _log.warning(
        "the body has not come to rest, and moves on from here: %s; settling once more. Less than "
        "%.2g m/s2 counts as rest",
        fastest_node(system, accelerations).described(n_steps, support),
        settled,
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
    free = free[:: 1 + len(free) // NODES_MEASURED]
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
    found[system.attachments.nodes[system.attachments.is_tie == 0]] = True
    return found
