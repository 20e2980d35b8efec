"""Pictures of models and meshes against MuJoCo's own renderer, and what they leave in memory."""

import os
import pickle
import resource
import subprocess
import sys
from ctypes.util import find_library
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bridge import TissueFrame
from scalpel_sim.camera.canvas import Canvas, PixelSize
from scalpel_sim.camera.finishes import Finish
from scalpel_sim.camera.gl_context import RenderError
from scalpel_sim.camera.lights import Light
from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.errors import EXIT_OK, EXIT_RUN_FAILED
from scalpel_sim.viewer import primitives, textures
from tests.support.egl import needs_renderer

pytestmark = needs_renderer

ROOT = Path(__file__).parents[3]

MODEL = """
<mujoco>
  <visual><map fogstart="2" fogend="6"/><quality shadowsize="1024"/></visual>
  <asset>
    <texture type="skybox" builtin="gradient" rgb1=".3 .5 .7" rgb2="0 0 0" width="64" height="64"/>
    <texture name="tiles" type="2d" builtin="checker" rgb1=".1 .2 .3" rgb2=".2 .3 .4" width="100"
             height="100" mark="edge" markrgb=".8 .8 .8"/>
    <texture name="cross" type="cube" builtin="flat" mark="cross" width="32" height="32"
             rgb1=".8 .6 .4" markrgb="1 1 1"/>
    <material name="tiles" texture="tiles" texrepeat="5 5" texuniform="true" reflectance=".2"/>
    <material name="cross" texture="cross" specular="1" shininess=".9"/>
    <hfield name="hill" nrow="4" ncol="4" size=".1 .1 .05 .01"
            elevation="0 0 0 0 0 1 .5 0 0 .2 1 0 0 0 0 0"/>
    <mesh name="wedge" vertex="0 0 0  .1 0 0  0 .2 0  0 0 .3"/>
    <mesh name="sheet" vertex="0 0 0  .2 0 0  0 .2 0  .2 .2 .01" inertia="shell"
          face="0 1 2 1 3 2" texcoord="0 0 1 0 0 1 1 1"/>
    <mesh name="egg" builtin="sphere" params="3" scale=".05 .05 .1"/>
  </asset>
  <worldbody>
    <light pos="0 -.3 1.6" dir="0 .2 -1"/>
    <geom type="plane" size="0 0 .01" material="tiles"/>
    <geom type="plane" size=".1 .1 .01" pos=".4 .3 .2" euler="30 0 0"/>
    <camera name="eye" pos="0 -1 .6" xyaxes="1 0 0 0 .5 1"/>
    <geom type="hfield" hfield="hill" pos=".3 0 0"/>
    <body pos="0 0 .2">
      <freejoint/>
      <geom type="mesh" mesh="wedge" rgba="1 .3 .2 1"/>
      <geom type="mesh" mesh="egg" pos="-.2 0 0" material="cross"/>
      <geom type="mesh" mesh="sheet" pos="-.4 0 .2" material="tiles" mass=".1"/>
      <geom type="box" size=".05 .05 .05" pos=".1 .1 .3" material="cross"/>
      <geom type="capsule" size=".02 .1" pos="-.3 0 .1" rgba="0 1 0 .5"/>
    </body>
    <body name="clothed" pos=".2 -.3 .1"><joint/><geom size=".02"/></body>
    <flexcomp name="jelly" type="grid" count="4 4 2" spacing=".05 .05 .05" pos="-.4 -.4 .2" dim="3"
              rgba=".3 .5 1 1" radius=".005">
      <contact selfcollide="none"/>
      <elasticity young="1e4"/>
    </flexcomp>
    <flexcomp name="cloth" type="grid" count="3 4 1" spacing=".05 .05 .05" pos="0 -.4 .3" dim="2"
              radius=".002" material="tiles" mass=".1"/>
    <flexcomp name="rope" type="grid" count="6 1 1" spacing=".05 .05 .05" pos="0 -.5 .2" dim="1"
              radius=".004" mass=".1"/>
  </worldbody>
  <deformable>
    <skin name="sleeve" vertex="0 0 0 .2 0 0 0 0 .2" face="0 1 2" texcoord="0 0 1 0 0 1"
          material="tiles">
      <bone body="clothed" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 2" vertweight="1 1 1"/>
    </skin>
  </deformable>
</mujoco>
"""


def test_a_model_alone_looks_as_mujocos_own_renderer_draws_it(monkeypatch):
    from mujoco.egl import GLContext
    from mujoco.rendering.classic import gl_context

    monkeypatch.setattr(gl_context, "GLContext", GLContext)
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    canvas = Canvas(model, finishes={}, shadows=True)
    canvas.option = mujoco.MjvOption()
    canvas.look(model.camera("eye").id, data)
    own = canvas.colours(PixelSize(320, 240))
    depth, far = canvas.depth(PixelSize(320, 240)), canvas.far
    ends = ("near", "far", "bottom", "top")
    lenses = [{end: getattr(lens, f"frustum_{end}") for end in ends} for lens in canvas.lenses]
    canvas.close()
    model.vis.quality.offsamples, model.vis.quality.shadowsize = 0, 2048
    with mujoco.Renderer(model, 240, 320) as renderer:
        for _ in range(2):  # the first time it lays infinite planes around another place
            renderer.update_scene(data, "eye")
        renderer.enable_depth_rendering()
        its_depth = renderer.render()
        renderer.disable_depth_rendering()
        # Where surfaces cross, the range of the depth decides which one a pixel shows.
        for its, ours in zip(renderer.scene.camera, lenses, strict=True):
            for end in ends:
                setattr(its, f"frustum_{end}", ours[end])
        assert (own == renderer.render()).all()
    is_near = its_depth < 1.5  # beyond, the floor runs along the rays
    assert is_near.mean() > 0.3
    assert np.quantile(np.abs(depth - its_depth)[is_near], 0.995) < 1e-4
    assert (depth[its_depth >= 0.999 * far] > 0.99 * far).all()


BALL = primitives.ellipsoid(np.full(3, 0.03))
FROM_FRONT = Viewpoint(np.array([0.0, -0.2, 0.0]), np.zeros(3))


def test_a_picture_does_not_hang_on_those_before_it():
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    canvas, size, eye = Canvas(model, finishes={}), PixelSize(96, 72), model.camera("eye").id
    pictures = []
    for view in (eye, eye, FROM_FRONT, eye):
        canvas.look(view, data)
        pictures.append(canvas.colours(size))
    assert (pictures[0] == pictures[1]).all() and (pictures[0] == pictures[3]).all()


def test_a_mesh_stands_beside_the_flexes_and_skins_of_a_model():
    model = mujoco.MjModel.from_xml_string(MODEL)
    model.mat_reflectance[:] = 0.0
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    canvas, size = Canvas(model, finishes={"ball": Finish((0.0, 0.0, 1.0, 1.0))}), PixelSize(96, 72)
    canvas.look(model.camera("eye").id, data)
    alone = canvas.colours(size)
    canvas.put("ball", BALL, TissueFrame(origin=np.array([0.0, -0.5, 0.4])))
    canvas.look(model.camera("eye").id, data)
    with_ball = canvas.colours(size)
    places, things = canvas.numbers(size)
    kinds = {things[place].kind for place in np.unique(places) if place >= 0}
    assert {mujoco.mjtObj.mjOBJ_FLEX, mujoco.mjtObj.mjOBJ_SKIN} <= kinds
    is_ball = places == [thing.mesh for thing in things].index("ball")
    assert 20 < is_ball.sum() < 1000
    assert (with_ball[~is_ball] == alone[~is_ball]).all()
    assert (with_ball[is_ball] != alone[is_ball]).any(axis=1).all()


def test_a_mesh_is_drawn_where_its_frame_is_and_lit_by_the_lamps_that_are_given():
    canvas = Canvas(finishes={"ball": Finish((1.0, 1.0, 1.0, 1.0), gloss=0.0)})
    canvas.put("ball", BALL, TissueFrame(origin=np.array([0.03, 0.0, 0.0])))
    pictures = []
    for towards in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)):
        canvas.look(FROM_FRONT, lights=[Light(towards, (0.5, 0.25, 0.0))])
        pictures.append(canvas.colours(PixelSize(64, 64)).astype(int))
    left, right = (picture.sum(axis=(0, 2)) for picture in pictures)
    columns = np.arange(64)
    assert left @ columns / left.sum() < right @ columns / right.sum()
    red, green, blue = np.moveaxis(pictures[0], 2, 0)
    assert abs(green - red / 2).max() <= 1 and blue.max() == 0
    edges = np.flatnonzero(pictures[0].any(axis=(0, 2)) | pictures[1].any(axis=(0, 2)))
    assert edges.min() > 30  # the ball is in the right half


def test_a_picture_lies_on_a_mesh_by_its_texture_coordinates():
    import io

    from PIL import Image

    halves = np.zeros((2, 2, 3), np.uint8)
    halves[0, :, 0] = halves[1, :, 2] = 255  # red above, blue below
    png = io.BytesIO()
    Image.fromarray(halves).save(png, "PNG")
    finish = Finish(picture=png.getvalue(), gloss=0.0, glow=1.0)
    canvas = Canvas(finishes={"card": finish})
    canvas.put("card", primitives.rectangle(np.array([0.05, 0.05])))
    above = Viewpoint(np.array([0.0, 0.0, 0.2]), np.zeros(3), np.array([0.0, 1.0, 0.0]))
    canvas.look(above, lights=[])
    picture = canvas.colours(PixelSize(32, 32)).astype(int)
    assert picture[12, 16, 0] > picture[12, 16, 2] and picture[20, 16, 2] > picture[20, 16, 0]


def lit_ball() -> Canvas:
    """Return a canvas that sees a ball."""
    canvas = Canvas(finishes={"ball": Finish(picture=textures.skin())})
    uv = BALL.positions[:, :2] / 0.03
    canvas.put("ball", BALL._replace(uv=uv))
    canvas.look(FROM_FRONT, lights=[Light((0.0, 1.0, 0.0))])
    return canvas


def test_a_canvas_that_is_dropped_leaves_the_others_alone():
    kept, dropped = lit_ball(), lit_ball()
    before = kept.colours(PixelSize(48, 48))
    assert before.any() and (dropped.colours(PixelSize(48, 48)) == before).all()
    kept.colours(PixelSize(48, 48))  # its OpenGL is the current one
    del dropped
    assert (kept.colours(PixelSize(48, 48)) == before).all()
    kept.close()
    assert (kept.colours(PixelSize(48, 48)) == before).all()


def resident() -> int:
    """Return the memory of this process [bytes]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from /proc")
def test_a_thousand_pictures_of_a_mesh_that_grows_leave_memory_as_it_is():
    canvas, memory = Canvas(finishes={"cloth": Finish()}), []
    n_models = 0
    for _ in range(10):
        for i in range(100):
            n = 6 + i  # up to 11,000 vertices
            y, x = np.mgrid[0:n, 0:n] / n
            flat = np.stack([x, y, 0 * x], axis=2).reshape(-1, 3)
            up = np.tile([0.0, 0.0, 1.0], (n * n, 1))
            mesh = primitives.TriangleMesh(flat, primitives.grid_triangles(n, n), up)
            canvas.put("cloth", mesh)
            canvas.look(FROM_FRONT, lights=[])
            canvas.colours(PixelSize(32, 32))
        n_models = canvas.n_models
        canvas.close()
        canvas = Canvas(finishes={"cloth": Finish()})
        memory.append(resident())
    assert n_models > 5
    # What the allocator keeps comes and goes: the least of some is what is in use.
    assert min(memory[5:]) - min(memory[2:5]) < 8e6


def in_a_process(code: str, **environment: str) -> subprocess.CompletedProcess:
    """Run code in a process of its own without a screen."""
    of_this_process = ("DISPLAY", "MUJOCO_GL", "PYOPENGL_PLATFORM")
    env = {k: v for k, v in os.environ.items() if k not in of_this_process}
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env=env | {"PYTHONPATH": str(ROOT)} | environment,
    )


def test_without_a_driver_one_line_names_the_packages(tmp_path):
    code = "from scalpel_sim.camera.gl_context import renderer_name; renderer_name()"
    failed = in_a_process(code, __EGL_VENDOR_LIBRARY_DIRS=str(tmp_path))
    last = failed.stderr.strip().splitlines()[-1]
    assert "images cannot be drawn: there is no OpenGL by EGL" in last
    assert "apt-get install libegl1 libgl1-mesa-dri libopengl0" in last


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere GLFW is the usual one")
def test_a_backend_that_needs_a_screen_says_so_where_there_is_none():
    code = "from scalpel_sim.camera.gl_context import renderer_name; renderer_name()"
    failed = in_a_process(code, MUJOCO_GL="glfw")
    last = failed.stderr.strip().splitlines()[-1]
    assert "there is no OpenGL by GLFW" in last and last.endswith("and unset MUJOCO_GL")


needs_no_osmesa = pytest.mark.skipif(find_library("OSMesa") is not None, reason="it is there")


@pytest.mark.parametrize(
    ("asked", "remedy"),
    [
        ("nonsense", "Unset it, or set it to egl, osmesa"),
        pytest.param("osmesa", "and unset MUJOCO_GL", marks=needs_no_osmesa),
    ],
)
def test_a_backend_that_is_not_there_stops_images_alone(asked, remedy, tmp_path):
    code = "import sys; from scalpel_sim.__main__ import main; sys.argv[1:] = {}; main()"
    checked = in_a_process(code.format(["materials"]), MUJOCO_GL=asked)
    assert checked.returncode == EXIT_OK, checked.stderr
    words = ["snapshot", "slab", "--at", "0", "-o", str(tmp_path / "x.png")]
    failed = in_a_process(code.format(words), MUJOCO_GL=asked)
    assert failed.returncode == EXIT_RUN_FAILED
    (line,) = failed.stderr.splitlines()
    assert line.startswith("error: images cannot be drawn: ") and remedy in line


@needs_no_osmesa
def test_a_backend_that_is_not_there_is_named_where_a_name_is_imported():
    failed = in_a_process("from scalpel_sim import prepare", MUJOCO_GL="osmesa")
    last = failed.stderr.strip().splitlines()[-1]
    assert last.startswith("ImportError: scalpel_sim.prepare cannot be loaded")
    assert "MUJOCO_GL is osmesa" in last


FORKS = """
import os
import numpy as np
from scalpel_sim.camera.canvas import Canvas, PixelSize
from scalpel_sim.camera.gl_context import RenderError
from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.errors import EXIT_OK, EXIT_RUN_FAILED

def draw():
    canvas = Canvas(finishes={})
    canvas.look(Viewpoint(np.array([0.0, -0.2, 0.0]), np.zeros(3)), lights=[])
    return canvas.colours(PixelSize(16, 16)).tobytes()

child = os.fork()
if child == 0:
    os._exit(0 if len(draw()) == 768 else 1)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
draw()
child = os.fork()
if child == 0:
    try:
        draw()
    except RenderError as error:
        os._exit(0 if "spawn" in str(error) else 1)
    os._exit(2)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
draw()
"""


def test_why_nothing_can_be_drawn_comes_whole_from_another_process():
    told = RenderError("there is no OpenGL", "Install it")
    again = pickle.loads(pickle.dumps(told))
    assert (str(again), again.remedy) == (str(told), "Install it")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system does not fork")
def test_a_forked_process_draws_if_its_parent_has_not_and_else_says_what_to_do():
    """Mesa's threads do not survive a fork: a picture would wait for them without end."""
    done = in_a_process(FORKS)
    assert done.returncode == 0, done.stderr
