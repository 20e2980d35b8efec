"""A disk that gets full at a random instant ends a run; what was done is whole."""

import re
import tempfile
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.runs.file_names import RUN_FILES
from tests.support.battery import battery
from tests.support.run_files import names_in
from tests.support.small_disk import run_on_a_small_disk
from tests.support.whole_runs import broken_files

ROOM = (31e6, 60e6)
"""Sizes of the disk [bytes]: with room for the reserve of `grid2`, or hardly."""
LONGEST = 5.0
"""When the disk is filled at the latest [s]: by then most runs have ended."""


@pytest.mark.usefixtures("small_disks")
@battery(n_per_change=4, n_long=200)
def test_a_full_disk_ends_a_run_by_its_name_and_leaves_whole_files(case):
    random = np.random.default_rng(case)
    seconds = random.choice([0.1, 1.0, 3.0])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        done = run_on_a_small_disk(
            *("run", "grid2", "-q", "--seconds", str(seconds)),
            megabytes=random.uniform(*ROOM) / 1e6,
            copy_to=folder,
            filled_after=random.uniform(0.0, LONGEST),
        )
        assert not broken_files(folder)
        left = names_in(folder)
        if done.returncode == 0:
            assert left == sorted(RUN_FILES)
            return
        assert done.returncode == 1, done.stderr
        assert re.search("No space left|no room for", done.stderr.splitlines()[-1]), done.stderr
        if "holds what was done" in done.stderr:  # frames were done
            lacking = done.stderr.partition("but not ")[2]  # where the end of the run had no room
            for name in ("forces.csv", "initial.vtu", "final.vtu", "summary.json"):
                assert (name in left) != (name in lacking), done.stderr
