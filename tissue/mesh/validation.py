"""A mesh that the engine can work with, or an error that names what is wrong with it."""

import logging
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.mesh.faces import OUTWARD, SortedFaces, sorted_faces
from tissue.mesh.mesh_arrays import MeshError as MeshError
from tissue.mesh.mesh_arrays import mesh_arrays
from tissue.mesh.pieces import components
from tissue.mesh.star import LARGEST_STAR
from tissue.types import TetrahedralMesh

_logger = logging.getLogger("tissue")

MAX_EXTENT = 1e3
"""A body larger than this [m] is in other units than metres."""

MIN_EXTENT = 1e-5
"""A body smaller than this [m], the size of a cell, is in other units than metres."""

USUAL_EXTENT = 1.0
"""A body larger than this [m] may well be in millimetres; no organ and no blade is that long."""

FLAT_QUALITY = 1e-4
"""Quality below which a tetrahedron counts as flat: rounding hides on which side its nodes are.

A tetrahedron whose nodes lie in a plane but for single precision has 1e-7; a cell of a grid that
is 200 times as wide as high still has 4e-3.
"""

SLIVER_QUALITY = 1e-2
"""Quality below which a tetrahedron forces short time steps and poor cuts."""

N_NAMED = 5
"""Elements that an error names at most."""


class CheckedMesh(NamedTuple):
    """A mesh that is sound, and what was repaired in it."""

    mesh: TetrahedralMesh
    """Signed volumes are positive, every node is used, tetrahedra around it share faces."""
    origin: IntArray
    """Node of the given mesh that each node was, shape (n_nodes,)."""
    warnings: tuple[str, ...]
    """Repairs, and doubtful things."""


def checked(mesh: TetrahedralMesh, name: str = "mesh") -> CheckedMesh:
    """Refuse a broken mesh, repair harmless faults, and warn of doubtful ones.

    Repaired, with a warning: unused nodes (dropped), inverted tetrahedra (reordered), and nodes or
    edges at which tetrahedra meet that share no face there (the node is split). Tetrahedra stay
    in their order, with their labels.
    Doubtful, with a warning: several pieces, slivers, a body over a metre. Warnings go to the
    logger "tissue" too.

    Which way the nodes of a tetrahedron wind is a matter of the mesher. A mesh in which tetrahedra
    are inverted because the body is folded over itself is refused: there tetrahedra lie on the same
    side of the face between them.

    Args:
        mesh: The mesh as it comes; other integer and floating point types are converted.
        name: Its name in messages, for example that of its file.

    Raises:
        MeshError: No tetrahedra; an index out of range; NaN or infinity; a body larger than
            `MAX_EXTENT` or smaller than `MIN_EXTENT`; a tetrahedron that names a node twice,
            occurs twice, or is flat; a face with three tetrahedra, or with two on the same side;
            labels that are no whole numbers from 0 on.
    """
    try:
        result = examined(mesh)
    except MeshError as error:
        raise MeshError(f"{name}: {error}") from None
    for warning in result.warnings:
        _logger.warning("%s: %s", name, warning)
    return result


def expect_sound(mesh: TetrahedralMesh, name: str = "mesh") -> TetrahedralMesh:
    """Return a mesh as `mesh_arrays` does; refuse one that is broken, or would be repaired.

    For callers that also have data for each node of the mesh, and therefore must not change it.

    Raises:
        MeshError: `checked` would refuse the mesh or repair it.
    """
    try:
        result = examined(mesh)
    except MeshError as error:
        raise MeshError(f"{name}: {error}") from None
    mesh = mesh_arrays(mesh)
    n_nodes = len(result.mesh.positions)
    is_same = n_nodes == len(mesh.positions) and np.array_equal(
        result.mesh.tetrahedra, mesh.tetrahedra
    )
    if not is_same:
        raise MeshError(
            f"{name}: it would have to be repaired ({'; '.join(result.warnings)}): make it by "
            "tissue.mesh_from_arrays(positions, tetrahedra), which does so"
        )
    return mesh


def examined(mesh: TetrahedralMesh) -> CheckedMesh:
    """Return what `checked` returns, and log nothing.

    Raises:
        MeshError: `checked` would refuse the mesh.
    """
    warnings: list[str] = []
    positions, tetrahedra, labels, names = mesh_arrays(mesh)
    _refuse_wrong_indices(tetrahedra, len(positions))
    _refuse_not_finite(positions)
    positions, tetrahedra, origin = _without_unused(positions, tetrahedra, warnings)
    _refuse_wrong_extent(positions, warnings)
    _refuse_repeated(tetrahedra)
    if crowding := crowding_of(tetrahedra):
        raise MeshError(crowding)
    _refuse_flat(positions, tetrahedra, warnings)
    tetrahedra = _turned_left(positions, tetrahedra, warnings)
    faces = sorted_faces(tetrahedra)
    _refuse_wrong_faces(tetrahedra, faces)
    pairs = faces.halves[faces.starts[faces.counts == 2][:, None] + [0, 1]]
    tetrahedra, copied = _with_stars_joined(tetrahedra, pairs, len(positions), warnings)
    _count_pieces(len(tetrahedra), pairs // 4, warnings)
    positions = np.concatenate([positions, positions[copied]])
    sound = TetrahedralMesh(positions, tetrahedra, labels, names)
    return CheckedMesh(sound, np.concatenate([origin, origin[copied]]), tuple(warnings))


def _refuse_wrong_indices(tetrahedra: IntArray, n_nodes: int) -> None:
    """Refuse tetrahedra that do not name four different nodes that exist."""
    wrong = (tetrahedra < 0) | (tetrahedra >= n_nodes)
    if wrong.any():
        tets = np.flatnonzero(wrong.any(axis=1))
        raise MeshError(
            f"{_tetrahedra(tets)} an index out of range, such as {tetrahedra[wrong][0]}; "
            f"there are the nodes 0 to {n_nodes - 1}"
            if n_nodes
            else "there are tetrahedra but no nodes"
        )
    in_order = np.sort(tetrahedra, axis=1)
    twice = np.flatnonzero((in_order[:, 1:] == in_order[:, :-1]).any(axis=1))
    if twice.size:
        raise MeshError(f"{_tetrahedra(twice)} a repeated node: {tetrahedra[twice[0]].tolist()}")


def _refuse_not_finite(positions: FloatArray) -> None:
    """Refuse coordinates that are NaN or infinite."""
    wrong = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if wrong.size:
        raise MeshError(
            f"{_some('node', wrong)} a coordinate that is NaN or infinite: "
            f"{positions[wrong[0]].tolist()}"
        )


def _without_unused(
    positions: FloatArray, tetrahedra: IntArray, warnings: list[str]
) -> tuple[FloatArray, IntArray, IntArray]:
    """Drop nodes that no tetrahedron names; return the rest, and the old number of each node."""
    used = np.zeros(len(positions), dtype=bool)
    used[tetrahedra] = True
    kept = np.flatnonzero(used)
    n_unused = len(positions) - len(kept)
    if n_unused:
        nodes = (
            "node that no tetrahedron uses" if n_unused == 1 else "nodes that no tetrahedron uses"
        )
        warnings.append(f"dropped {n_unused} {nodes}, the first {_ids(np.flatnonzero(~used))}")
    return positions[kept], (np.cumsum(used) - 1)[tetrahedra], kept


def _refuse_wrong_extent(positions: FloatArray, warnings: list[str]) -> None:
    """Refuse a body of a size that makes no sense in metres."""
    with np.errstate(over="ignore"):
        extent = float(np.ptp(positions, axis=0).max())
    if extent > MAX_EXTENT:
        raise MeshError(
            f"extent {extent:.4g} m, over {MAX_EXTENT:g} m: millimetres? use --scale 0.001"
        )
    if extent < MIN_EXTENT:
        raise MeshError(
            f"extent {extent:.4g} m, under {MIN_EXTENT:g} m: is it in another unit? "
            "--scale is that unit in metres"
        )
    if extent > USUAL_EXTENT:
        warnings.append(f"extent {extent:.4g} m: millimetres? use --scale 0.001")


def _refuse_repeated(tetrahedra: IntArray) -> None:
    """Refuse a mesh in which a tetrahedron occurs twice."""
    in_order = np.sort(tetrahedra, axis=1)
    order = np.lexsort(in_order.T)
    equal = (in_order[order[1:]] == in_order[order[:-1]]).all(axis=1)
    if equal.any():
        k = int(np.flatnonzero(equal)[0])
        twins = sorted((int(order[k]), int(order[k + 1])))
        raise MeshError(
            f"duplicate tetrahedra: {twins[0]} and {twins[1]} have the same nodes "
            f"{in_order[order[k]].tolist()}; {int(equal.sum())} in all"
        )


def signed_volumes(positions: FloatArray, tetrahedra: IntArray) -> FloatArray:
    """Return the volumes [m3], shape (n_tets,); positive where abc turns left seen from d."""
    a, b, c, d = (positions[tetrahedra[:, k]] for k in range(4))
    volumes: FloatArray = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
    return volumes


def quality(positions: FloatArray, tetrahedra: IntArray) -> FloatArray:
    """Return 6 sqrt(2) V / l^3, shape (n_tets,), with l the root mean square of the six edges.

    1 for a regular tetrahedron, 0 for a flat one, negative for an inverted one.
    """
    squares = np.zeros(len(tetrahedra))
    for i, j in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)):
        squares += ((positions[tetrahedra[:, i]] - positions[tetrahedra[:, j]]) ** 2).sum(axis=1)
    lengths = np.maximum(np.sqrt(squares / 6.0), np.finfo(np.float64).tiny ** (1 / 3))
    shape: FloatArray = 6.0 * np.sqrt(2.0) * signed_volumes(positions, tetrahedra) / lengths**3
    return shape


def _refuse_flat(positions: FloatArray, tetrahedra: IntArray, warnings: list[str]) -> None:
    """Refuse flat tetrahedra, and warn of slivers."""
    shape = np.abs(quality(positions, tetrahedra))
    worst = np.argsort(shape, kind="stable")[:N_NAMED]
    flat = worst[shape[worst] < FLAT_QUALITY]
    if flat.size:
        named = ", ".join(f"{t} (quality {shape[t]:.1e})" for t in flat)
        raise MeshError(
            f"{int((shape < FLAT_QUALITY).sum())} flat tetrahedra, the worst: {named}; quality is "
            f"1 for a regular one and must be at least {FLAT_QUALITY:g}. Merge nodes that lie in "
            "the same place, or mesh the body again with the mesher's optimisation on"
        )
    n_slivers = int((shape < SLIVER_QUALITY).sum())
    if n_slivers:
        warnings.append(
            f"{n_slivers} slivers (quality below {SLIVER_QUALITY:g}), the worst tetrahedron "
            f"{worst[0]} ({shape[worst[0]]:.1e}): time steps will be short and cuts poor. The "
            "mesher's optimisation removes them"
        )


def _turned_left(positions: FloatArray, tetrahedra: IntArray, warnings: list[str]) -> IntArray:
    """Return the tetrahedra with positive volumes.

    Where the body is folded over itself, a tetrahedron that is turned overlaps its neighbours, and
    that is refused afterwards.
    """
    inverted = signed_volumes(positions, tetrahedra) < 0.0
    if not inverted.any():
        return tetrahedra
    most = bool(inverted.mean() > 0.5)
    odd = np.flatnonzero(inverted != most)
    others = ("all but " if most else "") + _ids(odd) if odd.size else "all"
    warnings.append(
        f"inverted tetrahedra (negative volumes): {others} ({int(inverted.sum())} of "
        f"{len(tetrahedra)}); reordered their nodes"
    )
    return np.where(inverted[:, None], tetrahedra[:, [0, 1, 3, 2]], tetrahedra)


def _refuse_wrong_faces(tetrahedra: IntArray, faces: SortedFaces) -> None:
    """Refuse faces of three or more tetrahedra, or of two on the same side."""
    crowded = np.flatnonzero(faces.counts > 2)
    if crowded.size:
        start = faces.starts[crowded[0]]
        halves = faces.halves[start : start + faces.counts[crowded[0]]]
        raise MeshError(
            f"the face {_face(tetrahedra, halves[0])} is shared by {len(halves)} tetrahedra, "
            f"{_ids(np.sort(halves // 4))}; a face has at most two. "
            f"{_count(crowded.size, 'such face')}"
        )
    first, second = faces.halves[faces.starts[faces.counts == 2][:, None] + [0, 1]].T
    overlapping = np.flatnonzero(_is_even(tetrahedra, first) == _is_even(tetrahedra, second))
    if overlapping.size:
        a, b = first[overlapping[0]], second[overlapping[0]]
        raise MeshError(
            f"tetrahedra {a // 4} and {b // 4} overlap: both lie on the same side of their common "
            f"face {_face(tetrahedra, a)}. {_count(overlapping.size, 'such pair')}. The body is "
            "folded over itself there, or a node is in the wrong place"
        )


def crowding_of(tetrahedra: IntArray) -> str | None:
    """Return what is wrong where more than `LARGEST_STAR` tetrahedra share a node; None: nothing.

    `tetrahedra`: shape (n_tets, 4).
    """
    counts = np.bincount(tetrahedra.ravel())
    if counts.max() <= LARGEST_STAR:
        return None
    return (
        f"node {counts.argmax()} has {counts.max()} tetrahedra around it; there may be "
        f"{LARGEST_STAR}. Mesh the body again: ordinary meshes have 60 at most"
    )


def _face(tetrahedra: IntArray, half: int) -> list[int]:
    """Return the nodes of a face in order."""
    return sorted(tetrahedra[half // 4, OUTWARD[half % 4]].tolist())


def _is_even(tetrahedra: IntArray, halves: IntArray) -> BoolArray:
    """Return whether sorting the face's nodes takes an even number of swaps, for each face."""
    a, b, c = np.take_along_axis(tetrahedra[halves // 4], OUTWARD[halves % 4], axis=1).T
    is_even: BoolArray = (a < b) ^ (b < c) ^ (a < c)
    return is_even


def _with_stars_joined(
    tetrahedra: IntArray, pairs: IntArray, n_nodes: int, warnings: list[str]
) -> tuple[IntArray, IntArray]:
    """Split each node whose tetrahedra are not connected through faces at the node.

    Args:
        tetrahedra: Node indices, shape (n_tets, 4).
        pairs: Faces that lie on each other, as 4 * tetrahedron + local face, shape (n_pairs, 2).
        n_nodes: Number of nodes.
        warnings: What was done is appended.

    Returns:
        The tetrahedra, with new nodes from `n_nodes` on, and the node that each new one copies.
    """
    # A corner is a tetrahedron's share of a node, numbered 4 * tetrahedron + local node. Corners
    # of one node are joined where their tetrahedra share a face that holds the node.
    tets, local = np.divmod(pairs, 4)
    corners = 4 * tets[:, :, None] + OUTWARD[local]
    nodes = tetrahedra.ravel()[corners]
    corners = np.take_along_axis(corners, np.argsort(nodes, axis=2), axis=2)
    n_stars, star = components(tetrahedra.size, corners.transpose(0, 2, 1).reshape(-1, 2))
    if n_stars == n_nodes:
        return tetrahedra, np.zeros(0, dtype=np.int64)

    node_of_star = np.empty(n_stars, dtype=np.int64)
    node_of_star[star] = tetrahedra.ravel()
    _, first = np.unique(node_of_star, return_index=True)  # the first star keeps the node
    new_node = np.full(n_stars, -1)
    new_node[first] = node_of_star[first]
    copies = np.flatnonzero(new_node < 0)
    new_node[copies] = n_nodes + np.arange(len(copies))
    copied = node_of_star[copies]
    split = np.unique(copied)
    warnings.append(
        f"split {_count(split.size, 'node')} ({_ids(split)}) where tetrahedra meet in an edge or a "
        "node but share no face"
    )
    return new_node[star].reshape(tetrahedra.shape), copied


def _count_pieces(n_tets: int, neighbours: IntArray, warnings: list[str]) -> None:
    """Warn of a body in several pieces."""
    n_pieces, piece = components(n_tets, neighbours)
    if n_pieces > 1:
        sizes = np.sort(np.bincount(piece))[::-1]
        warnings.append(
            f"the body is in {n_pieces} pieces that share no face, of {_ids(sizes)} tetrahedra"
        )


def _tetrahedra(tets: IntArray) -> str:
    """Name tetrahedra as the subject of "have"."""
    return _some("tetrahedron", tets)


def _some(noun: str, ids: IntArray) -> str:
    """Name elements as the subject of a sentence, with its verb."""
    if len(ids) == 1:
        return f"{noun} {ids[0]} has"
    plural = "tetrahedra" if noun == "tetrahedron" else f"{noun}s"
    return f"{len(ids)} {plural} ({_ids(ids)}) have"


def _count(n: int, noun: str) -> str:
    """Write a number of things."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def _ids(ids: IntArray | Sequence[int]) -> str:
    """List the first few numbers."""
    return ", ".join(str(i) for i in ids[:N_NAMED]) + (", ..." if len(ids) > N_NAMED else "")
