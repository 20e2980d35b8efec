import json
import os
import pty
import re
import signal
import socket
import urllib.request
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.file_names import ENERGY_PLOT, RUN_FILES
from scalpel_sim.runs.run_folder import FRAMES_PER_FLUSH
from tests.support.processes import start, wait_for_rows
from tests.support.run_files import assert_same_run, names_in
from tissue import MATERIALS

HEADER = "t,tip_x,tip_y,tip_z,heel_x,heel_y,heel_z\n"

UNAUDITED = set(RUN_FILES) - {ENERGY_PLOT}
"""Files of a run without an energy audit."""

WRONG_USE = {
    "an unknown command": (["rnu"], "Did you mean .run."),
    "an unknown option": (["run", "slab", "--tougness", "3"], 'Did you mean "?--toughness'),
    "a word for a number": (["run", "slab", "--young", "soft"], "soft"),
    "a number below its range": (
        ["run", "slab", "--coupling", "virtual", "--coupling-stiffness", "-1"],
        "--coupling-stiffness is -1.0; it must be a number above 0",
    ),
    "a whole number beyond its range": (["run", "slab", "--tissue-every", "999"], "1 to 100"),
    "an infinite time": (["run", "slab", "--seconds", "inf"], "--seconds is inf"),
    "too many words": (["run", "slab", "grid2"], "grid2"),
    "an unknown scene": (["run", "slap"], "Did you mean 'slab'.*organ"),
    "a scene and a mesh": (["run", "slab", "--mesh", "{mesh}"], "choose one"),
    "a scale without a mesh": (["run", "slab", "--scale", "2"], "--mesh"),
    "a mesh that is not there": (["run", "--mesh", "nothing.msh"], "nothing.msh"),
    "a broken mesh": (["run", "--mesh", "{broken}"], "broken.msh"),
    "a mesh of no size": (["run", "--mesh", "{mesh}", "--scale", "0"], "--scale"),
    "a stroke file with a broken line": (["run", "slab", "--stroke", "{bad_stroke}"], "line 3"),
    "a stiffness of a coupling that has none": (
        ["run", "slab", "--coupling-stiffness", "500"],
        "--coupling-stiffness is for --coupling virtual",
    ),
    "a coupling without damping": (
        ["run", "slab", "--coupling", "virtual", "--coupling-damping", "0"],
        "damping is 0.0; it must be positive",
    ),
    "a speed of 0": (["run", "slab", "--speed", "0"], "speed"),
    "an unknown material": (["run", "slab", "--material", "livr"], "Did you mean 'liver'"),
    "a list of an unknown material": (["materials", "lung"], "Known: liver"),
    "springs of a law that has none": (
        ["run", "slab", "--law", "neo_hookean", "--calibrate"],
        "Add --law springs",
    ),
    "an unknown law": (
        ["run", "slab", "--law", "hooke"],
        '--law is hooke; it must be "springs" or "neo_hookean"',
    ),
    "a Prony series without a time": (
        ["run", "organ", "--prony", "0.3:0.1,0.2"],
        "the term '0.2'; write g:tau",
    ),
    "a bevel of a line": (
        ["run", "organ", "--blade-thickness", "0", "--blade-bevel", "10"],
        "--blade-bevel is about a blade with faces",
    ),
    "friction on a line": (
        ["run", "slab", "--blade-friction", "0.2"],
        "add --blade-thickness 0.0004",
    ),
    "a work to rupture of an edge without radius": (
        ["run", "organ", "--work-to-rupture", "1e4", "--blade-edge-radius", "0"],
        "add --blade-edge-radius",
    ),
    "an audit of a hierarchical relaxation": (
        ["run", "slab", "--audit", "--relaxation", "hierarchical"],
        "--audit needs --relaxation global or verlet",
    ),
    "the hierarchy on two threads": (
        ["run", "slab", "--relaxation", "hierarchical", "--threads", "2"],
        "--threads 2 is for --relaxation global or verlet; hierarchical runs on one",
    ),
    "a figure by an unknown scheme": (
        ["figure", "10", "--scheme", "mine"],
        "Known: stellar, paper",
    ),
    "an output folder that is a file": (["run", "slab", "--out", "{text}"], "is a file"),
    "an invalid address": (["run", "--connect", "here"], "here"),
    "a material for a tissue elsewhere": (
        ["run", "--connect", "127.0.0.1:1", "--young", "1e4"],
        "scalpel-sim serve",
    ),
    "a host that others can reach": (
        ["serve", "grid2", "--host", "0.0.0.0"],
        "'0.0.0.0' is open to other machines, and that takes a key",
    ),
    "another machine without a key": (
        ["run", "--connect", "192.0.2.1:8766"],
        "another machine, and that takes a key",
    ),
    "a key for no server": (["run", "grid2", "--key", "{text}"], "add --connect"),
    "a key written over a file": (["key", "{text}"], "exists already"),
    "a port that does not exist": (["view", "grid2", "--port", "99999"], "99999"),
}

TETRAHEDRON = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
4
1 0 0 0
2 0.01 0 0
3 0 0.01 0
4 0 0 0.01
$EndNodes
$Elements
1
1 4 0 {nodes}
$EndElements
"""


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Run in a folder of its own, with one file of each kind."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mesh.msh").write_text(TETRAHEDRON.format(nodes="1 2 3 4"))
    (tmp_path / "broken.msh").write_text(TETRAHEDRON.format(nodes="1 2 3 9"))
    (tmp_path / "text.stl").write_text("solid nothing")
    (tmp_path / "bad.csv").write_text(HEADER + "0,0,0,0,0,0,1\n1,0,0,x,0,0,1\n")
    return {
        "mesh": "mesh.msh",
        "broken": "broken.msh",
        "text": "text.stl",
        "folder": str(tmp_path),
        "bad_stroke": "bad.csv",
    }


def only_line(text: str) -> str:
    (line,) = text.splitlines()
    return line


@pytest.mark.parametrize("case", WRONG_USE)
def test_wrong_use_gets_one_line_and_exit_code_2(case, files, capsys):
    words, expected = WRONG_USE[case]
    code = command_line([word.format(**files) for word in words])
    out, err = capsys.readouterr()
    line = only_line("\n".join(x for x in err.splitlines() if not x.startswith("compiling")))
    assert (code, out) == (2, "")
    assert re.match(f"error: .*{expected.format(**files)}", line)
    assert "Traceback" not in err


def test_a_run_that_starts_before_its_server_waits_for_it_and_says_so(monkeypatch, capsys):
    monkeypatch.setattr("scalpel_sim.cli.run_setup.SERVER_PATIENCE", 0.3)
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{unused.getsockname()[1]}"
    assert command_line(["run", "--connect", address]) == 1
    waits, failed = capsys.readouterr().err.splitlines()
    assert f"no tissue is served at {address} yet; waiting for it, up to 0.3 s" in waits
    assert failed.startswith(f"error: no tissue is served at {address}")


@pytest.mark.parametrize("command", ["serve", "view"])
def test_a_port_in_use_is_a_failed_run(command, files, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert command_line([command, "grid2", "--port", port]) == 1
    line = capsys.readouterr().err.splitlines()[-1]
    assert re.match(f"error: .*{port}.*in use", line)


def test_a_folder_that_cannot_be_written_is_a_failed_run_before_it_begins(files, capsys):
    assert command_line(["run", "slab", "--out", "/proc/nothing"]) == 1
    assert "cannot be written" in only_line(capsys.readouterr().err)


def test_verbose_shows_where_an_error_came_from(files, capsys):
    assert command_line(["run", "slap", "-v"]) == 2
    err = capsys.readouterr().err
    assert "Traceback" in err and err.splitlines()[-1].startswith("error: no scene")


def test_a_run_prints_a_table_and_writes_every_file(files, capsys):
    assert command_line(["run", "slab", "--seconds", "0.05"]) == 0
    out, err = capsys.readouterr()
    for words in ("real-time factor", "tetrahedra after", "RX", "path error"):
        assert words in out
    assert names_in("out/slab") == sorted(RUN_FILES)
    assert "\x1b" not in out + err  # neither colours nor a progress bar off a terminal


def test_json_prints_the_summary_alone_whose_keys_are_those_that_are_documented(files, capsys):
    """They stay: programs read them. A new one is added to the page."""
    page = (Path(__file__).parents[3] / "docs" / "results.md").read_text(encoding="utf-8")
    words = ["run", "grid2", "--seconds", "0.02", "--json", "--out", "here"]
    assert command_line(words) == 0
    printed = json.loads(capsys.readouterr().out)
    with open("here/summary.json") as file:
        assert json.load(file) == printed
    assert list(printed) == re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)
    assert (printed["scene"], printed["frames"]) == ("grid2", 20)
    assert printed["settings"]["arm"] == "touch"  # what auto resolved to
    assert printed["simulated_seconds"] == pytest.approx(0.02)


def test_quiet_prints_nothing(files, capsys):
    assert command_line(["run", "grid2", "--seconds", "0.01", "-q"]) == 0
    assert capsys.readouterr() == ("", "")


def test_the_coupling_of_the_command_line_reaches_the_arm(files, capsys):
    coupling_options = "--tissue-every 10 --coupling virtual --coupling-stiffness 900"
    line = ["run", "grid2", "--seconds", "0.5", "--json", "--out", "soft"]
    assert command_line([*line, *coupling_options.split(), "--no-passivity"]) == 0
    summary = json.loads(capsys.readouterr().out)
    settings, counters = summary["settings"], summary["counters"]
    assert (settings["tissue_every"], settings["coupling"]) == (10, "virtual")
    assert (settings["coupling_stiffness"], settings["passivity"]) == (900.0, False)
    assert (counters["frames"], counters["answers"]) == (500, 50)
    assert set(counters["passivity"]) == {"energy", "least_energy", "injected_away", "frames"}


def test_a_named_material_reaches_the_tissue_with_what_is_changed_about_it(files, capsys):
    words = ["run", "grid2", "--seconds", "0.01", "--json", "--material", "gelatin"]
    assert command_line([*words, "--toughness", "7"]) == 0
    material = json.loads(capsys.readouterr().out)["settings"]["material"]
    assert material["young_modulus"] == MATERIALS["gelatin"].young_modulus.value
    assert (material["law"], material["toughness"]) == ("neo_hookean", 7.0)


def test_a_blade_on_the_command_line_has_faces_that_the_tissue_presses_and_rubs(files, capsys):
    words = ["run", "grid2", "--seconds", "0.8", "--json", "--blade-thickness", "0.002"]
    assert command_line([*words, "--blade-bevel", "20", "--blade-friction", "0.3"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["settings"]["blade"]["thickness"] == 0.002
    assert summary["settings"]["blade"]["bevel_angle"] == pytest.approx(np.radians(20.0))
    assert summary["energies_j"]["friction"] > 1e-5
    assert abs(summary["residual_of_work"]) < 0.005
    table = read_forces(Path("out/grid2/forces.csv"))
    for name in ("pressing_force", "friction_force"):
        assert np.linalg.norm(table.vector(name), axis=1).max() > 5e-3


def test_materials_are_listed_with_their_sources(capsys):
    assert command_line(["materials"]) == 0
    out = capsys.readouterr().out
    for preset in MATERIALS.values():
        assert preset.name in out
    assert "Gokgol et al. 2012" in out
    assert command_line(["materials", "liver", "--json"]) == 0
    (liver,) = json.loads(capsys.readouterr().out)
    assert liver["toughness"]["value"] == MATERIALS["liver"].material.toughness


def test_the_error_of_springs_is_reported_on_request_and_removed_by_calibration(files, capsys):
    words = ["run", "slab", "--young", "2e4", "--seconds", "0.01"]
    assert command_line([*words, "--spring-error", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["settings"]["springs"]["poisson_ratio"] < 0.05
    assert command_line([*words, "--calibrate", "--json"]) == 0
    springs = json.loads(capsys.readouterr().out)["settings"]["springs"]
    assert springs["young_modulus_pa"] == pytest.approx(2e4, rel=1e-4)
    assert springs["calibration"] == pytest.approx(29 / 30, rel=1e-3)


def test_snap_and_guard_trade_the_path_of_the_cut_against_the_time_step(files, capsys):
    def quality_with(*words):
        cut = ["run", "grid2", "--stroke", "curved", "--seconds", "0.9", "--json", *words]
        assert command_line(cut) == 0
        return json.loads(capsys.readouterr().out)["quality"]

    rough = quality_with("--snap", "0.6", "--guard", "0.3")
    fine = quality_with("--snap", "0.02", "--guard", "0.01")
    assert rough["guard_m"] <= rough["smallest_altitude_m"]
    assert fine["path_error_mean_m"] < rough["path_error_mean_m"]
    assert fine["substep_growth"] > rough["substep_growth"] >= 1.0


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["--version"]])
def test_help_and_version_are_no_errors(words, capsys):
    assert command_line(words) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.end_to_end
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_run_keeps_what_it_did(number, tmp_path):
    folder = tmp_path / "run"
    program = start("run", "grid2", "--seconds", "1000", "--out", str(folder))
    forces = folder / "forces.csv"
    wait_for_rows(program, forces)
    program.send_signal(number)
    _, err = program.communicate(timeout=60)
    assert program.returncode == 1
    assert re.match(
        f"error: interrupted by {number.name} after .* holds what .*; --resume .*/run continues",
        err.splitlines()[-1],
    )
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == f"interrupted by {number.name}"
    assert summary["frames"] == len(read_forces(forces)) >= FRAMES_PER_FLUSH
    assert names_in(folder) == sorted(RUN_FILES)


def test_an_arm_and_a_tissue_in_two_processes_give_the_same_bits(tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    assert command_line(["run", "grid2", "--seconds", "0.9", "-q", "--out", str(here)]) == 0
    key = str(tmp_path / "link.key")
    assert command_line(["key", key]) == 0
    server = start("serve", "grid2", "--audit", "--port", "0", "--key", key)
    try:
        address = re.search(r"127\.0\.0\.1:\d+", server.stdout.readline()).group()
        words = ["run", "--connect", address, "--seconds", "0.9", "-q", "--out", str(there)]
        assert command_line(words) == 1  # without the key
        words += ["--key", key]
        assert command_line(words) == 0
    finally:
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=60)
    assert server.returncode == 0
    ours = read_forces(here / "forces.csv")
    assert ours.column("cut_area_m2").max() > 0.0
    assert ours.is_audited  # so that no number is a NaN
    assert_same_run(here, there)
    assert json.loads((there / "summary.json").read_text())["scene"] == "grid2"
    # The client does not know how the server's tissue is held: it writes no scene.
    assert (here / "scene.toml").exists() and not (there / "scene.toml").exists()


@pytest.mark.parametrize("stroke", ["straight", "curved"])
def test_the_arm_cuts_the_organ_in_two(tmp_path, stroke):
    words = ["run", "organ", "--no-audit", "--stroke", stroke, "-q", "--out", str(tmp_path)]
    assert command_line(words) == 0
    assert json.loads((tmp_path / "summary.json").read_text())["pieces"] == 2


@pytest.mark.end_to_end
def test_view_shows_the_run_and_stays_until_it_is_interrupted(tmp_path):
    program = start("view", "grid2", "--seconds", "0.3", "--out", str(tmp_path))
    log = ""
    while "stays until Ctrl-C" not in log:
        line = program.stderr.readline()
        assert line, f"it ended: {log}"
        log += line
    url = re.search(r"live at (http://127\.0\.0\.1:\d+/)", log).group(1)
    with urllib.request.urlopen(url, timeout=10) as page:
        assert "grid2: straight stroke" in page.read().decode()
    assert names_in(tmp_path) == sorted(UNAUDITED)
    program.send_signal(signal.SIGINT)
    out, _ = program.communicate(timeout=30)
    assert program.returncode == 0
    assert "tetrahedra after" in out


@pytest.mark.end_to_end
def test_view_waits_for_enter_at_a_terminal(tmp_path):
    ours, theirs = pty.openpty()
    program = start("view", "grid2", "--seconds", "0.1", "--out", str(tmp_path), stdin=theirs)
    try:
        while "press Enter" not in (line := program.stderr.readline()):
            assert line, "it ended"
        assert not (tmp_path / "forces.csv").exists()
        os.write(ours, b"\n")
        while "stays until Ctrl-C" not in (line := program.stderr.readline()):
            assert line, "it ended"
        assert len(read_forces(tmp_path / "forces.csv")) == 100
    finally:
        program.terminate()
        program.communicate(timeout=30)
        os.close(ours)
        os.close(theirs)
