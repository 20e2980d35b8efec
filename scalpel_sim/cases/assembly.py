"""The tissue, the loads, the supports and the blade of a case."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from scalpel_sim.cases.case_file import CaseFile
from scalpel_sim.cases.tables import (
    CaseBladeTable,
    LoadTable,
    SupportTable,
)
from scalpel_sim.cases.time_table import TimeTable
from scalpel_sim.errors import UsageError
from scalpel_sim.tables.body import mesh_of
from scalpel_sim.tables.material import material_of
from scalpel_sim.tables.problems import naming_table
from tissue import (
    BladeSegment,
    BladeShape,
    BoolArray,
    FloatArray,
    Load,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    fixed_nodes,
)


class Support:
    """A region of fixed nodes that is held, or moved over time.

    Args:
        table: What the case says of it.
    """

    def __init__(self, table: SupportTable) -> None:
        self.name = table.name
        self.region = table.region
        rows = table.displacement or [(0.0, 0.0, 0.0)]
        self.displacement = TimeTable(table.times, rows, f"[[support]] {table.name}")
        self.moves = bool(self.displacement.rows.any())
        self._nodes: BoolArray = np.zeros(0, dtype=bool)

    def nodes(self, tissue: Tissue) -> BoolArray:
        """Return the mask of its nodes, shape (n_nodes,), those that a cut has added too."""
        if len(self._nodes) != tissue.n_nodes:
            body = tissue.snapshot()
            mesh = TetrahedralMesh(body.rest_positions, body.tetrahedra)
            self._nodes = fixed_nodes(mesh, self.region) & body.fixed
        return self._nodes

    def force(self, tissue: Tissue, forces: FloatArray) -> FloatArray:
        """Return the force of the support on the tissue [N], shape (3,)."""
        return np.asarray(forces[self.nodes(tissue)].sum(axis=0))


class Push(NamedTuple):
    """A load, and its force over time."""

    load: Load
    force: TimeTable


class BladePath:
    """The path of the cutting edge.

    Args:
        table: What the case says of it.
    """

    def __init__(self, table: CaseBladeTable) -> None:
        self._tip = TimeTable(table.times, table.tip, "[blade] tip")
        self._heel = TimeTable(table.times, table.heel, "[blade] heel")
        self._forward = np.array(table.forward)

    def pose(self, time: float) -> BladeSegment:
        """Return the edge at a time [s]."""
        return BladeSegment(self._tip.at(time), self._heel.at(time), self._forward)


class Assembly(NamedTuple):
    """All that takes part in a case."""

    tissue: Tissue
    supports: dict[str, Support]
    pushes: list[Push]
    blade: BladePath | None


def assemble(case: CaseFile) -> Assembly:
    """Return the tissue of a case at rest, with its supports, loads and blade.

    Raises:
        MeshError: the mesh cannot be read or used.
        UsageError: a region holds no node, or numbers make no sense together.
    """
    content = case.content
    mesh = naming_table("[body]", lambda: mesh_of(content.body, case.path.parent))
    supports = {table.name: Support(table) for table in content.support}
    tissue = Tissue(
        mesh,
        naming_table("[material]", lambda: material_of(content.material)),
        fixed=_fixed(mesh, list(supports.values())),
        gravity=content.run.gravity,
        blade=None if content.blade is None else _blade_shape(content.blade),
        solver=SolverSettings(relaxation=content.run.relaxation, audit=True),
    )
    pushes = [_push(tissue, table) for table in content.load]
    blade = None if content.blade is None else BladePath(content.blade)
    return Assembly(tissue, supports, pushes, blade)


def _fixed(mesh: TetrahedralMesh, supports: Sequence[Support]) -> BoolArray:
    """Return the nodes of all supports; refuse a node of two."""
    owner = np.full(len(mesh.positions), -1)
    for i, support in enumerate(supports):
        where = f"[[support]] {support.name}"
        nodes = naming_table(where, partial(fixed_nodes, mesh, support.region))
        if not nodes.any():
            raise UsageError(f"{where}: its region '{support.region}' holds no node")
        shared = nodes & (owner >= 0)
        if shared.any():
            other = supports[int(owner[shared][0])].name
            raise UsageError(
                f"{where} shares {shared.sum()} nodes with [[support]] {other}; their regions must "
                "not overlap"
            )
        owner[nodes] = i
    return np.asarray(owner >= 0)


def _push(tissue: Tissue, table: LoadTable) -> Push:
    """Return a load of a case, which acts from now on."""
    where = f"[[load]] {table.name}"
    force = TimeTable(table.times, table.force, where)
    place = table.region if table.region is not None else np.array(table.points, dtype=np.float64)
    load = naming_table(where, lambda: tissue.push(place, force.at(0.0)))
    return Push(load, force)


def _blade_shape(table: CaseBladeTable) -> BladeShape | None:
    """Return the shape of the blade; None for a line."""
    given = {
        "thickness": table.thickness,
        "bevel_angle": None if table.bevel_degrees is None else np.radians(table.bevel_degrees),
        "height": table.height,
        "edge_radius": table.edge_radius,
    }
    numbers = {key: float(value) for key, value in given.items() if value is not None}
    if not numbers.get("thickness"):
        if len(numbers) > ("thickness" in numbers):
            raise UsageError("[blade] has a shape and no thickness; a blade without one is a line")
        return None
    return naming_table("[blade]", lambda: BladeShape(**numbers))
