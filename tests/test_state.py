"""A state that is loaded gives the same bits from there on, as if nothing had happened since."""

import hashlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from tests import bodies, strokes
from tissue import (
    BladeShape,
    BladeSweep,
    Geom,
    Material,
    SolverSettings,
    Tissue,
    TissueState,
)

MESH = bodies.jittered(4, 0)
STROKE = list(strokes.sweeps(strokes.THROUGH["slanted"](MESH)))
MIDDLE = len(STROKE) // 2
N_AFTER = 50
BLADE = BladeShape()
SPRINGS = Material(law="springs", poisson_ratio=0.25)


def nothing(tissue: Tissue) -> None:
    """Hold nothing."""


class Case(NamedTuple):
    """A body, and what acts on it."""

    solver: SolverSettings = SolverSettings(audit=True)
    material: Material = Material()
    floor: float | None = None
    blade: BladeShape | None = BLADE
    drive: Callable[[Tissue], None] = nothing

    def make(self) -> Tissue:
        tissue = Tissue(
            MESH,
            self.material,
            fixed=bodies.sides(MESH),
            floor=self.floor,
            blade=self.blade,
            solver=self.solver,
        )
        self.drive(tissue)
        return tissue


def hold(tissue: Tissue) -> None:
    """Push it, pull it by an attachment, and tie it by strands that the blade meets."""
    tissue.push([MESH.positions.mean(axis=0)], (0.0, 0.0, 0.05))
    high = MESH.positions[:, 2].max()
    nodes = np.flatnonzero(MESH.positions[:, 2] > high - 1e-6)[:6]
    grip = tissue.attach(nodes, stiffness=50.0, damping=0.1)
    grip.move(MESH.positions[nodes].mean(axis=0) + np.array([0.0, 0.0, 1e-3]))
    tissue.tie(nodes, MESH.positions[nodes].mean(axis=0) + [0.0, 0.0, 0.02], stiffness=10.0,
               area=1e-6, toughness=100.0)  # fmt: skip


def touch(tissue: Tissue) -> None:
    """Press a ball on it from above."""
    top = MESH.positions.max(axis=0)
    middle = np.array([*MESH.positions.mean(axis=0)[:2], top[2] + 0.0101])
    tissue.collide_with([Geom("ball", "sphere", (0.01,), 0.3)], [middle]).move(
        [middle - [0.0, 0.0, 5e-4]]
    )


def shift(tissue: Tissue) -> None:
    """Move its supports."""
    tissue.move_supports(np.flatnonzero(bodies.sides(MESH)), (0.0, 0.0, 5e-3))


CASES = {
    "global": Case(),
    "global in stages": Case(SolverSettings(relaxation="global"), SPRINGS),
    "single precision": Case(SolverSettings(precision="single")),
    "two threads": Case(SolverSettings(threads=2)),
    "verlet": Case(SolverSettings(relaxation="verlet", audit=True)),
    "hierarchical": Case(SolverSettings(relaxation="hierarchical"), SPRINGS),
    "impulses": Case(SolverSettings(contact="impulses")),
    "floor": Case(floor=float(MESH.positions[:, 2].min())),
    "springs": Case(material=SPRINGS),
    "stiffening": Case(material=Material(law="exponential", stiffening=5.0)),
    "prony": Case(material=Material(prony=((0.3, 0.02), (0.2, 0.1)))),
    "paper": Case(SolverSettings(scheme="paper", relaxation="hierarchical"), SPRINGS, blade=None),
    "line": Case(blade=None),
    "held": Case(drive=hold),
    "touched": Case(drive=touch),
    "moved": Case(drive=shift),
}


def step(tissue: Tissue, sweeps: list[BladeSweep]) -> str:
    """Do some frames; return a hash of all that can be seen of the body and of each frame."""
    digest = hashlib.sha256()
    for sweep in sweeps:
        result = tissue.step(sweep, strokes.DT)
        digest.update(np.concatenate([*result.wrench, result.force_on_tissue]).tobytes())
        seen = (result.cut_area, result.work_of_blade, result.work_of_cutting, result.n_substeps)
        digest.update(repr((seen, result.energies)).encode())
        digest.update(b"".join(np.ascontiguousarray(each).tobytes() for each in result.contacts))
    for array in (*tissue.snapshot(), *tissue.surface(), tissue.support_forces()):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr([each.wrench.numbers for each in tissue.attachments]).encode())
    return digest.hexdigest()


AFTER = STROKE[MIDDLE : MIDDLE + N_AFTER]


def in_mid_cut(case: Case) -> Tissue:
    tissue = case.make()
    result = [tissue.step(sweep, strokes.DT) for sweep in STROKE[:MIDDLE]][-1]
    assert result.cut_area > 0.0
    return tissue


@pytest.mark.parametrize("name", CASES)
def test_what_follows_a_state_is_the_same_each_time_that_it_is_loaded(name):
    tissue = in_mid_cut(CASES[name])
    state, n = tissue.save_state(), tissue.n_tetrahedra
    expected = step(tissue, AFTER)
    assert tissue.n_tetrahedra > n  # the mesh has changed since
    for _ in range(2):
        tissue.load_state(state)
        assert tissue.n_tetrahedra == n
        assert step(tissue, AFTER) == expected


@pytest.mark.parametrize("name", CASES)
def test_a_tissue_made_alike_goes_on_from_the_bytes_of_a_state(name):
    tissue = in_mid_cut(CASES[name])
    data = tissue.save_state().to_bytes()
    expected = step(tissue, AFTER)
    other = CASES[name].make()
    for _ in range(2):
        other.load_state(TissueState.from_bytes(data))
        assert step(other, AFTER) == expected
