"""The one decorator of compiled code, whose cache sees a change in every file that the code stands on."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

from numba import njit

from .sources import digest


def compiled(*, allocates: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: the function compiled, kept between processes, without the interpreter's lock.

    Parameters
    ----------
    allocates: whether it makes or returns arrays.  What does not is compiled without the counting of
        references, a tenth of the time of a small beam's loop, and cannot allocate by mistake.
    options: further ones of `numba.njit`, such as `error_model` and `fastmath`.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = njit(cache=True, nogil=True, _nrt=allocates, **options)(function)
        if not hasattr(dispatcher, "py_func"):
            # the compiler is switched off: there is nothing to keep
            return dispatcher
        try:
            kept = dispatcher._cache._cache_file
            # an attribute that is not there would be made by assignment, and mean nothing
            kept._source_stamp  # noqa: B018
            load = kept._load_index
        except AttributeError:
            _warn_once()
            return njit(nogil=True, _nrt=allocates, **options)(function)
        kept._source_stamp = digest(function.__module__)
        kept._load_index = partial(_readable, load)
        return dispatcher

    return decorate


def _readable(load: Callable[[], dict[Any, Any]]) -> dict[Any, Any]:
    """What is kept of a function; nothing if of arguments whose class this release does not have."""
    try:
        return load()
    except (ImportError, AttributeError):
        return {}


@lru_cache(maxsize=1)
def _warn_once() -> None:
    warnings.warn(
        "this release of numba does not let ribbonfem say what its compiled code depends on: nothing is "
        "kept, and every process compiles anew (releases 0.60 to 0.68 do)",
        RuntimeWarning,
        stacklevel=4,
    )
