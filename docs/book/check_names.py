#!/usr/bin/env python3
"""Check that no identifier in Rust or Python uses a word that docs/glossary.md lists under "Do not use".

A word is looked for as a part of an identifier: "limit strain" is in `limit_strain_old` and in `LimitStrain`. Comments and strings do
not count: keys that users write never change. Words with a remark in parentheses are wrong only in some places, and are not checked.
"""

import io
import keyword
import re
import subprocess
import sys
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GLOSSARY = ROOT / "docs/glossary.md"
# Words with another meaning in code as well, and this meaning.
OTHER_MEANINGS = {
    "answer": "what a server or a function of the user returns",
    "body": "body of a host, of a coupling, or of a request",
    "box": "a shape",
    "container": "of a host or an archive",
    "copy": "to copy bytes",
    "direction": "a unit vector that is no normal of a contact",
    "dyad": "a product of two vectors",
    "fate": "what becomes of a bond of a host, in a rebuild",
    "found": "what a search or a test finds",
    "grain": "coarse grains of LIGGGHTS",
    "held": "what a test holds in place",
    "incident": "of a wave",
    "lever": "of a bending moment",
    "link": "a link of a network, or between pages",
    "matrix": "of numbers",
    "memory": "of the computer",
    "mode": "of a motion, or the key",
    "model": "what stays constant in a step, or the key",
    "mould": "of aggregates, the key",
    "packing fraction": "the attribute in Python, and a key of results of `sweep`",
    "picture": "an image",
    "piece": "of a file",
    "place": "position of something that is no particle",
    "places": "positions of things that are no particles",
    "push": "to append",
    "rest length": "of a bond without thermal expansion, a column of checkpoints",
    "row": "of a table",
    "sample": "an entry of a series, the key",
    "search": "for a value",
    "share": "a fraction",
    "slide": "a motion of particles along each other",
    "take": "to move out of something",
    "waiting": "of threads",
    "widening": "the attribute of YADE's state",
}
# Words that only the files use where a quantity of users or hosts becomes another one.
AT_BORDERS = {
    "friction angle": {
        "rust-core/app/src/program/calibrate/concrete.rs",
        "rust-core/app/src/program/calibrate/rock.rs",
        "rust-core/contact/src/law/cohesive_beam/table.rs",
        "rust-core/contact/src/law/cpm/table.rs",
        "rust-core/contact/src/law/jointed/table.rs",
        "rust-core/contact/src/law/jointed/tests.rs",
        "rust-core/python/python/concordem/tables.py",
        "rust-core/python/tests/test_scenario.py",
        "rust-core/scenario/src/checks/joints.rs",
        "rust-core/scenario/src/schema/joint.rs",
        "tests/cpm_gold.rs",
        "validation/concordem_validate/engines/translate.py",
        "validation/concordem_validate/engines/yade.py",
        "validation/tests/test_engines.py",
        "yade-bridge/native/src/bonded_engine/arrays.rs",
    },
}
# Attributes of YADE.
OF_OTHERS = {"frictionAngle", "jointFrictionAngle", "residualFrictionAngle", "tanFrictionAngle", "tangensOfFrictionAngle"}
# Comments, strings, and characters of Rust.
RUST = re.compile(
    r"""//[^\n]*|/\*.*?\*/|b?r(?P<hashes>\#*)".*?"(?P=hashes)|b?"(?:\\.|[^"\\])*"|b?'(?:\\[^']+|[^'\\])'""", re.S | re.X
)
IDENTIFIER = re.compile(r"[A-Za-z_]\w*")


def plain(word):
    """`LimitStrain` and "limit strain" as `limit_strain`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", word).lower().replace(" ", "_").replace("-", "_")


def forbidden(glossary):
    """Words not to use, and the term that takes their place; without those that are wrong only in some places."""
    words = {}
    for line in glossary.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) < 3 or cells[-1] in ("", "Do not use") or cells[-1].startswith("---"):
            continue
        for word in cells[-1].split(","):
            if "(" not in word:
                words[word.strip()] = cells[0]
    return words


def identifiers_of_rust(text):
    """Line and name of every identifier in Rust source."""
    blank = RUST.sub(lambda match: "\n" * match[0].count("\n") + " ", text)
    for number, line in enumerate(blank.splitlines(), 1):
        yield from ((number, name) for name in IDENTIFIER.findall(line))


def identifiers_of_python(text):
    """Line and name of every identifier in Python source."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NAME and not keyword.iskeyword(token.string):
            yield token.start[0], token.string


def hits(names, words):
    """Line, identifier, and the word in it that must not be used. Attributes of other programs keep their names."""
    parts = re.compile(r"(?:^|_)(%s)(?=_|$)" % "|".join(sorted(map(plain, words), key=len, reverse=True)))
    back = {plain(word): word for word in words}
    for line, name in names:
        for part in parts.findall(plain(name)) if name not in OF_OTHERS else ():
            yield line, name, back[part]


def sources():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.rs", "*.py", "*.pyi"], cwd=ROOT, check=True, text=True, capture_output=True)
    return [ROOT / name for name in listed.stdout.split() if (ROOT / name).exists()]


def main():
    words, wrong, used = forbidden(GLOSSARY.read_text(encoding="utf-8")), [], set()
    at_borders = {(word, file) for word, files in AT_BORDERS.items() for file in files}
    files = sources()
    for path in files:
        names = identifiers_of_rust if path.suffix == ".rs" else identifiers_of_python
        for line, name, word in hits(names(path.read_text(encoding="utf-8")), words):
            file = str(path.relative_to(ROOT))
            used |= {word, (word, file)}
            if word not in OTHER_MEANINGS and (word, file) not in at_borders:
                wrong.append(f"{file}:{line}: `{name}`: not \"{word}\", but \"{words[word]}\" (docs/glossary.md)")
    for word in sorted(set(OTHER_MEANINGS) - used):
        wrong.append(f"docs/book/check_names.py: \"{word}\" is in no identifier, or not in the glossary; remove it from OTHER_MEANINGS")
    for word, file in sorted(at_borders - used):
        wrong.append(f"docs/book/check_names.py: \"{word}\" is in no identifier of {file}; remove the file from AT_BORDERS")
    for problem in wrong:
        print(problem, file=sys.stderr)
    print(f"{len(words)} words of the glossary in {len(files)} sources, {len(words) - len(OTHER_MEANINGS)} of them not to be used anywhere")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
