"""A run whose files are damaged at random after it was killed ends as one that was never killed."""

import shutil
import tempfile
from pathlib import Path

import pytest

from tests.scalpel_sim.output.killed_runs import (
    copied,
    damaged_at_random,
    expect_same,
    killed_in,
    resuming,
    run_in,
)
from tests.support.battery import battery


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> tuple[Path, Path]:
    """A whole run, and one that was killed."""
    whole, killed = (tmp_path_factory.mktemp(name) for name in ("whole", "killed"))
    run_in(whole)
    killed_in(killed)
    return whole, killed


@pytest.fixture(scope="module")
def resume():
    with resuming() as go_on:
        yield go_on


@battery(n_per_change=3, n_long=500)
def test_no_random_damage_is_kept(case, runs, resume):
    whole, killed = runs
    parent = Path(tempfile.mkdtemp())
    try:
        folder = copied(killed, parent / "run")
        damaged_at_random(folder, case)
        resume(folder)
        expect_same(folder, whole)
    finally:
        shutil.rmtree(parent)
