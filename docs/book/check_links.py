#!/usr/bin/env python3
"""Check links to files: relative links of every tracked Markdown file, and paths of the repository in code style in the book.

Sphinx checks the links between pages of the book; this checks what Sphinx does not see. External links are not checked.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"(?<!!)\[[^\]]*\]\(<?([^)\s>]+)>?\)")
FOLDERS = r"(?:docs|validation|rust-core|tests|yade-bridge|liggghts-bridge|\.ci)"
# A path in code style: `validation/specimens.py`, also with a place in it behind a colon.
PATH = re.compile(rf"`({FOLDERS}/[\w./+-]+)(?::[\w:]+)?`")
MADE = ("_build", "/target/")
# Pages outside of the book: what is wrong there is printed, and fails with --strict only.
OTHERS = re.compile(r"[A-Z]+\.md|docs/(glossary|limits|performance)\.md|docs/(decisions|journal)/.*")


def anchors(text):
    """Anchors of a Markdown file as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def problems_of(page):
    text = page.read_text(encoding="utf-8")
    plain = re.sub(r"^( *)```.*?^\1```", "", text, flags=re.M | re.S)
    book = ROOT / "docs/book" in page.parents
    for target in LINK.findall(re.sub(r"`[^`\n]*`", "", plain)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        to = (page.parent / path).resolve() if path else page
        if not to.exists() and "generated/" not in path:
            yield f"{target} does not exist"
        elif anchor and to.suffix == ".md" and not book and anchor not in anchors(to.read_text(encoding="utf-8")):
            yield f"{target}: no such heading"
    for path in PATH.findall(plain) if book else ():
        if not (ROOT / path).exists() and not any(made in path for made in MADE):
            yield f"`{path}` does not exist"


def main():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=ROOT, check=True, text=True, capture_output=True)
    wrong = 0
    for name in listed.stdout.split():
        page = ROOT / name
        if not page.exists():
            continue
        for problem in problems_of(page):
            foreign = OTHERS.fullmatch(name) and "--strict" not in sys.argv
            wrong += not foreign
            print(f"{'note: ' if foreign else ''}{name}: {problem}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
