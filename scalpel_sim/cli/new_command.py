"""The command `new`: writes a scene file to start from."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import OUTPUT, Flag, PrintOptions


def new(
    file: Path,
    /,
    *,
    scene: Annotated[str, Parameter(name="--from")] = "organ",
    force: Annotated[Flag, Parameter(group=OUTPUT)] = False,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Write a scene to a file, to be changed and run.

    For example:

    ```console
    scalpel-sim new mine.toml --from incision
    scalpel-sim run mine.toml --set stroke.0.depth=0.01
    ```

    Args:
        file: The file; .toml is added to its name where it is missing.
        scene: The scene that is written: one that comes with the project.
        force: Replace the file if it exists.
    """
    from scalpel_sim.cli.new_file import write_new_file
    from scalpel_sim.scene_file.reading import shipped_path, shipped_scene
    from scalpel_sim.tables.toml import SUFFIX

    with log_to_stderr(printing):
        shipped_scene(scene)  # refuses an unknown one
        path = file if file.suffix.lower() == SUFFIX else file.with_name(file.name + SUFFIX)
        text = shipped_path(scene).read_text(encoding="utf-8")
        write_new_file(path, text, force=force, instead="another file")
        if not printing.quiet:
            print(f"{path}: written; run it with `scalpel-sim run {path}`")
