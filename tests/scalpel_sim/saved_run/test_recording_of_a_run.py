"""A recording has what was simulated: read by VTK and by `SavedRun`, in any order."""

from typing import NamedTuple, get_args

import numpy as np
import pytest

from scalpel_sim import SCENES, RunRecorder, SavedRun, prepare
from scalpel_sim.errors import UsageError
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.pictures import readings
from tests.support.vtk_steps import VtkSteps
from tissue import SurfaceQuantity, piece_of_tetrahedra

SECONDS = 1.5
"""By then both hands hold the sheet, and the blade has cut 5 mm [s]."""


class Truth(NamedTuple):
    """State of the simulation at a step."""

    time: float
    snapshot: object
    deformation: object
    surface: object
    values: dict
    wrench: object
    poses: np.ndarray
    readings: object


def truth_of(simulation):
    link = simulation.link
    return Truth(
        simulation.time,
        link.snapshot(),
        link.deformation(),
        link.surface(),
        {each: link.surface_values(each) for each in get_args(SurfaceQuantity)},
        simulation.wrench,
        body_poses(simulation.arm.data),
        readings(simulation),
    )


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("recorded") / "run.vtkhdf"
    scene = SCENES["excise"]
    simulation = prepare(scene)
    truths = [truth_of(simulation)]

    def keep(now):
        if now.n_frames % 40 == 0:
            truths.append(truth_of(now))

    with RunRecorder(simulation, path, seconds=SECONDS):
        simulation.run(SECONDS, keep)
    truths.append(truth_of(simulation))
    return path, truths, simulation


@pytest.fixture(scope="module")
def run(recorded):
    with SavedRun(recorded[0]) as run:
        yield run


def single(array):
    return np.asarray(array, np.float32)


def test_vtk_reads_what_was_simulated_step_by_step_and_in_any_order(recorded):
    path, truths, _ = recorded
    steps = VtkSteps(path)
    assert np.array_equal(steps.times, [truth.time for truth in truths])
    sizes = [len(truth.snapshot.tetrahedra) for truth in truths]
    assert sizes[-1] > sizes[0] and truths[-1].surface.is_cut.any()
    for i in np.random.default_rng(0).permutation(len(truths)):
        step, (_, snapshot, deformation, *_) = steps.step(int(i)), truths[i]
        assert np.array_equal(step.points, single(snapshot.positions))
        assert np.array_equal(step.tetrahedra, snapshot.tetrahedra)
        point, cell = step.point_data, step.cell_data
        assert np.array_equal(point["velocity"], single(snapshot.velocities))
        assert np.array_equal(point["rest_position"], single(snapshot.rest_positions))
        assert np.array_equal(point["mass"], single(snapshot.masses))
        assert np.array_equal(point["fixed"], snapshot.fixed)
        assert np.array_equal(cell["stress"], single(deformation.stress).reshape(-1, 9))
        xx, yy, zz, xy, yz, xz = cell["strain"].T
        strain = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1)
        assert np.array_equal(strain, single(deformation.strain).reshape(-1, 9))
        assert np.array_equal(cell["von_mises"], single(deformation.von_mises()))
        assert np.array_equal(cell["label"], snapshot.labels)
        assert np.array_equal(cell["piece"], piece_of_tetrahedra(snapshot))


def test_a_saved_run_has_surface_arm_and_forces_of_each_step(recorded, run):
    _, truths, simulation = recorded
    assert len(run) == len(truths) and run.graspers == ("left",)
    for i, truth in enumerate(truths):
        step = run.step(i)
        for kind in ("positions", "rest_positions", "velocities", "masses", "tetrahedra", "fixed"):
            expected = getattr(truth.snapshot, kind)
            expected = single(expected) if expected.dtype == float else expected
            assert np.array_equal(getattr(step.snapshot, kind), expected)
        assert np.array_equal(step.deformation.stress, single(truth.deformation.stress))
        assert np.array_equal(step.deformation.strain, single(truth.deformation.strain))
        assert np.array_equal(step.surface.positions, single(truth.surface.positions))
        assert np.array_equal(step.surface.triangles, truth.surface.triangles)
        assert np.array_equal(step.surface.is_cut, truth.surface.is_cut)
        assert (step.surface.labels is None) == (truth.surface.labels is None)
        assert np.array_equal(step.body_poses, truth.poses)
        assert step.wrench.numbers == truth.wrench.numbers
        assert step.cut_area == truth.readings.cut_area
        assert np.array_equal(step.contact_points, truth.readings.contact_points)
        assert np.array_equal(step.contact_forces, truth.readings.contact_forces)
        hands = [np.linalg.norm(force) for force in step.grasper_forces]
        assert hands == pytest.approx([force for _, force in truth.readings.hands] or [0.0])
    assert np.array_equal(run.rows, simulation.recording.rows, equal_nan=True)
    assert max(np.linalg.norm(run.step(-1).grasper_forces, axis=1)) > 0.1


def test_colours_of_a_step_are_those_of_the_tissue(recorded, run):
    _, truths, _ = recorded
    for quantity, values in truths[-1].values.items():
        found = run.step(-1).surface_values[quantity]
        # A place in a body of 5 cm is known to 4 nm in single precision.
        assert found == pytest.approx(values, rel=1e-6, abs=1e-8)


def test_the_age_of_a_cut_begins_in_the_frame_that_opens_a_face_at_its_node(recorded, run):
    tissue = recorded[2].link.tissue
    faces, last = tissue.cut_faces(), run.step(-1)
    expected = np.full(len(last.cut_age), np.nan)
    snapshot = tissue.snapshot()
    for corners, time in zip(faces.corners[::-1], faces.times[::-1], strict=True):
        for corner in corners:  # the first face overwrites what later ones wrote
            expected[(snapshot.rest_positions == corner).all(axis=1)] = time
    on_cut = ~np.isnan(last.cut_age)
    assert on_cut.any() and len(np.unique(last.cut_age[on_cut])) > 5
    assert last.cut_age[on_cut] == pytest.approx(last.time - expected[on_cut], abs=1e-6)
    assert np.isnan(run.step(0).cut_age).all()


def test_a_node_is_on_a_cut_from_one_step_on_and_keeps_its_number(run):
    before = run.step(0)
    for i in range(1, len(run)):
        step, n = run.step(i), len(before.cut_age)
        assert np.array_equal(step.snapshot.rest_positions[:n], before.snapshot.rest_positions)
        cut = step.surface.positions[np.unique(step.surface.triangles[step.surface.is_cut])]
        is_cut = (step.snapshot.positions[:, None] == cut).all(axis=2).any(axis=1)
        assert np.array_equal(~np.isnan(step.cut_age), is_cut)
        assert np.nanmax(step.cut_age[:n][np.isnan(before.cut_age)], initial=0.0) < 0.04
        before = step


def test_a_step_is_found_by_its_time(run):
    assert run.at(0.0).number == 0 and run.at(0.0399).number == 0 and run.at(0.04).number == 1
    assert run.at(run.times[-1]).number == len(run) - 1
    with pytest.raises(UsageError, match=r"has no instant 2 s; it goes from 0 to 1\.5 s"):
        run.at(2.0)
    with pytest.raises(UsageError, match=r"has no instant -0\.1 s"):
        run.at(-0.1)


def test_the_scene_of_a_recording_is_the_one_that_was_simulated(run):
    assert run.scene.settings() == SCENES["excise"].settings()


def test_the_mesh_is_written_only_where_it_changed(recorded):
    import h5py

    path, truths, _ = recorded
    sizes = [len(truth.snapshot.tetrahedra) for truth in truths]
    with h5py.File(path) as file:
        n_cells = file["VTKHDF/NumberOfCells"][:]
        assert len(n_cells) < len(truths) and len(n_cells) >= len(set(sizes))
        assert len(file["VTKHDF/Connectivity"]) == 4 * n_cells.sum()
        assert len(file["VTKHDF/CellData/label"]) < len(file["VTKHDF/CellData/stress"])


@pytest.mark.parametrize("damage", ["cut off", "text", "other", "missing"])
def test_what_is_no_recording_is_refused_in_a_sentence(damage, recorded, tmp_path):
    import h5py

    path = tmp_path / "run.vtkhdf"
    if damage == "cut off":
        content = recorded[0].read_bytes()
        path.write_bytes(content[: len(content) // 2])
    elif damage == "text":
        path.write_text("solid")
    elif damage == "other":
        with h5py.File(path, "w") as file:
            file["VTKHDF/Points"] = np.zeros((3, 3))
    with pytest.raises(UsageError, match=r"run\.vtkhdf: (is no recording|there is no such file)"):
        SavedRun(path)
