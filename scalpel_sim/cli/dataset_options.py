"""The options of the command `dataset`, in the groups that `--help` shows."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from scalpel_sim.cli.camera_options import CAMERA
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.options import OUTPUT, Flag

_EXPERT = Group("Expert", sort_key=5)


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class DatasetFiles:
    """The folder of a dataset, its format, and what its card says."""

    output: Annotated[Path, Parameter(name=["--output", "-o"])]
    "Folder of the dataset, which must be new. It appears when it is whole."
    form: Annotated[Literal["lerobot", "robomimic"], Parameter(name="--format")] = "lerobot"
    "lerobot, version 3.0 of its format; or robomimic, a file of HDF5."
    task: str | None = None
    "The task in words, for policies that read them [default: what the scene is about]."
    licence: Annotated[str, Parameter(name=["--licence", "--license"])] = "cc-by-4.0"
    "Licence of the dataset, as hubs write it."


@Parameter(name="*", group=CAMERA)
@dataclass(frozen=True)
class TakenOptions:
    """The images of a dataset, and how often they are taken."""

    cameras: Annotated[tuple[str, ...] | None, Parameter(consume_multiple=True, negative="")] = None
    """Cameras, each with the size of its images: NAME:WIDTHxHEIGHT; none: no images [default:
    those of `[observe]` of the scene]."""
    fps: int | None = None
    "Control steps a second [default: as `[act]` has them, 50]."
    video: Flag = False
    """Write the images as videos, by the ffmpeg on the PATH: smaller, and not without loss. For
    lerobot alone."""


@Parameter(name="*", group=_EXPERT)
@dataclass(frozen=True)
class ExpertOptions:
    """The demonstrations of experts of tasks."""

    episodes: int | None = None
    "Number of episodes of each expert [default: 1]."
    seed: int | None = None
    "Seed of the first of them; each later one has the next number [default: 0]."

    @property
    def seeds(self) -> range:
        """Seeds of all of them."""
        first = self.seed or 0
        return range(first, first + (1 if self.episodes is None else self.episodes))

    def check(self, *, has_expert: bool) -> None:
        """Refuse options where there is no expert, and numbers that they cannot have.

        Args:
            has_expert: Whether there is one.

        Raises:
            UsageError: there is one of these.
        """
        for name, value, least in (("episodes", self.episodes, 1), ("seed", self.seed, 0)):
            if value is not None and not has_expert:
                raise UsageError(f"--{name} is about experts of tasks, and no task is given")
            if value is not None and value < least:
                raise UsageError(f"--{name} is {value}; it must be at least {least}")
