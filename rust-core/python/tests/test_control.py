"""Control of a simulation while it runs: keys of the scenario, walls, bonds, energies; and what cannot be changed."""

import concordem
import numpy as np
import pytest

BOX = """
version = 1
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
repeats = [2, 2, 2]
[[material]]
name = "m"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 2e5, normal_strength = 1e3, shear_strength = 1e3 }
frictional = { normal_stiffness = 1e6, shear_stiffness = 2e5, friction_coefficient = 0.3 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.01
[contacts]
law = "frictional"
[[wall]]
name = "floor"
material = "m"
shape = { kind = "plane", point = [0, 0, "-10 mm"], normal = [0, 0, 1] }
[[wall]]
name = "lid"
material = "m"
shape = { kind = "plane", point = [0, 0, "10 mm"], normal = [0, 0, -1] }
servo = { force = "1 N", maximum_speed = "0.1 m/s" }
[output]
sample_interval = 5
[stop]
steps = 2000
"""


@pytest.fixture
def box():
    return concordem.Scenario.from_text(BOX)


def test_a_change_is_that_of_a_checkpoint(box, tmp_path):
    """Gravity and damping changed on the way: the bits of a run that was saved, and loaded with the changed scenario."""
    settings = {"integration.gravity": [0, 0, -9.81], "integration.damping": {"kind": "local", "coefficient": 0.2}}
    simulation = box.simulation(threads=1)
    simulation.step(100)
    simulation.save(tmp_path / "state.h5")
    view = simulation.state.velocities
    simulation.change(settings)
    loaded = concordem.Simulation.load(tmp_path / "state.h5", box.with_settings(settings), threads=1)
    for run in (simulation, loaded):
        run.step(200)
    assert simulation.state_hash() == loaded.state_hash()
    assert np.shares_memory(view, simulation.state.velocities) and view[:, 2].mean() < -1e-4
    assert simulation.scenario.to_dict()["integration"]["gravity"] == [0, 0, -9.81]
    text = concordem.Result(simulation.write(tmp_path / "run.h5")).provenance["changed_from_python"]
    assert "integration.gravity" in text and "before step 100" in text
    # It is kept by checkpoints, and a snapshot of before is of another scenario.
    simulation.save(tmp_path / "later.h5")
    again = concordem.Simulation.load(tmp_path / "later.h5", threads=1)
    for run in (simulation, again):
        run.step(50)
    assert again.state_hash() == simulation.state_hash()


def test_gravity_accelerates_by_its_amount(box):
    simulation = box.with_settings({"bonds.interaction_ratio": 1.01}).simulation(threads=1)
    simulation.change({"integration.gravity": [0, 0, -5]})
    simulation.step(10)
    masses = simulation.state.masses
    mean = (masses[:, None] * simulation.state.velocities).sum(axis=0) / masses.sum()
    np.testing.assert_allclose(mean, [0, 0, -5 * 10 * simulation.state.time_step], rtol=1e-12, atol=1e-18)


def test_a_run_that_has_ended_goes_on(box):
    simulation = box.with_settings({"stop.steps": 50}).simulation(threads=1)
    assert simulation.run() == "steps"
    simulation.change({"stop.steps": 80})
    assert simulation.stopped is None and simulation.run() == "steps" and simulation.state.step == 80
    whole = box.with_settings({"stop.steps": 80}).simulation(threads=1)
    whole.run()
    assert whole.state_hash() == simulation.state_hash() and whole.samples.tobytes() == simulation.samples.tobytes()


@pytest.mark.parametrize(
    ("settings", "error", "match"),
    [
        ({"packing.radius": "2 mm"}, concordem.ScenarioError, "particles cannot be added or removed: arrays of `state` are views"),
        ({"packing.repeats": [2, 2, 3]}, concordem.ScenarioError, "particles cannot be added or removed: arrays of `state` are views"),
        ({"bonds.interaction_ratio": 1.5}, concordem.ScenarioError, "call make_bonds and break_bonds"),
        ({"wall": []}, concordem.ScenarioError, "walls cannot be added or removed; call drive_wall and place_wall"),
        ({"material[0].density": 3000}, concordem.ScenarioError, "a restart cannot change this key\n  help: masses"),
        ({"stop.steps": 3}, ValueError, "already at step"),
        ({"integration.gravity": "9.81 m"}, concordem.ScenarioError, "gravity"),
        ({"nowhere.key": 1}, ValueError, "nowhere"),
        ({"material[0].linear_bond.normal_stiffness": 1e12}, concordem.UnstableError, "stability bound"),
    ],
)
def test_changes_that_are_refused_change_nothing(box, settings, error, match):
    simulation, other = box.simulation(threads=1), box.simulation(threads=1)
    for run in (simulation, other):
        run.step(40)
    with pytest.raises(error, match=match):
        simulation.change(settings)
    for run in (simulation, other):
        run.step(40)
    assert simulation.state_hash() == other.state_hash() and simulation.scenario == box


def test_walls(box):
    simulation = box.simulation(threads=1)
    assert simulation.wall_names == ["floor", "lid"]
    simulation.drive_wall("floor", [0, 0, 0.5])
    simulation.step(10)
    floor = simulation.wall("floor")
    np.testing.assert_allclose(floor.displacement, [0, 0, 0.5 * 10 * simulation.state.time_step], rtol=1e-12)
    assert floor.velocity.tolist() == [0, 0, 0.5] and floor.angular_velocity is None
    lowest = (simulation.state.positions[:, 2] - simulation.state.radii).min()
    simulation.drive_wall("floor", [0, 0, 0])
    simulation.place_wall("floor", [0, 0, lowest + 0.010 + 1e-5])
    simulation.step(1)
    force = simulation.wall("floor").force
    assert force[2] < 0
    np.testing.assert_allclose(force[2], -simulation.net_forces()[0][:, 2].sum(), rtol=1e-9)
    # The servo keeps its force when it is changed.
    simulation.change({"wall[1].servo.force": "2 N"})
    for name, velocity, match in [
        ("lid", [0, 0, 1], "its servo moves it"),
        ("roof", [0, 0, 1], r'there is no wall "roof"; the walls are: \["floor", "lid"\]'),
        ("floor", [0, 0, np.nan], "not finite"),
    ]:
        with pytest.raises(ValueError, match=match):
            simulation.drive_wall(name, velocity)
        with pytest.raises(ValueError, match=match):
            simulation.place_wall(name, velocity)
    with pytest.raises(ValueError, match="it has no axis"):
        simulation.drive_wall("floor", [0, 0, 0], [0, 0, 1])


def test_a_driven_wall_moves_as_one_of_the_scenario(box):
    """The work is that of a wall which has its place and velocity from the scenario; the first half step differs, 1e-4 of the work."""
    free = BOX.replace('servo = { force = "1 N", maximum_speed = "0.1 m/s" }', "")
    simulation = concordem.Scenario.from_text(free).simulation(threads=1)
    lowest = (simulation.state.positions[:, 2] - simulation.state.radii).min()
    simulation.place_wall("floor", [0, 0, lowest + 0.010])
    simulation.drive_wall("floor", [0, 0, 0.2])
    given = free.replace('[0, 0, "-10 mm"], normal = [0, 0, 1] }', f"[0, 0, {lowest}], normal = [0, 0, 1] }}\nvelocity = [0, 0, 0.2]")
    other = concordem.Scenario.from_text(given).simulation(threads=1)
    for run in (simulation, other):
        run.step(200)
    one, two = simulation.energies(), other.energies()
    assert two["boundary_work"] > 1e-5
    assert one["boundary_work"] == pytest.approx(two["boundary_work"], rel=5e-4)
    assert one["kinetic"] == pytest.approx(two["kinetic"], rel=5e-3)
    assert set(one) <= set(simulation.samples.dtype.names)


def test_bonds_break_and_are_made(box):
    simulation = box.simulation(threads=1)
    simulation.step(5)
    bonds = simulation.state.contacts()["linear_bond"]
    pairs = np.stack([bonds["a"], bonds["b"]], axis=1)[::7]
    before = simulation.state.bond_count
    assert simulation.break_bonds(pairs[:, ::-1]) == len(pairs)
    simulation.step(1)
    assert simulation.state.bond_count == before - len(pairs)
    events = {(min(e["a"], e["b"]), max(e["a"], e["b"])) for e in simulation.events}
    assert events == {(min(p), max(p)) for p in pairs.tolist()}
    with pytest.raises(ValueError, match="have no intact bond"):
        simulation.break_bonds(pairs)
    with pytest.raises(ValueError, match="there is no particle with id 9999"):
        simulation.break_bonds([[0, 9999]])
    # Those that broke stay broken, the others of the range are there already.
    assert simulation.make_bonds(1.01) == 0
    made = simulation.make_bonds(1.45)
    assert made > 0 and simulation.state.bond_count == before - len(pairs) + made
    simulation.step(10)
    with pytest.raises(ValueError, match="positive number"):
        simulation.make_bonds(0)


def test_bonds_that_are_too_stiff_change_nothing(box):
    """The time step is too large for many more bonds: the simulation stays as it was."""
    scenario = box.with_settings({"integration.time_step": f"{0.95 * box.simulation(threads=1).summary.largest_time_step} s"})
    simulation, other = scenario.simulation(threads=1), scenario.simulation(threads=1)
    for run in (simulation, other):
        run.step(5)
    with pytest.raises(concordem.SolverError, match="bonds"):
        simulation.make_bonds(2.9)
    for run in (simulation, other):
        run.step(5)
    assert simulation.state_hash() == other.state_hash()


def test_bonds_without_a_law_are_refused(box):
    loose = {key: value for key, value in box.to_dict().items() if key != "bonds"}
    del loose["material"][0]["linear_bond"]
    simulation = concordem.Scenario.from_dict(loose).simulation(threads=1)
    with pytest.raises(ValueError, match=r"has no \[bonds\]"):
        simulation.make_bonds(1.1)


@pytest.mark.parametrize("name", ["orientations", "radii", "masses", "inertias", "materials", "clumps", "tags", "ids", "temperatures", "nothing"])
def test_fields_that_cannot_be_written_say_why(box, name):
    simulation = box.simulation(threads=1)
    with pytest.raises(ValueError, match=name):
        simulation.state.writable(name)
