"""README and guide: every block of Python and every command in them is run, and their numbers are found.

In a page the blocks of Python share one namespace, and blocks and commands one folder, from top to end.
A number in the comment behind an expression is what the expression gives, to the digits shown.  A line before
a block says where that is not asked for:  <!-- slow -->, more than a few seconds;  <!-- not run -->, another
machine, or an installation, is needed.
"""

import ast
import contextlib
import doctest
import inspect
import json
import re
import shlex
import tokenize
import warnings
from dataclasses import dataclass
from functools import cache, reduce
from importlib import import_module
from io import StringIO
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from compare.__main__ import main
from compare.report.registry import ORDER, named
from ribbonfem import Fold
from ribbonfem.output.scene_file import read_scene

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / ".docs"
PAGES = [ROOT / "README.md", *sorted(GUIDE.glob("*.md"))]
OWN = ("scenes", "report", "warm")
BLOCK = re.compile(r"(?:<!-- (?P<mark>[a-z ]+) -->\n)?^```(?P<kind>\w+)\n(?P<text>.*?)^```$", re.M | re.S)
NUMBERS = re.compile(r"#\s*(True|False|[-+]?\d[\d.]*(?:e[-+]?\d+)?(?:, [-+]?\d[\d.]*(?:e[-+]?\d+)?)*)")
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)


@dataclass(frozen=True)
class Block:
    kind: str
    text: str
    mark: str
    line: int


@cache
def blocks_of(page):
    text = page.read_text(encoding="utf-8")
    return [
        Block(m["kind"], m["text"], m["mark"] or "", text[: m.start()].count("\n") + 1)
        for m in BLOCK.finditer(text)
    ]


def commands_of(block):
    return [shlex.split(line)[1:] for line in block.text.splitlines() if line.startswith("ribbonfem ")]


def flat(value):
    """The numbers of a value: of a fold its angle."""
    if isinstance(value, Fold):
        return [float(value.angle)]
    if isinstance(value, (tuple, list)):
        return [number for part in value for number in flat(part)]
    return [float(value)]


def agree(value, comment, where):
    """What is written behind an expression is what it gives."""
    if comment in ("True", "False"):
        assert bool(value) is (comment == "True"), where
        return
    told = comment.split(", ")
    result = flat(value)[: len(told)]
    assert len(result) == len(told), where
    for text, number in zip(told, result, strict=True):
        mantissa, _, power = text.partition("e")
        digit = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
        assert abs(number - float(text)) <= 1.01 * digit, f"{where}: {text} is told, {number!r} is found"


def run_python(block, names, page):
    comments = {
        token.start[0]: match[1]
        for token in tokenize.generate_tokens(StringIO(block.text).readline)
        if token.type == tokenize.COMMENT and (match := NUMBERS.match(token.string))
    }
    for node in ast.parse(block.text).body:
        where = f"{page.name}, line {block.line + node.lineno}"
        if isinstance(node, ast.Expr):
            value = eval(compile(ast.Expression(node.value), where, "eval"), names)
            if node.end_lineno in comments:
                agree(value, comments[node.end_lineno], where)
        else:
            exec(compile(ast.Module([node], []), where, "exec"), names)


def follow(page, folder, monkeypatch, slow):
    """Do what a page says; the slow blocks too, or not."""
    monkeypatch.chdir(folder)
    # what workers do is another test's: each would load everything first
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0})
    names = {"__name__": "page"}
    for block in blocks_of(page):
        if block.mark == "not run" or (block.mark == "slow" and not slow):
            continue
        if block.kind == "python":
            run_python(block, names, page)
            plt.close("all")
        elif block.kind == "text":
            for words in commands_of(block):
                with warnings.catch_warnings():
                    assert main([*words, *(["--quiet"] if words[0] not in OWN else [])]) == 0, words


@each_page
def test_a_page_does_what_it_says(page, tmp_path, monkeypatch, capsys):
    follow(page, tmp_path, monkeypatch, slow=False)


@pytest.mark.slow
@each_page
def test_a_page_does_what_it_says_however_long(page, tmp_path, monkeypatch, capsys):
    if not any(block.mark == "slow" for block in blocks_of(page)):
        pytest.skip("it has nothing slow")
    follow(page, tmp_path, monkeypatch, slow=True)


@each_page
def test_a_scene_file_in_a_page_is_one(page, tmp_path):
    for block in blocks_of(page):
        if block.kind == "toml":
            (tmp_path / "scene.toml").write_text(block.text, encoding="utf-8")
            read_scene(tmp_path / "scene.toml")


@cache
def options_of(command):
    """The options that a command's --help names."""
    told = StringIO()
    with contextlib.redirect_stdout(told), pytest.raises(SystemExit):
        main([command, "--help"])
    return set(re.findall(r"--[a-z-]+", told.getvalue()))


@each_page
def test_every_command_named_is_one_and_has_its_options(page):
    text = page.read_text(encoding="utf-8")
    said = [line.split() for line in re.findall(r"`ribbonfem ([^`]+)`", text)]
    said += [words for block in blocks_of(page) if block.kind == "text" for words in commands_of(block)]
    for words in said:
        if words[0].startswith("-") or words[0] == "COMMAND":
            continue
        assert words[0] in (*ORDER, *OWN), words
        for word in words[1:]:
            if word.startswith("--"):
                assert word in options_of(words[0]), f"{page.name}: ribbonfem {' '.join(words)}"


def test_the_table_of_commands_is_the_register():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `ribbonfem ([\w-]+)[^|]*\| [^|]+ \| ([^|]+) \|$", text, re.M)
    assert [name for name, _ in rows] == [*ORDER, *OWN]
    for name, takes in rows[: len(ORDER)]:
        assert takes == named(name).takes, name


@each_page
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        if re.match(r"https?:", target):
            continue
        # what the build makes is in no checkout, but what it is made from is
        made = {"tutorial.md": GUIDE / "tutorial.ipynb", "commands.md": GUIDE / "commands.head"}
        made["examples.md"] = GUIDE / "examples.head"
        path = page.parent / target
        if path.parent.name == "made":
            path = made.get(path.name, ROOT / "compare" / "examples" / f"{path.stem}.py")
        assert path.exists(), f"{page.name}: {target}"


# where docstrings have examples, and what of each the reference shows
SHOWN = ("ribbonfem", "ribbonfem.quasilinear", "ribbonfem.elastica", "ribbonfem.kirchhoff", "der", "compare")
MORE = ("ribbonfem.delay:predict", "ribbonfem.results:History.crossing", "ribbonfem.outcomes:name_by_signs")


def public_names():
    for module in map(import_module, SHOWN):
        for name in module.__all__:
            yield module.__name__, name, getattr(module, name)


def test_the_reference_shows_every_public_name():
    text = (GUIDE / "api.rst").read_text(encoding="utf-8")
    shown = set(re.findall(r"^.. auto\w+:: ([\w.]+)", text, re.M))
    shown |= {name.split(".")[-1] for name in shown}
    for module, name, value in public_names():
        # a module among the names has a heading, and `MODEL_INFO` is told once for all
        if name == "MODEL_INFO" or inspect.ismodule(value):
            continue
        assert name in shown, f"{module}.{name}"


def test_examples_in_docstrings():
    objects = {f"{module}.{name}": value for module, name, value in public_names()}
    for place in MORE:
        module, _, path = place.partition(":")
        objects[place] = reduce(getattr, path.split("."), import_module(module))
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    result = 0
    for name, value in objects.items():
        written = inspect.getdoc(value) if inspect.isroutine(value) or inspect.isclass(value) else None
        if not written or ">>>" not in written:
            continue
        names = dict(inspect.unwrap(value).__globals__ if inspect.isroutine(value) else vars(owner(value)))
        runner.run(parser.get_doctest(written, names, name, None, 0))
        result += 1
    assert runner.failures == 0
    assert result >= 8


def owner(kind):
    return import_module(kind.__module__)


def test_the_tutorial_runs_cell_by_cell(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0})
    notebook = json.loads((GUIDE / "tutorial.ipynb").read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(code) == 10
    names = {"__name__": "tutorial"}
    for k, cell in enumerate(code):
        assert not cell["outputs"]
        assert cell["execution_count"] is None
        exec(compile("".join(cell["source"]), f"cell {k}", "exec"), names)
    plt.close("all")
    assert "behind the fold" in capsys.readouterr().out
    assert names["diagram"].outcome.shape == (3, 3)
    rods, elements = (
        np.array([fold.angle for fold in model.folds(names["ramp"], **options)])
        for model, options in ((names["der"], {"nodes": 101}), (names["kirchhoff"], {"extensible": True}))
    )
    np.testing.assert_allclose(rods, elements, atol=1e-3)
