"""Quaternions in kernels against MuJoCo's functions."""

import platform

import mujoco
import numpy as np
import pytest

from scalpel_sim import quaternions

CONTRACTS = platform.machine() not in ("x86_64", "AMD64")
"""Whether MuJoCo is compiled with fused multiplications and additions, which round once."""


def same(found, expected):
    found = np.array(found)
    if CONTRACTS:
        return np.allclose(found, expected, rtol=0.0, atol=1e-14)
    return found.tobytes() == np.array(expected).tobytes()


def by_mujoco(function, size, *arguments):
    result = np.empty(size)
    function(result, *arguments)
    return result


def random_quaternion(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def numbers(array):
    return tuple(array.tolist())


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(4))
def test_each_function_gives_the_bits_of_mujoco(seed):
    rng = np.random.default_rng(seed)
    for _ in range(50):
        assert_as_mujoco(rng)


def assert_as_mujoco(rng):
    """Compare each function for random arguments: small turns, half turns and zero vectors too."""
    a, b = random_quaternion(rng), random_quaternion(rng)
    near = a + rng.choice([0.0, 1e-9, 1e-4]) * rng.normal(size=4)
    near /= np.linalg.norm(near)
    v, share = rng.choice([0.0, 1e-12, 1.0, 3.0]) * rng.normal(size=3), rng.uniform()
    p, q, w = numbers(a), numbers(b), numbers(v)
    assert same(quaternions.product(p, q), by_mujoco(mujoco.mju_mulQuat, 4, a, b))
    assert same(quaternions.inverse(p), by_mujoco(mujoco.mju_negQuat, 4, a))
    assert same(quaternions.rotated(w, p), by_mujoco(mujoco.mju_rotVecQuat, 3, v, a))
    for other in (b, near, -near):
        turn = quaternions.turn_between(p, numbers(other))
        assert same(turn, by_mujoco(mujoco.mju_subQuat, 3, other, a))
    turned = a.copy()
    mujoco.mju_quatIntegrate(turned, v, share)
    assert same(quaternions.turned_on(p, w, share), turned)
    matrix = by_mujoco(mujoco.mju_quat2Mat, 9, a)
    assert same(quaternions.matrix_of(p), matrix)
    assert same(
        quaternions.quaternion_of(numbers(matrix)), by_mujoco(mujoco.mju_mat2Quat, 4, matrix)
    )
