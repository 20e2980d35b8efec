"""Local time stepping against a literal version, against theory, and at its limits."""

import numpy as np
import pytest

from tests.tissue.integrators.networks import (
    FREE_FALL,
    block,
    found_nodes,
    frequency_bound,
    macro_steps,
    nearest,
    rings_around,
    shake,
    stiffen,
)
from tests.tissue.kernels_of import dense_modes, row
from tissue.integrators.local.chebyshev import STABILISATION, chebyshev

MIDDLE = np.array([0.02, 0.02, 0.02])


def middle_of(network, last_ring=1):
    """Return the nodes in rings around the middle of the body."""
    return found_nodes(rings_around(network, nearest(network, MIDDLE), last_ring))


def naive_macro_step(network, fine, span, n_substeps, kick):
    """Take one macro step with every node in the recursion: a slow, literal version."""
    body, c = network.body, chebyshev(n_substeps)
    selected = np.isin(np.arange(len(body.rest)), fine)[:, None]
    start, v = body.positions.copy(), body.velocities
    before = e = np.zeros_like(start)
    for m in range(n_substeps):
        y = start + selected * e
        r = np.zeros_like(start)
        for i in np.flatnonzero(~body.fixed):
            for q, (k, rest_pull) in row(network.springs, i).items():
                d = y[q] - y[i]
                r[i] += (k - rest_pull / np.linalg.norm(d)) * d / body.masses[i]
            r[i] += network.surroundings.gravity
        before, e = e, c.onward[m] * e - c.back[m] * before + c.push[m] * span**2 * r
    v += kick * 2.0 * e / span
    body.positions[:] = start + span * v


@pytest.mark.kernel
@pytest.mark.parametrize("n_substeps", [1, 3])
def test_a_step_is_that_of_the_literal_version_of_the_scheme(n_substeps):
    """Nodes away from fine nodes take one step; in the literal version all use the recursion."""
    plain, quick = (block(2, gravity=FREE_FALL) for _ in range(2))
    for network in (plain, quick):
        shake(network, 1e-3)
    fine = [i for i in middle_of(plain, 0) if not plain.body.fixed[i]]
    for i in range(3):
        naive_macro_step(plain, fine, 1e-3, n_substeps, 0.5 if i == 0 else 1.0)
    macro_steps(quick, fine, 1e-3, 3, n_substeps)
    np.testing.assert_allclose(quick.body.positions, plain.body.positions, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(quick.body.velocities, plain.body.velocities, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("n_substeps", [1, 2, 4, 8])
def test_the_equilibrium_is_that_of_global_steps(n_substeps):
    network = block(3, gravity=FREE_FALL, drag=20.0, retardation_time=2e-4)
    span = 1.0 / frequency_bound(network)
    network.advance(span, int(3.0 / span))
    expected = network.body.positions.copy()
    network.body.positions[:] = network.body.rest
    network.body.velocities[:] = 0.0
    macro_steps(network, middle_of(network), span, int(3.0 / span), n_substeps)
    error = np.abs(network.body.positions - expected).max()
    assert error < 1e-9 * np.abs(expected - network.body.rest).max()


@pytest.mark.parametrize("retardation_time", [0.0, 2e-4])
def test_a_free_body_conserves_momentum(retardation_time):
    network = block(3, held=False, retardation_time=retardation_time)
    shake(network, 2e-4)
    body = network.body
    body.velocities[:] = np.random.default_rng(0).normal(size=body.velocities.shape) * 0.02
    momentum = body.masses @ body.velocities
    macro_steps(network, middle_of(network), 1.0 / frequency_bound(network), 2000, 4)
    scale = 0.02 * body.masses.sum()
    np.testing.assert_allclose(body.masses @ body.velocities, momentum, atol=1e-12 * scale)


def test_dampers_conserve_angular_momentum_and_dissipate_energy():
    """Impulses along the springs in one short step, without drag, with all nodes fine."""
    for retardation_time in (1e-4, 1.0):  # the second is far too stiff for any explicit step
        network = block(2, held=False, retardation_time=retardation_time)
        body = network.body
        body.velocities[:] = np.random.default_rng(0).normal(size=body.velocities.shape)
        before = np.cross(body.positions, body.masses[:, None] * body.velocities).sum(axis=0)
        energy = float((body.masses[:, None] * body.velocities**2).sum())
        macro_steps(network, list(range(len(body.rest))), 1e-9, 1, 1)
        after = np.cross(body.positions, body.masses[:, None] * body.velocities).sum(axis=0)
        np.testing.assert_allclose(after, before, atol=1e-7 * np.abs(before).max())
        left = float((body.masses[:, None] * body.velocities**2).sum())
        assert left < energy


@pytest.mark.parametrize("n_substeps", [1, 4])
def test_the_order_is_two(n_substeps):
    def error(n):
        ends = []
        for is_global in (True, False):
            network = block(3)
            shake(network, 2e-4)
            if is_global:
                network.advance(0.02 / 1000, 1000)
            else:
                macro_steps(network, middle_of(network), 0.02 / n, n, n_substeps)
            ends.append(network.body.positions.copy())
        return np.abs(ends[1] - ends[0]).max()

    coarse, fine = error(200), error(400)
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


STIFF = 16.0


def shaken_about_a_stiff_zone(size, n_substeps, stabilisation):
    """Return the largest displacement [m] after 2 s at 0.9 of the coarse limit, undamped."""
    network = block(4, held=False)
    coarse = np.sqrt(np.linalg.eigvalsh(dense_modes(network.body, network.springs))[-1])
    zone = middle_of(network)
    stiffen(network, zone, STIFF)
    shake(network, size)
    noise = np.random.default_rng(1).normal(size=network.body.rest.shape)
    network.body.velocities[:] = 40.0 * size * (noise - noise.mean(axis=0))
    span = 0.9 * 2.0 / coarse
    macro_steps(network, zone, span, int(2.0 / span), n_substeps, stabilisation)
    moved = np.abs(network.body.positions - network.body.rest).max()
    return moved if np.isfinite(moved) else np.inf


def test_a_zone_16_times_as_stiff_is_stable_in_4_substeps_at_the_limit_of_the_others():
    """At small strain, with the least stabilisation of the literature."""
    assert shaken_about_a_stiff_zone(1e-6, 4, 0.05) < 1e-3


def test_too_few_substeps_are_unstable():
    """Two substeps allow twice the frequency; the zone has 3.2 times that of the other nodes."""
    assert shaken_about_a_stiff_zone(1e-6, 2, 0.05) > 1.0


def test_large_strains_need_the_stabilisation_that_is_the_default():
    """Waves of half a millimetre strain the springs by 6 %, without damping."""
    assert shaken_about_a_stiff_zone(5e-4, 5, STABILISATION) < 0.1
