"""Clone the expert of a task: learn to do what it did from what is seen, state or images.

    python clone.py --task scalpel_sim/Incise-v0 --episodes 200
    python clone.py --episodes 200 --obs images
    python clone.py --watch clone.pt

The last line shows in the live page what was learnt.
To install: pip install "scalpel-sim[examples]"
"""

import argparse
import contextlib
import math
import time
from pathlib import Path

import gymnasium
import numpy as np
import torch
from torch import nn

from scalpel_sim.learning import Expert

with contextlib.suppress(ImportError):
    # An optimiser loads it. Where Mesa, which draws without a graphics card, is loaded before, two
    # versions of LLVM meet and the process dies.
    import triton  # noqa: F401

PIXELS = 64
"""Width and height at which a policy looks at images."""

BATCH = 128
"""Steps of demonstrations that are learnt from at once."""

N_LOOKED, TELLS = 64, 0.3
"""Numbers that an eye makes of images, and weight of its errors about what they show."""

OF_TISSUE = ("target", "depth", "points")
"""Beginnings of the names of what no arm knows."""


def numbers(seen: dict[str, np.ndarray], obs: str) -> np.ndarray:
    """Return the numbers that the policy is shown, in one row.

    Of the state all, the plan as it lies from the tip; beside images what an arm knows of itself.
    """
    rows = {name: each for name, each in seen.items() if each.ndim == 1}
    if obs == "images":
        rows = {name: each for name, each in rows.items() if not name.startswith(OF_TISSUE)}
    if "target" in rows and "blade" in rows:
        places = rows["target"].reshape(-1, 4).copy()
        places[:, :3] -= rows["blade"][:3]
        rows["target"] = places.ravel()
    return np.concatenate(list(rows.values()))


def hidden(seen: dict[str, np.ndarray]) -> np.ndarray:
    """Return what a policy that is shown images is to make out in them, in one row."""
    rows = [each for name, each in seen.items() if name.startswith(OF_TISSUE)]
    return np.concatenate(rows) if rows else np.zeros(0, np.float32)


def image(seen: dict[str, np.ndarray]) -> np.ndarray:
    """Return the colours of all cameras, one above the other, shape (3 n, PIXELS, PIXELS)."""
    found = []
    for name in sorted(name for name in seen if name.endswith("_rgb")):
        rgb = torch.from_numpy(seen[name].copy()).permute(2, 0, 1).float()
        found.append(nn.functional.adaptive_avg_pool2d(rgb, PIXELS).byte())
    return torch.cat(found).numpy()


class Policy(nn.Module):
    """A policy of two hidden layers; images go through three layers of convolution before."""

    def __init__(self, n_seen: int, n_actions: int, channels: int = 0) -> None:
        super().__init__()
        self.sizes = (n_seen, n_actions, channels)
        self.register_buffer("mean", torch.zeros(n_seen))
        self.register_buffer("scale", torch.ones(n_seen))
        n_of_image = N_LOOKED if channels else 0
        self.look = nn.Sequential(
            nn.Conv2d(max(channels, 1), 16, 5, 2, 2), nn.ReLU(),
            nn.Conv2d(16, 32, 3, 2, 1), nn.ReLU(),
            nn.Conv2d(32, 32, 3, 2, 1), nn.ReLU(),
            nn.Flatten(), nn.Linear(32 * (PIXELS // 8) ** 2, N_LOOKED), nn.ReLU(),
        )  # fmt: skip
        self.act = nn.Sequential(
            nn.Linear(n_seen + n_of_image, 256), nn.ReLU(),
            nn.Linear(256, 256), nn.ReLU(),
            nn.Linear(256, n_actions),
        )  # fmt: skip

    def forward(self, seen: torch.Tensor, images: torch.Tensor | None = None) -> torch.Tensor:
        return self.acted(seen, None if images is None else self.look(images.float() / 255.0))

    def acted(self, seen: torch.Tensor, looked: torch.Tensor | None) -> torch.Tensor:
        """Return the actions where images were looked at so."""
        given = (seen - self.mean) / self.scale
        return self.act(given if looked is None else torch.cat([given, looked], dim=1))


class Shown:
    """Observations of each step, and the actions of the expert there."""

    def __init__(self, obs: str) -> None:
        self.obs = obs
        self.seen: list[np.ndarray] = []
        self.images: list[np.ndarray] = []
        self.hidden: list[np.ndarray] = []
        self.actions: list[np.ndarray] = []

    def add(self, seen: dict[str, np.ndarray], action: np.ndarray) -> None:
        self.seen.append(numbers(seen, self.obs))
        if self.obs == "images":
            self.images.append(image(seen))
            self.hidden.append(hidden(seen))
        self.actions.append(action)

    def extend(self, other: "Shown") -> None:
        for name in ("seen", "images", "hidden", "actions"):
            getattr(self, name).extend(getattr(other, name))


def demonstrate(env: gymnasium.Env, options: argparse.Namespace) -> Shown:
    """Return successful episodes of the expert, whose hand trembles: it shows how to mend that."""
    shown, n, n_tried = Shown(options.obs), 0, 0
    tremble = np.random.default_rng(options.seed)
    while n < options.episodes and n_tried < 2 * options.episodes:
        seen, _ = env.reset(seed=1_000_000 * options.seed + n_tried)
        n_tried += 1
        expert, episode, ended = Expert(env.unwrapped.episode), Shown(options.obs), False
        while not ended:
            action = expert.action()
            episode.add(seen, action)
            done = action + options.tremble * tremble.standard_normal(len(action))
            seen, _, terminated, truncated, info = env.step(done)
            ended = terminated or truncated
        if info["is_success"]:
            shown.extend(episode)
            n += 1
    print(f"{n} of {n_tried} demonstrations succeed, {len(shown.seen)} steps", flush=True)
    return shown


def learn(policy: Policy, shown: Shown, options: argparse.Namespace) -> None:
    """Fit a policy to what was shown, and print the learning curve.

    Beside its actions the eye of a policy learns to tell what images show of the plan and the
    depth: the simulation knows that of each demonstration, and no policy is given it later.
    """
    seen = torch.from_numpy(np.array(shown.seen, np.float32))
    actions = torch.from_numpy(np.array(shown.actions, np.float32))
    images = torch.from_numpy(np.array(shown.images)) if shown.images else None
    policy.mean.copy_(seen.mean(0))
    policy.scale.copy_(seen.std(0) + 1e-3)
    schedules, parameters = torch.optim.lr_scheduler, list(policy.parameters())
    if images is None:
        optimizer = torch.optim.Adam(parameters, lr=1e-3)
        slower = schedules.CosineAnnealingLR(optimizer, options.steps)
    else:
        told = torch.from_numpy(np.array(shown.hidden, np.float32))
        told = (told - told.mean(0)) / (told.std(0) + 1e-4)
        teller = nn.Linear(N_LOOKED, told.shape[1])
        optimizer = torch.optim.Adam([*parameters, *teller.parameters()])
        slower = schedules.OneCycleLR(optimizer, 2e-3, options.steps)
    order = torch.Generator().manual_seed(options.seed)
    every, total = max(options.steps // 10, 1), 0.0
    for step in range(1, options.steps + 1):
        some = torch.randint(len(seen), (BATCH,), generator=order)
        looked = None if images is None else policy.look(images[some].float() / 255.0)
        error = nn.functional.mse_loss(policy.acted(seen[some], looked), actions[some])
        loss = error
        if looked is not None and told.shape[1]:
            loss = error + TELLS * nn.functional.mse_loss(teller(looked), told[some])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        slower.step()
        total += error.item()
        if step % every == 0:
            print(f"step {step}: error of an action {(total / every) ** 0.5:.4f}", flush=True)
            total = 0.0


def cloned(env: gymnasium.Env, options: argparse.Namespace) -> Policy:
    """Return a policy that has learnt from demonstrations; it is saved."""
    began = time.process_time()
    shown = demonstrate(env, options)
    channels = len(shown.images[0]) if shown.images else 0
    policy = Policy(len(shown.seen[0]), len(shown.actions[0]), channels)
    shown_after = time.process_time()
    learn(policy, shown, options)
    learnt_after = time.process_time()
    torch.save({"sizes": policy.sizes, "policy": policy.state_dict()}, options.out)
    seconds = shown_after - began, learnt_after - shown_after
    print(f"CPU: {seconds[0]:.0f} s to demonstrate, {seconds[1]:.0f} s to learn", flush=True)
    return policy


def evaluate(policy: Policy, env: gymnasium.Env, options: argparse.Namespace) -> int:
    """Return in how many episodes that were not shown the policy succeeds."""
    n = 0
    for i in range(options.evaluate):
        (seen, _), ended = env.reset(seed=10_000_000 + i), False
        while not ended:
            with torch.no_grad():
                given = torch.from_numpy(numbers(seen, options.obs).astype(np.float32))[None]
                images = torch.from_numpy(image(seen))[None] if options.obs == "images" else None
                action = policy(given, images)[0].numpy()
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
    parser.add_argument("--obs", choices=("state", "images"), default="state")
    parser.add_argument("--episodes", type=int, default=200, help="demonstrations")
    parser.add_argument("--tremble", type=float, default=0.2, help="noise of the expert's hand")
    parser.add_argument("--steps", type=int, default=10_000, help="steps of training")
    parser.add_argument("--evaluate", type=int, default=50, help="episodes")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("clone.pt"))
    parser.add_argument("--watch", type=Path, help="policy to show in the live page")
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    torch.set_num_threads(1)
    obs, render_mode = "all" if options.obs == "images" else "state", None
    if options.watch:
        render_mode = "human"
    env = gymnasium.make(options.task, obs=obs, render_mode=render_mode)
    if options.watch:
        saved = torch.load(options.watch)
        policy = Policy(*saved["sizes"])
        policy.load_state_dict(saved["policy"])
    else:
        policy = cloned(env, options)
    n = evaluate(policy, env, options)
    low, high = wilson(n, options.evaluate)
    print(f"{n} of {options.evaluate} episodes succeed: {100 * low:.0f} to {100 * high:.0f} %")


if __name__ == "__main__":
    main()
