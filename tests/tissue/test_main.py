"""`python -m tissue`: the engine alone, from the command line."""

import re
import subprocess
import sys

import pytest

from tissue import block
from tissue.__main__ import cut_through, run_command


def test_a_block_is_cut_in_two_and_every_stage_is_timed(capsys):
    assert run_command(["--cells", "3", "4", "3", "--steps", "200"]) == 0
    out = capsys.readouterr().out
    for stage in ("CD", "GC", "RX", "all"):
        median, high = re.search(rf"^{stage}\b.*?([\d.]+) +([\d.]+)$", out, re.MULTILINE).groups()
        assert 0.0 <= float(median) <= float(high)
    assert re.search(r"pieces +2$", out, re.MULTILINE)
    before, after = re.search(r"tetrahedra +(\d+) -> (\d+)", out).groups()
    assert int(before) == 6 * 3 * 4 * 3 < int(after)


def test_the_cut_area_is_that_of_the_leaning_blade_through_the_block():
    cut = cut_through(block(), 400)
    assert cut.results[-1].cut_area == pytest.approx(0.06 * 0.04 * (1 + 0.25**2) ** 0.5, rel=0.15)


@pytest.mark.parametrize(
    "wrong",
    [
        ["--cells", "0", "1", "1"],
        ["--cells", "2", "2"],
        ["--size", "-1", "1", "1"],
        ["--size", "nan", "1", "1"],
        ["--steps", "0"],
        ["--steps", "many"],
        ["--cells", "100000", "100000", "1000"],
    ],
)
def test_a_wrong_option_gives_one_clear_error(wrong, capsys):
    with pytest.raises(SystemExit) as stopped:
        run_command(wrong)
    assert stopped.value.code == 2
    assert "error:" in capsys.readouterr().err.splitlines()[-1]


def test_the_engine_imports_no_arm_collision_or_viewer_package():
    """Neither MuJoCo, FCL and meshcat nor the other packages of the project are imported."""
    program = (
        "import sys, tissue.tissue, tissue.__main__\n"
        "print({'mujoco', 'fcl', 'meshcat', 'bridge', 'scalpel_sim'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)
    assert done.stdout.strip() == b"set()"
