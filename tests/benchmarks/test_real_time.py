"""`real-time` times whole frames in each mode; random strokes are those of their seed."""

import numpy as np
import pytest

from benchmarks.__main__ import benchmark_line
from benchmarks.strokes import random_stroke
from scalpel_sim.errors import EXIT_OK
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.read import SCENES
from scalpel_sim.validate.speed.measurements import load_results

CASES = ("plain", "account", "viewer")


def test_a_quick_look_has_a_row_for_each_mode(capsys, tmp_path):
    file = tmp_path / "real_time.json"
    command = ["real-time", "--scenes", "grid2", "--quick", "--save", str(file)]
    assert benchmark_line(command) == EXIT_OK
    out = capsys.readouterr().out
    assert "p99.9" in out and "late %" in out
    found = {(m.case, m.quantity): m for m in load_results(file).measurements}
    assert {case for case, _ in found} == {f"grid2, as shipped: {what}" for what in CASES}
    for what in CASES:
        case = f"grid2, as shipped: {what}"
        frame, factor = found[case, "frame"], found[case, "real-time factor"]
        assert frame.n == pytest.approx(50, abs=1)
        assert 0.0 < frame.median <= frame.p99 <= 1.001 * found[case, "p99.9 of a frame"].median
        assert factor.median > 0.0
        assert found[case, "substeps"].median >= 0.0
        assert 0.0 <= found[case, "late frames"].median <= 100.0


def test_random_strokes_are_those_of_their_seed_and_cross_the_body():
    tissue = make_tissue(SCENES["grid2"])
    first, again, other = (random_stroke(tissue, np.random.default_rng(s)) for s in (3, 3, 4))
    assert all(np.array_equal(a.tip, b.tip) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0].tip, other[0].tip)
    length = np.linalg.norm(first[-1].tip - first[0].tip)
    low, high = tissue.bounds
    assert length > np.linalg.norm((high - low)[:2])
