"""The benchmarks: that they do the work they say, and say what they found."""

import json

import pytest

from scalpel_sim.bench import cut, table1
from scalpel_sim.cli import command_line
from scalpel_sim.table_1 import TABLE_1


def test_the_blade_does_the_same_to_a_body_however_large_it_is():
    small, large = cut.measure(1, cut.CELLS[:2])
    assert large.n_tetrahedra > 9 * small.n_tetrahedra
    assert large.n_split == pytest.approx(small.n_split, rel=0.05)
    assert large.n_steps == pytest.approx(small.n_steps, abs=1)
    for cost in (small, large):
        assert cost.n_split > 100
        assert 0.0 < cost.idle_median < cost.step_mean < cost.step_longest
        assert cost.per_split * cost.n_split == pytest.approx(cost.step_mean * cost.n_steps)


def test_table_1_has_our_figures_beside_the_papers(capsys, tmp_path):
    file = tmp_path / "table1.json"
    assert command_line(["bench", "table1", "--runs", "1", "--save", str(file)]) == 0
    printed = capsys.readouterr().out
    for words in ("SGI Indigo 2", "3.78", "92.2", "2,446", "stellar", "354", "pictures"):
        assert words in printed
    found = json.loads(file.read_text())
    assert (found["benchmark"], found["runs"]) == ("table1", 1)
    assert found["machine"]["processor"] and found["versions"]["numba"]
    rows = found["rows"]
    assert len(rows) == len(TABLE_1) * len(table1.SCHEMES)
    for row in rows:
        paper = TABLE_1[tuple(row["cells"])]
        assert row["tetrahedra_initial"] == paper.tetrahedra_initial < row["tetrahedra_final"]
        assert row["frame_rate"] > 10.0 * paper.frame_rate
        assert set(row["percent"]) == {"RX", "RD", "GC", "CD", "other"}
        assert all(share > 0.0 for share in row["percent"].values())
        assert sum(row["percent"].values()) == pytest.approx(100.0)
    final = {(tuple(row["cells"]), row["scheme"]): row["tetrahedra_final"] for row in rows}
    assert final[(2, 2, 2), "paper"] == 354  # as printed
    assert final[(2, 4, 3), "paper"] == 960  # as printed
    assert final[(4, 6, 4), "paper"] == 576 + 17 * 108  # the paper: 110


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["speed"], "speed"),
        (["cut", "--runs", "0"], "--runs is 0"),
        (["table1", "--save", "figures.txt"], "must end in .json"),
    ],
)
def test_a_benchmark_that_makes_no_sense_is_refused(words, expected, capsys):
    assert command_line(["bench", *words]) == 2
    assert expected in capsys.readouterr().err
