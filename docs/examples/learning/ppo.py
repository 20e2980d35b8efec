"""Learn a task by trial and error, from state: proximal policy optimisation in one file.

    python ppo.py --task scalpel_sim/Incise-v0 --minutes 30
    python ppo.py --demonstrations 30 --minutes 30

The second line begins with a clone of the expert, and goes on by trial and error from there.
After Schulman et al. 2017 (arXiv:1707.06347), with advantages of Schulman et al. 2016.
To install: pip install "scalpel-sim[examples]"
"""

import argparse
import math
import time
from collections.abc import Iterable
from pathlib import Path

import gymnasium
import numpy as np
import torch
from torch import nn

from scalpel_sim.learning import Expert

N_EPOCHS, N_BATCHES = 10, 8
"""Times that the steps of a round are learnt from, and parts in which."""

DISCOUNT, SMOOTHING = 0.99, 0.95
"""Discount of a control step, and smoothing of advantages."""

CLIP, RATE = 0.2, 5e-4
"""Largest change of a ratio of probabilities that counts, and rate of learning at first."""

FARTHEST = 0.03
"""Distance of the new policy from the one that played, as a divergence, where a round ends."""

PAY = 0.1
"""Factor of rewards: returns are some tens, and a critic learns numbers of about 1."""

FIRST_NOISE, CLONE_NOISE = 0.3, 0.1
"""Standard deviation of the actions at first, and of those of a clone."""

N_ALONE = 5
"""Rounds in which only the critic of a clone learns: an actor would learn from its errors."""

N_AHEAD = 5
"""Places of the plan that are shown, from the next that is to be cut."""


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


def shown(rows: dict[str, np.ndarray], names: Iterable[str]) -> torch.Tensor:
    """Return what is seen in rows, as the blade would feel it: from its tip and in its axes.

    A policy then has to learn once what to do at each place of a line, and in each direction.
    """
    rows = {name: rows[name] for name in names}
    if "blade" in rows:
        blade = rows["blade"]
        axes = axes_of(blade[:, 3:7])
        up, speed, turn = axes[:, 2], *(along(blade[:, i : i + 3], axes) for i in (7, 10))
        rows["blade"] = np.concatenate([up, speed, turn], axis=1)
        if "target" in rows:
            places = rows["target"].reshape(len(blade), -1, 4)
            rows["target"] = ahead(places, blade[:, None, :3], axes)
    return torch.from_numpy(np.concatenate(list(rows.values()), axis=1)).float()


def ahead(places: np.ndarray, tip: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the next places of the plan from the tip, along the axes, and the share that is cut.

    Next is what follows the last place along the line that is cut.
    """
    is_cut, n = places[:, :, 3] > 0.5, places.shape[1]
    following = np.where(is_cut.any(axis=1), n - is_cut[:, ::-1].argmax(axis=1), 0)
    chosen = np.minimum(following[:, None] + np.arange(N_AHEAD), n - 1)
    ways = np.take_along_axis(places[:, :, :3], chosen[:, :, None], axis=1) - tip
    ways = np.einsum("nki,nij->nkj", ways, axes).reshape(len(places), -1)
    return np.concatenate([ways, places[:, :, 3].mean(axis=1, keepdims=True)], axis=1)


def axes_of(quaternions: np.ndarray) -> np.ndarray:
    """Return the axes of rotations (w, x, y, z) as columns, shape (n, 3, 3)."""
    w, v = quaternions[:, :1], quaternions[:, 1:]
    turned = [unit + 2.0 * np.cross(v, np.cross(v, unit) + w * unit) for unit in np.eye(3)[:, None]]
    return np.stack(turned, axis=2)


def along(vectors: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return vectors along axes."""
    return np.einsum("ni,nij->nj", vectors, axes)


def clone(policy: Policy, options: argparse.Namespace) -> None:
    """Fit a policy to what the expert does, whose hand trembles: it shows how to mend that."""
    env, seen, actions = gymnasium.make(options.task, obs="state"), [], []
    tremble = np.random.default_rng(options.seed)
    for i in range(options.demonstrations):
        (rows, _), ended = env.reset(seed=1_000_000 * (options.seed + 1) + i), False
        expert = Expert(env.unwrapped.episode)
        while not ended:
            action = expert.action()
            rows = {name: each[None] for name, each in rows.items()}
            seen.append(shown(rows, env.observation_space))
            actions.append(action)
            done = action + CLONE_NOISE * tremble.standard_normal(len(action))
            rows, _, terminated, truncated, _ = env.step(done)
            ended = terminated or truncated
    wanted = torch.tensor(np.array(actions)).float()
    policy.notice(torch.cat(seen))
    scaled = policy.scaled(torch.cat(seen))
    optimizer = torch.optim.Adam(policy.actor.parameters(), 1e-3)
    for _ in range(4000):
        some = torch.randint(len(scaled), (256,))
        loss = nn.functional.mse_loss(policy.actor(scaled[some]), wanted[some])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    nn.init.constant_(policy.log_noise, math.log(CLONE_NOISE))


class Learner:
    """Plays episodes in several environments at once, and learns from them.

    An environment that ends an episode begins the next one in the step after: that is left out.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.envs = gymnasium.make_vec(
            options.task, options.envs, obs="state", workers=options.workers
        )
        self.names = list(self.envs.single_observation_space)
        seen, _ = self.envs.reset(seed=options.seed)
        self.seen, self.begins = shown(seen, self.names), np.zeros(options.envs, bool)
        n_actions = self.envs.single_action_space.shape[0]
        self.policy = Policy(self.seen.shape[1], n_actions)
        self.n_alone = 0
        if options.demonstrations:
            clone(self.policy, options)
            self.n_alone = N_ALONE
        self.optimizer = torch.optim.Adam(self.policy.parameters(), RATE, eps=1e-5)
        self.n_steps = 0
        self.returns = np.zeros(options.envs)  # of the episodes that run
        self.ended: list[tuple[float, bool]] = []

    def play(self) -> list[torch.Tensor]:
        """Play a round; return what was seen and done, its log probability, gains and values."""
        rows, policy, round_steps = [], self.policy, self.options.round // self.options.envs
        self._notice()
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
            self.seen, self.begins = shown(seen, self.names), ended | late
            for i in np.flatnonzero(self.begins):
                self.ended.append((self.returns[i], bool(info["is_success"][i])))
                self.returns[i] = 0.0
            self._notice()
            with torch.no_grad():
                after = policy.critic(policy.scaled(self.seen))[:, 0]
            arrays = (PAY * reward, ended, self.begins, is_real)
            numbers = [torch.from_numpy(each) for each in arrays]
            rows.append((scaled, action, chance, value, after, *numbers))
        return self._with_advantages([torch.stack(each) for each in zip(*rows, strict=True)])

    def _notice(self) -> None:
        """Take what is seen into the scales; those of a clone stay as it has learnt with them."""
        if not self.options.demonstrations:
            self.policy.notice(self.seen)

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
        is_near = self.n_alone <= 0
        self.n_alone -= 1
        for _ in range(N_EPOCHS):
            for some in torch.randperm(len(rows[0])).chunk(N_BATCHES):
                scaled, action, chance, gains, wanted = (each[some] for each in rows)
                loss = 0.5 * ((policy.critic(scaled)[:, 0] - wanted) ** 2).mean()
                if is_near:
                    ratio = (policy.distribution(scaled).log_prob(action).sum(1) - chance).exp()
                    gains = (gains - gains.mean()) / (gains.std() + 1e-8)
                    held = ratio.clamp(1.0 - CLIP, 1.0 + CLIP)
                    loss = loss - torch.min(ratio * gains, held * gains).mean()
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(policy.parameters(), 0.5)
                self.optimizer.step()
            is_near = is_near and self._distance(rows) < FARTHEST

    def _distance(self, rows: list[torch.Tensor]) -> float:
        """Return the divergence of the policy from the one that played a round."""
        scaled, action, chance, *_ = rows
        with torch.no_grad():
            change = self.policy.distribution(scaled).log_prob(action).sum(1) - chance
        return (change.exp() - 1.0 - change).mean().item()


def train(options: argparse.Namespace) -> Policy:
    """Train, and print the learning curve."""
    learner, rounds = Learner(options), 0
    if options.demonstrations:
        print(f"the clone: {evaluate(learner.policy, options)} of {options.evaluate}", flush=True)
    began = time.monotonic()
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
                given = policy.scaled(shown(rows, env.observation_space))
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
    parser.add_argument("--workers", type=int, help="processes; one for each core without")
    parser.add_argument("--demonstrations", type=int, default=0, help="of the expert, at first")
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
