"""The command `mesh`: tetrahedra that can be cut, from the files that people have."""

import json
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from scalpel_sim.errors import UsageError, writing
from scalpel_sim.runs.console import SECONDS_PER_LINE, log_to_stderr, say
from scalpel_sim.runs.options import OUTPUT, Flag, PrintOptions

if TYPE_CHECKING:
    from scalpel_sim.meshing.meshed import Meshed

_MESH = Group("Mesh", sort_key=1)

_SUFFIX = ".vtu"

_BEGINNING = 200
"""Bytes of a file that show whether it stands for another one."""


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
    "Farthest that a surface may move [m; default: half a percent of the body's size]."
    coarsen: Flag = False
    "Make as few tetrahedra as the tolerance allows, of a surface."
    keep_labels: str | None = None
    "Labels of a volume to make tissue of, as in 3,5 [default: all but 0]."
    label: Annotated[tuple[str, ...], Parameter(negative="", show_default=False)] = ()
    """Join labels of a volume and name them, as in 3,5=liver; or name one: 2=tumour. May be given
    several times."""


@Parameter(name="*", group=_MESH)
@dataclass(frozen=True)
class LimitOptions:
    """Limits of the mesher."""

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
    """Make tetrahedra that can be cut, from a surface, a segmentation, or a mesh to be repaired.

    Surfaces (STL, OBJ, PLY, GLB): holes are closed, parts that overlap become one body, and
    triangles may face either way. Label volumes (NIfTI, NRRD): each tetrahedron keeps its label,
    and labels that touch share faces. Tetrahedra of any file that `run --mesh` reads: nodes in the
    same place are merged, and flat, inverted and sliver tetrahedra mended, or the skin is filled
    anew. It needs the extra `mesh` (pip install 'scalpel-sim[mesh]'). For example:

    ```console
    scalpel-sim mesh liver.stl --scale 0.001 -o liver.vtu
    scalpel-sim mesh abdomen.nii.gz --keep-labels 3,5 --label 5=tumour -o liver.vtu
    scalpel-sim mesh slivers.msh --scale 0.001 -o liver.vtu
    scalpel-sim run --mesh liver.vtu
    ```

    Args:
        file: The surface, the label volume, or the mesh.
        out: The mesh to write, a FILE.vtu [default: the name of the file, here, with .vtu].
        force: Replace the mesh if it exists.
    """
    with log_to_stderr(printing):
        target = _target(file, out, force=force)
        _write(_meshed(file, lengths, limits, _shown(printing)), target, printing)


def _meshed(
    file: Path, lengths: MeshOptions, limits: LimitOptions, on_progress: Callable[[str], None]
) -> "Meshed":
    """Return the mesh that is made of a file, by what it is.

    Raises:
        UsageError: an option has no use for it, or it cannot be used.
    """
    from scalpel_sim.meshing.filling import fill
    from scalpel_sim.meshing.label_volume import is_label_volume
    from scalpel_sim.meshing.limited_process import ProcessLimits
    from scalpel_sim.meshing.meshed import Meshed
    from scalpel_sim.meshing.repair import repaired
    from scalpel_sim.meshing.stuffing import stuff_volume
    from scalpel_sim.meshing.surface import SURFACE_FILES

    _expect_itself(file)
    given = asdict(lengths)
    if is_label_volume(file):
        _expect_none(given, ("tolerance", "coarsen"), f"{file} is a label volume")
        return stuff_volume(file, **given, on_progress=on_progress)
    is_surface = file.suffix.lower() in SURFACE_FILES
    kind = "a surface" if is_surface else "no label volume"
    _expect_none(given, ("keep_labels", "label"), f"{file} is {kind}")
    allowed = ProcessLimits(limits.time_limit, limits.memory_limit)
    if not is_surface:
        return repaired(file, **given, limits=allowed, on_progress=on_progress)
    filled = fill(file, **given, limits=allowed, on_progress=on_progress)
    return Meshed(filled.mesh, filled.notes())


def _expect_itself(file: Path) -> None:
    """Refuse a file that only stands for the one that was meant.

    Raises:
        UsageError: it is a web page, or what Git LFS leaves in its place.
    """
    from tissue.support import stand_in

    with suppress(OSError), file.open("rb") as stream:  # readers say why a file cannot be read
        found = stand_in(stream.read(_BEGINNING))
        if found:
            raise UsageError(f"{file}: {found}")


def _expect_none(given: dict[str, Any], names: Sequence[str], reason: str) -> None:
    """Take options away that have no use, and check that they were not given.

    Raises:
        UsageError: one was.
    """
    for name in names:
        if given.pop(name):
            raise UsageError(f"--{name.replace('_', '-')} has no use here: {reason}; omit it")


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
