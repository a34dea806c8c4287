"""The new operator in a scenario, in the result, the report, the table of the book, and Python: `check.py TREE OUT`."""
import csv
import os
import shutil
import subprocess
import sys
from pathlib import Path

import concordem
import numpy as np

NAME = "granular-temperature"
tree, out = (Path(word) for word in sys.argv[1:])
program = os.environ["CONCORDEM"]


def run(*words):
    done = subprocess.run([program, *map(str, words)], check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout


def near(found, expected):
    assert np.allclose(found, expected, rtol=1e-12, atol=1e-15), (found, expected)


# The scenario has ±1 m/s along x: mean 0, T = 1/3 m²/s².
scenario = out / "scenario.toml"
shutil.copy(tree / "tests/new_kind/operator/scenario.toml", scenario)
result, report = out / "scenario.h5", out / "report.html"
run("run", "--force", "--quiet", scenario)
table = concordem.Result(result).table(f"samples/{NAME}")
near(table["temperature"], 1 / 3)
near(table["velocity"], 0)
assert len(table["temperature"]) > 5 and set(table["particles"]) == {2}
# With all three the temperature is 2/9.
printed = run("measure", result, "--operator", NAME, "--region", '{ kind = "all", volume = "1 cm^3" }', "--csv")
row = next(csv.DictReader(printed.splitlines()))
near(float(row["temperature [m^2/s^2]"]), 2 / 9)
run("report", result, "--force", "--output", report)
assert f"{NAME}, temperature" in report.read_text(encoding="utf-8")

# From Python: the records, and the same operator at any moment with another region.
assert NAME in concordem.operators.sampled_operators()
simulation = concordem.Scenario.from_file(scenario).simulation(threads=1)
now = simulation.sample(NAME, region={"kind": "set", "set": "right", "volume": "1 cm^3"})
near(now["velocity"], [1, 0, 0])
near(now["temperature"], 0)
simulation.run()
near(simulation.operator_samples[NAME]["temperature"], 1 / 3)
try:
    simulation.sample(NAME, truncation="internal-only")
except concordem.ScenarioError as error:
    assert "does not use this key" in str(error), error
else:
    raise AssertionError("a key that the operator does not use is accepted")

# The table of the book, as generate_reference.py makes it: behind at first, which is an error, then written.
sys.path.insert(0, str(tree / "docs/book"))
from reference_pages import lists  # noqa: E402


def of_program(*words):
    return subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout


try:
    lists.committed(program, of_program, write=False)
except SystemExit as error:
    assert "the block operators is not up to date" in str(error), error
else:
    raise AssertionError("a table without the new operator counts as up to date")
lists.committed(program, of_program, write=True)
page = (tree / "docs/book/theory/operators.md").read_text(encoding="utf-8")
assert f"| `{NAME}` | Granular temperature and mean velocity | [Notation](notation.md) |" in page
lists.committed(program, of_program, write=False)
print("the new operator works in the scenario, the result, the report, the book, and Python")
