"""Lists that the program or the headers have: operators in a page of the theory, templates, functions of the C interfaces."""

import csv
import json
import re
import statistics
import tempfile
from pathlib import Path

from .schema import Schema
from .text import ROOT, sentence

BOOK = ROOT / "docs/book"
OPERATORS = BOOK / "theory/operators.md"
STUDY = BOOK / "how-to/how-large-how-fast.md"
END = "<!-- end -->"
#: One file per operator; a line of its comment names the page with its equations, from the folder theory.
DEFINITIONS = ROOT / "rust-core/scenario/src/sampling/operators"

HEADERS = {"LIGGGHTS and LAMMPS": "liggghts-bridge/shim/abi.h", "YADE": "yade-bridge/native/shim/abi.h"}


def operators(program, run):
    """Lines of the table of operators."""
    schema = Schema(json.loads(run(program, "schema")))
    lines = ["| `operator` | Result | Page |", "|---|---|---|"]
    for name, meaning in schema.words(schema.root["$defs"]["Operator"]):
        path = DEFINITIONS / f"{name.replace('-', '_')}.rs"
        page = re.search(r"^//! Page: (.+)$", path.read_text(encoding="utf-8"), re.M)
        if not page:
            raise SystemExit(f"{path.relative_to(ROOT)}: no line `//! Page: [TITLE](PAGE.md)` in the comment at the top")
        lines.append(f"| `{name}` | {sentence(meaning).rstrip('.')} | {page[1]} |")
    return lines


def block(path, name, lines):
    """The text of a page with these lines between the marks of a generated block."""
    begin = f"<!-- generated: {name} -->"
    head, rest = path.read_text(encoding="utf-8").split(begin, 1)
    return "\n".join([head + begin, *lines, END + rest.split(END, 1)[1]])


def recorded(name):
    """A recorded sweep of the page on size, rate, and seeds: name of its axis, and its rows by the values of the axis."""
    with (BOOK / f"data/{name}.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    axis = next(iter(rows[0]))
    return {value: [row for row in rows if row[axis] == value] for value in dict.fromkeys(row[axis] for row in rows)}


def spread(rows, key, scale, digits):
    """Mean and standard deviation over the packings, as text."""
    found = [float(row[key]) / scale for row in rows]
    return f"{statistics.mean(found):.{digits}f} ± {statistics.stdev(found):.{digits}f}"


def study():
    """The tables of how-to/how-large-how-fast.md from its recorded sweeps."""
    rates, press, sizes, damping = (recorded(name) for name in ("rates", "press", "sizes", "damping"))
    usual = rates["0.4 1/s"]
    lines = ["| Result, five packings | Mean ± standard deviation | Deviation over mean |", "|---|---|---|"]
    for what, rows, key, scale, digits in (
        ("E of the middle half, GPa", usual, "E_gauge", 1e9, 2),
        ("tensile strength, MPa", usual, "f_t", 1e6, 2),
        ("fracture energy, N/m", usual, "G_F", 1, 1),
        ("compressive strength, MPa", press["-3 1/s"], "f_c", 1e6, 1),
    ):
        found = [float(row[key]) for row in rows]
        lines.append(f"| {what} | {spread(rows, key, scale, digits)} | {100 * statistics.stdev(found) / statistics.mean(found):.1f} % |")
    blocks = {"seeds": lines}
    lines = ["| Strain rate | Tensile strength, MPa | E, GPa | | Strain rate | Compressive strength, MPa |", "|---|---|---|---|---|---|"]
    for (rate, rows), pressed in zip(rates.items(), [*press.items(), *[None] * (len(rates) - len(press))], strict=True):
        other = f"{pressed[0].replace('-', '−')} | {spread(pressed[1], 'f_c', 1e6, 1)}" if pressed else " | "
        lines.append(f"| {rate} | {spread(rows, 'f_t', 1e6, 2)} | {spread(rows, 'E_gauge', 1e9, 2)} | | {other} |")
    blocks["rates"] = lines
    lines = ["| Damping | Tensile strength, MPa, three packings |", "|---|---|"]
    blocks["damping"] = [*lines, *(f"| {value} | {spread(rows, 'f_t', 1e6, 2)} |" for value, rows in damping.items())]
    lines = ["| Size | Spheres across | Tensile strength, MPa | E, GPa | Fracture energy, N/m |", "|---|---|---|---|---|"]
    for value, rows in sizes.items():
        edges = re.findall(r"(\d+) mm", value)
        across = f"{int(edges[0]) / 2:g}"
        lines.append(f"| {' × '.join(edges)} mm | {across} | {spread(rows, 'f_t', 1e6, 2)} | {spread(rows, 'E_gauge', 1e9, 2)} | {spread(rows, 'G_F', 1, 1)} |")
    blocks["sizes"] = lines
    return blocks


def templates(program, run):
    """Every template with what its file says about it, and its picture if the gallery has one."""
    lines = ["# Templates", "", "`concordem init --template NAME` writes one of these scenarios. The texts stand at the top of the files.", ""]
    with tempfile.TemporaryDirectory() as folder:
        for name, what in re.findall(r"^  (\S+)  +(.+)$", run(program, "init"), re.M):
            path = Path(folder) / f"{name}.toml"
            run(program, "init", "--template", name, path)
            comment = re.match(r"(?:#.*\n)+", path.read_text(encoding="utf-8"))[0]
            paragraphs = re.sub(r"(?m)^# ?", "", comment).split("\n\n")
            lines += [f"## {name}", "", f"{sentence(what[0].upper() + what[1:])}.", ""]
            if (BOOK / f"images/templates/{name}.png").exists():
                lines += [f"![Result of the template {name}](../../images/templates/{name}.png)", ""]
            for one in paragraphs:
                # Commands are indented in the files.
                indented = one.startswith(" ")
                lines += [*(["```text", one.rstrip(), "```"] if indented else [sentence(one)]), ""]
    return "\n".join(lines)


def c_functions():
    """Every function of the C interfaces with the first sentence of its comment, from the headers that cbindgen writes."""
    lines = ["# C interfaces", "", "The functions that the shims of the hosts call, from the headers that cbindgen writes. The comments there say more.", ""]
    for host, header in HEADERS.items():
        text = (ROOT / header).read_text(encoding="utf-8")
        found = re.findall(r"((?:^///.*\n)+)^[\w \*]*?\b(concordem_\w+)\(", text, re.M)
        # A function without a comment does not match: none may be missing.
        named = set(re.findall(r"^[\w][\w \*]*?\b(concordem_\w+)\(", text, re.M))
        if {name for _, name in found} != named:
            raise SystemExit(f"{header}: functions without a comment: {', '.join(named - {name for _, name in found})}")
        lines += [f"## {host}", "", f"{len(found)} functions in `{header}`.", "", "| Function | |", "|---|---|"]
        for comment, name in found:
            first = re.split(r"(?<=\.)\s", sentence(re.sub(r"(?m)^///", "", comment)).strip(), maxsplit=1)[0]
            # Links of Rust lead nowhere here.
            first = re.sub(r"\[`([^`]+)`\]", r"`\1`", first).replace("|", "\\|")
            lines.append(f"| `{name}` | {first} |")
        lines.append("")
    return "\n".join(lines)


def committed(program, run, write):
    """Write the generated blocks of committed pages, or fail if they are not up to date."""
    for path, name, lines in [(OPERATORS, "operators", operators(program, run)), *((STUDY, name, lines) for name, lines in study().items())]:
        text = block(path, name, lines)
        if write:
            path.write_text(text, encoding="utf-8")
        elif text != path.read_text(encoding="utf-8"):
            raise SystemExit(f"{path.relative_to(ROOT)}: the block {name} is not up to date; run docs/book/generate_reference.py --write")


def pages(program, run):
    """The pages, by file name."""
    return {"templates.md": templates(program, run), "c-interface.md": c_functions()}
