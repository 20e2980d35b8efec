"""A second run with fewer cases has each value of each parameter, and few cases more than that."""

import re
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest

from tests.support.each_value_once import each_value_once

ROOT = Path(__file__).parents[2]

SMALL = """
import pytest

@pytest.mark.parametrize("side", "abc")
@pytest.mark.parametrize("seed", range(4))
def test_cases(seed, side):
    print(f"ran {seed}{side}")

def test_alone():
    print("ran alone")
"""


@pytest.mark.parametrize("sizes", [(1,), (7,), (3, 8), (8, 3), (2, 3, 4)])
def test_as_many_cases_are_kept_as_the_longest_parameter_has_values(sizes):
    cases = [frozenset(enumerate(indices)) for indices in product(*map(range, sizes))]
    kept = each_value_once(cases)
    assert len(set(kept)) == len(kept) == max(sizes)
    assert frozenset().union(*(cases[i] for i in kept)) == frozenset().union(*cases)


def test_cases_that_were_listed_in_part_lose_no_value():
    listed = [(0, 0), (0, 1), (1, 0), (2, 1), (2, 2), (0, 2)]
    cases = [frozenset(enumerate(indices)) for indices in listed]
    kept = each_value_once(cases)
    assert frozenset().union(*(cases[i] for i in kept)) == frozenset().union(*cases)
    assert len(kept) < len(cases)


def test_each_value_is_run_and_a_test_without_parameters_stays(tmp_path):
    (tmp_path / "test_small.py").write_text(SMALL)
    plugin = ("-p", "tests.support.each_value_once", "-p", "no:cacheprovider")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-s", "-q", *plugin, "--rootdir", tmp_path, tmp_path],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    ran = set(re.findall(r"ran (\w+)", done.stdout))
    assert "alone" in ran and len(ran) == 5
    assert {seed for seed, _ in ran - {"alone"}} == set("0123")
    assert {side for _, side in ran - {"alone"}} == set("abc")
