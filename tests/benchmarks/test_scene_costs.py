"""The costs on which `scalpel-sim doctor` rests are measured, compared and stored."""

import tomllib

import pytest

from benchmarks import scene_costs
from benchmarks.__main__ import benchmark_line
from benchmarks.scene_costs import MOST_DRIFT, is_off
from scalpel_sim.validate.speed import expected


@pytest.fixture
def file(monkeypatch, tmp_path):
    """A file of costs in which the smallest scene has a cost that no machine measures."""
    path = tmp_path / "scene_costs.toml"
    path.write_text("[costs]\ngrid2 = 100.0\nslab = 3.0\n")
    monkeypatch.setattr(scene_costs, "COSTS_FILE", path)
    monkeypatch.setattr(expected, "COSTS_FILE", path)
    return path


@pytest.mark.parametrize(
    ("cost", "stored", "expected"),
    [
        (1.0 + 0.9 * MOST_DRIFT, 1.0, False),
        (1.0 + 1.1 * MOST_DRIFT, 1.0, True),
        (1.0 - 1.1 * MOST_DRIFT, 1.0, True),
        (1.0, None, True),
    ],
)
def test_a_cost_that_changed_by_more_than_a_tenth_is_off(cost, stored, expected):
    assert is_off(cost, stored) == expected


def test_a_cost_that_no_longer_holds_is_marked_and_fails(file, capsys):
    assert benchmark_line(["scene-costs", "grid2", "--runs", "1"]) == 1
    (line,) = (x for x in capsys.readouterr().out.splitlines() if "grid2" in x)
    assert line.split()[-1] == "off" and "100" in line
    assert "grid2 = 100.0" in file.read_text()


def test_costs_are_stored_anew_where_that_is_asked_for(file, capsys):
    assert benchmark_line(["scene-costs", "grid2", "--runs", "1", "--write"]) == 0
    content = tomllib.loads(file.read_text())
    assert 0.0 < content["costs"]["grid2"] < 10.0
    assert content["costs"]["slab"] == 3.0  # was not measured
    assert "GHz" in content["measured_on"]
    assert expected.scene_costs() == content["costs"]
