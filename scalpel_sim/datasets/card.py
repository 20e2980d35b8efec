"""`README.md` of a dataset, which hubs show as its card, and where its episodes come from."""

import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any, NamedTuple

from scalpel_sim.datasets.demonstration import DatasetLayout
from scalpel_sim.version import version

CARD, PROVENANCE = "README.md", "provenance.json"
"""Names of the files."""

LICENCE = "cc-by-4.0"
"""Licence of a dataset where none is chosen, as hubs write it: use it as you like, and name its
author."""


class Card(NamedTuple):
    """Contents of the card besides those that the episodes have themselves."""

    title: str
    """Heading."""
    form: str
    """Name of the format."""
    licence: str
    """Licence, as hubs write it."""
    renderer: str | None
    """Name of the renderer that drew the images; None: there are none."""
    layout: DatasetLayout
    """Contents of each control step."""


def write_card(folder: Path, card: Card, episodes: Sequence[Mapping[str, Any]]) -> None:
    """Write `README.md` and `provenance.json`.

    Args:
        folder: Folder of the dataset.
        card: What they say.
        episodes: Where each episode comes from, and how it ended.
    """
    told = {
        "program": {"scalpel-sim": version(), "mujoco": version_of("mujoco")},
        "python": platform.python_version(),
        "platform": platform.platform(),
        "format": card.form,
        "licence": card.licence,
        "renderer": card.renderer,
        "fps": card.layout.fps,
        "observations": {each.name: list(each.shape) for each in card.layout.observations},
        "images": {name: list(size) for name, size in card.layout.images.items()},
        "actions": list(card.layout.action.names or ()),
        "episodes": list(episodes),
    }
    text = json.dumps(told, indent=2, allow_nan=False)
    (folder / PROVENANCE).write_text(f"{text}\n", encoding="utf-8")
    (folder / CARD).write_text(_text(card, episodes), encoding="utf-8")


def _text(card: Card, episodes: Sequence[Mapping[str, Any]]) -> str:
    """Return the text of the card."""
    layout = card.layout
    steps = sum(each["steps"] for each in episodes)
    done = sum(bool(each["success"]) for each in episodes)
    scenes = sorted({each["scene"] for each in episodes})
    tasks = list(dict.fromkeys(each["task"] for each in episodes))
    images = [f"- `{name}`: {width} x {height} pixels" for name, (height, width) in _sizes(layout)]
    lines = [
        "---",
        f"license: {card.licence}",
        "task_categories:",
        "- robotics",
        "tags:",
        *(f"- {tag}" for tag in _tags(card)),
        "configs:",
        "- config_name: default",
        "  data_files: data/*/*.parquet",
        "---",
        "",
        f"# {card.title}",
        "",
        "Demonstrations of surgery on soft tissue that is cut, simulated by scalpel_sim "
        f"{version()}. A demonstration is a scene and the poses of the hands; all else was "
        "computed by doing it again.",
        "",
        "| | |",
        "|---|---|",
        f"| Episodes | {len(episodes)}, {done} of which succeed |",
        f"| Control steps | {steps}, {layout.fps} a second, {steps / layout.fps:.1f} s |",
        f"| Scenes | {', '.join(scenes)} |",
        f"| Arm | {layout.robot} |",
        f"| Format | {card.form} |",
        f"| Licence | {card.licence} |",
        f"| Images by | {card.renderer or 'no images'} |",
        "",
        "## Tasks",
        "",
        *(f"- {task}" for task in tasks),
        "",
        "## Observations",
        "",
        *(f"- `{each.name}`: {_shape(each.shape)}" for each in layout.observations),
        *images,
        "",
        "Metres, newtons, seconds and radians; the frame is that of the tissue. An action is how "
        "far each hand moves and turns in a control step, as a share of what its limits permit: "
        f"{', '.join(f'`{name}`' for name in layout.action.names or ())}.",
        "",
        "## Limits",
        "",
        "The tissue is a model, and no patient. Its figures are those of the literature where a "
        "preset names it, and the scene's own where it does not; what a policy learns here is not "
        "shown to work on tissue. `provenance.json` has of each episode the scene with its hash, "
        "the score, and whether it was done again to the bit.",
        "",
    ]
    return "\n".join(lines)


def _sizes(layout: DatasetLayout) -> list[tuple[str, tuple[int, int]]]:
    """Return the size of the images of each camera."""
    return list(layout.images.items())


def _tags(card: Card) -> list[str]:
    """Return the words by which it is found."""
    form = "LeRobot" if card.form.startswith("LeRobot") else "robomimic"
    return [form, "surgery", "soft-tissue", "cutting", "simulation"]


def _shape(shape: tuple[int, ...]) -> str:
    """Return the shape of an array in words."""
    return " x ".join(map(str, shape)) + (" numbers" if shape != (1,) else " number")
