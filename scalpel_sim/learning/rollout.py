"""Whole episodes of policies that need no training: experts, and baselines that gain nothing."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scalpel_sim.learning.episode import Episode
from scalpel_sim.learning.expert import Expert
from tissue import FloatArray

Policy = Callable[[], FloatArray]
"""Returns the next action."""

PolicyMaker = Callable[[Episode, np.random.Generator], Policy]
"""Makes the policy of an episode after its `reset`, with a generator of its own."""

LONGEST_EPISODE = 2_000
"""Control steps after which an episode of a task without a time limit ends."""


class EpisodeEnd(NamedTuple):
    """End of an episode."""

    is_success: bool
    """Whether all conditions of success held."""
    reward: float
    """Sum of the rewards."""
    n_steps: int
    """Control steps."""
    failed: tuple[str, ...]
    """Conditions that could no longer hold."""
    fault: str | None
    """Error with which the simulation failed; None: it did not."""
    terms: dict[str, float]
    """Terms of the score at the end."""


def expert(episode: Episode, rng: np.random.Generator) -> Policy:
    """Return the policy that does the script of the scene."""
    return Expert(episode).action


def uniform(episode: Episode, rng: np.random.Generator) -> Policy:
    """Return a policy whose actions are random, each number evenly within plus or minus 1."""
    n = len(episode.action_names)
    return lambda: rng.uniform(-1.0, 1.0, n)


def idle(episode: Episode, rng: np.random.Generator) -> Policy:
    """Return a policy that does nothing."""
    n = len(episode.action_names)
    return lambda: np.zeros(n)


POLICIES: dict[str, PolicyMaker] = {
    "expert": expert,
    "random": uniform,
    "idle": idle,
}
"""Policies by name: each is made for an episode after its `reset`."""


def run_episode(episode: Episode, policy: PolicyMaker, seed: int) -> EpisodeEnd:
    """Do a whole episode.

    Args:
        episode: The task.
        policy: Makes the policy, such as one of `POLICIES`.
        seed: Seed of all that is random.
    """
    of_episode, of_policy = (
        np.random.default_rng(each) for each in np.random.SeedSequence(seed).spawn(2)
    )
    episode.reset(of_episode)
    act, reward = policy(episode, of_policy), 0.0
    for _ in range(LONGEST_EPISODE):
        outcome = episode.act(act())
        reward += outcome.reward
        if outcome.terminated or outcome.truncated:
            break
    return EpisodeEnd(
        episode.is_success,
        reward,
        episode.n_steps,
        outcome.failed,
        outcome.fault,
        episode.terms,
    )
