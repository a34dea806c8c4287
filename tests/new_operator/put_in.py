"""Copies the sources to a folder and puts a new operator in: a file and a line, and nothing else.

    put_in.py ROOT FOLDER
"""
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "new_law"))
from scratch import copy, write  # noqa: E402

OPERATORS = "rust-core/scenario/src/sampling/operators"


def main(root, to):
    to.mkdir(parents=True, exist_ok=True)
    copy(root, to)
    shutil.copy2(HERE / "granular_temperature.rs", to / OPERATORS)
    listed = root / OPERATORS / "mod.rs"
    head, rest = listed.read_text().split("\noperators! {\n", 1)
    lines, rest = rest.split("\n}\n", 1)
    text = f"{head}\noperators! {{\n{lines}\n    granular_temperature: GranularTemperature,\n}}\n{rest}"
    write(to / OPERATORS / "mod.rs", text, listed)


main(*(Path(word).resolve() for word in sys.argv[1:]))
