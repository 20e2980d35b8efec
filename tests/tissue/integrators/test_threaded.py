"""Threads share the loops over a body and change only the run time."""

import hashlib
import os

import numpy as np
import pytest

from tests import bodies, strokes
from tissue import Material, SolverSettings, Tissue

pytestmark = pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core")

MESH = bodies.jittered(4, 2)
LAWS = {
    "springs": Material(),
    "neo-Hookean": Material(law="neo_hookean", poisson_ratio=0.45),
    "undamped": Material(retardation_time=0.0),
}


def state_after(threads, material, n_steps):
    """Return a digest of a body that is cut through and oscillates, after `n_steps` of 1 ms."""
    tissue = Tissue(
        MESH,
        material,
        fixed=bodies.sides(MESH),
        floor=-0.03,
        solver=SolverSettings(threads=threads),
    )
    n_cut = len(strokes.make(tissue, strokes.slanted(MESH)))
    for _ in range(n_steps - n_cut):
        tissue.step(None, 1e-3)
    assert tissue.n_pieces() == 2
    snapshot = tissue.snapshot()
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in snapshot)).hexdigest()


@pytest.mark.parametrize(
    ("law", "n_steps"), [("springs", 1000), ("neo-Hookean", 300), ("undamped", 300)]
)
def test_two_threads_give_the_same_bits_as_one(law, n_steps):
    one = state_after(1, LAWS[law], n_steps)
    assert state_after(2, LAWS[law], n_steps) == one


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, 10_000])
def test_an_impossible_number_of_threads_is_refused(threads):
    with pytest.raises(ValueError, match="whole number from 1 to"):
        Tissue(MESH, solver=SolverSettings(threads=threads))
