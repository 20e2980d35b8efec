"""A weight of `approach` pays a blade for its way to what is to be cut next."""

import numpy as np
import pytest
from msgspec.structs import replace

from scalpel_sim.learning import Episode, Expert
from scalpel_sim.scene.task_table import RewardTable
from tests.scalpel_sim.learning.little_task import little_task

__all__ = ["little_task"]

SPACING = 0.25e-3
"""Distance between places of a plan [m]: a place that stands for it is that near."""


@pytest.fixture(scope="module")
def episode(little_task):
    """An episode of the little task that pays -1 for a metre of way, and nothing else."""
    task = replace(little_task.task, reward=RewardTable(approach=-1.0))
    return Episode(replace(little_task, task=task))


def begin(episode):
    """Begin; return the tip, and the bottoms of the cut below the line [m], tissue frame."""
    tip = episode.reset(np.random.default_rng(0))["blade"][:3]
    plan = episode.score.plan
    return tip, plan.stations + plan.depths[:, None] * plan.into


def way(tip, bottoms):
    return np.linalg.norm(bottoms[0] - tip)


def test_a_blade_is_paid_for_coming_nearer_to_the_first_bottom_of_the_cut(episode):
    before, bottoms = begin(episode)
    action = np.zeros(len(episode.action_names))
    action[:2] = 0.3, 0.6  # across, and along the edge to the tip: in the air
    paid = episode.act(action).reward
    after = episode.observation["blade"][:3]
    assert episode.observation["wrench"].max() == 0.0
    assert paid == pytest.approx(way(before, bottoms) - way(after, bottoms), abs=SPACING)
    assert paid > 2 * SPACING


def test_there_and_back_pays_nothing(episode):
    begin(episode)
    there = np.zeros(len(episode.action_names))
    there[:3] = -0.5, 0.4, 0.7
    assert episode.act(there).reward + episode.act(-there).reward == pytest.approx(0.0, abs=1e-9)


def test_what_is_cut_no_longer_pulls(episode):
    tip, bottoms = begin(episode)
    expert, paid, covered = Expert(episode), 0.0, 0.0
    while covered < 0.5:
        paid += episode.act(expert.action()).reward
        covered = episode.score.terms()["covered"]
    left = way(tip, bottoms) - paid
    rest = bottoms[~episode.score.is_covered[nearest(episode, bottoms)]]
    assert 0 < len(rest) < 0.7 * len(bottoms)
    assert left == pytest.approx(way(episode.observation["blade"][:3], rest), abs=2e-3)  # it gives


def nearest(episode, places):
    points = episode.score.plan.surface.points
    return np.linalg.norm(points - places[:, None], axis=2).argmin(axis=1)
