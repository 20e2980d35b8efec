"""Learn a task by trial and error, from state: proximal policy optimisation in one file.

    python ppo.py --task scalpel_sim/Incise-v0 --minutes 30

After Schulman et al. 2017 (arXiv:1707.06347), with advantages of Schulman et al. 2016.
To install: pip install "scalpel-sim[examples]"
"""

import argparse
import math
import time
from pathlib import Path

import gymnasium
import numpy as np
import torch
from torch import nn

import scalpel_sim.learning  # noqa: F401  # registers the tasks

N_EPOCHS, N_BATCHES = 10, 8
"""Times that the steps of a round are learnt from, and parts in which."""

DISCOUNT, SMOOTHING = 0.99, 0.95
"""Discount of a control step, and smoothing of advantages."""

CLIP, RATE = 0.2, 3e-4
"""Largest change of a ratio of probabilities that counts, and rate of learning at first."""

FIRST_NOISE = 0.5
"""Standard deviation of the actions at first."""


def layer(n: int, m: int, gain: float) -> nn.Linear:
    found = nn.Linear(n, m)
    nn.init.orthogonal_(found.weight, gain)
    nn.init.zeros_(found.bias)
    return found


def network(n: int, m: int, gain: float) -> nn.Sequential:
    first, second = layer(n, 128, math.sqrt(2.0)), layer(128, 128, math.sqrt(2.0))
    return nn.Sequential(first, nn.Tanh(), second, nn.Tanh(), layer(128, m, gain))


class Policy(nn.Module):
    """Normal distributions of actions, and the value of what is seen."""

    def __init__(self, n_seen: int, n_actions: int) -> None:
        super().__init__()
        self.sizes = (n_seen, n_actions)
        self.actor, self.critic = network(n_seen, n_actions, 0.01), network(n_seen, 1, 1.0)
        self.log_noise = nn.Parameter(torch.full((n_actions,), math.log(FIRST_NOISE)))
        self.register_buffer("n", torch.tensor(1e-4, dtype=torch.float64))
        self.register_buffer("mean", torch.zeros(n_seen, dtype=torch.float64))
        self.register_buffer("squares", torch.zeros(n_seen, dtype=torch.float64))

    def notice(self, rows: torch.Tensor) -> None:
        """Take rows into the mean and the spread of what is seen."""
        rows = rows.double()
        n, away = self.n + len(rows), rows.mean(0) - self.mean
        self.squares += ((rows - rows.mean(0)) ** 2).sum(0) + away**2 * self.n * len(rows) / n
        self.mean += away * len(rows) / n
        self.n.copy_(n)

    def scaled(self, rows: torch.Tensor) -> torch.Tensor:
        """Return what is seen, each number about within plus or minus 1."""
        spread = (self.squares / self.n).sqrt() + 1e-4  # 0.1 mm and 0.1 mN make no difference
        return ((rows - self.mean) / spread).clamp(-5.0, 5.0).float()

    def distribution(self, scaled: torch.Tensor) -> torch.distributions.Normal:
        return torch.distributions.Normal(self.actor(scaled), self.log_noise.exp())

    def save(self, path: Path) -> None:
        torch.save({"sizes": self.sizes, "policy": self.state_dict()}, path)


def from_tip(rows: np.ndarray, space: gymnasium.spaces.Dict) -> torch.Tensor:
    """Return what is seen in rows, the places of the plan as they lie from the tip of the blade."""
    found = {name: rows[name] for name in space}
    if "target" in found and "blade" in found:
        places = found["target"].reshape(len(found["target"]), -1, 4).copy()
        places[:, :, :3] -= found["blade"][:, None, :3]
        found["target"] = places.reshape(len(places), -1)
    return torch.from_numpy(np.concatenate(list(found.values()), axis=1))


class Learner:
    """Plays episodes in several environments at once, and learns from them.

    An environment that ends an episode begins the next one in the step after: that is left out.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.envs = gymnasium.make_vec(options.task, options.envs, obs="state")
        self.space = self.envs.single_observation_space
        seen, _ = self.envs.reset(seed=options.seed)
        self.seen, self.begins = from_tip(seen, self.space), np.zeros(options.envs, bool)
        n_actions = self.envs.single_action_space.shape[0]
        self.policy = Policy(self.seen.shape[1], n_actions)
        self.optimizer = torch.optim.Adam(self.policy.parameters(), RATE, eps=1e-5)
        self.n_steps = 0
        self.returns = np.zeros(options.envs)  # of the episodes that run
        self.ended: list[tuple[float, bool]] = []

    def play(self) -> list[torch.Tensor]:
        """Play a round; return what was seen and done, its log probability, gains and values."""
        rows, policy, round_steps = [], self.policy, self.options.round // self.options.envs
        policy.notice(self.seen)
        for _ in range(round_steps):
            with torch.no_grad():
                scaled = policy.scaled(self.seen)
                distribution = policy.distribution(scaled)
                action = distribution.sample()
                chance, value = distribution.log_prob(action).sum(1), policy.critic(scaled)[:, 0]
            seen, reward, ended, late, info = self.envs.step(action.clamp(-1.0, 1.0).numpy())
            is_real = ~self.begins
            self.n_steps += int(is_real.sum())
            self.returns += reward * is_real
            self.seen, self.begins = from_tip(seen, self.space), ended | late
            for i in np.flatnonzero(self.begins):
                self.ended.append((self.returns[i], bool(info["is_success"][i])))
                self.returns[i] = 0.0
            policy.notice(self.seen)
            with torch.no_grad():
                after = policy.critic(policy.scaled(self.seen))[:, 0]
            numbers = [torch.from_numpy(each) for each in (reward, ended, self.begins, is_real)]
            rows.append((scaled, action, chance, value, after, *numbers))
        return self._with_advantages([torch.stack(each) for each in zip(*rows, strict=True)])

    def _with_advantages(self, rows: list[torch.Tensor]) -> list[torch.Tensor]:
        scaled, action, chance, value, after, reward, ended, last, is_real = rows
        gains, gain = torch.zeros_like(value), torch.zeros(value.shape[1])
        for i in reversed(range(len(value))):
            wrong = reward[i].float() + DISCOUNT * after[i] * ~ended[i] - value[i]
            gain = wrong + DISCOUNT * SMOOTHING * gain * ~last[i]
            gain = gain * is_real[i]
            gains[i] = gain
        return [each[is_real] for each in (scaled, action, chance, gains, gains + value)]

    def learn(self, rows: list[torch.Tensor], left: float) -> None:
        """Learn from a round; `left` is the share of the training that is left."""
        policy = self.policy
        for group in self.optimizer.param_groups:
            group["lr"] = RATE * max(left, 0.05)
        for _ in range(N_EPOCHS):
            for some in torch.randperm(len(rows[0])).chunk(N_BATCHES):
                scaled, action, chance, gains, wanted = (each[some] for each in rows)
                ratio = (policy.distribution(scaled).log_prob(action).sum(1) - chance).exp()
                gains = (gains - gains.mean()) / (gains.std() + 1e-8)
                gained = torch.min(ratio * gains, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * gains)
                wrong = (policy.critic(scaled)[:, 0] - wanted) ** 2
                loss = -gained.mean() + 0.5 * wrong.mean()
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(policy.parameters(), 0.5)
                self.optimizer.step()


def train(options: argparse.Namespace) -> Policy:
    """Train, and print the learning curve."""
    learner, began, rounds = Learner(options), time.monotonic(), 0
    print("  steps   minutes  episodes  reward  success  noise", flush=True)
    while True:
        spent = (time.monotonic() - began) / (60.0 * options.minutes)
        spent = max(spent, learner.n_steps / options.steps if options.steps else 0.0)
        if spent >= 1.0:
            return learner.policy
        learner.learn(learner.play(), 1.0 - spent)
        rounds += 1
        if rounds % 5 == 0 and learner.ended:
            rewards, successes = np.array(learner.ended[-50:]).T
            minutes = (time.monotonic() - began) / 60.0
            print(
                f"{learner.n_steps:7d}  {minutes:8.1f}  {len(learner.ended):8d}"
                f"  {rewards.mean():6.2f}  {100.0 * successes.mean():5.0f} %"
                f"  {learner.policy.log_noise.exp().mean().item():.2f}",
                flush=True,
            )
            learner.policy.save(options.out)


def evaluate(policy: Policy, options: argparse.Namespace) -> int:
    """Return in how many new episodes the policy succeeds without noise."""
    env, n = gymnasium.make(options.task, obs="state"), 0
    for i in range(options.evaluate):
        (seen, _), ended = env.reset(seed=10_000_000 + i), False
        while not ended:
            rows = {name: each[None] for name, each in seen.items()}
            with torch.no_grad():
                given = policy.scaled(from_tip(rows, env.observation_space))
                action = policy.actor(given)[0].clamp(-1.0, 1.0).numpy()
            seen, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
        n += info["is_success"]
    return n


def wilson(n: int, of: int) -> tuple[float, float]:
    """Return the interval in which a rate is at 95 % (Wilson 1927)."""
    z = 1.96
    middle, half = n + z * z / 2, z * math.sqrt(n * (of - n) / of + z * z / 4)
    return (middle - half) / (of + z * z), (middle + half) / (of + z * z)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--task", default="scalpel_sim/Incise-v0")
    parser.add_argument("--minutes", type=float, default=30.0, help="of training, at most")
    parser.add_argument("--steps", type=int, help="control steps of training, at most")
    parser.add_argument("--envs", type=int, default=8, help="environments")
    parser.add_argument("--round", type=int, default=1024, help="control steps of a round")
    parser.add_argument("--evaluate", type=int, default=50, help="episodes")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("ppo.pt"))
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    torch.set_num_threads(1)
    policy = train(options)
    policy.save(options.out)
    n = evaluate(policy, options)
    low, high = wilson(n, options.evaluate)
    print(f"{n} of {options.evaluate} episodes succeed: {100 * low:.0f} to {100 * high:.0f} %")


if __name__ == "__main__":
    main()
