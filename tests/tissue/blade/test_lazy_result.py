"""A result whose arrays are made when they are asked for acts as a plain one."""

import copy
import pickle

import numpy as np
import pytest

from tests.bridge.bits import bits
from tissue import BladeSegment, BladeShape, BladeSweep, StepResult, Tissue, block

SIDE = 0.02


def edge(y):
    ends = np.array([[SIDE / 2.0, y, -SIDE], [SIDE / 2.0, y, 2.0 * SIDE]])
    return BladeSegment(*ends, np.array([0.0, 1.0, 0.0]))


def steps(n):
    """Return results of a blade that enters a block, and copies of them made at once."""
    tissue = Tissue(block((2, 2, 2), (SIDE,) * 3), blade=BladeShape())
    results, copies = [], []
    for i in range(n):
        sweep = BladeSweep(edge(-0.002 + 5e-4 * i), edge(-0.002 + 5e-4 * (i + 1)))
        results.append(tissue.step(sweep, 1e-3))
        copies.append(copy.deepcopy(results[-1]))
    return results, copies


@pytest.fixture(scope="module")
def result():
    results, _ = steps(12)
    assert results[-1].anchored_length > 0.0 and results[-1].wrench.force.any()
    return results[-1]


def test_later_steps_change_nothing_but_the_views_of_contacts():
    results, copies = steps(12)
    for result, copied in zip(results, copies, strict=True):
        assert bits(result._replace(contacts=None)) == bits(copied._replace(contacts=None))
    assert bits(results[-1].contacts) == bits(copies[-1].contacts)


def test_copies_are_plain_results(result):
    for copied in (copy.copy(result), copy.deepcopy(result), pickle.loads(pickle.dumps(result))):
        assert type(copied) is StepResult
        assert bits(copied) == bits(result)
    assert type(result._replace(n_nodes=1)) is StepResult
    assert repr(result) == repr(StepResult(*result))
    assert repr(result).startswith("StepResult(wrench=Wrench(force=array(")
