"""Names and rows of the tables of a recorded run: VTKHDF of changing topology, and our own beside.

In the group `VTKHDF` are the body and its fields as VTK reads them. Of each array there is one
table of all its rows, and one, with a row a step, of where the rows of that step begin. An array
that did not change is not written again: the steps share it, and so with the mesh.

In the group `scalpel_sim` are the surface that pages draw, the poses of the arm, the forces, the
rows of `forces.csv`, and the scene; VTK passes over it.
"""

from typing import NamedTuple

from scalpel_sim.saved_run.preallocated_file import STEP_TIMES, STEPS, GrowingTable
from tissue import Energies

VTK = "VTKHDF"
OWN = "scalpel_sim"

FORM = 1
"""Version of the group `scalpel_sim`; it rises where an old reader would read something wrong."""

VERSION = (2, 0)
"""Version of VTKHDF: the first that has steps."""

VTKHDF_SUFFIX = ".vtkhdf"
"""Ending of the name, by which ParaView knows the format."""

COUNTS = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
"""Tables with a row for each mesh: sizes of it."""

POSITIONS, CONNECTIVITY, OFFSETS, TYPES = (
    f"{VTK}/{name}" for name in ("Points", "Connectivity", "Offsets", "Types")
)
"""Positions of nodes [m]; nodes of all cells; where those of each begin; types of cells."""

PART_OFFSETS, N_PARTS, POINT_OFFSETS, CELL_OFFSETS, CONNECTIVITY_OFFSETS = (
    f"{STEPS}/{name}"
    for name in (
        "PartOffsets",
        "NumberOfParts",
        "PointOffsets",
        "CellOffsets",
        "ConnectivityIdOffsets",
    )
)
"""Of each step: which mesh it has, how many parts (one), and where positions, cells and the nodes
of the cells begin."""


class Field(NamedTuple):
    """A quantity of nodes or of tetrahedra."""

    name: str
    """Its name."""
    kind: str
    """Type of its numbers."""
    width: tuple[int, ...] = ()
    """Shape of one value."""


POINT_FIELDS = (
    Field("velocity", "f4", (3,)),
    Field("cut_age", "f4"),
    Field("rest_position", "f4", (3,)),
    Field("mass", "f4"),
    Field("fixed", "u1"),
)
"""Quantities of nodes: velocity [m/s]; time since the node is on a face of a cut [s], NaN where
it is on none; position in the body at rest [m]; mass [kg]; whether it is held, 0 or 1."""

CELL_FIELDS = (
    Field("stress", "f4", (9,)),
    Field("strain", "f4", (6,)),
    Field("von_mises", "f4"),
    Field("label", "i8"),
    Field("piece", "i8"),
)
"""Quantities of tetrahedra: Cauchy stress [Pa], row by row; Green-Lagrange strain, which is
symmetric, as xx, yy, zz, xy, yz, xz; equivalent stress of von Mises [Pa]; label; connected piece, 0
for the largest."""


def field_table(where: str, name: str) -> str:
    """Return the table of a field; `where` is `PointData` or `CellData`."""
    return f"{VTK}/{where}/{name}"


def field_offsets(where: str, name: str) -> str:
    """Return the table of where a field of a step begins."""
    return f"{STEPS}/{where}Offsets/{name}"


SURFACE_FIELDS = (
    Field("surface/positions", "f4", (3,)),
    Field("surface/rest_positions", "f4", (3,)),
    Field("surface/strain", "f4"),
    Field("surface/stress", "f4"),
    Field("surface/triangles", "i4", (3,)),
    Field("surface/is_cut", "u1"),
    Field("surface/labels", "i8"),
    Field("first_cut", "f8"),
)
"""The surface that pages draw: positions of its vertices, now and at rest [m], what
`Tissue.surface_values` has at them; triangles, whether each is a face of a cut, and its label (none
of a body with one). Then since when each node is on a face of a cut [s]; NaN: it is on none."""

CONTACTS = Field("contacts", "f8", (6,))
"""Points at which the tissue acts on the blade [m] and the forces on it there [N], world frame."""


def step_fields(n_bodies: int, n_graspers: int, n_cameras: int) -> tuple[Field, ...]:
    """Return what each step has besides the body: see `docs/recordings.md`.

    Args:
        n_bodies: Bodies of the arm's model.
        n_graspers: Graspers.
        n_cameras: Cameras of the arm's model.
    """
    return (
        Field("steps/frame", "i8"),
        Field("steps/wrench", "f8", (9,)),
        Field("steps/blade", "f8", (9,)),
        Field("steps/poses", "f8", (n_bodies, 7)),
        Field("steps/cut_area", "f8"),
        Field("steps/force_parts", "f8", (9,)),
        Field("steps/energies", "f8", (len(Energies._fields),)),
        *([Field("steps/grasper_forces", "f8", (n_graspers, 3))] if n_graspers else []),
        *([Field("steps/cameras", "f8", (n_cameras, 7))] if n_cameras else []),
        *(Field(f"steps/{each.name}", "i8", (2,)) for each in (*SURFACE_FIELDS, CONTACTS)),
        Field("steps/rows", "i8"),
    )


ROWS = "rows"
"""Rows of `forces.csv`, one for each frame of the simulation."""

ENDS = f"{OWN}/ends"
"""Of each step the lengths of all tables after it, in the order of the attribute `tables`."""


class Sizes(NamedTuple):
    """Sizes of a run, from which the first capacities of its tables follow."""

    n_steps: int
    """Steps that are expected."""
    n_points: int
    """Nodes at the start."""
    n_cells: int
    """Tetrahedra at the start."""
    n_bodies: int
    """Bodies of the arm's model."""
    n_graspers: int
    """Graspers."""
    n_cameras: int
    """Cameras of the arm's model."""
    n_columns: int
    """Columns of `forces.csv`."""
    rows_per_step: int
    """Frames of the simulation between two steps."""


GROWTH = 2
"""Size of a mesh that was cut over its size before, for which there is capacity."""


def tables_of(sizes: Sizes) -> tuple[GrowingTable, ...]:
    """Return the tables of a run, with capacity for what is expected of it."""
    n, points, cells = sizes.n_steps, GROWTH * sizes.n_points, GROWTH * sizes.n_cells
    own = step_fields(sizes.n_bodies, sizes.n_graspers, sizes.n_cameras)
    fields = [("PointData", each, points) for each in POINT_FIELDS]
    fields += [("CellData", each, cells) for each in CELL_FIELDS]
    found = [
        GrowingTable(STEP_TIMES, "f8", (), n),
        *(GrowingTable(each, "i8", (), n) for each in (PART_OFFSETS, N_PARTS, POINT_OFFSETS)),
        *(GrowingTable(each, "i8", (1,), n) for each in (CELL_OFFSETS, CONNECTIVITY_OFFSETS)),
        *(GrowingTable(f"{VTK}/{each}", "i8", (), n) for each in COUNTS),
        GrowingTable(POSITIONS, "f4", (3,), n * points),
        GrowingTable(CONNECTIVITY, "i8", (), n * 4 * cells),
        GrowingTable(OFFSETS, "i8", (), n * (cells + 1)),
        GrowingTable(TYPES, "u1", (), n * cells),
        *(
            GrowingTable(field_table(to, f.name), f.kind, f.width, n * rows)
            for to, f, rows in fields
        ),
        *(GrowingTable(field_offsets(to, f.name), "i8", (), n) for to, f, _ in fields),
        *(
            GrowingTable(f"{OWN}/{f.name}", f.kind, f.width, n * points)
            for f in (*SURFACE_FIELDS, CONTACTS)
        ),
        *(GrowingTable(f"{OWN}/{f.name}", f.kind, f.width, n) for f in own),
        GrowingTable(f"{OWN}/{ROWS}", "f8", (sizes.n_columns,), n * sizes.rows_per_step),
    ]
    return (*found, GrowingTable(ENDS, "i8", (len(found) + 1,), n))
