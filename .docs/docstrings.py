"""Docstrings of this package as reStructuredText: its sections as lists, its formulas as they are written."""

import re

SECTIONS = ("Parameters", "Attributes", "Returns", "Raises", "Warns")
# of an item: its names, and what is said of them in the same line
ITEM = re.compile(r"^(?P<names>[\w*]+(?:, [\w*]+)*):(?: (?P<text>.*))?$")


def escaped(line):
    """A line in which no sign has a meaning, except between backticks."""
    parts = re.split(r"(``.+?``|`.+?`)", line)
    for k in range(0, len(parts), 2):
        bullet = re.match(r"\s*\* ", parts[k]) if k == 0 else None
        start = bullet.end() if bullet else 0
        parts[k] = parts[k][:start] + re.sub(r"([|*])", r"\\\1", parts[k][start:]).replace(" -> ", " → ")
    return "".join(parts)


def _indent(line):
    return len(line) - len(line.lstrip())


def text(lines):
    """Paragraphs; what is indented below one stands as it is, if it is no part of a list."""
    out, inside, listed = [], False, False
    for k, line in enumerate(lines):
        if not line.strip():
            out.append("")
            continue
        if not _indent(line):
            inside, listed = False, line.startswith(("* ", "- "))
        elif not inside and not listed and (k == 0 or not lines[k - 1].strip()):
            out += ["::", ""]
            inside = True
        out.append(line if inside or line.startswith(">>>") else escaped(line))
    return out


def items(name, lines):
    """A section as a list of definitions, or as it is where it defines nothing."""
    out = [f"**{name}**", ""]
    for k, line in enumerate(lines):
        if not line.strip():
            out.append("")
        elif _indent(line):
            out.append("   " + escaped(line.strip()))
        else:
            result = ITEM.match(line) if name in ("Parameters", "Attributes") else None
            below = k + 1 < len(lines) and _indent(lines[k + 1])
            if result:
                out += ["", f"``{result['names']}``"]
                out += [f"   {escaped(result['text'])}"] if result["text"] else []
            elif below and name in ("Returns", "Raises", "Warns"):
                out += ["", f"``{line}``"]
            else:
                out += [escaped(line)]
    return [*out, ""]


def process(app, what, name, obj, options, lines):
    """Rewrite the lines of a docstring in place."""
    # headings, and the lines below each; the first part has none
    parts = [("", [])]
    below = [line.strip() for line in lines[1:]] + [""]
    underline = [bool(mark) and set(mark) == {"-"} for mark in below]
    for k, line in enumerate(lines):
        if underline[k] and not _indent(line):
            parts.append((line, []))
        elif not (k and underline[k - 1]):
            parts[-1][1].append(line)
    told = []
    for heading, body in parts:
        if heading in SECTIONS:
            told += items(heading, body)
        else:
            told += [*([f"**{heading}**", ""] if heading else []), *text(body), ""]
    lines[:] = told
