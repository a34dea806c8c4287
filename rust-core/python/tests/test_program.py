"""The program inside Python's process."""

import os
import subprocess
import sys

from concordem import _core

SCENARIO = """
version = 1
[packing]
kind = "random-dense"
count = 60
radius = "1 mm"
seed = 1
[packing.shape]
kind = "periodic"
[[material]]
name = "m"
density = 2000
linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }
[bonds]
law = "linear_bond"
coordination = 8
[contacts]
law = "none"
[stop]
steps = 1
"""


def test_another_build_makes_its_own_packing(tmp_path, monkeypatch):
    """The file of the module, not the interpreter, which stays the same, identifies the build that made a stored packing."""
    cache = tmp_path / "cache"
    monkeypatch.setenv("CONCORDEM_CACHE", str(cache))
    scenario = tmp_path / "cell.toml"
    scenario.write_text(SCENARIO)
    builds = [tmp_path / name for name in ("one.so", "two.so")]
    for number, build in enumerate(builds):
        build.write_text(build.name)
        for _ in range(2):
            assert _core.run_program(["run", "-q", "--force", str(scenario)], build) == 0
            assert len(list(cache.glob("*.packing"))) == number + 1


def test_the_exit_code_of_the_program_is_that_of_the_process(tmp_path):
    command = [sys.executable, "-m", "concordem"]
    # A name that is no UTF-8 reaches the program.
    name = os.fsdecode(b"missing-\xff.h5")
    given = subprocess.run([*command, "info", name], cwd=tmp_path, capture_output=True)
    assert given.returncode == 3, given.stderr
    given = subprocess.run([*command, "--no-such-option"], cwd=tmp_path, capture_output=True)
    assert given.returncode == 2, given.stderr
