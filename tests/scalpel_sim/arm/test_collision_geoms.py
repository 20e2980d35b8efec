import mujoco
import numpy as np
import pytest

from scalpel_sim.arm.arm import ARMS, Arm
from scalpel_sim.arm.collision_geoms import TABLE_THICKNESS, ArmParts, tables
from tests.scalpel_sim.little_arm import MJCF

BOTH = pytest.mark.parametrize("preset", ARMS)


def parts_of(arm):
    return ArmParts(arm.model, arm.data, arm.blade.body_id)


@BOTH
def test_the_parts_are_the_links_and_the_instrument_but_not_the_hand(preset):
    parts = parts_of(Arm(preset, base_position=(0.0, 0.0, 0.1))).parts
    assert {part.name for part in parts if part.is_instrument} == {"stylus", "neck", "blade"}
    standing = {part.name for part in parts if not part.checked_against_fixtures}
    assert {"base", "pedestal"} <= standing <= {"base", "pedestal", "column"}
    links = {
        part.name for part in parts if part.checked_against_instrument and not part.is_instrument
    }
    assert {"base", "torso", "upper_arm", "forearm"} <= links
    assert not links & {"wrist", "gimbal", "hand", "table"}


@BOTH
def test_the_parts_are_where_the_arm_is(preset):
    arm = Arm(preset)
    parts = parts_of(arm)
    (blade,) = [i for i, part in enumerate(parts.parts) if part.name == "blade"]
    edge = arm.blade.segment()
    half = parts.parts[blade].half_extents
    found = (edge.tip - parts.positions()[blade]) @ parts.axes()[blade]
    np.testing.assert_allclose(found, [0.0, half[1], -half[2]], atol=1e-12)


def test_the_table_is_a_box_whose_top_is_the_plane():
    (table,) = tables(Arm("touch").model).values()
    assert table.name == "table"
    assert table.centre[2] + 0.5 * table.size[2] == pytest.approx(0.0)
    np.testing.assert_allclose(table.size, [1.0, 1.0, TABLE_THICKNESS])


def test_an_infinite_plane_is_no_table():
    assert tables(mujoco.MjModel.from_xml_string(MJCF)) == {}


def test_the_parts_of_any_other_model_are_found_too():
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    parts = ArmParts(model, data, model.body("blade").id).parts
    assert {part.name for part in parts if part.is_instrument} >= {"grip", "blade"}
