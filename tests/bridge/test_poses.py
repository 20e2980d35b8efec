import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.poses import half_length, motion, moved
from tissue import BladeSegment

UPRIGHT = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.array([0.0, 1.0, 0.0]))

components = st.floats(-1.0, 1.0)
vectors = st.tuples(components, components, components).map(np.array)


def test_a_blade_that_slides_does_not_turn():
    slid = UPRIGHT._replace(tip=UPRIGHT.tip + 0.01, heel=UPRIGHT.heel + 0.01)
    assert motion(UPRIGHT, slid) == pytest.approx([0.01, 0.01, 0.01, 0.0, 0.0, 0.0])


def test_a_quarter_turn_about_the_edge_turns_the_flat():
    turned = UPRIGHT._replace(forward=np.array([-1.0, 0.0, 0.0]))
    assert motion(UPRIGHT, turned) == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2.0])


@given(vectors, vectors)
def test_the_motion_to_a_moved_pose_is_the_one_that_moved_it(shift, turn):
    done = np.concatenate([shift, 1.5 * turn])
    assert motion(UPRIGHT, moved(UPRIGHT, done)) == pytest.approx(done, abs=1e-12)


@given(vectors, vectors)
def test_the_motion_between_two_poses_moves_the_first_to_the_second(shift, turn):
    there = moved(UPRIGHT, np.concatenate([shift, 1.5 * turn]))
    again = moved(UPRIGHT, motion(UPRIGHT, there))
    for wanted, found in zip(there, again, strict=True):
        assert found == pytest.approx(wanted, abs=1e-12)


@given(vectors)
def test_a_moved_blade_keeps_its_length_and_right_angle(turn):
    there = moved(UPRIGHT, np.concatenate([np.zeros(3), 2.0 * turn]))
    assert half_length(there) == pytest.approx(0.02)
    assert np.linalg.norm(there.forward) == pytest.approx(1.0, abs=1e-15)
    assert there.forward @ (there.heel - there.tip) == pytest.approx(0.0, abs=1e-15)
