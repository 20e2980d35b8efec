"""Compiled kernels as files that can be copied to another machine, or packed in a bundle.

Numba finds a cached function by the path of its source file. Here it is the name of its module, in
`cache_directory`: a copy serves an installation at any other path.
"""

import functools
import hashlib
import logging
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core import caching, compiler
from numba.core.serialize import dumps

from tissue.core.kernel_bundle import bundled
from tissue.core.kernel_folder import FILES, cache_directory

_log = logging.getLogger(__name__)


class _Locator(caching._CacheLocator):
    """Where one function is kept, and which source it was compiled from."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._path = cache_directory() / function.__module__
        self._line = function.__code__.co_firstlineno
        self._file = file

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> Any:
        """Return the place of a function."""
        return cls(function, file)

    def get_cache_path(self) -> str:
        """Return the folder of the function's module."""
        return str(self._path)

    def get_source_stamp(self) -> str:
        """Return a digest of the source file."""
        return _digest_of(self._file)

    def get_disambiguator(self) -> str:
        """Return the function's line, which distinguishes two of the same name."""
        return str(self._line)


@functools.cache
def _digest_of(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


@functools.cache
def _stamp_of(function: Callable[..., Any]) -> str:
    """Return a digest of what a function is compiled from, besides the sources of this package.

    That is its file, the files of the kernels that it calls, and the constants that these name.
    """
    found, left, seen = set[str](), [function], set[Any]()
    while left:
        each = left.pop()
        if each in seen:
            continue
        seen.add(each)
        found.add(_digest_of(each.__code__.co_filename))
        if each.__code__.co_filename in FILES:
            continue
        for name in each.__code__.co_names:
            value: Any = each.__globals__.get(name)
            if hasattr(value, "py_func"):
                left.append(value.py_func)
            elif isinstance(value, (int, float, str, tuple)):
                found.add(f"{name} = {value!r}")
    return hashlib.sha256("\n".join(sorted(found)).encode()).hexdigest()


class _Results(caching.CacheImpl):
    """Stores results of the compiler, whose libraries know how they are stored."""

    _locator_classes = [_Locator]  # noqa: RUF012 (Numba's own attribute)

    def __init__(self, function: Callable[..., Any], library: Any) -> None:
        self._library = library
        super().__init__(function)

    def get_filename_base(self, name: str, abi: str) -> str:
        """Return the name of the files."""
        return f"{super().get_filename_base(name, abi)}-{self._library.kind}"

    def check_cachable(self, result: Any) -> bool:
        """Return whether another process can use it."""
        return not result.library.has_dynamic_globals and result.library.can_be_stored

    def reduce(self, result: Any) -> tuple[Any, ...]:
        """Return what is written."""
        description = result.fndesc
        description.typemap = description.calltypes = None  # large, and needed no more
        return (
            result.library.stored(),
            description,
            result.environment,
            result.signature,
            result.reload_init,
        )

    def rebuild(self, context: Any, content: tuple[Any, ...]) -> Any:
        """Return the result that was written."""
        stored, description, environment, signature, reload_init = content
        for prepare in reload_init:
            prepare()
        library = self._library.restored(context.codegen(), stored)
        return compiler.compile_result(
            typing_context=context.typing_context,
            target_context=context,
            entry_point=context.get_executable(library, description, environment),
            signature=signature,
            objectmode=False,
            lifted=(),
            fndesc=description,
            library=library,
            environment=environment,
            reload_init=reload_init,
        )


class _Files(caching.IndexDataCacheFile):
    """One file for each signature, named after it.

    Numba keeps an index next to numbered files; two processes that write at once mix them up.
    """

    def __init__(self, path: str, base: str, function: Callable[..., Any]) -> None:
        super().__init__(path, base, source_stamp=None)
        self._function = function

    def save(self, key: Any, data: Any) -> None:
        """Write the result for a signature."""
        self._save_data(self._name(key), data)

    def load(self, key: Any) -> Any:
        """Return the result for a signature, from the bundle first; None where there is none."""
        name = self._name(key)
        packed = bundled(f"{Path(self._cache_path).name}/{name}")
        if packed is not None:
            return pickle.loads(packed)
        try:
            return self._load_data(name)
        except OSError:
            return None

    def flush(self) -> None:
        """Leave the files, which other processes may use."""

    def _name(self, key: Any) -> str:
        # Only now: a kernel may call others that its module defines behind it.
        described = f"{_stamp_of(self._function)} {key}"
        digest = hashlib.sha256(described.encode()).hexdigest()[:16]
        return str(self._data_name_pattern.replace("{number:d}", digest))


class KernelCache(caching.Cache):
    """The cache of one function, which may be read-only."""

    def __init__(self, function: Callable[..., Any], library: Any) -> None:
        self._impl_class: Any = functools.partial(_Results, library=library)
        super().__init__(function)
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, function)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return a result that was written, or None.

        Numba searches all its registries for new code before each; once is enough.
        """
        _refresh_once(context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(signature, context)

    def _index_key(self, signature: Any, codegen: Any) -> Any:
        """Return what tells results of the function apart, beside its source and the processor.

        They are in the names of the file (`_stamp_of`) and of the folder.
        """
        cells = self._py_func.__closure__ or ()
        values = dumps(tuple(cell.cell_contents for cell in cells)) if cells else b""
        return signature, hashlib.sha256(values).hexdigest()

    def save_overload(self, signature: Any, result: Any) -> None:
        """Write a result; without a place to write, the next process compiles it again."""
        try:
            super().save_overload(signature, result)
        except OSError as error:
            _warn_once(f"compiled kernels are not kept: {error}")


@functools.cache
def _warn_once(message: str) -> None:
    _log.warning(message)


@functools.cache
def _refresh_once(context: Any) -> None:
    context.refresh()
