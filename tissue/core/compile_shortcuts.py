"""What Numba does while it compiles that the engine can do without: a fifth of the time."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from numba.core.types import Function

_function_type: Any = Function
_get_call_type = _function_type.get_call_type
_SIGNATURES: dict[tuple[Any, tuple[Any, ...]], Any] = {}
"""Signatures that were found, by function and types of the arguments."""


@contextmanager
def shortcuts() -> Iterator[None]:
    """Compile without what is done twice or for nobody. Blocks may be nested; one thread compiles.

    For each `a + b` Numba tries some eighty implementations one after the other, once to find the
    type and once to find the code. Here the signature is remembered. And Numba tells each function
    that is being compiled of each call of LLVM, for a sum of times that nobody reads.
    """
    lock = llvm.ffi.lib._lock
    listeners, lock._cblist = lock._cblist, []
    before, _function_type.get_call_type = _function_type.get_call_type, _call_type
    try:
        yield
    finally:
        lock._cblist = listeners
        _function_type.get_call_type = before


def _call_type(function: Any, context: Any, args: Any, keywords: Any) -> Any:
    """Return the signature of a call with arguments of these types."""
    if keywords:
        return _get_call_type(function, context, args, keywords)
    call = function, tuple(args)
    if call not in _SIGNATURES:
        _SIGNATURES[call] = _get_call_type(function, context, args, keywords)
    return _SIGNATURES[call]
