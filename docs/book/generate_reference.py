#!/usr/bin/env python3
"""Write the generated part of the book's reference into docs/book/reference/generated (not committed).

* scenario-TABLE.md: every key, from `concordem schema`; examples are the values in templates and tests/scenarios/good
* laws.md: every parameter of every law, from the same schema, as LIGGGHTS and LAMMPS take them
* commands.md: `concordem COMMAND --help`
* results.md: datasets of small runs' result files, with their units and descriptions
* host-commands.md: commands of LIGGGHTS and LAMMPS beside our styles, from the tables that the tests run
* host-decks.md: public decks on our styles, from the record of `make host-decks`
* yade-classes.md, yade-CLASS.md: the classes of the native YADE plugin, from their declarations
* yade-functions.md: what functions and engines of YADE answer beside a bonded engine, from the outcomes of a test
* templates.md: every template, from `concordem init`; c-interface.md: the functions of the C interfaces, from their headers
* python.md: the package, from its stub, its docstrings, and the doc comments of its Rust functions; nothing is imported

The folder reference_pages has one module for each of them. Generated blocks of committed pages (the table of operators in theory/operators.md, the
tables of recorded sweeps in how-to/how-large-how-fast.md) and concordem/tables.py of the Python package must be up to date; `--write` writes them.
"""

import argparse
import json
import subprocess
from pathlib import Path

from reference_pages import commands, hosts, laws, lists, python_package, python_tables, results, scenario, yade_classes, yade_functions
from reference_pages.text import ROOT

TARGET = Path(__file__).resolve().parent / "reference/generated"
NOTE = "<!-- Written by generate_reference.py; changes are lost. -->\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--concordem", type=Path, default=ROOT / "target/release/concordem", help="the program")
    parser.add_argument("--write", action="store_true", help="also write the generated blocks of committed pages")
    options = parser.parse_args()
    program = options.concordem.resolve()

    def run(*arguments):
        done = subprocess.run(arguments, check=False, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{' '.join(map(str, arguments))}:\n{done.stderr}")
        return done.stdout

    pages = {
        **scenario.pages(program, run),
        **laws.pages(program, run),
        **commands.pages(program, run),
        **results.pages(program, run),
        **python_package.pages(),
        **hosts.pages(),
        **yade_classes.pages(program, run),
        **yade_functions.pages(),
        **lists.pages(program, run),
    }
    lists.committed(program, run, options.write)
    python_tables.committed(json.loads(run(program, "schema")), options.write)
    TARGET.mkdir(parents=True, exist_ok=True)
    for path in TARGET.glob("*.md"):
        if path.name not in pages:
            path.unlink()
    for name, text in pages.items():
        path, text = TARGET / name, NOTE + text.rstrip() + "\n"
        # Pages that did not change need no new build.
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
