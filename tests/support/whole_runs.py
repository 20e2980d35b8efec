"""Whether the files of a run are whole, whatever ended it."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from scalpel_sim.recording.recording import read_forces
from tissue import read_mesh


def broken_files(folder: Path) -> list[str]:
    """Return what is wrong with the files of a run, one line each; some may be missing."""
    found = []
    for name, check in CHECKS.items():
        path = folder / name
        try:
            if path.exists():
                check(path)
        except Exception as error:
            found.append(f"{name}: {type(error).__name__}: {error}")
    return found


def _forces(path: Path) -> None:
    """Each frame has one row, in order, and only the last may be cut off by a kill."""
    rows = read_forces(path).rows
    assert np.array_equal(rows[:, 0], np.arange(len(rows)) * 1e-3)
    assert np.isfinite(rows[:, :20]).all()


def _picture(path: Path) -> None:
    with Image.open(path) as picture:
        picture.load()


def _page(path: Path) -> None:
    assert path.read_text().rstrip().endswith("</html>")


def _json(path: Path) -> None:
    assert json.loads(path.read_text())["frames"] >= 0


CHECKS: dict[str, Callable[[Path], object]] = {
    "initial.vtu": read_mesh,
    "final.vtu": read_mesh,
    "forces.csv": _forces,
    "summary.json": _json,
    "scene.toml": lambda path: tomllib.loads(path.read_text()),
    "force.png": _picture,
    "energy.png": _picture,
    "replay.html": _page,
    "report.html": _page,
}
"""A check of each file, which raises an error."""
