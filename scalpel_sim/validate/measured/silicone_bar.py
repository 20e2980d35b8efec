"""A clamped bar of silicone: how far it sags, and how it swings when it is let go.

A weight at the tip is a point mass on a stiff spring, with its inertia.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scalpel_sim.validate.bar import (
    BAR_DENSITY,
    BAR_LENGTH,
    BAR_STIFFNESS,
    BAR_THICKNESS,
    GRAVITY,
    bar_mesh,
)
from scalpel_sim.validate.clamped_solid import clamped_solid
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from tissue import FloatArray, Material, SolverSettings, TetrahedralMesh, Tissue, fixed_nodes

_LINES = lines_of("silicone_bar")
_SILICONE = Material(
    263.8e3,
    poisson_ratio=0.49,
    density=1070.0,
    law="neo_hookean",
    viscous_damping=0.0,
    retardation_time=0.0,
)
"""Dragon Skin 10: Young's modulus as its authors fitted it to the take of 1.001 N. Theirs has a
Poisson's ratio of 0.499, at which the sag differs by 0.4 % and the steps are a third as long."""
_ACROSS = 4
"""Cells of the lattice through the thickness; with eight it sags by 0.1 to 0.9 % more."""
_DAMPING_RATIO, _BAND = 0.144, (3.3, 7.7)
"""Damping ratio, from the depth of the first swing without a weight, (10.7 - 6.55) / 6.55 =
exp(-pi zeta / sqrt(1 - zeta^2)), and the frequencies of the three swings [Hz]."""
_THREAD, _THREAD_DAMPING = 5e3, 5.0
"""Stiffness [N/m] and damping [N s/m] of what holds the weight: it gives way by 0.2 mm."""
_DT, _LONGEST = 1e-3, 1.0
"""Step, and longest swing [s]."""
_N_CROSSINGS = 3


class Take(NamedTuple):
    """Measurements under one load."""

    name: str
    """Name of its lines."""
    load: float
    """Weight at the tip's upper edge [N]."""
    rest: float
    """Height of the tip at rest [m]."""
    deepest: float
    """Lowest height of the first swing [m]."""
    interval: float
    """Time between two crossings of the rest position [s]."""


TAKES = (
    Take("alone", 0.0, -6.55e-3, -10.7e-3, 65e-3),
    Take("half", 0.510, -17.07e-3, -25.0e-3, 115e-3),
    Take("one", 1.001, -25.90e-3, -39.5e-3, 150e-3),
)
"""Three of the six takes. The other three rest at -6.47, -17.03 and -25.07 mm."""


class Swing(NamedTuple):
    """The tip of the bar after it was let go from the horizontal."""

    time: FloatArray
    """[s], shape (n,)."""
    height: FloatArray
    """Height of the tip [m], shape (n,)."""

    def interval(self, rest: float) -> float:
        """Return the mean time between crossings of the height at rest [s]; NaN for too few."""
        below = self.height < rest
        at = np.flatnonzero(below[1:] != below[:-1])[:_N_CROSSINGS]
        share = (rest - self.height[at]) / (self.height[at + 1] - self.height[at])
        times = self.time[at] + share * _DT
        if len(times) < _N_CROSSINGS:
            return math.nan
        return float(np.diff(times).mean())


def _edge(mesh: TetrahedralMesh) -> npt.NDArray[np.int64]:
    """Return the numbers of the nodes of the tip's upper edge."""
    away = np.abs(mesh.positions[:, [0, 2]] - (BAR_LENGTH, BAR_THICKNESS)).max(axis=1)
    return np.flatnonzero(away < 1e-9)


_TIP = [(BAR_LENGTH, 0.5 * BAR_THICKNESS, BAR_THICKNESS)]
"""Middle of the tip's upper edge at rest [m]."""


def height_at_rest(load: float, across: int = _ACROSS) -> float:
    """Return the height of the tip at rest under a load [m].

    Args:
        load: Weight at the tip's upper edge [N].
        across: Cells through the thickness.
    """
    mesh = bar_mesh(across)
    tissue = Tissue(
        mesh,
        _SILICONE,
        fixed=fixed_nodes(mesh, "left"),
        gravity=(0.0, 0.0, -GRAVITY),
        solver=SolverSettings(relaxation="verlet"),
    )
    if load:
        tissue.push(_edge(mesh), (0.0, 0.0, -load))
    tissue.settle()
    return float(tissue.positions_of(tissue.material_points(_TIP))[0, 2]) - BAR_THICKNESS


def let_go(load: float, rest: float, across: int = _ACROSS) -> Swing:
    """Release the bar from the horizontal, until it has crossed its rest position three times.

    Args:
        load: Weight at the tip's upper edge [N].
        rest: Height of the tip at rest [m].
        across: Cells through the thickness.
    """
    mesh = bar_mesh(across)
    silicone = _SILICONE.with_damping(_DAMPING_RATIO, *_BAND)
    tissue = Tissue(
        mesh,
        silicone,
        fixed=fixed_nodes(mesh, "left"),
        gravity=(0.0, 0.0, -GRAVITY),
    )
    tip = tissue.material_points(_TIP)
    thread = (
        tissue.attach(_edge(mesh), stiffness=_THREAD, damping=_THREAD_DAMPING) if load else None
    )
    place, velocity = np.array(_TIP[0]), np.zeros(3)
    heights, n_crossings = [0.0], 0
    while n_crossings < _N_CROSSINGS and len(heights) * _DT < _LONGEST:
        if thread is not None:
            force = thread.wrench.force - (0.0, 0.0, load)
            velocity += force * (GRAVITY / load * _DT)
            place += velocity * _DT
            thread.move(place)
        tissue.step(None, _DT)
        heights.append(float(tissue.positions_of(tip)[0, 2]) - BAR_THICKNESS)
        n_crossings += (heights[-1] < rest) != (heights[-2] < rest)
    time: FloatArray = _DT * np.arange(len(heights), dtype=np.float64)
    return Swing(time, np.array(heights))


def check_take(take: Take, rest: float, deepest: float, interval: float) -> list[Check]:
    """Return the checks of one take.

    Args:
        take: What was measured.
        rest: Height of the tip at rest [m].
        deepest: Lowest height of the first swing [m].
        interval: Time between two crossings [s].
    """
    case = f"{take.load:g} N"
    return [
        _LINES[f"sag_{take.name}"].check(case, rest / take.rest),
        _LINES[f"depth_{take.name}"].check(case, deepest / take.deepest),
        _LINES["interval"].check(case, interval / take.interval),
    ]


def check_solid(rest: float) -> Check:
    """Return the check of the sag without a weight against linear elasticity.

    Args:
        rest: Height of the tip at rest [m].
    """
    softer = BAR_STIFFNESS / _SILICONE.young_modulus * _SILICONE.density / BAR_DENSITY
    theory = softer * clamped_solid(_SILICONE.poisson_ratio).sag_of_weight
    return _LINES["solid"].check("0 N", -rest / theory)


def measure_silicone_bar(quick: bool) -> Findings:
    """Measure how the bar sags and swings under each load; the short version takes no weight."""
    checks: list[Check] = []
    curves: list[Curve] = []
    for take in TAKES[:1] if quick else TAKES:
        rest = height_at_rest(take.load)
        found = let_go(take.load, rest)
        checks += check_take(take, rest, float(found.height.min()), found.interval(rest))
        checks += [] if take.load else [check_solid(rest)]
        curves.append(Curve(f"{take.load:g} N", found.time, found.height * 1e3))
        level = np.full(2, take.rest * 1e3)
        curves.append(Curve("", found.time[[0, -1]], level, is_theory=True))
    title = "Dragon Skin 10, let go from the horizontal; dashed: measured at rest"
    return Findings(checks, [Plot(title, "time [s]", "height of the tip [mm]", curves)])
