#!/usr/bin/env python3
"""Write llms.txt (llmstxt.org) and the JSON Schemas into the built book: an index of all pages with one line each, for programs that read.

    docs/book/make_llms.py [--concordem PROGRAM] [--pages FOLDER]

Lists the pages in the order of the book, the schemas, the commands of the program, and the exceptions of the Python package. A link
without a target, a page without a line, and a page that no list of index.md names are errors.
"""

import argparse
import ast
import re
import subprocess
from pathlib import Path

BOOK = Path(__file__).resolve().parent
ROOT = BOOK.parents[1]
SCHEMAS = {"scenario": [], "sweep": ["--sweep"]}
LENGTH = 200  # letters of a line's text
LINK = re.compile(r"\]\(([^)\s]+)\)")
TREE = re.compile(r"```\{toctree\}\n:caption: (.+)\n:hidden:\n\n((?:[\w/-]+\n)+)```")
INCLUDE = re.compile(r"```\{include\} (\S+)")


def plain(text):
    """Text without links, formulas, and marks; at most the first sentences that fit."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", " ".join(text.split()))
    text = re.sub(r"\{(\w+)\}`([^`<]*?)\s*(?:<[^>]*>)?`", r"\2", text)
    # Numbers of lists.
    text = re.sub(r"(^| )\d\. ", r"\1", re.sub(r"[*$]", "", text))
    line = ""
    for sentence in re.split(r"(?<=[.!?]) (?=[A-Z`\"])", text):
        if line and (len(line) + len(sentence) > LENGTH or sentence.endswith(":")):
            break
        line = f"{line} {sentence}".strip()
    return line if len(line) <= LENGTH else line[:LENGTH].rpartition(" ")[0] + " …"


def described(page):
    """Title and first paragraph of a page."""
    text = page.read_text(encoding="utf-8")
    if include := INCLUDE.search(text):
        text += (page.parent / include[1]).resolve().read_text(encoding="utf-8")
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    title = re.search(r"^# (.+)$", text, re.M)
    if not title:
        raise SystemExit(f"{page} has no title")
    text = re.sub(r"^( *)```.*?^\1```", "", text, flags=re.M | re.S)
    for paragraph in re.split(r"\n\s*\n", text):
        paragraph = "\n".join(line for line in paragraph.splitlines() if not line.startswith("#")).strip()
        # Neither pictures, tables, lists, definitions, nor formulas.
        if re.match(r"[`\"(]?\w|\$\w", paragraph) and len(paragraph.split()) > 3:
            return plain(title[1]), plain(paragraph)
    return plain(title[1]), ""


def commands(program):
    """Name and purpose of each command."""
    text = subprocess.run([program, "--help"], check=True, capture_output=True, text=True).stdout
    # The second line of a purpose is indented.
    text = re.sub(r"(?<=\S)\n {8,}(?=\S)", " ", text)
    found = re.findall(r"^  ([a-z]+) {2,}(\S.*)$", text.split("Commands:")[1].split("Options:")[0], re.M)
    if len(found) < 10:
        raise SystemExit(f"make_llms.py: {program} --help shows {len(found)} commands; adapt the pattern")
    return [one for one in found if one[0] != "help"]


def errors():
    """Name and meaning of each exception of the package."""
    tree = ast.parse((ROOT / "rust-core/python/python/concordem/_errors.py").read_text(encoding="utf-8"))
    return [(node.name, plain(ast.get_docstring(node) or "")) for node in tree.body if isinstance(node, ast.ClassDef) and node.name != "Problem"]


def missing(text, folder):
    """Links of a text whose targets are not in the folder."""
    return [link for link in LINK.findall(text) if not re.match(r"\w+:", link) and not (folder / link.partition("#")[0]).is_file()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--concordem", type=Path, default=ROOT / "target/release/concordem", help="the program")
    parser.add_argument("--pages", type=Path, default=BOOK / "_build/html", help="the built book")
    options = parser.parse_args()
    program = options.concordem.resolve()
    index = (BOOK / "index.md").read_text(encoding="utf-8")
    lines = ["# ConcorDEM", "", f"> {described(BOOK / 'index.md')[1]}", ""]
    lines += ["A scenario is one TOML file; `concordem run` writes one HDF5 file. Numbers are in SI units, or texts such as \"30 GPa\"; tension is positive.", ""]
    lines += ["## Machine-readable", ""]
    for kind, words in SCHEMAS.items():
        text = subprocess.run([program, "schema", *words], check=True, capture_output=True, text=True).stdout
        (options.pages / f"{kind}.schema.json").write_text(text, encoding="utf-8")
        command = " ".join(["concordem schema", *words])
        lines.append(f"- [JSON Schema of a {kind}]({kind}.schema.json): every key with type, unit, range, and meaning; as `{command}` prints it.")
    listed, wrong = set(), []
    for caption, entries in TREE.findall(index):
        lines += ["", f"## {caption}", ""]
        for entry in entries.split():
            listed.add(entry)
            title, text = described(BOOK / f"{entry}.md")
            lines.append(f"- [{title}]({entry}.html){': ' if text else ''}{text}")
            if not text and "generated/" not in entry:
                wrong.append(f"{entry}.md has no paragraph that says what it is about")
    written = {str(page.relative_to(BOOK).with_suffix("")) for folder in ("tutorials", "how-to", "theory", "evidence") for page in (BOOK / folder).glob("*.md")}
    # A page may lie below another one.
    nested = {f"{Path(entry).parent}/{name}" for entry in listed for name in re.findall(r"\]\(([\w/-]+)\.md", (BOOK / f"{entry}.md").read_text(encoding="utf-8"))}
    wrong += [f"{page}.md is in no list of index.md" for page in sorted(written - listed - nested)]
    lines += ["", "## Commands", "", "Options of each: [commands](reference/generated/commands.html).", ""]
    lines += [f"- `concordem {name}`: {plain(text)}" for name, text in commands(program)]
    lines += ["", "## Exceptions of the Python package", "", "All of it: [Python package](reference/generated/python.html).", ""]
    lines += [f"- `concordem.{name}`: {text}" for name, text in errors()]
    text = "\n".join(lines) + "\n"
    wrong += [f"{link} is not in the built book" for link in missing(text, options.pages)]
    if wrong:
        raise SystemExit("llms.txt: " + "; ".join(wrong))
    (options.pages / "llms.txt").write_text(text, encoding="utf-8")
    print(f"llms.txt: {len(listed)} pages, {len(text)} letters")


if __name__ == "__main__":
    main()
