"""Views of a body: copies of its state, its pieces, the boxes around it, quantities at its skin."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import get_args

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.elasticity.internal_forces import Elastic
from tissue.fields.node_fields import largest_principal_strains, von_mises_stresses
from tissue.fields.tetrahedron_fields import (
    mark_strained,
    strains_of_tetrahedra,
    stresses_of_tetrahedra,
)
from tissue.integrators.model import TissueModel
from tissue.loads.facing import Facing, facing_points
from tissue.loads.material_points import MaterialPoints, points_of, region_mask
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import ChunkNodes, chunk_nodes, chunks_of, write_bounds
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.cut_faces import CutFaces
from tissue.mesh.parts import labels_of_part
from tissue.mesh.pieces import label_pieces, piece_of_tetrahedra, pieces_of
from tissue.mesh.rigid_cores import CoreMotion
from tissue.mesh.surface import boundary_nodes, boundary_surface
from tissue.types import Chunks, Deformation, Piece, Snapshot, Surface, SurfaceQuantity


def bounds_of_body(body: Body) -> FloatArray:
    """Return the lowest and highest corner of a body [m], shape (2, 3)."""
    corners = np.empty((2, 3))
    write_bounds(body, corners)
    return corners


def snapshot_of(body: Body) -> Snapshot:
    """Return a copy of the whole state of a body."""
    n = body.n_nodes
    return Snapshot(
        body.positions[:n].copy(),
        body.rest[:n].copy(),
        body.velocities[:n].copy(),
        body.masses[:n] - body.added_masses[:n],
        body.added_masses[:n].copy(),
        body.tetrahedra[: body.n_tetrahedra].copy(),
        body.fixed[:n].copy(),
        labels_of(body),
    )


def labels_of(body: Body) -> IntArray:
    """Return the label of each tetrahedron of a body, shape (n_tets,)."""
    return np.asarray(body.materials.label[body.material[: body.n_tetrahedra]])


def tetrahedra_of(body: Body, names: Mapping[int, str], part: int | str | BoolArray) -> BoolArray:
    """Return which tetrahedra are of a part, shape (n_tets,): see `BodyView.facing`.

    Raises:
        ValueError: there is no such part, or the mask has another shape.
    """
    labels = labels_of(body)
    if isinstance(part, (int, np.integer, str)):
        return np.isin(labels, labels_of_part(np.unique(labels).tolist(), names, part))
    nodes = region_mask(body, np.asarray(part))
    return np.asarray(nodes[body.tetrahedra[: body.n_tetrahedra]].any(axis=1))


def n_pieces_of(body: Body) -> int:
    """Return the number of connected pieces of a body."""
    piece, queue = np.empty((2, body.n_tetrahedra), dtype=np.int64)
    return label_pieces(body, piece, queue)


class BodyChunks:
    """The parts of a body around which boxes are drawn, until its mesh changes."""

    def __init__(self) -> None:
        self._nodes: ChunkNodes | None = None

    def boxes(self, body: Body) -> Chunks:
        """Return boxes that together hold the body."""
        if self._nodes is None:
            self._nodes = chunk_nodes(body)
        return chunks_of(body, self._nodes)

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Divide the body again when its boxes are needed next."""
        del changed
        self._nodes = None

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: there are no rows of nodes."""


def surface_values_of(body: Body, elastic: Elastic, quantity: SurfaceQuantity) -> FloatArray:
    """Return a quantity at each vertex of the skin, shape (n_vertices,); see `Tissue`.

    Args:
        body: The body.
        elastic: Arrays from which the stress follows.
        quantity: Name of the quantity.

    Raises:
        ValueError: there is no such quantity.
    """
    n, nodes = body.n_nodes, boundary_nodes(body)
    if quantity == "displacement":
        offsets = body.positions[nodes] - body.rest[nodes]
        return np.asarray(np.linalg.norm(offsets, axis=1), float)
    values, sums = np.empty(n), np.zeros((n, 7))
    if quantity == "strain":
        largest_principal_strains(body, sums, values)
    elif quantity == "stress":
        with _as_before(elastic):
            von_mises_stresses(elastic, body, sums, values)
    else:
        raise ValueError(
            f"there is no quantity {quantity!r}. Known: {', '.join(get_args(SurfaceQuantity))}"
        )
    return values[nodes]


@contextmanager
def _as_before(elastic: Elastic) -> Iterator[None]:
    """Put back what the last step left for the bound before the next one."""
    left = elastic.solid.gradient, elastic.solid.stiffness_taken
    kept = [array.copy() for array in left]
    yield
    for array, values_before in zip(left, kept, strict=True):
        array[:] = values_before


def deformation_of(body: Body, elastic: Elastic) -> Deformation:
    """Return stress and strain of each tetrahedron.

    Args:
        body: The body.
        elastic: Arrays from which the stress follows.
    """
    stresses, strains = np.zeros((2, body.n_tetrahedra, 3, 3))
    with _as_before(elastic):
        stresses_of_tetrahedra(elastic, body, stresses)
    strains_of_tetrahedra(body, strains)
    return Deformation(stresses, strains)


class BodyView:
    """The body of a `Tissue`, to be read."""

    material: Material
    """Material of the body; of several that which resists changes of volume most."""
    label_names: Mapping[int, str]
    """Names of labels, of those that have one."""
    _model: TissueModel

    @property
    def _body(self) -> Body:
        return self._model.body

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self._model.body.n_nodes

    @property
    def n_tetrahedra(self) -> int:
        """Number of tetrahedra."""
        return self._model.body.n_tetrahedra

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest corner of the body [m], shape (2, 3)."""
        return bounds_of_body(self._body)

    def snapshot(self) -> Snapshot:
        """Return a copy of the whole state."""
        return snapshot_of(self._body)

    def surface(self) -> Surface:
        """Return the boundary triangles, skin and cut faces apart."""
        return boundary_surface(self._body)

    def surface_values(self, quantity: SurfaceQuantity) -> FloatArray:
        """Return a quantity at each vertex of `surface()`, shape (n_vertices,).

        `displacement`: distance from rest [m]. `strain`: largest principal Green-Lagrange strain,
        (l^2 - 1) / 2 where the most stretched direction is l times as long. `stress`: equivalent
        stress of von Mises of the elastic Cauchy stress [Pa], under any law, less what has relaxed.
        Strain and stress are the mean of the tetrahedra around the node, by volume: those of
        `deformation`.

        Raises:
            ValueError: there is no such quantity.
        """
        return surface_values_of(self._body, self._model.elasticity.arrays, quantity)

    def deformation(self) -> Deformation:
        """Return stress and strain of each tetrahedron now."""
        return deformation_of(self._body, self._model.elasticity.arrays)

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

    def facing(
        self, one: int | str | BoolArray, other: int | str | BoolArray, *, within: float = 1e-3
    ) -> Facing:
        """Return the skin of one body that faces that of another at rest, for `Tissue.tie`.

        Args:
            one: A label, by number or name; one of several bodies, by name; or a mask of nodes,
                shape (n_nodes,): the tetrahedra that have one of them.
            other: The other body, likewise.
            within: Farthest distance between the two [m].

        Raises:
            ValueError: there is no such part, or none of its skin is so near and faces the other.
        """
        body, names = self._body, self.label_names
        mine, theirs = (tetrahedra_of(body, names, part) for part in (one, other))
        return facing_points(body, mine, theirs, within)

    def positions_of(self, points: MaterialPoints) -> FloatArray:
        """Return where material points are now [m], shape (n, 3)."""
        return points.positions(self._body)

    def mark_strained(self, points: MaterialPoints, limit: float, marked: BoolArray) -> None:
        """Mark the material points at which the tissue is now stretched beyond a limit.

        Args:
            points: The points.
            limit: Largest principal Green-Lagrange strain, above 0: (l^2 - 1) / 2 where the most
                stretched direction is l times as long, in the tetrahedron that holds the point.
            marked: Which are marked, shape (n,); those are not looked at again.
        """
        mark_strained(self._body, points.rest, points.last_holders, float(limit), marked)

    @property
    def n_cut_faces(self) -> int:
        """Number of faces that cuts have opened since the body was made."""
        return len(self._model.cut_faces)

    def cut_faces(self, since: int = 0) -> CutFaces:
        """Return the faces that cuts have opened, one side of each, in order.

        Their areas add up to `StepResult.cut_area`. A state has them too.

        Args:
            since: Number of the first of them: those before are known.

        Raises:
            ValueError: fewer faces were cut.
        """
        return self._model.cut_faces.since(since)

    def labels(self) -> IntArray:
        """Return the label of each tetrahedron now, shape (n_tets,): 0 of meshes without labels."""
        return labels_of(self._body)

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""
        return n_pieces_of(self._body)

    @property
    def cores(self) -> tuple[CoreMotion, ...]:
        """Return where each rigid core is now and how it moves, in the order they were made."""
        return self._model.cores.motions(self._body)

    def pieces(self) -> tuple[Piece, ...]:
        """Return the connected pieces and their mass properties, the largest at rest first."""
        return pieces_of(self.snapshot())

    def piece_of_tetrahedra(self) -> IntArray:
        """Return the index in `pieces` of the piece of each tetrahedron, shape (n_tets,)."""
        return piece_of_tetrahedra(self.snapshot())
