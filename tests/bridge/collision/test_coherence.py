"""The collision library compares blade and tissue only where the last answer may have changed."""

import itertools

import numpy as np
import pytest

from bridge.collision import broad_phase
from bridge.collision.broad_phase import BroadPhase
from bridge.collision.coherence import WitnessPoint
from bridge.poses import pose_of
from tissue import BladeSegment, BladeShape, Chunks

DT = 1e-3
BOX = np.array([[-0.02, -0.02, -0.02], [0.02, 0.02, 0.02]])
SOUND_SPEED = 3.0
SHAPES = [None, BladeShape()]


def turned(vector, axis, angle):
    """Return a vector turned about a unit axis (Rodrigues)."""
    along = (axis @ vector) * axis
    return along + np.cos(angle) * (vector - along) + np.sin(angle) * np.cross(axis, vector)


def random_path(rng, n_frames):
    """Return poses of a blade that wanders and turns around the box, fast and slow, in and out."""
    tip, edge, forward = np.array([0.08, 0.0, 0.0]), np.array([0, 0, 0.04]), np.array([0, 1.0, 0])
    velocity, axis, poses = np.zeros(3), np.array([1.0, 0.0, 0.0]), []
    for i in range(n_frames):
        if i % 40 == 0:
            away = rng.uniform(-0.08, 0.08, 3) - tip
            velocity = rng.choice([0.0, 0.02, 0.2, 2.0]) * away / np.linalg.norm(away)
            axis, spin = rng.normal(size=3), rng.choice([0.0, 1.0, 30.0])
            axis /= np.linalg.norm(axis)
        tip = tip + DT * velocity
        edge, forward = (turned(v, axis, DT * spin) for v in (edge, forward))
        forward = forward / np.linalg.norm(forward)
        poses.append(pose_of(BladeSegment(tip, tip + edge, forward)))
    return poses


@pytest.fixture
def n_compared(monkeypatch):
    """Count how often boxes are compared by the collision library."""
    calls = []
    real = broad_phase.are_colliding
    monkeypatch.setattr(broad_phase, "are_colliding", lambda *a: (calls.append(1), real(*a))[1])
    return lambda: len(calls)


@pytest.mark.parametrize("shape", SHAPES, ids=["line", "body"])
@pytest.mark.parametrize("seed", range(4))
def test_every_answer_is_the_one_of_a_comparison_in_every_frame(shape, seed):
    """The tissue's box moves and grows too."""
    rng = np.random.default_rng(seed)
    poses = random_path(rng, 2000)
    kept, bounds, answers = BroadPhase(BOX, 3.0, blade=shape), BOX, []
    for before, after in itertools.pairwise(poses):
        fresh = BroadPhase(bounds, 3.0, blade=shape)
        bounds = bounds + rng.choice([0.0, 1e-6, 1e-4]) * rng.normal(size=(2, 3))
        for phase in (fresh, kept):
            phase.update_bounds(bounds, DT)
        answers.append(kept.overlaps(before, after, DT))
        assert answers[-1] == fresh.overlaps(before, after, DT)
    touches = [answer.tissue for answer in answers]
    assert 100 < sum(touches) < 1900


def divided(bounds, rng):
    """Return chunks in a box, which leave gaps."""
    low, high = bounds
    corners = [low + (high - low) * np.array(index) / 3.0 for index in np.ndindex(3, 3, 3)]
    return np.array([(corner, corner + 0.25 * (high - low)) for corner in rng.permutation(corners)])


@pytest.mark.parametrize("shape", SHAPES, ids=["line", "body"])
@pytest.mark.parametrize("seed", range(4))
def test_every_answer_about_chunks_is_the_one_of_a_comparison_in_every_frame(shape, seed):
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


NEAR = BladeSegment(np.array([0, 0, 0.022]), np.array([0, 0.04, 0.025]), np.array([0, 0, -1.0]))
FAR = NEAR._replace(tip=np.array([0, 0, 0.1]), heel=np.array([0, 0.04, 0.1]))


@pytest.mark.parametrize(
    ("start", "step", "touches"),
    [(NEAR, (1e-5, 0.0, 0.0), True), (FAR, (0.0, 0.0, -5e-5), False)],  # from 80 to 30 mm above
    ids=["stays near", "stays away"],
)
def test_a_blade_is_compared_rarely(start, step, touches, n_compared):
    phase = BroadPhase(BOX, SOUND_SPEED, blade=BladeShape(), chunks=lambda: Chunks(BOX[None], 0.0))
    before = pose_of(start)
    for i in range(1000):
        by = i * np.array(step)
        after = pose_of(start._replace(tip=start.tip + by, heel=start.heel + by))
        phase.update_bounds(BOX, DT)
        assert phase.overlaps(before, after, DT).tissue == touches
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
