"""Every example in docs/examples runs to its end and prints the documented results."""

import os
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[1] / "docs" / "examples"


@pytest.fixture
def run(tmp_path, monkeypatch, capsys) -> Callable[[str], str]:
    """Run an example in a folder of its own, and return what it printed."""

    def printed(name: str) -> str:
        monkeypatch.chdir(tmp_path)
        runpy.run_path(str(FOLDER / name), run_name="__main__")
        return capsys.readouterr().out

    return printed


def test_no_example_is_left_out():
    tests = "".join(
        path.read_text(encoding="utf-8") for path in Path(__file__).parent.rglob("*.py")
    )
    assert [path.name for path in FOLDER.glob("*.py") if f'"{path.name}"' not in tests] == []


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text)]


def test_two_hands_stretch_a_bar_and_each_keeps_its_piece(run):
    felt, after, pieces, *held = numbers(run("two_hands.py"))
    area, stretch, length = 0.02**2, 4e-3, 0.08
    assert felt == pytest.approx(20e3 * area * stretch / length, rel=0.15)  # the hands yield, too
    assert (after, pieces, held) == (0.0, 2.0, [16.0, 16.0])


def test_a_parallel_jaw_lifts_a_block_and_carries_its_weight(run):
    way, carried = numbers(run("parallel_jaw.py"))
    assert way == pytest.approx(20.0, abs=1.0)  # hand and tissue sag
    assert carried == pytest.approx(0.05 * 9.81, rel=0.02)


def test_an_attached_arm_cuts_a_block_in_two_with_a_force_set_by_toughness(run):
    peak, area, pieces = re.search(
        r"peak ([\d.]+) N, cut (\d+) mm2, (\d+) pieces", run("attach_mjcf.py")
    ).groups()
    assert float(peak) == pytest.approx(20.0 * 0.02, rel=0.3)  # toughness times thickness
    assert float(area) == pytest.approx(40 * 20, rel=0.1)
    assert int(pieces) == 2


def test_images_of_a_cut_show_what_there_is(run, tmp_path, renderer):
    pixels = {
        name: (int(n), float(mm))
        for name, n, mm in re.findall(r"(\w+): (\d+) pixels, from (\d+) mm", run("camera.py"))
    }
    assert pixels.keys() == {"skin", "cut", "blade"} and min(n for n, _ in pixels.values()) > 50
    assert all(20.0 < mm < 200.0 for _, mm in pixels.values())
    assert (tmp_path / "endoscope.png").exists() and (tmp_path / "overview.png").exists()


def test_a_cut_along_a_line_in_an_image_is_as_long_as_the_line(run, tmp_path, renderer):
    area, length = numbers(run("cut_in_image.py").replace("mm2", ""))
    assert area == pytest.approx(6.0 * length, rel=0.15)
    assert (tmp_path / "planned.png").exists() and (tmp_path / "cut.png").exists()


def test_an_edge_moved_through_a_block_meets_toughness_times_thickness(run):
    peak, area, _, pieces = numbers(run("cut_block.py"))
    assert peak == pytest.approx(20.0 * 0.02, rel=0.2)
    assert area == pytest.approx(40 * 20, rel=0.1) and pieces == 2


def test_a_body_is_cut_along_a_given_surface_and_written(run, tmp_path):
    area, pieces = re.search(r"(\d+) mm2, (\d+) pieces", run("incise.py")).groups()
    assert float(area) == pytest.approx(60 * 40, rel=0.1) and int(pieces) == 2
    assert (tmp_path / "incised.vtu").stat().st_size > 10_000
    assert (tmp_path / "incised.stl").stat().st_size > 10_000


def test_a_stroke_from_a_file_cuts_the_slab_in_two(run):
    area, pieces = re.search(r"cut (\d+) mm2, (\d+) pieces", run("own_stroke.py")).groups()
    assert float(area) == pytest.approx(60 * 40, rel=0.05) and int(pieces) == 2


def test_a_step_reports_its_forces_and_its_energy_balance(run):
    found = run("forces.py")
    assert float(re.search(r"press with ([\d.]+) N", found).group(1)) > 0.1
    assert int(re.search(r"cutting took (\d+)%", found).group(1)) > 50
    assert abs(float(re.search(r"not accounted for: (-?[\d.]+)%", found).group(1))) < 0.5


def test_a_clamp_in_front_of_the_blade_is_hit(run):
    assert re.search(r"'blade, clamp': \d+", run("clamp.py"))


def test_the_floor_carries_the_whole_weight_of_a_loose_piece(run):
    found = run("falling_piece.py")
    grams, height = re.search(r"([\d.]+) g lie ([\d.]+) mm", found).groups()
    assert float(grams) == pytest.approx(8.0, rel=0.01)  # half of 16 cm3
    assert float(height) == pytest.approx(10.0, rel=0.05)  # half of its thickness
    assert float(re.search(r"bears ([\d.]+)", found).group(1)) == pytest.approx(1.0, abs=0.02)


def test_a_tissue_in_another_process_is_cut_in_two():
    """The example runs in a process of its own, as a user would start it."""
    done = subprocess.run(
        [sys.executable, str(FOLDER / "two_processes.py")],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
        env=os.environ | {"PYTHONPATH": str(FOLDER.parents[1])},
    )
    assert "cut 400 mm2, 2 pieces" in done.stdout


def test_a_robot_of_your_own_is_the_left_hand_and_carries_what_is_cut_off(run):
    printed = run("own_grasper.py")
    pieces, held, weight, grams = re.search(
        r"(\d) pieces; .* (\d+) points .*\n.* ([\d.]+) N and has ([\d.]+) g", printed
    ).groups()
    assert int(pieces) == 2 and int(held) > 100
    assert 5.0 < float(grams) < 20.0
    assert float(weight) == pytest.approx(1e-3 * float(grams) * 9.81, rel=0.1)  # it swings
    code = (FOLDER / "own_grasper.py").read_text(encoding="utf-8").splitlines()
    assert sum(bool(line) and not line.startswith(('"""', "import", "from")) for line in code) < 15


def edits_of(page: str) -> list[tuple[str, str, str]]:
    """Return each edit that the `diff` blocks of a page show: file, text before, text after."""
    found = []
    for path, body in re.findall(r"^```diff\n--- (\S+)\n(.*?)^```", page, re.DOTALL | re.MULTILINE):
        for hunk in re.split(r"^@@\n", body, flags=re.MULTILINE):
            lines = hunk.splitlines(keepends=True)
            before = "".join(line[1:] for line in lines if not line.startswith("+"))
            after = "".join(line[1:] for line in lines if not line.startswith("-"))
            found.append((path, before, after))
    return found


SAGS = """
from tissue import Material, SolverSettings, Tissue, block, fixed_nodes

mesh = block((1, 1, 1), (0.01, 0.01, 0.01))
material = Material(10e3, law="neo_hookean", viscous_damping=0.0, retardation_time=0.0)
for relaxation in ("verlet", "symplectic_euler"):
    solver = SolverSettings(relaxation=relaxation)
    tissue = Tissue(mesh, material, fixed=fixed_nodes(mesh, "bottom"), solver=solver)
    top = tissue.material_points("top")
    for _ in range(20):
        tissue.step(None, 1e-3)
        print(1e6 * (0.01 - tissue.positions_of(top)[:, 2].mean()))
"""
"""The height that a block loses in each millisecond after its weight begins to act [um]."""


def test_a_method_is_added_by_the_edits_that_are_shown(tmp_path):
    """A copy of the package with them swings a block, without the compiler, nearly as verlet."""
    root = FOLDER.parents[1]
    page = (root / "docs" / "extend.md").read_text(encoding="utf-8")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(root / "tissue", tmp_path / "tissue", ignore=ignored)
    code = re.search(r"^```py\n(.*?)^```", page, re.DOTALL | re.MULTILINE).group(1)
    path = re.search(r"Its new file is \*([\w/.]+)\*", page).group(1)
    (tmp_path / path).write_text(code, encoding="utf-8")
    for name, before, after in edits_of(page):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert text.count(before) == 1, f"{name} does not have once:\n{before}"
        (tmp_path / name).write_text(text.replace(before, after), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", SAGS],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
        env=os.environ | {"PYTHONPATH": str(tmp_path), "NUMBA_DISABLE_JIT": "1"},
    )
    verlet, euler = np.array(done.stdout.split(), dtype=float).reshape(2, 20)
    assert 0.01 < np.abs(euler - verlet).max() / verlet.max() < 0.1  # it is of first order
