import itertools
import math
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from bridge import (
    Bridge,
    CouplingError,
    DeviceLimits,
    FixtureBox,
    InProcessLink,
    TissueFrame,
    VirtualCoupling,
)
from tests.bridge.bits import bits
from tests.bridge.conftest import ROOT
from tests.bridge.coupling.walls import Wall
from tissue import BladeSegment, BladeShape, BladeSweep, Material, TetrahedralMesh, Tissue, block

DT = 1e-3
ABOVE = 0.1


@pytest.fixture
def block_tissue():
    def make(size=(0.02, 0.02, 0.02)):
        mesh = block((3, 2, 2), size)
        fixed = (mesh.positions[:, 0] == 0.0) | (mesh.positions[:, 0] == size[0])
        return Tissue(mesh, fixed=fixed, gravity=(0.0, 0.0, 0.0))

    return make


def draw(bridge, upright, n_frames, y_start=-0.002, speed=0.1):
    """Draw the blade along y through the block and return the wrenches on the arm."""
    return [bridge.step(upright(0.009, y_start + speed * DT * i), DT) for i in range(n_frames)]


class DivergedLink(InProcessLink):
    """A real tissue whose results are spoilt in transit."""

    def __init__(self, tissue, spoil):
        super().__init__(tissue)
        self._spoil = spoil

    def step(self, sweep, dt, *led):
        return self._spoil(super().step(sweep, dt, *led))


def test_nothing_is_felt_out_of_contact_and_the_tissue_still_advances(block_tissue, upright):
    tissue = Tissue(block((1, 1, 1), (0.02, 0.02, 0.02)))
    bridge = Bridge(InProcessLink(tissue))
    felt = [bridge.step(upright(0.01, 0.01, ABOVE), DT) for _ in range(20)]
    assert not any(w.force.any() or w.torque.any() for w in felt)
    assert tissue.bounds[0, 2] == pytest.approx(-0.5 * 9.81 * 0.02**2, rel=0.1)
    assert bridge.counters.frames == bridge.counters.rejected == 20


def test_a_bridge_takes_a_tissue_as_it_is(block_tissue, upright):
    tissue = block_tissue()
    itself, linked = Bridge(tissue), Bridge(InProcessLink(block_tissue()))
    felt = [draw(bridge, upright, 60)[-1] for bridge in (itself, linked)]
    assert bits(felt[0]) == bits(felt[1])
    assert felt[0].force.any() and np.array_equal(tissue.bounds, itself.result.bounds)


@pytest.mark.parametrize(
    ("argument", "found"),
    [(None, "NoneType"), ("127.0.0.1:8766", "str"), (block((1, 1, 1), (1.0, 1.0, 1.0)), "Mesh")],
    ids=["nothing", "an address", "a mesh"],
)
def test_an_argument_that_is_neither_a_tissue_nor_a_link_is_refused_with_its_type(argument, found):
    with pytest.raises(TypeError, match=rf"needs a tissue\.Tissue, or a link .*; got \w*{found}$"):
        Bridge(argument)


@pytest.mark.parametrize("made", [Tissue, InProcessLink])
def test_a_class_in_place_of_an_object_is_refused(made):
    with pytest.raises(TypeError, match=f"got {made.__name__}, the class and not an object of it"):
        Bridge(made)


def test_a_process_without_the_tissue_does_not_load_its_compiler():
    code = "import sys; from bridge import Bridge, TcpLink, serve; print('numba' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout == "False\n"


def test_the_first_call_does_not_move_the_blade(block_tissue, upright):
    # Inside the tissue a sweep from any other pose would cut.
    bridge = Bridge(InProcessLink(block_tissue()))
    bridge.step(upright(0.009, 0.01), DT)
    assert bridge.result.cut_area == 0.0


def horseshoe(blade):
    """Return a bar of soft tissue that is bent into half a ring around z and held at its middle."""
    mesh = block((12, 2, 3), (0.06, 0.01, 0.01))
    turn = np.pi * (1.0 - mesh.positions[:, 0] / 0.06)
    radius = 0.015 + mesh.positions[:, 1]
    bent = np.stack([radius * np.cos(turn), radius * np.sin(turn), mesh.positions[:, 2]], axis=1)
    material = Material(young_modulus=1e3, toughness=1.0)  # sound travels 1.1 mm in a frame
    fixed = np.abs(mesh.positions[:, 0] - 0.03) < 1e-3
    body = TetrahedralMesh(bent, mesh.tetrahedra)
    return Tissue(body, material, fixed=fixed, blade=blade, gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("blade", [None, BladeShape()], ids=["line", "body"])
def test_in_the_hollow_of_a_body_the_broad_phase_is_conservative_too(upright, blade):
    """A blade goes into the hollow and turns there, then out through an arm of the horseshoe."""
    filtered, unfiltered = horseshoe(blade), horseshoe(blade)
    bridge = Bridge(InProcessLink(filtered))
    before, n_free, n_touching = None, 0, 0
    for i in range(500):
        turn = 0.03 * min(i, 250)
        segment = upright(1.2e-4 * max(i - 250, 0), -0.005 + 1e-4 * min(i, 120))
        segment = segment._replace(forward=np.array([np.sin(turn), np.cos(turn), 0.0]))
        n_rejected = bridge.counters.rejected
        bridge.step(segment, DT)
        result = unfiltered.step(BladeSweep(before or segment, segment), DT)
        before = segment
        touches = result.n_active > 0 or len(result.contacts.point) > 0
        n_touching += touches
        if bridge.counters.rejected > n_rejected:
            assert not touches
            n_free += bool((filtered.bounds[0, :2] < segment.tip[:2]).all())
    assert n_free > 30 and n_touching > 50
    assert bits(filtered.snapshot()) == bits(unfiltered.snapshot())


def test_an_engaged_blade_keeps_its_tissue_however_far_it_pulls_it(block_tissue, upright):
    bridge = Bridge(InProcessLink(block_tissue()))
    draw(bridge, upright, 60)
    n_rejected = bridge.counters.rejected
    assert bridge.result.anchored_length > 0.0
    bridge.step(upright(0.03, 0.004), DT)  # a jump beyond the block: the held tissue follows
    bridge.step(upright(0.03, 0.004), DT)
    assert bridge.counters.rejected == n_rejected


def test_the_wrench_turns_with_the_tissue(block_tissue, upright):
    s = math.sqrt(0.5)
    frame = TissueFrame(
        np.array([[s, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, s]]), np.array([0.3, -0.2, 0.1])
    )
    straight, turned = (
        Bridge(InProcessLink(block_tissue())),
        Bridge(InProcessLink(block_tissue()), frame),
    )
    for i in range(60):
        segment = upright(0.009, -0.002 + 0.1 * DT * i)
        felt = straight.step(segment, DT)
        felt_turned = turned.step(frame.segment_to_world(segment), DT)
    expected = frame.wrench_to_world(felt)
    np.testing.assert_allclose(felt_turned.force, expected.force, atol=1e-6)
    np.testing.assert_allclose(felt_turned.point, frame.points_to_world(segment.tip), atol=1e-12)


def test_the_arm_never_feels_more_than_its_device_can_exert(block_tissue, upright):
    bridge = Bridge(InProcessLink(block_tissue()), limits=DeviceLimits(force=0.02))
    felt = draw(bridge, upright, 60)
    assert max(math.hypot(*w.force) for w in felt) <= 0.02
    assert bridge.counters.force_limited > 0
    assert math.hypot(*bridge.wrench_raw.force) > 0.02
    np.testing.assert_allclose(np.cross(felt[-1].force, bridge.wrench_raw.force), 0.0, atol=1e-12)


def test_the_fixtures_that_the_blade_touches_are_named_in_the_world(block_tissue, upright):
    frame = TissueFrame(origin=np.array([0.0, 0.0, 0.05]))
    table = FixtureBox("table", np.array([1.0, 1.0, 0.02]), np.array([0.0, 0.0, 0.0]))
    bridge = Bridge(InProcessLink(block_tissue()), frame, fixtures=[table])
    bridge.step(upright(0.01, -0.1, 0.2), DT)
    assert bridge.touching == ()
    bridge.step(upright(0.01, -0.1, 0.0), 10.0 * DT)
    assert bridge.touching == ("table",)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize(
    "spoil",
    [
        lambda r, bad: r._replace(wrench=r.wrench._replace(force=np.array([0.0, bad, 0.0]))),
        lambda r, bad: r._replace(bounds=np.full((2, 3), bad)),
    ],
    ids=["force", "bounds"],
)
def test_a_tissue_that_diverged_ends_the_run_instead_of_reaching_the_arm(
    block_tissue, upright, spoil, bad
):
    bridge = Bridge(DivergedLink(block_tissue(), lambda result: spoil(result, bad)))
    with pytest.raises(CouplingError, match="finite"):
        bridge.step(upright(0.009, 0.0), DT)


WALL_AT, BACK = np.array([0.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])


def in_and_out(upright, n_frames=330, depth=2e-3):
    """Return the poses of a blade that moves into a wall at y = 0 and out, at up to 40 mm/s."""
    path = 0.5 * (depth + 1e-3) * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, n_frames))) - 1e-3
    return [upright(0.0, y) for y in path]


class RecordingWall(Wall):
    """A wall that records its queries."""

    def __init__(self, stiffness=500.0):
        super().__init__(WALL_AT, BACK, stiffness)
        self.queries = []

    def step(self, sweep, dt, *led):
        self.queries.append((sweep, dt))
        return super().step(sweep, dt, *led)


def test_queries_every_ten_frames_cover_the_whole_time_and_path(upright):
    wall = RecordingWall()
    bridge = Bridge(wall, tissue_every=10)
    poses = in_and_out(upright, 101)
    for pose in poses:
        bridge.step(pose, DT)
    assert sum(dt for _, dt in wall.queries) == pytest.approx(0.101)
    for (before, _), (after, _) in itertools.pairwise(wall.queries):
        assert np.array_equal(before.t1.tip, after.t0.tip)
    assert np.array_equal(wall.queries[-1][0].t1.tip, poses[-1].tip)
    assert bridge.counters.answers == 11


def test_a_blade_that_holds_tissue_moves_straight_and_a_free_one_follows_the_arm(upright):
    wall = RecordingWall()
    bridge = Bridge(wall, tissue_every=10)
    for pose in in_and_out(upright, 101):
        bridge.step(pose, DT)
    steps = np.array([dt for _, dt in wall.queries])
    inside = np.array([sweep.t0.tip[1] > 0.0 for sweep, _ in wall.queries])
    assert steps[~inside] == pytest.approx(DT)
    assert (~inside).sum() > 10
    # Once it holds as much as before: one step of nine frames, and one of the last frame.
    n_straight = np.isclose(steps[inside], 9 * DT).sum()
    assert n_straight >= 4
    assert np.isclose(steps[inside], DT).sum() == len(steps[inside]) - n_straight


def test_the_tissue_answers_in_the_first_frame_and_then_in_every_fifth(upright):
    bridge = Bridge(RecordingWall(), tissue_every=5)
    answered = []
    for pose in in_and_out(upright, 16):
        bridge.step(pose, DT)
        answered.append(bridge.answered)
    assert np.flatnonzero(answered).tolist() == [0, 5, 10, 15]


@pytest.mark.parametrize("every", [1, 5, 10, 33])
@pytest.mark.parametrize(
    "coupling", [None, VirtualCoupling(stiffness=5e3)], ids=["rigid", "virtual"]
)
def test_the_impulse_that_the_arm_feels_is_that_on_the_tissue(upright, every, coupling):
    """From before a contact to after it no momentum is lost."""
    wall = RecordingWall()
    bridge = Bridge(wall, tissue_every=every, coupling=coupling, passivity=False)
    poses = in_and_out(upright) + [upright(0.0, -1e-3)] * (2 * every)
    felt = DT * np.sum([bridge.step(pose, DT).force for pose in poses], axis=0)
    missing = np.linalg.norm(felt - wall.impulse)
    assert np.abs(wall.impulse[1]) > 0.1
    assert missing < 0.003 * np.abs(wall.impulse[1])
    # Only what was written off may be missing.
    assert missing <= bridge.counters.impulse_written_off + 1e-12


def test_a_wall_queried_every_ten_frames_feels_nearly_as_if_queried_in_each(upright):
    """Without the stiffness the wrench is held, and five frames old on average."""

    def forces(every, reported):
        bridge = Bridge(Wall(WALL_AT, BACK, 500.0, reported), tissue_every=every)
        return np.array([bridge.step(pose, DT).force[1] for pose in in_and_out(upright)])

    each_frame = forces(1, 1.0)
    error, held_error = (
        np.abs(forces(10, reported) - each_frame).mean() for reported in (1.0, 0.0)
    )
    assert each_frame.min() < -0.9
    assert error < 0.015 and held_error > 1.5 * error


def test_a_virtual_coupling_keeps_the_blade_that_cuts_out_of_a_wall(upright):
    wall = RecordingWall(stiffness=20e3)
    bridge = Bridge(wall, coupling=VirtualCoupling(stiffness=700.0))
    for _ in range(100):
        felt = bridge.step(upright(0.0, 2e-3), DT)
    # 20 kN/m and 700 N/m in series, pressed in by 2 mm.
    assert felt.force[1] == pytest.approx(-2e-3 / (1.0 / 700.0 + 1.0 / 20e3), rel=1e-3)
    assert wall.queries[-1][0].t1.tip[1] == pytest.approx(-felt.force[1] / 20e3, rel=1e-3)


@pytest.mark.parametrize("every", [0, -1, 1.5, 101])
def test_a_number_of_frames_per_query_out_of_range_is_refused(every):
    with pytest.raises(ValueError, match=f"every {every} frames; .* from 1 to 100"):
        Bridge(RecordingWall(), tissue_every=every)


class Silent(RecordingWall):
    """A wall that does not answer while it is not awake."""

    def __init__(self):
        super().__init__()
        self.is_awake = threading.Event()
        self.is_awake.set()

    def step(self, sweep, dt, *led):
        assert self.is_awake.wait(10.0)
        return super().step(sweep, dt, *led)


def wait_for(bridge, upright, condition):
    for _ in range(1000):
        felt = bridge.step(upright(0.0, 2e-3), DT)
        if condition():
            return felt
        time.sleep(1e-3)
    raise AssertionError("the tissue never answered")


def test_an_arm_that_cannot_wait_feels_a_silent_tissue_fade_and_return_along_a_ramp(upright):
    tissue = Silent()
    bridge = Bridge(tissue, waits=False, passivity=False)
    felt = wait_for(bridge, upright, lambda: bridge.counters.answers > 50)
    assert felt.force[1] == pytest.approx(-1.0, rel=0.1)
    tissue.is_awake.clear()
    sizes = [-bridge.step(upright(0.0, 2e-3), DT).force[1] for _ in range(550)]
    assert sizes[30] > 0.9 and 0.0 < sizes[300] < 0.6 and sizes[-1] == 0.0
    assert bridge.counters.silent > 500 and bridge.counters.faded > 450
    tissue.is_awake.set()
    n_answers = bridge.counters.answers
    back = wait_for(bridge, upright, lambda: bridge.counters.answers > n_answers)
    assert -0.1 < back.force[1] < 0.0
    assert bridge.counters.silent < bridge.counters.frames


UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("segment", "why"),
    [
        (BladeSegment(np.array([0.0, np.nan, 0.0]), UP, np.array([0.0, 1.0, 0.0])), "not finite"),
        (BladeSegment(UP, UP, np.array([0.0, 1.0, 0.0])), "0.0 m long"),
        (BladeSegment(np.zeros(3), UP, np.array([0.0, 2.0, 0.0])), "unit vector; its length is 2"),
        (BladeSegment(np.zeros(3), UP, UP), "across the edge; they are 0 degrees apart"),
    ],
)
def test_an_invalid_pose_is_refused_before_it_reaches_the_tissue(block_tissue, segment, why):
    bridge = Bridge(InProcessLink(block_tissue()))
    with pytest.raises(ValueError, match=why):
        bridge.step(segment, DT)
    assert bridge.result is None


@pytest.mark.parametrize("dt", [0.0, -1e-3, np.nan, np.inf])
def test_a_frame_that_lasts_no_time_is_refused(block_tissue, upright, dt):
    with pytest.raises(ValueError, match="must be positive and finite"):
        Bridge(InProcessLink(block_tissue())).step(upright(0.0, 0.0), dt)
