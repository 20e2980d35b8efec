"""Scenes of two hands: what must be true at their end, and that both arms reach and stay apart."""

import msgspec
import numpy as np
import pytest

from bridge import InProcessLink
from scalpel_sim import prepare
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.read import scene_in, shipped_scene, with_settings
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.asked import asked_area
from tests.scalpel_sim.moved_scenes import moved
from tests.support.battery import battery
from tissue import pieces_of

ACCOUNT = ("solver.audit=true",)
FAST = (*ACCOUNT, "solver.relaxation=verlet")
"""As `view` has them, in a third of the time."""
RETRACT = scene_in(with_settings(shipped_scene("retract"), FAST))
EXCISE = scene_in(with_settings(shipped_scene("excise"), (*ACCOUNT, "body.cells=[18, 12, 2]")))
TAUT = scene_in(with_settings(shipped_scene("taut_incision"), ACCOUNT))
EACH = pytest.mark.parametrize("scene", [RETRACT, EXCISE, TAUT], ids=["retract", "excise", "taut"])


def done(scene):
    simulation = prepare(scene)
    simulation.run(simulation.duration + 0.3)
    return simulation


def done_from_elsewhere(scene, case=1):
    """The scene, with hands that start up to three millimetres from where it has them."""
    return done(moved(scene, np.random.default_rng(case)))


def pieces(simulation):
    """The piece that is held by the supports, and the one that came off."""
    found = pieces_of(simulation.link.snapshot())
    assert [piece.is_held for piece in found] == [True, False]
    return found


def check_retract(simulation):
    """The piece came off, and hangs from the grasper above the table."""
    _, off = pieces(simulation)
    assert off.centre[2] > 0.03 and np.linalg.norm(off.velocity) < 0.15  # it swings
    (left,) = simulation.graspers
    assert left.n_points == simulation.recording.column("left_points").max() > 0


def check_excise(simulation):
    """The lump came out whole, and lies on the table 1 cm behind the sheet: it is 18 mm deep."""
    sheet, lump = pieces(simulation)
    assert sheet.rest_volume + lump.rest_volume == pytest.approx(60 * 40 * 8e-9, rel=1e-6)
    assert lump.centre[1] > 0.06 and abs(lump.centre[2] + 0.01) < 0.002
    assert np.linalg.norm(lump.velocity) < 0.01
    assert simulation.recording.column("left_points").max() > 0
    assert simulation.graspers[0].n_points == 0


def check_taut(simulation, asked):
    """One piece, cut as asked, whose end the left hand still holds, and held taut all the while."""
    (piece,) = pieces_of(simulation.link.snapshot())
    assert piece.is_held
    recording, (left,) = simulation.recording, simulation.graspers
    assert left.n_points == recording.column("left_points").max() > 0
    cut = recording.column("cut_area_m2")
    assert cut[-1] == pytest.approx(asked, rel=0.1)
    is_cutting = (cut > 0.0) & (cut < cut[-1])
    assert (recording.vector("left_force")[is_cutting, 0] < 0.0).all()


def check_account(simulation):
    """The account of the energy closes."""
    energies = simulation.result.energies
    lifted = np.abs(simulation.recording.column("work_of_loads_j")).max()
    assert abs(energies.residual) < 5e-3 * (energies.work_of_blade + lifted)


@pytest.fixture(scope="module")
def retract():
    return done_from_elsewhere(RETRACT)


@pytest.fixture(scope="module")
def excise():
    return done_from_elsewhere(EXCISE)


@pytest.fixture(scope="module")
def pinched():
    """The same lump where the scene has it, held by friction alone."""
    (left,) = EXCISE.graspers
    closing = [
        msgspec.structs.replace(row, opening=0.0) if row.opening == 0.007 else row
        for row in left.motion
    ]
    jaws = msgspec.structs.replace(left, holds="friction", closed=None, force=0.5, motion=closing)
    return done(changed(EXCISE, graspers=(jaws,)))


@pytest.fixture(scope="module")
def taut():
    return done_from_elsewhere(TAUT)


# How they end


def test_the_lobe_is_cut_as_asked_while_the_left_hand_holds_it_taut(taut):
    body = InProcessLink(make_tissue(TAUT)).snapshot()
    check_taut(taut, asked_area(taut.stroke, body))
    assert taut.touching.frames == {}


def test_the_lobe_is_cut_off_under_the_edge_that_the_left_hand_lifts(retract):
    check_retract(retract)
    assert retract.touching.frames == {}


def test_the_lump_is_cut_out_lifted_and_put_down(excise):
    check_excise(excise)
    assert excise.touching.frames == {}


def test_the_lump_is_what_the_arc_encloses_but_for_how_far_the_sheet_gives(pinched):
    """A segment of a circle of 18 mm, 14 mm high, through 8 mm; the sheet is taut, and opens."""
    radius, height = 18.0, 14.0
    chord = np.sqrt(2.0 * radius * height - height**2)
    area = radius**2 * np.arccos(1.0 - height / radius) - (radius - height) * chord
    assert 0.75 < pieces(pinched)[1].rest_volume / (8e-9 * area) < 1.0


def test_a_lump_that_the_jaws_hold_by_friction_alone_is_cut_out_lifted_and_put_down_too(pinched):
    _, lump = pieces(pinched)
    assert lump.centre[1] > 0.06 and abs(lump.centre[2] + 0.01) < 0.002
    assert (pinched.recording.column("left_points") == 0.0).all()


# What the hands feel


def test_after_the_cut_the_left_hand_carries_the_weight_of_the_piece(retract):
    _, off = pieces(retract)
    force = retract.recording.vector("left_force")[-300:].mean(axis=0)
    assert force == pytest.approx([0.0, 0.0, -off.mass * 9.81], abs=0.1 * off.mass * 9.81)


def test_the_left_hand_feels_nothing_before_it_is_there(retract):
    closed = retract.recording.column("left_points") > 0
    first = int(np.argmax(closed))
    assert 0.5 < first * retract.dt < 0.8 and closed[first:].all()
    assert (retract.recording.vector("left_force")[:150] == 0.0).all()


@pytest.mark.parametrize("name", ["retract", "excise", "pinched", "taut"])
def test_the_account_closes_within_half_a_percent_of_the_work_of_all_hands(name, request):
    check_account(request.getfixturevalue(name))


@battery(n_per_change=0, n_long=20)
@EACH
def test_a_scene_ends_as_it_should_wherever_its_hands_start(scene, case):
    simulation = done_from_elsewhere(scene, case)
    if scene is TAUT:
        body = InProcessLink(make_tissue(TAUT)).snapshot()
        check_taut(simulation, asked_area(simulation.stroke, body))
    else:
        {"retract": check_retract, "excise": check_excise}[scene.name](simulation)
    check_account(simulation)


# Where the arms stand


def still(simulation):
    """A tissue that does nothing: only the arms move."""
    result = simulation.link.tissue.step(None, simulation.dt)
    del simulation.coupled_bodies[1:]
    return lambda sweep, dt, *led: result


@EACH
def test_both_arms_stand_on_one_table_with_their_instruments_where_their_ways_begin(scene):
    simulation = prepare(scene)
    data, frame = simulation.arm.data, simulation.frame
    assert data.body("base").xpos[2] >= 0.0 and data.body("left_base").xpos[2] >= 0.0
    (left,) = simulation.graspers
    start = frame.points_to_world(np.array(scene.graspers[0].motion[0].at))
    assert left.grasper.pads.centre == pytest.approx(start, abs=1e-5)
    assert left.grasper.opening == pytest.approx(scene.graspers[0].motion[0].opening)
    tip = frame.points_to_world(simulation.stroke.pose(0.0).tip)
    assert simulation.arm.blade.segment().tip == pytest.approx(tip, abs=1e-5)
