"""Scenes with `[[attachment]]`: tissue that is held, pulled and tied, as files."""

import json

import numpy as np
import pytest

from scalpel_sim import read_scene
from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import UsageError
from scalpel_sim.preparation.tissue import make_tissue, times_of
from scalpel_sim.recording.columns import held_group, shared_columns
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.scene.checks import check_attachment
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.schema import AttachmentTable
from tests.support.run_files import assert_same_run

FILE = """\
seconds = 0.6
[body]
shape = "block"
cells = [4, 2, 2]
size = [0.04, 0.02, 0.02]
fixed = "left"

[material]
law = "neo_hookean"
young_modulus = 20e3
toughness = 20.0
viscous_damping = 40.0

[[attachment]]
where = "right"
stiffness = 2000.0
damping = 5.0
displacements = [[0.002, 0.0, 0.0], [0.001, 0.0, 0.0]]
times = [0.1, 0.2]
release_at = 0.5

[[attachment]]
where = "sphere:0.02,0.01,0.02,0.001"
to = [0.05, 0.01, 0.03]
stiffness = 100.0
damping = 0.1
area = 1e-6
toughness = 50.0

[[stroke]]
kind = "points"
points = [[0.031, -0.005, 0.015], [0.031, 0.025, 0.015]]
length = 0.04
speed = 0.2
"""
"""The blade cuts the ligament, and a slit of 5 mm below it."""


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """The folder of a run of that file."""
    folder = tmp_path_factory.mktemp("held")
    (folder / "held.toml").write_text(FILE, encoding="utf-8")
    words = ["run", str(folder / "held.toml"), "-q", "--out", str(folder / "out")]
    assert command_line(words) == 0
    return folder / "out"


def test_the_forces_on_attachments_have_columns_of_their_own_at_the_end(first):
    recording = read_forces(first / "forces.csv")
    assert recording.columns == shared_columns() + held_group(2).columns
    right, tie = recording.vector("held_0"), recording.vector("held_1")
    time = recording.column("time_s")
    assert right[abs(time - 0.1).argmin(), 0] < -0.2  # pulled back while it is led away
    assert (right[time > 0.502] == 0.0).all()  # let go at 0.5 s
    assert tie[0, 0] < -1e-3 and tie[0, 2] < -1e-3  # a part of the weight of the body
    assert (tie[-1] == 0.0).all()


def test_the_summary_says_what_each_held_and_at_which_force(first):
    summary = json.loads((first / "summary.json").read_text())
    right, tie = summary["attachments"]
    assert right["where"] == "right" and right["points"] == 0
    recording = read_forces(first / "forces.csv")
    largest = np.linalg.norm(recording.vector("held_0"), axis=1).max()
    assert right["force_peak_n"] == pytest.approx(largest)
    assert tie["where"].startswith("sphere") and tie["force_at_end_n"] == 0.0
    energies = summary["energies_j"]
    assert energies["breaking"] == pytest.approx(50.0 * 1e-6, rel=0.05)  # the ligament's
    assert energies["work_of_loads"] > 1e-5
    works = energies["work_of_blade"] + energies["work_of_loads"]
    assert abs(energies["residual"]) < 5e-3 * works


def test_the_scene_that_a_run_writes_gives_the_same_bits_again(first, tmp_path):
    words = ["run", str(first / "scene.toml"), "-q", "--out", str(tmp_path / "again")]
    assert command_line(words) == 0
    assert_same_run(first, tmp_path / "again")
    assert (tmp_path / "again" / "scene.toml").read_text() == (first / "scene.toml").read_text()


def test_a_body_that_only_attachments_hold_hangs_from_them(first):
    scene = read_scene(first / "scene.toml")
    hook = AttachmentTable(where="top", stiffness=500.0, damping=2.0)
    tissue = make_tissue(changed(scene, fixed="none", stretch=0.0, attachments=(hook,)))
    for _ in range(50):
        tissue.step(None, 1e-3)
    (attachment,) = tissue.attachments
    weight = 9.81 * tissue.snapshot().masses.sum()
    np.testing.assert_allclose(attachment.wrench.force, [0, 0, -weight], atol=0.01 * weight)


def test_a_speed_gives_the_times_of_the_ways():
    """3, 4 and 5 mm at 1 mm/s."""
    ways = [(3e-3, 0.0, 0.0), (3e-3, 4e-3, 0.0), (0.0, 0.0, 0.0)]
    table = AttachmentTable(where="top", stiffness=1.0, displacements=ways, speed=1e-3)
    assert times_of(table) == pytest.approx([3.0, 7.0, 12.0])
    check_attachment(table, "it")
    same = AttachmentTable(where="top", stiffness=1.0, displacements=[ways[0]] * 2, speed=1e-3)
    with pytest.raises(UsageError, match="two displacements in turn that are equal"):
        check_attachment(same, "it")
