"""The store of finished tasks of a sweep: a folder, one file each, so that a killed sweep can go on."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.archive import ArchiveError, from_bytes, to_bytes
from ribbonfem.output.files import write_whole

SUFFIX = ".result"


@dataclass(frozen=True)
class Store:
    """A folder of finished tasks.

    Each file is written aside and put in its place in one move: there are whole files and none else,
    whenever the program is killed.  A file that is cut short, spoilt, or of another task is not
    believed: its task is done again.
    """

    folder: Path

    def path(self, key: str) -> Path:
        """Where the result of a key lies."""
        return self.folder / key[:2] / f"{key}{SUFFIX}"

    def read(self, key: str) -> tuple[Any] | None:
        """The result of a key in a tuple, or None where there is none to be believed."""
        try:
            result = from_bytes(self.path(key).read_bytes())
        except (OSError, ArchiveError):
            return None
        if not (isinstance(result, dict) and result.get("key") == key and "result" in result):
            return None
        return (result["result"],)

    def write(self, key: str, result: Any) -> None:
        """Keep a result.

        Raises
        ------
        OSError
            If the folder cannot be written, or the disk is full.
        """
        write_whole(self.path(key), to_bytes({"key": key, "result": result}))

    def clear(self) -> None:
        """Forget all results."""
        shutil.rmtree(self.folder, ignore_errors=True)
