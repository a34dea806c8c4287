"""Errors of `python3 -m concordem.yade build`, and its cache of objects."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import concordem
from concordem.yade import _build


def build(*arguments, **environment):
    """Exit code and standard error of a build that must fail."""
    command = [sys.executable, "-m", "concordem.yade", "build", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment}, check=False)
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == 1, done.stdout
    return done.stderr


def check(text, *wanted):
    for part in wanted:
        assert part in text, f"{part!r} is not in {text!r}"


with tempfile.TemporaryDirectory() as folder:
    check(build(YADE_SRC=folder), "core/Scene.hpp", "YADE_SRC")
    (Path(folder) / "core").mkdir()
    (Path(folder) / "core/Scene.hpp").write_text("")
    check(build(YADE_SRC=folder), "RELEASE", "2025.2.0")
    (Path(folder) / "RELEASE").write_text("2023.02a\n")
    check(build(YADE_SRC=folder), "contains YADE 2023.02a", "2025.2.0 is installed")
    # apt finds no sources: the message must give the remedy.
    (Path(folder) / "empty.list").write_text("")
    (Path(folder) / "apt.conf").write_text(
        f'Dir::Etc::sourcelist "{folder}/empty.list";\nDir::Etc::sourceparts "-";\nDir::State::lists "{folder}/lists";\n'
    )
    check(build(XDG_CACHE_HOME=folder, APT_CONFIG=f"{folder}/apt.conf"), "apt-get source", "YADE_SRC=<folder>")
# A wheel that was built without the native parts.
with tempfile.TemporaryDirectory() as folder:
    package = Path(concordem.__file__).parent
    shutil.copytree(package, Path(folder) / "concordem", ignore=shutil.ignore_patterns("native", "__pycache__"))
    check(build(PYTHONPATH=folder), "lacks the native parts", "make wheel")
check(build("--yade", "no-such-yade"), "no-such-yade", "apt install yade")
# A compiler that reports another version than YADE's.
with tempfile.TemporaryDirectory() as folder:
    other = Path(folder) / "g++-old"
    other.write_text("#!/bin/sh\nexec g++ -U__GNUC__ -D__GNUC__=9 \"$@\"\n")
    other.chmod(0o755)
    check(build("--compiler", str(other)), "gcc 14", "version 9")
# Not built yet: the error in YADE must give the command.
script = "from concordem.yade import load_native\nload_native()\n"
with tempfile.NamedTemporaryFile("w", suffix=".py") as file:
    file.write(script)
    file.flush()
    environment = {**os.environ, "CONCORDEM_YADE_PLUGINS": "/nowhere"}
    done = subprocess.run(["yade", "-n", "-x", "-j1", file.name], capture_output=True, text=True, env=environment, check=False)
    check(done.stdout + done.stderr, "python3 -m concordem.yade build")

# An object is compiled again if a header, the flags, or the compiler has changed, and only then. Objects of the cache are kept by use.
with tempfile.TemporaryDirectory() as folder:
    os.environ["XDG_CACHE_HOME"] = f"{folder}/cache"
    here = Path(folder)
    (here / "number.hpp").write_text("const int number = 1;\n")
    # A program in front of the compiler: other bytes are another compiler.
    compiler = here / "g++"

    def compiler_says(word):
        compiler.write_text(f'#!/bin/sh\n# {word}\nexec g++ "$@"\n')
        compiler.chmod(0o755)

    def compiled(*flags, source='#include "number.hpp"\nint found() { return number; }\n'):
        """Whether the compiler ran, and the object."""
        said = []
        with tempfile.TemporaryDirectory(dir=folder) as work:
            unit = Path(work) / "unit.cpp"
            unit.write_text(source)
            made = _build.object_file(str(compiler), ["-O2", f"-I{folder}", *flags], unit, "unit.cpp", said.append).read_bytes()
        (message,) = said
        return message.startswith("compiling"), made

    compiler_says("one")
    new, first = compiled()
    assert new and compiled() == (False, first)
    (here / "number.hpp").write_text("const int number = 2;\n")
    new, second = compiled()
    assert new and second != first and compiled() == (False, second)
    assert compiled("-DNUMBER=1")[0] and not compiled("-DNUMBER=1")[0]
    compiler_says("two")
    assert compiled() == (True, second)
    (here / "number.hpp").write_text("const int number = 1;\n")
    compiler_says("one")
    # The fifth object pushes out the oldest one, unless it was used since.
    assert _build.KEPT == 4 and not compiled()[0]
    assert compiled(source="int found() { return 5; }\n")[0] and not compiled()[0]
    assert len(list(_build.cache_folder().glob("*"))) == 4
    # A cache that cannot be written is no error.
    os.environ["XDG_CACHE_HOME"] = f"{folder}/number.hpp"
    assert compiled() == (True, first)
print("test_build.py: passed")
