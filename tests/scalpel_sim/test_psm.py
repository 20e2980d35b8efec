"""Patient-side manipulators that cut: through their trocars, as other arms do, and two together."""

import numpy as np
import pytest

from bridge import FixtureBox
from scalpel_sim import prepare
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.read import scene_in, shipped_scene, with_settings
from tests.scalpel_sim.coarse_lobe import with_coarse_lobe
from tissue import pieces_of

HELD = 5e-4
"""How far the axis of a shaft may pass the trocar [m]: a tenth of a trocar's bore."""
SAME_FORCE = 0.03
"""Share by which the mean force of a stroke may differ from that by another arm."""


class ShaftWatch:
    """Measures how far the shaft of an arm passes its trocar, in every frame.

    From where MuJoCo has the geom of the shaft, and where the base was put before the start.
    """

    def __init__(self, simulation, prefix=""):
        model, data = simulation.arm.model, simulation.arm.data
        self.trocar = data.body(prefix + "base").xpos.copy()
        self.farthest = self.most_force = 0.0
        shaft = model.geom(prefix + "shaft").id
        self._middle, self._axes = data.geom_xpos[shaft], data.geom_xmat[shaft]

    def look(self, simulation):
        off, along = self.trocar - self._middle, self._axes.reshape(3, 3)[:, 2]
        aside = off - (off @ along) * along
        self.farthest = max(self.farthest, float(np.linalg.norm(aside)))
        self.most_force = max(self.most_force, float(np.linalg.norm(simulation.wrench.force)))


def scene_with(name, *settings):
    return scene_in(with_settings(shipped_scene(name), settings))


def run(scene, *prefixes):
    """Run a scene to its end; return it, and what was seen of the shafts of some arms."""
    simulation = prepare(scene)
    watches = [ShaftWatch(simulation, prefix) for prefix in prefixes]

    def look(simulation):
        for watch in watches:
            watch.look(simulation)
        return False

    simulation.run(simulation.duration + 0.3, look)
    return simulation, watches


def mean_force(simulation):
    force = np.linalg.norm(simulation.recording.vector("force"), axis=1)
    return force[force > 0.01].mean()


@pytest.fixture(scope="module")
def cut():
    return run(scene_with("grid2", 'arm.preset="psm"'), "")


def test_the_shaft_passes_the_trocar_during_the_whole_cut(cut):
    simulation, (watch,) = cut
    assert len(pieces_of(simulation.link.snapshot())) == 2
    assert watch.most_force > 0.5  # the hand and the tissue pull at the blade
    assert watch.farthest < HELD


def test_the_same_stroke_takes_the_same_force_as_by_another_arm(cut):
    other, _ = run(scene_with("grid2", 'arm.preset="touch"'))
    assert mean_force(cut[0]) == pytest.approx(mean_force(other), rel=SAME_FORCE)


def test_two_of_them_cut_off_the_edge_that_one_lifts_each_through_its_own_trocar(tmp_path):
    settings = ('arm.preset="psm"', 'solver.relaxation="verlet"')
    scene = with_coarse_lobe("retract", tmp_path, *settings)
    simulation, watches = run(scene, "", "left_")
    held, off = pieces_of(simulation.link.snapshot())
    assert held.is_held and not off.is_held and off.centre[2] > 0.03
    assert simulation.graspers[0].n_points > 0
    assert simulation.touching.frames == {}
    assert max(watch.farthest for watch in watches) < HELD
    assert np.linalg.norm(watches[0].trocar - watches[1].trocar) > 0.05


def test_the_trocar_of_the_scene_is_where_the_shaft_passes():
    scene = scene_with("grid2", 'arm.preset="psm"', "arm.trocar=[0.1, 0.02, 0.17]")
    simulation = prepare(scene)
    there = simulation.frame.points_to_world(np.array(scene.arm.trocar))
    assert ShaftWatch(simulation).trocar == pytest.approx(there, abs=1e-12)


def hole_in_a_wall(trocar, half_width):
    """Four plates around a square hole in a body wall, level, at a trocar."""
    plates, width, thickness = [], 0.02, 2e-4
    for k, (axis, side) in enumerate([(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)]):
        centre, size = np.array(trocar), np.array([width, width, thickness])
        centre[axis] += side * (half_width + 0.5 * width)
        size[1 - axis] = 2.0 * (half_width + width)
        plates.append(FixtureBox(f"wall{k}", size, centre))
    return plates


def test_the_cannula_swings_in_a_hole_a_quarter_of_a_millimetre_wider_and_touches_a_tighter_one():
    """By the collisions of its geoms: of 6 mm radius, it leans by up to 19.2 degrees."""
    trocar, leaning = (0.02, 0.02, 0.17), 6e-3 / np.cos(np.radians(19.2))
    scene = scene_with("grid2", 'arm.preset="psm"', f"arm.trocar={list(trocar)}")
    touched = []
    for half_width in (leaning + 0.5 * HELD, 6e-3 - HELD):
        simulation = prepare(scene, fixtures=hole_in_a_wall(trocar, half_width))
        simulation.run(simulation.duration)
        assert simulation.recording.column("cut_area_m2")[-1] > 1.5e-3
        touched.append(set(simulation.touching.frames))
    assert touched == [set(), {f"cannula, wall{k}" for k in range(4)}]


@pytest.mark.parametrize(
    ("name", "key"),
    [("grid2", "arm.trocar=[0, 0, 0.2]"), ("retract", "grasper.0.trocar=[0, 0, 0.2]")],
)
def test_a_trocar_for_an_arm_that_goes_through_none_is_refused(name, key):
    with pytest.raises(UsageError, match='trocar is for preset = "psm"'):
        scene_with(name, key)
