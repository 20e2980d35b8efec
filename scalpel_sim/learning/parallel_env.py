"""`parallel_env`: a task as an environment of PettingZoo, in which each hand is an agent."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv

from scalpel_sim.errors import UsageError
from scalpel_sim.learning.environment import RESET_OPTIONS, TissueEnv
from scalpel_sim.learning.episode import finite_numbers
from scalpel_sim.learning.registration import NAMESPACE
from scalpel_sim.scene.scene import Scene

Each = dict[str, Any]
"""A value for each agent, by the name of its hand."""


class TissueParallelEnv(ParallelEnv[str, Any, np.ndarray]):  # type: ignore[misc]  # untyped
    """A task whose hands are agents. All are shown the same, and get the same reward.

    Args:
        env: The environment that they share.
    """

    def __init__(self, env: TissueEnv) -> None:
        self.env = env
        """The environment that they share."""
        self.metadata = env.metadata | {"name": env.episode.scene.name}
        self.render_mode = env.render_mode
        self.possible_agents = list(env.episode.hand.led)
        self.agents: list[str] = []
        self.action_spaces = {
            name: Box(-1.0, 1.0, (len(names),), np.float32)
            for name, names in env.episode.hand.names_by_hand.items()
        }
        self.observation_spaces = dict.fromkeys(self.possible_agents, env.observation_space)

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """Return the space of an agent's actions: those of its hand."""
        return self.action_spaces[agent]

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """Return the space of what an agent is shown."""
        return self.observation_spaces[agent]

    def reset(self, seed: int | None = None, options: Each | None = None) -> tuple[Each, Each]:
        """Begin an episode; see `TissueEnv.reset`. Options that it does not have are ignored."""
        # As PettingZoo's checker asks.
        known = {name: value for name, value in (options or {}).items() if name in RESET_OPTIONS}
        observed, info = self.env.reset(seed=seed, options=known)
        self.agents = list(self.possible_agents)
        return self._for_each(observed), {name: dict(info) for name in self.agents}

    def step(self, actions: Mapping[str, np.ndarray]) -> tuple[Each, Each, Each, Each, Each]:
        """Do the actions of all hands over a control step; see `Episode.act`.

        Raises:
            UsageError: no episode has begun, or the last one has ended; or an action is missing,
                has another shape, or is not finite.
        """
        if not self.agents:
            raise UsageError("no episode goes on: begin one by reset()")
        action = np.concatenate([self._checked(actions, name) for name in self.agents])
        observed, reward, terminated, truncated, info = self.env.step(action)
        found = (observed, reward, terminated, truncated)
        infos = {name: dict(info) for name in self.agents}
        observations, rewards, terminations, truncations = map(self._for_each, found)
        if terminated or truncated:
            self.agents = []
        return observations, rewards, terminations, truncations, infos

    def _checked(self, actions: Mapping[str, np.ndarray], name: str) -> np.ndarray:
        """Return the action of an agent.

        Raises:
            UsageError: it is missing, has another shape, or is not finite.
        """
        if not isinstance(actions, Mapping) or name not in actions:
            given = ", ".join(map(str, actions)) if isinstance(actions, Mapping) else repr(actions)
            raise UsageError(f"actions have none of '{name}', only {given or 'none'}")
        shape = self.action_spaces[name].shape
        return finite_numbers(actions[name], shape, f"an action of '{name}' is")

    def _for_each(self, value: Any) -> Each:
        return dict.fromkeys(self.agents, value)

    def render(self) -> Any:
        """Return a picture of the present; see `TissueEnv.render`."""
        return self.env.render()

    def close(self) -> None:
        """Free what the environment holds."""
        self.env.close()


def parallel_env(task: str | Path | Scene, **settings: Any) -> TissueParallelEnv:
    """Return a task as an environment of PettingZoo, in which each hand is an agent.

    Args:
        task: An id of Gymnasium, such as `scalpel_sim/InciseTaut-v0`; or a scene with a task: its
            name, a TOML file, or the scene itself.
        settings: More arguments of `TissueEnv`.

    Raises:
        UsageError: there is no such scene, or an argument has no such value.
        gymnasium.error.UnregisteredEnv: there is no such id.
    """
    if isinstance(task, str) and (task in gymnasium.registry or task.startswith(f"{NAMESPACE}/")):
        settings = gymnasium.spec(task).kwargs | settings
    else:
        settings = {"scene": task, **settings}
    return TissueParallelEnv(TissueEnv(**settings))
