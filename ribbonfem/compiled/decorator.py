"""The one decorator of compiled code.

A function is compiled for where it is called from: from Python, to machine code with all that it calls
inside, which is kept between processes; from compiled code, to a part of that (`entries`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import config, njit

try:
    from .entries import Function
except ImportError:
    # (another release of the compiler: every function is compiled for both)
    Function = None  # type: ignore[assignment, misc]


def compiled(*, allocates: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: the function compiled, kept between processes, without the interpreter's lock.

    Parameters
    ----------
    allocates: whether it makes or returns arrays.  What does not is compiled without the counting of
        references, a tenth of the time of a small beam's loop, and cannot allocate by mistake.
    options: further ones of `numba.njit`, such as `fastmath` and `forceinline`.
    """
    options = {"nogil": True, "_nrt": allocates, **options}

    def decorate(function: Callable[..., Any]) -> Any:
        if config.DISABLE_JIT:
            return function
        if Function is None:
            return _plain(function, options)
        return Function(function, targetoptions={"nopython": True, **options})

    return decorate


def _plain(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """The compiler's own way, with our files where it takes them."""
    dispatcher = njit(**options)(function)
    try:
        from .kept import Kept

        dispatcher._cache = Kept(function)
    except ImportError:
        # every process compiles anew
        pass
    return dispatcher
