"""A step that goes wrong is done again from where it began, in shorter steps, or the body stops."""

import re

import numpy as np
import pytest

from tests.support import bodies, faults, strokes
from tissue import (
    BladeShape,
    Geom,
    Material,
    SolverSettings,
    Tissue,
    TissueError,
)

MESH = bodies.jittered(4, 0)
STROKE = list(strokes.sweeps(strokes.THROUGH["slanted"](MESH)))
MIDDLE = len(STROKE) // 2
N_AFTER = 8
TOP = MESH.positions.max(axis=0)
BALL = np.array([*MESH.positions.mean(axis=0)[:2], TOP[2] + 0.0101])
SOLID = Material(law="neo_hookean", poisson_ratio=0.45)


def in_mid_cut(relaxation="global", material=SOLID):
    """Return a body that a blade is cutting."""
    solver = SolverSettings(relaxation=relaxation, audit=True)
    tissue = Tissue(MESH, material, fixed=bodies.sides(MESH), blade=BladeShape(), solver=solver)
    for sweep in STROKE[:MIDDLE]:
        tissue.step(sweep, strokes.DT)
    return tissue


def same(one, other):
    """Whether two bodies are the same to the last bit."""
    pairs = zip(one.snapshot(), other.snapshot(), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


class Driven:
    """A body whose loads, attachments, geoms and supports are moved before each step."""

    def __init__(self):
        self.tissue = in_mid_cut()
        self.load = self.tissue.push([MESH.positions.mean(axis=0)], (0.0, 0.0, 0.05))
        self.nodes = np.flatnonzero(MESH.positions[:, 2] > TOP[2] - 1e-6)[:6]
        self.grip = self.tissue.attach(self.nodes, stiffness=50.0, damping=0.1)
        self.ball = self.tissue.collide_with([Geom("ball", "sphere", (0.01,), 0.3)], [BALL])

    def drive(self, i):
        self.load.force = (0.0, 0.01 * i, 0.05)
        x, y, z = MESH.positions[self.nodes].mean(axis=0)
        self.grip.move((x, y, z + 2e-4 * i))
        self.ball.move([BALL - [0.0, 0.0, 1e-4 * i]])
        self.tissue.move_supports("left", (0.0, 0.0, 1e-3 * i))


@pytest.mark.parametrize("last", [1, N_AFTER - 1])
def test_going_back_by_steps_gives_the_same_bits_whatever_drives_the_body(last):
    """The body is spoiled before its last step, goes back, and is as if it had not been."""
    spoiled, other = Driven(), Driven()
    tissue = spoiled.tissue
    for i in range(last + 1):
        for each in (spoiled, other):
            each.drive(i)
        if i == last:
            inputs = tissue._stages.handles.inputs(STROKE[MIDDLE + i], strokes.DT)
            tissue._body.positions[7] = tissue._body.velocities[9] = np.nan
            tissue._steps.go_back(inputs)
        for each in (spoiled, other):
            each.tissue.step(STROKE[MIDDLE + i], strokes.DT)
    assert same(tissue, other.tissue)


def test_going_back_to_before_a_line_touched_the_body_loses_no_step():
    spoiled, other = (Tissue(MESH, SOLID, fixed=bodies.sides(MESH)) for _ in range(2))
    for i, sweep in enumerate(STROKE[:MIDDLE]):
        if i == 3:
            spoiled._steps.save()  # as after so many steps
        if i % 50 == 49:
            spoiled._steps.go_back(spoiled._stages.handles.inputs(sweep, strokes.DT))
        results = [tissue.step(sweep, strokes.DT) for tissue in (spoiled, other)]
    assert results[0].cut_area == results[1].cut_area > 0.0
    assert same(spoiled, other)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
@pytest.mark.parametrize("where", ["positions", "velocities"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e3])
def test_a_fault_before_a_step_is_gone_after_it(relaxation, where, value, caplog):
    tissue, other = in_mid_cut(relaxation), in_mid_cut(relaxation)
    faults.inject(tissue, where, value, np.random.default_rng(0))
    results = [each.step(STROKE[MIDDLE], strokes.DT) for each in (tissue, other)]
    assert tissue.n_repeated_steps == 1
    assert other.n_repeated_steps == 0
    assert "a step was repeated in steps of 1/2 the length" in caplog.text
    assert results[0].n_substeps > results[1].n_substeps
    assert results[0].wrench.force == pytest.approx(results[1].wrench.force, rel=0.05, abs=0.01)


@pytest.mark.parametrize("force", [1e3, 1e9])
@pytest.mark.parametrize("where", ["middle", "node"])
def test_a_body_that_cannot_go_on_stops_as_it_was_and_names_nodes(force, where):
    tissue, other = in_mid_cut(), in_mid_cut()
    free = np.flatnonzero(~bodies.sides(MESH))[:1]
    tissue.push([MESH.positions.mean(axis=0)] if where == "middle" else free, (force, 0.0, 0.0))
    named = r"The worst nodes, before this step: \d+ at \(.*\) m, \d+ at"
    with pytest.raises(TissueError, match=named):
        tissue.step(STROKE[MIDDLE], strokes.DT)
    assert not issubclass(TissueError, ValueError)  # exit code 1
    assert same(tissue, other)


def test_a_body_that_was_left_not_finite_is_not_said_to_have_been_tried_in_shorter_steps():
    tissue = in_mid_cut()
    tissue.push([0], (0.0, 0.0, 0.1))  # a change: there is nothing to go back to
    faults.inject(tissue, "positions", np.nan, np.random.default_rng(0))
    with pytest.raises(TissueError, match=r"not finite before .*no step was taken") as error:
        tissue.step(None, strokes.DT)
    assert "did not help" not in str(error.value)


def test_a_body_that_has_stopped_takes_no_change_until_a_state_is_loaded():
    tissue, other = in_mid_cut(), in_mid_cut()
    state = tissue.save_state()
    load = tissue.push([MESH.positions.mean(axis=0)], (1e9, 0.0, 0.0))
    with pytest.raises(TissueError, match="became unstable"):
        tissue.step(STROKE[MIDDLE], strokes.DT)
    for change in (
        lambda: tissue.step(None, strokes.DT),
        lambda: tissue.settle(),
        lambda: tissue.incise(2 * [[(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]], (1.0, 0.0, 0.0)),
        lambda: tissue.push([0], (0.0, 0.0, 1.0)),
        lambda: tissue.attach([0], stiffness=1.0),
        lambda: tissue.release(load),
        lambda: tissue.move_supports("left", (0.0, 0.0, 0.0)),
        lambda: tissue.collide_with([Geom("ball", "sphere", (0.01,), 0.3)], [BALL]),
        lambda: tissue.save_state(),
    ):
        with pytest.raises(TissueError, match="has stopped, and takes no step or change until"):
            change()
    assert np.isfinite(tissue.snapshot().positions).all()
    assert len(tissue.surface().triangles)
    tissue.load_state(state)
    for sweep in STROKE[MIDDLE : MIDDLE + N_AFTER]:
        tissue.step(sweep, strokes.DT)
        other.step(sweep, strokes.DT)
    assert same(tissue, other)


def test_nodes_that_move_faster_than_their_energy_allows_are_found():
    """Each node gets a tenth of a metre per second more than it had: it is gone afterwards."""
    tissue = in_mid_cut()
    before = tissue._body.velocities[: tissue.n_nodes]
    fastest = np.abs(before).max()
    before += 3.0 * SOLID.wave_speed * ~tissue._body.fixed[: tissue.n_nodes, None]
    tissue.step(STROKE[MIDDLE], strokes.DT)
    assert tissue.n_repeated_steps == 1
    assert np.abs(tissue._body.velocities[: tissue.n_nodes]).max() < 3.0 * fastest


def test_a_node_that_leaves_the_box_faster_than_nodes_move_is_named():
    tissue = in_mid_cut()
    watch, frame = tissue._steps.watch, tissue._stages.frame_now()
    watch.look(tissue._stages.context)
    assert watch.fault(frame, strokes.DT) is None
    tissue._body.positions[5, 0] = TOP[0] + 1.0
    found = watch.fault(frame, strokes.DT)
    assert re.match(r"a node went 1 m out of the box around the body", found)


def test_a_frame_that_is_repeated_is_one_frame():
    """Halves of a step together last as long as the step: a falling body falls as far."""
    mesh = bodies.jittered(2, 0)
    tissue, other = (Tissue(mesh, SOLID) for _ in range(2))
    for each in (tissue, other):
        each.step(None, strokes.DT)
    faults.inject(tissue, "velocities", np.nan, np.random.default_rng(0))
    for each in (tissue, other):
        each.step(None, strokes.DT)
    assert tissue.n_repeated_steps == 1
    heights = [each.snapshot().positions[:, 2].mean() for each in (tissue, other)]
    fallen = [mesh.positions[:, 2].mean() - height for height in heights]
    assert fallen[0] == pytest.approx(fallen[1], rel=1e-9)
    assert fallen[0] == pytest.approx(0.5 * 9.81 * (2 * strokes.DT) ** 2, rel=1e-3)


def test_a_cut_in_no_time_is_no_fault_and_neither_is_the_motion_after_it():
    solver = SolverSettings(audit=True)
    tissue = Tissue(MESH, SOLID, fixed=bodies.sides(MESH), blade=BladeShape(), solver=solver)
    for sweep in STROKE:
        tissue.step(sweep, 0.0)
    for _ in range(N_AFTER):
        tissue.step(None, strokes.DT)
    assert tissue.n_repeated_steps == 0
