import csv
import functools
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from rich.console import Console

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.plots import (
    HAND_COLOURS,
    LIMITED,
    OPACITY,
    PARTS,
    plot_energies,
    plot_forces,
)
from scalpel_sim.output.report import print_summary
from scalpel_sim.output.run_outcome import RunOutcome
from scalpel_sim.output.summary import Summary, summarise, summary_json
from scalpel_sim.recording.columns import columns_in, grasper_quantities, shared_columns
from scalpel_sim.recording.recording import TERMS, Recording, read_forces
from scalpel_sim.runs.file_names import ENERGY_PLOT, FORCES, PLOT, SUMMARY
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
    return Snapshot(corners, corners.copy(), np.zeros((8, 3)), np.ones(8), tetrahedra, is_held)


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
            first=None,
            last=body(),
            report=CUT_REPORT,
            wall_seconds=wall_seconds,
            tetrahedra_final=8,
            asked_area=2.5e-4,
            counters=counters,
        )
    )


def test_forces_csv_reads_back_to_the_same_bits(tmp_path, plotter):
    recording = recorded(250)
    outputs = Outputs(tmp_path, plotter)
    outputs.write_forces(recording, all_rows=True)
    with (tmp_path / FORCES).open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == list(shared_columns())
    assert np.array_equal(np.array(rows, float), recording.rows)


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


def test_a_path_that_is_a_file_is_wrong_use(tmp_path, plotter):
    file = tmp_path / "file"
    file.write_text("mine")
    for path in (file, file / "below"):
        with pytest.raises(UsageError, match="is a file"):
            Outputs(path, plotter)
    assert file.read_text() == "mine"


def test_a_folder_that_cannot_be_made_is_a_failed_run(plotter):
    with pytest.raises(RunError, match=r"^/proc/nothing: cannot be written \("):
        Outputs(Path("/proc/nothing"), plotter)


def test_the_plot_is_a_picture_that_shows_the_force(tmp_path, plotter):
    image = pytest.importorskip("PIL.Image")
    outputs = Outputs(tmp_path, plotter)
    outputs.write_forces(recorded(50), all_rows=True)
    outputs.start_plots("block: straight stroke")
    outputs.finish_plots()
    with image.open(tmp_path / PLOT) as picture:
        pixels = np.asarray(picture.convert("RGB"))
    assert pixels.shape[0] > 500 and pixels.shape[1] > 800
    assert (pixels == (0x22, 0x22, 0x22)).all(axis=2).sum() > 500  # the magnitude's line


def test_the_plot_shows_what_the_force_is_made_of_and_where_the_device_limits_it(tmp_path):
    plain, limited = zero_recording(), zero_recording()
    for name in ("force_z_n", "tissue_force_z_n"):
        plain.column(name)[:] = limited.column(name)[:] = 2.0
    limited.column("tissue_force_z_n")[50:] = 4.0
    edge = zero_recording()
    edge.column("edge_force_x_n")[:] = 1.0
    plot_forces(plain, "plain", tmp_path / "plain.png")
    plot_forces(limited, "limited", tmp_path / "limited.png")
    plot_forces(edge, "edge", tmp_path / "edge.png")
    assert n_of_colour(tmp_path / "plain.png", LIMITED) < n_of_colour(
        tmp_path / "limited.png", LIMITED
    )
    (_, _, edge_colour), *_ = PARTS
    assert n_of_colour(tmp_path / "edge.png", edge_colour) > 500


def test_heights_in_the_energy_plot_are_energies(tmp_path):
    recording = zero_recording()
    recording.column("work_of_blade_j")[:] = 3e-3
    recording.column("cutting_j")[:] = 2e-3
    recording.column("damping_j")[:] = 1e-3
    plot_energies(recording, "block", tmp_path / ENERGY_PLOT)
    cutting, damping = (
        n_of_colour(tmp_path / ENERGY_PLOT, on_white(colour_of(name)))
        for name in ("cutting", "damping")
    )
    assert cutting > 10_000
    assert cutting == pytest.approx(2 * damping, rel=0.1)


def test_the_labels_of_the_energy_plot_are_whole_however_small_the_residual_is(tmp_path):
    recording = zero_recording()
    recording.column("work_of_blade_j")[:] = 1.0
    recording.column("residual_j")[:] = np.linspace(0.0, -4e-5, 100)  # ticks such as -0.004 %
    plot_energies(recording, "block", tmp_path / ENERGY_PLOT)
    picture = imread(tmp_path / ENERGY_PLOT)
    assert (picture[:, :4] == 1.0).all(), "the left edge is white"


def test_without_an_account_there_is_no_energy_plot(tmp_path):
    recording = zero_recording()
    recording.column("residual_j")[:] = np.nan
    with Plotter() as plotter:
        outputs = Outputs(tmp_path, plotter)
        outputs.write_forces(recording, all_rows=True)
        outputs.start_plots("block: straight stroke")
        outputs.finish_plots()
    assert (tmp_path / PLOT).exists() and not (tmp_path / ENERGY_PLOT).exists()


def zero_recording(n_frames: int = 100) -> Recording:
    """Return a recording of zeros, to be filled in."""
    recording = Recording()
    for i in range(n_frames):
        row = dict.fromkeys(shared_columns(), 0.0) | {"time_s": i * DT, "frame_s": 1e-4}
        recording.append(list(row.values()))
    return recording


def n_of_colour(path: Path, colour: str) -> int:
    """Return the number of pixels of a picture that have nearly a given colour."""
    image = pytest.importorskip("PIL.Image")
    with image.open(path) as picture:
        pixels = np.asarray(picture.convert("RGB"), int)
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(pixels - wanted).max(axis=2) <= 3).sum())


def colour_of(name: str) -> str:
    return next(term.colour for term in TERMS if term.name == name)


def on_white(colour: str) -> str:
    """Return how a colour of the stack appears on a white background."""
    channels = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    seen = (round(OPACITY * channel + (1.0 - OPACITY) * 255) for channel in channels)
    return "#" + "".join(f"{channel:02x}" for channel in seen)


def test_the_summary_has_every_documented_key(tmp_path, plotter):
    outputs = Outputs(tmp_path, plotter)
    outputs.write_summary(summary_of(recorded(10)))
    found = json.loads((tmp_path / SUMMARY).read_text())
    documented = (
        "scene simulated_seconds wall_seconds real_time_factor frame_rate_median "
        "frame_rate_p99 tetrahedra_initial tetrahedra_final pieces quality cut_area_m2 "
        "asked_area_m2 finished_area_m2 force_peak_n "
        "force_mean_n work_of_blade_j share versions"
    )
    assert set(documented.split()) <= set(found)
    assert {"RX", "RD", "GC", "CD"} <= set(found["share"])
    assert {"scalpel_sim", "python", "numpy", "numba", "mujoco", "platform"} <= set(
        found["versions"]
    )


def test_the_summary_lists_each_piece():
    summary = json.loads(summary_json(summary_of(recorded(10))))
    assert summary["pieces"] == len(summary["each_piece"]) == 2
    assert [piece["held"] for piece in summary["each_piece"]] == [False, True]
    first = summary["each_piece"][0]
    assert first["volume_m3"] == pytest.approx(1 / 6) and first["mass_kg"] == 4.0
    assert first["centre_m"] == [0.25] * 3 and np.shape(first["inertia_kg_m2"]) == (3, 3)


def test_the_table_has_a_row_for_each_piece():
    console = Console(record=True, width=100)
    print_summary(summary_of(recorded(10)), console)
    text = console.export_text()
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
    console = Console(record=True, width=120)
    summary = summary_of(recorded(10), wall_seconds)
    summary.settings.update(settings)
    print_summary(summary, console)
    (row,) = (x for x in console.export_text().splitlines() if "real-time factor" in x)
    assert row.strip(" │|").endswith(words)


def test_the_table_reports_frames_that_were_limited_or_damped():
    console = Console(record=True, width=100)
    passivity = {"energy": 0.0, "least_energy": -5e-7, "injected_away": 2e-3, "frames": 12}
    print_summary(
        summary_of(recorded(10), force_limited=1234, silent=0, passivity=passivity), console
    )
    text = console.export_text()
    assert re.search("force above the device's limit.*1,234 frames", text)
    assert re.search("damped for passivity.*12 frames, 2 mJ", text)
    assert "silent" not in text


def test_the_summary_has_the_trade_between_path_error_and_time_step():
    found = summary_of(recorded(10)).quality
    assert found["path_error_mean_node_sizes"] == pytest.approx(0.05)
    assert found["path_error_largest_node_sizes"] == pytest.approx(0.3)
    assert found["tetrahedra_growth"] == pytest.approx(1.5)
    assert found["frequency_growth"] == pytest.approx(3.0)
    assert found["substep_growth"] == pytest.approx(4.0)


def test_the_summary_and_the_table_tell_the_mass_that_slivers_got():
    console = Console(record=True, width=100)
    summary = summary_of(recorded(10))
    print_summary(summary, console)
    assert summary.quality["added_mass"] == 1e-3
    assert summary.quality["most_added_mass"] == 2e-3
    assert re.search("mass added to light nodes.* 0.1 %", console.export_text())


def test_the_summary_and_the_table_tell_which_share_of_the_area_asked_for_was_cut():
    recording = zero_recording()
    recording.column("cut_area_m2")[-1] = 2.4e-4
    summary = summary_of(recording)
    assert summary.asked_area_m2 == 2.5e-4
    for given, expected in ((summary, True), (summary._replace(asked_area_m2=None), False)):
        console = Console(record=True, width=100)
        print_summary(given, console)
        assert ("240 mm², 96% of what is asked" in console.export_text()) == expected


@pytest.mark.parametrize(("area", "expected"), [(1.25e-5, "12.5 mm² of the cut"), (0.0, None)])
def test_the_table_tells_the_area_of_the_bridges_that_were_finished(area, expected):
    recording = zero_recording()
    recording.column("cut_area_m2")[-1] = 2.5e-4
    recording.column("finished_area_m2")[-1] = area
    summary = summary_of(recording)
    assert summary.finished_area_m2 == area
    console = Console(record=True, width=100)
    print_summary(summary, console)
    found = re.search("bridges finished .*?([0-9.]+ mm² of the cut)", console.export_text())
    assert (found and found[1]) == expected


@pytest.mark.parametrize(
    ("material", "paid"),
    [({"toughness": 20.0}, 2e-4), ({"toughness": 20.0, "skin_toughness": 40.0}, None), ({}, None)],
)
def test_the_table_tells_which_area_the_blade_paid_for(material, paid):
    recording = zero_recording()
    recording.column("cutting_j")[-1] = 4e-3
    recording.column("cut_area_m2")[-1] = 2.5e-4
    summary = summary_of(recording, material=material)
    assert summary.cut_area_paid_m2 == paid
    console = Console(record=True, width=100)
    print_summary(summary, console)
    found = re.search(
        "area paid for.* 200 mm², 80% of the cut: more than 5% off", console.export_text()
    )
    assert (found is not None) == (paid is not None)


def test_the_summary_and_the_table_tell_how_many_tetrahedra_are_inside_out():
    console = Console(record=True, width=100)
    summary = summary_of(recorded(10))
    print_summary(summary, console)
    assert summary.quality["inverted"] == 2 / 9
    assert re.search("tetrahedra inside out.* 22 %", console.export_text())


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
    console = Console(record=True, width=100)
    recording = zero_recording()
    recording.column("work_of_blade_j")[-1] = 4e-3
    recording.column("friction_j")[-1] = 1e-3
    print_summary(summary_of(recording), console)
    (row,) = [line for line in console.export_text().splitlines() if "friction on" in line]
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


def test_a_table_with_half_a_vector_is_refused(tmp_path):
    path = tmp_path / FORCES
    path.write_text(",".join((*shared_columns(), "probe_force_x_n", "probe_force_y_n")) + "\n")
    with pytest.raises(ValueError, match="must be the columns of a run"):
        read_forces(path)


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


def test_rows_of_another_length_than_the_first_line_are_refused(tmp_path):
    path = tmp_path / FORCES
    path.write_text("time_s,probe_opening_m\n1.0,2.0,3.0\n")
    with pytest.raises(ValueError, match="not as many numbers as columns"):
        read_forces(path)


def test_the_summary_and_the_table_tell_what_each_grasper_felt():
    console = Console(record=True, width=100)
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
    print_summary(summary, console)
    assert re.search("peak force, left.* 1.000 N, 7 points held at most", console.export_text())


def test_the_picture_of_the_forces_has_a_line_for_each_grasper(tmp_path):
    plain, with_hand = tmp_path / "plain.png", tmp_path / "hand.png"
    plot_forces(zero_recording(30), "one hand", plain)
    plot_forces(recording_of_hands("left", n_frames=30), "two hands", with_hand)
    assert n_of_colour(with_hand, HAND_COLOURS[0]) > 100 + n_of_colour(plain, HAND_COLOURS[0])


def test_the_residual_is_over_the_work_of_all_hands():
    """Also of what a grasper lifted and put down again, which took no work in the end."""
    recording = recording_of_hands("left")
    recording.column("work_of_blade_j")[-1] = 1e-3
    recording.column("work_of_loads_j")[:] = [0.0, 3e-3, 0.0]
    recording.column("residual_j")[-1] = 1e-5
    assert summary_of(recording).residual_of_work == pytest.approx(1e-5 / 4e-3)
