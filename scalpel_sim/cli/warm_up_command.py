"""The command `scalpel-sim warm-up`: compile ahead, and say what was made and how to copy it."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scalpel_sim.cli.options import TissueOptions
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.runs.console import compiling, log_to_stderr
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.scene.scene import changed

if TYPE_CHECKING:  # `--help` should not wait for a compiler
    from scalpel_sim.runs.warm_up import KernelSet

_BYTES_PER_MB = 1e6


def warm_up(
    *scenes: str,
    target: Literal["x86-64-v3", "x86-64-v4", "neoverse"] | None = None,
    out: Path | None = None,
    tissue: TissueOptions = TissueOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Compile ahead what a first run compiles, for an image or a cluster, and print where it is.

    The folder can be copied: it serves any machine with the same processor and the same versions,
    wherever the program is installed, and may be read-only. Options of the tissue choose the
    kernels of another law, scheme or relaxation. With --target all goes into one file, a bundle,
    which serves every processor of a level. For example:

    ```console
    scalpel-sim warm-up
    scalpel-sim warm-up all
    NUMBA_CACHE_DIR=/opt/kernels scalpel-sim warm-up slab --relaxation hierarchical
    scalpel-sim warm-up all --target x86-64-v3
    SCALPEL_SIM_BUNDLE=kernels-x86-64-v3.zip scalpel-sim run
    ```

    Args:
        scenes: organ, incision, incise-v0 or another scene or task, or all [default: organ].
        target: Level of processors for which to compile, and to write a bundle: x86-64-v3 (with
            AVX2), x86-64-v4 (with AVX-512) or neoverse (Arm, N1 and later). This machine has to be
            of that level [default: for this processor alone, without a bundle].
        out: File of the bundle [default: kernels-LEVEL.zip].
    """
    if out is not None and target is None:
        raise UsageError("--out names a bundle: give --target, too")
    with log_to_stderr(printing):
        from scalpel_sim.runs.warm_up import compile_ahead, kernels_are_compiled
        from scalpel_sim.scene.read import SHIPPED_SCENES, TASK_SCENES

        if target is not None:
            _expect_level(target)
        known, every = (*SHIPPED_SCENES, *TASK_SCENES), "all" in scenes
        chosen: Sequence[str | None] = known if every else scenes or (None,)
        sets = _sets(chosen, tissue)
        with compiling(printing) as on_progress:
            compile_ahead(sets, on_progress, target)
        if not all(kernels_are_compiled(each, target) for each in sets):
            raise RunError(
                "the kernels could not be compiled, or not be written; set NUMBA_CACHE_DIR to a "
                "folder that can be written"
            )
        if target is None:
            _report(printing)
        else:
            _write_bundle(target, out, printing)


def _expect_level(target: str) -> None:
    """Check that this machine can compile for a level.

    Raises:
        UsageError: it cannot.
    """
    from tissue.support import LEVELS

    if missing := LEVELS[target].missing():
        raise UsageError(
            f"cannot compile for {target} here: kernels are compiled as they run, and this machine "
            f"lacks {missing}; make the bundle on a machine of that level"
        )


def _write_bundle(target: str, out: Path | None, printing: PrintOptions) -> None:
    """Write the bundle of a level, and print where it is and how another machine uses it.

    Raises:
        RunError: it cannot be written.
    """
    from scalpel_sim.runs.warm_up import folder_of
    from tissue.support import bundle_name, write_bundle

    file = out or Path(bundle_name(target))
    try:
        n = write_bundle(target, folder_of(target), file)
    except OSError as error:
        raise RunError(f"cannot write the bundle {file}: {error}") from error
    size = file.stat().st_size
    if printing.json:
        content = {"programs": n, "bytes": size, "file": str(file), "target": target}
        print(json.dumps(content, indent=2))
    elif not printing.quiet:
        print(f"{n} compiled programs for {target}, {size / _BYTES_PER_MB:.1f} MB, in {file}")
        print(
            "To use them elsewhere, copy the file and set SCALPEL_SIM_BUNDLE to its path: same "
            "versions of Python, numba, llvmlite and this program. It is machine code, which runs "
            "without further checks: use those of people you trust"
        )


def _sets(names: Sequence[str | None], tissue: TissueOptions) -> list["KernelSet"]:
    """Return the sets that the scenes need, with an account of the energy and without, each once.

    Raises:
        UsageError: there is no such scene, or options that make no sense together.
    """
    from scalpel_sim.cli.scene_options import chosen_scene
    from scalpel_sim.runs.warm_up import KernelSet
    from scalpel_sim.scene.checks import moves_together

    found: dict[KernelSet, None] = {}
    for name in names:
        scene = chosen_scene(name, tissue)
        audits = (True, False) if moves_together(scene.solver.relaxation) else (False,)
        audit = vars(tissue.solver)["audit"]
        if audit is not None:
            audits = (audit,)
        for audit in audits:
            found[KernelSet.of(changed(scene, audit=audit))] = None
    return list(found)


def _report(printing: PrintOptions) -> None:
    """Print where the kernels are, how large they are, and how another machine uses them."""
    from tissue.support import cache_directory, n_compiled_kernels

    folder = cache_directory()
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    root, n = folder.parents[1], n_compiled_kernels()
    if printing.json:
        content = {"kernels": n, "bytes": size, "folder": str(folder), "root": str(root)}
        print(json.dumps(content, indent=2))
    elif not printing.quiet:
        print(f"{n} kernels, {size / _BYTES_PER_MB:.1f} MB, in {folder}")
        print(
            f"To use them elsewhere, copy {root} and set NUMBA_CACHE_DIR to the copy: same "
            "processor, same versions of Python, numba and this program"
        )
