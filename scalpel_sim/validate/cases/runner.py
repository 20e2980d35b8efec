"""Runs a case, and records it: a row for each interval."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.blade import blade_of
from scalpel_sim.scene.case import (
    TIME,
    CaseBladeTable,
    CaseContent,
    LoadTable,
    RecordedQuantity,
    RecordTable,
    SupportTable,
)
from scalpel_sim.scene.materials import material_of, naming_table
from tissue import (
    BladeSegment,
    BladeShape,
    BladeSweep,
    BoolArray,
    Energies,
    FloatArray,
    Load,
    SolverSettings,
    StepResult,
    TetrahedralMesh,
    Tissue,
    fixed_nodes,
)

UNITS: dict[RecordedQuantity, str] = {
    "reaction": "N",
    "displacement": "m",
    "blade_force": "N",
    "blade_position": "m",
    "cut_area": "m2",
}
"""Unit of each quantity."""

_AXES = "xyz"

ReachedTime = Callable[[float], None]
"""Receives the time that a run has reached [s]."""


class CaseRecord(NamedTuple):
    """Records of the case."""

    columns: dict[str, FloatArray]
    """Time [s] and each record, shape (n_rows,), in the order of the file."""
    units: dict[str, str]
    """Unit of each column."""
    energies: Energies
    """The account of energy at the end."""
    n_pieces: int
    """Connected pieces at the end."""


class TimeTable:
    """Vectors at given times; before the first and after the last they stay as they are.

    Args:
        times: [s], ascending, shape (n,); None for one row that holds at all times.
        rows: A vector for each time, shape (n, 3).
        where: What the table belongs to, for messages.

    Raises:
        UsageError: the lengths differ, or times do not ascend.
    """

    def __init__(
        self, times: Sequence[float] | None, rows: Sequence[Sequence[float]], where: str
    ) -> None:
        self.rows: FloatArray = np.array(rows, dtype=np.float64)
        self.times: FloatArray = np.array([0.0] if times is None else times, dtype=np.float64)
        if len(self.times) != len(self.rows):
            raise UsageError(
                f"{where}: {len(self.rows)} rows and {len(self.times)} times; each row needs a time"
            )
        if not (np.diff(self.times) > 0.0).all():
            raise UsageError(f"{where}: times are {self.times.tolist()}; they must ascend")

    def at(self, time: float) -> FloatArray:
        """Return the vector at a time [s], shape (3,)."""
        return np.array([np.interp(time, self.times, column) for column in self.rows.T])


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


def assemble(case: CaseContent) -> Assembly:
    """Return the tissue of a case at rest, with its supports, loads and blade.

    Raises:
        MeshError: the mesh cannot be read or used.
        UsageError: a region holds no node, or numbers make no sense together.
    """
    mesh = naming_table("[body]", case.body.mesh)
    supports = {table.name: Support(table) for table in case.support}
    tissue = Tissue(
        mesh,
        naming_table("[material]", lambda: material_of(case.material)),
        fixed=_fixed(mesh, list(supports.values())),
        gravity=case.run.gravity,
        blade=None if case.blade is None else _blade_shape(case.blade),
        solver=SolverSettings(relaxation=case.run.relaxation, audit=True),
    )
    pushes = [_push(tissue, table) for table in case.load]
    blade = None if case.blade is None else BladePath(case.blade)
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
    if not table.thickness:
        if any(getattr(table, key) for key in ("bevel_degrees", "height", "edge_radius")):
            raise UsageError("[blade] has a shape and no thickness; a blade without one is a line")
        return None
    return naming_table("[blade]", lambda: blade_of(table))


def run_case(
    case: CaseContent, assembly: Assembly, progress: ReachedTime = lambda time: None
) -> CaseRecord:
    """Run a case from rest to its end.

    Args:
        case: What happens, and what to record.
        assembly: What takes part, at rest.
        progress: Called after each row.

    Raises:
        TissueError: the motion became unstable.
        UsageError: a point to record is outside the body.
    """
    run, tissue = case.run, assembly.tissue
    recorder = _Recorder(case, assembly)
    if run.settle:
        tissue.settle()
    recorder.add_row(0.0, None)
    n_steps, every = round(run.seconds / run.dt), round(run.record_every / run.dt)
    for i in range(n_steps):
        result = _step(assembly, i * run.dt, run.dt)
        recorder.note(result)
        if (i + 1) % every == 0:
            recorder.add_row((i + 1) * run.dt, result)
            progress((i + 1) * run.dt)
    names = [TIME, *(record.name for record in case.record)]
    units = {TIME: "s"} | {r.name: UNITS[r.quantity] for r in case.record}
    columns = dict(zip(names, np.array(recorder.rows).T, strict=True))
    assert result.energies is not None
    return CaseRecord(columns, units, result.energies, tissue.n_pieces())


class _Recorder:
    """The rows of a run.

    Args:
        case: What to record.
        assembly: What takes part.
    """

    def __init__(self, case: CaseContent, assembly: Assembly) -> None:
        self._records = case.record
        self._assembly = assembly
        self._points = {
            record.name: assembly.tissue.material_points(_point(record))
            for record in self._records
            if record.point is not None
        }
        self._needs_forces = any(record.support for record in self._records)
        self._blade_forces: list[FloatArray] = []
        self.rows: list[list[float]] = []

    def note(self, result: StepResult) -> None:
        """Record a step; the force on the blade is averaged over those of a row."""
        self._blade_forces.append(result.wrench.force.copy())

    def add_row(self, time: float, result: StepResult | None) -> None:
        """Record the state at a time [s]; `result` is that of the last step."""
        tissue = self._assembly.tissue
        forces = tissue.support_forces() if self._needs_forces else np.zeros((0, 3))
        row = [time]
        for record in self._records:
            row.append(_component(self._vector(record, time, forces, result), record.component))
        self._blade_forces.clear()
        self.rows.append(row)

    def _vector(
        self, record: RecordTable, time: float, forces: FloatArray, result: StepResult | None
    ) -> FloatArray:
        """Return the quantity of a record, shape (3,)."""
        tissue, supports, _, blade = self._assembly
        if record.quantity == "reaction":
            assert record.support is not None
            return supports[record.support].force(tissue, forces)
        if record.quantity == "displacement":
            points = self._points[record.name]
            return np.asarray((tissue.positions_of(points) - points.rest)[0])
        if record.quantity == "blade_position":
            assert blade is not None
            return blade.pose(time).tip
        if record.quantity == "cut_area":
            return np.array([0.0 if result is None else result.cut_area, 0.0, 0.0])
        if not self._blade_forces:
            return np.zeros(3)
        return np.asarray(np.mean(self._blade_forces, axis=0))


def _step(assembly: Assembly, time: float, dt: float) -> StepResult:
    """Advance a case by a step of `dt` [s] from a time [s]."""
    tissue, supports, pushes, blade = assembly
    for support in supports.values():
        if support.moves:
            moved = support.displacement.at(time + dt) - support.displacement.at(time)
            tissue.move_supports(support.nodes(tissue), moved / dt)
    for push in pushes:
        push.load.force = push.force.at(time + 0.5 * dt)
    sweep = None if blade is None else BladeSweep(blade.pose(time), blade.pose(time + dt))
    return tissue.step(sweep, dt)


def _point(record: RecordTable) -> FloatArray:
    """Return the point of a record [m], shape (3,)."""
    return np.array(record.point, dtype=np.float64)


def _component(vector: FloatArray, component: str) -> float:
    """Return a component of a vector, or its magnitude."""
    if component == "magnitude":
        return float(np.linalg.norm(vector))
    return float(vector[_AXES.index(component)])
