"""Identity of a program by content: the hash of its file and of what it loads. A name or a package database would miss another build.

A compiled program loads the libraries that `ldd` names. A script loads its interpreter, the files and folders that its text names, and the
Python packages that it imports.
"""
import ast
import hashlib
import os
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

from .errors import HarnessError

_ELF = b"\x7fELF"
# Scripts name folders such as /usr, whose contents are no part of them.
_MOST_FILES = 4000
_MOST_BYTES = 1 << 30
_SCRIPTS = {".py", ".sh", ".bash", ".jl", ".m", ".R", ".r", ".pl", ".rb", ".lua", ".js", ".tcl", ".awk"}
# a round, a baseline, a case, and an environment of Python: what they hold is no program, or is hashed by itself
_NO_PROGRAM = ("round.json", "runs/.round", "manifest.json", "case.toml", "pyvenv.cfg")


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


class TooMany(HarnessError):
    """A folder with more than can be hashed."""


def tree(top, without=()):
    """All files in the folder of a script, which may read any of them: without hidden folders, and those of rounds, cases, and environments."""
    found, size = [], 0
    for place, folders, names in os.walk(top):
        keep = lambda name: not (name.startswith(".") or name == "__pycache__" or any((Path(place, name) / mark).exists() for mark in _NO_PROGRAM))
        folders[:] = sorted(filter(keep, folders))
        for name in sorted(names):
            path = Path(place, name)
            if path in without or not path.is_file():
                continue
            found.append(path)
            size += path.stat().st_size
            if len(found) > _MOST_FILES or size > _MOST_BYTES:
                raise TooMany(f"{top} holds more than {_MOST_FILES} files or {_MOST_BYTES >> 30} GiB")
    return found


def is_script(path):
    """Whether a file is a text that another program reads."""
    with open(path, "rb") as file:
        return path.suffix in _SCRIPTS or file.read(2) == b"#!"


def meaning(path):
    """Hash of a file by content; of Python by its syntax tree, which comments do not change."""
    if path.suffix == ".py":
        try:
            return hashlib.sha256(ast.dump(ast.parse(path.read_bytes())).encode()).hexdigest()[:16]
        except (SyntaxError, ValueError, RecursionError):
            pass
    return digest(path)


# Python names the modules that it would import; those that are installed import others, which count only by their own packages.
_IMPORTS = r"""
import ast, importlib.util, os, sys
seen, todo = set(), [path for path in sys.argv[1].split("\n") if path]
sys.path[:0] = [os.path.dirname(os.path.realpath(path)) for path in todo]
names = [name for name in sys.argv[2].split("\n") if name]
while todo or names:
    if todo:
        try:
            tree = ast.parse(open(todo.pop(), "rb").read())
        except (SyntaxError, ValueError, OSError):
            continue
        for one in ast.walk(tree):
            if isinstance(one, ast.Import):
                names += [alias.name for alias in one.names]
            elif isinstance(one, ast.ImportFrom) and one.module and not one.level:
                names.append(one.module)
    while names:
        name = names.pop().partition(".")[0]
        if name in seen:
            continue
        seen.add(name)
        try:
            spec = importlib.util.find_spec(name)
        except Exception:
            continue
        for place in (spec.submodule_search_locations or [spec.origin]) if spec else []:
            if not place or not os.path.exists(place):
                continue
            installed = "site-packages" in place or "dist-packages" in place
            # a file beside the script may have the name of a module of Python
            if place.startswith(os.path.dirname(os.__file__) + os.sep) and not installed:
                continue
            print(place)
            if installed:
                continue
            if os.path.isfile(place):
                todo.append(place)
            else:
                todo += [os.path.join(top, file) for top, _, files in os.walk(place) for file in files if file.endswith(".py")]
"""


def imports(python, scripts, modules=(), environment=None):
    """Files and folders of what scripts of Python and the modules of `python -m` import, and what these import, without Python itself."""
    return _imports(str(python), tuple((str(p), digest(p)) for p in scripts), tuple(modules), tuple(sorted((environment or {}).items())))


@cache
def _imports(python, scripts, modules, environment):
    paths = "\n".join(path for path, _ in scripts)
    told = subprocess.run([python, "-c", _IMPORTS, paths, "\n".join(modules)], capture_output=True, text=True, errors="replace",
                          env={**os.environ, **dict(environment)}).stdout.splitlines()
    return sorted({Path(line) for line in told if Path(line).exists()})


def identity(program, also=()):
    """Hash of a program, of what it loads, and of other files or folders."""
    return digest_all([Path(program).resolve(), *loads(program), *also])


@cache
def _loaded(path, modified, size):
    with open(path, "rb") as file:
        head = file.read(4)
    if head == _ELF:
        return tuple(_libraries(path))
    if head[:2] == b"#!":
        return tuple(_of_script(Path(path)))
    return ()


def loads(path):
    """What a program or script loads beside itself."""
    path = Path(path).resolve()
    about = path.stat()
    return _loaded(str(path), about.st_mtime_ns, about.st_size)


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
