"""The benchmarks do the work that they describe, and report what they measured."""

import re

import numpy as np
import pytest

from benchmarks.__main__ import BENCHMARKS, benchmark_line
from benchmarks.costs import images
from benchmarks.engine import PRECISION_OF_LAW, EngineLoops, jittered_block
from benchmarks.frame import Stopwatches, Trace, trace_frame
from benchmarks.scaling import (
    RELAXATION_NAME,
    SMALLEST_CUT,
    cut,
    cut_block,
    kernels,
    measure_local_frames,
    measure_steps,
)
from benchmarks.studies.environments import environments
from scalpel_sim.scene.read import SCENES
from tests.support.measured import is_sane, printed


def test_a_cut_does_the_same_work_in_a_body_of_any_size():
    small, large = map(cut_block, (SMALLEST_CUT, 10_296))
    assert large.splits.sum() == pytest.approx(small.splits.sum(), rel=0.05)
    assert len(large.cut) == pytest.approx(len(small.cut), abs=1)
    for slit in (small, large):
        assert slit.splits.sum() > 100
        assert slit.other.min() > 0.0 and 0.0 < slit.cut.min() < slit.cut.max()


def test_every_step_of_a_cut_is_a_sample():
    found = cut(runs=2, largest=SMALLEST_CUT)
    assert all(map(is_sane, found.measurements))
    by_case = {each.case: each for each in found.measurements}
    assert by_case["cut step"].n == by_case["split tetrahedron"].n > 10
    # Each cut step splits several tetrahedra.
    assert by_case["split tetrahedron"].median < by_case["cut step"].median


def test_each_loop_is_timed_for_each_law_and_size_and_contact_between_two_blocks(capsys):
    found = kernels(runs=1, largest=5_400)
    assert all(map(is_sane, found.measurements))
    cases = {(each.case, each.tetrahedra) for each in found.measurements}
    loops = (
        *("evaluation and stage", "evaluation alone, damped"),
        *("whole step, damped", "time step of 1 ms"),
    )
    for law in ("springs, double", "neo-Hookean, single"):
        assert {(f"{law}: {loop}", size) for loop in loops for size in (576, 5_400)} < cases
    for loop in ("new search", "search", "forces of a step"):
        assert (f"contact: {loop}", 10_800) in cases
    text = printed(found, capsys)
    assert "ns/tet" in text and "CPU" in text and "wall" in text and "p99" in text


def test_loops_are_timed_in_the_precision_in_which_run_does_them():
    precision = PRECISION_OF_LAW["neo_hookean"]
    assert precision == SCENES["organ"].solver.precision == "single"
    loops = EngineLoops(jittered_block(576), "neo_hookean", precision=precision)
    assert loops._tissue._model.elasticity.is_single


def test_scaling_gives_the_time_of_a_step_whole_and_per_tetrahedron(capsys):
    found = measure_steps(1, (576, 6_000))
    assert all(map(is_sane, found.measurements))
    by_case = {
        (each.case, each.quantity, each.tetrahedra): each.median for each in found.measurements
    }
    for law in ("springs, double", "neo-Hookean, single"):
        step = f"{law}: whole step, damped"
        for size in (576, 6_000):
            each, whole = by_case[step, "time per tetrahedron", size], by_case[step, "time", size]
            assert each == pytest.approx(1e6 * whole / size)
    assert "6,000" in printed(found, capsys)


def test_a_local_frame_splits_a_dozen_in_a_body_of_any_size(capsys):
    found = measure_local_frames(1, (6_000, 20_250))
    assert all(map(is_sane, found.measurements))
    by_case = {(each.case, each.tetrahedra): each for each in found.measurements}
    small, large = (by_case[f"{RELAXATION_NAME}: cut frame", size] for size in (6_000, 20_250))
    splits = [float(each.note.split()[0]) for each in (small, large)]
    assert all(6.0 < n < 24.0 for n in splits)
    assert (f"{RELAXATION_NAME}: blade moves, nothing split", 6_000) in by_case
    assert "split in a cut frame" in printed(found, capsys)


def test_a_call_into_a_file_that_was_left_is_a_return():
    trace = Trace("made", 48, ["a", "b", "a", "c", "b"], dict.fromkeys("abc"))
    assert trace.n_returns == 2


def test_a_frame_that_cuts_is_traced_the_same_each_time():
    first, again = (trace_frame("grid2", 2) for _ in range(2))
    assert first == again
    assert "tissue/tissue.py" in first.calls and "bridge/bridge.py" in first.calls
    assert 20 < len(first.calls) < first.n_returns + len(first.calls) == len(first.entered)
    assert len(first.calls) <= 41 and first.n_returns <= 54, "a frame stays easy to follow"
    assert all(a != b for a, b in zip(first.entered, first.entered[1:], strict=False))


def test_time_inside_a_part_is_not_counted_twice():
    watches = Stopwatches()
    inner = watches.around("inner", lambda: np.linalg.inv(np.eye(200)))
    watches.around("outer", inner)()
    assert 0 < watches.spent["outer"] < watches.spent["inner"]


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_benchmark_has_help(name, capsys):
    assert benchmark_line([name, "--help"]) == 0
    out = capsys.readouterr().out
    assert f"python -m benchmarks {name}" in out and "--save" in out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["speed"], "speed"),
        (["cut", "--runs", "0"], "--runs is 0"),
        (["cut", "--save", "figures.txt"], "must end in .json"),
        (["frame", "slap"], "Did you mean 'slab'"),
        (["kernels", "--largest", "5"], "--largest is 5.*576"),
        (["kernels", "--compare", "nothing.json"], "nothing.json: cannot be read"),
        (["peers", "--python", "nowhere"], "--python is nowhere"),
        (["real-time", "--quick", "--materials", "wood"], "liver"),
    ],
)
def test_wrong_arguments_of_a_benchmark_are_refused(words, expected, capsys):
    assert benchmark_line(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = (x for x in err.splitlines() if not x.startswith("compiling"))
    assert re.search(expected, line)


def test_environments_are_timed_without_arms_with_arms_and_in_processes(capsys):
    found = environments("ligament-v0", steps=3, many="ligament-v0", runs=1)
    assert all(map(is_sane, found.measurements))
    by_case = {each.case.partition(": ")[2]: each.median for each in found.measurements}
    assert by_case["ratio of both"] == by_case["no arms"] / by_case["whole arms"]
    assert by_case["two over one"] == by_case["processes: 2"] / by_case["processes: 1"]
    assert by_case["reset"] > 0.0
    assert "the load was" in " ".join(printed(found, capsys).split())


def test_images_are_timed_beside_the_simulation_that_they_show(renderer):
    found = images("slab", side=32, runs=1).measurements
    assert all(map(is_sane, found))
    by_case = {each.case: each.median for each in found}
    share = by_case["image, over 20 ms of simulation"]
    assert share == pytest.approx(
        100.0 * by_case["image"] / by_case["20 ms of simulation"], rel=0.01
    )
    assert by_case["a further camera"] < by_case["image"] < by_case["all three"]
