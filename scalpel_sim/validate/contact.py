"""Contact with rigid geoms: Hertz's sphere on a half-space, and a block on a table that tilts."""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from tissue import FloatArray, Geom, Material, TetrahedralMesh, Tissue, block

_LINES = lines_of("contact")
_DEPTHS = [0.5e-3, 1e-3, 1.5e-3, 2e-3]
"""Depth to which the sphere is pressed [m]."""
_POISSON = (0.3, 0.45)
"""Poisson's ratios of the half-space."""
_COARSE, _FINE = 1.2e-3, 0.8e-3
"""Sizes of cells near the contact [m]."""
_FRICTIONS = (0.2, 0.5, 1.0)
"""Coefficients of friction of the table."""
_BLOCK, _CELLS = (0.04, 0.03, 0.01), (4, 3, 2)
"""Sides of the block [m], flat, so that it presses on the table all over; and its cells."""
_RATE = 3.0
"""Rate at which the table tilts [degrees/s]."""
_HELD, _SLID = 3e-5, 3e-4
"""Way that the foot of the block has slid at most while it holds, and at least when it slips [m].
Some of it slides before the rest: the pressure is largest at its front. From the one to the other
a block that slips takes 0.1 s."""
_DT = 1e-3
"""Time step [s]."""
RADIUS = 0.01
"""Radius of the sphere [m]."""
YOUNG = 20e3
"""Young's modulus [Pa]; the force is proportional to it."""
_REACH = 0.12
"""Reach of the half-space sideways and down, at least [m]: 27 times the radius of the
contact at a depth of 2 mm. Where it is twice as large the force is 0.6 to 1.2 % less."""
_FINE_REACH = 0.0048
"""Distance around the contact within which cells are small [m]: more than its radius at 2 mm, 4.5
mm."""
_GROWTH = 1.4
"""Growth of the cells from there on."""
_FRAMES, _PRESS_DT = 10, 2e-3
"""Time steps in which the sphere goes to the next depth, and their length [s]."""


class Indentation(NamedTuple):
    """A sphere that was pressed in, at several depths."""

    n_tetrahedra: int
    """Size of the mesh."""
    depth: FloatArray
    """Depth of it [m]."""
    force: FloatArray
    """Force on it [N]."""


def hertz_force(depth: float, poisson_ratio: float) -> float:
    """Return the force of a rigid sphere at a depth [m] by Hertz, 4/3 E* sqrt(R) d^1.5 [N]."""
    modulus = YOUNG / (1.0 - poisson_ratio * poisson_ratio)
    return 4.0 / 3.0 * modulus * depth * math.sqrt(RADIUS * depth)


def press_sphere(poisson_ratio: float, cell: float, depths: list[float]) -> Indentation:
    """Press the sphere into a half-space, until it is at rest at each depth.

    Args:
        poisson_ratio: Poisson's ratio.
        cell: Size of cells near the contact [m].
        depths: Depths [m], rising.
    """
    mesh = half_space(cell)
    tissue = Tissue(
        mesh,
        Material(YOUNG, poisson_ratio=poisson_ratio, law="neo_hookean"),
        fixed=mesh.positions[:, 2] == mesh.positions[:, 2].min(),
        gravity=(0.0, 0.0, 0.0),
    )
    ball = tissue.collide_with([Geom("ball", "sphere", (RADIUS,))], [[0.0, 0.0, RADIUS]])
    before, forces = 0.0, []
    for depth in depths:
        for part in np.linspace(before, depth, _FRAMES + 1)[1:]:
            ball.move([[0.0, 0.0, RADIUS - part]])
            tissue.step(None, _PRESS_DT)
        tissue.settle()
        tissue.step(None, _PRESS_DT)
        forces.append(float(ball.wrench(0).force[2]))
        before = depth
    return Indentation(len(mesh.tetrahedra), np.array(depths), np.array(forces))


def half_space(cell: float) -> TetrahedralMesh:
    """Return a cylinder below z = 0 whose cells are small around the origin and grow away from it.

    Rings of six more nodes each as far as cells are small, and of as many as the last beyond; the
    triangles between them go down in layers of prisms, of three tetrahedra each.

    Args:
        cell: Size of cells near the origin [m].
    """
    places = _places(cell)
    most = 6 * round(_FINE_REACH / cell)
    rings = [np.zeros((1, 2))]
    for k, radius in enumerate(places[1:], 1):
        n = min(6 * k, most)
        angle = 2.0 * np.pi * (np.arange(n) + 0.5 * (k % 2)) / n
        rings.append(radius * np.column_stack([np.cos(angle), np.sin(angle)]))
    disc = np.concatenate(rings)
    n_disc = len(disc)
    # The diagonals of neighbouring prisms agree where each runs from the node of lowest number.
    a, b, c = np.sort(Delaunay(disc).simplices, axis=1).T
    prisms = np.stack([a, b, c, c + n_disc, a, b, b + n_disc, c + n_disc,
                       a, a + n_disc, b + n_disc, c + n_disc], axis=1)  # fmt: skip
    n_layers = len(places) - 1
    tetrahedra = np.concatenate([prisms + n_disc * i for i in range(n_layers)]).reshape(-1, 4)
    positions = np.concatenate(
        [np.column_stack([disc, np.full(n_disc, -depth)]) for depth in places]
    )
    sides = positions[tetrahedra[:, 1:]] - positions[tetrahedra[:, :1]]
    is_left_handed = np.linalg.det(sides) < 0.0
    tetrahedra[is_left_handed] = tetrahedra[is_left_handed][:, [1, 0, 2, 3]]
    return TetrahedralMesh(positions, tetrahedra)


def _places(cell: float) -> FloatArray:
    """Return distances from the origin [m], `cell` apart where cells are small, then growing."""
    places, size = [0.0], cell
    while places[-1] < _REACH:
        if len(places) > round(_FINE_REACH / cell):
            size *= _GROWTH
        places.append(places[-1] + size)
    return np.array(places)


class Tilt(NamedTuple):
    """A block on a table that is tilted until it slips."""

    weight: float
    """Force on the table before it is tilted, over the weight of the block."""
    holds: float
    """Angle up to which the block holds [degrees]."""
    slips: float
    """Angle at which it slips [degrees]."""


def tilt_table(friction: float) -> Tilt:
    """Tilt a table with that coefficient of friction until a block that rests on it slips."""
    mesh = block(_CELLS, _BLOCK)
    material = Material(50e3, poisson_ratio=0.45, law="neo_hookean", viscous_damping=20.0)
    tissue = Tissue(mesh, material)
    table = tissue.collide_with([Geom("table", "plane", friction=friction)])
    tissue.settle()
    tissue.step(None, _DT)
    weight = -float(table.wrench(0).force[2]) / (9.81 * float(tissue.snapshot().masses.sum()))
    foot = tissue.material_points(np.flatnonzero(mesh.positions[:, 2] == 0.0))
    begin, holds, angle = tissue.positions_of(foot)[:, 0].mean(), 0.0, 0.0
    slid = 0.0
    while slid < _SLID and angle < 90.0:
        if slid < _HELD:
            holds = angle
        angle += _RATE * _DT
        axes = Rotation.from_euler("y", angle, degrees=True).as_matrix()
        table.move([[0.0, 0.0, 0.0]], [axes])
        tissue.step(None, _DT)
        slid = float((tissue.positions_of(foot) @ axes[:, 0]).mean() - begin)
    return Tilt(weight, holds, angle)


def check_hertz(name: str, poisson_ratio: float, found: Indentation) -> list[Check]:
    """Return the checks of a sphere that was pressed in."""
    hertz, rows = _LINES["hertz"], zip(found.depth.tolist(), found.force.tolist(), strict=True)
    return [
        hertz.check(f"{name}, {1e3 * depth:g} mm deep", force / hertz_force(depth, poisson_ratio))
        for depth, force in rows
    ]


def check_tilt(friction: float, found: Tilt) -> list[Check]:
    """Return the checks of a block on a table."""
    angle = math.degrees(math.atan(friction))
    name = f"friction {friction:g}"
    return [
        _LINES["weight"].check(f"{name}, level table", found.weight),
        _LINES["holds"].check(name, found.holds, around=angle),
        _LINES["slips"].check(name, found.slips, around=angle),
    ]


def measure_contact(quick: bool) -> Findings:
    """Press a sphere into half-spaces; put a block on tables and tilt them."""
    checks, curves, notes = [], [], []
    for poisson_ratio in _POISSON[1:] if quick else _POISSON:
        name = f"Poisson's ratio {poisson_ratio:g}"
        found = press_sphere(poisson_ratio, _FINE, _DEPTHS[1:2] if quick else _DEPTHS)
        checks += check_hertz(name, poisson_ratio, found)
        theory = np.array([hertz_force(depth, poisson_ratio) for depth in found.depth])
        curves += [
            Curve(name, 1e3 * found.depth, found.force),
            Curve("", 1e3 * found.depth, theory, is_theory=True),
        ]
    if not quick:
        notes.append(_of_coarse_mesh(found))
    for friction in _FRICTIONS[1:2] if quick else _FRICTIONS:
        checks += check_tilt(friction, tilt_table(friction))
    plot = Plot("A sphere of 10 mm pressed into 20 kPa", "depth [mm]", "force [N]", curves)
    return Findings(checks, [plot], notes)


def _of_coarse_mesh(fine: Indentation) -> str:
    """Return what a coarser mesh gives, as a sentence; `fine` is of the last Poisson's ratio."""
    poisson_ratio = _POISSON[-1]
    coarse = press_sphere(poisson_ratio, _COARSE, _DEPTHS)
    of_theory = [
        force / hertz_force(depth, poisson_ratio)
        for depth, force in zip(coarse.depth.tolist(), coarse.force.tolist(), strict=True)
    ]
    return (
        f"Poisson's ratio {poisson_ratio:g} in a coarser mesh, with cells of {1e3 * _COARSE:g} in "
        f"place of {1e3 * _FINE:g} mm and {coarse.n_tetrahedra:,} in place of "
        f"{fine.n_tetrahedra:,} tetrahedra: {', '.join(f'{each:.3f}' for each in of_theory)} of "
        "Hertz's force"
    )
