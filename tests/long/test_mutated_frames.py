"""Damaged frames: an honest client gets the same bits, and no frame crashes or delays a server."""

import pytest

from tests.long.child import GROWTH_WITH_KERNELS, HANG, Child
from tests.long.frame_mutations import N_FRAMES
from tests.support.battery import battery


@pytest.fixture(scope="module")
def servers():
    child = Child(
        "tests.long.frame_mutations",
        "converse",
        longest=N_FRAMES * HANG,
        growth=GROWTH_WITH_KERNELS,
    )
    yield child
    child.close()


@battery(n_per_change=100, n_long=20_000)
def test_fifty_damaged_frames_change_nothing_for_others(case, servers):
    assert servers.run(case) == [True, True], "the answers that the honest side got"
