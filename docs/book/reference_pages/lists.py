"""Lists that the program or the headers have: operators in a page of the theory, templates, functions of the C interfaces."""

import json
import re
import tempfile
from pathlib import Path

from .schema import Schema
from .text import ROOT, sentence

BOOK = ROOT / "docs/book"
OPERATORS = BOOK / "theory/operators.md"
BEGIN, END = "<!-- generated: operators -->", "<!-- end -->"

#: Page, from the folder theory, with the equations of an operator. An operator without one is an error.
PAGES = {
    "region-stress": "[Stress](stress.md)",
    "particle-stress": "[Stress](stress.md#particles)",
    "boundary-stress": "[Stress](stress.md#boundary), [couple stress](couple-stress.md#body)",
    "wall-traction": "[Stress](stress.md#walls)",
    "wall-moment": "[Walls](../how-to/walls-and-stl.md#turn-a-plane-or-a-cylinder)",
    "set-force": "[Load a set](../how-to/load-a-set.md)",
    "set-motion": "[Load a set](../how-to/load-a-set.md)",
    "gauge": "[Laboratory tests](../how-to/laboratory-tests.md)",
    "couple-stress": "[Couple stress](couple-stress.md)",
    "affine-strain": "[Strain](strain.md#affine-fit)",
    "affine-rate": "[Strain](strain.md#affine-fit)",
    "cell-strain": "[Strain](strain.md#space-cells)",
    "cell-rate": "[Strain](strain.md#space-cells)",
    "contact-cell-strain": "[Strain](strain.md#contact-cells)",
    "contact-cell-rate": "[Strain](strain.md#contact-cells)",
    "fabric": "[Fabric](fabric.md)",
    "porosity": "[Fabric](fabric.md)",
    "temperature": "[Heat](heat.md)",
    "heat-flux": "[Heat](heat.md#flux)",
    "damage-tensor": "[Damage](damage.md)",
    "power": "[Power](power.md)",
    "coarse-grain": "[Stress](stress.md#coarse-graining)",
}

HEADERS = {"LIGGGHTS and LAMMPS": "liggghts-bridge/shim/abi.h", "YADE": "yade-bridge/native/shim/abi.h"}


def operators(program, run):
    """The page of the theory with the table of operators."""
    schema = Schema(json.loads(run(program, "schema")))
    found = dict(schema.words(schema.root["$defs"]["Operator"]))
    if set(found) != set(PAGES):
        raise SystemExit(f"reference_pages/lists.py: give a page for these operators, or remove it: {', '.join(set(found) ^ set(PAGES))}")
    lines = ["| `operator` | Result | Page |", "|---|---|---|"]
    lines += [f"| `{name}` | {sentence(meaning).rstrip('.')} | {PAGES[name]} |" for name, meaning in found.items()]
    head, rest = OPERATORS.read_text(encoding="utf-8").split(BEGIN, 1)
    return "\n".join([head + BEGIN, *lines, END + rest.split(END, 1)[1]])


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


def pages(program, run):
    """The pages, by file name."""
    return {"templates.md": templates(program, run), "c-interface.md": c_functions()}
