"""The folder of compiled kernels: one for each state of the sources, compiler and processor."""

import functools
import hashlib
import os
from pathlib import Path
from typing import Any, cast

import llvmlite.binding as llvm
import numba as nb
import platformdirs

# A kernel contains kernels from other files, so the folder is named after all of them: editing one
# can never revive an old binary. Kernels of other packages are compiled again by themselves: see
# `kernel_cache`.
_SOURCES = sorted(Path(__file__).parents[1].rglob("*.py"))

FILES = frozenset(map(str, _SOURCES))
"""Paths of the sources of this package."""
DIGEST = hashlib.sha256(b"".join(source.read_bytes() for source in _SOURCES)).hexdigest()[:16]
"""Digest of these sources."""


def cache_root() -> Path:
    """Return the folder that holds all caches: $NUMBA_CACHE_DIR, else the user's cache folder."""
    return Path(os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("scalpel-sim"))


def cache_directory(processor: str | None = None, features: str | None = None) -> Path:
    """Return where kernels of exactly these sources are kept for exactly one processor.

    Args:
        processor: LLVM's name of it [default: that of the one for which this process compiles].
        features: Extensions that it has besides those of the name, as LLVM writes them [default:
            those for which this process compiles].
    """
    return cache_root() / "kernels" / f"{DIGEST}-{_machine(processor, features)}"


def n_compiled_kernels(folder: Path | None = None) -> int:
    """Return how many kernels are in a folder, compiled by any process.

    Args:
        folder: The folder [default: that of this process].
    """
    return sum(1 for _ in (folder or cache_directory()).glob("*/*-part.*.nbc"))


@functools.cache
def _machine(processor: str | None, features: str | None) -> str:
    """Return a digest of the version of Numba and the processor that it compiles for.

    In a folder that is found by it all files fit. One image can hold those of several processors.
    """
    config = cast(Any, nb.config)
    processor = processor or config.CPU_NAME or llvm.get_host_cpu_name()
    if features is None:
        features = config.CPU_FEATURES
    if features is None:
        features = llvm.get_host_cpu_features().flatten()
    described = f"{nb.__version__} {llvm.get_process_triple()} {processor} {features}"
    return hashlib.sha256(described.encode()).hexdigest()[:8]
