import gc
import re
from dataclasses import replace

import numpy as np
import pytest

from bridge import InProcessLink, LinkError
from scalpel_sim import SCENES, Simulation, prepare
from scalpel_sim.cli.options import BodyOptions, MaterialOptions, TissueOptions
from scalpel_sim.cli.scene_options import chosen_scene
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.preparation.tissue import check_scene, make_tissue, pulled_apart
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.file_names import ENERGY_PLOT, RUN_FILES, SCENE
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.run import REST_AFTER_STROKE, perform, run_time
from scalpel_sim.scene.read import DEFAULT_SCENE, scene_called
from scalpel_sim.scene.scene import GEL, changed
from tests.support.run_files import assert_same_rows, names_in
from tissue import Tissue, block, write_vtu

GRID2 = SCENES["grid2"]
UNAUDITED = set(RUN_FILES) - {ENERGY_PLOT, SCENE}


def test_two_runs_of_a_scene_give_the_same_bits():
    first, second = (prepare(GRID2) for _ in range(2))
    for simulation in (first, second):
        simulation.run(0.8)
    assert first.result.cut_area > 0.0
    assert_same_rows(first.recording, second.recording)


def test_a_run_ends_when_its_callback_returns_true():
    simulation = prepare(GRID2)
    simulation.run(1.0, lambda now: len(now.recording) == 7)
    assert len(simulation.recording) == 7
    assert simulation.time == pytest.approx(7 * simulation.dt)


def test_the_blade_starts_on_the_stroke_and_stays_near_it():
    simulation = prepare(GRID2)
    simulation.run(simulation.stroke.duration)
    tips = simulation.frame.points_to_tissue(simulation.recording.vector("tip"))
    wanted = [simulation.stroke.pose(t).tip for t in simulation.recording.column("time_s")]
    distances = np.linalg.norm(tips - wanted, axis=1)
    assert distances[0] < 1e-5
    assert distances.max() < 2e-3


def test_the_garbage_collector_is_off_during_a_run_and_on_after_it():
    simulation = prepare(GRID2)
    seen, n_frozen = [], gc.get_freeze_count()
    simulation.run(0.005, lambda now: seen.append(gc.isenabled()))
    assert seen == [False] * 5
    assert gc.isenabled() and gc.get_freeze_count() == n_frozen


def test_a_run_does_not_search_the_process_for_garbage():
    """With a million objects that takes longer than a hundred frames.

    What the run has made itself is searched after it: the youngest generation.
    """
    simulation = prepare(GRID2)
    searched = []
    gc.callbacks.append(lambda phase, found: searched.append(found["generation"]))
    try:
        simulation.run(0.001)
    finally:
        gc.callbacks.pop()
    assert 2 not in searched


def test_the_stages_of_a_frame_take_no_longer_than_the_frame():
    simulation = prepare(GRID2)
    simulation.pictures.append(lambda now: sum(range(10_000)))
    simulation.run(0.5)
    rows = simulation.recording
    stages = rows.column("cd_s") + rows.column("gc_s") + rows.column("rx_s")
    assert (stages <= rows.column("frame_s")).all()
    assert (rows.column("rd_s") > 0.0).all()
    in_all = sum(rows.column(name).sum() for name in ("frame_s", "rd_s", "recording_s"))
    assert 0.9 * simulation.wall_seconds < in_all <= simulation.wall_seconds


def test_there_is_no_result_before_the_first_frame():
    with pytest.raises(RuntimeError, match="no frame"):
        _ = prepare(GRID2).result


def test_the_scenes_have_those_of_the_paper_and_an_organ():
    counts = {name: len(scene.mesh().tetrahedra) for name, scene in SCENES.items()}
    assert (counts["slab"], counts["grid2"], counts["grid7"]) == (576, 48, 2058)
    assert 4500 <= counts["organ"] <= 5500
    assert DEFAULT_SCENE == "organ"
    with pytest.raises(UsageError, match=r"Did you mean 'grid7'. Known: organ, .*, slab, grid2"):
        scene_called("grid77")


def test_a_body_that_would_be_dragged_instead_of_cut_gets_a_warning(caplog):
    check_scene(changed(GRID2, toughness=30.0))
    assert not caplog.records
    check_scene(changed(GRID2, toughness=60.0))
    assert "drag the tissue along by some 6 mm" in caplog.text


@pytest.mark.parametrize("name", SCENES)
def test_the_body_of_a_scene_is_cut_before_it_is_dragged_far(name):
    """The blade drags tissue along by toughness / stiffness: little against the body.

    Tissue that stiffens is dragged much less far; `incision` has a test of its own.
    """
    scene = SCENES[name]
    drag = scene.material.toughness / scene.material.young_modulus
    far = 0.1 * np.ptp(scene.mesh().positions, axis=0).min()
    assert drag <= far or scene.material.stiffens


def test_a_stretch_moves_held_sides_apart_and_nothing_else():
    corners = block((1, 1, 1), (0.1, 0.2, 0.3)).positions
    pulled = pulled_apart(corners, "left,right", 0.5)
    assert np.ptp(pulled, axis=0) == pytest.approx([0.15, 0.2, 0.3])
    assert pulled.mean(axis=0) == pytest.approx(corners.mean(axis=0))
    assert pulled_apart(corners, "bottom", 0.0) is corners
    with pytest.raises(UsageError, match="no such pair"):
        pulled_apart(corners, "left,bottom", 0.1)


def test_a_body_is_at_rest_when_the_run_begins():
    tissue = make_tissue(GRID2)
    before = tissue.snapshot().positions
    for _ in range(100):
        tissue.step(None, 1e-3)
    assert np.abs(tissue.snapshot().positions - before).max() < 1e-5


def test_a_run_lasts_for_the_stroke_and_a_rest_unless_a_time_is_given():
    simulation = prepare(GRID2)
    assert run_time(simulation, None) == simulation.stroke.duration + REST_AFTER_STROKE
    assert run_time(simulation, 0.1) == 0.1


class BreakingLink(InProcessLink):
    """A link that is lost after some steps, as when a server dies."""

    n_steps_left = 150

    def _check_connection(self) -> None:
        if self.n_steps_left == 0:
            raise LinkError("the server is gone")

    def step(self, sweep, dt, *led):
        self._check_connection()
        self.n_steps_left -= 1
        return super().step(sweep, dt, *led)

    def snapshot(self):
        self._check_connection()
        return super().snapshot()

    def surface(self):
        self._check_connection()
        return super().surface()

    def n_pieces(self):
        self._check_connection()
        return super().n_pieces()


def test_an_arm_that_loses_its_tissue_in_the_middle_of_a_cut_is_released():
    link = BreakingLink(make_tissue(GRID2), "grid2")
    link.n_steps_left = 600
    simulation = prepare(GRID2, link)
    with pytest.raises(LinkError):
        simulation.run(1.0)
    assert np.linalg.norm(simulation.wrench.force) > 0.1
    assert not simulation.arm.data.xfrc_applied.any()


def perform_in(folder, simulation: Simulation, seconds: float = 0.3):
    with Plotter() as plotter:
        scene = changed(GRID2, seconds=seconds)
        prepared = PreparedRun(
            simulation, scene, folder, {"stroke": "straight"}, plotter, is_here=False
        )
        return perform(prepared)


def test_a_run_that_loses_its_tissue_keeps_all_files_but_the_final_mesh(tmp_path):
    simulation = prepare(GRID2, BreakingLink(make_tissue(GRID2), "grid2"))
    with pytest.raises(RunError, match=r"after 0\.150 s: the server is gone; .* holds"):
        perform_in(tmp_path, simulation)
    assert len(read_forces(tmp_path / "forces.csv")) == 150
    assert set(names_in(tmp_path)) == UNAUDITED - {"final.vtu"}


def test_a_run_that_ends_by_a_bug_keeps_its_files_too(tmp_path):
    simulation = prepare(GRID2)
    simulation.pictures.append(lambda now: 1 / (now.time < 0.1))
    with pytest.raises(RunError, match=r"ZeroDivisionError.*fault of the program"):
        perform_in(tmp_path, simulation)
    assert set(names_in(tmp_path)) == UNAUDITED


def test_a_body_that_folds_as_it_settles_gets_a_warning_that_names_what_helps(caplog):
    make_tissue(GRID2)
    assert "inside out" not in caplog.text
    make_tissue(changed(GRID2, young_modulus=200.0, toughness=0.1, gravity=50.0))
    assert re.search(
        r"[\d.]+ % of the tetrahedra are inside out, and the body has [\d.]+ % of its volume.*"
        r"--law neo_hookean, --poisson-ratio 0.45, a larger --young",
        caplog.text,
    )
    assert "less --gravity" in caplog.text
    assert ("less --stretch" in caplog.text) == (
        GRID2.body.stretched_by != 0.0
    )  # only what there is


def test_supports_carry_the_weight_along_gravity():
    gravity = (3.0, -4.0, 2.0)
    tissue = make_tissue(changed(GRID2, gravity=gravity, stretch=0.0))
    weight = tissue.snapshot().masses.sum() * np.array(gravity)
    carried = tissue.support_forces().sum(axis=0)
    # Settling ends at 1e-3 of the largest force.
    np.testing.assert_allclose(carried, -weight, rtol=2e-3)


def test_springs_that_the_blade_would_fold_are_refused_before_the_body_settles(monkeypatch):
    monkeypatch.setattr(Tissue, "settle", lambda tissue: pytest.fail("it settles"))
    with pytest.raises(ValueError, match=r"springs fold ahead of the blade above 0\.6"):
        make_tissue(changed(GRID2, young_modulus=1e3, toughness=60.0))


def test_options_change_the_gel_of_a_mesh_from_a_file(tmp_path):
    path = tmp_path / "body.vtu"
    write_vtu(path, make_tissue(GRID2).snapshot())
    body, tougher = BodyOptions(mesh=path), MaterialOptions(toughness=60.0)
    assert chosen_scene(None, TissueOptions(body=body)).material == GEL
    scene = chosen_scene(None, TissueOptions(body=body, material=tougher))
    assert scene.material == replace(GEL, toughness=60.0)
