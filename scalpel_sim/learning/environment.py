"""`TissueEnv`: a task of a scene as an environment of Gymnasium."""

from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict

from scalpel_sim.camera.camera import Camera, image_size
from scalpel_sim.camera.viewpoints import expect_camera
from scalpel_sim.errors import UsageError
from scalpel_sim.learning.episode import Episode, Outcome
from scalpel_sim.learning.episode_state import EpisodeState
from scalpel_sim.learning.images import ImageTaker
from scalpel_sim.learning.live_page import LivePage
from scalpel_sim.scene.scene import Scene
from tissue import FloatArray

OBSERVED_FORMS = ("state", "flat", "images", "all")
"""Forms of an observation: arrays by name, all numbers in one row, images, or both."""

HUMAN = "human"
"""Way to render that opens the live page, and goes no faster than simulated time."""

RENDER_MODES = ("rgb_array", "depth_array", "rgbd_tuple", HUMAN)
"""Ways to render."""

RESET_OPTIONS = ("variation", "state")
"""Options of `reset`."""

ObservedArrays = dict[str, np.ndarray] | FloatArray
"""An observation."""


class TissueEnv(gymnasium.Env[Any, Any]):
    """A task of a scene as an environment of Gymnasium.

    An action moves and turns the hands that `[act]` names; each number is within plus or minus 1.
    What is seen is said by `[observe]`, what is paid by `[task.reward]`, and what differs from
    episode to episode by `[[vary]]`: see `docs/learning.md`.

    Args:
        scene: A scene with a task: its name, a TOML file, or the scene itself.
        obs: One of `OBSERVED_FORMS`.
        arm: `kinematic` or `full`; None: what `[act]` says.
        render_mode: One of `RENDER_MODES`, or None.
        camera: Camera that renders: see `scalpel_sim.Camera`. None: the first view.
        width: Width of rendered images [pixels].
        height: Height of rendered images [pixels].

    Raises:
        UsageError: there is no such scene or camera, it has no task, or an argument has no such
            value.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  # as the base class has it
        "render_modes": list(RENDER_MODES),
        "render_fps": 50,
    }

    def __init__(
        self,
        scene: str | Path | Scene,
        obs: str = "state",
        arm: str | None = None,
        render_mode: str | None = None,
        *,
        camera: str | None = None,
        width: int = 480,
        height: int = 360,
    ) -> None:
        if obs not in OBSERVED_FORMS:
            raise UsageError(f"obs is '{obs}'; it must be one of {', '.join(OBSERVED_FORMS)}")
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise UsageError(
                f"render_mode is '{render_mode}'; it must be one of {', '.join(RENDER_MODES)}"
            )
        self.episode = Episode(scene, arm)
        """The task itself, with its simulation."""
        self.render_mode = render_mode
        self.metadata = self.metadata | {
            "render_fps": round(1.0 / self.episode.act_table.step),
        }
        self._obs = obs
        self._images = ImageTaker(self.episode) if obs in ("images", "all") else None
        if camera is not None:
            simulation = self.episode.simulation
            expect_camera(camera, self.episode.scene.views, simulation.arm.model)
        self._rendered = (camera, *image_size(width, height))
        self._camera: Camera | None = None
        self._page: LivePage | None = None
        n = len(self.episode.action_names)
        self.action_space = Box(-1.0, 1.0, (n,), np.float32)
        self.observation_space = self._space()

    def _space(self) -> gymnasium.Space[Any]:
        """Return the space of observations."""
        shapes = self.episode.shapes
        rows = {name: (each.low.ravel(), each.high.ravel()) for name, each in shapes.items()}
        if self._obs == "flat":
            low, high = (np.concatenate(ends) for ends in zip(*rows.values(), strict=True))
            return Box(low.astype(np.float32), high.astype(np.float32))
        spaces: dict[str, gymnasium.Space[Any]] = {}
        if self._obs in ("state", "all"):
            spaces = {
                name: Box(low.astype(np.float32), high.astype(np.float32))
                for name, (low, high) in rows.items()
            }
        if self._images is not None:
            spaces |= {
                name: Box(each.low, each.high, each.shape, each.kind)
                for name, each in self._images.shapes.items()
            }
        return Dict(spaces)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ObservedArrays, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Seed of all that is random; None: as before.
            options: `variation`: numbers of `[[vary]]` by name, as `info["variation"]` has had
                them, in place of those that are drawn. Or `state`: bytes of `save_state` at which
                the episode begins. What is random then goes on as it did, unless there is a seed.

        Raises:
            UsageError: there is no such option, or a number is missing, unknown or out of range.
            StateError: the state is of another task, or no state.
        """
        given = options_by_name(options)
        variation, state = (given.pop(name, None) for name in RESET_OPTIONS)
        if given:
            name = next(iter(given))
            raise UsageError(f"reset has no option '{name}'; it has variation and state")
        if state is not None and variation is not None:
            raise UsageError("reset has a state and a variation: a state has its own")
        super().reset(seed=seed)
        if state is None:
            self.episode.reset(self.np_random, variation)
        elif seed is None:
            self.episode.load_state(EpisodeState.from_bytes(state))
            self.np_random = self.episode.rng
        else:
            self.episode.load_state(EpisodeState.from_bytes(state), self.np_random)
        if self._images is not None:
            self._images.begin()
        if self.render_mode == HUMAN:
            self._live_page()
        return self._observed(), self._info(None)

    def step(
        self, action: FloatArray
    ) -> tuple[ObservedArrays, SupportsFloat, bool, bool, dict[str, Any]]:
        """Do an action over a control step; see `Episode.act`."""
        outcome = self.episode.act(action)
        if self.render_mode == HUMAN:
            self._live_page().wait(self.episode.act_table.step)
        observed, info = self._observed(), self._info(outcome)
        return observed, outcome.reward, outcome.terminated, outcome.truncated, info

    def save_state(self) -> bytes:
        """Return the episode as it is now, for `reset(options={"state": ...})`.

        Raises:
            StateError: its simulation has failed.
        """
        return self.episode.save_state().to_bytes()

    def _observed(self) -> ObservedArrays:
        """Return the observation after the last control step."""
        if self._obs == "flat":
            return np.concatenate([each.ravel() for each in self.episode.observation.values()])
        found: dict[str, np.ndarray] = {}
        if self._obs in ("state", "all"):
            found = {name: each.ravel() for name, each in self.episode.observation.items()}
        if self._images is not None:
            found |= self._images.take()
        return found

    def _info(self, outcome: Outcome | None) -> dict[str, Any]:
        """Return what is known besides."""
        episode = self.episode
        info: dict[str, Any] = {
            "is_success": episode.is_success,
            "score": episode.terms,
        }
        if outcome is None:
            info["variation"] = dict(episode.drawn)
        elif outcome.failed:
            info["failed"] = list(outcome.failed)
        if outcome is not None and outcome.fault is not None:
            info["fault"] = outcome.fault
        return info

    def render(self) -> Any:
        """Return a picture of the present, as `render_mode` says; None where it shows a page."""
        if self.render_mode in (None, HUMAN):
            return None
        if self._camera is None:
            name, width, height = self._rendered
            self._camera = Camera(self.episode.simulation, name, width=width, height=height)
        if self.render_mode == "rgb_array":
            return self._camera.rgb()
        if self.render_mode == "depth_array":
            return self._camera.depth()
        rgb, depth, _ = self._camera.image()
        return rgb, depth

    def close(self) -> None:
        """Free what OpenGL holds, and end the page."""
        for each in (self._camera, self._images, self._page):
            if each is not None:
                each.close()
        self._camera = self._page = None

    @property
    def page_url(self) -> str | None:
        """Address of the live page; None: none is open."""
        return None if self._page is None else self._page.url

    def _live_page(self) -> LivePage:
        """Return the page, which opens now if it has not yet."""
        if self._page is None:
            self._page = LivePage(self.episode.simulation)
        return self._page


def options_by_name(options: dict[str, Any] | None) -> dict[str, Any]:
    """Return a copy of the options of `reset`.

    Raises:
        UsageError: they are not by name.
    """
    if options is not None and not isinstance(options, dict):
        raise UsageError(f"options of reset are {options!r}; they are a dict, by their names")
    return dict(options or {})
