"""`scalpel-sim bench`: scenes and the paper's Table 1 are measured, saved and compared."""

import json
import re

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.output.summary import TABLE_1
from scalpel_sim.validate.speed.measurements import HIGHER, LOWER, NEITHER, load_results
from scalpel_sim.validate.speed.scenes import measure_scenes
from tests.support.measured import is_sane, printed

WAYS = ("stellar", "paper", "paper, rings")
"""Ours, the paper's scheme with our relaxation, and the paper's own."""


def test_table_1_has_our_figures_beside_the_papers(capsys, tmp_path):
    file = tmp_path / "table1.json"
    assert command_line(["bench", "table1", "--runs", "1", "--save", str(file)]) == 0
    out = capsys.readouterr().out
    for words in ("SGI Indigo 2", "3.78", "92.2", "2,446", "stellar", "354", "pictures"):
        assert words in out
    measurements = load_results(file).measurements
    assert all(map(is_sane, measurements))
    assert len({each.case for each in measurements}) == len(TABLE_1) * len(WAYS)
    by_case = {(each.case, each.quantity): each.median for each in measurements}
    for cells, paper in TABLE_1.items():
        for way in WAYS:
            case = f"{'x'.join(map(str, cells))} cells, {way}"
            assert by_case[case, "frames"] > 10.0 * paper.frame_rate
            assert by_case[case, "after the cut"] > paper.tetrahedra_initial
            shares = [by_case[case, f"share of {s}"] for s in ("RX", "RD", "GC", "CD", "other")]
            assert min(shares) > 0.0 and sum(shares) == pytest.approx(100.0)
    for way in WAYS[1:]:
        assert by_case[f"2x2x2 cells, {way}", "after the cut"] == 354  # as printed
        assert by_case[f"2x4x3 cells, {way}", "after the cut"] == 960  # as printed
        assert by_case[f"4x6x4 cells, {way}", "after the cut"] == 576 + 17 * 108  # the paper: 110


def test_a_scene_reports_its_frames_and_its_stages(capsys):
    found = measure_scenes(1, ["grid2"], seconds=0.6)
    assert all(map(is_sane, found.measurements))
    by_case = {each.case: each for each in found.measurements}
    assert by_case["grid2: frame"].n == 600 > by_case["grid2: frame, blade in the tissue"].n > 0
    assert {f"grid2: {stage}" for stage in ("RX", "GC", "CD")} < set(by_case)
    assert 0.0 <= by_case["grid2: late frames"].median <= 100.0
    assert by_case["grid2: real-time factor"].better == HIGHER
    assert "wall" in printed(found, capsys)


def test_a_run_is_saved_and_compared_with_itself(capsys, tmp_path):
    file = tmp_path / "before.json"
    words = ["bench", "scenes", "grid2", "--runs", "1"]
    assert command_line([*words, "--json", "--save", str(file)]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(file.read_text())
    machine = load_results(file).machine
    assert machine["clock_hz"] > 0.0
    assert command_line([*words, "--compare", str(file)]) == 0
    out = capsys.readouterr().out
    assert "Ratio: above 1 is faster now" in out and "real-time" in out
    assert f"Measured on: {machine['processor']}" in out and "GHz under load" in out
    assert {each.better for each in load_results(file).measurements} <= {LOWER, HIGHER, NEITHER}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["speed"], "no benchmark 'speed'.*scenes or table1"),
        ([], "name a benchmark"),
        (["kernels", "--largest", "576"], "a clone .* has others, .*kernels.*python -m benchmarks"),
        (["scenes", "--runs", "0"], "--runs is 0"),
        (["table1", "--save", "figures.txt"], "must end in .json"),
        (["scenes", "slap"], "Did you mean 'slab'"),
        (["table1", "--compare", "nothing.json"], "nothing.json: cannot be read"),
    ],
)
def test_wrong_arguments_of_a_benchmark_are_refused_before_it_begins(words, expected, capsys):
    assert command_line(["bench", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = (x for x in err.splitlines() if not x.startswith("compiling"))
    assert re.search(expected, line)
