"""Modes of a free bar die away by the damping ratio that was asked for."""

import math

import numpy as np
import pytest
from scipy.optimize import curve_fit

from tissue import Material, SolverSettings, Tissue, lattice_block

LENGTH, WIDTH = 0.12, 0.02
DT = 5e-4
N_STEPS = 1200
"""Two and a half periods of the slowest mode, in bending."""
SPEED = 0.01
"""Largest speed at first, about [m/s]: the motion is within a millimetre, and linear."""
RATIO, AT = 0.05, 10.0
"""Damping ratio, and the frequency at which it is asked for [Hz]; it rises as the frequency."""
FREE_FREE = 4.730040744862704
"""First root of cosh(k) cos(k) = 1: the mode of a free beam in bending (Timoshenko, Vibration
Problems in Engineering)."""
OF_SPRINGS = 0.03
"""Largest deviation of springs, whose dampers are along them."""
OF_TETRAHEDRA = 0.17
"""Largest deviation of tetrahedra: along its axes a lattice of dampers has 0.83 of the mean of its
viscosity over all directions."""


def bending(s):
    """Return deflection and slope of a free beam, at shares of its length."""
    k, x = FREE_FREE, FREE_FREE * s
    ratio = (math.cosh(k) - math.cos(k)) / (math.sinh(k) - math.sin(k))
    deflection = np.cosh(x) + np.cos(x) - ratio * (np.sinh(x) + np.sin(x))
    slope = k * (np.sinh(x) - np.sin(x) - ratio * (np.cosh(x) + np.cos(x)))
    return deflection, slope / LENGTH


def shape_of(mode, rest, nu):
    """Return the shape of a mode of a slender bar along x, shape (n, 3)."""
    s = (rest[:, 0] - rest[:, 0].min()) / LENGTH
    _, y, z = (rest - rest.mean(axis=0)).T
    nothing = np.zeros(len(rest))
    if mode == "bending":
        deflection, slope = bending(s)
        return np.stack((-slope * z, nothing, deflection), axis=1)
    along, strain = np.cos(np.pi * s), -np.pi / LENGTH * np.sin(np.pi * s)
    if mode == "stretching":
        return np.stack((along, -nu * strain * y, -nu * strain * z), axis=1)
    return np.stack((nothing, -along * z, along * y), axis=1) / (0.5 * WIDTH)


def decay(mode, cells, **material):
    """Return frequency [Hz] and damping ratio of a mode, from how far the bar moves along it."""
    mesh = lattice_block((6 * cells, cells, cells), (LENGTH, WIDTH, WIDTH))
    bar = Material(**material, viscous_damping=0.0).with_damping(RATIO, AT)
    solver = SolverSettings(mass_scaling=None)
    tissue = Tissue(mesh, bar, gravity=(0.0, 0.0, 0.0), solver=solver)
    shape = shape_of(mode, mesh.positions, bar.poisson_ratio)
    tissue._body.velocities[: tissue.n_nodes] = SPEED * shape
    at_first = tissue.snapshot()
    weights = at_first.masses[:, None] * shape / (at_first.masses @ (shape**2).sum(axis=1))
    moved = np.empty(N_STEPS)
    for k in range(N_STEPS):
        tissue.step(None, DT)
        moved[k] = (weights * (tissue._body.positions[: tissue.n_nodes] - at_first.positions)).sum()
    return fitted(DT * np.arange(1, N_STEPS + 1), moved)


def fitted(time, moved):
    """Return frequency [Hz] and damping ratio of a motion that dies away."""
    spectrum = np.abs(np.fft.rfft(moved * np.hanning(len(moved)), 8 * len(moved)))
    guess = 2.0 * math.pi * np.fft.rfftfreq(8 * len(moved), DT)[spectrum.argmax()]

    def swing(time, a, b, rate, omega):
        return np.exp(-rate * time) * (a * np.cos(omega * time) + b * np.sin(omega * time))

    first = (0.0, np.abs(moved).max(), 0.02 * guess, guess)
    _, _, rate, omega = curve_fit(swing, time, moved, p0=first)[0]
    return omega / (2.0 * math.pi), rate / math.hypot(rate, omega)


@pytest.mark.parametrize("mode", ["bending", "stretching", "twisting"])
@pytest.mark.parametrize("nu", [0.25, 0.45])
def test_a_bar_of_springs_dies_away_by_the_ratio_asked_for_in_three_modes(mode, nu):
    frequency, ratio = decay(mode, 3, law="springs", poisson_ratio=nu)
    assert ratio == pytest.approx(RATIO * frequency / AT, rel=OF_SPRINGS)


@pytest.mark.parametrize("cells", [3, 4])
@pytest.mark.parametrize("mode", ["bending", "stretching"])
@pytest.mark.parametrize(
    "law",
    [{"law": "neo_hookean"}, {"law": "exponential", "stiffening": 1.0}],
    ids=lambda x: x["law"],
)
def test_a_bar_of_tetrahedra_dies_away_by_the_ratio_asked_for(law, mode, cells):
    frequency, ratio = decay(mode, cells, poisson_ratio=0.45, **law)
    assert ratio == pytest.approx(RATIO * frequency / AT, rel=OF_TETRAHEDRA)
