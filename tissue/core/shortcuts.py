"""Leaves out what Numba's compiler does twice, or for what no kernel has.

Each shortcut replaces a function of Numba while a kernel is compiled, and only then.
"""

import functools
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any, cast

import llvmlite.binding as llvm
from numba.core import base, errors, interpreter, transforms
from numba.core.base import BaseContext
from numba.core.postproc import PostProcessor
from numba.core.types import Function
from numba.core.typing.context import BaseContext as TypingContext

_function_type: Any = Function
_context_type: Any = BaseContext
_fixer_type: Any = cast(Any, errors).WarningsFixer
_interpreter_type: Any = cast(Any, interpreter).Interpreter
_typing_type: Any = TypingContext

_get_call_type = _function_type.get_call_type
_get_function = _context_type.get_function
_get_size = _context_type.get_abi_sizeof
_find_attribute = _typing_type.find_matching_getattr_template
_has_loc = cast(Any, base)._has_loc
_post_process = PostProcessor.run
_rewrite_code = _interpreter_type.post_process

_SIGNATURES: dict[tuple[Any, tuple[Any, ...]], Any] = {}
"""Signatures that were found, by function and types of the arguments."""
_MISSING: set[tuple[Any, ...]] = set()
"""Functions, with the types of a call, of which there is no code: while one program compiles."""
_ATTRIBUTES: dict[tuple[Any, str], Any] = {}
"""Attributes that were found, by type of the object and name."""
_SIZES: dict[Any, int] = {}
"""Sizes of LLVM's types [byte]."""
_NOTHING = nullcontext()
_NEEDLESS = (
    cast(Any, interpreter).peep_hole_delete_with_exit,
    cast(Any, interpreter).peep_hole_fuse_dict_add_updates,
)
"""Features that Numba looks for in each kernel, and none has: `with`, and dictionaries."""


@contextmanager
def shortcuts() -> Iterator[None]:
    """Compile without what is done twice or for nobody. Blocks may be nested; one thread compiles.

    Numba reports to each function that is being compiled each call of LLVM, for a sum of times that
    nobody reads. The other shortcuts are functions below, which give their reasons.
    """
    lock = llvm.ffi.lib._lock
    listeners, lock._cblist = lock._cblist, []
    if _function_type.get_call_type is _get_call_type:
        _MISSING.clear()  # modules that were loaded since may bring code
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in _REPLACEMENTS]
    try:
        for owner, name, replacement in _REPLACEMENTS:
            setattr(owner, name, replacement)
        yield
    finally:
        lock._cblist = listeners
        for owner, name, original in before:
            setattr(owner, name, original)


def _call_type(function: Any, context: Any, args: Any, keywords: Any) -> Any:
    """Return the signature of a call with arguments of these types, which is remembered.

    For each `a + b` Numba tries some eighty implementations one after the other, once to find the
    type and once to find the code.
    """
    if keywords:
        return _get_call_type(function, context, args, keywords)
    call = function, tuple(args)
    if call not in _SIGNATURES:
        _SIGNATURES[call] = _get_call_type(function, context, args, keywords)
    return _SIGNATURES[call]


def _function(context: Any, function: Any, signature: Any, _firstcall: bool = True) -> Any:
    """Return the code of a call; remember where there is none.

    Numba asks for each array that is read whether its type has code of its own, and looks through
    all its registries to find that it has not.

    Raises:
        NotImplementedError: there is none.
    """
    call = function, signature.args, signature.return_type
    if call in _MISSING:
        raise NotImplementedError(f"no code for {function} of {signature}")
    try:
        return _get_function(context, function, signature, _firstcall)
    except NotImplementedError:
        _MISSING.add(call)
        raise


def _processed(processor: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Bring the blocks of a kernel in order.

    Numba finds the lifetimes of variables after each of five passes; the last one alone uses them.
    """
    code = processor.func_ir
    if emit_dels or code.is_generator:
        _post_process(processor, emit_dels, extend_lifetimes)
        return
    code.blocks = cast(Any, transforms).canonicalize_cfg(code.blocks)
    code.generator_info = None


def _warnings(fixer: Any, filename: str | None = None, lineno: int | None = None) -> Any:
    """Return a context that catches no warnings: typing a kernel gives none."""
    return _NOTHING


def _attribute(context: Any, owner: Any, name: str) -> Any:
    """Return the type of an attribute and what finds it; None where the type has none."""
    found = _ATTRIBUTES.get((owner, name))
    if found is None:
        found = _find_attribute(context, owner, name)
        if found is not None:
            _ATTRIBUTES[owner, name] = found
    return found


def _size(context: Any, kind: Any) -> int:
    """Return the size of one of LLVM's types [byte]; Numba parses a module for each question."""
    if kind not in _SIZES:
        _SIZES[kind] = _get_size(context, kind)
    return _SIZES[kind]


def _rewritten(reader: Any, rewrites: Any, code: Any) -> Any:
    """Return the code of a kernel after the rewrites that it can need."""
    return _rewrite_code(reader, [each for each in rewrites if each not in _NEEDLESS], code)


_REPLACEMENTS: tuple[tuple[Any, str, Any], ...] = (
    (_function_type, "get_call_type", _call_type),
    (_context_type, "get_function", _function),
    (_context_type, "get_abi_sizeof", _size),
    (_typing_type, "find_matching_getattr_template", _attribute),
    (_interpreter_type, "post_process", _rewritten),
    (base, "_has_loc", functools.cache(_has_loc)),
    (PostProcessor, "run", _processed),
    (_fixer_type, "catch_warnings", _warnings),
)
"""Type or module, name of its function, and what stands in for it."""
