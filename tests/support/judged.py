"""Cuts of a moving, deformed body, with every invariant checked after each of them."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from tests.support import incisions, soundness, strokes
from tests.support.incisions import Incision
from tissue import FloatArray, Snapshot, TetrahedralMesh, Tissue
from tissue.body_view import snapshot_of
from tissue.stepping.stages import StepStages


class _WatchedStages(StepStages):
    """Stages that record how much their cuts change the momentum."""

    momentum_jump = 0.0
    n_watched = 0
    after_cut: Callable[[], None]
    """Called after each cut step."""

    def _before_cut(self) -> None:
        self._before = snapshot_of(self.model.body)
        super()._before_cut()

    def _after_cut(self) -> None:
        super()._after_cut()
        before = self._before
        self.n_watched += 1
        scale = float(before.masses @ np.linalg.norm(before.velocities, axis=1))
        if scale > 0.0:
            jump = soundness.momentum(snapshot_of(self.model.body)) - soundness.momentum(before)
            self.momentum_jump = max(self.momentum_jump, float(np.abs(jump).max()) / scale)
        self.after_cut()


class WatchedTissue(Tissue):
    """A tissue that records how much its cuts change the momentum.

    Forces act only between cuts, so a cut itself must not change the momentum.
    """

    _stages: _WatchedStages

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._stages.__class__ = _WatchedStages
        self._stages.after_cut = self.after_cut

    def after_cut(self) -> None:
        """Do nothing after a cut step; a class of a test inspects the body."""

    @property
    def momentum_jump(self) -> float:
        """Largest change in any cut step, relative to the sum of mass times speed."""
        return self._stages.momentum_jump

    @property
    def n_watched(self) -> int:
        """Number of cut steps so far."""
        return self._stages.n_watched


class Verdict(NamedTuple):
    """State of the body after the cuts."""

    faults: list[str]
    n_pieces: int
    growth: float
    """Number of tetrahedra after the cuts over that before."""
    volume: float
    """Relative change of the volume."""
    mass: float
    """Relative change of the mass."""
    momentum: float
    """Largest relative jump of the momentum in a cut step."""


def out_of_shape(mesh: TetrahedralMesh, seed: int) -> FloatArray:
    """Return positions of the body sheared, stretched and bent by about 10 % [m]."""
    random = np.random.default_rng(seed)
    middle = mesh.positions.mean(axis=0)
    x = mesh.positions - middle
    bent = x @ (np.eye(3) + random.uniform(-0.1, 0.1, (3, 3))).T
    waves = 2.0 * np.pi * random.uniform(0.5, 1.0, 3) / np.ptp(mesh.positions, axis=0).max()
    return (
        middle + bent + 0.05 * np.sin(x @ waves)[:, None] * np.abs(x).max() * random.normal(size=3)
    )


def set_random_velocities(tissue: Tissue, seed: int) -> None:
    """Give every free node a random velocity of about 0.1 m/s."""
    n = tissue.n_nodes
    velocities = 0.1 * np.random.default_rng(seed).normal(size=(n, 3))
    tissue._body.velocities[:n] = np.where(tissue._body.fixed[:n, None], 0.0, velocities)


def judge(before: Snapshot, tissue: WatchedTissue, lips_match: bool) -> Verdict:
    """Check every invariant of the cut body."""
    after = tissue.snapshot()
    found = soundness.faults(before, after, volume=1e-12, mass=1e-12, lips_match=lips_match)
    found += soundness.link_faults(tissue._body)
    if tissue.n_watched == 0 and tissue.cut_report().n_cut_nodes > 0:
        found.append("no cut step was watched")
    if tissue.momentum_jump > 1e-12:
        found.append(f"momentum jumped by {tissue.momentum_jump:.1e}")
    v_before = soundness.volumes(before.rest_positions, before.tetrahedra).sum()
    v_after = soundness.volumes(after.rest_positions, after.tetrahedra).sum()
    return Verdict(
        found,
        soundness.n_pieces(after.tetrahedra),
        len(after.tetrahedra) / len(before.tetrahedra),
        abs(float(v_after / v_before) - 1.0),
        abs(float(after.masses.sum() / before.masses.sum()) - 1.0),
        tissue.momentum_jump,
    )


def incised(mesh: TetrahedralMesh, cuts: list[Incision], seed: int = 0, **options) -> Verdict:
    """Cut a moving, deformed body along these surfaces and judge the result."""
    options = {"positions": out_of_shape(mesh, seed), "gravity": (0.0, 0.0, 0.0)} | options
    tissue = WatchedTissue(mesh, **options)
    set_random_velocities(tissue, seed)
    before = tissue.snapshot()
    for cut in cuts:
        tissue.incise(*cut)
    return judge(before, tissue, lips_match=len(cuts) == 1)


def cut_by_blade(mesh: TetrahedralMesh, cuts: list[Incision]) -> Verdict:
    """Cut a body at rest, held on both sides of the first cut, by strokes; judge the result.

    A blade follows each surface against the forces of the tissue, then leaves it for 3 ms.
    """
    sideways = np.cross(cuts[0].forward[0], cuts[0].edges[0, 1] - cuts[0].edges[0, 0])
    across = mesh.positions @ sideways
    share = (across - across.min()) / np.ptp(across)
    tissue = WatchedTissue(mesh, fixed=(share < 0.15) | (share > 0.85), gravity=(0.0, 0.0, 0.0))
    before = tissue.snapshot()
    for cut in cuts:
        strokes.make(tissue, incisions.blade_on(cut, 0.1 * tissue.node_size))
        for _ in range(3):
            tissue.step(None, strokes.DT)
    return judge(before, tissue, lips_match=len(cuts) == 1)
