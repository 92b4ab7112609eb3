"""The compiler driver on top of numba: one library per function called from Python, with its callees inside.

The compiler's own way makes machine code, and wrappers that unpack nested tuples of arrays, of every function
on every level of calls, and types constants in calls as kinds of their own; only the outermost is ever
run.  Here a function is compiled once per types of arguments, to the compiler's intermediate language, for
compiled code that calls it (a part), and to machine code when Python calls it (an entry), with every
part inside and no name shared with another entry: what an entry computes depends neither on which others
were loaded nor on whether it was compiled here.

This rests on what numba does not promise: with other releases than those that it was tried with this module
cannot be imported, and `decorator` goes the compiler's own way.
"""

from __future__ import annotations

import gc
import operator
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, ClassVar

import llvmlite.binding as llvm
import numba
from numba.core import types
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import _FunctionCompiler
from numba.core.registry import CPUDispatcher
from numba.core.typing import Context
from numba.extending import models, register_model

from .cache import Kept

# the releases that it was tried with, the first and the last
TRIED = ((0, 60), (0, 68))
if not TRIED[0] <= tuple(map(int, numba.__version__.split(".")[:2])) <= TRIED[1]:
    raise ImportError(f"numba {numba.__version__} is none of the releases that this was tried with")


class Part(JITCodeLibrary):
    """A function for compiled code alone: neither linked nor optimised as a whole, and never run."""

    def _optimize_functions(self, ll_module: Any) -> None:
        # what reads a field is taken in first (`references`); in other releases with all the rest
        if hasattr(self._codegen, "_pass_builder"):
            manager = llvm.create_new_module_pass_manager()
            manager.add_always_inliner_pass()
            manager.run(ll_module, self._codegen._pass_builder())
        super()._optimize_functions(ll_module)

    def finalize(self) -> None:
        """Take nothing more."""
        self._raise_if_finalized()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """With all that it calls: for code that is not ours."""
        if self._shared_module is None:
            module = self._final_module.clone()
            _take_in(module, self)
            for function in _defined(module):
                if function.linkage == llvm.Linkage.external:
                    function.linkage = "linkonce_odr"
            self._shared_module = module
        return self._shared_module


class Entry(JITCodeLibrary):
    """A function for Python, with all that it calls inside; only its wrapper has a name outside."""

    def finalize(self) -> None:
        """Link every part once, and make machine code of the whole."""
        wrappers = {function.name for function in _defined(self._final_module) if "cpython" in function.name}
        _take_in(self._final_module, self)
        self._linking_libraries = []
        for function in _defined(self._final_module):
            if function.name not in wrappers:
                function.linkage = "internal"
        super().finalize()


def _defined(module: Any) -> list[Any]:
    return [function for function in module.functions if not function.is_declaration]


def _take_in(module: Any, library: Any) -> None:
    """Link what a library calls into a module, directly or through others, each once."""
    seen: set[Any] = set()
    rest = list(library._linking_libraries)
    while rest:
        called = rest.pop(0)
        if called not in seen:
            seen.add(called)
            if isinstance(called, Part):
                rest += called._linking_libraries
                module.link_in(called._final_module, preserve=True)
            else:
                module.link_in(called._get_module_for_linking(), preserve=True)


class _Fixed(Flags):
    """Flags of a function, one object for all functions that have the same.

    The compiler looks thousands of times for what it knows of a call under the caller's flags, and compares
    them option by option: a seventh of its time.
    """

    __slots__ = ("_hash",)
    _known: ClassVar[dict[Any, _Fixed]] = {}

    def __hash__(self) -> int:
        return self._hash  # type: ignore[no-any-return]

    def __eq__(self, other: object) -> bool:
        return self is other if isinstance(other, _Fixed) else super().__eq__(other)

    def copy(self) -> _Fixed:
        return self

    @classmethod
    def of(cls, flags: Any) -> _Fixed:
        """The one object."""
        fixed = cls(flags)
        fixed._hash = Flags.__hash__(fixed)
        return cls._known.setdefault(repr(fixed), fixed)


class _Operator(types.Function):
    """An operator, which keeps in mind what it makes of types.

    The compiler looks through a dozen ways to understand one, at each place where one stands, twice: a
    sixth of its time.
    """

    def __init__(self, function: Any) -> None:
        super().__init__(function.templates)
        self._call_types: dict[Any, Any] = {}

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """See `types.Function`."""
        if kws:
            return super().get_call_type(context, args, kws)
        if args not in self._call_types:
            self._call_types[args] = super().get_call_type(context, args, kws)
        return self._call_types[args]


register_model(_Operator)(models.OpaqueModel)
_OPERATORS = {function for function in vars(operator).values() if callable(function)}
_operator = cache(_Operator)


class _Typing(Context):
    """What the compiler knows of types, with operators that keep theirs in mind."""

    @classmethod
    @cache
    def of(cls, context: Any) -> _Typing:
        """The same knowledge, shared."""
        typing = cls.__new__(cls)
        typing.__dict__ = context.__dict__
        return typing

    def resolve_value_type(self, val: Any) -> Any:
        """See `Context`."""
        value_type = super().resolve_value_type(val)
        return _operator(value_type) if getattr(value_type, "typing_key", None) in _OPERATORS else value_type


class _PartCompiler(Compiler):
    """The usual passes, to a part."""

    def compile_extra(self, func: Any) -> Any:
        # no address is asked for: there is no machine code that would have one
        self.state.flags.no_compile = True
        self.state.flags = _Fixed.of(self.state.flags)
        self.state.typingctx = self.state.targetctx.typing_context = _Typing.of(self.state.typingctx)
        self.state.library = Part(self.state.targetctx.codegen(), func.__qualname__)
        return super().compile_extra(func)


_NO_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class _PartOf(CPUDispatcher):
    """The function as compiled code calls it."""

    def __init__(self, py_func: Any, locals: Any, targetoptions: dict[str, Any]) -> None:
        super().__init__(py_func, locals, {**targetoptions, **_NO_WRAPPERS}, _PartCompiler)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        # a constant is no type of its own
        args = tuple(types.unliteral(kind) for kind in args)
        return super().get_call_template(args, {name: types.unliteral(kind) for name, kind in kws.items()})

    def add_overload(self, cres: Any) -> None:
        """Put it where compiled code looks for it; there is nothing that Python could call."""
        name = object()
        self.targetctx.insert_user_function(name, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres._replace(entry_point=name)

    def compiled_for(self, args: tuple[Any, ...]) -> Any:
        """What there is of it for types of arguments."""
        self.compile(args)
        return self.overloads[args]


class _EntryCompiler(_FunctionCompiler):
    """An entry of a part: its wrapper for calls from Python, and machine code."""

    part: _PartOf

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        cres = self.part.compiled_for(args)
        descriptor, target = cres.fndesc, cres.target_context
        library = Entry(target.codegen(), descriptor.qualname)
        library.enable_object_caching()
        library.add_linking_library(cres.library)
        context = target.subtarget(environment=cres.environment, fndesc=descriptor)
        with target.push_code_library(library):
            context.create_cpython_wrapper(
                library, descriptor, cres.environment, cres.call_helper, release_gil=True
            )
        function = target.get_executable(library, descriptor, cres.environment)
        return cres._replace(library=library, entry_point=function, metadata={})


@contextmanager
def _collector_off() -> Iterator[None]:
    """Compiling makes objects by the million, and few circles: looking for them takes a tenth of it."""
    on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if on:
            gc.enable()


class Function(CPUDispatcher):
    """A function that Python and compiled code can call."""

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None) -> None:
        options = targetoptions or {}
        super().__init__(py_func, locals or {}, options)
        self.part = _PartOf(py_func, locals or {}, options)
        self._compiler = _EntryCompiler(py_func, self.targetdescr, options, self.locals, None)
        self._compiler.part = self.part

    def compile(self, sig: Any) -> Any:
        """See `numba.core.dispatcher.Dispatcher`: from what was kept, or by one process at a time."""
        if isinstance(self._cache, NullCache):
            # (looked for when it is first needed: importing is not to touch hundreds of files)
            self._cache = Kept(self.py_func)
        with global_compiler_lock, _collector_off(), self._cache.turn():
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """See `numba.core.types.Dispatcher`: what compiled code calls is the part."""
        return self.part.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """See `get_call_template`."""
        return self.part.get_overload(sig)
