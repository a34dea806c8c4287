"""Copies the sources to a folder and puts the two new laws in: a file and a line each, and nothing else.

    scratch.py ROOT FOLDER

The adhesive contact is taken from the code blocks of the tutorial that are marked `<!-- file: adhesive.rs -->`, the bond with moments
from hinge.rs. `adhesive_scalar` is the adhesive contact without the line that declares its straight form: speed.py compares both.
What is not new keeps its time, so that a second call compiles nothing again.
"""
import re
import shutil
import subprocess
import sys
from pathlib import Path

LAW = "rust-core/contact/src/law"
PAGE = "docs/book/tutorials/write-a-law.md"
NEW = ["adhesive: Adhesive", "adhesive_scalar: AdhesiveScalar", "hinge: Hinge"]
BLOCK = re.compile(r"^<!-- file: (\S+) -->\n(?:<!-- code: [^\n]* -->\n)?```\w+\n(.*?)^```$", re.M | re.S)


def files_of(page):
    """The files of a page by name: its marked blocks, joined."""
    found = {}
    for name, text in BLOCK.findall(page.read_text()):
        found.setdefault(name, []).append(text)
    return {name: "\n".join(parts) for name, parts in found.items()}


def copy(root, to):
    """The sources as git knows them, without what is built."""
    for old in to.iterdir():
        if old.name != "target":
            shutil.rmtree(old) if old.is_dir() and not old.is_symlink() else old.unlink()
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root, stdout=subprocess.PIPE, check=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        if (root / name).is_symlink():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            (to / name).symlink_to((root / name).readlink())
        elif (root / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, to / name)
    for name in (".venv", ".venv-debian", ".venv-lammps"):
        (to / name).symlink_to((root / name).resolve())


def write(path, text, like):
    """A file as old as the one it comes from."""
    path.write_text(text)
    shutil.copystat(like, path)


def main(root, to):
    to.mkdir(parents=True, exist_ok=True)
    copy(root, to)
    files = files_of(root / PAGE)
    write(to / LAW / "adhesive.rs", files["adhesive.rs"], root / PAGE)
    scalar = re.sub(r"\n *const COLUMNS: [^;]*;\n", "\n", files["adhesive.rs"]).replace("{ColumnUse, ", "{")
    assert "ColumnUse" not in scalar, "the tutorial declares its straight form otherwise"
    scalar = scalar.replace("Adhesive", "AdhesiveScalar").replace('"adhesive"', '"adhesive_scalar"')
    write(to / LAW / "adhesive_scalar.rs", scalar, root / PAGE)
    shutil.copy2(root / "tests/new_law/hinge.rs", to / LAW / "hinge.rs")
    registry = root / LAW / "registry.rs"
    last = "            hertz_mindlin: HertzMindlin,\n"
    assert registry.read_text().count(last) == 1, "the list of laws ends otherwise than the tutorial says"
    write(to / LAW / "registry.rs", registry.read_text().replace(last, last + "".join(f"            {law},\n" for law in NEW)), registry)
    (to / "pull.toml").write_text(files["pull.toml"])
    # What is tested, not a part of the law: cases of the harness.
    for case in sorted((root / "tests/new_law/cases").iterdir()):
        shutil.copytree(case, to / "validation/cases" / case.name)
    (to / "validation/cases/new-adhesion/scenario.toml").write_text(files["pull.toml"])


if __name__ == "__main__":
    main(*(Path(word).resolve() for word in sys.argv[1:]))
