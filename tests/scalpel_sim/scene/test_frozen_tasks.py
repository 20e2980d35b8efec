"""A task never changes what it means: its scene, materials and mesh are those of its hash."""

import hashlib
import json
import tomllib

import numpy as np
import pytest

from scalpel_sim import scene_called
from scalpel_sim.scene.read import TASK_SCENES, shipped_path

FROZEN = {
    "biopsy-v0": "cebf5e769e1164e6",
    "dissect-v0": "5b9045fe0aa7a469",
    "excise-v0": "04c2dfcb5fc796f6",
    "expose-v0": "fbbf7b7944befddc",
    "gallbladder-v0": "33d1943516034483",
    "incise-v0": "f67bcef1c291998b",
    "incise_taut-v0": "a9a305b4cf3a1839",
    "ligament-v0": "535061e1c81775fc",
    "retract-v0": "859d0b1a5469cb09",
    "spare_vessel-v0": "3b8db9de8248a99c",
}
"""Hash of each task. A line is added with a new task or version, and none is ever changed."""

SAME_PLACE = 1e-7
"""Distance within which a node is where it was [m]: far above the rounding of any computer."""


def of_text(text):
    """Return what a scene file says, whatever its comments, the order of its keys and 1 for 1.0."""

    def plain(value):
        if isinstance(value, dict):
            return {key: plain(each) for key, each in value.items()}
        if isinstance(value, list):
            return [plain(each) for each in value]
        is_number = isinstance(value, int) and not isinstance(value, bool)
        return float(value) if is_number else value

    return plain(tomllib.loads(text))


def hash_of(said, scene):
    """Return the hash of what a scene file says, with the numbers of its materials and its mesh."""
    settings, mesh = scene.settings(), scene.mesh()
    rows = [settings, *settings["labels"], *settings["bodies"]]
    materials = [
        {key: value for key, value in row["material"].items() if value}  # a new key changes none
        for row in rows
        if row.get("material")
    ]
    digest = hashlib.sha256(json.dumps([said, materials], sort_keys=True).encode())
    digest.update(np.round(mesh.positions / SAME_PLACE).astype("<i8").tobytes())
    digest.update(mesh.tetrahedra.astype("<i8").tobytes())
    return digest.hexdigest()[:16]


@pytest.mark.parametrize("name", TASK_SCENES)
def test_a_task_means_what_it_has_always_meant(name):
    found = hash_of(of_text(shipped_path(name).read_text(encoding="utf-8")), scene_called(name))
    task, version = name.rsplit("-v", 1)
    assert found == FROZEN.get(name), (
        f"{name} is another task than it was: results of policies would no longer be comparable. "
        f"Take the change back, or copy the scene to {task}-v{int(version) + 1}.toml, change that "
        "one, name it in TASK_SCENES, and add its hash to FROZEN; the old one stays as it is"
    )


def test_a_number_changes_a_task_and_its_comments_do_not():
    scene = scene_called("incise-v0")
    text = 'about = "a cut"\nseconds = 5\n[task]\ndepth = 0.006\ntolerance = 1e-3\n'
    same = 'seconds = 5.0  # s\nabout = "a cut"\n[task]\ntolerance = 0.001\ndepth = 0.006\n'
    assert hash_of(of_text(text), scene) == hash_of(of_text(same), scene)
    assert hash_of(of_text(text.replace("6", "7")), scene) != hash_of(of_text(text), scene)
    assert hash_of(of_text(text), scene_called("retract-v0")) != hash_of(of_text(text), scene)
