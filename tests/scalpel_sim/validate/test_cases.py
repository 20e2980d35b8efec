"""Cases run from their files to their tables, and fail where they miss what they expect."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.case import ExpectedTable, read_case
from scalpel_sim.validate.cases.expected import check_expected, read_curve
from scalpel_sim.validate.cases.runner import CaseRecord, TimeTable, assemble, run_case
from scalpel_sim.validate.findings import FAIL, PASS
from tissue import MATERIALS, Energies

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"

# A cylinder stands on a plate and is loaded by a tenth of E A at its other end, in 40 ms.
COLUMN = """
title = "A column is pressed"
body = {shape = "cylinder", radius = 0.01, height = 0.04, rings = 2, layers = 8}
material = {law = "neo_hookean", young_modulus = 50e3, poisson_ratio = 0.0, viscous_damping = 200.0}
run = {seconds = 0.04, record_every = 0.01, settle = true, relaxation = "verlet"}
support = [{name = "plate", region = "bottom"}]
load = [{name = "weight", region = "top", force = [[0.0, 0.0, -0.15707963]]}]
record = [
    {name = "at_plate", quantity = "reaction", support = "plate", component = "z"},
    {name = "sag", quantity = "displacement", point = [0.0, 0.0, 0.04], component = "z"},
]
expected = [
    {record = "at_plate", value = 0.15707963, tolerance = 0.01, source = "equilibrium"},
    {record = "sag", value = -0.0004, tolerance = 0.03, source = "F L / (E A)"},
]
"""


def columns(path):
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))


def test_a_bar_is_stretched_as_its_formula_says(tmp_path, capsys):
    words = ["validate", "--case", str(EXAMPLES / "tension.toml"), "--out", str(tmp_path)]
    assert command_line(words) == 0
    assert "pass: force against elongation" in " ".join(capsys.readouterr().out.split())
    table = columns(tmp_path / "case.csv")
    assert list(table) == ["time_s", "force_n", "elongation_m"]
    np.testing.assert_allclose(table["time_s"], np.linspace(0.0, 0.5, 26), atol=1e-9)
    np.testing.assert_allclose(table["elongation_m"], 0.016 * table["time_s"], atol=1e-9)
    content = json.loads((tmp_path / "case.json").read_text(encoding="utf-8"))
    assert content["passed"] and content["expected"][0]["verdict"] == "pass"
    energies = content["energies_j"]
    assert abs(energies["residual"]) < 1e-3 * energies["work_of_supports"]
    assert (tmp_path / "force.png").read_bytes()[:4] == b"\x89PNG"


def test_a_blade_cuts_a_block_with_toughness_times_thickness(tmp_path, capsys):
    words = ["run", str(EXAMPLES / "cut.toml"), "--out", str(tmp_path), "--json"]
    assert command_line(words) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["pieces"] == 2
    table = columns(tmp_path / "case.csv")
    assert table["area_m2"][-1] == pytest.approx(8e-4, rel=0.05)
    steady = (table["time_s"] >= 0.15) & (table["time_s"] <= 0.33)
    # What the blade pushes forward, the sides hold back.
    sides, blade = table["on_the_sides_n"][steady].mean(), table["cutting_force_n"][steady].mean()
    assert sides == pytest.approx(blade, rel=0.1)


def test_a_wire_through_gelatin_weighs_what_kitchen_scales_would_show(tmp_path):
    case = EXAMPLES / "gelatin_cut.toml"
    assert command_line(["validate", "--case", str(case), "--out", str(tmp_path), "-q"]) == 0
    table = columns(tmp_path / "case.csv")
    deep = (table["time_s"] >= 1.2) & (table["time_s"] <= 2.2)
    wire, scales = table["wire_n"][deep], table["scales_n"][deep]
    # The wire in a hand weighs on the scales: both are the same force, but for the block's motion.
    assert scales.mean() == pytest.approx(wire.mean(), rel=0.02)
    gelatin = MATERIALS["gelatin"].material
    faster = (10e-3 / gelatin.toughness_speed) ** gelatin.toughness_exponent
    assert wire.mean() == pytest.approx(gelatin.toughness * (1.0 + faster) * 20e-3, rel=0.05)


def test_pressed_gelatin_is_as_stiff_as_its_own_figure_says(tmp_path):
    forces = []
    for young in ("18.3e3", "36.6e3"):
        path = tmp_path / f"press{young}.toml"
        text = (EXAMPLES / "gelatin_press.toml").read_text(encoding="utf-8")
        path.write_text(text.replace("18.3e3", young), encoding="utf-8")
        assert command_line(["validate", "--case", str(path), "--out", str(tmp_path), "-q"]) == 0
        forces.append(columns(tmp_path / "case.csv")["force_n"][-1])
    assert forces[1] == pytest.approx(2.0 * forces[0], rel=0.01)
    # A cube between plates that hold it: stiffer than one between plates that slip.
    assert 1.1 < forces[0] / (18.3e3 * 0.04**2 * 0.1) < 1.5


def test_a_case_that_misses_what_it_expects_ends_with_exit_code_3(tmp_path, capsys):
    path = tmp_path / "column.toml"
    path.write_text(COLUMN.replace("-0.0004", "-0.0005"), encoding="utf-8")
    assert command_line(["validate", "--case", str(path), "--out", str(tmp_path / "o"), "-q"]) == 3
    assert "what it expects is missed" in capsys.readouterr().err
    content = json.loads((tmp_path / "o" / "case.json").read_text(encoding="utf-8"))
    assert content["passed"] is False
    assert [each["verdict"] for each in content["expected"]] == ["pass", "FAIL"]


def test_a_column_bears_its_load_and_sags_by_force_times_length_over_stiffness(tmp_path):
    path = tmp_path / "column.toml"
    path.write_text(COLUMN, encoding="utf-8")
    case = read_case(path)
    record = run_case(case, assemble(case))
    checks = [check_expected(each, None, record) for each in case.expected]
    assert [check.verdict for check in checks] == [PASS, PASS]
    np.testing.assert_allclose(record.columns["at_plate"], 0.15707963, rtol=0.01)


def test_a_mesh_file_is_found_beside_the_case(tmp_path):
    from tissue import Tissue, block, write_vtu

    write_vtu(tmp_path / "body.vtu", Tissue(block((2, 2, 4), (0.02, 0.02, 0.04))).snapshot())
    body = 'body = {shape = "mesh", file = "body.vtu"}'
    text = "\n".join(body if line.startswith("body") else line for line in COLUMN.splitlines())
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    assert assemble(read_case(path)).tissue.n_nodes == 45


def test_a_lattice_has_a_node_in_each_cell(tmp_path):
    body = 'body = {shape = "lattice", size = [0.02, 0.02, 0.04], cells = [2, 2, 4]}'
    text = "\n".join(body if line.startswith("body") else line for line in COLUMN.splitlines())
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    assert assemble(read_case(path)).tissue.n_nodes == 45 + 16


@pytest.mark.parametrize("words", [["--only", "steady"], ["--quick"]])
def test_a_case_goes_with_no_option_of_the_scenes(words, capsys):
    case = str(EXAMPLES / "tension.toml")
    assert command_line(["validate", "--case", case, *words]) == 2
    assert "--only and --quick are for the scenes" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--young", "1e4"], ["--stroke", "press"], ["--hand", "device"]])
def test_a_case_has_all_that_options_of_a_scene_say(words, capsys):
    assert command_line(["run", str(EXAMPLES / "tension.toml"), *words]) == 2
    assert f"{words[0]} is " in capsys.readouterr().err


def test_vectors_are_interpolated_and_stay_after_the_last_time():
    table = TimeTable([1.0, 2.0], [[0.0, 0.0, 0.0], [1.0, 0.0, -2.0]], "it")
    for time, expected in ((0.0, [0, 0, 0]), (1.25, [0.25, 0, -0.5]), (9.0, [1, 0, -2])):
        np.testing.assert_array_equal(table.at(time), expected)


def a_record(x, y):
    nothing = Energies(*[0.0] * len(Energies._fields))
    time = np.linspace(0.0, 1.0, len(x))
    data = {"time": time, "x": np.array(x, dtype=float), "y": np.array(y, dtype=float)}
    return CaseRecord(data, {"time": "s", "x": "m", "y": "N"}, nothing, 1)


def curve_of(tmp_path, text):
    path = tmp_path / "curve.csv"
    path.write_text(text, encoding="utf-8")
    return read_curve(path)


EXPECTED = ExpectedTable(record="y", against="x", tolerance=0.1, source="s", file="curve.csv")


@pytest.mark.parametrize(
    ("x", "y", "deviation"),
    [
        ([0, 1, 2], [0, 10, 20], 0.0),
        ([0, 1, 2], [0, 11, 20], 0.05),
        ([2, 1, 0], [20, 13, 0], 0.15),
        ([0, 1, 1.9], [0, 10, 19], np.nan),  # not as far as the curve
        ([0, 1, 0.5], [0, 10, 5], np.nan),  # back and forth
        ([0, 1, 2], [0, np.nan, 20], np.nan),
    ],
)
def test_the_largest_deviation_from_a_curve_counts(x, y, deviation, tmp_path):
    curve = curve_of(tmp_path, "x,y\n0,0\n1,10\n2,20\n")
    check = check_expected(EXPECTED, curve, a_record(x, y))
    assert check.value == pytest.approx(deviation, nan_ok=True)
    assert check.verdict == (PASS if deviation <= 0.1 else FAIL)


def test_a_value_is_that_of_the_rows_between_two_times():
    table = ExpectedTable(
        record="y", tolerance=0.1, source="s", value=-10.0, from_time=0.5, to_time=1.0
    )
    assert check_expected(table, None, a_record([0, 0, 0], [99, -9.5, -10.7])).verdict == PASS
    assert check_expected(table, None, a_record([0, 0, 0], [99, -9.5, -13.0])).verdict == FAIL


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x,y\n0,0\n1,nan\n", "line 3: 'nan' is not a finite number"),
        ("x,y\n0,0\n1\n", "line 3: 1 values, wanted 2"),
        ("x,y\n0,1\n", "give two or more"),
        ("x,y\n1,0\n0,1\n", "must ascend"),
        ("x,y\n0,0\n1,0\n", "0 everywhere"),
    ],
)
def test_a_curve_that_is_none_is_refused(text, expected, tmp_path):
    with pytest.raises(UsageError, match=expected):
        curve_of(tmp_path, text)


def test_a_curve_that_is_missing_is_said_before_the_run(tmp_path, capsys):
    shutil.copy(EXAMPLES / "tension.toml", tmp_path)
    assert command_line(["validate", "--case", str(tmp_path / "tension.toml")]) == 2
    assert "cannot read the curve" in capsys.readouterr().err
