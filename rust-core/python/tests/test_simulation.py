"""Simulations: bitwise equal results however they are driven, valid views, interruption."""

import _thread
import gc
import pickle
import subprocess
import sys
import threading
import time
import weakref

import concordem
import numpy as np
import pytest
from conftest import TWO


def test_run_and_step_and_threads_give_the_same_bits(concrete):
    whole = concrete.simulation(threads=1)
    whole.step(300)
    parts = concrete.simulation(threads=2)
    for count in (1, 9, 190, 100):
        parts.step(count)
    assert whole.state_hash() == parts.state_hash()
    assert np.array_equal(whole.samples, parts.samples)


def test_the_program_and_python_agree(concrete, tmp_path):
    text = concrete.text
    assert "[stop]" in text
    data = concrete.to_dict()
    data["stop"] = {"steps": 60}
    scenario = concordem.Scenario.from_dict(data)
    (tmp_path / "s.toml").write_text(scenario.text)
    command = [sys.executable, "-m", "concordem", "run", "--quiet", str(tmp_path / "s.toml")]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    result = concordem.Result(tmp_path / "s.h5")
    simulation = scenario.simulation()
    assert simulation.run() == "steps"
    assert result.state_hash == simulation.state_hash()
    for name in result.samples.dtype.names:
        assert np.array_equal(result.samples[name], simulation.samples[name]), name
    assert concordem.units(result.samples) == concordem.units(simulation.samples)
    assert len(result.events) == len(simulation.events)
    assert result.laws == ["cpm", "unbonded"] or "cpm" in result.laws
    assert result.table("particles")["position"].shape == (len(simulation.state), 3)
    assert "version" in result.scenario_text and result.provenance


def test_checkpoints_go_on_with_the_same_bits(concrete, tmp_path):
    straight = concrete.simulation()
    straight.step(80)
    straight.save(tmp_path / "half.h5")
    loaded = concordem.Simulation.load(tmp_path / "half.h5")
    assert loaded.state.step == 80 and loaded.state_hash() == straight.state_hash()
    straight.step(40)
    loaded.step(40)
    assert loaded.state_hash() == straight.state_hash()
    (tmp_path / "half.h5").write_bytes(b"no checkpoint")
    with pytest.raises(concordem.ResultError):
        concordem.Simulation.load(tmp_path / "half.h5")


def test_a_snapshot_goes_back_with_the_same_bits_and_its_records(concrete):
    # Records are taken before and after the snapshot.
    data = concrete.to_dict()
    data["output"] = data.get("output", {}) | {"sample_interval": 7}
    scenario = concordem.Scenario.from_dict(data)
    simulation = scenario.simulation(threads=2)
    positions, ids = simulation.state.positions, simulation.state.ids
    simulation.step(80)
    kept, hashed, records = simulation.snapshot(), simulation.state_hash(), len(simulation.samples)
    at = positions.copy()
    ends = []
    for _ in range(2):
        simulation.step(200)
        ends.append((simulation.state_hash(), simulation.samples.tobytes()))
        assert not np.array_equal(positions, at)
        simulation.restore(kept)
        assert simulation.state_hash() == hashed and len(simulation.samples) == records
        # Views of the arrays show the restored state.
        assert np.array_equal(positions, at) and np.array_equal(positions, simulation.state.positions)
        assert positions.ctypes.data == simulation.state.positions.ctypes.data and ids.ctypes.data == simulation.state.ids.ctypes.data
    assert ends[0] == ends[1]
    with pytest.raises(ValueError, match="snapshot"):
        concordem.Scenario.template("hertz-impact").simulation(threads=1).restore(kept)


def test_a_snapshot_brings_back_a_bond_that_broke():
    simulation = concordem.Scenario(**{**TWO, "integration": {"allow_energy_error": True}}).simulation()
    simulation.state.writable("velocities")[1] = [20.0, 0, 0]
    kept, ends = simulation.snapshot(), []
    for _ in range(2):
        assert simulation.state.bond_count == 1 and len(simulation.events) == 0
        simulation.step(300)
        assert simulation.state.bond_count == 0
        ends.append((simulation.state_hash(), simulation.events.tobytes()))
        simulation.restore(kept)
    assert ends[0] == ends[1]


def test_a_snapshot_keeps_the_motion_and_the_loads_that_python_set():
    tables = TWO | {"set": [{"name": "held", "selection": {"kind": "ids", "ids": [0]}}],
                    "prescribe": [{"set": "held", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}]}
    simulation = concordem.Scenario(**tables).simulation()
    still = np.zeros((2, 3))
    moving = np.array([[1e-3, 0, 0], [0, 0, 0]])
    simulation.set_motion(moving, still)
    simulation.set_loads(np.array([[0, 0, 0], [0, 0.5, 0]]))
    simulation.step(10)
    kept = simulation.snapshot()
    simulation.step(30)
    end = simulation.state_hash()
    simulation.restore(kept)
    simulation.set_motion(still, still)
    simulation.set_loads(still)
    simulation.step(30)
    assert simulation.state_hash() != end
    simulation.restore(kept)
    simulation.step(30)
    assert simulation.state_hash() == end


def test_another_scenario_is_applied_or_refused_by_key(tmp_path):
    block = concordem.Scenario(
        packing={"kind": "lattice", "lattice": "hcp", "radius": "1 mm", "repeats": [5, 3, 5]},
        material={"name": "stone", "density": 2500,
                  "linear_bond": {"normal_stiffness": 1e6, "shear_stiffness": 2e5}},
        bonds={"law": "linear_bond", "interaction_ratio": 1.05},
        contacts={"law": "none"},
        loading={"kind": "uniaxial", "strain_rate": 1.0},
        stop={"steps": 50},
    )
    simulation = block.simulation()
    assert simulation.run() == "steps"
    simulation.save(tmp_path / "end.h5")
    fastest = simulation.state.velocities[:, 2].max()
    # Another rate moves the ends at that rate.
    data = block.to_dict() | {"stop": {"steps": 51}}
    data["loading"]["strain_rate"] = 0.5
    other = concordem.Simulation.load(tmp_path / "end.h5", concordem.Scenario.from_dict(data))
    prescribed = np.abs(other.state.velocities[:, 2])
    assert other.run() == "steps" and other.state.step == 51
    assert 0 < prescribed.max() and fastest > 0
    # Another packing is an error that names the key, not a panic.
    data["packing"]["repeats"] = [5, 3, 6]
    with pytest.raises(concordem.ScenarioError, match="restart cannot change") as caught:
        concordem.Simulation.load(tmp_path / "end.h5", concordem.Scenario.from_dict(data))
    assert caught.value.key == "packing.repeats[2]"


@pytest.mark.parametrize("place", ["with", "without", "argument"])
def test_a_panic_is_an_error_of_the_package(place):
    """With and without the interpreter's lock, and while pyo3 converts an argument, outside of any function of ours."""
    with pytest.raises(Exception, match=r"^intended panic \(internal error; please report it") as caught:
        concordem._core._panic(place)
    error = caught.value
    assert isinstance(error, concordem.InternalError) and isinstance(error, concordem.ConcordemError)
    assert error.kind == "Panic" and type(error).__name__ == "InternalError"
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, concordem.InternalError) and str(again) == str(error)


def test_a_panic_while_reading_leaves_the_simulation_usable(two):
    simulation = two.simulation()
    simulation.step(5)
    before = simulation.state_hash()
    with pytest.raises(concordem.InternalError):
        concordem._core._panic("read", simulation)
    assert simulation.state_hash() == before and len(simulation.samples) > 0
    simulation.step(5)
    assert simulation.state.step == 10


def test_a_panic_during_a_step_ends_the_simulation(two):
    simulation = two.simulation()
    with pytest.raises(concordem.InternalError):
        concordem._core._panic("changed", simulation)
    for use in (simulation.step, simulation.state_hash, simulation.forces, lambda: simulation.state.positions):
        with pytest.raises(RuntimeError, match="failed in the middle of a step"):
            use()


def test_a_panic_in_a_progress_function_is_an_error(concrete):
    simulation = concrete.simulation(threads=1)
    with pytest.raises(concordem.InternalError, match="intended panic"):
        simulation.step(10_000_000, progress=lambda text, share: concordem._core._panic("with"))
    assert simulation.state.step > 0
    # The packing is made inside the library, which the panic of the function unwinds.
    specimen = concordem.Scenario.template("cpm-specimen-tension")
    with pytest.raises(concordem.InternalError, match="intended panic"):
        specimen.pack(threads=1, progress=lambda stage, share: concordem._core._panic("without"))


def test_views_show_what_happens_and_outlive_the_simulation():
    # A written velocity adds energy without a source, and 20 m/s is too fast for the time step.
    two = concordem.Scenario(**{**TWO, "integration": {**TWO.get("integration", {}), "allow_energy_error": True}})
    simulation = two.simulation()
    positions, velocities = simulation.state.positions, simulation.state.velocities
    address = positions.ctypes.data
    before = positions.copy()
    simulation.state.writable("velocities")[1] = [20.0, 0, 0]
    assert velocities[1, 0] == 20.0
    # The bond breaks and neighbor lists are rebuilt, but the arrays do not move.
    simulation.step(300)
    assert simulation.state.bond_count == 0 and len(simulation.events) >= 1
    assert simulation.state.positions.ctypes.data == address
    assert not np.array_equal(positions, before)
    alive = weakref.ref(simulation)
    last = positions.copy()
    del simulation
    gc.collect()
    assert alive() is not None, "a view keeps its simulation"
    assert np.array_equal(positions, last)
    del positions, velocities
    gc.collect()
    assert alive() is None, "and lets it go"


def test_views_are_read_only_unless_asked(two):
    state = two.simulation().state
    names = ["ids", "positions", "velocities", "angular_velocities", "orientations", "radii", "masses", "inertias"]
    for name in names + ["materials", "clumps", "tags"]:
        view = getattr(state, name)
        assert not view.flags.writeable and not view.flags.owndata, name
        with pytest.raises(ValueError):
            view[0] = 0
        with pytest.raises(ValueError):
            view.flags.writeable = True
    assert state.writable("positions").flags.writeable
    with pytest.raises(ValueError, match="radii"):
        state.writable("radii")


def test_tables_of_contacts_are_copies_with_units(concrete):
    simulation = concrete.simulation()
    simulation.step(50)
    table = simulation.state.contacts()["cpm"]
    assert len(table) == simulation.state.bond_count
    units = concordem.units(table)
    assert units["area"] == "m^2" and units["kappa"] == "1" and units["normal"] == "1"
    kept = table.copy()
    simulation.step(50)
    assert np.array_equal(table, kept), "what was read does not change"
    x, ids = simulation.state.positions, simulation.state.ids
    assert np.array_equal(ids[table["index_a"]], table["a"])
    # The table has the strain of the step; one step later, lengths have changed by at most 1e-6.
    table = simulation.state.contacts()["cpm"]
    length = np.linalg.norm(x[table["index_b"]] - x[table["index_a"]], axis=1)
    assert np.allclose(length, table["length"], rtol=1e-5)
    assert np.allclose(table["length"] / table["reference_length"] - 1, table["normal_strain"], atol=1e-12)


def test_forces_balance_what_the_solver_found(concrete):
    simulation = concrete.simulation()
    simulation.step(50)
    contacts = simulation.forces().contacts
    force, moment = concordem.operators.resultants(simulation.state.positions, contacts)
    simulation.step(1)
    net, torque = simulation.net_forces()
    # Tolerance: about twelve terms are summed in another order.
    scale = np.abs(contacts.force).max()
    assert np.abs(net - force).max() < 1e-14 * scale * 12
    assert np.abs(torque - moment).max() < 1e-14 * scale * 12 * simulation.state.radii.max()


def test_a_key_press_leaves_a_state_that_goes_on(concrete):
    simulation = concrete.simulation(threads=1)
    timer = threading.Timer(0.4, _thread.interrupt_main)
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        simulation.step(10_000_000)
    assert time.monotonic() - start < 5.0, "looks at signals every 50 ms; the rest is for a busy machine"
    done = simulation.state.step
    assert done > 0
    simulation.step(10)
    other = concrete.simulation(threads=1)
    other.step(done + 10)
    assert other.state_hash() == simulation.state_hash()


def test_progress_functions_see_the_run_and_may_end_it(concrete):
    simulation = concrete.simulation(threads=1)
    seen = []

    def report(text, share):
        seen.append((text, share, simulation.state.step))
        if len(seen) == 2:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        simulation.step(10_000_000, progress=report)
    assert 0 < seen[0][2] < seen[1][2] and "strain" in seen[0][0]
    with pytest.raises(TypeError, match="progress"):
        simulation.step(1, progress="yes")


def test_other_threads_of_python_run_and_are_told_to_wait(concrete):
    simulation = concrete.simulation(threads=1)
    outcome = []

    def run():
        try:
            simulation.step(2000)
        except KeyboardInterrupt:
            pass
        outcome.append("done")

    worker = threading.Thread(target=run)
    worker.start()
    refused = counted = 0
    while worker.is_alive():
        counted += 1
        try:
            simulation.state.step
        except RuntimeError as error:
            assert "running" in str(error)
            refused += 1
    worker.join()
    assert outcome == ["done"] and refused > 0 and counted > 10


def test_runs_without_an_end_are_refused(two):
    data = two.to_dict()
    del data["stop"]
    with pytest.raises(concordem.ScenarioError, match="the run has no end"):
        concordem.Scenario.from_dict(data)


def test_motion_that_is_not_finite_is_an_error(two):
    simulation = two.simulation()
    simulation.state.writable("velocities")[0, 0] = np.nan
    with pytest.raises(concordem.SolverError) as caught:
        simulation.step(2)
    assert caught.value.kind == "Solver" or caught.value.kind == "NotFinite"


def test_progress_functions_see_a_packing_and_may_end_it():
    data = concordem.Scenario.template("cpm-specimen-tension").to_dict()
    data["packing"]["count"] = 100_000
    seen = []

    def report(stage, share):
        seen.append((stage, share))
        if len(seen) == 4:
            raise RuntimeError("enough")

    start = time.monotonic()
    with pytest.raises(RuntimeError, match="enough"):
        concordem.Scenario.from_dict(data).simulation(threads=1, progress=report)
    assert time.monotonic() - start < 5.0
    assert [stage for stage, _ in seen] == ["compaction"] * 4
    shares = [share for _, share in seen]
    assert shares == sorted(set(shares)) and shares[0] > 0


def test_a_packing_is_unwound_when_interrupted():
    # So many spheres that it takes minutes: a packing that is finished is in the cache, and the next run has it at once.
    data = concordem.Scenario.template("cpm-specimen-tension").to_dict()
    data["packing"]["count"] = 100_000
    start = time.monotonic()
    scenario = concordem.Scenario.from_dict(data)
    timer = threading.Timer(0.5, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        scenario.simulation(threads=1)
    assert time.monotonic() - start < 5.0, "while spheres are placed, too, which takes a minute here"


def test_sample_gives_what_the_run_records(concrete):
    region = {"kind": "box", "minimum": ["-16 mm"] * 3, "maximum": ["16 mm"] * 3}
    data = concrete.to_dict()
    data["sample"] = [{"operator": name, "region": region, "interval": 1} for name in ("region-stress", "affine-strain", "porosity")]
    simulation = concordem.Scenario.from_dict(data).simulation()
    simulation.step(20)
    before = simulation.state_hash()
    now = {sample["operator"]: simulation.sample(sample["operator"], region=region) for sample in data["sample"]}
    assert simulation.state_hash() == before
    simulation.step()
    for name, table in simulation.operator_samples.items():
        for quantity, value in now[name].items():
            assert np.array_equal(table[quantity][-1], value), (name, quantity)
    # Also an operator from the start that the scenario does not have, and a grid.
    assert simulation.sample("affine-rate", region=region)["gradient"].shape == (3, 3)
    cells = simulation.sample("cell-strain", region=region, grid=[2, 1, 1])
    assert cells["gradient"].shape == (2, 3, 3) and cells["volume"].shape == (2,)


def test_sample_checks_its_options(concrete):
    simulation = concrete.simulation()
    assert {"porosity", "wall-moment", "heat-flux"} <= set(concordem.operators.sampled_operators())
    with pytest.raises(concordem.ScenarioError, match="region-stress"):
        simulation.sample("stress")
    with pytest.raises(concordem.ScenarioError, match="no periodic cell"):
        simulation.sample("porosity")
    with pytest.raises(concordem.ScenarioError, match="does not use this key"):
        simulation.sample("porosity", region={"kind": "all", "volume": "1 cm^3"}, wall="floor")
    with pytest.raises(ValueError, match=r'^sample\("porosity", interval=2\): .* remove it'):
        simulation.sample("porosity", interval=2)


def test_problems_of_a_sample_begin_with_the_call(concrete):
    data = concrete.to_dict()
    material = data["material"][0]["name"]
    shapes = {"floor": "-1 m", "ceiling": "-2 m"}.items()
    walls = [{"name": name, "material": material, "shape": {"kind": "plane", "point": [0, 0, z], "normal": [0, 0, 1]}} for name, z in shapes]
    simulation = concordem.Scenario.from_dict({**data, "wall": walls}).simulation()
    refused = [
        # A wall that does not exist is named, and so are those that do, also where the area is missing.
        (("wall-traction", {"wall": "nowhere"}), 'sample("wall-traction", wall="nowhere"): ', ['wall = "nowhere": no wall has this name', "floor", "ceiling", "area"]),
        (("wall-traction", {"wall": "floor"}), 'sample("wall-traction", wall="floor"): operator = "wall-traction": wall-traction needs a wall and its area', ["36 mm^2"]),
        (("region-stress", {"wall": "floor"}), 'sample("region-stress", wall="floor"): wall = "floor": ', ["remove it"]),
        (("region-stress", {"region": {"kind": "box"}}), "sample(\"region-stress\", region={'kind': 'box'}): region", []),
        (("set-force", {"set": "top"}), 'sample("set-force", set="top"): set = "top"', []),
    ]
    for (operator, options), begins, holds in refused:
        with pytest.raises(concordem.ScenarioError) as info:
            simulation.sample(operator, **options)
        message = str(info.value)
        assert message.splitlines()[0].startswith(begins), message
        assert all(word in message for word in holds), message
        assert "--set" not in message and "sample[" not in message and not info.value.key.startswith("sample"), message
        assert (info.value.line, info.value.problems[0].column) == (1, 1)
    # What only the assembly can find, too.
    far = {"kind": "half-spaces", "volume": "1 m^3", "planes": [{"point": [0, 0, "-1 m"], "normal": [0, 0, 1]}]}
    cell = concordem.Scenario.template("cpm-periodic").with_settings({"packing.count": 100}).simulation()
    with pytest.raises(concordem.ScenarioError, match=r'^sample\("region-stress", region=.*\): region: '):
        cell.sample("region-stress", region=far)
