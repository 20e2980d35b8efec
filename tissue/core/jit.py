"""`@kernel`: the one decorator that compiles, and the one place where its flags live."""

from collections.abc import Callable
from typing import Any, Generic, TypeVar, cast

import numba as nb

from tissue.core.kernel_parts import in_parts

F = TypeVar("F", bound=Callable[..., Any])

FLAGS = {
    "error_model": "numpy",
    "_nrt": False,
    "no_cfunc_wrapper": True,
    "nogil": True,
    "forceinline": False,
}
"""Flags with which every kernel is compiled; `kernel` gives the reasons."""


def is_compiling() -> bool:
    """Return whether kernels are compiled: not where $NUMBA_DISABLE_JIT is 1."""
    return not cast(Any, nb.config).DISABLE_JIT


def kernel(function: F) -> F:
    """Compile `function` and keep the binary on disk.

    Kernels work on arrays and plain numbers. They never raise and never allocate, so they run
    without Numba's reference counting (`_nrt`): with it a cut step costs three times as much,
    because every call of a helper counts the references of every array it passes on.
    `error_model="numpy"` makes 1/0 an inf instead of an exception. `forceinline` is given although
    it is False: Numba would take it over from whichever caller compiles the function first, and
    flags are a part of its name in the code. Parts of two processes that compile at once would then
    not fit, and a call go nowhere.
    """
    return _compiled(function, FLAGS)


def inlined(function: F) -> F:
    """Compile as `kernel` does, but always as a part of the caller.

    For functions that run once a node in each stage of a step: as calls they took a third of its
    time.
    """
    return _compiled(function, FLAGS | {"forceinline": True})


def _compiled(function: F, flags: dict[str, Any]) -> F:
    return cast(F, in_parts(function, flags)) if is_compiling() else function


class SameTypes(Generic[F]):
    """A kernel for a caller whose arguments have the same types in each call: `name.call(...)`.

    Numba finds the type of each argument in each call, which takes 0.3 us for a struct; here it
    does so in the first call alone. Later ones are not checked: a float becomes whole where the
    first one was. So this is for arguments that are made here, structs, floats and arrays of the
    caller's own, and not for what a user passes.
    """

    def __init__(self, function: F) -> None:
        self._function: Any = function
        self.call = cast(F, self._first_call if is_compiling() else function)
        """Calls the kernel."""

    def _first_call(self, *arguments: Any) -> Any:
        """Call the kernel, and keep what was compiled for these types."""
        kernel = self._function
        result = kernel(*arguments)
        types = tuple(kernel.typeof_pyval(argument) for argument in arguments)
        self.call = kernel.overloads[types].entry_point
        return result
