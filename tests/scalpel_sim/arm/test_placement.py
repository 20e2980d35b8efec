import numpy as np
import pytest

from scalpel_sim.arm import place_search
from scalpel_sim.arm.arm import CHOSEN_BY_SIZE
from scalpel_sim.arm.placement import NEEDED_MARGIN, PlacementError, place
from tests.support.planned_strokes import PLANNED, plan_stroke
from tissue import block

SLAB = block((4, 6, 4), (0.04, 0.06, 0.04))
ON_EDGE = block((5, 1, 5), (0.12, 0.008, 0.12))


def bounds(mesh):
    return np.array([mesh.positions.min(axis=0), mesh.positions.max(axis=0)])


def in_world(pose, placement):
    return pose._replace(
        tip=pose.tip + placement.tissue_origin, heel=pose.heel + placement.tissue_origin
    )


@pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)
@pytest.mark.parametrize("mesh", [SLAB, ON_EDGE], ids=["slab", "on edge"])
@pytest.mark.parametrize("name", PLANNED)
def test_both_arms_lead_the_blade_along_every_stroke_above_the_table_and_out_of_the_body(
    preset, mesh, name
):
    stroke = plan_stroke(name, mesh)
    placement = place(stroke, bounds(mesh), preset)
    assert placement.margin >= NEEDED_MARGIN
    assert placement.base_position[2] == 0.0
    assert (bounds(mesh)[0] + placement.tissue_origin)[2] >= 0.01 - 1e-12
    assert min(in_world(pose, placement).tip[2] for pose in stroke.poses(50)) >= 0.01 - 1e-12
    arm = placement.arm()
    start = in_world(stroke.pose(0.0), placement)
    np.testing.assert_allclose(arm.blade.segment(), start, atol=1e-9)
    low, high = arm.model.jnt_range.T
    box = bounds(mesh) + placement.tissue_origin
    worst = 0.0
    for k in range(int(stroke.duration / 1e-3)):
        wanted = in_world(stroke.pose(1e-3 * k), placement)
        arm.hand.follow(wanted)
        arm.step1()
        there = arm.blade.segment()
        if k % 50 == 0:
            for body in ("base", "torso", "forearm", "wrist", "gimbal"):
                position = arm.data.body(body).xpos
                assert ((position < box[0]) | (position > box[1])).any()
        arm.step2()
        arm.check()
        worst = max(
            worst, np.abs(there.tip - wanted.tip).max(), np.abs(there.heel - wanted.heel).max()
        )
        assert (arm.data.qpos > low).all()
        assert (arm.data.qpos < high).all()
    assert worst < 1e-3


def test_auto_takes_the_smallest_arm_that_reaches_and_renders_the_force():
    stroke = plan_stroke("straight", SLAB)
    assert place(stroke, bounds(SLAB)).preset == "touch"
    assert place(stroke, bounds(SLAB), force=3.4).preset == "premium"
    assert place(stroke, bounds(SLAB), force=100.0).preset == "premium"
    large = block((4, 6, 4), (0.16, 0.24, 0.16))
    assert place(plan_stroke("straight", large), bounds(large)).preset == "premium"


@pytest.mark.parametrize(
    ("preset", "remedy"),
    [("touch", "smaller, or choose --arm premium"), ("premium", "smaller"), ("auto", "smaller")],
)
def test_a_stroke_out_of_reach_is_refused_with_a_scale_that_is_in_reach(preset, remedy):
    mesh = block((4, 6, 4), (0.4, 0.6, 0.4))
    with pytest.raises(PlacementError, match=rf"at 0\.\d+ times the size: .*{remedy}$") as error:
        place(plan_stroke("straight", mesh), bounds(mesh), preset)
    scale = float(str(error.value).split(" times the size")[0].split()[-1])
    smaller = block((4, 6, 4), (0.4 * scale, 0.6 * scale, 0.4 * scale))
    place(plan_stroke("straight", smaller), bounds(smaller), preset)


def test_a_stroke_in_metres_that_is_out_of_reach_is_to_be_drawn_smaller():
    stroke = plan_stroke("points", SLAB, points=[[0.0, -0.6, 0.0], [0.0, 0.6, 0.0]], length=0.04)
    with pytest.raises(PlacementError, match=r"at 0\.\d+ times the size: draw the stroke smaller$"):
        place(stroke, bounds(SLAB))


def test_an_unknown_arm_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="Known: touch, premium, psm, auto"):
        place(plan_stroke("straight", SLAB), bounds(SLAB), "omni")


def test_a_place_that_was_searched_before_is_not_searched_again(monkeypatch):
    stroke, searches, search = plan_stroke("straight", SLAB), [], place_search._search

    def counted(*args, **options):
        searches.append(args)
        return search(*args, **options)

    monkeypatch.setattr(place_search, "_known", {})
    monkeypatch.setattr(place_search, "_search", counted)
    first, again = (place(stroke, bounds(SLAB), "touch") for _ in range(2))
    assert len(searches) == 1
    place(stroke, 1.01 * bounds(SLAB), "touch")
    assert len(searches) == 2
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one, other)
