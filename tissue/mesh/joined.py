"""Several bodies as one mesh, each a part of it that labels name."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.geometry.rotations import checked_rotation
from tissue.mesh.faces import boundary_faces
from tissue.mesh.mesh_arrays import MeshError, mesh_arrays
from tissue.mesh.overlaps import expect_apart
from tissue.mesh.parts import OF_BODY
from tissue.types import TetrahedralMesh

WELDED = 1e-6
"""Distance at which two nodes are in one place, in the body's extent: the rounding of files."""


def placed(
    mesh: TetrahedralMesh,
    pos: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
    rotation: FloatArray | None = None,
) -> TetrahedralMesh:
    """Return a mesh in another place.

    Args:
        mesh: The mesh.
        pos: Where its origin comes [m], shape (3,).
        rotation: Its axes as columns, shape (3, 3); None: as they are.

    Raises:
        ValueError: a number is not finite, or it is no rotation.
    """
    origin = np.array(pos, dtype=np.float64)
    if origin.shape != (3,) or not np.isfinite(origin).all():
        raise ValueError(f"pos is {pos!r}; it is three finite numbers in m")
    positions = mesh.positions
    if rotation is not None:
        positions = positions @ checked_rotation(rotation, "rotation").T
    return mesh._replace(positions=positions + origin)


def joined(bodies: Mapping[str, TetrahedralMesh], *, weld: Collection[str] = ()) -> TetrahedralMesh:
    """Return several bodies as one mesh, for one `Tissue`: they touch, and one blade cuts them all.

    Each body has labels of its own: one that is called as the body; or, where its mesh has several,
    one for each, called `body/label`. Nodes of two bodies are apart, even in one place, unless one
    of them is welded.

    Args:
        bodies: Meshes where they lie at rest, by the names of their bodies.
        weld: Bodies that are bonded to those before them where faces of both lie node on node: they
            share these nodes from then on.

    Raises:
        MeshError: there is no body, a mesh is broken, two overlap, or one that is to be welded
            lies node on node on none of those before it.
        ValueError: a name is empty, has a `/`, or is that of no body.
    """
    _expect_names(bodies, weld)
    meshes = {name: mesh_arrays(mesh) for name, mesh in bodies.items()}
    for (one, a), (other, b) in itertools.combinations(meshes.items(), 2):
        expect_apart((one, other), a, b)
    positions: list[FloatArray] = []
    tetrahedra: list[IntArray] = []
    labels: list[IntArray] = []
    names: dict[int, str] = {}
    n_nodes, next_label = 0, 1
    for name, mesh in meshes.items():
        own, own_names = _labelled(name, mesh, next_label)
        tets, is_kept = mesh.tetrahedra + n_nodes, np.ones(len(mesh.positions), np.bool_)
        if name in weld:
            before = np.concatenate([*positions, np.zeros((0, 3))]), tetrahedra
            tets, is_kept = _welded(name, mesh, *before)
        positions.append(mesh.positions[is_kept])
        tetrahedra.append(tets)
        labels.append(own)
        names |= own_names
        n_nodes += int(is_kept.sum())
        next_label = int(own.max()) + 1
    return TetrahedralMesh(
        np.concatenate(positions),
        np.concatenate(tetrahedra),
        np.concatenate(labels),
        MappingProxyType(names),
    )


def _expect_names(bodies: Mapping[str, TetrahedralMesh], weld: Collection[str]) -> None:
    """Refuse names that no label can have, and bodies that there are not."""
    if not bodies:
        raise MeshError("there is no body")
    for name in bodies:
        if not name or OF_BODY in name:
            raise ValueError(f"a body is called {name!r}; a name is a text without '{OF_BODY}'")
    unknown = [name for name in weld if name not in bodies]
    if unknown:
        raise ValueError(f"there is no body {unknown[0]!r} to weld; there is {', '.join(bodies)}")


def _labelled(name: str, mesh: TetrahedralMesh, first: int) -> tuple[IntArray, dict[int, str]]:
    """Return the labels of a body, from `first` on, and their names."""
    given = np.zeros(len(mesh.tetrahedra), np.int64) if mesh.labels is None else mesh.labels
    found = np.unique(given).tolist()
    own = np.searchsorted(found, given) + first
    if len(found) == 1 and found[0] not in mesh.label_names:
        return own, {first: name}
    texts = [mesh.label_names.get(label, str(label)) for label in found]
    return own, {first + i: f"{name}{OF_BODY}{text}" for i, text in enumerate(texts)}


def _welded(
    name: str, mesh: TetrahedralMesh, positions: FloatArray, tetrahedra: Sequence[IntArray]
) -> tuple[IntArray, BoolArray]:
    """Return the tetrahedra of a body with nodes of those before it, and which nodes it keeps.

    Args:
        name: Name of the body.
        mesh: The body.
        positions: Nodes of the bodies before it [m], shape (n, 3).
        tetrahedra: Tetrahedra of each of them.

    Raises:
        MeshError: no face of it lies node on node on one of theirs.
    """
    from scipy.spatial import cKDTree  # 0.2 s, and only here

    node = np.full(len(mesh.positions), -1)
    if len(positions):
        near = WELDED * float(np.ptp(np.concatenate([positions, mesh.positions]), axis=0).max())
        distance, nearest = cKDTree(positions).query(mesh.positions, distance_upper_bound=near)
        node[np.isfinite(distance)] = nearest[np.isfinite(distance)]
    mine = boundary_faces(mesh.tetrahedra)
    theirs = [boundary_faces(each) for each in tetrahedra]
    faces = {tuple(sorted(face)) for each in theirs for face in each.tolist()}
    shared = [tuple(sorted(face)) in faces for face in node[mine].tolist()]
    is_welded = np.zeros(len(node), np.bool_)
    is_welded[mine[shared]] = True
    if not is_welded.any():
        raise MeshError(
            f"body '{name}' cannot be welded: no face of it lies node on node on a face of a body "
            "before it. Mesh both together, as labels of one mesh, or tie them by fibres"
        )
    number = np.where(is_welded, node, len(positions) + np.cumsum(~is_welded) - 1)
    return number[mesh.tetrahedra], ~is_welded
