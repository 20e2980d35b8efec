import numpy as np
import pytest

from scalpel_sim import SCALPEL, SCENES, Simulation, prepare
from scalpel_sim.recording.columns import EDGE_COSINE, force_parts
from scalpel_sim.scene.scene import changed
from tissue import RigidContacts

FORWARD = np.array([0.0, 1.0, 0.0])


def test_the_face_of_the_steepest_bevel_does_not_count_as_edge():
    steep = np.array([[0.5, np.sin(np.radians(60.0)), 0.0]])
    none, zero = np.zeros((1, 3)), np.zeros(1)
    contacts = RigidContacts(none, steep, np.ones(1), none, zero, np.full(1, -1))
    assert not force_parts(contacts, FORWARD).edge.any()


@pytest.mark.kernel
@pytest.mark.parametrize("n", [0, 1, 7, 60])
def test_the_parts_are_the_sums_of_numpy(n):
    rng = np.random.default_rng(n)
    normal = rng.normal(size=(n, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal[::2] = FORWARD
    contacts = RigidContacts(
        np.zeros((n, 3)), normal, rng.normal(size=n), normal + 1.0, np.zeros(n), np.full(n, -1)
    )
    pressing = contacts.normal_force[:, None] * normal
    is_edge = normal @ FORWARD > EDGE_COSINE
    parts = force_parts(contacts, FORWARD)
    assert parts.edge == pytest.approx(-(pressing + contacts.friction)[is_edge].sum(axis=0))
    assert parts.pressing == pytest.approx(-pressing[~is_edge].sum(axis=0))
    assert parts.friction == pytest.approx(-contacts.friction[~is_edge].sum(axis=0))


@pytest.fixture(scope="module")
def cut() -> tuple[Simulation, list[np.ndarray]]:
    """Return a cut by a scalpel with friction, and the force at the end of each frame."""
    scene = changed(SCENES["grid2"], blade=SCALPEL, blade_friction=0.3, audit=True)
    simulation = prepare(scene)
    forces: list[np.ndarray] = []
    simulation.run(1.0, lambda now: forces.append(now.result.wrench_t1.force.copy()))
    return simulation, forces


def test_the_parts_of_each_frame_add_up_to_the_force_at_its_end(cut):
    simulation, forces = cut
    parts = ("edge_force", "pressing_force", "friction_force")
    recorded = [simulation.recording.vector(name) for name in parts]
    assert all(np.abs(part).max() > 1e-3 for part in recorded)
    there = simulation.frame.vectors_to_world(np.array(forces))
    assert sum(recorded) == pytest.approx(there, abs=1e-9)
