"""What a checkpoint and a snapshot keep: motion and loads set just before, records, and the names of a law's history."""

import subprocess
import sys

import concordem
import numpy as np
import pytest
from concordem.laws import Law, Response

pytestmark = pytest.mark.once

HELD = """
version = 1
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
repeats = [3, 3, 3]
[[material]]
name = "m"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 2e5, normal_strength = 10, shear_strength = 10 }
frictional = { normal_stiffness = 1e6, shear_stiffness = 2e5, friction_coefficient = 0.3 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.01
[contacts]
law = "frictional"
[[set]]
name = "end"
selection = { kind = "layer", axis = "z", end = "minimum", thickness = "1.5 mm" }
[[prescribe]]
set = "end"
velocity = [0, 0, 0]
angular_velocity = [0, 0, 0]
[[wall]]
name = "plate"
material = "m"
shape = { kind = "mesh", vertices = [[-0.01, -0.01, -0.0105], [0.02, -0.01, -0.0105], [0.0, 0.02, -0.0105]], triangles = [[0, 1, 2]] }
[[sample]]
operator = "region-stress"
region = { kind = "all", volume = "1 cm^3" }
[integration]
allow_energy_error = true
[output]
sample_interval = 3
[stop]
steps = 1000
"""


def push(n):
    return np.tile([0.1, 0.05, -0.02], (n, 1))


def write(array, values):
    array[...] = values


SETTERS = {
    "nothing": lambda s, n: None,
    "set_motion": lambda s, n: s.set_motion(push(n), 100 * push(n)),
    "set_motion twice": lambda s, n: (s.set_motion(push(n), push(n)), s.step(), s.set_motion(-push(n), push(n))),
    "set_loads": lambda s, n: s.set_loads(push(n), 1e-3 * push(n)),
    "drive_mesh": lambda s, n: s.drive_mesh("plate", np.tile([0, 0, 2.0], (3, 1))),
    "place_mesh": lambda s, n: s.place_mesh("plate", s.mesh("plate").positions + [0, 0, 1e-4], np.tile([0, 0, 2.0], (3, 1))),
    "velocities": lambda s, n: write(s.state.writable("velocities"), push(n)),
    "velocities after set_motion": lambda s, n: (s.set_motion(push(n), push(n)), s.step(), write(s.state.writable("velocities"), -push(n))),
    "angular velocities": lambda s, n: write(s.state.writable("angular_velocities"), 100 * push(n)),
    "positions": lambda s, n: write(s.state.writable("positions"), s.state.positions + 1e-7 * push(n)),
}


@pytest.mark.parametrize("name", SETTERS)
def test_what_was_set_just_before_survives(name, tmp_path):
    """Saved or kept at once, without a step between: loaded and restored, the run has the bits of one that goes on."""
    simulation = concordem.Scenario.from_text(HELD).simulation(threads=1)
    simulation.step(5)
    SETTERS[name](simulation, len(simulation.state))
    simulation.save(tmp_path / "state.h5")
    kept, now = simulation.snapshot(), simulation.state_hash()
    loaded = concordem.Simulation.load(tmp_path / "state.h5", threads=1)
    assert loaded.state_hash() == now
    ends = []
    for run in (simulation, loaded):
        run.step(10)
        ends.append(run.state_hash())
    simulation.restore(kept)
    assert simulation.state_hash() == now
    simulation.step(10)
    assert ends == [simulation.state_hash()] * 2
    if name != "nothing":
        still = concordem.Scenario.from_text(HELD).simulation(threads=1)
        still.step(int(loaded.state.step))
        assert still.state_hash() != ends[0], "the setter has no effect"


def records(run):
    tables = [run.samples, run.events, *run.operator_samples.values()]
    return [table.tobytes() for table in tables]


def test_records_survive(concrete, tmp_path):
    """The loaded run has the records of one without interruption."""
    data = concrete.to_dict()
    data["sample"] = [{"operator": "region-stress", "region": {"kind": "all", "volume": "1 cm^3"}}]
    # Four times the rate of the template: a fourth of the steps, and as many events.
    data["loading"]["strain_rate"] = "1.6 1/s"
    scenario = concordem.Scenario.from_dict(data | {"output": {"sample_interval": 7}})
    whole = scenario.simulation(threads=2)
    whole.step(1000)
    whole.save(tmp_path / "state.h5")
    before = records(whole)
    assert len(whole.samples) > 100
    loaded = concordem.Simulation.load(tmp_path / "state.h5", threads=2)
    assert records(loaded) == before
    for run in (whole, loaded):
        run.run()
    assert records(loaded) == records(whole) and len(whole.events) > 0
    # At the end, with the rows of the final state.
    loaded.save(tmp_path / "end.h5")
    assert records(concordem.Simulation.load(tmp_path / "end.h5", threads=2)) == records(whole)


def test_a_longer_run_replaces_the_rows_of_the_end(tmp_path):
    scenario = concordem.Scenario.from_text(HELD)
    short, long = (scenario.with_settings({"stop.steps": steps}) for steps in (30, 60))
    first, whole = short.simulation(threads=1), long.simulation(threads=1)
    first.run()
    whole.run()
    first.save(tmp_path / "end.h5")
    further = concordem.Simulation.load(tmp_path / "end.h5", long, threads=1)
    further.run()
    assert records(further) == records(whole) and further.state_hash() == whole.state_hash()


def test_records_of_a_result_come_with_it(tmp_path):
    (tmp_path / "s.toml").write_text(HELD.replace("steps = 1000", "steps = 30"))
    command = [sys.executable, "-m", "concordem", "run", "--quiet", "--threads", "1", str(tmp_path / "s.toml")]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    short = concordem.Scenario.from_file(tmp_path / "s.toml").simulation(threads=1)
    short.run()
    loaded = concordem.Simulation.load(tmp_path / "s.h5", threads=1)
    assert records(loaded) == records(short) and loaded.stopped == "steps"
    long = concordem.Scenario.from_text(HELD.replace("steps = 1000", "steps = 60"))
    further, whole = concordem.Simulation.load(tmp_path / "s.h5", long, threads=1), long.simulation(threads=1)
    for run in (further, whole):
        run.run()
    assert records(further) == records(whole)


class Slipping(Law):
    history = {"temperature": "scalar", "slip": "vector"}

    def stiffness(self, geometry):
        return 1e6, 0.0

    def respond(self, contacts):
        return Response(1e6 * contacts.elongation, history={"temperature": 777.0})


class Damaging(Slipping):
    history = {"slip": "vector", "damage": "scalar"}

    def respond(self, contacts):
        return Response(1e6 * contacts.elongation)


class Reordered(Slipping):
    history = {"slip": "vector", "temperature": "scalar"}


def test_a_law_with_another_history_is_refused(two, tmp_path):
    simulation = two.simulation(bond_law=Slipping())
    simulation.step(2)
    simulation.save(tmp_path / "state.h5")
    with pytest.raises(ValueError, match="bond_law has the history {slip: vector, damage: scalar}, but the checkpoint was written with "):
        concordem.Simulation.load(tmp_path / "state.h5", bond_law=Damaging())
    with pytest.raises(ValueError, match="give it as bond_law"):
        concordem.Simulation.load(tmp_path / "state.h5")
    # Vectors and scalars have places of their own, so that their order among each other does not matter.
    for law in (Slipping(), Reordered()):
        again = concordem.Simulation.load(tmp_path / "state.h5", bond_law=law)
        assert again.state_hash() == simulation.state_hash()


def test_a_temperature_that_is_no_number_ends_the_run():
    text = HELD.replace("[contacts]\nlaw = \"frictional\"", "[contacts]\nlaw = \"none\"").split("[[wall]]")[0]
    text = "\n".join(line for line in text.splitlines() if not line.startswith("frictional"))
    text = text.replace("density = 2500\n", "density = 2500\nthermal = { specific_heat = 800, conductivity = 1 }\n")
    text += """
[[history]]
name = "fade"
shape = { kind = "expression", expression = "sqrt(1 - t/1e-4)", until = "0.1 ms" }
[heat]
model = "ordered"
pairs = "bonds"
temperature = 293
[[heat.source]]
set = "end"
power = 1
history = "fade"
[stop]
steps = 500
"""
    simulation = concordem.Scenario.from_text(text).simulation(threads=1)
    with pytest.raises(concordem.SolverError, match="the temperature of the particle with id 0 is no longer a finite number"):
        simulation.run()
    assert 0 < simulation.state.time < 1.2e-4
