import numpy as np
import pytest

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.stroke import Stroke, from_csv
from tissue import BladeSegment

HEADER = "t,tip_x,tip_y,tip_z,heel_x,heel_y,heel_z"
FORWARD = ",forward_x,forward_y,forward_z"


def standing(y=0.0, length=0.05):
    """Return an upright blade with its tip at (0, y, 0), which cuts towards +y."""
    return BladeSegment(
        np.array([0.0, y, 0.0]), np.array([0.0, y, length]), np.array([0.0, 1.0, 0.0])
    )


def write(tmp_path, *lines):
    path = tmp_path / "stroke.csv"
    path.write_text("\n".join(lines))
    return path


def test_a_stroke_passes_through_its_poses_and_rests_before_and_after():
    stroke = Stroke([2.0, 2.5, 4.0], [standing(0.0), standing(0.01), standing(0.03)])
    assert stroke.duration == 2.0
    assert stroke.blade_length == pytest.approx(0.05)
    for t, y in ((-1.0, 0.0), (0.0, 0.0), (0.5, 0.01), (1.25, 0.02), (2.0, 0.03), (9.0, 0.03)):
        pose = stroke.pose(t)
        assert np.allclose(pose.tip, [0.0, y, 0.0], atol=1e-15)
        assert np.allclose(pose.heel, [0.0, y, 0.05], atol=1e-15)
        assert np.allclose(pose.forward, [0.0, 1.0, 0.0], atol=1e-15)


def test_a_blade_turns_evenly_about_the_middle_of_its_edge():
    turned = BladeSegment(
        np.array([0.025, 0.0, 0.025]), np.array([-0.025, 0.0, 0.025]), np.array([0.0, 1.0, 0.0])
    )
    stroke = Stroke([0.0, 1.0], [standing(), turned])
    for share in (0.0, 0.25, 0.5, 1.0):
        pose = stroke.pose(share)
        angle = share * np.pi / 2.0
        assert np.allclose(
            pose.tip - pose.heel, 0.05 * np.array([np.sin(angle), 0, -np.cos(angle)]), atol=1e-12
        )
        assert np.allclose(pose.tip + pose.heel, [0.0, 0.0, 0.05], atol=1e-12)


def test_forward_is_made_orthogonal_to_the_edge():
    leaning = standing()._replace(forward=np.array([0.0, 1.0, 1.0]))
    assert np.allclose(Stroke([0, 1], [leaning, leaning]).pose(0.5).forward, [0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("times", "poses", "message"),
    [
        ([0.0], [standing()], "at least two"),
        ([0.0, 1.0], [standing()], "2 times and 1 poses"),
        ([0.0, 0.0], [standing(), standing(0.01)], "pose 1 .* times must increase"),
        ([0.0, np.nan], [standing(), standing(0.01)], "pose 1 .* not finite"),
        ([0.0, 1.0], [standing(), standing(length=0.0)], "pose 1 .* no length"),
        ([0.0, 1.0], [standing(), standing(length=0.06)], "60 mm long, and was 50 mm"),
        ([0.0, 1.0], [standing(), standing(3.0)], "3 m/s"),
        (
            [0.0, 1.0],
            [standing(), standing()._replace(forward=np.array([0.0, 0.0, 2.0]))],
            "pose 1 .* along the edge",
        ),
        ([0.0, 1.0], [standing(), standing()._replace(tip=np.zeros(2))], "three numbers|inhomog"),
    ],
)
def test_a_path_that_no_blade_can_follow_is_refused(times, poses, message):
    with pytest.raises(ValueError, match=message):
        Stroke(times, poses)


def test_a_file_of_poses_is_a_stroke(tmp_path):
    path = write(
        tmp_path,
        "# by hand",
        HEADER,
        "0.0, 0,0.00,0, 0,0.00,0.05",
        "",
        "1.0, 0,0.02,0, 0,0.02,0.05",
    )
    pose = from_csv(path).pose(0.5)
    assert np.allclose(pose.tip, [0.0, 0.01, 0.0])
    assert np.allclose(pose.forward, [0.0, 1.0, 0.0])  # the direction of its motion


def test_columns_may_come_in_any_order_and_name_forward(tmp_path):
    path = write(
        tmp_path,
        "forward_x,forward_y,forward_z,heel_x,heel_y,heel_z,tip_x,tip_y,tip_z,t",
        "1,0,0, 0,0,.05, 0,0,0, 0",
        "1,0,0, 0,0,.05, 0,0,0, 1",
    )
    assert np.allclose(from_csv(path).pose(0.5).forward, [1.0, 0.0, 0.0])


def test_a_blade_at_rest_faces_the_direction_of_its_next_or_last_motion(tmp_path):
    rows = [f"{t},0,{y},0,0,{y},.05" for t, y in enumerate([0, 0, 0, 0.01, 0.02, 0.02, 0.02])]
    stroke = from_csv(write(tmp_path, HEADER, *rows))
    for t in (0.0, 3.0, 6.0):
        assert np.allclose(stroke.pose(t).forward, [0.0, 1.0, 0.0])


GOOD = "0,0,0,0,0,0,.05"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "is empty; its first line is t,tip_x"),
        (["t,x,y,z"], "line 1: the columns are 't,x,y,z'; wanted t,tip_x"),
        ([HEADER + ",forward_x", GOOD], "line 1: the columns are"),
        ([HEADER], "has 0 poses"),
        ([HEADER, GOOD], "has 1 poses"),
        ([HEADER, GOOD, "1,0,0,0,0,0"], "line 3: 6 values, wanted 7"),
        ([HEADER, GOOD, "", "1,0,zero,0,0,0,.05"], "line 4: 'zero' is not a finite number"),
        ([HEADER, "0,0,0,0,0,0,0", "1,0,.01,0,0,.01,0"], "line 2: .* no length"),
        ([HEADER, GOOD, "1" * 200_000], "line 3: it cannot be read as CSV: field larger"),
        ([HEADER, GOOD, "1,0,0,-.01,0,0,.04"], "never moves across its edge"),
    ],
)
def test_a_bad_file_is_refused_with_the_line(tmp_path, lines, message):
    with pytest.raises(StrokeError, match=message) as error:
        from_csv(write(tmp_path, *lines))
    assert "stroke.csv" in str(error.value)


def test_a_file_that_cannot_be_read_is_refused_by_name(tmp_path):
    with pytest.raises(StrokeError, match=r"none.csv: No such file"):
        from_csv(tmp_path / "none.csv")
    with pytest.raises(StrokeError, match="it is a folder"):
        from_csv(tmp_path)
    (tmp_path / "image.csv").write_bytes(bytes(range(128, 256)))
    with pytest.raises(StrokeError, match="not a text file"):
        from_csv(tmp_path / "image.csv")


def test_a_file_with_the_column_engaged_is_a_stroke_that_was_led(tmp_path):
    rows = ["0,0,0,0,0,0,0.05,0,1,0", "1,0,0.01,0,0,0.01,0.05,0,1,0"]
    plain = write(tmp_path, HEADER + FORWARD, *rows)
    assert not from_csv(plain).is_led
    led = write(tmp_path, HEADER + FORWARD + ",engaged", *(row + ",1" for row in rows))
    assert from_csv(led).is_led
    with pytest.raises(StrokeError, match="engaged"):
        from_csv(write(tmp_path, HEADER + ",engaged", "0,0,0,0,0,0,0.05,1"))


def test_a_blade_at_rest_is_not_turned_by_rounding():
    leaning = BladeSegment(
        np.array([0.01, 0.02, 0.0]), np.array([0.013, 0.031, 0.05]), np.array([0.3, 1.0, 0.1])
    )
    stroke = Stroke([0.0, 0.3, 1.0], [leaning] * 3)
    first = stroke.pose(0.0).numbers
    assert all(stroke.pose(t).numbers == first for t in np.linspace(0.0, 1.2, 50))
