"""Random episodes of a task: actions that hurt, states at any moment, variations at their ends."""

import gc
import math
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.learning import Expert, TissueEnv
from tests.long.child import memory_of_this_process
from tissue import FloatArray

Policy = Callable[[], FloatArray]
"""Returns the next action."""

SHARES = ("covered", "spared", "removed", "exposed", "held")
"""Terms from 0 to 1, or the ends of their names."""

ROUNDING = 1e-9
"""Share by which a term may pass its range: sums of areas and solid angles round."""

MOST_SHORT = 60
"""Control steps of an episode at most; one of twenty goes on to its end."""

MOST_STEPS = 400
"""Control steps of one that goes on at most."""

_LONGEST_FAULT = 60
"""Characters of a fault by which it is counted."""

N_REPEATED = 8
"""Control steps that are repeated from a state at most."""


class Round(NamedTuple):
    """Memory and objects of a process after a round of episodes."""

    memory: int
    """Memory in use [byte]."""
    objects: int
    """Objects that Python watches."""


def noise(env: TissueEnv, rng: np.random.Generator) -> Policy:
    """Return even noise."""
    return lambda: rng.uniform(-1.0, 1.0, len(env.episode.action_names))


def steady(env: TissueEnv, rng: np.random.Generator) -> Policy:
    """Return full speed, always the same way."""
    action = rng.choice([-1.0, 1.0], len(env.episode.action_names))
    return lambda: action


def bang_bang(env: TissueEnv, rng: np.random.Generator) -> Policy:
    """Return full speed, the ways of which change now and then."""
    action, often = rng.choice([-1.0, 1.0], len(env.episode.action_names)), rng.uniform(0.05, 0.6)

    def act() -> FloatArray:
        action[rng.random(len(action)) < often] *= -1.0
        return action

    return act


def homing(env: TissueEnv, rng: np.random.Generator) -> Policy:
    """Return full speed into the body or into the other hand; the jaws open and close fast."""
    episode = env.episode
    body = episode.simulation.link.snapshot().positions
    aim, turn = body[rng.integers(len(body))], rng.choice([-1.0, 0.0, 1.0], 3)
    meets, period = rng.random() < 0.4, int(rng.integers(1, 4))

    def act() -> FloatArray:
        hands, parts = list(episode.hand.led.values()), list[float]()
        for i, hand in enumerate(hands):
            other = hands[1 - i].pose.middle if len(hands) == 2 and meets else aim
            way = other - hand.pose.middle
            if episode.act_table.frame == "tool":
                way = hand.axes @ way
            parts += (way / max(float(np.abs(way).max()), 1e-9)).tolist() + turn.tolist()
            if hand is not episode.hand.blade:
                parts.append(-1.0 if episode.n_steps // period % 2 else 1.0)
        return np.array(parts)

    return act


def astray(env: TissueEnv, rng: np.random.Generator) -> Policy:
    """Return the expert's actions up to a random step, and then one of the others."""
    until, script = int(rng.integers(10, 120)), Expert(env.episode)
    then: list[Policy] = []

    def act() -> FloatArray:
        if env.episode.n_steps < until:
            return script.action()
        if not then:
            then.append(POLICIES[int(rng.integers(len(POLICIES) - 1))](env, rng))
        return then[0]()

    return act


POLICIES = (noise, steady, bang_bang, homing, astray)
"""Policies; the last one becomes one of the others."""


def play(env: TissueEnv, case: int, tally: Counter[str] | None = None) -> None:
    """Do the random episode of a number, and check all that comes of it.

    Raises:
        AssertionError: what is shown, paid or told is not as it is to be.
    """
    tally = Counter() if tally is None else tally
    rng = np.random.default_rng(case)
    observed, info = env.reset(seed=case, options=_options(env, rng))
    _expect_sane(env, observed, 0.0, info)
    policy = POLICIES[int(rng.integers(len(POLICIES)))]
    act, saved, actions = policy(env, rng), None, list[FloatArray]()
    whole = rng.random() < 0.05
    n_steps = MOST_STEPS if whole else int(rng.integers(5, MOST_SHORT + 150 * (policy is astray)))
    save_at = int(rng.integers(n_steps))
    after: list[Any] = []
    for i in range(n_steps):
        if i == save_at:
            saved = env.save_state()
        action = np.clip(act(), -1.0, 1.0).astype(np.float32)
        done = env.step(action)
        _expect_sane(env, *done)
        if saved is not None and len(actions) < N_REPEATED:
            actions.append(action.copy())
            after.append(_plain(done))
        tally["steps"] += 1
        if done[2] or done[3]:
            fault = done[4].get("fault")
            how = (
                f"fault: {fault[:_LONGEST_FAULT]}" if fault else "terminated" if done[2] else "late"
            )
            tally[how] += 1
            break
    tally["episodes"] += 1
    tally[f"{policy.__name__} cut [mm2]"] += round(1e6 * env.episode.terms["cut_area"])
    if saved is not None and rng.random() < 0.5:
        tally["states"] += 1
        env.reset(options={"state": saved})
        assert [_plain(env.step(action)) for action in actions] == after


def _options(env: TissueEnv, rng: np.random.Generator) -> dict[str, Any] | None:
    """Return a variation within its range or at its ends, or none."""
    kind = int(rng.integers(4))
    rows = env.episode.scene.vary
    if kind == 0 or not rows:
        return None
    shares = rng.random(len(rows)) if kind == 1 else rng.integers(0, 2, len(rows))
    ends = [(row.name, *row.range) for row in rows]
    return {
        "variation": {
            name: low if share == 0 else high if share == 1 else low + float(share) * (high - low)
            for share, (name, low, high) in zip(shares, ends, strict=True)
        }
    }


def _expect_sane(env: TissueEnv, observed: Any, reward: Any, *rest: Any) -> None:
    """Check an observation, a reward, flags and what is known besides."""
    *ends, info = rest
    assert env.observation_space.contains(observed), observed
    assert all(array.dtype == np.float32 for array in observed.values())
    assert isinstance(reward, float) and math.isfinite(reward)
    assert all(type(end) is bool for end in ends)
    assert "fault" not in info or ends == [False, True], info
    for name, value in info["score"].items():
        most = 1.0 + ROUNDING if name.rpartition("_")[2] in SHARES else math.inf
        least = -math.inf if name == "work" else 0.0  # tissue that recoils pushes the blade
        assert math.isfinite(value) and least <= value <= most, (name, value)
    assert info["score"]["pieces"] >= 1.0


def _plain(done: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a step as what can be compared to the bit."""
    observed, reward, terminated, truncated, info = done
    arrays = [array.tobytes() for array in observed.values()]
    return (*arrays, reward, terminated, truncated, str(info))


def rounds(first: int, task: str, n_episodes: int, n_rounds: int) -> list[Round]:
    """Return what this process has after each round of the same episodes.

    Args:
        first: Number of the first episode of a round.
        task: Name of the task.
        n_episodes: Episodes of a round.
        n_rounds: Rounds.
    """
    env, found = TissueEnv(task), list[Round]()
    for _ in range(n_rounds):
        for case in range(first, first + n_episodes):
            play(env, case)
        found.append(Round(memory_of_this_process(), len(gc.get_objects())))
    return found
