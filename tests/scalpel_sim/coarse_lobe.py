"""Scenes with the lobe of a liver in 730 tetrahedra, for claims that do not depend on its mesh."""

from pathlib import Path

from scalpel_sim.scene.read import scene_in, shipped_scene, with_settings
from scalpel_sim.scene.scene import Scene
from tissue import liver_lobe, write_mesh


def with_coarse_lobe(name: str, folder: Path, *settings: str) -> Scene:
    """Return a shipped scene whose lobe has cells of twice the size.

    Args:
        name: The scene, whose body is the lobe.
        folder: Where to write the file of the mesh.
        settings: Other keys of the scene, as `--set` gives them.
    """
    file = folder / "lobe.vtu"
    write_mesh(file, liver_lobe(2.0))
    mesh = ('body.shape="mesh"', f'body.file="{file}"')
    return scene_in(with_settings(shipped_scene(name), (*mesh, *settings)))
