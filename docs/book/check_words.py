#!/usr/bin/env python3
"""Check that pages stay short and plain: evidence stands apart, cells of tables are short, and turns that sound translated are rare;
tutorials and how-to pages show a picture of their result; properties of bonds are not named after links.

Pages outside of docs/book/evidence hold at most a quarter of evidence. The counts are printed; what is above its limit fails.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Titles of sections that hold evidence, and the beginning of paragraphs that do.
EVIDENCE = re.compile(
    r"Verification|Evidence\b|Cost\b|Figures?\b|Speed\b|Compared with|Measured|Not done|Strength in compression|A model of weak|Counted on|Breaking bonds|"
    r"The published specimen|Random packings|Spacing of cracks|What the concrete does|The runs of|What was tried|The test case of"
)
TESTED = re.compile(r"\**Tested\b")
SHARE = 0.25
CELL = 40  # words
TURNS = re.compile(r"\b(that of|those of|of its own|in turn|the bits of)\b|, too\b|\bsome \d|without a word")
PER_THOUSAND = 0.3
PICTURE = re.compile(r"^!\[.+\]\(\.\./images/.+\.png\)$", re.M)
# Tutorials and how-to pages whose result is no picture, and why.
WITHOUT_PICTURE = {
    "how-to/choose-in-yade.md": "it leads to the pages that show results",
    "how-to/use-the-command-line.md": "its results are texts on the terminal",
    "how-to/use-a-graphics-processor.md": "its results are those without it, bit by bit",
    "how-to/use-rust.md": "its results are numbers in the program of the reader",
}
# Properties of bonds: "link" is a word for the static network, for heat, and for the structure of packings (docs/glossary.md).
OF_BONDS = re.compile(
    r"\blinks?['’]?s? (?:modulus|moduli|damage|strain|stress|strength|law|force|break|broke)|\b(?:modulus|damages?|strength|stiffness) of (?:the |a |each )?links?\b",
    re.I,
)
NETWORK = ("rust-core/statics/", "docs/book/check_words.py")
# A page may name a turn that its code prints.
README_WORDS, CHANGELOG_LINES, LIMITS_ROWS = 500, 150, 80


def pages():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=ROOT, check=True, text=True, capture_output=True)
    return [name for name in listed.stdout.split() if (ROOT / name).exists() and not name.startswith(("validation/cases/", "tests/"))]


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def evidence_share(text):
    """The share of a page's words that stand in sections or paragraphs of evidence; code does not count."""
    plain = re.sub(r"^( *)```.*?^\1```", "", text, flags=re.M | re.S)
    level, evidence, everything = 0, 0, 0
    for paragraph in re.split(r"\n\s*\n|\n(?=#)|(?<=\n)(?=#)", plain):
        words = len(paragraph.split())
        title = re.match(r"(#+) (.+)", paragraph)
        if title:
            if level and len(title[1]) <= level:
                level = 0
            if not level and EVIDENCE.match(title[2]):
                level = len(title[1])
        everything += words
        evidence += words if level or TESTED.match(paragraph) else 0
    return evidence / max(everything, 1)


def cells(text):
    """The words of every cell of every table."""
    for line in text.splitlines():
        if line.startswith("|"):
            yield from (len(cell.split()) for cell in re.split(r"(?<!\\)\|", line))


def rows(text):
    """Rows of tables, without their heads."""
    lines = text.splitlines()
    return sum(line.startswith("|") and not line.startswith("|---") and not (after.startswith("|---")) for line, after in zip(lines, [*lines[1:], ""]))


def without_picture():
    """Tutorials and how-to pages that show no picture of their result, and pages excused for nothing."""
    for folder in "tutorials", "how-to":
        for path in sorted((ROOT / "docs/book" / folder).glob("*.md")):
            name, shown = f"{folder}/{path.name}", bool(PICTURE.search(path.read_text(encoding="utf-8")))
            if not shown and name not in WITHOUT_PICTURE:
                yield f"docs/book/{name}: no picture of its result; draw one with docs/book/make_gallery.py"
            if shown and name in WITHOUT_PICTURE:
                yield f"docs/book/{name}: has a picture; remove it from WITHOUT_PICTURE"


def links_for_bonds():
    """Places where sources and pages name properties of bonds after links."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "*.rs", "*.py", "*.pyi", "*.md", "*.html", "*.toml", "*.h"], cwd=ROOT, check=True, text=True, capture_output=True
    )
    for name in listed.stdout.split():
        if (ROOT / name).exists() and not name.startswith(NETWORK):
            for number, line in enumerate(text_of(name).splitlines(), 1):
                for match in OF_BONDS.finditer(line):
                    yield f'{name}:{number}: "{match[0]}": not "link", but "bond" (docs/glossary.md)'


def main():
    names, wrong = pages(), []
    turns = words = longest = 0
    for name in names:
        text = text_of(name)
        words += len(text.split())
        found = [match[0].strip(", ") for match in TURNS.finditer(text)]
        turns += len(found)
        if found and "--turns" in sys.argv:
            print(f"{name}: {', '.join(found)}")
        of_book = name.startswith("docs/book/") or name in ("README.md", "ARCHITECTURE.md", "docs/limits.md", "docs/performance.md")
        cell = max(cells(text), default=0)
        if of_book:
            longest = max(longest, cell)
            if cell > CELL:
                wrong.append(f"{name}: a cell of a table has {cell} words, more than {CELL}")
        share = evidence_share(text)
        if name.startswith("docs/book/") and not name.startswith("docs/book/evidence/") and share > SHARE:
            wrong.append(f"{name}: {share:.0%} of its words are evidence, more than {SHARE:.0%}; move it to docs/book/evidence")
    rate = 1000 * turns / words
    if rate > PER_THOUSAND:
        wrong.append(f"turns of phrase per 1,000 words: {rate:.2f}, more than {PER_THOUSAND} (check_words.py --turns lists them)")
    for what, count, limit in (
        ("words of README.md", len(text_of("README.md").split()), README_WORDS),
        ("lines of CHANGELOG.md", text_of("CHANGELOG.md").count("\n"), CHANGELOG_LINES),
        ("rows of docs/limits.md", rows(text_of("docs/limits.md")), LIMITS_ROWS),
    ):
        if count > limit:
            wrong.append(f"{what}: {count}, more than {limit}")
    wrong += without_picture()
    wrong += links_for_bonds()
    for problem in wrong:
        print(problem, file=sys.stderr)
    print(f"{words} words in {len(names)} pages, turns per 1,000 words {rate:.2f}, longest cell {longest} words")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
