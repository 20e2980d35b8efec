"""Learn a task with PPO of Stable-Baselines3, from state.

    python sb3.py --task scalpel_sim/Incise-v0 --minutes 30

To install: pip install "scalpel-sim[examples]"
"""

import argparse
import math
import time
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecNormalize

import scalpel_sim.learning  # noqa: F401  # registers the tasks


class Curve(BaseCallback):
    """Prints the learning curve, and ends the training when its time is over."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self.minutes, self.began = minutes, time.monotonic()

    def _on_rollout_end(self) -> None:
        episodes = self.model.ep_info_buffer
        if episodes:
            reward = np.mean([each["r"] for each in episodes])
            success = 100.0 * np.mean([each["is_success"] for each in episodes])
            cpu = time.process_time() / 60.0
            print(
                f"{self.num_timesteps:7d} steps, {cpu:.1f} CPU min: reward {reward:.2f}, "
                f"success {success:.0f} %",
                flush=True,
            )

    def _on_step(self) -> bool:
        return time.monotonic() - self.began < 60.0 * self.minutes


def wilson(n: int, of: int) -> tuple[float, float]:
    """Return the interval in which a rate is at 95 % (Wilson 1927)."""
    z = 1.96
    middle, half = n + z * z / 2, z * math.sqrt(n * (of - n) / of + z * z / 4)
    return (middle - half) / (of + z * z), (middle + half) / (of + z * z)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--task", default="scalpel_sim/Incise-v0")
    parser.add_argument("--minutes", type=float, default=30.0, help="of training, at most")
    parser.add_argument("--steps", type=int, default=1_000_000, help="of training, at most")
    parser.add_argument("--envs", type=int, default=8, help="environments")
    parser.add_argument("--round", type=int, default=1024, help="control steps of a round")
    parser.add_argument("--evaluate", type=int, default=50, help="episodes")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("sb3.zip"))
    options = parser.parse_args()
    torch.set_num_threads(1)
    envs = VecNormalize(
        make_vec_env(
            options.task,
            options.envs,
            options.seed,
            monitor_kwargs={"info_keywords": ("is_success",)},
            env_kwargs={"obs": "flat"},
        )
    )
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=max(options.round // options.envs, 1),
        batch_size=min(options.round, 128),
        seed=options.seed,
        device="cpu",
        policy_kwargs={"log_std_init": -0.7, "net_arch": [128, 128]},
    )
    model.learn(options.steps, callback=Curve(options.minutes))
    model.save(options.out)
    envs.save(str(options.out.with_suffix(".scales.pkl")))

    envs.training, successes = False, []
    envs.venv.seed(10_000_000 + options.seed)  # episodes that it has not seen

    def note(told: dict, _: dict) -> None:
        if told["done"]:
            successes.append(told["info"]["is_success"])

    evaluate_policy(model, envs, options.evaluate, callback=note)
    n = sum(successes)
    low, high = wilson(n, len(successes))
    print(f"{n} of {len(successes)} episodes succeed: {100 * low:.0f} to {100 * high:.0f} %")


if __name__ == "__main__":
    main()
