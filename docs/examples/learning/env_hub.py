"""Tasks as LeRobot takes environments: `make_env`, which it calls in a repository of its hub.

LeRobot has requirements of its own, so it is installed in an environment of its own:

    uv venv --python 3.12 lerobot
    uv pip install --python lerobot "lerobot[dataset]==0.6.1" "scalpel-sim[learn]"

Copied to a repository of the hub as `env.py`, it is what
`lerobot.envs.make_env("YOU/REPOSITORY", n_envs=4, trust_remote_code=True)` returns. Instruments,
forces and cameras have the names and the order that a dataset of demonstrations has.
"""

from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv, VectorEnv

import scalpel_sim.learning  # noqa: F401  # registers the ids

TASKS = ("scalpel_sim/Incise-v0", "scalpel_sim/Retract-v0")
"""Tasks of the suite, by their numbers."""


class AsLeRobot(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A task whose observations have the names that LeRobot's policies know.

    Args:
        env: The task, which shows arrays and images.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        episode = env.unwrapped.episode
        self._max_episode_steps = episode.max_steps
        self.task_description = self.task = episode.scene.about
        spaces = env.observation_space.spaces
        graspers = [each.name for each in episode.scene.graspers]
        self._hands = [name for name in ("blade", *graspers) if name in spaces]
        self._forces = [name for name in ("wrench", "wrench_peak") if name in spaces]
        self._cameras = [name for name in spaces if name.endswith("_rgb")]
        ends = [[getattr(spaces[name], end) for name in self._hands] for end in ("low", "high")]
        self.observation_space = Dict(
            {
                "agent_pos": Box(*map(np.concatenate, ends)),
                "pixels": Dict({_camera(name): spaces[name] for name in self._cameras}),
                **{name: spaces[name] for name in self._forces},
            }
        )

    def _shown(self, observed: dict[str, np.ndarray]) -> dict[str, Any]:
        return {
            "agent_pos": np.concatenate([observed[name] for name in self._hands]),
            "pixels": {_camera(name): observed[name] for name in self._cameras},
            **{name: observed[name] for name in self._forces},
        }

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode. LeRobot has options of its own, which a task does not know."""
        observed, info = self.env.reset(seed=seed)
        return self._shown(observed), info

    def step(self, action: np.ndarray) -> Any:
        """Do an action over a control step."""
        observed, *rest = self.env.step(action)
        return (self._shown(observed), *rest)


def _camera(name: str) -> str:
    return name.removesuffix("_rgb")


def make_task(name: str) -> gymnasium.Env[Any, Any]:
    """Return a task as LeRobot takes it."""
    return AsLeRobot(gymnasium.make(name, obs="all", render_mode="rgb_array"))


def make_env(n_envs: int = 1, use_async_envs: bool = False) -> dict[str, dict[int, VectorEnv]]:
    """Return the environments of each task, by the name of the suite and the number of the task."""
    many = AsyncVectorEnv if use_async_envs else SyncVectorEnv
    tasks = {i: many([partial(make_task, name)] * n_envs) for i, name in enumerate(TASKS)}
    return {"scalpel_sim": tasks}
