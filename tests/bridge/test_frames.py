import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import FixtureBox, FixtureMesh, TissueFrame
from bridge.poses import six
from tissue import BladeSegment, Wrench

QUARTER_TURN_ABOUT_Z = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TURNED = TissueFrame(QUARTER_TURN_ABOUT_Z, np.array([1.0, 0.0, 0.0]))

coordinates = st.floats(-1.0, 1.0)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)


@st.composite
def frames(draw):
    w, x, y, z = q = np.array(draw(st.tuples(*[coordinates] * 4).filter(lambda q: any(q)))) + 0.0
    w, x, y, z = q / np.sqrt(q @ q) if q @ q > 1e-6 else (1.0, 0.0, 0.0, 0.0)
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return TissueFrame(np.array(rotation), draw(vectors))


def test_forward_turns_with_the_frame_but_does_not_move_with_it():
    segment = BladeSegment(np.zeros(3), np.ones(3), np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(TURNED.segment_to_tissue(segment).forward, [1, 0, 0])


@given(frames(), vectors, vectors, vectors)
def test_a_segment_is_the_same_after_conversion_to_the_tissue_and_back(frame, tip, heel, forward):
    segment = BladeSegment(tip, heel, forward)
    back = frame.segment_to_world(frame.segment_to_tissue(segment))
    np.testing.assert_allclose(back, segment, atol=1e-14)


@given(frames(), vectors, vectors, vectors)
def test_the_moment_about_the_origin_of_the_world_is_that_of_the_turned_wrench(
    frame, force, torque, point
):
    world = frame.wrench_to_world(Wrench(force, torque, point))
    about_tissue = torque + np.cross(point, force)
    about_world = frame.rotation @ about_tissue + np.cross(frame.origin, frame.rotation @ force)
    np.testing.assert_allclose(
        world.torque + np.cross(world.point, world.force), about_world, atol=1e-13
    )


@given(frames(), vectors, vectors)
def test_power_is_the_same_in_both_frames(frame, force, velocity):
    wrench = frame.wrench_to_world(Wrench(force, np.zeros(3), np.zeros(3)))
    assert wrench.force @ frame.vectors_to_world(velocity) == pytest.approx(
        force @ velocity, abs=1e-14
    )


def test_the_identity_changes_no_bit():
    segment = BladeSegment(*np.random.default_rng(1).normal(size=(3, 3)))
    for before, after in zip(segment, TissueFrame().segment_to_tissue(segment), strict=True):
        assert before.tobytes() == after.tobytes()


@given(frames())
def test_a_corner_of_a_fixture_box_is_converted_as_a_point_is(frame):
    box = FixtureBox("table", np.array([0.4, 0.2, 0.1]), np.array([0.1, 0.0, -0.3]))
    turned = frame.fixture_to_tissue(box)
    np.testing.assert_allclose(
        turned.centre + turned.rotation @ (0.5 * turned.size),
        frame.points_to_tissue(box.centre + 0.5 * box.size),
        atol=1e-14,
    )


def test_the_vertices_of_a_fixture_mesh_are_points():
    mesh = FixtureMesh("clamp", np.eye(3), np.array([[0, 1, 2]]))
    np.testing.assert_allclose(
        TURNED.fixture_to_tissue(mesh).positions, TURNED.points_to_tissue(np.eye(3))
    )


@pytest.mark.parametrize(
    ("rotation", "why"),
    [
        (np.diag([1.0, 1.0, -1.0]), "is a reflection"),
        (np.diag([1.0, 1.0, 1.001]), "not orthonormal"),
        (np.zeros((3, 3)), "not orthonormal"),
        (np.full((3, 3), np.nan), "not finite"),
        (np.eye(2), r"shape \(2, 2\)"),
    ],
)
def test_a_matrix_that_is_no_rotation_is_refused(rotation, why):
    with pytest.raises(ValueError, match=f"the tissue's rotation.*{why}"):
        TissueFrame(rotation)


def test_an_origin_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="the tissue's origin is not finite"):
        TissueFrame(origin=np.array([0.0, np.inf, 0.0]))


def test_a_frame_cannot_change_during_a_run():
    with pytest.raises(ValueError, match="read-only"):
        TURNED.origin[0] = 2.0


@given(frames(), vectors, vectors, vectors)
def test_a_wrench_in_plain_numbers_is_the_one_in_arrays(frame, force, torque, point):
    numbers = six(np.concatenate([force, torque]))
    expected = frame.wrench_to_world(Wrench(force, torque, point))
    for found, wanted in zip(frame.numbers_to_world(numbers, point), expected, strict=True):
        assert found.tobytes() == wanted.tobytes()
