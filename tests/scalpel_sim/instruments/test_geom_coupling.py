"""Geoms of MuJoCo and tissue: jaws that lift by friction, bodies that feel what they touch."""

import contextlib
import threading

import mujoco
import numpy as np
import pytest

from bridge import Bridge, TcpLink, TissueFrame
from bridge.tcp.server import TissueServer
from scalpel_sim import GeomCoupling
from scalpel_sim.instruments.geom_coupling import GeomCouplingError
from tests.bridge.bits import bits
from tissue import BladeSegment, Material, SolverSettings, Tissue, block

EDGE = 0.0368
"""Of a cube of 50 g [m]."""
MASS = 0.05
GEL = Material(law="neo_hookean", young_modulus=20e3, poisson_ratio=0.45, density=MASS / EDGE**3)


def cube(cells=4, frame=TissueFrame()):
    """A cube that lies on the table of the world, wherever its own frame is."""
    mesh = block((cells,) * 3, (EDGE,) * 3)
    in_world = mesh.positions - [EDGE / 2, EDGE / 2, 0.0]
    mesh = mesh._replace(positions=frame.points_to_tissue(in_world))
    return Tissue(mesh, GEL, solver=SolverSettings(audit=True))


def parallel_jaw(friction):
    """A hand that goes up, with two jaws that are pressed together."""
    pad = f'type="box" size=".003 .012 .012" mass=".03" friction="{friction}"'
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <geom name="table" type="plane" size="1 1 .01" friction="0.5"/>
    <body name="hand" pos="0 0 .06">
      <joint name="lift" type="slide" axis="0 0 1" damping="2"/>
      <geom name="palm" type="sphere" size=".01" mass=".1"/>
      <body name="left" pos="-.022 0 -.03">
        <joint name="left" type="slide" axis="1 0 0" damping="3"/><geom name="left" {pad}/>
      </body>
      <body name="right" pos=".022 0 -.03">
        <joint name="right" type="slide" axis="-1 0 0" damping="3"/><geom name="right" {pad}/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="lift" kp="3000" kv="60"/><motor joint="left"/><motor joint="right"/>
  </actuator>
</mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def frame(model, data, touch, tissue):
    """One step of model and tissue together; the result of the tissue."""
    mujoco.mj_step1(model, data)
    touch.follow()
    result = tissue.step(None, 1e-3)
    touch.apply()
    mujoco.mj_step2(model, data)
    return result


def lifted(friction, seconds=1.3):
    """How far a jaw that goes up by 20 mm lifts the cube [m], and what is there at the end."""
    model, data = parallel_jaw(friction)
    tissue = cube()
    touch = GeomCoupling(data, tissue)
    before = tissue.pieces()[0].centre[2]
    for k in range(round(seconds / 1e-3)):
        data.ctrl[0] = 0.02 * np.clip((k * 1e-3 - 0.4) / 0.5, 0.0, 1.0)
        data.ctrl[1:] = 1.5 * min(1.0, k * 1e-3 / 0.2)
        energies = frame(model, data, touch, tissue).energies
    return tissue.pieces()[0].centre[2] - before, touch, energies


def test_it_drops_the_block_where_there_is_hardly_any_friction():
    way, touch, _ = lifted(friction=0.05)
    assert abs(way) < 1e-3
    assert touch.wrench("world").force[2] < -0.2 * MASS * 9.81


def test_bodies_get_what_the_contacts_push_and_its_moment():
    model, data = parallel_jaw(0.5)
    tissue = cube()
    touch = GeomCoupling(data, tissue, ["left", "right"])
    for _ in range(60):
        data.ctrl[1:] = 1.0
        frame(model, data, touch, tissue)
        found = touch.forces()
        for name in ("left", "right"):
            body = model.body(name).id
            mine = found.geom == model.geom(name).id
            applied = data.xfrc_applied[body]
            assert applied[:3] == pytest.approx(found.force[mine].sum(axis=0), abs=1e-9)
            levers = np.cross(found.point[mine] - data.xipos[body], found.force[mine])
            assert applied[3:] == pytest.approx(levers.sum(axis=0), rel=0.01, abs=2e-5)
    assert np.abs(data.xfrc_applied).max() > 0.3


def test_the_frame_of_the_tissue_changes_nothing():
    pushed = []
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for where in (TissueFrame(), TissueFrame(turned, np.array([0.3, -0.2, 0.1]))):
        model, data = parallel_jaw(0.5)
        tissue = cube(frame=where)
        touch = GeomCoupling(data, tissue, frame=where)
        for _ in range(80):
            data.ctrl[1:] = 1.0
            frame(model, data, touch, tissue)
        pushed.append(touch.wrench("left").force)
    assert pushed[0] == pytest.approx(pushed[1], abs=1e-3)


WEDGE_AND_EGG = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  .02 0 0  0 .02 0  .02 .02 0  .01 .01 -.02"/></asset>
  <worldbody>
    <body name="wedge" mocap="true" pos="-.01 -.01 .06"><geom type="mesh" mesh="wedge"/></body>
    <body name="egg" pos="0 0 -.0051"><geom type="ellipsoid" size=".02 .015 .005"/></body>
  </worldbody>
</mujoco>"""
LYING = TissueFrame(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.3, -0.2, 0.1]))
FAR = BladeSegment(np.array([1.0, 0, 0]), np.array([1.0, 0, 0.03]), np.array([0.0, 1.0, 0.0]))


def pressed(tissue):
    """A wedge that goes down into the cube, which lies on an egg; what the two feel in each frame.

    Args:
        tissue: The cube, or a bridge to it.
    """
    model = mujoco.MjModel.from_xml_string(WEDGE_AND_EGG)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    touch, felt = GeomCoupling(data, tissue, ["wedge", "egg"], frame=LYING), []
    for k in range(60):
        data.mocap_pos[0, 2] = 0.06 - 1e-4 * k
        mujoco.mj_kinematics(model, data)
        touch.follow()
        if isinstance(tissue, Bridge):
            tissue.step(FAR, 1e-3)
        else:
            tissue.step(None, 1e-3)
        touch.apply()
        felt.append((touch.wrench("wedge"), touch.wrench("egg"), data.xfrc_applied.copy()))
    assert len(touch.forces().geom) > 1
    return felt


def test_it_is_the_same_on_the_tissue_itself_over_a_bridge_and_over_tcp():
    server = TissueServer(lambda: cube(frame=LYING), port=0)
    threading.Thread(target=server.run, daemon=True).start()
    with contextlib.closing(TcpLink(server.address)) as link:
        here, bridged, there = (
            bits(tuple(pressed(tissue)))
            for tissue in (cube(frame=LYING), Bridge(cube(frame=LYING), LYING), Bridge(link, LYING))
        )
    assert here == bridged == there


def test_convex_meshes_and_ellipsoids_of_a_model_push_too():
    wedges, eggs, _ = zip(*pressed(cube(frame=LYING)), strict=True)
    assert max(wedge.force[2] for wedge in wedges) > 0.05
    assert min(egg.force[2] for egg in eggs) < -0.05


def test_the_broad_phase_changes_no_bit(monkeypatch):
    states = []
    for is_asked in (True, False):
        model, data = parallel_jaw(0.5)
        tissue = cube()
        touch = GeomCoupling(data, tissue)
        if not is_asked:
            monkeypatch.setattr(touch._contact._near, "near", lambda *_: None)
        for _ in range(80):
            data.ctrl[1:] = 1.0
            frame(model, data, touch, tissue)
        states.append(tissue.snapshot().positions.tobytes())
    assert states[0] == states[1]


def test_unknown_bodies_and_bodies_without_geoms_are_refused():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body name="a"><joint/><inertial pos="0 0 0" mass="1" '
        'diaginertia="1 1 1"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    with pytest.raises(GeomCouplingError, match=r"no body 'jaw'. It has: 'a'"):
        GeomCoupling(data, cube(), ["jaw"])
    with pytest.raises(GeomCouplingError, match="'a' has no geom that tissue can touch"):
        GeomCoupling(data, cube(), ["a"])
