"""Modes of a free bar die away by the damping ratio that was asked for."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import curve_fit

from tissue import Global, Material, SolverSettings, Tissue, Verlet, lattice_block
from tissue.elasticity.stiffness_matrix import masses, stiffness_matrix

LENGTH, WIDTH = 0.12, 0.02
DT = 5e-4
N_STEPS = 1200
"""Two and a half periods of the slowest mode, in bending."""
PERIODS = 6.0
"""Periods for which a mode of volume is watched, in as many steps."""
N_RIGID = 6
MODES = ["bending", "stretching", "twisting"]
SPEED = 0.01
"""Largest speed at first, about [m/s]: the motion is within a millimetre, and linear."""
RATIO, AT = 0.05, 10.0
"""Damping ratio, and the frequency at which it is asked for [Hz]; it rises as the frequency."""
FREE_FREE = 4.730040744862704
"""First root of cosh(k) cos(k) = 1: the mode of a free beam in bending (Timoshenko, Vibration
Problems in Engineering)."""
OF_SPRINGS = 0.03
"""Largest deviation of springs, whose dampers are along them."""
OF_TETRAHEDRA = 0.012
"""Largest deviation of tetrahedra: half of the rate of decay times the step, and where a law leaves
tetrahedra a negative bulk modulus up to 1 % (`tissue.elasticity.viscous_stress`)."""
SOLIDS = [
    {"law": "neo_hookean"},
    {"law": "exponential", "stiffening": 1.0},
    {"law": "yeoh", "yeoh_second": 1.0},
]


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


def decay(mesh, shape, at, dt=DT, element="plain", relaxation="global", **material):
    """Return frequency [Hz] and damping ratio of a mode, from how far a body moves along it.

    Args:
        mesh: The body, which is free.
        shape: The mode, shape (n, 3).
        at: Frequency at which `RATIO` is asked for [Hz].
        dt: Time step [s].
        element: Element of tetrahedra.
        relaxation: The integrator.
        **material: What it is made of.
    """
    damped = Material(**material, viscous_damping=0.0).with_damping(RATIO, at)
    solver = SolverSettings(mass_scaling=None, element=element, relaxation=relaxation)
    tissue = Tissue(mesh, damped, gravity=(0.0, 0.0, 0.0), solver=solver)
    tissue._body.velocities[: tissue.n_nodes] = SPEED * shape
    at_first = tissue.snapshot()
    weights = at_first.masses[:, None] * shape / (at_first.masses @ (shape**2).sum(axis=1))
    moved = np.empty(N_STEPS)
    for k in range(N_STEPS):
        tissue.step(None, dt)
        moved[k] = (weights * (tissue._body.positions[: tissue.n_nodes] - at_first.positions)).sum()
    return fitted(dt * np.arange(1, N_STEPS + 1), moved, dt)


def decay_of_bar(mode, cells, **material):
    """Return frequency [Hz] and damping ratio of a mode of a slender bar."""
    mesh = lattice_block((6 * cells, cells, cells), (LENGTH, WIDTH, WIDTH))
    shape = shape_of(mode, mesh.positions, material["poisson_ratio"])
    return decay(mesh, shape, AT, **material)


def mode_of_volume(mesh, material, element):
    """Return the mode with the largest share of volume in its energy, and its frequency [Hz].

    That share is returned, too.
    """
    root = 1.0 / np.sqrt(np.repeat(masses(mesh, material.density), 3))
    whole = stiffness_matrix(mesh, material, element=element).toarray()
    squared, modes = np.linalg.eigh(root[:, None] * whole * root)
    squared, modes = squared[N_RIGID:], root[:, None] * modes[:, N_RIGID:]
    # Without lam, and with the same mu:
    no_lam = replace(material, poisson_ratio=0.0, young_modulus=2.0 * material.mu)
    of_shear = stiffness_matrix(mesh, no_lam, element=element)
    shares = 1.0 - (modes * (of_shear @ modes)).sum(axis=0) / squared
    best = int(shares.argmax())
    shape = modes[:, best].reshape(-1, 3)
    return shape / np.abs(shape).max(), math.sqrt(squared[best]) / (2.0 * math.pi), shares[best]


def fitted(time, moved, dt):
    """Return frequency [Hz] and damping ratio of a motion that dies away, told every `dt` [s]."""
    spectrum = np.abs(np.fft.rfft(moved * np.hanning(len(moved)), 8 * len(moved)))
    guess = 2.0 * math.pi * np.fft.rfftfreq(8 * len(moved), dt)[spectrum.argmax()]

    def swing(time, a, b, rate, omega):
        return np.exp(-rate * time) * (a * np.cos(omega * time) + b * np.sin(omega * time))

    first = (0.0, np.abs(moved).max(), 0.02 * guess, guess)
    _, _, rate, omega = curve_fit(swing, time, moved, p0=first)[0]
    return omega / (2.0 * math.pi), rate / math.hypot(rate, omega)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("nu", [0.25, 0.45])
def test_a_bar_of_springs_dies_away_by_the_ratio_asked_for_in_three_modes(mode, nu):
    frequency, ratio = decay_of_bar(mode, 3, law="springs", poisson_ratio=nu)
    assert ratio == pytest.approx(RATIO * frequency / AT, rel=OF_SPRINGS)


@pytest.mark.parametrize("element", ["plain", "averaged"])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("law", SOLIDS, ids=lambda x: x["law"])
def test_a_bar_of_tetrahedra_dies_away_by_the_ratio_asked_for_in_three_modes(law, mode, element):
    frequency, ratio = decay_of_bar(mode, 3, element=element, poisson_ratio=0.45, **law)
    assert ratio == pytest.approx(RATIO * frequency / AT, rel=OF_TETRAHEDRA)


@pytest.mark.parametrize("element", ["plain", "averaged"])
@pytest.mark.parametrize("nu", [0.45, 0.49])
@pytest.mark.parametrize("law", SOLIDS, ids=lambda x: x["law"])
def test_a_mode_that_changes_volume_dies_away_by_the_ratio_asked_for(law, nu, element):
    mesh, solid = lattice_block((3, 3, 3), (0.06, 0.06, 0.06)), {"poisson_ratio": nu, **law}
    shape, frequency, share = mode_of_volume(mesh, Material(**solid), element)
    assert share > 0.8
    dt = PERIODS / frequency / N_STEPS
    found, ratio = decay(mesh, shape, frequency, dt, element=element, **solid)
    assert found == pytest.approx(frequency, rel=0.01)
    assert ratio == pytest.approx(RATIO, rel=OF_TETRAHEDRA)


@pytest.mark.parametrize("element", ["plain", "averaged"])
@pytest.mark.parametrize("relaxation", [Global(damping="stage"), Verlet()], ids=repr)
def test_the_ratio_is_that_of_any_method(relaxation, element):
    solid = {"law": "neo_hookean", "poisson_ratio": 0.45, "element": element}
    frequency, ratio = decay_of_bar("twisting", 2, relaxation=relaxation, **solid)
    assert ratio == pytest.approx(RATIO * frequency / AT, rel=OF_TETRAHEDRA)


@pytest.mark.parametrize("element", ["plain", "averaged"])
@pytest.mark.parametrize(
    "relaxation", [Global(damping="step"), Global(damping="stage"), Verlet()], ids=repr
)
def test_what_viscosity_takes_is_what_a_strained_body_loses(relaxation, element):
    mesh = lattice_block((3, 2, 2), (0.03, 0.02, 0.02))
    material = Material(poisson_ratio=0.45, viscous_damping=0.0, retardation_time=5e-4)
    solver = SolverSettings(relaxation=relaxation, element=element, audit=True)
    tissue = Tissue(mesh, material, gravity=(0.0, 0.0, 0.0), solver=solver)
    stretch = 40.0 * (mesh.positions - mesh.positions.mean(axis=0)) * np.array([1.0, -0.5, -0.5])
    tissue._body.velocities[: tissue.n_nodes] = stretch
    at_first = 0.5 * tissue.snapshot().masses @ (stretch**2).sum(axis=1)
    for _ in range(60):
        energies = tissue.step(None, 2e-4).energies
    left = energies.kinetic + energies.elastic
    assert energies.damping > 0.3 * at_first
    assert energies.damping + left == pytest.approx(at_first, abs=0.001 * energies.damping)
