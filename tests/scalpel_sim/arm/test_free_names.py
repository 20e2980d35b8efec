"""Names that the program adds to a model of the user's are free, whatever the user's are."""

import mujoco
import numpy as np
import pytest
from msgspec import structs

from bridge import FixtureMesh
from scalpel_sim import GrasperTable, WaypointTable, prepare, read_scene
from scalpel_sim.arm.free_names import free_name, free_prefix, names_in
from scalpel_sim.arm.grasper import PADS_HEEL, PADS_TIP, GuidedGrasper, add_grasper
from scalpel_sim.arm.hand import Impedance, add_hand
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.instruments.test_own_arm import EXAMPLES, ROBOT
from tests.support.run_files import assert_same_rows

CORNERS = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e-3]])
SHEET = FixtureMesh("sheet", np.array([0.0, 0.3, 0.0]) + CORNERS, np.array([[0, 1, 2]]))
N_FRAMES = 12
WORDS = {
    "bodies": "BODY",
    "geoms": "GEOM",
    "sites": "SITE",
    "joints": "JOINT",
    "meshes": "MESH",
    "tendons": "TENDON",
    "equalities": "EQUALITY",
    "actuators": "ACTUATOR",
}
"""Kinds of elements that the program adds, as MuJoCo calls their objects."""


def add_named(spec, kind, name):
    """Add an element of a kind, which does nothing, to a robot."""
    world = spec.worldbody
    if kind == "bodies":
        world.add_body(name=name)
    elif kind == "sites":
        world.add_site(name=name)
    elif kind == "geoms":
        world.add_geom(name=name, size=[1e-3] * 3, pos=[9.0, 9.0, 9.0], contype=0, conaffinity=0)
    elif kind == "joints":
        slider = world.add_body(pos=[8.0, 8.0, 8.0])
        slider.add_geom(size=[1e-3] * 3, mass=0.1, contype=0, conaffinity=0)
        slider.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE)
    elif kind == "meshes":
        spec.add_mesh(name=name, uservert=CORNERS.ravel())
    elif kind == "tendons":
        spec.add_tendon(name=name).wrap_joint("elbow", 1.0)
    elif kind == "equalities":
        joint = mujoco.mjtEq.mjEQ_JOINT
        spec.add_equality(name=name, type=joint, name1="elbow", active=False)
    else:
        assert kind == "actuators"
        spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target="elbow")


def robot(path, names, bare=False):
    """Write a robot that has elements of these names, by kind; bare: without its scalpel."""
    spec = mujoco.MjSpec.from_file(str(ROBOT))
    if bare:
        spec.delete(spec.body("scalpel"))
    for kind, named in names.items():
        for name in named:
            add_named(spec, kind, name)
    path.write_text(spec.to_xml(), encoding="utf-8")
    return str(path)


def two_robots(folder, names):
    """A scene in which one robot cuts and one holds a grasper; both have these names."""
    folder.mkdir()
    scene = read_scene(EXAMPLES / "robot.toml")
    own = robot(folder / "robot.xml", names)
    (stroke,) = scene.strokes
    stroke = structs.replace(stroke, points=[[0.03, -2e-4, 0.01], [0.03, 0.05, 0.01]])
    aside, bare = (-0.02, 0.02, 0.1), robot(folder / "bare.xml", names, bare=True)
    rest = [WaypointTable(time=0.0, at=aside, opening=0.01), WaypointTable(time=0.1)]
    held = GrasperTable(model=bare, at="wrist_3", pos=(-0.5, 0.3, -0.2), motion=rest)
    around = {"graspers": (held,), "table": 0.0, "floor": -0.05}
    return changed(scene, model=own, strokes=(stroke,), **around)


def ran(scene, link=None):
    simulation = prepare(scene, link, [SHEET])
    simulation.run(N_FRAMES * simulation.dt)
    return simulation


def named_in(model):
    """The names of a compiled model that `names_in` may give, by kind."""
    found = {}
    for kind, word in WORDS.items():
        of_kind = getattr(mujoco.mjtObj, f"mjOBJ_{word}")
        names = (mujoco.mj_id2name(model, of_kind, i) for i in range(100))
        found[kind] = {name for name in names if name}
    return found


def added_to(model, user):
    """Names that the program has added to two robots."""
    own = names_in(mujoco.MjSpec.from_file(user))
    named = named_in(model)
    return {
        kind: sorted(named[kind] - own[kind] - {f"left_{name}" for name in own[kind]})
        for kind in named
    }


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """A run with robots that have none of our names, and the names that they get."""
    folder = tmp_path_factory.mktemp("usual")
    bare = ran(two_robots(folder / "bare", {}))
    ours = added_to(bare.arm.model, str(ROBOT))
    taken = {
        kind: [name for each in named for name in (each, f"scalpel_sim_{each}")]
        for kind, named in ours.items()
    }
    free = {kind: [f"own_{i}" for i in range(len(named))] for kind, named in taken.items()}
    return ran(two_robots(folder / "free", free)), taken


def test_every_kind_of_what_is_added_is_among_them(usual):
    _, taken = usual
    assert all(taken[kind] for kind in WORDS)


def test_robots_with_all_of_our_names_do_the_same_to_the_bit(usual, tmp_path):
    expected, taken = usual
    found = ran(two_robots(tmp_path / "taken", taken))
    assert_same_rows(found.recording, expected.recording)
    np.testing.assert_array_equal(found.arm.data.qpos, expected.arm.data.qpos)
    assert np.abs(found.recording.vector("force")).max() > 1e-3
    kept = named_in(found.arm.model)
    assert all(set(taken[kind]) <= kept[kind] for kind in taken if kind != "actuators")


OF_GRASPER = ("scalpel_sim_grasper_", "")
OF_HAND = ("grasper_", "scalpel_sim_")


@pytest.mark.parametrize(
    ("kind", "name", "prefixes"),
    [
        ("bodies", "grasper_shaft", OF_GRASPER),
        ("actuators", "grasper_jaws", OF_GRASPER),
        ("bodies", "hand", OF_HAND),
        ("actuators", "hand_turn", OF_HAND),
        ("meshes", "hand", ("grasper_", "")),
    ],
)
def test_a_loop_of_ones_own_gets_the_names_from_what_adds(kind, name, prefixes):
    spec = mujoco.MjSpec.from_file(str(ROBOT))
    add_named(spec, kind, name)
    prefix = add_grasper(spec, "wrist_3")
    hand = add_hand(spec, Impedance(), prefix + PADS_HEEL, prefix + PADS_TIP)
    assert (prefix, hand) == prefixes
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    grasper = GuidedGrasper(model, data, prefix, hand)
    grasper.hold()
    mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all() and name in named_in(model)[kind]


def test_a_second_grasper_on_one_model_has_names_of_its_own():
    spec = mujoco.MjSpec.from_file(str(ROBOT))
    assert [add_grasper(spec, at) for at in ("wrist_3", "wrist_2", "wrist_1")] == [
        "grasper_",
        "scalpel_sim_grasper_",
        "scalpel_sim_2_grasper_",
    ]
    spec.compile()


def test_names_of_replicated_and_attached_elements_are_taken_too(tmp_path):
    part = tmp_path / "part.xml"
    part.write_text('<mujoco><worldbody><body name="and"/></worldbody></mujoco>', encoding="utf-8")
    spec = mujoco.MjSpec.from_string(f"""
    <mujoco>
      <asset><model name="part" file="{part}"/></asset>
      <worldbody>
        <replicate count="2" offset="1 0 0"><body name="scalpel_sim_hand"/></replicate>
        <attach model="part" body="and" prefix="h"/>
      </worldbody>
    </mujoco>
    """)
    assert names_in(spec)["bodies"] >= {"hand", "scalpel_sim_hand0", "scalpel_sim_hand1"}
    assert free_prefix(spec, {"bodies": ["hand", "hand0"]}) == "scalpel_sim_2_"
    assert free_prefix(spec, {"geoms": ["hand"]}) == ""


def test_a_body_without_a_name_may_carry_the_blade_beside_a_grasper(tmp_path):
    scene = two_robots(tmp_path / "robots", {})
    spec = mujoco.MjSpec.from_file(scene.arm.model)
    spec.body("scalpel").name = ""
    (tmp_path / "robots" / "robot.xml").write_text(spec.to_xml(), encoding="utf-8")
    simulation = ran(scene)
    touching = simulation.coupled_bodies[1].geom_ids
    blade = simulation.arm.blade.body_id
    assert touching and blade not in simulation.arm.model.geom_bodyid[touching]


def test_a_name_is_the_wanted_one_where_that_is_free():
    assert free_name("floor", ["table"]) == "floor"
    assert free_name("floor", ["floor", "scalpel_sim_floor"]) == "scalpel_sim_2_floor"


def test_a_plane_may_be_called_as_a_fixture_and_both_are_told_apart(tmp_path):
    spec = mujoco.MjSpec.from_file(str(ROBOT))
    spec.geom("table").name = "floor"
    path = tmp_path / "robot.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    scene = read_scene(EXAMPLES / "robot.toml")
    scene = changed(scene, model=str(path), floor=-0.01)
    simulation = prepare(scene)
    assert simulation.arm.fixtures == {"floor": "fixture_floor"}
