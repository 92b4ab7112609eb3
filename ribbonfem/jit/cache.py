"""The cache of compiled code on disk: where its files are, how they are checked, read and written.

numba's own cache has an index and numbered data files a function: processes that save at once can give
one signature the code of another, a file cut short is an error in every later run, and so is a folder that
cannot be written.  Here every entry has one file, named by what it is called with, which holds a digest of
what it was made from and of what it holds.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cached_property, lru_cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import IO, Any

import llvmlite
import numba
from numba import config
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from .sources import digest

try:
    import fcntl
except ImportError:  # pragma: no cover (elsewhere than on Unix every process compiles for itself)
    fcntl = None  # type: ignore[assignment]


@lru_cache(maxsize=1)
def warn_once(reason: str) -> None:
    """Say that compiled code is not kept, and why."""
    warnings.warn(
        f"compiled code is not kept, so that every process compiles anew: {reason}.  The environment "
        "variable NUMBA_CACHE_DIR names a folder for it.",
        RuntimeWarning,
        stacklevel=2,
    )


def folders(source: Path) -> list[Path]:
    """Where code of a source file may be kept, the first one first."""
    name = f"{source.parent.name}_{hashlib.sha256(str(source.parent).encode()).hexdigest()[:16]}"
    if config.CACHE_DIR:
        return [Path(config.CACHE_DIR) / name]
    result = [source.parent / "__pycache__"]
    with suppress(RuntimeError):
        # (there may be no home)
        home = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        result.append(Path(home) / "ribbonfem" / name)
    return result


def made_from(module: str) -> bytes:
    """What the code of a module of kernels depends on."""
    return repr((sys.version, numba.__version__, llvmlite.__version__, digest(module))).encode()


def read(places: list[Path], name: str, made: bytes) -> bytes | None:
    """The payload of a file that is whole, and was made from the same."""
    for folder in places:
        with suppress(OSError):
            data = (folder / name).read_bytes()
            if data[:32] == hashlib.sha256(made + data[32:]).digest():
                return data[32:]
    return None


def write(places: list[Path], name: str, made: bytes, payload: bytes) -> None:
    """Keep a payload in the first folder that takes it."""
    reason = "there is no folder for it"
    for folder in places:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            _put(folder / name, hashlib.sha256(made + payload).digest() + payload)
        except OSError as error:
            reason = str(error)
        else:
            return
    warn_once(reason)


class Kept(_Cache):
    """What is kept of one function, an entry a file."""

    def __init__(self, function: Any) -> None:
        self._function = function
        self._turn: IO[bytes] | None = None
        # what a function inside of another stands on is not in its file alone
        inside = function.__closure__ is not None
        self._folders = [] if inside else folders(Path(function.__code__.co_filename).absolute())

    @property
    def cache_path(self) -> str | None:
        """The folder in which it is looked for first."""
        return str(self._folders[0]) if self._folders else None

    def enable(self) -> None:
        """See `numba.core.caching`: it is always on."""

    disable = flush = enable

    @cached_property
    def _made_from(self) -> bytes:
        return made_from(self._function.__module__)

    def _name(self, sig: Any, codegen: Any) -> str:
        code = self._function.__code__
        key = hashlib.sha256(repr((sig, codegen.magic_tuple(), code.co_firstlineno)).encode()).hexdigest()
        tag = sys.implementation.cache_tag
        return f"{self._function.__qualname__.replace('<locals>.', '')}-{key[:20]}.{tag}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is kept for a signature, or None; then it is this process's turn to compile it (`turn`)."""
        target_context.refresh()
        name = self._name(sig, target_context.codegen())
        payload = read(self._folders, name, self._made_from)
        if payload is None and self._wait(name):
            # another process may have made it meanwhile
            payload = read(self._folders, name, self._made_from)
        if payload is None:
            return None
        try:
            return CompileResult._rebuild(target_context, *pickle.loads(payload))
        except (ImportError, AttributeError):
            # of arguments whose class this release does not have
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled in the first folder that takes it."""
        if self._folders:
            name = self._name(sig, data.codegen)
            write(self._folders, name, self._made_from, dumps(data._reduce()))

    def _wait(self, name: str) -> bool:
        """Wait for other processes that compile the same; whether one could be waited for."""
        if fcntl is None:
            return False
        for folder in self._folders:
            with suppress(OSError):
                folder.mkdir(parents=True, exist_ok=True)
                self._turn = (folder / "compiling.lock").open("ab")
                # a byte an entry: others are compiled at the same time
                place = int(hashlib.sha256(name.encode()).hexdigest()[:7], 16)
                fcntl.lockf(self._turn, fcntl.LOCK_EX, 1, place)
                return True
        return False

    @contextmanager
    def turn(self) -> Iterator[None]:
        """What is compiled inside is compiled by one process at a time."""
        try:
            yield
        finally:
            if self._turn is not None:
                self._turn.close()
                self._turn = None


def _put(path: Path, content: bytes) -> None:
    """Write a file aside and put it in its place: whoever reads it meanwhile finds all of it or nothing."""
    with NamedTemporaryFile(dir=path.parent, prefix=path.name, suffix=".tmp", delete=False) as file:
        try:
            file.write(content)
            file.close()
            Path(file.name).replace(path)
        except BaseException:
            file.close()
            Path(file.name).unlink(missing_ok=True)
            raise
