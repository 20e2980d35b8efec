"""`scalpel-sim doctor` says what is there, what a lack costs, and how fast the scenes will be."""

import importlib.metadata
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from scalpel_sim.cli import doctor_command
from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.doctor_command import Health, Lack, print_health
from scalpel_sim.errors import EXIT_OK, EXIT_RUN_FAILED
from scalpel_sim.runs.warm_up import KernelSet, compile_ahead
from scalpel_sim.scene.read import DEFAULT_SCENE, SCENES
from scalpel_sim.validate.speed.expected import as_run, expected_factors, scene_costs
from tissue.support import cache_directory

ROOT = Path(__file__).parents[3]

HEALTHY = Health(
    versions={"scalpel-sim": "1.2", "python": "3.11.7", "numpy": "2.4.6"},
    machine={
        "processor": "Cray-1",
        "simd": "x86-64-v3",
        "clock_hz": 4e9,
        "cores": 4,
        "usable_cores": 1.5,
        "load": 0.2,
    },
    kernels={
        "folder": "/here/kernels",
        "kernels": 1200,
        "bytes": 12_300_000,
        "compiled_for": ["organ", "slab"],
        "not_compiled_for": ["grid2"],
    },
    browser="/usr/bin/firefox",
    renderer="llvmpipe, OpenGL 4.5",
    ffmpeg="/usr/bin/ffmpeg",
    reference_frame_s=0.5e-3,
    real_time_factors=expected_factors(0.5e-3, scene_costs()),
    lacks=[],
)


def text_of(health, capsys, width=80):
    print_health(health, Console(width=width))
    return capsys.readouterr().out


def examined(capsys):
    """Return what the command prints as JSON, and its exit code."""
    code = command_line(["doctor", "--json"])
    return json.loads(capsys.readouterr().out), code


def test_it_measures_one_number_and_predicts_every_scene_from_it(capsys):
    compile_ahead([KernelSet.of(as_run(SCENES[DEFAULT_SCENE]))])
    found, code = examined(capsys)
    assert code == EXIT_OK
    reference = found["reference_frame_s"]
    assert found["real_time_factors"] == expected_factors(reference, scene_costs())
    assert list(found["real_time_factors"]) == list(SCENES)
    assert found["kernels"]["folder"] == str(cache_directory()) and found["kernels"]["bytes"] > 1e6
    assert DEFAULT_SCENE in found["kernels"]["compiled_for"]
    assert found["machine"]["clock_hz"] > 0.0 and found["machine"]["usable_cores"] > 0.0
    assert {"scalpel-sim", "python", "numpy", "numba", "mujoco", "meshcat"} < set(found["versions"])


@pytest.mark.parametrize("width", [80, 100])
def test_the_page_names_what_is_there_and_fits_the_terminal(width, capsys):
    text = text_of(HEALTHY, capsys, width)
    words_of_text = " ".join(text.split())
    for words in (
        *("scalpel-sim 1.2", "numpy 2.4.6", "Cray-1, x86-64-v3, 4.0 GHz", "1.5 for this process"),
        *("1200 compiled, 12.3 MB", "/here/kernels", "for all scenes but grid2"),
        *("llvmpipe, OpenGL 4.5", "/usr/bin/ffmpeg", "/usr/bin/firefox", "0.50 ms", *SCENES),
    ):
        assert words in words_of_text
    assert "missing" not in text
    assert max(map(len, text.splitlines())) <= width


def test_a_factor_has_the_digits_that_are_known(capsys):
    factors = {"a": 0.3456, "b": 3.456, "c": 34.56}
    text = text_of(HEALTHY._replace(real_time_factors=factors), capsys)
    assert text.splitlines()[-1].split() == ["a", "0.35", "b", "3.5", "c", "35"]


def test_on_a_busy_machine_it_says_that_a_quiet_one_is_faster(capsys):
    busy = HEALTHY._replace(machine=HEALTHY.machine | {"load": 3.0})
    assert "3.0 programs" in text_of(busy, capsys, 200)
    assert "a quiet machine is faster" in text_of(busy, capsys, 200)
    assert "a quiet machine is faster" not in text_of(HEALTHY, capsys, 200)


def test_with_an_empty_cache_nothing_is_compiled_and_it_says_how_to(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    found, code = examined(capsys)
    assert code == EXIT_OK
    assert found["reference_frame_s"] is None and found["real_time_factors"] == {}
    assert found["kernels"]["compiled_for"] == []
    (lack,) = (each for each in found["lacks"] if "compiled" in each["what"])
    assert "scalpel-sim warm-up" in lack["cost"]
    assert command_line(["doctor"]) == EXIT_OK
    text = " ".join(capsys.readouterr().out.split())
    assert "missing the kernels of organ are not compiled yet" in text and "factor" not in text


def test_without_a_browser_it_says_what_does_not_work(capsys, monkeypatch):
    monkeypatch.setattr(doctor_command.shutil, "which", lambda name: None)
    monkeypatch.setattr(doctor_command.platform, "system", lambda: "Linux")
    monkeypatch.setattr(doctor_command, "_measured", lambda is_compiled: (4e9, None))
    found, code = examined(capsys)
    assert code == EXIT_OK and found["browser"] is None
    (lack,) = (each for each in found["lacks"] if "browser" in each["what"])
    assert "replay.html" in lack["cost"]
    (lack,) = (each for each in found["lacks"] if "ffmpeg" in each["what"])
    assert found["ffmpeg"] is None and "animated PNG" in lack["cost"]


@pytest.mark.parametrize(
    ("environment", "said"),
    [
        ({"__EGL_VENDOR_LIBRARY_DIRS": "/nowhere"}, "apt-get install libegl1"),
        ({"MUJOCO_GL": "nonsense"}, "MUJOCO_GL is 'nonsense'"),
    ],
)
def test_where_nothing_draws_it_says_why_and_what_to_do(environment, said):
    """In a process that finds no driver, or is told of none."""
    code = (
        "from scalpel_sim.camera.gl_context import set_backend_aside; set_backend_aside()\n"
        "from scalpel_sim.cli import doctor_command as doctor; lacks = []\n"
        "print(doctor._renderer(lacks), *lacks)"
    )
    env = {key: value for key, value in os.environ.items() if key != "MUJOCO_GL"}
    env |= {"PYTHONPATH": str(ROOT)} | environment
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env)
    assert done.stdout.startswith("None") and said in done.stdout, done.stderr


def test_a_package_that_is_needed_and_not_there_fails_with_what_to_install(capsys, monkeypatch):
    real = importlib.metadata.version

    def version(name):
        if name == "mujoco":
            raise importlib.metadata.PackageNotFoundError(name)
        return real(name)

    monkeypatch.setattr(doctor_command.importlib.metadata, "version", version)
    assert command_line(["doctor"]) == EXIT_RUN_FAILED
    out, err = capsys.readouterr()
    assert "mujoco is not installed" in " ".join(out.split())
    assert err.startswith("error: mujoco is not installed") and 'pip install "mujoco' in err


@pytest.mark.parametrize("module", ["fcl", "mujoco"])
def test_a_module_without_which_no_command_loads_is_named_in_one_line(module):
    code = f"import sys; sys.modules[{module!r}] = None; import scalpel_sim.__main__ as m; m.main()"
    ended = subprocess.run([sys.executable, "-c", code, "doctor"], capture_output=True, text=True)
    assert ended.returncode == EXIT_RUN_FAILED and ended.stdout == ""
    (line,) = ended.stderr.splitlines()
    assert line.startswith(f"error: import of {module}") and "install scalpel-sim" in line


def test_what_is_missing_is_printed_with_its_cost(capsys):
    health = HEALTHY._replace(browser=None, lacks=[Lack("no [browser]", "no page")])
    assert "missing    no [browser]: no page." in text_of(health, capsys)


def test_a_folder_of_kernels_that_cannot_be_written_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "new"))
    assert doctor_command._can_be_written(cache_directory())
    monkeypatch.setattr(doctor_command.os, "access", lambda path, mode: False)
    lacks = []
    doctor_command._kernels(lacks)
    assert any("cannot be written" in each.what for each in lacks)


def test_one_core_is_named_as_few(monkeypatch):
    monkeypatch.setattr("scalpel_sim.validate.speed.machine.usable_cores", lambda: 0.5)
    lacks = []
    assert doctor_command._machine(lacks)["usable_cores"] == 0.5
    assert "0.5" in lacks[0].what and "compiles" in lacks[0].cost
