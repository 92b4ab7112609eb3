"""The rules of the house: what may import what, read off the sources."""

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for room in ("ribbonfem", "der", "compare")
    for path in (ROOT / room).rglob("*.py")
}
# what stands to the left of each room: a room may import from these, and from itself
PROBLEM = {
    f"ribbonfem.{n}"
    for n in (
        "ribbon",
        "scene",
        "scene_checks",
        "scene_numbers",
        "control_in_time",
        "state_names",
        "results",
        "equilibria",
        "fold_curves",
        "history",
        "events",
        "frozen",
        "options",
        "public_names",
        "row_buffer",
        "rows",
        "drive",
        "schedule",
        "csv_columns",
        "measured",
    )
}
# (a method of Runge and Kutta is data, and knows no mechanics)
PROBLEM |= {"ribbonfem.model_info", "ribbonfem.outcomes", "ribbonfem.tableaus"}
GENERIC = (
    "jit",
    "linalg",
    "ends",
    "material",
    "elements",
    "closed_form",
    "continuation",
    "stepping",
    "delay",
)
MATHEMATICS = {f"ribbonfem.{n}" for n in GENERIC}
ELEMENTS = {f"ribbonfem.{n}" for n in ("quasilinear", "elastica", "kirchhoff")}
# banded solves are linear algebra and no mechanics
SHARED = (
    PROBLEM | {"ribbonfem"} | {f"ribbonfem.{n}" for n in ("continuation", "jit", "linalg", "ends", "delay")}
)
OUTPUT = {"ribbonfem.output"}
BELOW = PROBLEM | MATHEMATICS | ELEMENTS | OUTPUT | {"ribbonfem", "der"}


def _of(*names):
    return {f"compare.{name}" for name in names}


ALLOWED = {
    **{room: PROBLEM for room in PROBLEM},
    **{room: PROBLEM | MATHEMATICS for room in MATHEMATICS},
    **{room: PROBLEM | MATHEMATICS | {room} for room in ELEMENTS},
    "ribbonfem.output": PROBLEM | OUTPUT | {"ribbonfem"},
    "der": SHARED | {"der"},
    "compare.archive": OUTPUT | _of("archive"),
    "compare.limits": {"ribbonfem.results", "compare.limits"},
    "compare.models": BELOW | _of("models"),
    "compare.sweep": OUTPUT | _of("sweep", "archive"),
    "compare.report": PROBLEM | OUTPUT | {"ribbonfem"} | _of("report", "archive", "sweep"),
    "compare.quantities": BELOW | _of("quantities", "models", "limits", "archive", "sweep"),
}
ALLOWED["compare.chooser"] = ALLOWED["compare.quantities"] | _of("chooser")
ALLOWED["compare.fitting"] = ALLOWED["compare.chooser"] | _of("fitting")
ALLOWED["compare.external"] = ALLOWED["compare.quantities"] | _of("external")
ALLOWED["compare.diagrams"] = ALLOWED["compare.chooser"] | _of("diagrams", "report")
# an example asks as a user does: public names of `compare`, and the models
ALLOWED["compare.examples"] = BELOW | {"compare"} | _of("quantities", "examples")
ALLOWED["compare.studies"] = ALLOWED["compare.diagrams"] | _of("studies", "external")
ALLOWED["compare.reproduction"] = ALLOWED["compare.diagrams"] | _of("reproduction")
ALLOWED["compare.commands"] = ALLOWED["compare.diagrams"] | _of("commands", "compilation", "fitting")


def room(name):
    """The room of a module: of `ribbonfem` and `compare` the second name, of `der` the first."""
    parts = name.split(".")
    return parts[0] if parts[0] == "der" else ".".join(parts[:2])


def imports(name):
    """Modules and packages that a module imports, whole or in part, wherever in its file."""
    path = FILES[name]
    package = path.relative_to(ROOT).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            stem = list(package[: len(package) - node.level + 1]) if node.level else []
            stem = ".".join([*stem, *([node.module] if node.module else [])])
            for alias in node.names:
                whole = f"{stem}.{alias.name}"
                yield whole if whole in FILES else stem


@cache
def ours(name):
    return tuple(r for r in imports(name) if r.split(".")[0] in ("ribbonfem", "der", "compare"))


@pytest.mark.parametrize("name", sorted(FILES))
def test_a_room_imports_from_its_left_alone(name):
    mine = room(name)
    # what is in no list, the packages themselves, may know all of it
    for result in ours(name) if mine in ALLOWED else ():
        assert room(result) in ALLOWED[mine], f"{name} imports {result}: {mine} may not know it"


def test_a_command_imports_no_other_command():
    # (the runner that the campaigns share is none)
    for name in FILES:
        parts = name.split(".")
        if parts[:2] not in (["compare", "commands"], ["compare", "studies"]) or len(parts) < 3:
            continue
        for result in ours(name):
            other = result.split(".")
            if other[:2] == parts[:2]:
                assert len(other) < 3 or other[2] in (parts[2], "study"), f"{name} imports {result}"


def test_nothing_imports_the_reproduction():
    for name in FILES:
        if room(name) != "compare.reproduction":
            for result in ours(name):
                assert room(result) != "compare.reproduction", f"{name} imports {result}"


def test_no_model_knows_another_and_rods_share_no_mechanics():
    for name in FILES:
        for result in ours(name):
            if room(name) == "der":
                assert room(result) in SHARED | {"der"}, f"{name} imports {result}"
            elif room(name) in PROBLEM | MATHEMATICS | ELEMENTS:
                assert not result.startswith(("der", "compare")), f"{name} imports {result}"


def test_compare_reaches_inside_no_model():
    inside = ("problem", "kernels", "rod", "states", "motion", "loop", "functions", "rest", "discretisation")
    for name in FILES:
        if not name.startswith("compare"):
            continue
        for result in ours(name):
            if room(result) in ELEMENTS | {"der"}:
                assert result.split(".")[-1] not in inside, f"{name} reaches into {result}"


def test_no_circles():
    edges = defaultdict(set)
    for name in FILES:
        for result in ours(name):
            # a package imports its own modules, and they import each other
            if result in FILES and not name.startswith(f"{result}.") and result != name:
                edges[name].add(result)
    done, path = set(), []

    def visit(name):
        assert name not in path, f"a circle: {' -> '.join([*path[path.index(name) :], name])}"
        if name in done:
            return
        path.append(name)
        for result in edges[name]:
            visit(result)
        path.pop()
        done.add(name)

    for name in FILES:
        visit(name)
