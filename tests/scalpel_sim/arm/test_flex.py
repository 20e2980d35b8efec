"""A solid flex of a user's model becomes a tissue at its place, held where it was pinned."""

import mujoco
import numpy as np
import pytest

from scalpel_sim import FlexError, take_flex
from tissue import Tissue
from tissue.mesh.validation import signed_volumes

PINS = "0 1 2 3 4 5 6 7 8"

MODEL = """<mujoco><worldbody>
<body name="stand" pos="0 0 0.1"><geom name="plate" type="box" size=".05 .05 .005" pos="0 0 -.02"/>
<flexcomp name="soft" type="grid" count="4 3 3" spacing=".01 .01 .01" pos=".002 0 0"
 euler="0 0 90" dim="3" mass="0.018" radius=".001">
<pin id="0 1 2 3 4 5 6 7 8"/><contact selfcollide="none"/>
<elasticity young="12e3" poisson="0.4"/></flexcomp></body>
<body name="arm"><joint name="hinge"/><geom name="link" size=".01"/></body>
</worldbody></mujoco>"""


def taken(text=MODEL, name=None):
    spec = mujoco.MjSpec.from_string(text)
    return take_flex(spec, name), spec


def test_the_mesh_lies_where_mujoco_has_the_flex_and_is_held_by_its_pins():
    body, _ = taken()
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(body.mesh.positions, data.flexvert_xpos, atol=1e-12)
    x, y, z = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in (4, 3, 3)), indexing="ij")
    turned = np.stack([0.002 - 0.01 * y, 0.01 * x, 0.1 + 0.01 * z], axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(body.mesh.positions, turned, atol=1e-6)  # floats of the model
    assert np.flatnonzero(body.fixed).tolist() == list(range(9))
    volumes = signed_volumes(body.mesh.positions, body.mesh.tetrahedra)
    assert volumes.sum() == pytest.approx(12e-6, rel=1e-4)


def test_its_elasticity_and_density_are_the_material():
    body, _ = taken()
    material = body.material
    assert (material.young_modulus, material.poisson_ratio) == (12e3, 0.4)
    assert material.density == pytest.approx(0.018 / 12e-6, rel=1e-3)


def test_the_model_compiles_to_what_it_is_without_the_flex():
    _, spec = taken()
    model = spec.compile()
    assert (model.nflex, model.nbody, model.nq) == (0, 3, 1)
    assert [model.body(i).name for i in range(3)] == ["world", "stand", "arm"]
    assert [model.geom(i).name for i in range(2)] == ["plate", "link"]


def test_the_body_sags_and_stays_on_its_pins():
    body, _ = taken()
    tissue = Tissue(body.mesh, body.material, fixed=body.fixed)
    tissue.settle()
    moved = tissue.snapshot().positions - body.mesh.positions
    assert (moved[body.fixed] == 0.0).all()
    assert moved[~body.fixed, 2].mean() < -1e-5


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('dim="3"', 'dim="3" dof="trilinear"', 'give it dof="full"'),
        ('<geom name="plate"', '<freejoint/><geom name="plate"', "a body that moves, 'stand'"),
    ],
)
def test_what_cannot_become_a_tissue_is_refused(old, new, message):
    with pytest.raises(FlexError, match=message):
        taken(MODEL.replace(PINS, "0 1").replace(old, new))


def test_a_flex_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(FlexError, match="Did you mean 'soft'"):
        taken(name="sofd")
    with pytest.raises(FlexError, match="the model has 0 flexes"):
        taken("<mujoco/>")


def test_a_flex_that_is_written_out_is_taken_too():
    slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    inertia = '<inertial pos="0 0 0" mass="0.001" diaginertia="1e-7 1e-7 1e-7"/>'
    corners = ("0 0 0", ".01 0 0", "0 .01 0", "0 0 .01")
    vertices = "".join(
        f'<body name="v{i}" pos="{at}">{slides if i else ""}{inertia}</body>'
        for i, at in enumerate(corners)
    )
    body, spec = taken(
        f"<mujoco><worldbody>{vertices}</worldbody><deformable>"
        '<flex name="soft" dim="3" body="v0 v1 v2 v3" vertex="0 0 0 0 0 0 0 0 0 0 0 0" '
        'element="0 1 2 3" radius=".001"/></deformable></mujoco>'
    )
    expected = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]]
    np.testing.assert_allclose(body.mesh.positions, expected, atol=1e-9)
    assert body.fixed.tolist() == [True, False, False, False]
    model = spec.compile()
    assert (model.nflex, model.nv) == (0, 0)
