"""Compiles a kernel once as a part for other kernels, and as a program where Python calls it.

Numba optimises each function, translates it to machine code and wraps it for Python, and does the
same again to the copy of it in each caller. Six of seven kernels of the engine are called by
kernels alone. So a kernel becomes a `_Part` first: typed and lowered to LLVM's language, neither
optimised as a whole nor translated. The first call from Python makes a `_Program`: the part, all
parts that it calls and a wrapper, optimised together and translated. The engine compiles in half of
the time, to the same bits.
"""

import importlib
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple, Self, cast

import llvmlite.binding as llvm
import numba
from numba.core import codegen, compiler, environment
from numba.core.compiler_machinery import PassManager
from numba.core.typed_passes import (
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.types import unliteral
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    RewriteSemanticConstants,
    TranslateByteCode,
)

from tissue.core.kernel_cache import KernelCache
from tissue.core.shortcuts import shortcuts


class _Origin(NamedTuple):
    """Where a part comes from, so that a cached caller finds it again."""

    module: str
    name: str
    arguments: tuple[Any, ...]
    """Numba's types of its arguments."""

    @property
    def is_in_a_module(self) -> bool:
        """Whether it can be imported: it is not inside a function or the program that runs."""
        return "." not in self.name and self.module != "__main__"

    def part(self) -> "_Part":
        """Return the part, compiled where the cache does not have it."""
        kernel = getattr(importlib.import_module(self.module), self.name)
        part: _Part = _part_of(kernel.py_func, self.arguments).library
        return part


class _Part(codegen.JITCodeLibrary):
    """A kernel in LLVM's language, next to the parts that it calls."""

    kind: ClassVar[str] = "part"

    def __init__(self, owner: Any, name: str, origin: _Origin | None = None) -> None:
        super().__init__(owner, name)
        self.origin = origin
        self.needs: list[_Part] = []

    @property
    def codegen(self) -> Any:
        """Stands in for the code generator: Numba sets a variable in code that is not made yet."""
        return SimpleNamespace(set_env=lambda name, value: None)

    def finalize(self) -> None:
        """Take in the code of Numba's own functions, and leave that of kernels where it is."""
        for library in dict.fromkeys(self._linking_libraries):
            if isinstance(library, _Part):
                self.needs.append(library)
            else:
                self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: Python does not call a part."""
        self._ensure_finalized()
        return 0

    def add_to(self, parts: "dict[_Part, None]") -> None:
        """Add this part, and all that it needs."""
        if self not in parts:
            parts[self] = None
            for part in self.needs:
                part.add_to(parts)

    @property
    def can_be_stored(self) -> bool:
        """Whether another process can find the parts that it needs."""
        return all(part.origin is not None and part.origin.is_in_a_module for part in self.needs)

    def stored(self) -> tuple[Any, ...]:
        """Return what the cache keeps."""
        code = self._get_module_for_linking().as_bitcode()
        return self.name, self.origin, [part.origin for part in self.needs], code

    @classmethod
    def restored(cls, owner: Any, stored: tuple[Any, ...]) -> Self:
        """Return the part that was stored."""
        name, origin, needs, code = stored
        part = cls(owner, name, origin)
        part._shared_module = part._final_module = llvm.parse_bitcode(code)
        part.needs = [each.part() for each in needs]
        part._finalized = True
        return part


class _Program(codegen.JITCodeLibrary):
    """Machine code of a kernel that Python calls."""

    kind: ClassVar[str] = "program"
    can_be_stored: ClassVar[bool] = True

    def __init__(self, owner: Any, name: str) -> None:
        super().__init__(owner, name)
        self.enable_object_caching()
        self.environments: list[Any] = []

    def finalize(self) -> None:
        """Link, optimise and translate the kernel with all that it calls."""
        parts: dict[_Part, None] = {}
        for part in self._linking_libraries:
            part.add_to(parts)
        self._linking_libraries = list(parts)
        super().finalize()
        names = [variable.name for variable in self._final_module.global_variables]
        found = [environment.lookup_environment(name) for name in names]
        self._set_environments([each for each in found if each is not None])

    def _optimize_final_module(self) -> None:
        """Run the passes of the highest level.

        Numba runs cheaper ones before, so that reference counts can be pruned; kernels have none.
        """
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def _set_environments(self, environments: list[Any]) -> None:
        """Point the code at Python objects in which Numba keeps constants of each function."""
        self.environments = environments
        for each in environments:
            cast(Any, self._codegen).set_env(each.env_name, each)

    def stored(self) -> tuple[Any, ...]:
        """Return what the cache keeps."""
        module = self._final_module
        values = [*module.functions, *module.global_variables]
        names = {value.name for value in values if not value.is_declaration}
        return self.name, self._get_compiled_object(), names, self.environments

    @classmethod
    def restored(cls, owner: Any, stored: tuple[Any, ...]) -> Self:
        """Return the program that was stored."""
        name, code, names, environments = stored
        program = cls(owner, name)
        program._set_compiled_object(code)
        program._finalize_final_module()
        owner._engine._defined_symbols |= names
        program._set_environments(environments)
        return program


_PASSES = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    RewriteSemanticConstants,
    DeadBranchPrune,
    GenericRewrites,
    ReconstructSSA,
    NopythonTypeInference,
    PreLowerStripPhis,
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
)
"""Numba's passes that a kernel needs. Left out are those for what no kernel has: closures, `with`,
loops over tuples of several types, expressions of whole arrays."""


class _PartCompiler(compiler.CompilerBase):
    """Numba's compiler, ending in a `_Part`."""

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        """Return the part of a kernel."""
        with shortcuts():
            return super().compile_extra(function)

    def define_pipelines(self) -> Any:
        """Return the passes.

        Numba numbers functions in the order in which a process meets them, and the number is a part
        of a name in the code. Here it is the line, so that parts from several processes fit.
        """
        state, function = self.state, self.state.func_id
        origin = _Origin(function.modname, function.func_qualname, tuple(state.args))
        if origin.is_in_a_module:
            function.unique_id = function.firstlineno
            function.unique_name = f"{function.func_qualname}${function.firstlineno}"
        state.library = _Part(state.targetctx.codegen(), function.func_qualname, origin)
        passes = PassManager("part")
        for each in _PASSES:
            passes.add_pass(each, each.__name__)
        passes.finalize()
        return [passes]


class _ProgramCompiler(compiler.CompilerBase):
    """Makes a `_Program` of a part."""

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        """Return the kernel, wrapped for Python."""
        state, context = self.state, self.state.targetctx
        part = _part_of(function, tuple(state.args))
        program = _Program(context.codegen(), part.library.name)
        program.add_linking_library(part.library)
        with shortcuts():
            with context.push_code_library(program):
                context.create_cpython_wrapper(
                    program, part.fndesc, part.environment, None, state.flags.release_gil
                )
            return compiler.compile_result(
                typing_context=state.typingctx,
                target_context=context,
                entry_point=context.get_executable(program, part.fndesc, part.environment),
                signature=part.signature,
                objectmode=False,
                lifted=(),
                fndesc=part.fndesc,
                library=program,
                environment=part.environment,
                metadata={},
                reload_init=part.reload_init,
            )


_PARTS: dict[Callable[..., Any], Any] = {}
"""Compiler of the part of each kernel."""


def _part_of(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Return Numba's result for the part of a kernel."""
    part = _PARTS[function]
    part.compile(arguments)
    return part.overloads[arguments]


def in_parts(function: Callable[..., Any], flags: dict[str, Any]) -> Any:
    """Return the kernel, which is compiled as it is called."""
    njit = cast(Any, numba.njit)
    part = njit(pipeline_class=_PartCompiler, no_cpython_wrapper=True, **flags)(function)
    part._cache = KernelCache(function, _Part)
    _PARTS[function] = part
    program = njit(pipeline_class=_ProgramCompiler, **flags)(function)
    program._cache = KernelCache(function, _Program)

    def call_template(arguments: Any, keywords: Any) -> Any:
        """Make calls with constants share the code of calls with variables.

        Numba compiles a function again for each constant that another kernel passes to it: a third
        of the engine's compile time, for code that is inlined anyway.
        """
        return part.get_call_template(
            tuple(unliteral(argument) for argument in arguments),
            {name: unliteral(argument) for name, argument in keywords.items()},
        )

    program.get_call_template = call_template  # other kernels call the part
    program.get_overload = part.get_overload
    return program
