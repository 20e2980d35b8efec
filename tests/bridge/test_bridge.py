import math

import numpy as np
import pytest

from bridge.bridge import Bridge
from bridge.coupling import CouplingError, DeviceLimits
from bridge.fixtures import FixtureBox
from bridge.frames import TissueFrame
from bridge.link import InProcessLink
from tests.bridge.bits import bits
from tissue.blade_shape import BladeShape
from tissue.material import Material
from tissue.shapes import grid
from tissue.tissue import Tissue
from tissue.types import BladeSegment, BladeSweep, TetrahedralMesh

DT = 1e-3
ABOVE = 0.1


@pytest.fixture
def block():
    def make(size=(0.02, 0.02, 0.02)):
        mesh = grid((3, 2, 2), size)
        fixed = (mesh.positions[:, 0] == 0.0) | (mesh.positions[:, 0] == size[0])
        return Tissue(mesh, fixed=fixed, gravity=(0.0, 0.0, 0.0))

    return make


def draw(bridge, upright, n_frames, y_start=-0.002, speed=0.1):
    """Draw the blade along y through the block and return what was felt."""
    return [bridge.step(upright(0.009, y_start + speed * DT * i), DT) for i in range(n_frames)]


class DivergedLink(InProcessLink):
    """A real tissue whose answer is spoilt on its way."""

    def __init__(self, tissue, spoil):
        super().__init__(tissue)
        self._spoil = spoil

    def step(self, sweep, dt):
        return self._spoil(super().step(sweep, dt))


def test_nothing_is_felt_out_of_contact_and_the_tissue_still_lives(block, upright):
    tissue = Tissue(grid((1, 1, 1), (0.02, 0.02, 0.02)))
    bridge = Bridge(InProcessLink(tissue))
    felt = [bridge.step(upright(0.01, 0.01, ABOVE), DT) for _ in range(20)]
    assert not any(w.force.any() or w.torque.any() for w in felt)
    assert tissue.bounds[0, 2] == pytest.approx(-0.5 * 9.81 * 0.02**2, rel=0.1)
    assert bridge.counters.frames == bridge.counters.rejected == 20


def test_a_blade_that_is_drawn_into_the_block_is_pushed_back(block, upright):
    bridge = Bridge(InProcessLink(block()))
    felt = draw(bridge, upright, 60)
    assert felt[-1].force[1] < -0.01
    np.testing.assert_allclose(felt[-1].force, -bridge.result.force_on_tissue, atol=1e-9)


def test_the_first_call_does_not_move_the_blade(block, upright):
    # Anywhere but outside, a sweep from elsewhere would cut.
    bridge = Bridge(InProcessLink(block()))
    bridge.step(upright(0.009, 0.01), DT)
    assert bridge.result.cut_area == 0.0


def test_where_the_broad_phase_says_no_the_tissue_finds_no_active_tetrahedron(block, upright):
    filtered, asked = block(), block()
    bridge = Bridge(InProcessLink(filtered))
    before, n_rejected = upright(0.009, -0.03), 0
    for i in range(400):  # in from one side, out at the other
        segment = upright(0.009, -0.03 + 0.2 * DT * i)
        rejected_before = bridge.counters.rejected
        bridge.step(segment, DT)
        without_filter = asked.step(BladeSweep(before, segment), DT)
        if bridge.counters.rejected > rejected_before:
            assert without_filter.n_active == 0
            assert without_filter.anchored_length == 0.0
            n_rejected += 1
        before = segment
    assert 50 < n_rejected < 350
    assert bridge.result.cut_area == pytest.approx(without_filter.cut_area)


def horseshoe(blade):
    """Return a bar of soft tissue that is bent to half a ring around z, held by its middle."""
    mesh = grid((12, 2, 3), (0.06, 0.01, 0.01))
    turn = np.pi * (1.0 - mesh.positions[:, 0] / 0.06)
    radius = 0.015 + mesh.positions[:, 1]
    bent = np.stack([radius * np.cos(turn), radius * np.sin(turn), mesh.positions[:, 2]], axis=1)
    material = Material(young_modulus=1e3, toughness=1.0)  # sound goes 1.1 mm in a frame
    fixed = np.abs(mesh.positions[:, 0] - 0.03) < 1e-3
    body = TetrahedralMesh(bent, mesh.tetrahedra)
    return Tissue(body, material, fixed=fixed, blade=blade, gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("blade", [None, BladeShape()], ids=["line", "body"])
def test_in_the_hollow_of_a_body_the_broad_phase_is_strict_too(upright, blade):
    """A blade goes into the hollow and turns there, then out through an arm of the horseshoe."""
    filtered, asked = horseshoe(blade), horseshoe(blade)
    bridge = Bridge(InProcessLink(filtered))
    before, n_free, n_touching = None, 0, 0
    for i in range(500):
        turn = 0.03 * min(i, 250)
        segment = upright(1.2e-4 * max(i - 250, 0), -0.005 + 1e-4 * min(i, 120))
        segment = segment._replace(forward=np.array([np.sin(turn), np.cos(turn), 0.0]))
        n_rejected = bridge.counters.rejected
        bridge.step(segment, DT)
        result = asked.step(BladeSweep(before or segment, segment), DT)
        before = segment
        touches = result.n_active > 0 or len(result.contacts.point) > 0
        n_touching += touches
        if bridge.counters.rejected > n_rejected:
            assert not touches
            n_free += bool((filtered.bounds[0, :2] < segment.tip[:2]).all())
    assert n_free > 30 and n_touching > 50
    assert bits(filtered.snapshot()) == bits(asked.snapshot())


def test_an_engaged_blade_keeps_its_tissue_however_far_it_pulls_it(block, upright):
    bridge = Bridge(InProcessLink(block()))
    draw(bridge, upright, 60)
    n_rejected = bridge.counters.rejected
    assert bridge.result.anchored_length > 0.0
    bridge.step(upright(0.03, 0.004), DT)  # at once beyond the block: held tissue comes along
    bridge.step(upright(0.03, 0.004), DT)
    assert bridge.counters.rejected == n_rejected


def test_the_wrench_turns_with_the_tissue(block, upright):
    s = math.sqrt(0.5)
    frame = TissueFrame(
        np.array([[s, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, s]]), np.array([0.3, -0.2, 0.1])
    )
    straight, turned = Bridge(InProcessLink(block())), Bridge(InProcessLink(block()), frame)
    for i in range(60):
        segment = upright(0.009, -0.002 + 0.1 * DT * i)
        felt = straight.step(segment, DT)
        felt_turned = turned.step(frame.segment_to_world(segment), DT)
    expected = frame.wrench_to_world(felt)
    np.testing.assert_allclose(felt_turned.force, expected.force, atol=1e-6)
    np.testing.assert_allclose(felt_turned.point, frame.points_to_world(segment.tip), atol=1e-12)


def test_the_arm_never_feels_more_than_its_device_can_exert(block, upright):
    bridge = Bridge(InProcessLink(block()), limits=DeviceLimits(force=0.02))
    felt = draw(bridge, upright, 60)
    assert max(math.hypot(*w.force) for w in felt) <= 0.02
    assert bridge.counters.force_limited > 0
    assert math.hypot(*bridge.wrench_raw.force) > 0.02
    np.testing.assert_allclose(np.cross(felt[-1].force, bridge.wrench_raw.force), 0.0, atol=1e-12)


def test_the_fixtures_that_the_blade_meets_are_named_in_the_world(block, upright):
    frame = TissueFrame(origin=np.array([0.0, 0.0, 0.05]))
    table = FixtureBox("table", np.array([1.0, 1.0, 0.02]), np.array([0.0, 0.0, 0.0]))
    bridge = Bridge(InProcessLink(block()), frame, fixtures=[table])
    bridge.step(upright(0.01, -0.1, 0.2), DT)
    assert bridge.touching == ()
    bridge.step(upright(0.01, -0.1, 0.0), DT)
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
    block, upright, spoil, bad
):
    bridge = Bridge(DivergedLink(block(), lambda result: spoil(result, bad)))
    with pytest.raises(CouplingError, match="finite"):
        bridge.step(upright(0.009, 0.0), DT)


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
def test_a_blade_that_cannot_be_is_refused_before_the_tissue_hears_of_it(block, segment, why):
    bridge = Bridge(InProcessLink(block()))
    with pytest.raises(ValueError, match=why):
        bridge.step(segment, DT)
    assert bridge.result is None


@pytest.mark.parametrize("dt", [0.0, -1e-3, np.nan, np.inf])
def test_a_frame_that_lasts_no_time_is_refused(block, upright, dt):
    with pytest.raises(ValueError, match="must be positive and finite"):
        Bridge(InProcessLink(block())).step(upright(0.0, 0.0), dt)


def test_the_link_describes_what_the_arm_side_needs(block):
    tissue = block()
    described = InProcessLink(tissue, "block").describe()
    assert described.scene == "block"
    assert (described.n_tetrahedra, described.n_nodes) == (72, 36)
    assert described.material == tissue.material
    np.testing.assert_allclose(described.bounds, [[0.0] * 3, [0.02] * 3])
