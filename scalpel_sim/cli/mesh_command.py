"""The command `mesh`: tetrahedra that can be cut, from the files that people have."""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from scalpel_sim.errors import UsageError, writing
from scalpel_sim.runs.console import SECONDS_PER_LINE, log_to_stderr, say
from scalpel_sim.runs.options import OUTPUT, Flag, PrintOptions

if TYPE_CHECKING:
    from scalpel_sim.meshing.meshed import Meshed

_MESH = Group("Mesh", sort_key=1)

_SUFFIX = ".vtu"


@Parameter(name="*", group=_MESH)
@dataclass(frozen=True)
class MeshOptions:
    """Lengths of the mesh."""

    scale: float | None = None
    """Metres in one unit of the file: 0.001 for millimetres [default: what the file says, or else
    1 where that makes sense]."""
    edge_length: float | None = None
    "Length of the edges of tetrahedra [m; default: so that there are some 5,000]."
    tolerance: float | None = None
    """Farthest that a surface may move [m; default: half a percent of the body's size, less where
    it is thin]."""
    coarsen: Flag = False
    "Make as few tetrahedra as the tolerance allows, of a surface."


@Parameter(name="*", group=_MESH)
@dataclass(frozen=True)
class LimitOptions:
    """What the mesher may use."""

    time_limit: float = 300.0
    "Longest that it may take [s]."
    memory_limit: float = 4.0
    "Most memory that it may take, on Linux [GB]."


def mesh(
    file: Path,
    /,
    *,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"], group=OUTPUT)] = None,
    force: Annotated[Flag, Parameter(group=OUTPUT)] = False,
    lengths: MeshOptions = MeshOptions(),
    limits: LimitOptions = LimitOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Make tetrahedra that can be cut from a surface: STL, OBJ, PLY or GLB.

    Holes are closed, parts that overlap become one body, and triangles may face either way. It
    needs the extra `mesh` (pip install 'scalpel-sim[mesh]'). For example:

    ```console
    scalpel-sim mesh liver.stl --scale 0.001 -o liver.vtu
    scalpel-sim run --mesh liver.vtu
    ```

    Args:
        file: The surface.
        out: The mesh to write, a FILE.vtu [default: the name of the file, here, with .vtu].
        force: Replace the mesh if it exists.
    """
    with log_to_stderr(printing):
        from scalpel_sim.meshing.filling import fill
        from scalpel_sim.meshing.limited_process import ProcessLimits
        from scalpel_sim.meshing.meshed import Meshed

        target = _target(file, out, force=force)
        filled = fill(
            file,
            **asdict(lengths),
            limits=ProcessLimits(limits.time_limit, limits.memory_limit),
            on_progress=_shown(printing),
        )
        _write(Meshed(filled.mesh, filled.notes()), target, printing)


def _target(file: Path, out: Path | None, *, force: bool) -> Path:
    """Return the file to write.

    Raises:
        UsageError: it exists, or has another suffix.
    """
    target = out or Path(file.name.removesuffix(".gz")).with_suffix(_SUFFIX)
    if target.suffix.lower() != _SUFFIX:
        raise UsageError(f"{target}: meshes are written as {_SUFFIX}; call it NAME{_SUFFIX}")
    if target.exists() and not force:
        raise UsageError(f"{target} exists already; choose another -o, or add --force")
    return target


def _shown(printing: PrintOptions) -> Callable[[str], None]:
    """Return a function that shows a line: in place on a terminal, elsewhere from time to time."""
    if printing.quiet:
        return lambda text: None
    if sys.stderr.isatty():
        return lambda text: print(f"\r\033[K{text}", end="\r", file=sys.stderr, flush=True)
    due = time.monotonic() + SECONDS_PER_LINE

    def print_line(text: str) -> None:
        nonlocal due
        if time.monotonic() >= due:
            due = time.monotonic() + SECONDS_PER_LINE
            say(text)

    return print_line


def _write(meshed: "Meshed", target: Path, printing: PrintOptions) -> None:
    """Write a mesh, and print what was made.

    Raises:
        RunError: the system refuses.
    """
    from scalpel_sim.meshing.meshed import MeshFigures, lines_about
    from tissue import write_mesh

    with writing(target, "another file with -o"):
        write_mesh(target, meshed.mesh)
    figures = MeshFigures.of(meshed.mesh)
    if printing.json:
        content = figures._asdict() | {"file": str(target), "notes": list(meshed.notes)}
        print(json.dumps(content, indent=2))
    elif not printing.quiet:
        print("\n".join(lines_about(meshed, figures, target)))
