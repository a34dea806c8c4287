#!/usr/bin/env python3
"""Run the notebooks of the book, and compare what their cells give with what is stored. They need the Python package and matplotlib, not Jupyter.

    run_notebooks.py [NOTEBOOK …]      runs all, or those, and compares the texts
    run_notebooks.py --write [...]     stores texts, tables, and pictures

Each notebook runs in its own folder. Pictures are made again but not compared: they change with the version of matplotlib.
"""

import argparse
import ast
import base64
import contextlib
import io
import json
import os
import sys
import tempfile
import traceback
from pathlib import Path

BOOK = Path(__file__).resolve().parent / "notebooks"


def outputs_of(source, names, label):
    """Run a cell, and give its outputs as a notebook stores them: printed text, the last expression, and open figures."""
    import matplotlib.pyplot as plt

    tree = ast.parse(source, label)
    last = ast.Expression(tree.body.pop().value) if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, label, "exec"), names)
        if last is not None:
            value = eval(compile(last, label, "eval"), names)
    found = [{"name": "stdout", "output_type": "stream", "text": lines(printed.getvalue())}] if printed.getvalue() else []
    pictures = [plt.figure(number) for number in plt.get_fignums()]
    if value is not None and not pictures:
        data = {"text/plain": lines(repr(value))}
        if html := getattr(value, "_repr_html_", lambda: None)():
            data["text/html"] = lines(html)
        found.append({"data": data, "metadata": {}, "output_type": "display_data"})
    for figure in pictures:
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=80, bbox_inches="tight", metadata={"Software": None})
        data = {"image/png": base64.b64encode(file.getvalue()).decode(), "text/plain": ["a figure"]}
        found.append({"data": data, "metadata": {}, "output_type": "display_data"})
    plt.close("all")
    return found


def lines(text):
    return text.splitlines(keepends=True)


def texts(outputs):
    """What is compared: printed text, and the plain text of values."""
    return ["".join(one.get("text", one.get("data", {}).get("text/plain", []))) for one in outputs]


def run(path, write):
    """Run one notebook; lines about cells that give something else than what is stored."""
    notebook = json.loads(path.read_text(encoding="utf-8"))
    names, wrong, home = {"__name__": "__main__"}, [], Path.cwd()
    with tempfile.TemporaryDirectory(prefix="notebook-") as folder:
        os.chdir(folder)
        try:
            for number, cell in enumerate(notebook["cells"], 1):
                if cell["cell_type"] != "code":
                    continue
                label = f"{path.name}, cell {number}"
                try:
                    found = outputs_of("".join(cell["source"]), names, label)
                except Exception:
                    return [f"{label}: {traceback.format_exc(limit=-2)}"]
                if texts(found) != texts(cell["outputs"]):
                    wrong.append(f"{label} gives {texts(found)}, stored is {texts(cell['outputs'])}; look at it, then run_notebooks.py --write")
                cell["outputs"] = found
        finally:
            os.chdir(home)
    if write:
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        return []
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("notebooks", nargs="*", type=Path)
    parser.add_argument("--write", action="store_true", help="store what the cells give")
    options = parser.parse_args()
    os.environ["MPLBACKEND"] = "Agg"
    wrong = [text for path in options.notebooks or sorted(BOOK.glob("*.ipynb")) for text in run(path.resolve(), options.write)]
    print("\n".join(wrong) or "notebooks give what is stored")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
