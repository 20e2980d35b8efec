"""Sequences of 5 to 50 random cuts leave a sound body, by a blade and by `Tissue.incise`."""

import math

import pytest

from tests.long.child import Child
from tests.support.battery import Disagreement, battery

LONGEST, PATIENCE = 120.0, 900.0
"""Longest processor time, and wall time, of a sequence [s]; most take some seconds."""


def sequences(module):
    """Return a process that makes the sequences of a module.

    Caches of bodies fill its memory, and after some hundred sequences 512 MB did not suffice.
    """
    return Child(module, "run", longest=LONGEST, patience=PATIENCE, growth=math.inf, room=None)


@pytest.fixture(scope="module")
def blade():
    child = sequences("tests.long.blade_sequences")
    yield child
    child.close()


@pytest.fixture(scope="module")
def knife():
    child = sequences("tests.long.incision_sequences")
    yield child
    child.close()


@battery(n_per_change=3, n_long=5_000)
def test_strokes_of_a_blade_leave_a_sound_body(blade, tally, case):
    reply = blade.run(case)
    assert reply["faults"] == []
    tally["strokes"] += reply["n_strokes"]


@battery(n_per_change=4, n_long=5_000, disagreements=0.01)
def test_incisions_leave_a_sound_body_in_the_pieces_of_an_exact_cut(knife, tally, case):
    """Farther from each cut than the path error: whole what they leave whole, else apart."""
    reply = knife.run(case)
    assert reply["faults"] == []
    pieces, exact = reply["pieces"], reply["exact"]
    tally["incisions"] += reply["n_incisions"]
    tally["as many pieces as exactly"] += pieces == exact
    tally["decided [% of the bodies]"] += 100.0 * reply["decided"]
    if reply["contradictions"]:
        raise Disagreement(f"{reply['body']}: {'; '.join(reply['contradictions'])}")
