"""Copies the sources to a folder and puts a new kind in: a file, and a line at the end of the list beside it; nothing else.

    put_in.py ROOT FOLDER NEW LIST   NEW: the new file; LIST: the folder of the list, from ROOT
"""
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "new_law"))
from scratch import copy, write  # noqa: E402


def main(root, to, new, kinds):
    to.mkdir(parents=True, exist_ok=True)
    copy(root, to)
    shutil.copy2(new, to / kinds)
    listed = root / kinds / "mod.rs"
    # The list is a call of a macro of this file.
    text = listed.read_text()
    start = text.rindex("! {\n")
    end = text.index("\n}\n", start)
    kind = "".join(word.capitalize() for word in new.stem.split("_"))
    write(to / kinds / "mod.rs", f"{text[:end]}\n    {new.stem}: {kind},{text[end:]}", listed)


root, to, new, kinds = sys.argv[1:]
main(Path(root).resolve(), Path(to).resolve(), Path(new).resolve(), kinds)
