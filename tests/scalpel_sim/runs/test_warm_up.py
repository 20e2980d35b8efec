"""The first run compiles in several processes; a later one, or a copied cache, compiles nothing."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

import scalpel_sim
from scalpel_sim.runs import warm_up
from scalpel_sim.runs.warm_up import USUAL_SETS, KernelSet, compile_ahead, kernels_are_compiled
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from tests.support.processes import environment
from tissue import block
from tissue.support import LEVELS, cache_directory, write_bundle

SMALL = KernelSet.of(SCENES["grid2"])
"""A set whose blade is a line."""

RUN_AND_COUNT = """
from numba.core import event

class Compilations(event.Listener):
    names = []
    def on_start(self, event):
        self.names.append(event.data["dispatcher"].py_func.__name__)
    def on_end(self, event):
        pass

counted = Compilations()
event.register("numba:compile", counted)
from scalpel_sim import SCENES, prepare
simulation = prepare(SCENES["grid2"])
simulation.run(simulation.stroke.duration)
import scalpel_sim
print(scalpel_sim.__file__)
print(counted.names)
"""


def test_a_material_whose_stress_relaxes_needs_more_kernels():
    scene = SCENES["organ"]
    relaxing = changed(scene, material=replace(scene.material, prony=((0.3, 0.1),)))
    assert KernelSet.of(relaxing) == KernelSet.of(scene)._replace(relaxes=True)
    assert KernelSet.of(relaxing).body(block((2, 2, 2))).material.prony
    assert not KernelSet.of(scene).body(block((2, 2, 2))).material.prony


def test_graspers_need_the_kernels_of_what_they_touch_and_of_what_they_tie():
    """A tissue that is served would else compile them in the step in which the jaws close."""
    scene = changed(SCENES["retract"], table=None)
    (left,) = scene.graspers
    rubbing = changed(scene, graspers=(structs.replace(left, holds="friction", closed=None),))
    alone = changed(scene, graspers=())
    found = [KernelSet.of(each) for each in (scene, rubbing, alone)]
    assert [(each.is_held, each.has_table) for each in found] == [
        (True, True),
        (False, True),
        (False, False),
    ]


@pytest.fixture
def started(monkeypatch):
    """The processes that are started, on a machine that seems to have compiled nothing."""
    processes = []

    class RecordedProcess(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            processes.append(self)

    monkeypatch.setattr(subprocess, "Popen", RecordedProcess)
    monkeypatch.setattr(warm_up, "kernels_are_compiled", lambda *_: False)
    return processes


@pytest.mark.parametrize("job", ["cut", "motion"])
@pytest.mark.parametrize("kernels", [USUAL_SETS[0], SMALL._replace(audit=True)])
def test_what_is_compiled_ahead_is_done_to_its_end(kernels, job):
    """Else no run would find its kernels, and each would compile again."""
    command = [sys.executable, "-m", "scalpel_sim.runs.warm_up", job, json.dumps(kernels)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert done.returncode == 0, done.stderr


def test_sets_are_compiled_one_first_and_the_others_in_shares_by_all_cores(started, monkeypatch):
    """The first in two processes. All are waited for, and the progress ends with all kernels."""
    shown = []
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    others = [SMALL._replace(audit=not SMALL.audit), SMALL._replace(relaxation="verlet"), SMALL]
    compile_ahead([SMALL, *others], lambda done, total: shown.append((done, total)))
    asked = [
        (process.args[3], [KernelSet(*json.loads(each)) for each in process.args[4:]])
        for process in started
    ]
    assert asked == [
        ("motion", [SMALL]),
        ("cut", [SMALL]),
        ("all", [others[0], SMALL]),
        ("all", [others[1]]),
    ]
    assert [process.returncode for process in started] == [0] * 4
    assert kernels_are_compiled(SMALL)
    assert all(done <= total for done, total in shown)
    assert shown[-1][0] == shown[-1][1]


def test_the_progress_counts_what_is_added_to_the_kernels_of_other_sets(tmp_path, monkeypatch):
    """Beside the kernels of the organ it would else be at its end from its begin."""
    default, held = KernelSet(), KernelSet(is_held=True)
    monkeypatch.setattr(warm_up, "n_compiled_kernels", lambda folder: 1003)
    assert warm_up._expected([default], tmp_path) == (0, warm_up.USUAL_NUMBER)
    (tmp_path / warm_up._mark(default)).touch()
    n_held, n_relaxing = warm_up._ADDED["is_held"], warm_up._ADDED["relaxes"]
    assert warm_up._expected([held], tmp_path) == (1003, n_held)
    assert warm_up._expected([default._replace(has_table=False)], tmp_path) == (1003, 0)
    both, other = held._replace(relaxes=True), default._replace(relaxes=True)
    assert warm_up._expected([held, both], tmp_path)[1] == n_held + n_relaxing
    assert warm_up._expected([held, both, other], tmp_path)[1] == n_held + n_relaxing


def test_a_first_run_that_is_interrupted_leaves_no_process_behind(started):
    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        compile_ahead([SMALL], interrupt)
    assert all(process.returncode is not None for process in started)


def test_a_later_run_starts_none(started, monkeypatch):
    monkeypatch.setattr(warm_up, "kernels_are_compiled", lambda *_: True)
    compile_ahead([SMALL])
    assert not started


def test_a_copied_cache_serves_a_copied_program_without_compiling(tmp_path):
    compile_ahead([SMALL])
    compiled = cache_directory()
    shutil.copytree(compiled, tmp_path / "cache" / "kernels" / compiled.name)
    for name in ("tissue", "bridge", "scalpel_sim"):
        shutil.copytree(Path(scalpel_sim.__file__).parents[1] / name, tmp_path / "program" / name)
    done = subprocess.run(
        [sys.executable, "-c", RUN_AND_COUNT],
        cwd=tmp_path,
        env=os.environ
        | {"PYTHONPATH": str(tmp_path / "program"), "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    place, names = done.stdout.splitlines()
    assert Path(place).is_relative_to(tmp_path)
    assert names == "[]"


@pytest.mark.skipif(all(level.missing() for level in LEVELS.values()), reason="of no level")
def test_with_a_bundle_a_first_run_compiles_and_writes_no_kernel(tmp_path):
    """Whatever package the kernels are in."""
    compile_ahead([SMALL])
    level = next(name for name, level in LEVELS.items() if not level.missing())
    bundle = tmp_path / "kernels.zip"
    assert write_bundle(level, cache_directory(), bundle) > 50
    variables = {"SCALPEL_SIM_BUNDLE": str(bundle), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", RUN_AND_COUNT],
        env=environment() | variables,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines()[-1] == "[]"
    assert not list(tmp_path.glob("cache/**/*.nbc"))
