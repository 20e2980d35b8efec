"""Which memory of a tissue is state: how far each array is in use, and what is scratch.

What is not named here is state as a whole. What is named saves time: the arrays of an organ take
47 MB, of which some 8 MB are in use.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from tissue.core.memory_blocks import RowsInUse, StructRules
from tissue.core.structs import Arrays

SCRATCH = frozenset(
    {
        # Marks that are compared with the number of the search that left them: both stay.
        "Visits",
        "HashTable",
        # Without lips, which are there within a pass alone, all entries are 0.
        "FlowGraph",
        # Made by each update of the pairs, or search for self-proximity, before it is read.
        "Cells",
        "NodeGrid",
        "EdgeBoxes",
        "EdgeGrid",
        # Tests of one search.
        *(
            f"PairTests.{name}"
            for name in ("pair", "nodes", "is_held", "highest", "deepest", "close")
        ),
        *(f"PairTests.{name}" for name in ("size_of_normal", "path", "wake", "left", "distance")),
        *(f"PairTests.{name}" for name in ("close_nodes", "foot", "push")),
        *(f"NearPairs.{name}" for name in ("is_kept", "found_node", "found_face")),
        *(f"EdgePairs.{name}" for name in ("due", "end", "tip")),
        # Stages of one step of the integrator.
        *(f"Stages.{name}" for name in ("positions", "last_positions", "velocities", "change")),
        *(f"Stages.{name}" for name in ("a1", "a2", "start_positions", "start_velocities")),
        # Evaluations of forces and frequencies.
        *(f"Solid.{name}" for name in ("forces", "ring", "rest_ring", "ring_nodes")),
        *(f"Solid.{name}" for name in ("fast_blocks", "node_gradient", "node_stress")),
        "Solid.gradient_rows",
        "Viscosity",
        "Collapsing.scratch",
        # Searches of one pass of a cut.
        *(f"CutScratch.{name}" for name in ("around", "around_too", "parents", "parent_links")),
        *(f"CutScratch.{name}" for name in ("children", "place")),
    }
)
"""Classes of structs, and arrays of them, that hold nothing from one step to the next."""

_LISTS: Mapping[str, Mapping[str, str]] = {
    "Change": {
        "flagged": "n_flagged",
        "dirty": "n_dirty",
        "faces": "n_faces",
        "children": "n_children",
    },
    "CutScratch": {
        "active": "n_active",
        "segments": "n_active",
        "previous": "n_previous",
        "crossing": "n_crossings",
        "crossing_at": "n_crossings",
        "order": "n_crossings",
    },
    "GeomSearch": {"touched": "n_touched"},
    "FaceList": {"corners": "n", "area": "n", "labels": "n", "cause": "n", "time": "n"},
    "Collapsing": {"listed": "n"},
}
"""Lists with their counts: what is behind their ends means nothing."""

_POOLS: Mapping[str, Mapping[str, Sequence[str]]] = {
    "Springs": {"used": ("neighbour", "stiffness", "rest_pull")},
    "Solid": {"used": ("around", "corner")},
    "TetrahedronGrid": {"n_lines": ("lines",)},
    "Faces": {"n_places": ("face", "node", "generation", "free")},
}
"""Arrays with counts that never fall."""

_OF_NODES = {
    "Body": (
        *("rest", "lattice_rest", "positions", "velocities", "masses", "added_masses", "fixed"),
        *("friction", "drag", "off_path", "node_tetrahedron", "twin"),
    ),
    "Solid": (
        *("first", "room", "count", "node_volume", "weight", "dilatation", "frequency_squared"),
        *("displacement", "shear_frequency_squared", "strained_dilatation", "pressure"),
        *("strained_frequency_squared", "dilatation_test", "frequency_test"),
    ),
    "Springs": ("first", "room", "count", "stiffness_per_mass", "frequency_squared"),
    "CutSurface": ("node_stamp", "offset", "past_offset", "side", "nodes"),
    "Stages": ("external", "loads"),
    "NodeMotion": (
        *("before", "reference", "displacement", "radius", "path", "moved_at", "self_proximity"),
    ),
    "SelfProximity": ("reference", "seen_at", "skin", "sorted", "outward"),
    "NearPairs": (
        *("nodes", "seen_at", "cut_at", "moved_at", "unpaired_at", "is_penetrating", "found_in"),
        *("face_moved_at", "moved", "begin", "end"),
    ),
    "SearchState": (
        *("normal", "inverted_step", "is_due", "resting_until", "n_contacts", "listed_at", "share"),
        *("floor_listed_at", "edge_contact", "edge_contact_at", "recovered"),
    ),
    "GeomSearch": ("near", "near_at", "listed", "normal"),
}
"""Arrays with a row for each node of the body."""

_OF_TETRAHEDRA = {
    "Body": ("tetrahedra", "links", "is_rigid", "material"),
    "Collapsing": ("stiffness", "limit", "per_volume"),
    "CutSurface": ("tetrahedron_stamp", "tetrahedron_side"),
    "Faces": ("place", "piece"),
}
"""Arrays with a row for each tetrahedron."""

_IN_BLOCKS = {"nodes": 4, "shape": 10, "moduli": 9, "relaxed": 7, "gradient": 9}
"""Arrays of `Solid` in blocks of tetrahedra, and how many numbers each has there."""

_BEHIND_A_BLOCK = (
    *("dilated", "growth", "tested_growth", "tested_bound", "inverse_bound", "shear_share"),
    *("strained_bound", "stiffening", "stiffening_slope", "stiffness", "tested_stiffness"),
)
"""Those with one number for each tetrahedron, behind a first block."""

_OF_PLACES = (
    *("triangle", "tetrahedron", "is_of_cut", "is_active", "seen_generation", "dirty_at"),
    *("known_at", "path", "displacement", "low", "high"),
)
"""Arrays of `NearPairs` with a row for each place of its faces."""

_OF_EDGES = (
    *("listed", "is_feature", "is_of_cut", "dirty_at", "path", "node", "tip", "low", "high"),
    "outward",
)
"""Arrays of `FeatureEdges` with three rows for each place."""


def rows_in_use(structs: Sequence[Arrays]) -> Iterator[RowsInUse]:
    """Return what is in use in the structs of a tissue."""
    body = next(each for each in structs if type(each).__name__ == "Body")
    for struct in structs:
        yield from _of_one(struct, body)


def _of_one(struct: Arrays, body: Arrays) -> Iterable[RowsInUse]:
    """Return what is in use in one struct."""
    kind = type(struct).__name__
    for field in _OF_NODES.get(kind, ()):
        yield RowsInUse(struct, field, (body, "n_nodes"))
    for field in _OF_TETRAHEDRA.get(kind, ()):
        yield RowsInUse(struct, field, (body, "n_tetrahedra"))
    for cell, fields in _POOLS.get(kind, {}).items():
        for field in fields:
            yield RowsInUse(struct, field, (struct, cell))
    for field, cell in _LISTS.get(kind, {}).items():
        yield RowsInUse(struct, field, (struct, cell), has_rest=False)
    if kind == "Solid":
        yield from _of_solid(struct, body)
    elif kind == "SearchState":
        yield from _of_search(struct)
    elif kind == "FaceContacts":
        yield RowsInUse(struct, "row_of_face", (body, "n_tetrahedra"), elements=4)


def _of_solid(solid: Any, body: Arrays) -> Iterable[RowsInUse]:
    """Return what is in use of tetrahedra in blocks."""
    n, width = (body, "n_tetrahedra"), 64 // solid.shape.itemsize
    for field, elements in _IN_BLOCKS.items():
        yield RowsInUse(solid, field, n, elements, width)
    yield RowsInUse(solid, "relaxed_terms", n, 7 * solid.n_terms, width)
    if len(solid.node_relaxed):
        nodes, terms = (body, "n_nodes"), 7 * solid.n_terms
        yield RowsInUse(solid, "node_relaxed", nodes, 7, width)
        yield RowsInUse(solid, "node_relaxed_terms", nodes, terms, width)
    for field in _BEHIND_A_BLOCK:
        yield RowsInUse(solid, field, n, 1, width, lead=width)


def _of_search(search: Any) -> Iterable[RowsInUse]:
    """Return what is in use of faces and feature edges, which go by places of faces."""
    n = (search.faces, "n_places")
    for field in _OF_PLACES:
        yield RowsInUse(search.pairs, field, n)
    yield RowsInUse(search.pairs, "face_begin", n, lead=2)
    for field in _OF_EDGES:
        array = getattr(search.edges, field)
        yield RowsInUse(search.edges, field, n, 3 * array[:1].size)
    yield RowsInUse(search.edges, "first_pair", n, 3, lead=2)


STRUCTS = StructRules(SCRATCH, rows_in_use)
"""Parts of the memory of structs that are state."""
