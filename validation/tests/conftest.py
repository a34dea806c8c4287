"""Tests of the harness. Tests that need the program or a peer are skipped if it is missing, or fail if CI is set."""
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from concordem_validate import case as cases  # noqa: E402
from concordem_validate import registry, report, runner  # noqa: E402
from concordem_validate.engines import concordem  # noqa: E402
from concordem_validate.errors import NotInstalled  # noqa: E402
from concordem_validate.result import Result  # noqa: E402


def need(*engines):
    """Skip or fail unless these engines exist; `operators` is our Python package."""
    for name in engines:
        try:
            concordem.package() if name == "operators" else registry.ENGINES[name].version()
        except NotInstalled as error:
            if runner.strict_by_default():
                pytest.fail(str(error))
            pytest.skip(str(error))


# where the rounds of the suite store their runs
FOLDER = cases.ROOT.parents[1] / "target" / "validate"
SCENARIO = """version = 1
[packing]
kind = "spheres"
spheres = [[0, 0, 0, "1 mm"], ["3 mm", 0, 0, "1 mm"]]
[[material]]
name = "m"
density = 2500
[contacts]
law = "none"
[integration]
time_step = "1 ms"
[stop]
steps = 100
[output]
snapshot_interval = 10
"""
CASE = """title = "t"
question = "q"
source = "s"
reference = "one"
engines = ["two", "three"]
[[check]]
name = "force"
kind = "series"
peer = "two"
of = "force"
tolerance = 1e-3
reason = "a tolerance for tests"
[[check]]
name = "force of the third"
kind = "series"
peer = "three"
of = "force"
tolerance = 1e-3
reason = "a tolerance for tests"
[[check]]
name = "positions"
kind = "series"
peer = "two"
of = "position"
scale = "displacement"
tolerance = 1e-6
reason = "a tolerance for tests"
"""


def sound(name="one", dt=1e-3):
    """A whole result: a force that rises and falls, and two particles that move."""
    steps = np.arange(0, 101, 10)
    result = Result(name, dt)
    time = steps * 1e-3
    result.add("force", steps, 0.3 + np.sin(20 * time) + 0.5 * time, "N")
    place = np.zeros((len(steps), 2, 3))
    place[:, 0, 0], place[:, 1, 0], place[:, 1, 1] = 0.01 * np.sin(15 * time), 3e-3 + 0.02 * time**2, 0.005 * time
    result.add("position", steps, place, "m")
    result.fields["mass"] = (np.ones(2), "kg")
    return result


class Fake:
    """An engine of a test: a sound result, changed by a function."""

    def __init__(self, name, change=None, version="1"):
        self.NAME, self.change, self.number, self.runs = name, change, version, 0

    def version(self):
        if self.number is None:
            raise NotInstalled(f"{self.NAME} is not installed; buy it")
        return f"{self.NAME} {self.number}"

    def run(self, task, folder, limit):
        self.runs += 1
        result = sound(self.NAME)
        return (self.change(result) or result) if self.change else result


@pytest.fixture(autouse=True)
def registered():
    """Self-checks of engines come into being when they are named; none of them outlives its test."""
    before = dict(registry.ENGINES)
    yield
    registry.ENGINES.clear()
    registry.ENGINES.update(before)


@pytest.fixture
def engines(monkeypatch):
    """Three engines, of which a test changes the second. ConcorDEM is not installed here."""
    monkeypatch.setenv(concordem.VARIABLE, "/nowhere/concordem")
    made = {name: Fake(name) for name in ("one", "two", "three")}
    for name, engine in made.items():
        monkeypatch.setitem(registry.ENGINES, name, engine)
    return made


@pytest.fixture
def no_page(monkeypatch):
    """Rounds without their HTML page, whose pictures take a second."""
    monkeypatch.setattr(report, "write", lambda path, *_: path)


@pytest.fixture
def folder(tmp_path):
    """A folder of one case."""
    place = tmp_path / "cases" / "small"
    place.mkdir(parents=True)
    (place / "scenario.toml").write_text(SCENARIO)
    (place / "case.toml").write_text(CASE)
    return tmp_path


def judged(folder, case="small", fresh=False):
    """A round of one case."""
    return runner.Runner(folder / "out", quiet=True, fresh=fresh, jobs=1).run([cases.load(case, folder / "cases")])
