"""An incision in liver as published, on two meshes: first cut, distance ahead, force, and area."""

import math
from typing import NamedTuple

import numpy as np

from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.runs.run import REST_AFTER_STROKE
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.asked import asked_area, tetrahedra_at
from scalpel_sim.strokes.kinds.incision import DEPTH, SLOPE
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from tissue import FloatArray, Snapshot, TetrahedralMesh, liver_lobe

_LINES = lines_of("incision")
_SCENE = changed(SCENES["incision"], audit=True)
"""The organ on its underside, of liver as published; an arm draws a scalpel along it."""
_TOUGHNESS = _SCENE.material.toughness
"""Toughness of liver [J/m2]."""
_FINER = 0.75
"""Edge of the lattice of the finer mesh, per that of the mesh of the scene: 11,708 tetrahedra for
5,136."""
_FIRST_CUT = 0.01
"""Area that counts as the first cut, as a share of the area planned. From 0.5 to 3 % of it lie 2
mm of travel."""
_STEADY = (0.3, 0.6, 0.9)
"""Shares of the travel: from the first on the cut is steady, and from the first to the second and
from there to the third the blade is as far ahead."""
_FORWARDS = 1e-5
"""Motion of the tip in a frame from which on it counts as drawn [m]: a sixth of its speed."""
_POINTS = 9
"""Points of the edge whose material is looked up."""
_EVERY = 10
"""Frames after which it is looked up."""
_MM_PER_M, _MM2_PER_M2 = 1e3, 1e6


class DrawnIncision(NamedTuple):
    """An incision; a row for each frame in which the tip is drawn."""

    travel: FloatArray
    """Way that the tip has been drawn [m], shape (n,)."""
    force: FloatArray
    """Force of the tissue on the blade, against the motion [N], shape (n,)."""
    ahead: FloatArray
    """Lead of the edge over where its material is at rest [m], shape (n,): of the tissue
    around it, without the stretch of what is nearer than the mesh resolves."""
    paid: FloatArray
    """Area that the blade has paid for since the tip went in: work over toughness [m2], (n,)."""
    opened: FloatArray
    """Area that the mesh has opened so far [m2], shape (n,)."""
    asked: float
    """Area that is planned [m2]."""
    paid_at_end: float
    """Area that the blade has paid for when the blade is out [m2]."""
    opened_at_end: float
    """Area that the mesh has opened by then [m2]."""

    @property
    def first_cut(self) -> float:
        """Travel until the blade has cut `_FIRST_CUT` of the area beyond that of the entry [m]."""
        has_cut = self.paid > _FIRST_CUT * self.asked
        return float(self.travel[np.argmax(has_cut)]) if has_cut.any() else math.inf

    def mean(self, of: FloatArray, begin: float, end: float) -> float:
        """Return the mean of a column between two shares of the travel."""
        share = self.travel / self.travel[-1]
        return float(np.nanmean(of[(share >= begin) & (share < end)]))

    @property
    def steady_force(self) -> float:
        """Mean force of the steady cut [N]."""
        return self.mean(self.force, _STEADY[0], _STEADY[-1])

    @property
    def steady_ahead(self) -> float:
        """Mean distance by which the blade is ahead in the steady cut [m]."""
        return self.mean(self.ahead, _STEADY[0], _STEADY[-1])


def rest_of(points: FloatArray, body: Snapshot) -> FloatArray:
    """Return where material is at rest [m], shape (n, 3); not a number where there is none.

    Args:
        points: Points of the body as it is [m], shape (n, 3).
        body: The body.
    """
    holders, weights = tetrahedra_at(points, body)
    rest = body.rest_positions[body.tetrahedra[holders]]
    found: FloatArray = np.einsum("nk,nkx->nx", weights, rest)
    found[holders < 0] = np.nan
    return found


def draw_incision(mesh: TetrahedralMesh) -> DrawnIncision:
    """Draw the incision of the scene in an organ of that mesh."""
    simulation = prepare(changed(_SCENE, mesh=lambda: mesh))
    asked = asked_area(simulation.stroke, simulation.link.snapshot())
    assert asked is not None
    ahead: list[float] = []
    shares = np.linspace(0.0, 1.0, _POINTS)[:, None]

    def observe(now: Simulation) -> None:
        if len(ahead) % _EVERY:
            ahead.append(np.nan)
            return
        tip, heel = now.frame.points_to_tissue(np.array(now.arm.blade.segment()[:2]))
        along = (heel - tip) / np.linalg.norm(heel - tip)
        edge = tip + shares * DEPTH / math.sin(SLOPE) * along
        distances = (edge - rest_of(edge, now.link.snapshot()))[:, 0]
        is_held = np.isfinite(distances)
        ahead.append(float(np.median(distances[is_held])) if is_held.any() else np.nan)

    simulation.pictures.append(observe)
    simulation.run(simulation.stroke.duration + REST_AFTER_STROKE)
    recording = simulation.recording
    x = recording.vector("tip")[:, 0]
    paid, opened = recording.column("cutting_j") / _TOUGHNESS, recording.column("cut_area_m2")
    forwards = np.flatnonzero(np.diff(x) > _FORWARDS)
    drawn = slice(forwards[0], forwards[-1] + 1)
    return DrawnIncision(
        travel=x[drawn] - x[drawn.start],
        force=-recording.vector("tissue_force")[drawn, 0],
        ahead=np.array(ahead)[drawn],
        paid=paid[drawn] - paid[drawn.start],
        opened=opened[drawn].copy(),
        asked=asked,
        paid_at_end=float(paid[-1]),
        opened_at_end=float(opened[-1]),
    )


def check_incision(name: str, found: DrawnIncision) -> list[Check]:
    """Return the checks of an incision; `name` is that of its mesh."""
    begin, middle, end = _STEADY
    early, late = (found.mean(found.ahead, *r) for r in ((begin, middle), (middle, end)))
    force = found.steady_force / (_TOUGHNESS * DEPTH)
    return [
        _LINES["first_cut"].check(name, found.first_cut * _MM_PER_M),
        _LINES["ahead"].check(name, late / early),
        _LINES["force"].check(name, force),
        _LINES["paid"].check(name, found.paid_at_end / found.opened_at_end),
        _LINES["opened"].check(name, found.opened_at_end / found.asked),
    ]


def check_meshes(coarse: DrawnIncision, fine: DrawnIncision) -> list[Check]:
    """Return the checks that two meshes give the same."""
    pairs = {
        "travel to the first cut": (fine.first_cut, coarse.first_cut),
        "blade ahead of its material": (fine.steady_ahead, coarse.steady_ahead),
        "drawn force": (fine.steady_force, coarse.steady_force),
    }
    return [_LINES["meshes"].check(name, a / b - 1.0) for name, (a, b) in pairs.items()]


def measure_incision(quick: bool) -> Findings:
    """Draw the incision in one mesh or two."""
    spacings = (1.0,) if quick else (1.0, _FINER)
    checks, found = [], []
    forces, areas = [], []
    for spacing in spacings:
        mesh = liver_lobe(spacing)
        incision = draw_incision(mesh)
        name = f"{len(mesh.tetrahedra):,} tetrahedra"
        checks += check_incision(name, incision)
        found.append(incision)
        travel = incision.travel * _MM_PER_M
        forces.append(Curve(name, travel, incision.force))
        for what, area in (("paid for", incision.paid), ("opened", incision.opened)):
            areas.append(Curve(f"{what}, {name}", travel, area * _MM2_PER_M2))
    if not quick:
        checks += check_meshes(*found)
    x = "travel of the tip [mm]"
    ends = found[0].travel[[0, -1]] * _MM_PER_M
    forces.append(Curve("toughness × depth", ends, np.full(2, _TOUGHNESS * DEPTH), is_theory=True))
    plots = [
        Plot("Drawn force of an incision in liver", x, "force [N]", forces),
        Plot("Area of the incision", x, "area [mm²]", areas),
    ]
    ahead = " and ".join(f"{each.steady_ahead * _MM_PER_M:.1f}" for each in found)
    return Findings(checks, plots, [f"The blade is {ahead} mm ahead of its material"])
