"""Content of a file of a mesh: the cells that it lists, made into tetrahedra with labels."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.io.cell_division import divided
from tissue.io.cell_types import CellType, expect_volumes
from tissue.mesh.mesh_arrays import MeshError
from tissue.mesh.validation import signed_volumes
from tissue.types import TetrahedralMesh

MOST_UNBOUND_NODES = 3
"""Nodes of a cell that is left out whatever it is: a point, a line or a triangle. One of more could
be a tetrahedron whose type is wrong, unless it is a side of a cell that is not left out."""


MOST_KEYED_NODES = 2_000_000
"""Nodes of which three make one whole number of 64 bits."""


class CellBlock(NamedTuple):
    """Cells of one type, in the order of the file."""

    cell_type: CellType
    nodes: IntArray
    """Nodes of each, corners first, shape (n_cells, n_nodes): indices from 0 on, or tags."""
    ids: IntArray
    """Number of each in the file, shape (n_cells,)."""
    labels: IntArray | None = None
    """Label of each, shape (n_cells,); None: the file gives none."""


class MeshFile(NamedTuple):
    """The content of a file, before it is checked."""

    format: str
    """Format of the file, for people."""
    mesh: TetrahedralMesh
    """Its tetrahedra, those included that its other volumes are divided into."""
    cells: Mapping[str, int]
    """Number of cells of each type that the file lists."""
    remarks: tuple[str, ...]
    """Sentences on what was made of the content, and what was left out."""


def mesh_file(
    file_format: str,
    positions: FloatArray,
    blocks: Sequence[CellBlock],
    *,
    tags: IntArray | None = None,
    label_names: Mapping[int, str] = MappingProxyType({}),
    remarks: Sequence[str] = (),
) -> MeshFile:
    """Make the tetrahedra of the cells of a file.

    Pyramids, wedges and hexahedra are divided, and cells of higher order are straightened: their
    corners are used. Points, lines, triangles and sides of the cells are left out.

    Args:
        file_format: Name of the format.
        positions: Positions of the nodes, shape (n_nodes, 3).
        blocks: All cells.
        tags: The tag of each node, shape (n_nodes,), by which cells name it; None: its index.
        label_names: Names of labels.
        remarks: What is to be said of the file already.

    Raises:
        MeshError: There are no such cells, or others that cannot be left out; a node has the tag of
            another, or a cell names a node that there is not.
    """
    counts: dict[CellType, int] = {}
    for each in blocks:
        counts[each.cell_type] = counts.get(each.cell_type, 0) + len(each.nodes)
    expect_volumes(counts)
    volumes = [each for each in blocks if each.cell_type.fills]
    others = [each for each in blocks if not each.cell_type.fills]
    if tags is not None:
        places = _Places(tags)
        volumes = [places.of(each) for each in volumes]
        others = [places.where_known(each) for each in others]
    _expect_ignorable(volumes, others, len(positions))
    said = [*remarks, *_straightened(volumes, positions)]
    tetrahedra, labels = _tetrahedra(volumes, positions, said)
    if labels is not None and not label_names and not labels.any():
        labels = None  # 0 alone, without a name, is how writers say that there are no labels
    mesh = TetrahedralMesh(
        positions, tetrahedra, labels, {} if labels is None else _used(label_names, labels)
    )
    cells = {each.name: n for each, n in counts.items() if n}
    return MeshFile(file_format, mesh, cells, tuple(said))


def _used(names: Mapping[int, str], labels: IntArray) -> dict[int, str]:
    """Return the names of those labels that there are."""
    there = set(np.unique(labels).tolist())
    return {label: name for label, name in names.items() if label in there}


class _Places:
    """Indices of nodes by their tags."""

    def __init__(self, tags: IntArray) -> None:
        self._order = np.argsort(tags, kind="stable")
        self._tags = tags[self._order]
        twice = np.flatnonzero(self._tags[1:] == self._tags[:-1])
        if twice.size:
            raise MeshError(f"node {self._tags[twice[0]]} occurs twice")

    def where_known(self, block: CellBlock) -> CellBlock:
        """Return cells with the indices of their nodes, -1 for those that are not there."""
        wanted = block.nodes
        if not len(self._tags):
            return block._replace(nodes=np.full_like(wanted, -1))
        at = np.minimum(np.searchsorted(self._tags, wanted), len(self._tags) - 1)
        return block._replace(nodes=np.where(self._tags[at] == wanted, self._order[at], -1))

    def of(self, block: CellBlock) -> CellBlock:
        """Return cells with the indices of their nodes, all of which must be there."""
        found = self.where_known(block)
        missing = found.nodes < 0
        if missing.any():
            cell = np.argwhere(missing)[0, 0]
            raise MeshError(
                f"index out of range: cell {block.ids[cell]}, one of the {block.cell_type.name}, "
                f"names node {block.nodes[missing][0]}, which is not among the {len(self._tags)} "
                "nodes of the file"
            )
        return found


def _expect_ignorable(
    volumes: Sequence[CellBlock], others: Sequence[CellBlock], n_nodes: int
) -> None:
    """Refuse a cell that is left out unless it is small, or a side of one that is not.

    Raises:
        MeshError: There is one, which may be a tetrahedron of a wrong type.
    """
    for block in others:
        size = block.nodes.shape[1]
        if size <= MOST_UNBOUND_NODES or not len(block.nodes):
            continue
        apart = np.flatnonzero(~_within(block.nodes, volumes, n_nodes))
        if apart.size:
            raise MeshError(
                f"cell {block.ids[apart[0]]}, one of the {block.cell_type.name}, has {size} nodes: "
                "besides tetrahedra there may be points, lines, triangles, and sides of the cells "
                "only. If it is a tetrahedron its type is wrong; if not, leave it out"
            )


def _within(sides: IntArray, volumes: Sequence[CellBlock], n_nodes: int) -> BoolArray:
    """Return whether all nodes of each side are nodes of one larger cell, shape (n_sides,)."""
    found = np.zeros(len(sides), dtype=bool)
    is_named = _in_range(sides, n_nodes)
    of_sides = _incidence(sides[is_named], n_nodes)
    for each in volumes:
        cells = each.nodes[_in_range(each.nodes, n_nodes)]
        if cells.shape[1] <= sides.shape[1] or not (len(cells) and is_named.any()):
            continue
        shared = of_sides @ _incidence(cells, n_nodes).T
        found[is_named] |= shared.max(axis=1).toarray().ravel() == sides.shape[1]
    return found


def _in_range(cells: IntArray, n_nodes: int) -> BoolArray:
    """Return whether all nodes of each cell are among the nodes, shape (n_cells,)."""
    return np.asarray(((cells >= 0) & (cells < n_nodes)).all(axis=1))


def _incidence(cells: IntArray, n_nodes: int) -> csr_array:
    """Return which cell has which node, as a sparse matrix of ones."""
    rows = np.repeat(np.arange(len(cells)), cells.shape[1])
    return csr_array((np.ones(cells.size, np.int8), (rows, cells.ravel())), (len(cells), n_nodes))


def _straightened(volumes: Sequence[CellBlock], positions: FloatArray) -> list[str]:
    """Describe the cells of higher order, and how far off their corners' edges they reach."""
    said = []
    for block in volumes:
        kind, nodes = block.cell_type, block.nodes
        if kind.n_nodes == kind.n_corners:
            continue
        _expect_in_range(block, len(positions))
        text = f"{len(nodes)} {kind.name} straightened: their {kind.n_corners} corners are used"
        if kind.shape == "tetrahedra" and kind.n_nodes == 10:
            first, second = np.triu_indices(4, 1)
            corners = positions[nodes[:, :4]]
            middles = 0.5 * (corners[:, first] + corners[:, second])
            off = np.zeros(len(nodes))
            for k in range(4, 10):
                gaps = np.linalg.norm(positions[nodes[:, k], None] - middles, axis=2)
                off = np.maximum(off, gaps.min(axis=1))
            text += f"; a node between two corners lay up to {off.max():.3g} off their middle"
        said.append(text)
    return said


def _expect_in_range(block: CellBlock, n_nodes: int) -> None:
    """Refuse cells that name nodes by an index that is out of range."""
    wrong = (block.nodes < 0) | (block.nodes >= n_nodes)
    if wrong.any():
        cell = np.argwhere(wrong)[0, 0]
        raise MeshError(
            f"index out of range: cell {block.ids[cell]}, one of the {block.cell_type.name}, names "
            f"node {block.nodes[wrong][0]}; there are {n_nodes} nodes"
        )


def _tetrahedra(
    volumes: Sequence[CellBlock], positions: FloatArray, said: list[str]
) -> tuple[IntArray, IntArray | None]:
    """Return the tetrahedra of all cells and their labels; what was divided is added to `said`."""
    tetrahedra, labels, uncommon = [], [], []
    has_labels = any(each.labels is not None for each in volumes)
    for block in volumes:
        shape, corners = block.cell_type.shape, block.nodes[:, : block.cell_type.n_corners]
        if shape != "tetrahedra":
            _expect_in_range(block, len(positions))
        parts = divided(corners, shape)
        made = parts.tetrahedra
        if shape != "tetrahedra":
            said.append(f"{len(corners)} {shape} divided into {len(made)} tetrahedra")
            with np.errstate(over="ignore", invalid="ignore"):  # refused later
                inverted = signed_volumes(positions, made) < 0.0
            made = np.where(inverted[:, None], made[:, [0, 1, 3, 2]], made)
        if parts.n_collapsed:
            said.append(f"{parts.n_collapsed} of the {shape} have a node twice: taken as collapsed")
        tetrahedra.append(made)
        uncommon.append(parts.uncommon)
        of_cells = np.zeros(len(corners), np.int64) if block.labels is None else block.labels
        labels.append(of_cells[parts.parent])
    whole = np.concatenate(tetrahedra)
    if n_cracks := _n_cracks(np.concatenate(uncommon), whole, len(positions)):
        said.append(
            f"{n_cracks} triangles lie on sides of four corners that are divided the other way: "
            "the body has cracks there"
        )
    return whole, np.concatenate(labels) if has_labels else None


def _n_cracks(uncommon: IntArray, tetrahedra: IntArray, n_nodes: int) -> int:
    """Return how many of the triangles are sides of tetrahedra."""
    if not len(uncommon) or n_nodes > MOST_KEYED_NODES:
        return 0
    sides = tetrahedra[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)
    weights = np.array([n_nodes**2, n_nodes, 1])
    keys = [np.unique(np.sort(each, axis=1) @ weights) for each in (uncommon, sides)]
    return int(np.isin(keys[0], keys[1]).sum())
