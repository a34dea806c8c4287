"""Errors of `python3 -m concordem.yade build`."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path


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
print("test_build.py: passed")
