"""`@kernel`: the one decorator that compiles, and the one place where its flags live."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba as nb
import platformdirs
from numba.core.types import unliteral

F = TypeVar("F", bound=Callable[..., Any])

# Numba keys its disk cache on one source file. A kernel inlines kernels from other files, so the
# cache directory is named after all of them: editing one can never revive an old binary.
_SOURCES = sorted(Path(__file__).parents[1].rglob("*.py"))
_DIGEST = hashlib.sha256(b"".join(source.read_bytes() for source in _SOURCES)).hexdigest()[:16]


FLAGS = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True, "nogil": True}
"""Flags with which every kernel is compiled; `kernel` gives the reasons."""


def cache_directory() -> Path:
    """Return where compiled kernels are kept: $NUMBA_CACHE_DIR, else the user's cache folder."""
    root = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("scalpel-sim")
    return Path(root) / "kernels" / _DIGEST


def is_compiling() -> bool:
    """Return whether kernels are compiled: not where $NUMBA_DISABLE_JIT is 1."""
    return not cast(Any, nb.config).DISABLE_JIT


def kernel(function: F) -> F:
    """Compile `function` and keep the binary on disk.

    Kernels work on arrays and plain numbers. They never raise and never allocate, so they run
    without Numba's reference counting (`_nrt`): with it a cut step costs three times as much,
    because every call of a helper counts the references of every array it passes on.
    `error_model="numpy"` makes 1/0 an inf instead of an exception.
    """
    return _compiled(function, FLAGS)


def inlined(function: F) -> F:
    """Compile as `kernel` does, but always as a part of the caller.

    For functions that run once a node in each stage of a step: as calls they took a third of its
    time.
    """
    return _compiled(function, FLAGS | {"forceinline": True})


def _compiled(function: F, flags: dict[str, Any]) -> F:
    config = cast(Any, nb.config)
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())  # read by Numba as it decorates, so restored after
    try:
        compiled = cast(Any, nb.njit)(cache=True, **flags)(function)
    finally:
        config.CACHE_DIR = before
    if is_compiling():
        _compile_once(compiled)
    return cast(F, compiled)


def _compile_once(dispatcher: Any) -> None:
    """Let calls with constants share the binary of calls with variables.

    Numba compiles a function again for each constant that another kernel passes to it: a third of
    the engine's compile time, for code that is inlined anyway.
    """
    resolve, plain = dispatcher.get_call_template, cast(Any, unliteral)

    def resolve_variables(arguments: Any, keywords: Any) -> Any:
        return resolve(
            tuple(plain(a) for a in arguments),
            {name: plain(a) for name, a in keywords.items()},
        )

    dispatcher.get_call_template = resolve_variables
