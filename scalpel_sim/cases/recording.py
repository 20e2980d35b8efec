"""Runs a case, and records it: a row for each interval."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scalpel_sim.cases.assembly import Assembly
from scalpel_sim.cases.case_file import TIME, CaseFile
from scalpel_sim.cases.tables import RecordedQuantity, RecordTable
from tissue import BladeSweep, Energies, FloatArray, StepResult

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
    """What was recorded."""

    columns: dict[str, FloatArray]
    """Time [s] and each record, shape (n_rows,), in the order of the file."""
    units: dict[str, str]
    """Unit of each column."""
    energies: Energies
    """The account of energy at the end."""
    n_pieces: int
    """Connected pieces at the end."""


class _Recorder:
    """The rows of a run.

    Args:
        case: What to record.
        assembly: What takes part.
    """

    def __init__(self, case: CaseFile, assembly: Assembly) -> None:
        self._records = case.content.record
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
        """Take note of a step; the force on the blade is averaged over those of a row."""
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


def run_case(
    case: CaseFile, assembly: Assembly, progress: ReachedTime = lambda time: None
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
    run, tissue = case.content.run, assembly.tissue
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
    names = [TIME, *(record.name for record in case.content.record)]
    units = {TIME: "s"} | {r.name: UNITS[r.quantity] for r in case.content.record}
    columns = dict(zip(names, np.array(recorder.rows).T, strict=True))
    assert result.energies is not None
    return CaseRecord(columns, units, result.energies, tissue.n_pieces())


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
