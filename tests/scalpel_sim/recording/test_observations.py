"""Observations by name, without a tissue."""

from unittest.mock import patch

import numpy as np
import pytest

from scalpel_sim.errors import UsageError
from scalpel_sim.recording.observations import OBSERVATIONS, observed


def test_an_observation_gets_its_argument_and_returns_arrays():
    with patch.dict(OBSERVATIONS, {"mark": lambda _, text: {f"mark:{text}": np.ones(2)}}):
        assert observed(None, (), None, ["mark:4"])["mark:4"].shape == (2,)


def test_an_observation_that_is_no_array_is_named():
    says = "'mark' returned a float as 'mark'; it must be an array"
    with (
        patch.dict(OBSERVATIONS, {"mark": lambda *_: {"mark": 1.0}}),
        pytest.raises(UsageError, match=says),
    ):
        observed(None, (), None, ["mark"])
