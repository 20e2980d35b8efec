"""Ligaments: fibres between tissue and world that the edge of the blade bends and cuts."""

from itertools import pairwise

import numpy as np
import pytest

from tissue import (
    BladeSegment,
    BladeSweep,
    Material,
    SolverSettings,
    Tissue,
    block,
    fixed_nodes,
)

DT = 1e-3
GEL = Material(
    law="neo_hookean", young_modulus=20e3, poisson_ratio=0.45, toughness=5.0, viscous_damping=40.0
)
CUBE = block((2, 2, 2), (0.04, 0.04, 0.04))
TOP = [0.02, 0.02, 0.04]
ABOVE = [0.02, 0.02, 0.08]
"""A fibre of 40 mm stands on the middle of the top."""
AREA, TOUGHNESS = 1e-6, 500.0
ENERGY = TOUGHNESS * AREA
RESISTANCE = ENERGY / (2.0 * np.sqrt(AREA / np.pi))
"""0.44 N: toughness times section over diameter."""
NOTHING = (0.0, 0.0, 0.0)


def cube(fixed="bottom", *, gravity=NOTHING, **solver):
    held = fixed_nodes(CUBE, fixed)
    return Tissue(CUBE, GEL, fixed=held, gravity=gravity, solver=SolverSettings(**solver))


def tied(tissue, **changes):
    numbers = {"stiffness": 200.0, "damping": 0.2, "area": AREA, "toughness": TOUGHNESS}
    return tissue.tie([TOP], ABOVE, **(numbers | changes))


def edge(y, *, x=(-0.01, 0.05), z=0.06, forward=1.0):
    """An edge along x that cuts along y, half way up the fibre."""
    ends = [np.array([each, y, z]) for each in x]
    return BladeSegment(*ends, np.array([0.0, forward, 0.0]))


def sweep(tissue, y0, y1, *, speed=0.1, **where):
    """Lead the edge from y0 to y1; return the results."""
    n = max(round(abs(y1 - y0) / (speed * DT)), 1)
    poses = [edge(y, **where) for y in np.linspace(y0, y1, n + 1)]
    return [tissue.step(BladeSweep(a, b), DT) for a, b in pairwise(poses)]


def last(tissue, steps=200):
    for _ in range(steps):
        result = tissue.step(None, DT)
    return result


# What it costs


@pytest.mark.parametrize(
    ("speed", "relaxation", "open_by"),
    # Verlet, of second order, takes one step a millisecond as the body snaps back.
    [(0.02, "global", 5e-3), (0.5, "global", 5e-3), (0.5, "verlet", 1e-2)],
)
def test_the_blade_pays_toughness_times_section_at_any_speed(speed, relaxation, open_by):
    tissue = cube(relaxation=relaxation, audit=True)
    ligament = tied(tissue)
    sweep(tissue, 0.01, 0.045, speed=speed)
    energies = last(tissue).energies
    assert ligament.n_points == 0 and ligament.is_released
    assert energies.breaking == pytest.approx(ENERGY, rel=1e-9)
    assert energies.work_of_blade > ENERGY  # it has stretched fibre and tissue, too
    assert abs(energies.residual) < open_by * energies.work_of_blade


def test_the_edge_feels_two_pulls_of_the_tension_and_cuts_at_its_resistance():
    """Slowly, so that the tissue follows: the string by hand, T (u + w)."""
    tissue = cube()
    ligament = tied(tissue, damping=0.0)
    sweep(tissue, 0.015, 0.0195)
    forces = []
    for y in np.arange(0.0195, 0.034, 5e-5):
        result = sweep(tissue, y, y + 5e-5)[0]
        point, bend = tissue.positions_of(ligament.points)[0], np.array([0.02, y + 5e-5, 0.06])
        forces.append(-result.wrench_t1.force[1])
        if forces[-1] < 0.99 * RESISTANCE and ligament.n_points:
            ends = np.array([point, ABOVE]) - bend
            lengths = np.linalg.norm(ends, axis=1)
            by_hand = 200.0 * max(lengths.sum() - 0.04, 0.0) * (ends.T / lengths).sum(axis=1)
            np.testing.assert_allclose(result.wrench_t1.force, by_hand, atol=2e-4)
    assert max(forces) == pytest.approx(RESISTANCE, rel=1e-4)
    assert forces[-1] == 0.0  # it is through


def test_the_contacts_are_the_wrench_and_the_mean_force_on_tissue_is_its_opposite():
    tissue = cube()
    tied(tissue)
    result = sweep(tissue, 0.01, 0.028)[-1]
    contacts, wrench = result.contacts, result.wrench_t1
    forces = contacts.normal_force[:, None] * contacts.normal + contacts.friction
    assert len(forces) == 1 and wrench.force[1] < -0.1
    np.testing.assert_allclose(forces.sum(axis=0), -wrench.force, atol=1e-12)
    levers = contacts.point - wrench.point
    np.testing.assert_allclose(np.cross(levers, forces).sum(axis=0), -wrench.torque, atol=1e-12)
    np.testing.assert_allclose(result.force_on_tissue, -result.wrench.force, atol=1e-12)


def test_momenta_of_a_free_body_change_by_what_blade_and_world_feel():
    tissue = cube("none")
    ligament = tied(tissue)
    before, turn_before, feels = np.zeros(3), np.zeros(3), 0.0
    for y in np.arange(0.018, 0.05, 1e-3):
        result = sweep(tissue, y, y + 1e-3, speed=1.0)[0]
        body = tissue.snapshot()
        momenta = body.masses[:, None] * body.velocities
        push, turn = np.zeros(3), np.zeros(3)
        for wrench in (result.wrench, ligament.wrench):
            push -= DT * wrench.force
            turn -= DT * (wrench.torque + np.cross(wrench.point, wrench.force))
        after, turn_after = momenta.sum(axis=0), np.cross(body.positions, momenta).sum(axis=0)
        np.testing.assert_allclose(after - before, push, atol=1e-9 * DT)
        np.testing.assert_allclose(turn_after - turn_before, turn, atol=1e-7 * DT)
        before, turn_before, feels = after, turn_after, max(feels, -result.wrench.force[1])
        if ligament.is_released:
            break
    assert ligament.n_points == 0 and feels > 0.3


# What the edge does not cut


def test_a_fibre_that_the_blade_backs_off_from_lies_straight_and_holds_as_before():
    tissue = cube(audit=True)
    ligament = tied(tissue)
    pressed = sweep(tissue, 0.01, 0.028, speed=0.05)[-1]
    sweep(tissue, 0.028, 0.01, speed=0.05)
    energies = last(tissue).energies
    assert pressed.energies.held > 1e-5 and ligament.n_points == 1
    assert energies.held == pytest.approx(0.0, abs=1e-9)
    assert energies.breaking == 0.0
    assert sweep(tissue, 0.01, 0.028, speed=0.05)[-1].wrench.force[1] == pytest.approx(
        pressed.wrench.force[1], rel=1e-3
    )


def test_a_slack_fibre_goes_with_the_edge_and_is_cut_once_it_is_taut():
    """Bent half way by b, a fibre of 40 mm is sqrt(40^2 + 4 b^2) mm long: 45 mm at b = 10.3 mm."""
    tissue = cube()
    ligament = tied(tissue, rest_length=0.045)
    slack = sweep(tissue, 0.01, 0.0302)
    assert all((result.wrench.force == 0.0).all() for result in slack)
    taut = sweep(tissue, 0.0302, 0.05)
    assert ligament.n_points == 0
    assert min(result.wrench.force[1] for result in taut) < -0.9 * RESISTANCE


# Several


def test_a_body_falls_where_its_last_ligament_is_cut_and_the_account_closes():
    tissue = cube("none", gravity=(0, 0, -9.81), audit=True)
    corners = fixed_nodes(CUBE, "0,0,0.04:0.04,0.04,0.04") & ~fixed_nodes(
        CUBE, "sphere:0.02,0.02,0.04,0.021"
    )
    points = tissue.material_points(np.flatnonzero(corners))
    places = tissue.positions_of(points)
    ligament = tissue.tie(
        points,
        places + np.array([0.0, 0.0, 0.04]),
        stiffness=400.0,
        damping=1.0,
        area=4.0 * AREA,
        toughness=0.2 * TOUGHNESS,
    )
    tissue.settle()
    last(tissue, 100)
    hanging = ligament.wrench.force[2]
    assert hanging == pytest.approx(-9.81 * tissue.snapshot().masses.sum(), rel=0.01)
    half = sweep(tissue, -0.01, 0.02)
    assert ligament.n_points == 2
    full = sweep(tissue, 0.02, 0.07)
    assert ligament.n_points == 0
    energies = full[-1].energies
    assert energies.breaking == pytest.approx(0.8 * ENERGY, rel=1e-9)
    assert abs(energies.residual) < 5e-3 * energies.work_of_blade
    assert half[0].energies.breaking == 0.0
    v0 = tissue.pieces()[0].velocity[2]
    last(tissue, 20)
    assert tissue.pieces()[0].velocity[2] - v0 == pytest.approx(-9.81 * 20 * DT, rel=1e-3)


def test_another_attachment_that_comes_does_not_disturb_a_fibre_that_is_being_cut():
    tissues = cube(), cube()
    ligaments = [tied(tissue) for tissue in tissues]
    for tissue in tissues:
        sweep(tissue, 0.01, 0.031)
    tissues[1].attach([[0.0, 0.0, 0.0]], stiffness=1e-9)
    forces = [sweep(tissue, 0.031, 0.033)[-1].wrench.force for tissue in tissues]
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-6)
    assert [each.n_points for each in ligaments] == [1, 1] or forces[0][1] == 0.0


# What is refused


@pytest.mark.parametrize(
    ("to", "numbers", "expected"),
    [
        ([0.0, 0.0], {}, "it is one place in m"),
        ([0.0, 0.0, np.nan], {}, "all finite"),
        (ABOVE, {"area": 0.0}, "area is 0.0 m2"),
        (ABOVE, {"area": 1e4}, "area is 10000.0 m2"),
        (ABOVE, {"toughness": np.inf}, "toughness is inf J/m2"),
        (ABOVE, {"toughness": 1e12}, r"toughness is .*at most 1e\+09"),
        ([0.0, 0.0, 1e4], {}, "at most 1000"),
        (ABOVE, {"rest_length": -1.0}, "rest_length is -1.0"),
        (ABOVE, {"stiffness": 0.0}, "stiffness is 0.0"),
    ],
)
def test_what_makes_no_sense_is_refused(to, numbers, expected):
    given = {"stiffness": 100.0, "area": AREA, "toughness": TOUGHNESS} | numbers
    with pytest.raises(ValueError, match=expected):
        cube().tie([TOP], to, **given)
