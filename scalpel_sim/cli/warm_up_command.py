"""The command `scalpel-sim warm-up`: compile ahead, and say what was made and how to copy it."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from scalpel_sim.cli.options import TissueOptions
from scalpel_sim.errors import RunError
from scalpel_sim.runs.console import compiling, log_to_stderr
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.scene.scene import changed

if TYPE_CHECKING:  # `--help` should not wait for a compiler
    from scalpel_sim.runs.warm_up import KernelSet

_BYTES_PER_MB = 1e6


def warm_up(
    *scenes: str,
    tissue: TissueOptions = TissueOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Compile ahead what a first run compiles, for an image or a cluster, and print where it is.

    The folder can be copied: it serves any machine with the same processor and the same versions,
    wherever the program is installed, and may be read-only. Options of the tissue choose the
    kernels of another law, scheme or relaxation. For example:

    ```console
    scalpel-sim warm-up
    scalpel-sim warm-up all
    NUMBA_CACHE_DIR=/opt/kernels scalpel-sim warm-up slab --relaxation hierarchical
    ```

    Args:
        scenes: organ, incision, slab, grid2, grid7, or all [default: organ].
    """
    with log_to_stderr(printing):
        from scalpel_sim.runs.warm_up import compile_ahead, kernels_are_compiled
        from scalpel_sim.scene.read import SCENES

        every = "all" in scenes
        chosen: Sequence[str | None] = list(SCENES) if every else scenes or (None,)
        sets = _sets(chosen, tissue)
        with compiling(printing) as on_progress:
            compile_ahead(sets, on_progress)
        if not all(map(kernels_are_compiled, sets)):
            raise RunError(
                "the kernels could not be compiled, or not be written; set NUMBA_CACHE_DIR to a "
                "folder that can be written"
            )
        _report(printing)


def _sets(names: Sequence[str | None], tissue: TissueOptions) -> list["KernelSet"]:
    """Return the sets that the scenes need, with an account of the energy and without, each once.

    Raises:
        UsageError: there is no such scene, or options that make no sense together.
    """
    from scalpel_sim.cli.scene_options import chosen_scene
    from scalpel_sim.runs.warm_up import KernelSet
    from scalpel_sim.scene.checks import can_audit

    found: dict[KernelSet, None] = {}
    for name in names:
        scene = chosen_scene(name, tissue)
        audits = (True, False) if can_audit(scene.solver.relaxation) else (False,)
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
