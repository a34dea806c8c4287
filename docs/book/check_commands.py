#!/usr/bin/env python3
"""Check the pages of the commands of LIGGGHTS and LAMMPS against the parsers: every command has a page, each page has the sections that users of
these programs expect, and names every keyword, law, and property that the code reads."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BRIDGE = ROOT / "liggghts-bridge"
PAGES = ROOT / "docs/book/reference"
SECTIONS = ["Syntax", "Examples", "Description", "Restrictions", "Related commands", "Default"]
STATE = "Restart, fix_modify, output, run start/stop, minimize info"
INCLUDE = re.compile(r"```\{include\} (\S+)\n:start-after: (.+)\n:end-before: (.+)\n```")
# Pages by command; those of styles have the fixed heading of fixes, too, because they keep histories in a fix.
COMPUTES = {
    "concordem/bond/local": "liggghts/compute-bond-local.md",
    "concordem/broken/local": "liggghts/compute-broken-local.md",
    "concordem/stress/atom": "liggghts/compute-stress-atom.md",
    "concordem/couple": "liggghts/compute-couple.md",
}
FIXES = {"concordem/bond/vtk": "liggghts/fix-bond-vtk.md"}
STATEFUL = ["liggghts/fix-bond.md", "liggghts/heat.md", "liggghts/gran-models.md", "lammps/bond-style.md", "lammps/pair-style.md", "lammps/fix-bond.md"]


def source(path):
    return (BRIDGE / path).read_text(encoding="utf-8")


def page(name):
    """A page with the parts that it includes."""
    path = PAGES / name
    return INCLUDE.sub(
        lambda part: (path.parent / part[1]).read_text(encoding="utf-8").split(part[2])[1].split(part[3])[0], path.read_text(encoding="utf-8")
    )


def found(pattern, text, at_least):
    """Names that a source declares; fewer than expected mean that the source looks different now."""
    names = list(dict.fromkeys(re.findall(pattern, text, re.M)))
    if len(names) < at_least:
        raise SystemExit(f"check_commands.py: {pattern} matches {names} only; adapt it to the source")
    return names


def section(text, title):
    return text.split(f"\n## {title}\n")[1].split("\n## ")[0]


def missing():
    for name in [*COMPUTES.values(), *FIXES.values(), *STATEFUL]:
        titles = re.findall(r"^## (.+)$", page(name), re.M)
        wanted = [*SECTIONS[:3], *([STATE] if name in STATEFUL else ["Output info"]), *SECTIONS[3:]]
        if titles != wanted:
            yield f"{name} has the sections {titles} instead of {wanted}"

    parser = source("src/options.rs").split("fn read_option")[1].split("fn read_parameter")[0]
    keywords = found(r'^ {12}"(\w+)" =>', parser, 11)
    prefixes = [f"{prefix}NAME" for prefix in found(r'strip_prefix\("(\w+\.)"\)', source("src/options.rs"), 3)]
    creations = found(r'^ {12}"(\w+)" =>', source("src/options.rs").split("fn creation")[1].split("impl Arguments")[0], 3)
    refused = {
        "lammps/bond-style.md": found(r'word == "(\w+)"', source("lammps/bond_style.cpp"), 2),
        "lammps/pair-style.md": [*found(r'words\[k\] == "(\w+)" \|\|', source("lammps/pair_style.cpp"), 2), "contact", "heat_network"],
    }
    for name in ("liggghts/fix-bond.md", "lammps/fix-bond.md", *refused):
        syntax = section(page(name), "Syntax")
        for key in keywords:
            where, text = ("Restrictions", section(page(name), "Restrictions")) if key in refused.get(name, []) else ("Syntax", syntax)
            if not re.search(rf"(^|`){key}( |`)", text, re.M):
                yield f"{name}: {where} lacks the keyword {key}"
        if name not in refused:
            for word in [*prefixes, *creations]:
                if word not in syntax:
                    yield f"{name}: Syntax lacks {word}"

    registered = found(r'"(concordem/[\w/]+)"\] = &new_compute', source("shim/register.cpp"), 3)
    registered += found(r'\{"compute", "(concordem/[\w/]+)"', source("lammps/plugin.cpp"), 3)
    for name in registered:
        if name not in COMPUTES or f"compute {name} command" not in page(COMPUTES[name]).splitlines()[0]:
            yield f"compute {name} has no page"
    registered = found(r'"(concordem/[\w/]+)"\] = &new_fix', source("shim/register.cpp"), 2)
    registered += found(r'\{"fix", "(concordem/[\w/]+)"', source("lammps/plugin.cpp"), 2)
    for name in registered:
        title = page(FIXES.get(name, "liggghts/fix-bond.md")).splitlines()[0]
        if title != f"# fix {name} command":
            yield f"fix {name} has no page"
    words = found(r'(?:key|word) [!=]= "([\w-]+)"', source("shim/computes.cpp"), 5)
    for word in words:
        if word not in section(page("liggghts/compute-stress-atom.md"), "Syntax"):
            yield f"liggghts/compute-stress-atom.md: Syntax lacks {word}"

    models = found(r'c"(concordem/[\w/]+)"', source("src/pair/models.rs"), 6)
    for model in models:
        if f"`{model}`" not in section(page("liggghts/gran-models.md"), "Syntax"):
            yield f"liggghts/gran-models.md: Syntax lacks {model}"

    laws = (PAGES / "generated/laws.md").read_text(encoding="utf-8")
    for role, name in (("bond_style", "lammps/bond-style.md"), ("pair_style", "lammps/pair-style.md")):
        title = page(name).splitlines()[0]
        for law in found(rf"`{role} (concordem/\w+)`", laws, 3):
            if law not in title:
                yield f"{name}: the title lacks {law}"

    heat = page("liggghts/heat.md")
    for key in found(r"^ {8}(\w+)(?:: _)?,", source("src/options/heat.rs").split("let Heat {")[1].split("} = heat;")[0], 12):
        key = {"initials": "initial", "sources": "source", "boundaries": "boundary"}.get(key, key)
        if not re.search(rf"`{key}[` ]", heat):
            yield f"liggghts/heat.md lacks the key {key} of [heat]"


def main():
    problems = list(missing())
    for problem in problems:
        print(f"docs/book/reference/{problem}", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
