"""Atomic writing of files: whole, or not at all."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# s; for so long a file is written again whose folder is taken away meanwhile
_PATIENCE = 5.0


def _aside(target: Path, suffix: str) -> Path:
    """A new empty file beside a target, of a name that no other process has, and of its mode."""
    while True:
        aside = target.with_name(f".{secrets.token_hex(8)}{suffix}")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            # (as `open` would make it: what the process's mask allows)
            os.close(os.open(aside, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except FileExistsError:
            if target.parent.exists() and not target.parent.is_dir():
                raise
            # a name that is taken, or a folder that another process has taken away
            continue
        with suppress(FileNotFoundError):
            was = target.stat()
            os.chmod(aside, stat.S_IMODE(was.st_mode))
            with suppress(OSError):
                os.chown(aside, was.st_uid, was.st_gid)
        return aside


@contextmanager
def whole(path: Path, suffix: str = "") -> Iterator[Path]:
    """A file aside to write to, which takes the place of `path` at the end: whole, or not at all.

    What a link leads to is written, and stays a link; a file keeps its mode; a device or a pipe is written
    to, and stays what it is.

    Raises
    ------
    OSError
        If the disk is full or the folder cannot be written; the file is then as it was.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    special = target.exists() and not target.is_file()
    aside = _aside(Path(tempfile.gettempdir()) / "x" if special else target, suffix)
    try:
        yield aside
        if special:
            with aside.open("rb") as source, target.open("wb") as sink:
                shutil.copyfileobj(source, sink)
        else:
            os.replace(aside, target)
    finally:
        aside.unlink(missing_ok=True)


def write_whole(path: Path, content: bytes | str) -> None:
    """Write a file whole or not at all, in UTF-8 whatever the locale; errors as of `whole`."""
    # (names of files may hold bytes that are no letters)
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    until = time.monotonic() + _PATIENCE
    while True:
        try:
            with whole(path) as aside:
                aside.write_bytes(data)
            return
        except FileNotFoundError:
            # another process may clear a folder that this one writes to
            if time.monotonic() > until:
                raise
            time.sleep(1e-3)
