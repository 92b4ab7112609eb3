"""The rules of the house: what may import what, read off the sources."""

import ast
from collections import defaultdict
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
        "results",
        "crossings",
        "values",
        "policy",
        "image",
        "names",
        "growing",
        "rows",
    )
}
# (a method of Runge and Kutta is data, and knows no mechanics)
PROBLEM |= {"ribbonfem.model_info", "ribbonfem.outcomes", "ribbonfem.tableaus"}
GENERIC = ("compiled", "elements", "closed_form", "continuation", "stepping", "delay")
MATHEMATICS = {f"ribbonfem.{n}" for n in GENERIC}
ELEMENTS = {f"ribbonfem.{n}" for n in ("quasilinear", "elastica", "kirchhoff")}
# banded solves are linear algebra and no mechanics
SHARED = PROBLEM | {"ribbonfem", "ribbonfem.continuation", "ribbonfem.jit", "ribbonfem.delay"}
BELOW = PROBLEM | MATHEMATICS | ELEMENTS | {"ribbonfem", "der"}
ALLOWED = {
    **{room: PROBLEM for room in PROBLEM},
    **{room: PROBLEM | MATHEMATICS for room in MATHEMATICS},
    **{room: PROBLEM | MATHEMATICS | {room} for room in ELEMENTS},
    "der": SHARED | {"der"},
    "compare.archive": {"compare.archive"},
    "compare.limits": {"ribbonfem.results", "compare.limits"},
    "compare.models": BELOW | {"compare.models"},
    "compare.sweep": {"compare.sweep", "compare.archive"},
    "compare.report": PROBLEM | {"ribbonfem", "compare.report", "compare.archive"},
    "compare.quantities": BELOW
    | {"compare.quantities", "compare.models", "compare.limits", "compare.archive"},
}
ALLOWED["compare.chooser"] = ALLOWED["compare.quantities"] | {"compare.chooser"}
ALLOWED["compare.external"] = ALLOWED["compare.quantities"] | {"compare.external"}
ALLOWED["compare.diagrams"] = ALLOWED["compare.chooser"] | {
    "compare.diagrams",
    "compare.sweep",
    "compare.report",
}
# an example asks as a user does: public names of `compare`, and the models
ALLOWED["compare.examples"] = BELOW | {"compare", "compare.quantities", "compare.examples"}
ALLOWED["compare.reproduction"] = ALLOWED["compare.diagrams"] | {"compare.reproduction"}


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


def ours(name):
    return [found for found in imports(name) if found.split(".")[0] in ("ribbonfem", "der", "compare")]


@pytest.mark.parametrize("name", sorted(FILES))
def test_a_room_imports_from_its_left_alone(name):
    mine = room(name)
    # a question may know all of it, and so may the faces of the packages; its own rule is below
    for found in ours(name) if mine in ALLOWED else ():
        assert room(found) in ALLOWED[mine], f"{name} imports {found}: {mine} may not know it"


def test_a_question_imports_no_other_question():
    for name in FILES:
        parts = name.split(".")
        if parts[:2] != ["compare", "questions"] or len(parts) < 3 or parts[2] == "registry":
            continue
        for found in ours(name):
            other = found.split(".")
            if other[:2] == ["compare", "questions"]:
                assert len(other) < 3 or other[2] in (parts[2], "registry"), f"{name} imports {found}"


def test_no_model_knows_another_and_rods_share_no_mechanics():
    for name in FILES:
        for found in ours(name):
            if room(name) == "der":
                assert room(found) in SHARED | {"der"}, f"{name} imports {found}"
            elif room(name) in PROBLEM | MATHEMATICS | ELEMENTS:
                assert not found.startswith(("der", "compare")), f"{name} imports {found}"


def test_compare_reaches_inside_no_model():
    inside = ("problem", "kernels", "rod", "states", "motion", "loop", "tangent", "verbs", "rest")
    for name in FILES:
        if not name.startswith("compare"):
            continue
        for found in ours(name):
            if room(found) in ELEMENTS | {"der"}:
                assert found.split(".")[-1] not in inside, f"{name} reaches into {found}"


def test_no_circles():
    edges = defaultdict(set)
    for name in FILES:
        for found in ours(name):
            # a package imports its own modules, and they import each other
            if found in FILES and not name.startswith(f"{found}.") and found != name:
                edges[name].add(found)
    done, path = set(), []

    def visit(name):
        assert name not in path, f"a circle: {' -> '.join([*path[path.index(name) :], name])}"
        if name in done:
            return
        path.append(name)
        for found in edges[name]:
            visit(found)
        path.pop()
        done.add(name)

    for name in FILES:
        visit(name)


def test_files_hide_no_second_room():
    for name, path in FILES.items():
        if "kernels" in name or name.split(".")[-1] in ("loop", "tangent"):
            continue
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 400, name
    assert len(list((ROOT / "compare").glob("*.py"))) <= 6
