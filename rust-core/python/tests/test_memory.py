"""Memory stays flat over many simulations in one process."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.once

SCRIPT = """
import copy, gc, pickle, sys
import numpy as np
import concordem
from concordem.laws import Law, Response

class Spring(Law):
    def stiffness(self, geometry):
        return 1e6, 0.0
    def respond(self, contacts):
        return Response(1e6 * contacts.elongation)

scenario = concordem.Scenario(
    packing={"kind": "spheres", "spheres": [[0, 0, 0, "1 mm"], ["2 mm", 0, 0, "1 mm"]]},
    material={"name": "glass", "density": "2500 kg/m^3",
              "linear_bond": {"normal_stiffness": "1e6 N/m", "shear_stiffness": "3e5 N/m"}},
    bonds={"law": "linear_bond", "interaction_ratio": 1.1},
    contacts={"law": "none"},
    stop={"steps": 30},
)
path = sys.argv[2]

def once(number):
    simulation = scenario.simulation(threads=1, bond_law=Spring() if number % 5 == 0 else None)
    simulation.state.writable("velocities")[1, 0] = 1e-3
    simulation.step(10)
    simulation.restore(simulation.snapshot())
    other = copy.copy(simulation)
    if number % 5:
        simulation.change({"integration.gravity": [0, 0, -1]})
    simulation.run(), other.run(), simulation.samples, simulation.events, simulation.state.contacts()
    if number % 50 == 0:
        simulation.write(path, overwrite=True)
        concordem.Result(path).samples
        if number % 5:
            pickle.loads(pickle.dumps(simulation))

def resident():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

count = int(sys.argv[1])
for number in range(count // 2):
    once(number)
before = resident()
for number in range(count // 2, count):
    once(number)
print(before, resident())
"""

COUNT = 10_000 if os.environ.get("CONCORDEM_TEST_FULL") else 400


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_memory_is_flat(tmp_path):
    """The second half of the simulations needs no memory more than the first: at most 100 bytes for each, and what the heap rounds."""
    given = subprocess.run([sys.executable, "-c", SCRIPT, str(COUNT), str(tmp_path / "run.h5")], capture_output=True, text=True)
    assert given.returncode == 0, given.stderr
    before, after = map(int, given.stdout.split())
    assert after - before < 100 * COUNT // 2 + 500_000, f"{(after - before) / (COUNT / 2):.0f} bytes for each simulation"
