"""What the guide's pages show and nobody writes by hand: pictures, commands, the tutorial with its results.

Pictures are what `look` of the examples draws, commands are read from their register, and the
tutorial is its notebook, run.
"""

import ast
import contextlib
import io
import json
import os
from importlib import import_module
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from compare.__main__ import main
from compare.report.registry import ORDER, first_line, named

HERE = Path(__file__).parent
OTHERS = {
    "scenes": "List the scene files that are shipped, or write some.",
    "report": "Make the report's page anew, and with `--redraw` its pictures too, without a run.",
    "warm": "Compile everything once, in parallel: for images and clusters.",
}


def example_names():
    """The examples, in the order of their folder."""
    folder = Path(import_module("compare.examples").__file__).parent
    return sorted(path.stem for path in folder.glob("*.py") if path.stem != "__init__")


def pictures(folder):
    """The picture of each example."""
    for name in example_names():
        example = import_module(f"compare.examples.{name}")
        figure = example.look(example.main())
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
        plt.close(figure)


def examples_page(folder):
    """A page of all examples: what each asks, its picture, its text."""
    lines = ["# Examples", ""]
    lines += (HERE / "examples.head").read_text(encoding="utf-8").splitlines() + [""]
    for name in example_names():
        example = import_module(f"compare.examples.{name}")
        first, _, rest = example.__doc__.partition("\n")
        lines += [f"## {name}", "", f"**{first}**", rest.strip(), ""]
        lines += [f"```{{image}} {name}.svg", f":alt: {example.look.__doc__.split(chr(10))[0]}", "```", ""]
        path = os.path.relpath(example.__file__, folder)
        lines += [
            example.look.__doc__,
            "",
            f"```{{literalinclude}} {path}",
            ":start-at: from __future__",
            "```",
            "",
        ]
    (folder / "examples.md").write_text("\n".join(lines), encoding="utf-8")


def help_of(command):
    """What `ribbonfem COMMAND --help` prints."""
    os.environ |= {"COLUMNS": "96", "NO_COLOR": "1"}
    told = io.StringIO()
    with contextlib.redirect_stdout(told), contextlib.suppress(SystemExit):
        main([command, "--help"])
    return told.getvalue().rstrip()


def commands_page(folder):
    """A table of all commands, and the help of each."""
    lines = ["# Commands", "", *(HERE / "commands.head").read_text(encoding="utf-8").splitlines(), ""]
    lines += ["| command | what it asks | takes |", "| --- | --- | --- |"]
    for name in ORDER:
        lines.append(f"| [`{name}`](#{name}) | {first_line(name)} | {named(name).takes} |")
    for name, said in OTHERS.items():
        lines.append(f"| [`{name}`](#{name}) | {said} | no run |")
    for name in (*ORDER, *OTHERS):
        said = OTHERS.get(name) or first_line(name)
        lines += ["", f"({name})=", f"## ribbonfem {name}", "", said, "", "```text", help_of(name), "```"]
    (folder / "commands.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def shown(value, folder, name):
    """The lines that show the value of a cell's last expression."""
    if hasattr(value, "_repr_html_"):
        return [
            "",
            "```{raw} html",
            '<div class="shown table-wrapper">',
            value._repr_html_(),
            "</div>",
            "```",
            "",
        ]
    if value is None or hasattr(value, "figure"):
        return []
    return ["", "```text", repr(value) if not isinstance(value, str) else value, "```", ""]


def cells_of(path):
    """Kind and text of each cell of a notebook."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [(cell["cell_type"], "".join(cell["source"])) for cell in cells]


def tutorial_page(folder):
    """The notebook's words, its code, and what that gives."""
    lines, names = [], {"__name__": "tutorial"}
    for k, (kind, text) in enumerate(cells_of(HERE / "tutorial.ipynb")):
        if kind == "markdown":
            # the notebook lies beside the pages, its own page one folder below
            lines += [text.replace("](", "](../"), ""]
            continue
        lines += ["```python", text, "```", ""]
        tree = ast.parse(text)
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(tree, f"cell {k}", "exec"), names)
            value = eval(compile(ast.Expression(last.value), f"cell {k}", "eval"), names) if last else None
        if printed.getvalue():
            lines += ["```text", printed.getvalue().rstrip(), "```", ""]
        lines += shown(value, folder, f"tutorial-{k}")
        for number in plt.get_fignums():
            plt.figure(number).savefig(folder / f"cell-{k}-{number}.svg", metadata={"Date": None})
            lines += [f"![what the cell draws](cell-{k}-{number}.svg)", ""]
        plt.close("all")
    (folder / "tutorial.md").write_text("\n".join(lines), encoding="utf-8")


def everything(folder):
    """Draw and write all of it into a folder."""
    folder.mkdir(exist_ok=True)
    matplotlib.rcParams["svg.hashsalt"] = "ribbonfem"
    pictures(folder)
    examples_page(folder)
    commands_page(folder)
    tutorial_page(folder)
