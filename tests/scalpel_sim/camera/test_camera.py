"""Images against rays, the user's model, names and numbers."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bridge import TissueFrame
from scalpel_sim import (
    SCENES,
    Blade,
    Camera,
    Grasper,
    Theatre,
    add_grasper,
    changed,
    prepare,
    read_scene,
)
from scalpel_sim.camera.camera import CameraImage
from scalpel_sim.errors import UsageError
from tests.scalpel_sim.camera.traced import Tracer
from tests.support.egl import needs_renderer
from tissue import Material, Tissue, block, fixed_nodes

pytestmark = needs_renderer

ARM = """
<mujoco>
  <worldbody>
    <geom name="table" type="box" size=".2 .2 .01" pos="0 0 -.02"/>
    <camera name="side" pos="-.16 -.05 .1" xyaxes=".3 -1 0 .4 .12 .8"/>
    <camera name="front" pos="0 -.6 .2" xyaxes="1 0 0 0 .1 1"/>
    <body name="link" pos="0 .05 .1">
      <joint type="slide" axis="0 1 0"/>
      <geom name="link" type="box" size=".006 .006 .05" mass=".1" euler="20 0 0"/>
      <camera name="wrist" pos="0 -.06 .02" euler="40 0 0"/>
      <body name="tool" pos="0 -.02 -.04">
        <geom name="edge" type="box" size=".003 .01 .02" mass=".1"/>
        <site name="one end" pos="0 -.01 .02"/>
        <site name="other end" pos="0 -.01 -.02"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"

FRAME = TissueFrame(np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]))


def cut_tissue(n_cuts: int) -> Tissue:
    """Return a block, held at two sides, with so many slits that gape under its weight."""
    mesh = block((8, 8, 3), (0.06, 0.06, 0.02))
    tissue = Tissue(mesh, Material(2e3), fixed=fixed_nodes(mesh, "left,right"))
    random = np.random.default_rng(4)
    for i in range(n_cuts):
        x, depth = 0.004 + 0.052 * (i + 0.5) / n_cuts, random.uniform(0.004, 0.012)
        y = np.linspace(*sorted(random.uniform(0.002, 0.058, 2)), 12)
        place = [x + 0.001 * np.sin(150 * y), y]
        ends = [np.stack([*place, 0 * y + z], axis=1) for z in (0.02 - depth, 0.022)]
        tissue.incise(np.stack(ends, axis=1), forward=(0.0, 1.0, 0.0))
    for _ in range(20):
        tissue.step(None, 1e-3)
    return tissue


def theatre_with(tissue: Tissue) -> Theatre:
    """Return an arm of boxes above that tissue."""
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    blade = Blade(model, data, heel="one end", tip="other end", forward=(0, -1, 0))
    return Theatre(model, data, tissue, FRAME, blade)


def place_of(camera: Camera):
    """Return the place of a camera that is not one of the model."""
    return camera._view


@pytest.fixture(scope="module", params=[0, 5, 20])
def seen(request) -> tuple[Theatre, Camera, CameraImage]:
    """Return an image of a block with so many cuts."""
    theatre = theatre_with(cut_tissue(request.param))
    camera = Camera(theatre, "endoscope", width=160, height=120)
    return theatre, camera, camera.image()


def test_depth_is_that_of_rays_within_a_twentieth_of_a_millimetre(seen):
    theatre, camera, image = seen
    tracer = Tracer(theatre, place_of(camera), (camera.width, camera.height))
    random, n_of_tissue = np.random.default_rng(1), 0
    for _ in range(100):
        row, column = random.integers(camera.height), random.integers(camera.width)
        depths = [hit.depth for hit in tracer.hits_around(row, column)]
        found = float(image.depth[row, column])
        if not np.isfinite(depths).all():
            continue
        assert min(depths) - 5e-5 <= found <= max(depths) + 5e-5, (row, column)
        n_of_tissue += tracer.hit(row + 0.5, column + 0.5).triangle >= 0
    assert n_of_tissue > 20


def test_a_thousand_pixels_show_what_rays_hit(seen):
    theatre, camera, _ = seen
    camera = camera.another("overview")
    picture = camera.segmentation()
    tracer = Tracer(theatre, place_of(camera), (camera.width, camera.height))
    surface, ids = theatre.link.surface(), camera.ids
    of_geom = {"table": "world", "link": "arm", "edge": "blade"}
    random, n_unclear, names_seen = np.random.default_rng(2), 0, set()
    for _ in range(1000):
        row, column = random.integers(camera.height), random.integers(camera.width)
        names = set()
        for hit in tracer.hits_around(row, column):
            if hit.geom >= 0:
                names.add(of_geom[theatre.model.geom(hit.geom).name])
            elif hit.triangle >= 0:
                names.add("cut" if surface.is_cut[hit.triangle] else "skin")
            else:
                names.add("nothing")
        n_unclear += len(names) > 1
        assert picture[row, column] in [ids[name] for name in names], (row, column)
        names_seen |= names
    assert n_unclear < 50
    assert names_seen >= {"skin", "arm", "blade", "world"}


def test_the_silhouette_of_the_tissue_is_that_of_rays(seen):
    theatre, camera, _ = seen
    small = camera.another("endoscope", width=72, height=54)
    picture = small.segmentation()
    tracer = Tracer(theatre, place_of(small), (72, 54))
    hits = [[tracer.hit(i + 0.5, j + 0.5).triangle >= 0 for j in range(72)] for i in range(54)]
    drawn, traced = np.isin(picture, [small.ids["skin"], small.ids["cut"]]), np.array(hits)
    assert (drawn & traced).sum() / (drawn | traced).sum() >= 0.99


def test_the_users_model_and_state_stay_the_same_to_the_byte():
    theatre = theatre_with(cut_tissue(1))
    model, data = theatre.model, theatre.data
    contents = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, contents)
    state = [
        getattr(data, name).copy() for name in ("qpos", "qvel", "xpos", "cam_xpos", "light_xpos")
    ]
    with Camera(theatre, "wrist", width=64, height=64, shadows=True, samples=4) as camera:
        for name in camera.names:
            camera.another(name).image()
    after = np.empty_like(contents)
    mujoco.mj_saveModel(model, None, after)
    assert after.tobytes() == contents.tobytes()
    names = ("qpos", "qvel", "xpos", "cam_xpos", "light_xpos")
    assert all((getattr(data, name) == old).all() for name, old in zip(names, state, strict=True))


def test_a_run_that_is_drawn_is_the_same_run_to_the_bit():
    ends = []
    for is_drawn in (False, True):
        simulation = prepare(SCENES["slab"])
        camera = Camera(simulation, "endoscope", width=64, height=64)
        for i in range(60):
            simulation.step()
            if is_drawn and i % 10 == 0:
                camera.image()
        rows = simulation.recording.vector("force").tobytes()
        ends.append((rows, simulation.link.snapshot().positions.tobytes()))
    assert ends[0] == ends[1]


def test_the_same_picture_is_drawn_again_to_the_byte():
    theatre = theatre_with(cut_tissue(2))
    images = [Camera(theatre, "overview", width=80, height=60).image() for _ in range(2)]
    assert [part.tobytes() for part in images[0]] == [part.tobytes() for part in images[1]]


def test_a_camera_on_a_moving_body_goes_with_it():
    theatre = theatre_with(cut_tissue(0))
    camera = Camera(theatre, "wrist", width=64, height=48)
    before = camera.depth()
    theatre.data.qpos[0] = -0.02
    mujoco.mj_forward(theatre.model, theatre.data)
    moved = camera.depth()
    assert np.abs(moved - before).max() > 1e-3
    # What moves with the camera stays where it is in the picture.
    own = camera.segmentation() == camera.ids["blade"]
    assert own.any() and np.abs(moved - before)[own].max() < 1e-5


def test_a_further_camera_sees_the_same_instant():
    theatre = theatre_with(cut_tissue(3))
    first = Camera(theatre, "overview", width=48, height=32)
    second = first.another("endoscope", width=96)
    alone = Camera(theatre, "endoscope", width=96, height=32)
    assert (second.rgb() == alone.rgb()).all() and second.rgb().shape == (32, 96, 3)
    theatre.tissue.step(None, 0.01)
    assert (second.depth() == alone.depth()).all()
    before = second.rgb()
    first.another("side").rgb()  # of the model, which aims it by itself
    assert (second.rgb() == before).all()


def test_samples_smooth_edges_and_leave_the_numbers_alone():
    theatre = theatre_with(cut_tissue(5))
    coarse = Camera(theatre, "endoscope", width=80, height=60)
    fine = Camera(theatre, "endoscope", width=80, height=60, samples=4)
    assert (coarse.rgb() != fine.rgb()).any()
    assert (coarse.segmentation() == fine.segmentation()).mean() > 0.97
    assert set(np.unique(fine.segmentation())) <= set(fine.ids.values())


def test_numbers_hang_on_the_scene_and_not_on_what_is_in_the_picture():
    camera = Camera(prepare(SCENES["layers"]), "endoscope", width=64, height=48)
    names = ["nothing", "muscle", "skin", "fat", "cut muscle", "cut skin", "cut fat"]
    assert dict(camera.ids) == {n: i for i, n in enumerate([*names, "blade", "arm", "world"])}
    found = set(np.unique(camera.segmentation()).tolist())
    assert {camera.ids[name] for name in ("muscle", "skin", "fat", "world")} <= found
    assert camera.ids["cut fat"] not in found


def test_each_grasper_has_a_number_by_its_name():
    simulation = prepare(SCENES["excise"])
    camera = Camera(simulation, "overview", width=160, height=120)
    (grasper,) = simulation.graspers
    assert list(camera.ids)[-4:] == ["blade", grasper.name, "arm", "world"]
    picture = camera.segmentation()
    for name in ("blade", grasper.name, "arm", "world"):
        assert (picture == camera.ids[name]).any()


def test_a_grasper_on_an_arm_of_ones_own_is_named():
    spec = mujoco.MjSpec.from_string(ARM)
    prefix = add_grasper(spec, "link")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    grasper = Grasper(model, data, prefix)
    camera = Camera(Theatre(model, data, graspers={"left": grasper}), "front", width=96, height=96)
    assert dict(camera.ids) == {"nothing": 0, "blade": 1, "left": 2, "arm": 3, "world": 4}
    assert (camera.segmentation() == 2).any()


@pytest.mark.parametrize("scene", ["psm", "own arm", "two bodies"])
def test_any_arm_and_any_bodies_are_seen_by_the_cameras_that_are_always_there(scene):
    scenes = {
        "psm": lambda: changed(SCENES["organ"], preset="psm"),
        "own arm": lambda: read_scene(EXAMPLES / "robot.toml"),
        "two bodies": lambda: SCENES["gallbladder"],
    }
    overview = Camera(prepare(scenes[scene]()), "overview", width=96, height=72)
    for camera in (overview, overview.another("endoscope")):
        picture = camera.segmentation()
        names = list(camera.ids)
        tissue = (picture > 0) & (picture < camera.ids["blade"])
        assert 0.03 < tissue.mean() < 0.5
        assert (picture == camera.ids["blade"]).any()
        assert names[1:3] == ["skin", "cut"] or len(names) > 8


def test_views_of_the_scene_come_first_and_are_where_it_says():
    simulation = prepare(SCENES["retract"])
    view = SCENES["retract"].views[0]
    camera = Camera(simulation, view.name, width=32, height=32)
    assert camera.names[0] == view.name and camera.names[-2:] == ["overview", "endoscope"]
    assert Camera(simulation).name == view.name
    eye = simulation.frame.points_to_world(np.array(view.eye))
    assert np.allclose(place_of(camera).eye, eye)


def test_a_camera_of_the_model_is_not_put_elsewhere_and_an_unknown_part_has_no_colour():
    with Camera(theatre_with(cut_tissue(0)), "side", width=8, height=8) as camera:
        with pytest.raises(UsageError, match="'side' is one of the model, and stays where"):
            camera.move_eye((0.0, 0.0, 0.01))
        with pytest.raises(UsageError, match="no part of the body is called 'skim'"):
            camera.change_look(tints={"skim": (1.0, 0.5, 0.5)})


def test_an_unknown_camera_is_refused_with_the_names_of_all():
    theatre = theatre_with(cut_tissue(0))
    with pytest.raises(UsageError, match="no camera is called 'wirst'"):
        Camera(theatre, "wirst")
    with pytest.raises(UsageError, match="an image of 0 x 480 pixels"):
        Camera(theatre, width=0)
