"""Threads share the loops over a body and change only the run time."""

import gc
import hashlib
import os
import subprocess
import sys
import threading
import time
import weakref
from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.support.materials import SPRINGS
from tissue import Global, Material, SolverSettings, Tissue
from tissue.integrators import threads

needs_two_cores = pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core")

MESH = bodies.jittered(4, 2)
SOLID = Material()
CASES = {
    "springs": (SPRINGS, {}, 400),
    "springs, account": (SPRINGS, {"audit": True}, 100),
    "springs, Verlet": (SPRINGS, {"relaxation": "verlet"}, 300),
    "springs, damped between steps": (SPRINGS, {"relaxation": Global(damping="step")}, 300),
    "solid": (SOLID, {}, 300),
    "solid, single": (SOLID, {"precision": "single"}, 300),
    "solid, stress relaxes": (replace(SOLID, prony=((0.3, 0.1), (0.2, 5.0))), {"audit": True}, 300),
    "solid, damped in stages": (SOLID, {"relaxation": Global(damping="stage")}, 300),
    "solid, Verlet": (SOLID, {"relaxation": "verlet"}, 300),
    "undamped": (Material(retardation_time=0.0), {}, 300),
}
"""Material, settings, and number of steps of 1 ms."""


def cut_through(threads, case):
    """Return a body that has been cut through and oscillates."""
    material, settings, n_steps = CASES[case]
    solver = SolverSettings(threads=threads, **settings)
    tissue = Tissue(MESH, material, fixed=bodies.sides(MESH), floor=-0.03, solver=solver)
    n_cut = len(strokes.make(tissue, strokes.slanted(MESH)))
    for _ in range(n_steps - n_cut):
        tissue.step(None, 1e-3)
    assert tissue.n_pieces() == 2
    return tissue


def digest_of(tissue):
    """Return a digest of every bit of the state."""
    arrays = [np.ascontiguousarray(a).tobytes() for a in tissue.snapshot()]
    dissipated = tissue._model.damping.dissipated
    return hashlib.sha256(b"".join([*arrays, repr(dissipated).encode()])).hexdigest()


@needs_two_cores
@pytest.mark.parametrize("case", CASES)
def test_two_threads_give_the_same_bits_as_one(case):
    assert digest_of(cut_through(2, case)) == digest_of(cut_through(1, case))


@needs_two_cores
@pytest.mark.parametrize("case", ["solid", "solid, Verlet"])
def test_a_thread_that_never_arrives_changes_nothing(monkeypatch, case):
    expected = digest_of(cut_through(1, case))
    monkeypatch.setattr(threads._Worker, "_work", lambda worker: None)
    assert digest_of(cut_through(2, case)) == expected


@needs_two_cores
def test_a_thread_that_leaves_after_each_loop_changes_nothing(monkeypatch):
    expected = digest_of(cut_through(1, "solid"))
    monkeypatch.setattr(threads, "LONGEST_SPIN", 1)
    assert digest_of(cut_through(2, "solid")) == expected


@needs_two_cores
def test_two_bodies_have_threads_of_their_own():
    expected = digest_of(cut_through(1, "solid"))
    pair = [Tissue(MESH, SOLID, fixed=bodies.sides(MESH), floor=-0.03, solver=two()) for _ in "ab"]
    n_cut = 0
    for sweep in strokes.sweeps(strokes.slanted(MESH)):
        n_cut += 1
        for tissue in pair:
            tissue.step(sweep, strokes.DT)
    for _ in range(CASES["solid"][2] - n_cut):
        for tissue in pair:
            tissue.step(None, 1e-3)
    assert [digest_of(tissue) for tissue in pair] == [expected] * 2


def two():
    """Return the settings of two threads."""
    return SolverSettings(threads=2)


@needs_two_cores
def test_a_thread_ends_with_its_body():
    before = set(threading.enumerate())
    tissue = Tissue(MESH, SOLID, solver=two())
    tissue.step(None, 1e-3)
    (thread,) = set(threading.enumerate()) - before
    is_alive = weakref.ref(tissue)
    del tissue
    gc.collect()
    assert is_alive() is None
    thread.join(5.0)
    assert not thread.is_alive()


@needs_two_cores
def test_a_thread_sleeps_where_no_steps_are_taken():
    tissue = Tissue(MESH, SOLID, solver=two())
    tissue.step(None, 1e-3)
    (worker,) = tissue._stages.global_stepper._threads._workers
    until = time.monotonic() + 5.0
    while not worker._is_asleep and time.monotonic() < until:
        time.sleep(1e-3)
    assert worker._is_asleep


@needs_two_cores
@pytest.mark.parametrize("end", ["", "raise KeyboardInterrupt"])
def test_a_process_ends_while_its_threads_look_for_loops(end):
    program = (
        "from tissue import SolverSettings, Tissue, block\n"
        "tissue = Tissue(block((2, 2, 2)), solver=SolverSettings(threads=2))\n"
        f"for _ in range(20): tissue.step(None, 1e-3)\n{end}\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0 if not end else done.returncode != 0
    assert ("KeyboardInterrupt" in done.stderr) == bool(end)
    assert "Fatal" not in done.stderr


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, 10_000])
def test_an_impossible_number_of_threads_is_refused(threads):
    with pytest.raises(ValueError, match="whole number from 1 to"):
        Tissue(MESH, solver=SolverSettings(threads=threads))


@needs_two_cores
def test_the_hierarchy_runs_on_one_thread():
    with pytest.raises(ValueError, match="runs on one"):
        Tissue(MESH, SPRINGS, solver=SolverSettings(threads=2, relaxation="hierarchical"))
