"""The benchmarks do the work that they describe, and report what they measured."""

import json
import math
import re

import pytest

from benchmarks.cut import CUT_BLOCKS, cut_slits, measure_cut_steps, median_cost
from benchmarks.kernels import measure_kernels
from benchmarks.local_frame import RELAXATION_NAME, measure_local_frames
from benchmarks.roofline import measure_roofline
from benchmarks.scaling import measure_scaling
from scalpel_sim.cli.app import command_line
from scalpel_sim.output.summary import TABLE_1
from scalpel_sim.scene_parts.choices import SCHEMES
from scalpel_sim.validate.speed.measurements import HIGHER, LOWER, NEITHER, load_results
from scalpel_sim.validate.speed.scenes import measure_scenes


def is_sane(measured):
    """Check that a measurement has a unit, a clock, samples, and percentiles on the slow side."""
    assert measured.unit and measured.clock and measured.n >= measured.rounds >= 1
    assert all(map(math.isfinite, (measured.median, measured.p95, measured.p99)))
    assert measured.lowest <= measured.highest
    if measured.better == LOWER:
        assert 0.0 <= measured.median <= measured.p95 <= measured.p99
    if measured.better == HIGHER:
        assert measured.median >= measured.p95 >= measured.p99 > 0.0
    return True


def printed(result, capsys):
    from rich.console import Console

    result.show(Console(width=200))
    return capsys.readouterr().out


def test_a_cut_does_the_same_work_in_a_body_of_any_size():
    small, large = map(median_cost, cut_slits(1, CUT_BLOCKS[:2]))
    assert large.n_tetrahedra > 9 * small.n_tetrahedra
    assert large.n_split == pytest.approx(small.n_split, rel=0.05)
    assert large.n_steps == pytest.approx(small.n_steps, abs=1)
    for cost in (small, large):
        assert cost.n_split > 100
        assert cost.idle_median > 0.0 and 0.0 < cost.step_mean < cost.step_longest
        assert cost.per_split * cost.n_split == pytest.approx(cost.step_mean * cost.n_steps)


def test_every_step_of_a_cut_is_a_sample():
    found = measure_cut_steps(2, CUT_BLOCKS[:1])
    assert all(map(is_sane, found.measurements))
    by_case = {each.case: each for each in found.measurements}
    assert by_case["cut step"].n == by_case["split tetrahedron"].n > 10
    # Each cut step splits several tetrahedra.
    assert by_case["split tetrahedron"].median < by_case["cut step"].median


def test_table_1_has_our_figures_beside_the_papers(capsys, tmp_path):
    file = tmp_path / "table1.json"
    assert command_line(["bench", "table1", "--runs", "1", "--save", str(file)]) == 0
    out = capsys.readouterr().out
    for words in ("SGI Indigo 2", "3.78", "92.2", "2,446", "stellar", "354", "pictures"):
        assert words in out
    measurements = load_results(file).measurements
    assert all(map(is_sane, measurements))
    assert len({each.case for each in measurements}) == len(TABLE_1) * len(SCHEMES)
    by_case = {(each.case, each.quantity): each.median for each in measurements}
    for cells, paper in TABLE_1.items():
        for scheme in SCHEMES:
            case = f"{'x'.join(map(str, cells))} cells, {scheme}"
            assert by_case[case, "frames"] > 10.0 * paper.frame_rate
            assert by_case[case, "after the cut"] > paper.tetrahedra_initial
            shares = [by_case[case, f"share of {s}"] for s in ("RX", "RD", "GC", "CD", "other")]
            assert min(shares) > 0.0 and sum(shares) == pytest.approx(100.0)
    assert by_case["2x2x2 cells, paper", "after the cut"] == 354  # as printed
    assert by_case["2x4x3 cells, paper", "after the cut"] == 960  # as printed
    assert by_case["4x6x4 cells, paper", "after the cut"] == 576 + 17 * 108  # the paper: 110


def test_each_loop_is_timed_for_each_law_and_size_and_contact_between_two_blocks(capsys):
    found = measure_kernels(1, 5_400)
    assert all(map(is_sane, found.measurements))
    cases = {(each.case, each.tetrahedra) for each in found.measurements}
    loops = ("forces", "Runge-Kutta step", "time step of 1 ms")
    for law in ("springs", "neo-Hookean"):
        assert {(f"{law}: {loop}", size) for loop in loops for size in (576, 5_400)} < cases
    for loop in ("search anew", "search", "forces of a step"):
        assert (f"contact: {loop}", 10_800) in cases
    text = printed(found, capsys)
    assert "ns/tet" in text and "CPU" in text and "wall" in text and "p99" in text


def test_scaling_gives_the_time_of_a_step_whole_and_per_tetrahedron(capsys):
    found = measure_scaling(1, sizes=(576, 6_000))
    assert all(map(is_sane, found.measurements))
    by_case = {
        (each.case, each.quantity, each.tetrahedra): each.median for each in found.measurements
    }
    for law in ("springs", "neo-Hookean"):
        step = f"{law}: Runge-Kutta step"
        for size in (576, 6_000):
            each, whole = by_case[step, "time per tetrahedron", size], by_case[step, "time", size]
            assert each == pytest.approx(1e6 * whole / size)
    assert "6,000" in printed(found, capsys)


def test_a_local_frame_splits_a_dozen_in_a_body_of_any_size(capsys):
    found = measure_local_frames(1, sizes=(6_000, 20_250))
    assert all(map(is_sane, found.measurements))
    by_case = {(each.case, each.tetrahedra): each for each in found.measurements}
    small, large = (by_case[f"{RELAXATION_NAME}: cut frame", size] for size in (6_000, 20_250))
    splits = [float(each.note.split()[0]) for each in (small, large)]
    assert all(6.0 < n < 24.0 for n in splits)
    assert (f"{RELAXATION_NAME}: blade moves, nothing split", 6_000) in by_case
    text = printed(found, capsys)
    assert "share" in text and "µs" in text


def test_a_roofline_reports_the_limits_the_needs_of_a_step_and_its_share(capsys):
    found = measure_roofline(1, 576)
    assert all(map(is_sane, found.measurements))
    by_case = {each.case: each for each in found.measurements}
    shares = [share for case, share in by_case.items() if case.startswith("share")]
    assert len(shares) == 3 and all(0.0 < share.median <= 100.0 for share in shares)
    (whole,) = [share for share in shares if share.case.startswith("share of the limit")]
    assert whole.median == max(share.median for share in shares)
    text = printed(found, capsys)
    assert "GB/s" in text and "GFLOP/s" in text
    assert "bytes and" in text and "operations for each of" in text


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
    assert command_line([*words, "--compare", str(file)]) == 0
    out = capsys.readouterr().out
    assert "Ratio: above 1 is faster now" in out and "real-time" in out
    assert {each.better for each in load_results(file).measurements} <= {LOWER, HIGHER, NEITHER}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["speed"], "speed"),
        (["cut", "--runs", "0"], "--runs is 0"),
        (["table1", "--save", "figures.txt"], "must end in .json"),
        (["scenes", "slap"], "Did you mean 'slab'"),
        (["kernels", "--largest", "5"], "--largest is 5.*576"),
        (["kernels", "--compare", "nothing.json"], "nothing.json: cannot be read"),
        (["peers", "--python", "nowhere"], "--python is nowhere"),
    ],
)
def test_wrong_arguments_of_a_benchmark_are_refused_before_it_begins(words, expected, capsys):
    assert command_line(["bench", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = (x for x in err.splitlines() if not x.startswith("compiling"))
    assert re.search(expected, line)
