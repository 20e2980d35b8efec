"""Rigid cores: sets of tetrahedra that move as rigid bodies inside the tissue, such as bones.

Their nodes are nodes of the body like others. The tetrahedra of a core stay in the mesh, where they
carry no force but on each other, as they are never strained.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.structs import Arrays
from tissue.mesh.body import OUTER, Body
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.pieces import LoosePieces, no_loose_pieces
from tissue.mesh.surface import boundary_nodes
from tissue.types import TissueError

_IS_FIXED = (
    "fixed, and cannot be in a core, which moves. Hold fewer nodes, or take another region for the "
    "core"
)
_IS_BARE = (
    "on the skin, and a core is inside the tissue. Take a smaller region, or a finer mesh; what is "
    "rigid at the skin can be held (`fixed`)"
)
_IS_SHARED = (
    "in another core: two that share nodes would be one rigid body. Leave tissue between them, or "
    "take both as one core"
)


class CoreCutError(TissueError):
    """A blade would have cut a rigid core; the body is as it was before."""


class CoreMotion(NamedTuple):
    """Where a rigid core is, and how it moves."""

    mass: float
    """Mass of its nodes [kg]: the core, and a share of each tetrahedron at its surface."""
    centre: FloatArray
    """Centre of that mass [m], shape (3,)."""
    rotation: FloatArray
    """Rotation since it became rigid, shape (3, 3)."""
    velocity: FloatArray
    """Velocity of the centre [m/s], shape (3,)."""
    angular_velocity: FloatArray
    """Angular velocity [rad/s], shape (3,)."""


class Cores(Arrays):
    """The nodes of all cores, and where they are in the frame of their core."""

    pieces: LoosePieces
    """The nodes of each core."""
    shape: FloatArray
    """Place of each of these nodes in the frame of its core [m], shape (n, 3)."""


def no_cores() -> Cores:
    """Return that there is no core."""
    return Cores(pieces=no_loose_pieces(), shape=np.zeros((0, 3)))


class _Core(NamedTuple):
    """One core, by its tetrahedra. None of these arrays is written after it was made."""

    tetrahedra: IntArray
    """Its tetrahedra, shape (n,)."""
    shape: FloatArray
    """Where their corners were when it became rigid [m], shape (n, 4, 3)."""
    rest: FloatArray
    """Where they are at rest [m], shape (n, 4, 3)."""
    links: IntArray
    """Links of their faces that lead to another of them, else OUTER; shape (n, 4)."""
    added: FloatArray
    """Mass at each of their corners in addition to that of tissue [kg], shape (n,)."""


class RigidCores:
    """The cores of one body, kept true to cuts around them."""

    def __init__(self) -> None:
        self.arrays = no_cores()
        """Nodes and shapes, as kernels read them."""
        self._cores: tuple[_Core, ...] = ()

    def __len__(self) -> int:
        """Return the number of cores."""
        return len(self._cores)

    @property
    def nodes(self) -> IntArray:
        """The nodes of all cores, core by core, shape (n,)."""
        return self.arrays.pieces.node

    def add(self, body: Body, mask: BoolArray, added_density: float) -> int:
        """Make the tetrahedra rigid of which all nodes are in a region; return the core's number.

        Args:
            body: The body; what is rigid and its masses are written.
            mask: Whether each node is in the region, shape (n_nodes,).
            added_density: Density of the core less that of tissue [kg/m3].

        Raises:
            ValueError: there is no such tetrahedron, or one of their nodes is fixed, on the skin or
                in another core.
        """
        corners = body.tetrahedra[: body.n_tetrahedra]
        tetrahedra = np.flatnonzero(mask[corners].all(axis=1))
        if not tetrahedra.size:
            raise ValueError(
                "no tetrahedron has all its nodes in the region of the core. Take a larger region, "
                "or a finer mesh"
            )
        nodes = np.unique(corners[tetrahedra])
        for others, why in (
            (np.flatnonzero(body.fixed[: body.n_nodes]), _IS_FIXED),
            (boundary_nodes(body), _IS_BARE),
            (self.nodes, _IS_SHARED),
        ):
            common = np.intersect1d(nodes, others)
            if common.size:
                at = ", ".join(f"{x:.4g}" for x in body.rest[common[0]])
                raise ValueError(f"node {common[0]} at ({at}) m is {why}")
        return self.add_tetrahedra(body, tetrahedra, added_density)

    def add_tetrahedra(self, body: Body, tetrahedra: IntArray, added_density: float) -> int:
        """Make some tetrahedra one rigid body; see `add`."""
        corners, links = body.tetrahedra[tetrahedra], body.links[tetrahedra]
        is_inside = np.isin(links // 4, tetrahedra) & (links >= 0)
        rest = body.rest[corners]
        core = _Core(
            tetrahedra=tetrahedra,
            shape=body.positions[corners],
            rest=rest,
            links=np.where(is_inside, links, OUTER),
            added=0.25 * added_density * np.linalg.det(rest[:, 1:] - rest[:, :1]) / 6.0,
        )
        body.is_rigid[tetrahedra] = True
        body.n_rigid += len(tetrahedra)
        self._cores = (*self._cores, core)
        self._write(body)
        self._add_masses(body, np.unique(corners))
        return len(self._cores) - 1

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Follow cuts around the cores: nodes that were doubled, masses that were written.

        Raises:
            CoreCutError: a core itself was cut.
        """
        if not self._cores:
            return
        body = changed.body
        for core in self._cores:
            _expect_whole(core, body)
        self._write(body)
        self._add_masses(body, np.intersect1d(changed.nodes, self.nodes))

    def motions(self, body: Body) -> tuple[CoreMotion, ...]:
        """Return where each core is, and how it moves."""
        found = []
        for first, last in pairwise(self.arrays.pieces.begin.tolist()):
            nodes, shape = self.nodes[first:last], self.arrays.shape[first:last]
            masses = body.masses[nodes, None]
            mass = float(masses.sum())
            middle, centre, velocity = (
                (masses * rows).sum(axis=0) / mass
                for rows in (shape, body.positions[nodes], body.velocities[nodes])
            )
            arms = body.positions[nodes] - centre
            inertia = (masses * arms**2).sum() * np.eye(3) - arms.T @ (masses * arms)
            spin = np.cross(arms, masses * body.velocities[nodes]).sum(axis=0)
            before, _, after = np.linalg.svd((masses * (shape - middle)).T @ arms)
            turn, rate = (before @ after).T, np.linalg.solve(inertia, spin)
            found.append(CoreMotion(mass, centre, turn, velocity, rate))
        return tuple(found)

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: rows are those of the nodes of cores."""

    def _write(self, body: Body) -> None:
        """Write the nodes of the cores."""
        nodes, places, begin = [], [], [0]
        for core in self._cores:
            found, first = np.unique(body.tetrahedra[core.tetrahedra], return_index=True)
            nodes.append(found)
            places.append(core.shape.reshape(-1, 3)[first])
            begin.append(begin[-1] + len(found))
        node = np.concatenate(nodes)
        if not np.array_equal(node, self.nodes):
            pieces = LoosePieces(node=node, begin=np.array(begin, dtype=np.int64))
            self.arrays = Cores(pieces=pieces, shape=np.concatenate(places))

    def _add_masses(self, body: Body, nodes: IntArray) -> None:
        """Add to some nodes of cores, which have the mass of tissue, what cores are heavier."""
        more = np.zeros(body.n_nodes)
        for core in self._cores:
            for k in range(4):
                np.add.at(more, body.tetrahedra[core.tetrahedra, k], core.added)
        body.masses[nodes] += more[nodes]


def _expect_whole(core: _Core, body: Body) -> None:
    """Refuse a core that was cut.

    Raises:
        CoreCutError: one of its tetrahedra was divided, or two of them parted.
    """
    is_whole = (body.rest[body.tetrahedra[core.tetrahedra]] == core.rest).all(axis=(1, 2))
    is_joined = ((core.links == OUTER) | (body.links[core.tetrahedra] == core.links)).all(axis=1)
    cut = np.flatnonzero(~(is_whole & is_joined))
    if cut.size:
        at = ", ".join(f"{x:.4g}" for x in core.rest[cut[0]].mean(axis=0))
        raise CoreCutError(
            f"the blade has come to a rigid core, which it does not cut, at ({at}) m of the body "
            "at rest. Lead it past the core, or end the stroke before it"
        )
