"""A scalpel at any place of any model: where it points, what it weighs, and what it is called."""

import mujoco
import numpy as np
import pytest

from scalpel_sim import Blade, add_scalpel
from scalpel_sim.arm.scalpel import HANDLE_SIZE, ScalpelError
from scalpel_sim.viewer.model_shapes import shapes_of
from tissue import BladeShape

FLANGE = """
<mujoco>
  <compiler inertiafromgeom="false" angle="radian"/>
  <worldbody>
    <body name="arm" pos="0.1 0.2 0.3">
      <inertial mass="1" pos="0 0 0" diaginertia=".1 .1 .1"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <site name="flange" pos="0 0 -0.02" quat="0 1 0 0"/>
      <frame name="tool" pos="0 0 0.05"><geom size=".02" mass=".1"/></frame>
    </body>
  </worldbody>
</mujoco>
"""


def flange():
    return mujoco.MjSpec.from_string(FLANGE)


def compiled(spec):
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("as_object", [False, True])
@pytest.mark.parametrize(
    ("kind", "name", "origin", "along", "forward"),
    [
        ("body", "arm", [0.1, 0.2, 0.3], [0, 0, 1], [0, 1, 0]),
        ("site", "flange", [0.1, 0.2, 0.28], [0, 0, -1], [0, -1, 0]),
        ("frame", "tool", [0.1, 0.2, 0.35], [0, 0, 1], [0, 1, 0]),
    ],
)
def test_handle_and_edge_point_along_z_of_a_site_body_or_frame(
    kind, name, origin, along, forward, as_object
):
    spec, shape = flange(), BladeShape(height=0.008)
    prefix = add_scalpel(spec, getattr(spec, kind)(name) if as_object else name, shape, length=0.05)
    edge = Blade(*compiled(spec), prefix + "heel", prefix + "tip").segment()
    across = np.array(origin) + 0.004 * np.array(forward)
    np.testing.assert_allclose(edge.heel, across + HANDLE_SIZE[1] * np.array(along), atol=1e-12)
    np.testing.assert_allclose(edge.tip - edge.heel, 0.05 * np.array(along), atol=1e-12)
    np.testing.assert_allclose(edge.forward, forward, atol=1e-12)


def test_the_edge_cuts_where_forward_points_across_the_handle():
    spec = flange()
    prefix = add_scalpel(spec, "arm", forward=(3.0, 0.0, 5.0))
    edge = Blade(*compiled(spec), prefix + "heel", prefix + "tip").segment()
    np.testing.assert_allclose(edge.forward, [1.0, 0.0, 0.0], atol=1e-12)


def test_it_has_mass_and_inertia_of_its_boxes_of_steel():
    spec, shape = flange(), BladeShape(thickness=0.6e-3)
    prefix = add_scalpel(spec, "arm", shape, length=0.06)
    model, _ = compiled(spec)
    twin = mujoco.MjSpec()
    body = twin.worldbody.add_body(name="twin")
    for middle, size in ((0.0625, HANDLE_SIZE), (0.155, (0.6e-3, 0.06, shape.height))):
        box, half = mujoco.mjtGeom.mjGEOM_BOX, 0.5 * np.array(size)
        body.add_geom(type=box, pos=[0.0, middle, 0.0], size=half, density=7800.0)
    known, found = compiled(twin)[0].body("twin"), model.body(prefix + "handle")
    assert found.mass == pytest.approx(known.mass)
    assert found.ipos == pytest.approx(known.ipos)
    assert sorted(found.inertia) == pytest.approx(sorted(known.inertia))


def test_what_presses_on_its_edge_is_felt_by_the_arm():
    spec = flange()
    prefix = add_scalpel(spec, "arm")
    model, data = compiled(spec)
    data.xfrc_applied[model.body(prefix + "handle").id, 1] = 2.0
    mujoco.mj_forward(model, data)
    assert data.qfrc_smooth[0] == pytest.approx(2.0)


def test_several_scalpels_have_names_of_their_own_and_are_drawn_as_blades():
    spec = flange()
    prefixes = [add_scalpel(spec, at) for at in ("arm", "flange", "tool")]
    assert prefixes[0] == "scalpel_" and len(set(prefixes)) == 3
    blades = [shape.name for shape in shapes_of(compiled(spec)[0]) if shape.is_blade]
    assert blades == [f"{prefix}blade" for prefix in prefixes]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (
            {"at": "flang"},
            r"no site, body or frame 'flang'\. Did you mean 'flange'\? .* 'arm', 'tool'",
        ),
        ({"at": "arm", "length": 0.0}, "the edge is 0.0 m long"),
        ({"at": "arm", "forward": (0, 0, 1)}, "along the handle"),
        ({"at": "arm", "forward": (0, np.nan, 1)}, "three finite numbers"),
    ],
)
def test_a_scalpel_that_cannot_be_is_refused(arguments, expected):
    with pytest.raises(ScalpelError, match=expected):
        add_scalpel(flange(), **arguments)
