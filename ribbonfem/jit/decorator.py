"""The decorator `@compiled` of all kernels; what compiles them is in `entries.py`, their cache in `cache.py`.

A function is compiled for where it is called from: from Python, to machine code with all that it calls
inside, which is kept between processes; from compiled code, to a part of that (`entries`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from numba import config, njit

try:
    from .entries import Function
except ImportError:
    # (another release of the compiler: every function is compiled for both)
    Function = None  # type: ignore[assignment, misc]


def compiled(
    *, allocates: bool = False, inline: bool = False, fastmath: Collection[str] = ()
) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: the function compiled, kept between processes, without the interpreter's lock.

    A division by zero gives infinity, as in numpy.

    Parameters
    ----------
    allocates: whether it makes or returns arrays.  What does not is compiled without the counting of
        references, a tenth of the time of a small beam's loop, and cannot allocate by mistake.
    inline: whether it is compiled into every caller: for what is called for an element, a point or a node.
    fastmath: what the compiler may do to sums and products; the same for all kernels of a package.
    """
    options = {
        "nogil": True,
        "error_model": "numpy",
        "_nrt": allocates,
        "forceinline": inline,
        "fastmath": set(fastmath),
    }

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
        from .cache import Kept

        dispatcher._cache = Kept(function)
    except ImportError:
        # every process compiles anew
        pass
    return dispatcher
