"""The command `new`: writes a scene file to start from, which replaces another only on request."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from scalpel_sim.errors import UsageError, writing
from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import OUTPUT, Flag, PrintOptions
from tissue.support import new_whole_file, whole_file


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
        scene: The scene or task that is written: one that comes with the project.
        force: Replace the file if it exists.
    """
    from scalpel_sim.scene.read import shipped_path, shipped_scene
    from scalpel_sim.tables.text_files import SUFFIX

    with log_to_stderr(printing):
        shipped_scene(scene)  # refuses an unknown one
        path = file if file.suffix.lower() == SUFFIX else file.with_name(file.name + SUFFIX)
        text = shipped_path(scene).read_text(encoding="utf-8")
        write_new_file(path, text, force=force, instead="another file")
        if not printing.quiet:
            print(f"{path}: written; run it with `scalpel-sim run {path}`")


def write_new_file(path: Path, text: str, *, force: bool, instead: str) -> None:
    """Write a text to a file that does not exist yet; an error leaves what was there.

    Args:
        path: The file.
        text: What it is to hold.
        force: Whether a file that exists is replaced.
        instead: What to choose where the file cannot be written, for the message.

    Raises:
        UsageError: the file exists, and `force` is not given.
        RunError: the system refuses.
    """
    placed = whole_file if force else new_whole_file
    with writing(path, instead):
        try:
            with placed(path) as unfinished:
                unfinished.write_text(text, encoding="utf-8")
        except FileExistsError as error:
            raise UsageError(
                f"{path} exists already; choose another file, or add --force to replace it"
            ) from error
