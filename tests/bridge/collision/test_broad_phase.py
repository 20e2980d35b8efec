import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import FixtureBox, FixtureMesh
from bridge.collision.broad_phase import BroadPhase
from bridge.poses import pose_of
from tissue import BladeSegment, BladeShape, BladeSweep, Chunks

UNIT_BOX = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
SOUND_SPEED = 3.0
DT = 1e-3
FORWARD_LIKE = (0.3, 0.5, 0.7)

coordinates = st.floats(-2.0, 2.0)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
edges = vectors.filter(lambda v: np.linalg.norm(np.cross(v, FORWARD_LIKE)) > 1e-3)
fractions = st.floats(0.0, 1.0)


def segment(tip, edge):
    tip, edge = np.array(tip, float), np.array(edge, float)
    forward = np.cross(edge, FORWARD_LIKE)
    return BladeSegment(tip, tip + edge, forward / np.linalg.norm(forward))


def overlaps(phase, sweep, dt, **keywords):
    return phase.overlaps(pose_of(sweep.t0), pose_of(sweep.t1), dt, **keywords)


def resting(tip, edge=(0.0, 0.0, 1.0)):
    pose = segment(tip, edge)
    return BladeSweep(pose, pose)


@given(edges, edges, vectors, fractions, fractions, st.tuples(fractions, fractions, fractions))
def test_an_edge_that_passes_through_the_tissue_is_never_missed(
    edge_t0, edge_t1, motion, along, when, inside
):
    # Both ends move on straight lines. The blade is placed so that the point at the fraction
    # `along` of its edge is at `inside` in the unit box at the time `when`.
    swept_point = when * motion + along * ((1.0 - when) * edge_t0 + when * edge_t1)
    tip_t0 = np.array(inside) - swept_point
    sweep = BladeSweep(segment(tip_t0, edge_t0), segment(tip_t0 + motion, edge_t1))
    assert overlaps(BroadPhase(UNIT_BOX, 0.0), sweep, DT).tissue


@pytest.mark.parametrize(("gap", "touches"), [(2.9e-3, True), (3.1e-3, False)])
def test_the_box_grows_by_the_distance_that_sound_travels_in_a_step(gap, touches):
    phase = BroadPhase(UNIT_BOX, SOUND_SPEED)
    assert overlaps(phase, resting((0.5, 0.5, 1.0 + gap)), DT).tissue == touches


@pytest.mark.parametrize(("gap", "touches"), [(0.0499, True), (0.0501, False)])
def test_the_box_of_a_falling_body_grows_by_the_distance_it_fell_in_the_last_step(gap, touches):
    phase = BroadPhase(UNIT_BOX + np.array([0.0, 0.0, 0.05]), 0.0)
    phase.update_bounds(UNIT_BOX, DT)
    assert overlaps(phase, resting((0.5, 0.5, -1.0 - gap)), DT).tissue == touches


TABLE = FixtureBox("table", np.array([9.0, 9.0, 0.1]), np.array([0.0, 0.0, -0.5]))
CLAMP = FixtureMesh(
    "clamp",
    np.array([[3.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 0.0, 1.0]]),
    np.array([[0, 1, 2]]),
)


@pytest.mark.parametrize(
    ("tip", "names"),
    [
        ((0.5, 0.5, 3.0), ()),
        ((0.5, 0.5, -0.5), ("table",)),
        ((3.0, 0.2, 0.2), ("clamp",)),
        ((3.0, 0.2, -0.5), ("table", "clamp")),
    ],
)
def test_the_fixtures_that_the_blade_touches_are_named(tip, names):
    phase = BroadPhase(UNIT_BOX, SOUND_SPEED, [TABLE, CLAMP])
    assert overlaps(phase, resting(tip), DT).fixtures == names


def test_a_fixture_of_many_triangles_does_not_hide_the_tissue():
    grid = np.random.default_rng(0).random((3000, 3))
    mesh = FixtureMesh("gauze", grid, np.arange(3000).reshape(1000, 3))
    contacts = overlaps(BroadPhase(UNIT_BOX, 0.0, [mesh]), resting((0.5, 0.5, 0.0)), DT)
    assert contacts == (True, ("gauze",))


def test_a_rotated_fixture_box_is_tested_in_its_rotated_pose():
    s = np.sqrt(0.5)
    rotation = np.array([[s, -s, 0.0], [s, s, 0.0], [0.0, 0.0, 1.0]])
    bar = FixtureBox("bar", np.array([2.0, 0.02, 2.0]), np.array([5.0, 5.0, 0.0]), rotation)
    phase = BroadPhase(UNIT_BOX, 0.0, [bar])
    assert overlaps(phase, resting((5.5, 5.5, 0.0)), DT).fixtures == ("bar",)
    assert overlaps(phase, resting((5.5, 4.5, 0.0)), DT).fixtures == ()


def test_two_fixtures_with_the_same_name_are_refused():
    with pytest.raises(ValueError, match="two fixtures have the name 'table'"):
        BroadPhase(UNIT_BOX, SOUND_SPEED, [TABLE, TABLE])


# ---- chunks --------------------------------------------------------------------------------------

HORSESHOE = np.array(
    [
        [[0.0, 0.0, 0.0], [1.0, 0.2, 1.0]],
        [[0.0, 0.2, 0.0], [0.2, 1.0, 1.0]],
        [[0.8, 0.2, 0.0], [1.0, 1.0, 1.0]],
    ]
)
"""Three boxes around a hollow, open at the back: the unit box is the box around all of them."""


class Source:
    """A source of chunks that can be moved; it counts the queries."""

    def __init__(self, boxes, fastest=0.0):
        self.boxes, self.fastest, self.n_queries = boxes, fastest, 0

    def __call__(self):
        self.n_queries += 1
        return Chunks(self.boxes, self.fastest)


def test_chunks_are_queried_only_within_the_bounds_and_before_the_blade_holds_tissue():
    source = Source(HORSESHOE)
    phase = BroadPhase(UNIT_BOX, 0.0, chunks=source)
    overlaps(phase, resting((0.5, 0.6, 2.0)), DT)
    assert overlaps(phase, resting((0.5, 0.6, 0.0)), DT, engaged=True).tissue
    assert source.n_queries == 0
    overlaps(phase, resting((0.5, 0.6, 0.0)), DT)
    assert source.n_queries == 1


@pytest.mark.parametrize(("fastest", "touches"), [(0.0, False), (99.9, False), (100.1, True)])
def test_chunks_grow_by_the_distance_of_sound_and_their_fastest_node_in_a_step(fastest, touches):
    """The walls of the hollow are 0.3 m from its middle; sound travels 0.2 m."""
    phase = BroadPhase(UNIT_BOX, 200.0, chunks=Source(HORSESHOE, fastest))
    blade = BladeSegment(
        np.array([0.5, 0.6, 0.0]), np.array([0.5, 0.6, 1.0]), np.array([0, 1.0, 0])
    )
    assert overlaps(phase, BladeSweep(blade, blade), DT).tissue == touches


def test_chunks_that_move_are_tested_at_their_current_positions():
    source = Source(HORSESHOE)
    phase = BroadPhase(UNIT_BOX, 0.0, chunks=source)
    blade = resting((0.5, 0.6, 0.0))
    assert not overlaps(phase, blade, DT).tissue
    source.boxes = HORSESHOE + np.array([0.35, 0.0, 0.0])
    assert overlaps(phase, blade, DT).tissue
    source.boxes = HORSESHOE[:2]
    assert not overlaps(phase, blade, DT).tissue


@given(st.lists(vectors, min_size=1, max_size=6), vectors, edges, vectors, fractions)
def test_no_chunk_on_the_path_of_the_edge_is_missed(corners, tip, edge, motion, when):
    """The boxes are cubes of 1 mm, one of them around a point that the edge sweeps."""
    point = tip + when * motion + 0.3 * edge
    low = np.array([point, *corners])
    boxes = np.stack([low - 5e-4, low + 5e-4], axis=1)
    bounds = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    phase = BroadPhase(bounds, 0.0, chunks=Source(boxes))
    assert overlaps(phase, BladeSweep(segment(tip, edge), segment(tip + motion, edge)), DT).tissue


def test_the_body_of_a_blade_touches_tissue_that_its_edge_does_not():
    shape = BladeShape(thickness=0.02, bevel_angle=0.5, height=0.3)
    blade = BladeSegment(
        np.array([0.5, 1.2, 0.0]), np.array([0.5, 1.2, 1.0]), np.array([0, 1.0, 0])
    )
    sweep = BladeSweep(blade, blade)
    assert not overlaps(BroadPhase(UNIT_BOX, 0.0), sweep, DT).tissue
    assert overlaps(BroadPhase(UNIT_BOX, 0.0, blade=shape), sweep, DT).tissue
