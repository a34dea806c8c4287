"""What the pages share: the folder of the repository, and prose that the book does not read as markup."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def sentence(text):
    text = " ".join(text.split())
    # Angle brackets and dollars are markup to the book.
    return text.replace("<", "&lt;").replace("$", "\\$")
