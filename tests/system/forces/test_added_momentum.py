"""Forces are the rate of change of momentum, that of added mass included, in steps of 1 ms.

With mass scaling, which is on by default, a part of what acts on a body moves added mass.
"""

import itertools
from typing import NamedTuple

import numpy as np
import pytest

from tests.support import bodies, incisions, judged
from tissue import (
    BladeSegment,
    BladeShape,
    BladeSweep,
    FloatArray,
    Geom,
    Material,
    SolverSettings,
    Tissue,
    block,
)

DT = 1e-3
GRAVITY = np.array([0.0, 0.0, -9.81])
SIZE = (0.04, 0.04, 0.02)
ROUNDING = 1e-9
"""Of a force [N] and of a torque [N m]; the forces are half a newton."""
SOFT = {"young_modulus": 10e3, "poisson_ratio": 0.45, "toughness": 10.0, "blade_friction": 0.3}
LAWS = {
    "neo_hookean": {},
    "exponential": {"stiffening": 5.0},
    "yeoh": {"yeoh_second": 1.0},
    "springs": {"poisson_ratio": 0.25},
}


class Momenta(NamedTuple):
    """Momentum [N s], then angular momentum about the origin [N m s], shape (6,) each."""

    own: FloatArray
    added: FloatArray
    impulse: FloatArray
    """That of mass scaling since the start."""


def momenta(tissue, added=None):
    """Return momenta from the nodes, and the impulse that the result of a step tells."""
    now = tissue.snapshot()
    own, moved = (m[:, None] * now.velocities for m in (now.masses, now.added_masses))
    sums = [np.hstack((p, np.cross(now.positions, p))).sum(axis=0) for p in (own, moved)]
    if added is None:
        return Momenta(*sums, np.zeros(6))
    told = np.concatenate((added.momentum, added.angular_momentum))
    np.testing.assert_allclose(told, sums[1], atol=1e-12 * np.abs(own).sum())
    assert added.mass == pytest.approx(now.added_masses.sum(), rel=1e-12)
    return Momenta(*sums, np.concatenate((added.impulse, added.angular_impulse)))


def edge(y):
    """Return an edge on a wavy line."""
    x = 0.0213 + 0.003 * np.sin(75.0 * y)
    return BladeSegment(np.array([x, y, -0.002]), np.array([x, y, 0.03]), np.array([0.0, 1.0, 0.0]))


def free_block(law, relaxation="global", gravity=GRAVITY):
    """Return a block that nothing but forces holds, without drag."""
    material = Material(law=law, viscous_damping=0.0, **SOFT | LAWS[law])
    solver = SolverSettings(relaxation=relaxation)
    return Tissue(
        block((8, 8, 4), SIZE), material, gravity=gravity, blade=BladeShape(), solver=solver
    )


class Balance:
    """Remainder of the balance of momentum in each step of a cut, and its parts."""

    def __init__(self, tissue, holds, touch=None, gravity=GRAVITY):
        self.own, self.whole, self.impulse = [], [], []
        weight = tissue.snapshot().masses.sum() * np.asarray(gravity)
        poses = [edge(y) for y in -0.003 + 0.3 * DT * np.arange(60)]
        before = momenta(tissue)
        for k, sweep in enumerate(itertools.pairwise(poses)):
            wrenches = list(self._step(tissue, BladeSweep(*sweep), holds, touch, k))
            on_others = sum(
                np.concatenate((w.force, w.torque + np.cross(w.point, w.force))) for w in wrenches
            )
            on_others[:3] -= weight
            now = momenta(tissue, self.result.added_mass)
            own, added, impulse = ((b - a) / DT for a, b in zip(before, now, strict=True))
            self.own.append(on_others + own)
            self.whole.append(on_others + own + added - impulse)
            self.impulse.append(impulse)
            before = now

    def _step(self, tissue, sweep, holds, touch, k):
        """Do a step; yield the wrenches of the tissue on all else."""
        if touch is not None:
            touch.move([[0.02, 0.02, -0.0031 + 1e-5 * k], [0.02, 0.0485 - 1e-5 * k, 0.01]])
        self.result = tissue.step(sweep, DT)
        yield self.result.wrench
        for hold in holds:
            yield hold.wrench
        if touch is not None:
            yield from (touch.wrench(geom) for geom in range(2))


def held_block(*arguments):
    """Return a free block with two attachments, a ligament and two geoms that press it."""
    tissue = free_block(*arguments)
    holds = [tissue.attach(side, stiffness=400.0, damping=0.2) for side in ("left", "right")]
    tie = {"stiffness": 50.0, "area": 1e-6, "toughness": 100.0}
    holds.append(tissue.tie("back", (0.02, 0.06, 0.01), **tie))
    geoms = [Geom("a", "box", (0.01, 0.01, 0.003), 0.5), Geom("b", "sphere", (0.008,), 0.3)]
    return tissue, holds, tissue.collide_with(geoms, [[0.02, 0.02, -0.0031], [0.02, 0.0485, 0.01]])


def size(rows, part):
    """Return the largest number of a part of rows."""
    return float(np.abs(np.array(rows)[:, part]).max())


LINEAR, ANGULAR = slice(0, 3), slice(3, 6)


@pytest.mark.parametrize(
    ("law", "relaxation"),
    [*((law, "global") for law in LAWS), ("neo_hookean", "verlet"), ("springs", "verlet")],
)
def test_forces_on_all_else_are_the_change_of_own_and_added_momentum(law, relaxation):
    """With blade, attachments, ligament and geoms, through cuts, as mass comes and goes."""
    tissue, holds, touch = held_block(law, relaxation)
    n = tissue.n_nodes
    found = Balance(tissue, holds, touch)
    assert tissue.n_nodes > n and touch.arrays.n_contacts > 0
    assert size(found.whole, LINEAR) < ROUNDING
    if law == "springs":  # they get no mass
        assert size(found.own, LINEAR) < ROUNDING
    else:
        assert size(found.own, LINEAR) > 0.01
        assert sum(np.abs(each[LINEAR]).max() > ROUNDING for each in found.impulse) > 5


def test_torques_on_all_else_are_the_change_of_own_and_added_angular_momentum():
    """Without what acts on moving places over a step: weight, and geoms."""
    nothing = np.zeros(3)
    tissue = free_block("neo_hookean", "verlet", nothing)
    holds = [tissue.attach(side, stiffness=400.0, damping=0.2) for side in ("left", "right")]
    found = Balance(tissue, holds, gravity=nothing)
    assert size(found.whole, ANGULAR) < ROUNDING < 1e-4 < size(found.own, ANGULAR)
    assert size(found.impulse, ANGULAR) > 1e-4


@pytest.mark.parametrize("scheme", ["stellar", "paper"])
def test_an_incision_in_a_body_that_moves_changes_both_momenta_by_the_impulse(scheme):
    """No time passes: nodes get mass at the velocity that they have."""
    mesh = bodies.jittered(4, 1)
    solver = SolverSettings(mass_scaling=1.0, scheme=scheme)
    tissue = Tissue(mesh, Material(**SOFT, viscous_damping=0.0), gravity=(0, 0, 0), solver=solver)
    tissue.step(None, DT)
    judged.set_random_velocities(tissue, 0)
    before = momenta(tissue, tissue.step(None, 0.0).added_mass)
    for seed, kind in enumerate(incisions.KINDS):
        tissue.incise(*incisions.incision(mesh, kind, seed))
    now = momenta(tissue, tissue.step(None, 0.0).added_mass)
    own, added, impulse = (b - a for a, b in zip(before, now, strict=True))
    scale = np.abs(before.own)
    np.testing.assert_allclose(own + added, impulse, atol=1e-9 * scale.max())
    assert (np.abs(impulse) > 1e-6 * scale).all() and (np.abs(own) < 1e-9 * scale.max()).all()
