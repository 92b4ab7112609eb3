"""Results saved to files and loaded again: any frozen record of the package, equal to what was saved.

A file is a zip of one JSON tree and of the arrays in it as ``.npy``.  It holds data and no code: what is
read back are numbers, words, containers, arrays and the package's own dataclasses, and nothing else can
come out of it.  The bytes depend on the result alone, so that equal results make equal files.
"""

from __future__ import annotations

import dataclasses
import io
import json
import math
import zipfile
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ribbonfem.output.files import write_whole

ROOMS = ("ribbonfem", "der", "compare")
TREE = "result.json"
# the mark of everything in the tree that JSON has no word for
_MARK = "!"
# where records stood in files of the version before: modules, or folders of modules
_MOVED = (
    ("compare.measures.quantities", "compare.quantities.measure"),
    ("compare.measures", "compare.quantities"),
    ("compare.diagrams.record", "compare.diagrams.result"),
    ("compare.diagrams.edges", "compare.diagrams.boundaries"),
    ("compare.diagrams.runs", "compare.diagrams.setup"),
    ("compare.chooser.plans", "compare.chooser.strategies"),
    ("compare.chooser.climb", "compare.chooser.refinement"),
    ("compare.face.curve", "ribbonfem.output.curve"),
    ("ribbonfem.values", "ribbonfem.frozen"),
    ("compare.studies.stability.confirmations", "compare.studies.stability.judging"),
    ("compare.studies.calibrate.study", "compare.studies.calibrate"),
    ("compare.reproduction.named", "compare.reproduction.named_runs"),
    ("ribbonfem.delay.fold", "ribbonfem.delay.normal_forms"),
    ("compare.reproduction.folds.shear", "compare.reproduction.folds.shear_section"),
)
# records and fields by their names of the version before
_CLASSES = {"compare.commands.run:Asked": "RunResult"}
_RENAMED = {
    "angle": "control",
    "policy": "options",
    "doubt": "uncertainty",
    "verb": "function",
    "asked": "chosen",
    "rates": "x",
    "dampings": "y",
    "rate": "x",
    "damping": "y",
}
# keys of `--json` that are not the names of the fields
_KEYS = {"options": "policy", "uncertainty": "doubt", "function": "verb"}
# zip files carry times; a result has none
_EPOCH = (1980, 1, 1, 0, 0, 0)


def for_programs(record: Any, names: Iterable[str] | None = None) -> dict[str, Any]:
    """Fields of a record, all by default, by the keys that `--json` has for them: of options, "policy"."""
    return {_KEYS.get(name, name): getattr(record, name) for name in names or vars(record)}


class ArchiveError(ValueError):
    """A file that holds no result of this package, or a value that cannot be kept in one."""


def finite(value: Any) -> Any:
    """A tree for JSON, which knows no infinity and nothing that is no number: null stands for both."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def encode(value: Any, arrays: list[np.ndarray] | None = None) -> Any:
    """A value as a tree for JSON; its arrays go to the list, or into the tree where there is none.

    Raises
    ------
    ArchiveError
        For what is no number, word, container, array or record of the package.
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, np.generic):
        return {_MARK: "scalar", "dtype": value.dtype.str, "value": encode(value.item(), arrays)}
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {_MARK: "float", "value": repr(float(value))}
    if isinstance(value, list):
        return [encode(item, arrays) for item in value]
    if isinstance(value, (tuple, set, frozenset)):
        items = value if isinstance(value, tuple) else sorted(value)
        return {_MARK: type(value).__name__ if type(value) in (set, frozenset) else "tuple"} | {
            "value": [encode(item, arrays) for item in items]
        }
    if isinstance(value, Mapping):
        return {_MARK: "dict", "value": [[encode(k, arrays), encode(v, arrays)] for k, v in value.items()]}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufU":
        if arrays is None:
            return {_MARK: "array", "dtype": value.dtype.str, "value": value.tolist()}
        arrays.append(value)
        return {_MARK: "array", "number": len(arrays) - 1}
    if isinstance(value, Path):
        return {_MARK: "path", "value": str(value)}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        kind = type(value)
        if kind.__module__.split(".")[0] in ROOMS:
            given = {
                f.name: encode(getattr(value, f.name), arrays) for f in dataclasses.fields(value) if f.init
            }
            return {_MARK: "record", "type": f"{kind.__module__}:{kind.__qualname__}", "value": given}
    raise ArchiveError(f"{_shown(value)}: a {type(value).__name__} cannot be kept in a file")


def _record(name: str, given: dict[str, Any]) -> Any:
    module, _, qualname = name.partition(":")
    module = next(
        (new + module[len(old) :] for old, new in _MOVED if f"{module}.".startswith(f"{old}.")), module
    )
    qualname = _CLASSES.get(f"{module}:{qualname}", qualname)
    if module.split(".")[0] not in ROOMS or not qualname.isidentifier():
        raise ArchiveError(f"{name!r} is no record of this package")
    try:
        kind = getattr(import_module(module), qualname)
    except (ImportError, AttributeError):
        raise ArchiveError(f"{name!r}: this version has no such record") from None
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise ArchiveError(f"{name!r} is no record of this package")
    known = {item.name for item in dataclasses.fields(kind)}
    for old, new in _RENAMED.items():
        if old in given and old not in known and new in known:
            given[new] = given.pop(old)
    return kind(**given)


def decode(tree: Any, arrays: list[np.ndarray] | None = None) -> Any:
    """The value of a tree made by `encode`.

    Raises
    ------
    ArchiveError
        If the tree is not of this package's making.
    """
    if isinstance(tree, list):
        return [decode(item, arrays) for item in tree]
    if not isinstance(tree, dict):
        return tree
    kind, value = tree.get(_MARK), tree.get("value")
    if kind == "record":
        return _record(str(tree["type"]), {k: decode(v, arrays) for k, v in dict(value or {}).items()})
    if kind == "dict":
        return {decode(k, arrays): decode(v, arrays) for k, v in value or ()}
    if kind in ("tuple", "set", "frozenset"):
        items = [decode(item, arrays) for item in value or ()]
        return {"tuple": tuple, "set": set, "frozenset": frozenset}[kind](items)
    if kind == "array":
        return np.array(value, dtype=tree["dtype"]) if arrays is None else arrays[tree["number"]]
    if kind == "scalar":
        return np.dtype(tree["dtype"]).type(decode(value, arrays))
    if kind == "float":
        return float(str(value))
    if kind == "path":
        return Path(str(value))
    raise ArchiveError(f"{_shown(tree)} is no part of a result")


def to_bytes(value: Any) -> bytes:
    """A value as the bytes of a file; equal values give equal bytes."""
    arrays: list[np.ndarray] = []
    tree = json.dumps(encode(value, arrays), separators=(",", ":"), ensure_ascii=False)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        content = tree.encode("utf-8", "surrogatepass")
        archive.writestr(zipfile.ZipInfo(TREE, _EPOCH), content, zipfile.ZIP_DEFLATED)
        for number, array in enumerate(arrays):
            part = io.BytesIO()
            np.lib.format.write_array(part, np.ascontiguousarray(array), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{number}.npy", _EPOCH), part.getvalue(), zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def from_bytes(data: bytes) -> Any:
    """The value that `to_bytes` made these bytes of.

    Raises
    ------
    ArchiveError
        If they are cut short, spoilt, or no result of this package.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            tree = json.loads(archive.read(TREE))
            count = sum(name.endswith(".npy") for name in archive.namelist())
            arrays = [
                np.lib.format.read_array(io.BytesIO(archive.read(f"{k}.npy")), allow_pickle=False)
                for k in range(count)
            ]
        return decode(tree, arrays)
    except ArchiveError:
        raise
    except Exception as error:
        # whatever a spoilt file may do to the readers of zip, JSON and arrays
        raise ArchiveError(f"no result of this package: {error}") from None


def save(value: Any, path: str | Path) -> Path:
    """Keep a result in a file, whole or not at all; `load` reads it back.

    Parameters
    ----------
    value: a `History`, `Branch`, `Diagram`, `Convergence` or any other result.
    path: of the file; an existing one is replaced.

    Raises
    ------
    ArchiveError
        For a value that is no result.
    OSError
        If the file cannot be written.
    """
    where = Path(path)
    write_whole(where, to_bytes(value))
    return where


def load(path: str | Path) -> Any:
    """The result that `save` kept in a file.

    Raises
    ------
    ArchiveError
        Naming the file, if it holds no result of this package.
    OSError
        If it cannot be read.
    """
    where = Path(path)
    try:
        return from_bytes(where.read_bytes())
    except ArchiveError as error:
        raise ArchiveError(f"{where}: {error}") from None
