"""A blade of which a point is near the tissue is not compared by the collision library."""

import itertools

import numpy as np
import pytest

from bridge.collision import broad_phase
from bridge.collision.broad_phase import BroadPhase
from bridge.collision.coherence import WitnessPoint
from bridge.poses import pose_of
from tests.bridge.collision.test_coherence import BOX, DT, random_path
from tissue import BladeSegment, BladeShape, Chunks

SOUND_SPEED = 3.0
SHAPES = [None, BladeShape()]


@pytest.fixture
def n_compared(monkeypatch):
    """Count how often boxes are compared by the collision library."""
    calls = []
    real = broad_phase.are_colliding
    monkeypatch.setattr(broad_phase, "are_colliding", lambda *a: (calls.append(1), real(*a))[1])
    return lambda: len(calls)


def divided(bounds, rng):
    """Return chunks in a box, which leave gaps."""
    low, high = bounds
    corners = [low + (high - low) * np.array(index) / 3.0 for index in np.ndindex(3, 3, 3)]
    return np.array([(corner, corner + 0.25 * (high - low)) for corner in rng.permutation(corners)])


@pytest.mark.parametrize("shape", SHAPES, ids=["line", "body"])
@pytest.mark.parametrize("seed", range(4))
def test_every_answer_is_the_one_of_a_comparison_in_every_frame(shape, seed):
    """The chunks move, and change their order as after a cut."""
    rng = np.random.default_rng(seed)
    boxes, bounds, now = divided(BOX, rng), BOX, [Chunks(BOX[None], 0.0)]
    kept = BroadPhase(BOX, SOUND_SPEED, blade=shape, chunks=lambda: now[0])
    answers = []
    for i, (before, after) in enumerate(itertools.pairwise(random_path(rng, 2000))):
        if i % 200 == 0:
            boxes = divided(BOX, rng)
        boxes = boxes + 1e-5 * rng.normal(size=boxes.shape)
        now[0] = Chunks(boxes, rng.uniform(0.0, 0.1))
        fresh = BroadPhase(bounds, SOUND_SPEED, blade=shape, chunks=lambda: now[0])
        bounds = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
        for phase in (fresh, kept):
            phase.update_bounds(bounds, 1.0)
        answers.append(kept.overlaps(before, after, DT))
        assert answers[-1] == fresh.overlaps(before, after, DT)
    touches = [answer.tissue for answer in answers]
    assert 40 < sum(touches) < 1900


def test_a_blade_that_stays_near_is_compared_rarely(n_compared):
    phase = BroadPhase(BOX, SOUND_SPEED, blade=BladeShape(), chunks=lambda: Chunks(BOX[None], 0.0))
    there = BladeSegment(
        np.array([0, 0, 0.022]), np.array([0, 0.04, 0.025]), np.array([0, 0, -1.0])
    )
    before = pose_of(there)
    for i in range(1000):
        aside = np.array([1e-5 * i, 0.0, 0.0])
        after = pose_of(there._replace(tip=there.tip + aside, heel=there.heel + aside))
        phase.update_bounds(BOX, DT)
        assert phase.overlaps(before, after, DT).tissue
        before = after
    assert 1 <= n_compared() <= 5


@pytest.mark.parametrize("shape", SHAPES, ids=["line", "body"])
def test_the_point_is_nearest_to_a_box_beside_the_blade(shape):
    blade = pose_of(BladeSegment(np.zeros(3), np.array([0, 0, 0.04]), np.array([0, 1.0, 0])))
    low, high = np.array([[0.01, -0.005, 0.01], [0.02, 0.005, 0.02]])
    witness = WitnessPoint(shape)
    assert not witness.is_within(1.0, blade, low, high)
    witness.find(blade, low, high)
    distance = 0.01 - (0.0 if shape is None else 0.5 * shape.thickness)
    assert witness.is_within(distance + 1e-9, blade, low, high)
    assert not witness.is_within(distance - 1e-9, blade, low, high)
