"""The scene `contact`: the right theory passes, and a wrong one fails."""

import numpy as np
import pytest

from scalpel_sim.validate.contact import (
    Tilt,
    check_hertz,
    check_tilt,
    half_space,
    hertz_force,
    press_sphere,
)
from scalpel_sim.validate.findings import FAIL, PASS


def test_a_sphere_meets_the_force_of_hertz():
    """Within 10 %: under a contact of three cells averaged shear yields, 6 % with finer ones."""
    found = press_sphere(0.45, 1.2e-3, [1e-3])
    assert found.force == pytest.approx([hertz_force(1e-3, 0.45)], rel=0.1)
    right = found._replace(force=np.array([hertz_force(1e-3, 0.45)]))
    assert [check.verdict for check in check_hertz("it", 0.45, right)] == [PASS]
    soft = found._replace(force=0.9 * found.force)
    assert [check.verdict for check in check_hertz("it", 0.45, soft)] == [FAIL]


def test_the_force_of_hertz_grows_with_depth_to_the_power_of_three_halves():
    assert hertz_force(2e-3, 0.3) / hertz_force(1e-3, 0.3) == pytest.approx(2.0**1.5)
    assert hertz_force(1e-2, 0.0) == pytest.approx(4.0 / 3.0 * 20e3 * 0.01**2)


def test_the_half_space_is_a_full_cylinder_without_gaps():
    mesh = half_space(1.6e-3)
    a, b, c, d = mesh.positions[mesh.tetrahedra].swapaxes(0, 1)
    volumes = np.einsum("ni,ni->n", np.cross(b - a, c - a), d - a) / 6.0
    radius = np.linalg.norm(mesh.positions[:, :2], axis=1).max()
    n = 6 * 3  # nodes on a ring outside
    area = 0.5 * n * np.sin(2.0 * np.pi / n) * radius**2
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(area * -mesh.positions[:, 2].min())


def test_a_block_that_slips_too_early_or_weighs_too_little_fails():
    right = check_tilt(0.5, Tilt(1.0, 26.5, 26.8))
    assert [check.verdict for check in right] == [PASS] * 3
    wrong = check_tilt(0.5, Tilt(0.99, 25.0, 28.0))
    assert [check.verdict for check in wrong] == [FAIL] * 3
