"""The checks of the book's words (docs/book/check_words.py) find what they are for."""

import importlib.util
from pathlib import Path

PATH = Path(__file__).resolve().parents[2] / "docs/book/check_words.py"
spec = importlib.util.spec_from_file_location("check_words", PATH)
words = importlib.util.module_from_spec(spec)
spec.loader.exec_module(words)


def test_evidence_is_counted_by_section_and_paragraph():
    page = "# Page\n\none two\n\n## Verification\n\nthree four\n\n### Inside\n\nfive six\n\n## Limits\n\nseven eight\n\nTested: nine ten\n"
    # 2 of "## Verification", 2, 2 of "### Inside", 2, and the 3 of the last paragraph, of 19 words in all.
    assert words.evidence_share(page) == 11 / 19
    assert words.evidence_share("# Page\n\none two\n") == 0


def test_cells_and_rows_of_tables():
    table = "| a | b |\n|---|---|\n| one two | three \\| four |\n| five | six |\n"
    assert max(words.cells(table)) == 3
    assert words.rows(table) == 2


def test_turns_of_phrase():
    assert len(words.TURNS.findall("that of the solver, too, some 5 of them in turn")) == 4
    assert not words.TURNS.findall("the solver's, about 5, alternately")
