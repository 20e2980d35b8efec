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
# can never revive an old binary.
_SOURCES = sorted(Path(__file__).parents[1].rglob("*.py"))
_DIGEST = hashlib.sha256(b"".join(source.read_bytes() for source in _SOURCES)).hexdigest()[:16]


def cache_root() -> Path:
    """Return the folder that holds all caches: $NUMBA_CACHE_DIR, else the user's cache folder."""
    return Path(os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("scalpel-sim"))


def cache_directory() -> Path:
    """Return where kernels of exactly these sources are kept for exactly this processor."""
    return cache_root() / "kernels" / f"{_DIGEST}-{_machine()}"


def n_compiled_kernels() -> int:
    """Return how many kernels are in `cache_directory`, compiled by any process."""
    return sum(1 for _ in cache_directory().glob("*/*-part.*.nbc"))


@functools.cache
def _machine() -> str:
    """Return a digest of what Numba looks at: its version, and the processor that it compiles for.

    In a folder that is found by it all files fit. One image can hold those of several processors.
    """
    config = cast(Any, nb.config)
    processor = config.CPU_NAME or llvm.get_host_cpu_name()
    features = config.CPU_FEATURES
    if features is None:
        features = llvm.get_host_cpu_features().flatten()
    described = f"{nb.__version__} {llvm.get_process_triple()} {processor} {features}"
    return hashlib.sha256(described.encode()).hexdigest()[:8]
