"""The options of commands that take images: which camera, and how large."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from scalpel_sim.errors import UsageError
from scalpel_sim.runs.options import OUTPUT, Flag

CAMERA = Group("Camera", sort_key=6)


@Parameter(name="*", group=CAMERA)
@dataclass(frozen=True)
class CameraOptions:
    """A camera, and its images."""

    camera: str | None = None
    """A [[view]] of the scene, a camera of the arm's model, or overview or endoscope, which are
    always there [default: the first view, or overview]."""
    width: int = 640
    "Width of the image [pixels]."
    height: int = 480
    "Height of the image [pixels]."
    shadows: Flag = False
    "Draw shadows."
    samples: int = 4
    "Samples of each pixel, against jagged edges; 0: one."


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class ImageOptions:
    """The files of an image."""

    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("snapshot.png")
    "File for the colours, .png or .npy."
    depth: Path | None = None
    """Write the depth too: .png has 16 bits in steps of 0.1 mm, and 0 where nothing is; .npy has
    metres."""
    segmentation: Path | None = None
    """Write the number of what each pixel shows, too: .png has the numbers, in colours, and the
    table of names as its text "ids"; .npy has the numbers."""

    @property
    def files(self) -> dict[str, Path]:
        """The files that are wanted, by option."""
        given = {"output": self.output, "depth": self.depth, "segmentation": self.segmentation}
        return {option: path for option, path in given.items() if path is not None}


@Parameter(name="*", group=CAMERA)
@dataclass(frozen=True)
class FilmOptions:
    """The pace of a film, and what is beside it."""

    fps: float = 25.0
    "Pictures in a second of film."
    slow: float = 1.0
    "Slow motion: the film takes so many times as long as what it shows."
    plot: Flag = False
    "Plot force and cut area beside the pictures."

    def check(self) -> None:
        """Refuse a pace that no film has.

        Raises:
            UsageError: it is beyond its bounds.
        """
        for option, value, (least, most) in (
            ("--fps", self.fps, (1.0, 120.0)),
            ("--slow", self.slow, (0.01, 1000.0)),
        ):
            if not least <= value <= most:
                raise UsageError(f"{option} is {value:g}; it must be from {least:g} to {most:g}")
