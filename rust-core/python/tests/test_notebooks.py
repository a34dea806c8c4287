"""The notebooks of the book run, and give what is stored in them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

BOOK = Path(__file__).resolve().parents[3] / "docs/book"
NOTEBOOKS = sorted(path.name for path in (BOOK / "notebooks").glob("*.ipynb"))


def run(path):
    return subprocess.run([sys.executable, BOOK / "run_notebooks.py", path], capture_output=True, text=True)


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_gives_what_is_stored(name, tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("pandas")
    given = run(BOOK / "notebooks" / name)
    assert given.returncode == 0, given.stdout + given.stderr


def test_another_output_and_a_cell_that_raises_are_found(tmp_path):
    pytest.importorskip("matplotlib")
    cell = {"cell_type": "code", "execution_count": None, "id": "a", "metadata": {}, "source": ["print(1 + 1)"]}
    for source, stored, said in (("print(1 + 1)", "3\n", "gives ['2\\n'], stored is ['3\\n']"), ("1 / 0", "", "ZeroDivisionError")):
        cell |= {"source": [source], "outputs": [{"name": "stdout", "output_type": "stream", "text": [stored]}]}
        (tmp_path / "a.ipynb").write_text(json.dumps({"cells": [cell]}), encoding="utf-8")
        given = run(tmp_path / "a.ipynb")
        assert given.returncode == 1 and said in given.stdout, given.stdout
