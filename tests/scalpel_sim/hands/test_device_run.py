"""`scalpel-sim run --hand device`, led by a fake device from another process."""

import json
import os
import re
import signal
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from bridge import DeviceClient, LinkError, write_new_key
from bridge.tcp.keys import read_key
from scalpel_sim.cli.app import command_line
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.file_names import FORCES, INITIAL, REPORT, STROKE, SUMMARY
from scalpel_sim.scene.task_table import SuccessTable, TaskTable
from scalpel_sim.scene.write import scene_text
from tests.scalpel_sim.hands.device_runs import lead_forwards
from tests.scalpel_sim.hands.driven_runs import GRID2
from tests.scalpel_sim.hands.driven_view import DeviceRunProcess, assert_a_run_repeats

pytestmark = pytest.mark.end_to_end


def test_devices_lead_a_cut_in_turn_until_one_ends_it_and_a_run_repeats_it_to_the_bit(tmp_path):
    with DeviceRunProcess("run", tmp_path / "led", "--tissue-every", "2") as run:
        for _ in range(2):
            with device_once_free(run.address) as client:
                assert client.description.scene == "grid2"
                wait_for_frames(client)
                lead_forwards(client, 0.012)
        with device_once_free(run.address) as client:
            wait_for_frames(client)
            lead_forwards(client, 1e-3)
            client.end()
        counts = re.findall(r"(\d+)", run.line_with("periods missed"))
        assert len(counts) == 3 and counts[2] == "0"
        assert run.process.wait(60) == 0
    summary = json.loads((run.folder / SUMMARY).read_text())
    assert summary["status"] == "complete" and summary["settings"]["tissue_every"] == 2
    forces = read_forces(run.folder / FORCES)
    assert np.ptp(forces.rows[:, shared_columns().index("tip_y_m")]) > 0.02
    assert summary["cut_area_m2"] > 0.0
    engaged = np.genfromtxt(run.folder / STROKE, delimiter=",", names=True)["engaged"]
    assert np.count_nonzero(np.diff(engaged) > 0.0) >= 2, "it was taken hold of anew"
    assert_a_run_repeats(run.folder, tmp_path / "again")


def test_what_a_device_did_is_scored_reported_and_repeated_with_the_same_score(tmp_path):
    task = TaskTable(success=SuccessTable(off_plan=1e-3))
    scene = tmp_path / "scored.toml"
    scene.write_text(scene_text(structs.replace(GRID2, task=task, seconds=None), scene))
    again = tmp_path / "again"
    with DeviceRunProcess("run", tmp_path / "led", scene=str(scene)) as run:
        with DeviceClient(run.address) as client:
            wait_for_frames(client)
            lead_forwards(client, 0.025)
            client.end()
        assert run.process.wait(60) == 0
    summary = json.loads((run.folder / SUMMARY).read_text())
    score = summary["score"]
    assert score["terms"]["cut_area"] == pytest.approx(summary["cut_area_m2"], rel=1e-9)
    assert 0.0 < score["terms"]["covered"] < 1.0
    assert score["success"] is True
    (blade,) = score["instruments"]
    assert 0.015 < blade["path_length_m"] < 0.03  # from control step to control step
    assert blade["force_n"] == pytest.approx(summary["force_peak_n"], rel=1e-9)
    assert "Planned cut that is open" in (run.folder / REPORT).read_text()
    assert_a_run_repeats(run.folder, again)
    assert json.loads((again / SUMMARY).read_text())["score"] == score


def wait_for_frames(client):
    """Wait until frames have been done in which nobody held the blade, once the run has begun."""
    begun = client.measured().time
    while begun > 0.0 and client.measured().time < begun + 0.01:
        pass


def device_once_free(address):
    """Return a client, as soon as the run has noticed that the last one has left."""
    for _ in range(1000):
        try:
            return DeviceClient(address)
        except LinkError as error:
            assert "has the blade" in str(error)
    raise AssertionError("the run never released its device")


def test_a_run_ends_with_its_device_where_that_is_asked_for(tmp_path):
    with DeviceRunProcess("run", tmp_path, "--client-stops", "end", "--watchdog", "0.1") as run:
        with DeviceClient(run.address) as client:
            assert client.description.watchdog == 0.1
            lead_forwards(client, 4e-3)
        assert run.process.wait(60) == 0
    assert json.loads((tmp_path / SUMMARY).read_text())["status"] == "complete"


def test_a_device_needs_the_key_of_the_run(tmp_path):
    key = tmp_path / "device.key"
    write_new_key(key)
    with DeviceRunProcess("run", tmp_path / "led", "--listen-key", str(key)) as run:
        with pytest.raises(LinkError, match="requires a key"):
            DeviceClient(run.address)
        with DeviceClient(run.address, key=read_key(key)) as client:
            lead_forwards(client, 1e-3)
            client.end()
        assert run.process.wait(60) == 0


def test_the_page_shows_a_run_that_a_device_leads(tmp_path):
    with DeviceRunProcess("view", tmp_path, "--seconds", "0.3") as run:
        with DeviceClient(run.address) as client:
            lead_forwards(client, 1.0)
        run.line_with("stays until Ctrl-C")
        run.process.send_signal(signal.SIGINT)
        assert run.process.wait(60) == 0
    assert json.loads((tmp_path / SUMMARY).read_text())["simulated_seconds"] < 1.0


def test_a_run_that_waits_for_a_device_has_its_first_files_and_leaves_none_where_it_ends(tmp_path):
    with DeviceRunProcess("run", tmp_path) as run:
        assert (tmp_path / INITIAL).exists()
        run.process.send_signal(signal.SIGINT)
        run.line_with("before a device took hold of the blade")
        assert run.process.wait(30) == 1
    assert [path.name for path in tmp_path.iterdir() if not path.name.startswith(".")] == []


def test_a_run_whose_answers_end_keeps_what_was_done_and_says_so(tmp_path):
    with DeviceRunProcess("run", tmp_path) as run:
        with DeviceClient(run.address) as client:
            lead_forwards(client, 1e-3)
            children = Path(f"/proc/{run.process.pid}/task/{run.process.pid}/children")
            for pid in children.read_text().split():
                if b"answer_a_device" in Path(f"/proc/{pid}/cmdline").read_bytes():
                    os.kill(int(pid), signal.SIGKILL)
        run.line_with("the process that answers the device has ended")
        assert run.process.wait(60) == 1
    assert json.loads((tmp_path / SUMMARY).read_text())["status"].startswith("failed")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--listen", "127.0.0.1:0"], "--listen is for a device that leads; add --hand device"),
        (["--hand", "device", "--watchdog", "0"], "--watchdog 0 is out of range"),
        (["--hand", "device", "--watchdog", "nan"], "--watchdog nan is out of range"),
        (["--hand", "device", "--listen", "here"], "'here' is not an address"),
        (["--hand", "device", "--listen", "0.0.0.0:0"], "open to other machines"),
    ],
)
def test_wrong_options_of_a_device_are_one_clear_error(options, message, tmp_path, capsys):
    assert command_line(["run", "grid2", *options, "--out", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
