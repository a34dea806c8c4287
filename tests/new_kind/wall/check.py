"""The new kind of wall in scenarios, with a servo and restart, in the report, the book, and Python: `check.py TREE OUT`."""
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import concordem
import numpy as np

tree, out = (Path(word) for word in sys.argv[1:])
program = os.environ["CONCORDEM"]


def run(*words, status=0):
    done = subprocess.run([program, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == status, done.stdout
    return done.stdout


# The servo reaches its force within the 1 % that `stop.unbalanced` asks for; the run would name a servo that is not there.
scenario = out / "scenario.toml"
shutil.copy(tree / "tests/new_kind/wall/scenario.toml", scenario)
result, report = out / "scenario.h5", out / "report.html"
printed = run("run", "--force", scenario)
assert "Not reached" not in printed, printed
push = concordem.Result(result).table("samples/push")["force"][-1]
assert abs(push[2] - 1) < 0.01 and not push[:2].any(), push
run("report", result, "--force", "--output", report)
assert "push" in report.read_text(encoding="utf-8")

# Threads and a restart in the middle keep every bit.
data = tomllib.loads(scenario.read_text(encoding="utf-8"))
whole = concordem.Scenario.from_dict(data).simulation(threads=1)
whole.run()
half = concordem.Scenario.from_dict(data).simulation(threads=2)
half.step(1234)
half.save(out / "half.h5")
again = concordem.Simulation.load(out / "half.h5")
again.run()
assert whole.state.positions.tobytes() == again.state.positions.tobytes()
assert whole.state.velocities.tobytes() == again.state.velocities.tobytes()
assert whole.forces().walls.force.tobytes() == again.forces().walls.force.tobytes()

# A sphere that flies at the center of a ball at rest comes straight back with its speed: no damping, no friction. The error of the
# leapfrog at the end of the contact is below one step of force, 2 π dt/t_c.
direction = np.array([1, 2, -2]) / 3
data["packing"]["spheres"] = [[*(direction * 0.041), 0.01]]
data["material"][0]["frictional"]["damping_ratio"] = 0
data["wall"] = [{"name": "indenter", "material": "glass", "shape": {"kind": "ball", "center": [0, 0, 0], "radius": 0.03, "normal": [0, 0, 1]}}]
data["set"] = [{"name": "all", "selection": {"kind": "ids", "ids": [0]}}]
data["initial"] = [{"set": "all", "velocity": [float(-v) for v in direction]}]
del data["sample"]
flight = concordem.Scenario.from_dict(data).simulation(threads=1)
flight.run()
found = flight.state.velocities[0]
assert np.allclose(found, direction, rtol=0, atol=2e-2), found
assert np.linalg.norm(np.cross(found, direction)) < 1e-12, found

# Wrong values are refused by their key.
for key, value, words in [("normal", [0, 0, 0], "must not be zero"), ("radius", 0, "radius"), ("axis", "z", "axis")]:
    shape = {**data["wall"][0]["shape"], key: value}
    try:
        concordem.Scenario.from_dict({**data, "wall": [{**data["wall"][0], "shape": shape}]})
    except concordem.ScenarioError as error:
        assert words in str(error), error
    else:
        raise AssertionError(f"{key} = {value} is accepted")

# The page of the book with the keys of walls.
sys.path.insert(0, str(tree / "docs/book"))
from reference_pages import scenario as reference  # noqa: E402


def of_program(*words):
    return subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout


assert "which a servo pushes along" in reference.pages(program, of_program)["scenario-wall.md"]
print("the new kind of wall works in scenarios, with a servo and restart, in the report, the book, and Python")
