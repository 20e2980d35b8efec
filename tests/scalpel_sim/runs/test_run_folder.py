import functools
import json
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.report import print_summary
from scalpel_sim.output.run_outcome import RunOutcome
from scalpel_sim.output.summary import Summary, summarise, summary_json
from scalpel_sim.recording.columns import columns_in, grasper_quantities, shared_columns
from scalpel_sim.recording.recording import Recording, read_forces
from scalpel_sim.runs.file_names import FORCES, PLOT, SUMMARY
from scalpel_sim.runs.run_folder import FRAMES_PER_FLUSH, Outputs
from tests.support.run_files import names_in
from tissue import CutReport, Energies, MeshMeasures, Snapshot

DT = 1e-3
CUT_REPORT = CutReport(
    n_cut_nodes=9,
    path_error_mean=1e-4,
    path_error_largest=6e-4,
    node_size=2e-3,
    guard=3e-4,
    initial=MeshMeasures(6, 2e-3, 1000.0, 2e-3, 0.0, 0.0, 0.0),
    now=MeshMeasures(9, 4e-4, 3000.0, 5e-4, 1e-3, 2e-3, 2 / 9),
)


@functools.cache
def body():
    """Return two tetrahedra, the second of which is held."""
    corners = np.vstack([np.eye(3), np.zeros(3), np.eye(3) + 2.0, np.full(3, 2.0)])
    tetrahedra = np.array([[3, 0, 1, 2], [7, 4, 5, 6]])
    is_held = np.arange(8) == 4
    masses = np.ones(8), np.zeros(8)
    return Snapshot(
        corners,
        corners.copy(),
        np.zeros((8, 3)),
        *masses,
        tetrahedra,
        is_held,
        np.zeros(2, np.int64),
    )


@pytest.fixture(scope="module")
def plotter():
    with Plotter() as plotter:
        yield plotter


def recorded(n_frames: int) -> Recording:
    """Return a random recording whose stage times sum to less than the wall time."""
    untimed = shared_columns().index("cd_s") - 1
    rng = np.random.default_rng(0)
    recording = Recording()
    for i in range(n_frames):
        recording.append((i * DT, *rng.normal(size=untimed), *rng.uniform(0.0, 1e-5, 6)))
    return recording


def summary_of(
    recording: Recording, wall_seconds: float = 1.0, material: Any = None, **counters: Any
) -> Summary:
    return summarise(
        RunOutcome(
            recording,
            DT,
            stroke=None,
            frame=None,
            settings={"stroke": "straight", "material": material or {}},
            tissue=SimpleNamespace(scene="block", n_tetrahedra=6),
            first=body(),
            last=body(),
            report=CUT_REPORT,
            cut_faces=None,
            wall_seconds=wall_seconds,
            tetrahedra_final=8,
            asked_area=2.5e-4,
            counters=counters,
        )
    )


def test_forces_csv_is_written_to_disk_during_the_run(tmp_path, plotter):
    outputs, recording = Outputs(tmp_path, plotter), Recording()
    for i in range(FRAMES_PER_FLUSH + 5):
        recording.append([float(i)] * len(shared_columns()))
        outputs.write_forces(recording)
    assert len((tmp_path / FORCES).read_text().splitlines()) == 1 + FRAMES_PER_FLUSH


def test_a_new_run_removes_the_files_of_the_last_one_and_no_others(tmp_path, plotter):
    for name in (SUMMARY, PLOT, "notes.txt"):
        (tmp_path / name).write_text("old")
    Outputs(tmp_path, plotter)
    assert names_in(tmp_path) == [FORCES, "notes.txt"]


def zero_recording(n_frames: int = 100) -> Recording:
    """Return a recording of zeros, to be filled in."""
    recording = Recording()
    for i in range(n_frames):
        row = dict.fromkeys(shared_columns(), 0.0) | {"time_s": i * DT, "frame_s": 1e-4}
        recording.append(list(row.values()))
    return recording


def printed(summary: Summary, width: int = 100) -> str:
    """Return the table of a summary."""
    console = Console(record=True, width=width)
    print_summary(summary, console)
    return console.export_text()


def test_the_summary_and_the_table_list_each_piece():
    found = summary_of(recorded(10))
    summary, text = json.loads(summary_json(found)), printed(found)
    assert summary["pieces"] == len(summary["each_piece"]) == 2
    assert [piece["held"] for piece in summary["each_piece"]] == [False, True]
    first = summary["each_piece"][0]
    assert first["volume_m3"] == pytest.approx(1 / 6) and first["mass_kg"] == 4.0
    assert first["centre_m"] == [0.25] * 3 and np.shape(first["inertia_kg_m2"]) == (3, 3)
    assert "piece 1, loose" in text and "piece 2, held" in text


@pytest.mark.parametrize(
    ("wall_seconds", "settings", "words"),
    [
        (0.005, {"relaxation": "global", "audit": True}, "2.00"),
        (0.02, {"relaxation": "verlet", "audit": False}, "0.50: slower than real time"),
        (
            0.02,
            {"relaxation": "global", "audit": True},
            "0.50: slower than real time; try --relaxation verlet, --no-audit",
        ),
        (
            0.02,
            {"relaxation": "global", "audit": True, "material": {"law": "yeoh"}},
            "0.50: slower than real time; try --no-audit",
        ),
    ],
)
def test_the_table_says_when_a_run_was_slower_than_real_time(wall_seconds, settings, words):
    summary = summary_of(recorded(10), wall_seconds)
    summary.settings.update(settings)
    (row,) = (x for x in printed(summary, 120).splitlines() if "real-time factor" in x)
    assert row.strip(" │|").endswith(words)


def test_the_table_reports_frames_that_were_limited_or_damped():
    passivity = {"energy": 0.0, "least_energy": -5e-7, "injected_away": 2e-3, "frames": 12}
    text = printed(summary_of(recorded(10), force_limited=1234, silent=0, passivity=passivity))
    assert re.search("force above the device's limit.*1,234 frames", text)
    assert re.search("damped for passivity.*12 frames, 2 mJ", text)
    assert "silent" not in text


def test_the_summary_and_the_table_tell_what_the_cut_made_of_the_mesh():
    """Path error against time step, the mass that slivers got, and tetrahedra inside out."""
    summary = summary_of(recorded(10))
    found, text = summary.quality, printed(summary)
    assert found["path_error_mean_node_sizes"] == pytest.approx(0.05)
    assert found["path_error_largest_node_sizes"] == pytest.approx(0.3)
    assert found["tetrahedra_growth"] == pytest.approx(1.5)
    assert found["frequency_growth"] == pytest.approx(3.0)
    assert found["substep_growth"] == pytest.approx(4.0)
    assert (found["added_mass"], found["most_added_mass"]) == (1e-3, 2e-3)
    assert found["inverted"] == 2 / 9
    assert re.search("mass added to light nodes.* 0.1 %", text)
    assert re.search("tetrahedra inside out.* 22 %", text)


BOTH_TOUGH = {"toughness": 20.0, "skin_toughness": 40.0}


@pytest.mark.parametrize(
    ("material", "area", "finished", "asked", "paid"),
    [
        ({"toughness": 20.0}, 2.5e-4, 1.25e-5, True, 2e-4),
        (BOTH_TOUGH, 2.4e-4, 0.0, True, None),
        ({}, 2.4e-4, 0.0, False, None),
    ],
)
def test_the_summary_and_the_table_tell_the_areas_asked_for_finished_and_paid(
    material, area, finished, asked, paid
):
    recording = zero_recording()
    recording.column("cutting_j")[-1] = 4e-3
    recording.column("cut_area_m2")[-1] = area
    recording.column("finished_area_m2")[-1] = finished
    summary = summary_of(recording, material=material)
    assert summary.asked_area_m2 == 2.5e-4 and summary.finished_area_m2 == finished
    assert summary.cut_area_paid_m2 == paid
    text = printed(summary if asked else summary._replace(asked_area_m2=None))
    share = f"{1e6 * area:.0f} mm², {area / 2.5e-4:.0%} of what is planned"
    assert (share in text) == asked
    assert bool(re.search("bridges finished .*12.5 mm² of the cut", text)) == (finished > 0.0)
    paid_for = "area paid for.* 200 mm², 80% of the cut: more than 5% off"
    assert bool(re.search(paid_for, text)) == (paid is not None)


def test_the_summary_reports_where_the_work_went_and_the_residual():
    recording = zero_recording()
    for name, energy in (("work_of_blade_j", 4e-3), ("cutting_j", 3e-3), ("residual_j", 1e-5)):
        recording.column(name)[-1] = energy
    summary = summary_of(recording)
    assert summary.energies_j["work_of_blade"] == 4e-3
    assert summary.energies_j["cutting"] == 3e-3
    assert set(Energies._fields) | {"residual"} == set(summary.energies_j)
    assert summary.residual_of_work == pytest.approx(0.0025)


def test_without_an_audit_the_summary_has_no_energies():
    recording = zero_recording()
    recording.column("residual_j")[:] = np.nan
    summary = summary_of(recording)
    assert summary.energies_j is None and summary.residual_of_work is None
    json.loads(summary_json(summary))


def test_the_table_has_a_row_for_each_term_of_the_account():
    recording = zero_recording()
    recording.column("work_of_blade_j")[-1] = 4e-3
    recording.column("friction_j")[-1] = 1e-3
    text = printed(summary_of(recording))
    (row,) = [line for line in text.splitlines() if "friction on" in line]
    assert "1.0000 mJ" in row and "25.00%" in row


def test_the_shares_sum_to_one():
    assert sum(summary_of(recorded(100)).share.values()) == pytest.approx(1.0, abs=1e-12)


def test_the_figures_follow_from_the_frames():
    recording = Recording()
    for i in range(100):
        row = dict.fromkeys(shared_columns(), 0.0)
        row |= {"force_z_n": -2.0 if i < 50 else 0.0, "frame_s": 1e-2 if i == 99 else 1e-4}
        recording.append([row[name] for name in shared_columns()])
    summary = summary_of(recording, wall_seconds=0.05)
    assert summary.simulated_seconds == pytest.approx(0.1)
    assert summary.real_time_factor == pytest.approx(2.0)
    assert summary.force_peak_n == 2.0
    assert summary.force_mean_n == 2.0  # over the frames in which there was a force
    assert summary.frame_rate_median == pytest.approx(1e4)
    assert summary.frame_rate_p99 == pytest.approx(
        1.0 / np.percentile(recording.column("frame_s"), 99)
    )


def test_a_run_that_ended_before_its_first_frame_has_a_summary_too():
    summary = summary_of(Recording(), wall_seconds=0.0)
    assert summary.simulated_seconds == summary.force_peak_n == summary.frame_rate_median == 0.0
    assert json.loads(json.dumps(summary._asdict(), allow_nan=False))["frames"] == 0


def test_a_row_that_a_killed_run_did_not_finish_is_left_out(tmp_path):
    """Also where the cut is within the last number, which could still be read."""
    path, rows = (
        tmp_path / "forces.csv",
        np.arange(2.0 * len(shared_columns())).reshape(2, -1) + 0.25,
    )
    lines = [",".join(shared_columns()), *(",".join(map(repr, row.tolist())) for row in rows)]
    whole = "\n".join(lines) + "\n"
    for n_lost in (1, 2, 40):
        path.write_text(whole[:-n_lost])
        np.testing.assert_array_equal(read_forces(path).rows, rows[:1])
    path.write_text(whole)
    np.testing.assert_array_equal(read_forces(path).rows, rows)


# Graspers


def recording_of_hands(*names: str, n_frames: int = 3) -> Recording:
    """Return a recording in which grasper i pulls with i + 1 newtons along x, and holds points."""
    others = [column for name in names for column in columns_in(grasper_quantities(name))]
    recording = Recording([*shared_columns(), *others])
    for frame in range(n_frames):
        row = dict.fromkeys(recording.columns, 0.0) | {"time_s": frame * DT, "frame_s": 1e-4}
        for i, name in enumerate(names):
            row |= {f"{name}_force_x_n": i + 1.0, f"{name}_torque_z_nm": 0.1 * frame}
            row |= {f"{name}_points": 7.0 if frame == 1 else 0.0}
        recording.append(list(row.values()))
    return recording


def test_columns_of_graspers_follow_after_all_others_and_are_read_again(tmp_path, plotter):
    recording = recording_of_hands("left", "helper_2")
    assert recording.columns[: len(shared_columns())] == shared_columns() and recording.hands == (
        "left",
        "helper_2",
    )
    outputs = Outputs(tmp_path, plotter, recording.columns)
    outputs.write_forces(recording, all_rows=True)
    outputs.close()
    found = read_forces(tmp_path / FORCES)
    assert found.columns == recording.columns
    np.testing.assert_array_equal(found.rows, recording.rows)
    np.testing.assert_array_equal(found.vector("helper_2_force")[0], [2.0, 0.0, 0.0])


def test_columns_are_found_by_name_in_older_files_and_in_those_of_other_instruments(tmp_path):
    path = tmp_path / FORCES
    without_stiffness = [name for name in shared_columns() if not name.startswith("stiffness")]
    columns = [*reversed(without_stiffness[1:]), "probe_opening_m"]
    row = ",".join(str(i) for i in range(1 + len(columns)))
    path.write_text(",".join(["time_s", *columns]) + f"\n{row}\n")
    found = read_forces(path)
    assert found.column("cut_area_m2") == [1 + columns.index("cut_area_m2")]
    assert found.column("probe_opening_m") == [len(columns)]
    assert found.hands == () and found.n_held == 0
    with pytest.raises(ValueError, match="stiffness_xx_n_m"):
        found.column("stiffness_xx_n_m")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("time_s,probe_opening_m\n1.0,2.0,3.0\n", "not as many numbers as columns"),
        (
            ",".join((*shared_columns(), "probe_force_x_n", "probe_force_y_n")) + "\n",
            "must be the columns of a run",
        ),
    ],
    ids=["a row of another length", "half a vector"],
)
def test_a_table_that_no_run_wrote_is_refused(text, why, tmp_path):
    path = tmp_path / FORCES
    path.write_text(text)
    with pytest.raises(ValueError, match=why):
        read_forces(path)


def test_the_summary_and_the_table_tell_what_each_grasper_felt():
    summary = summary_of(recording_of_hands("left"))
    assert summary.hands == [
        {
            "name": "left",
            "force_peak_n": 1.0,
            "torque_peak_nm": pytest.approx(0.2),
            "points_held_most": 7,
            "points_held_at_end": 0,
        }
    ]
    assert re.search("peak force, left.* 1.000 N, 7 points held at most", printed(summary))


def test_the_residual_is_over_the_work_of_all_hands():
    """Also of what a grasper lifted and put down again, which took no work in the end."""
    recording = recording_of_hands("left")
    recording.column("work_of_blade_j")[-1] = 1e-3
    recording.column("work_of_loads_j")[:] = [0.0, 3e-3, 0.0]
    recording.column("residual_j")[-1] = 1e-5
    assert summary_of(recording).residual_of_work == pytest.approx(1e-5 / 4e-3)
