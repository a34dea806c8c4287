"""Identity of a program by content: the hash of its file and of what it loads. A name or a package database would miss another build.

A compiled program loads the libraries that `ldd` names. A script loads its interpreter, the files and folders that its text names, and the
Python packages that it imports.
"""
import hashlib
import os
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

_ELF = b"\x7fELF"
# Scripts name folders such as /usr, whose contents are no part of them.
_MOST_FILES = 4000


def digest(path):
    """Hash of a file, read again only if its time or size has changed."""
    about = Path(path).stat()
    return _digest(str(path), about.st_mtime_ns, about.st_size, about.st_ino)


@cache
def _digest(path, modified, size, inode):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def digest_all(paths):
    """Hash of several files or folders, and of the names of the files in them."""
    one = hashlib.sha256()
    for top in sorted(map(Path, paths)):
        files = sorted(p for p in top.rglob("*") if p.is_file() and "__pycache__" not in p.parts) if top.is_dir() else [top]
        for path in files:
            one.update(f"{path.relative_to(top)} {digest(path)}\n".encode())
    return one.hexdigest()[:16]


def identity(program, also=()):
    """Hash of a program, of what it loads, and of other files or folders."""
    path = Path(program).resolve()
    about = path.stat()
    loaded = _loaded(str(path), about.st_mtime_ns, about.st_size)
    return digest_all([path, *loaded, *also])


@cache
def _loaded(path, modified, size):
    with open(path, "rb") as file:
        head = file.read(4)
    if head == _ELF:
        return tuple(_libraries(path))
    if head[:2] == b"#!":
        return tuple(_of_script(Path(path)))
    return ()


def _libraries(path):
    text = subprocess.run(["ldd", path], capture_output=True, text=True).stdout if shutil.which("ldd") else ""
    return sorted({str(Path(found).resolve()) for found in re.findall(r"=> (/\S+)", text)})


def _of_script(path):
    text = path.read_text(errors="replace")
    first, _, body = text.partition("\n")
    words = first[2:].split()
    interpreter = shutil.which(words[1]) if words[0].endswith("/env") and len(words) > 1 else words[0]
    found = {Path(interpreter)} if interpreter and Path(interpreter).is_file() else set()
    for word in re.findall(r"(?<![\w.])/[\w.+@/-]+", body):
        named = Path(word.rstrip("/."))
        if named.is_file() or (named.is_dir() and len(named.parts) > 3 and _count(named) <= _MOST_FILES):
            found.add(named)
    if interpreter and "python" in Path(interpreter).name:
        found |= _packages(interpreter, body)
    return sorted(str(p.resolve()) for p in found if p.resolve() != path)


def _count(folder):
    return sum(1 for _ in folder.rglob("*"))


def _packages(python, body):
    """Files of the packages that a start script of Python imports, without those of Python itself."""
    names = sorted(set(re.findall(r"(?m)^\s*(?:from|import)\s+([a-zA-Z_]\w*)", body)))
    asked = ("import sys, importlib.util as u\n"
             "for n in sys.argv[1:]:\n"
             "  if n in sys.stdlib_module_names: continue\n"
             "  try: s = u.find_spec(n)\n"
             "  except Exception: s = None\n"
             "  if s and s.origin: print(s.origin if not s.submodule_search_locations else list(s.submodule_search_locations)[0])\n")
    told = subprocess.run([python, "-c", asked, *names], capture_output=True, text=True).stdout.splitlines()
    return {Path(line) for line in told if Path(line).exists()}


@cache
def says(program, option, identity, environment=()):
    """The first line with a digit that a program prints about itself; asked once for each identity."""
    try:
        told = subprocess.run([program, option], capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=60,
                              env={**os.environ, **dict(environment)})
    except (OSError, subprocess.TimeoutExpired):
        return "says no version"
    lines = [line.strip() for line in (told.stdout + told.stderr).splitlines() if re.search(r"\d", line)]
    return lines[0][:120] if lines else "says no version"


def label(name, program, option, also=(), environment=()):
    """Version of an engine: what its program says of itself, and its identity, which no package database decides."""
    one = identity(program, also)
    return f"{name} ({says(str(program), option, one, tuple(sorted(dict(environment).items())))}) sha256 {one}"
