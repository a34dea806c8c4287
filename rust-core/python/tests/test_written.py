"""A run driven from Python ends in a result: the file of the program, for all that reads such files."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import threading

import concordem
import h5py
import numpy as np
import pytest

DIFFER = {"run_id", "wall_time_s", "ended_utc", "first_step_after_s", "stability_bound_s", "threads"}
"""Attributes in which the results of two runs differ."""


def contents(path):
    """All datasets and attributes of a result, by name."""
    found = {}

    def add(name, item):
        found.update({f"{name}@{key}": np.asarray(value).tobytes() for key, value in item.attrs.items() if key not in DIFFER})
        if isinstance(item, h5py.Dataset):
            found[name] = (item.shape, str(item.dtype), np.asarray(item[()]).tobytes() if item.shape is not None else b"")

    with h5py.File(path) as file:
        add("", file)
        file.visititems(add)
    return found


def program(*arguments, **options):
    return subprocess.run([sys.executable, "-m", "concordem", *map(str, arguments)], capture_output=True, text=True, **options)


SMALL = """
version = 1
title = "small"
[packing]
kind = "random-dense"
count = 150
radius = "1 mm"
seed = 2
shape = { kind = "box", size = ["8 mm", "8 mm", "8 mm"] }
[[material]]
name = "m"
density = 2500
cpm = { young = "25 GPa", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = "3 MPa", friction_coefficient = 0.8 }
[bonds]
law = "cpm"
interaction_ratio = 1.5
[contacts]
law = "cpm"
[loading]
kind = "uniaxial"
axis = "z"
strain_rate = "10 1/s"
[integration.damping]
kind = "local"
coefficient = 0.3
[[sample]]
operator = "region-stress"
region = { kind = "sphere", center = [0, 0, 0], radius = "3 mm" }
interval = 50
[output]
sample_interval = 7
snapshot_interval = 200
bond_snapshots = true
csv = true
[stop]
steps = 900
"""


@pytest.fixture
def small(tmp_path):
    """A file with a small specimen that breaks."""
    text = SMALL
    path = tmp_path / "small.toml"
    path.write_text(text)
    return path


def test_the_result_is_that_of_the_program(small, tmp_path):
    """Bit for bit, but for the attributes that must differ; in one go and in steps, with any threads, table included."""
    given = program("run", "-q", "-j", "1", small)
    assert given.returncode == 0, given.stderr
    expected = contents(tmp_path / "small.h5")
    assert any(name.startswith("VTKHDF") for name in expected) and any(name.startswith("bonds/") for name in expected)
    table = (tmp_path / "small.csv").read_bytes()
    for number, count in enumerate([10**6, 37]):
        simulation = concordem.Scenario.from_file(small).simulation(threads=1 + number)
        while simulation.stopped is None:
            simulation.step(count)
        path = simulation.write(tmp_path / f"python-{number}.h5")
        assert path == tmp_path / f"python-{number}.h5"
        found = contents(path)
        assert sorted(found) == sorted(expected)
        assert [name for name in expected if found[name] != expected[name]] == []
        assert path.with_suffix(".csv").read_bytes() == table
    assert concordem.Result(path).state_hash == simulation.state_hash()


def test_everything_that_reads_results_reads_it(small, tmp_path):
    simulation = concordem.Scenario.from_file(small).simulation(threads=1)
    simulation.run()
    path = simulation.write(tmp_path / "run.h5")
    for command in (["report", path], ["info", path], ["export", path], ["measure", path]):
        given = program(*command)
        assert given.returncode == 0, given.stderr
    assert concordem.Result(path).snapshot_times.tolist() == sorted(set(concordem.Result(path).snapshot_times.tolist()))
    assert len(concordem.Result(path).snapshot_times) == 6
    # A further run begins with it, as with a result of the program.
    further = small.parent / "further.toml"
    further.write_text(SMALL.replace("steps = 900", "steps = 1000"))
    given = program("run", "-q", further, "--from", path)
    assert given.returncode == 0, given.stderr


def test_a_run_that_has_not_ended(small, tmp_path):
    """The result has record and snapshot of the present state, says that the run has not ended, and changes nothing."""
    scenario = concordem.Scenario.from_file(small)
    simulation, other = scenario.simulation(threads=1), scenario.simulation(threads=1)
    for run in (simulation, other):
        run.step(250)
    before = simulation.state_hash(), simulation.samples.tobytes()
    result = concordem.Result(simulation.write(tmp_path / "half.h5"))
    assert result.provenance["stopped_because"] == "not ended: written from Python after step 250"
    assert result.samples["step"][-1] == 250 and result.samples["step"][-2] == 245
    assert result.snapshot_times.tolist() == pytest.approx([0, 200 * simulation.state.time_step, simulation.state.time])
    assert (simulation.state_hash(), simulation.samples.tobytes()) == before
    for run in (simulation, other):
        run.run()
    paths = [run.write(tmp_path / f"{name}.h5") for name, run in (("one", simulation), ("two", other))]
    assert contents(paths[0]) == contents(paths[1])


def test_snapshots_on_demand_and_none(small, tmp_path):
    scenario = concordem.Scenario.from_file(small)
    simulation = scenario.simulation(threads=1)
    simulation.step(33)
    simulation.keep_snapshot()
    simulation.keep_snapshot()
    simulation.run()
    steps = np.rint(concordem.Result(simulation.write(tmp_path / "a.h5")).snapshot_times / simulation.state.time_step)
    assert steps.tolist() == [0, 33, 200, 400, 600, 800, 900]
    bare = scenario.simulation(threads=1, snapshots=False)
    bare.run()
    assert len(concordem.Result(bare.write(tmp_path / "b.h5")).snapshot_times) == 1


def test_a_loaded_run_has_its_snapshots_and_what_python_has_changed(small, tmp_path):
    scenario = concordem.Scenario.from_file(small)
    whole = scenario.simulation(threads=1)
    whole.step(450)
    whole.set_loads(np.zeros((len(whole.state), 3)))
    whole.save(tmp_path / "state.h5")
    loaded = concordem.Simulation.load(tmp_path / "state.h5", scenario, threads=1)
    for run in (whole, loaded):
        run.run()
    one, two = (contents(run.write(tmp_path / f"{name}.h5")) for name, run in (("one", whole), ("two", loaded)))
    assert one == two
    assert concordem.Result(tmp_path / "one.h5").provenance["changed_from_python"] == "set_loads before step 450"


def test_copies_go_on_for_themselves(small, tmp_path):
    """copy, deepcopy, and pickle give a simulation in the same state with the same records, which ends in the same result."""
    simulation = concordem.Scenario.from_file(small).simulation(threads=1)
    simulation.step(300)
    copies = [copy.copy(simulation), copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))]
    simulation.step(10)
    assert {one.state.step for one in copies} == {300} and len({one.state_hash() for one in copies}) == 1
    for run in (simulation, *copies):
        run.run()
    simulation.write(tmp_path / "s.h5")
    for number, one in enumerate(copies):
        assert contents(one.write(tmp_path / f"{number}.h5")) == contents(tmp_path / "s.h5")


def test_a_snapshot_goes_into_another_simulation(small, tmp_path):
    scenario = concordem.Scenario.from_file(small)
    one, two = scenario.simulation(threads=1), scenario.simulation(threads=2)
    one.step(400)
    view = two.state.positions
    two.restore(one.snapshot())
    assert two.state_hash() == one.state_hash() and np.array_equal(view, one.state.positions)
    assert two.samples.tobytes() == one.samples.tobytes()
    # Back and forth between branches: the records are those of the branch.
    later = one.snapshot()
    one.step(100)
    two.restore(one.snapshot())
    two.restore(later)
    for run in (one, two):
        run.run()
    assert contents(one.write(tmp_path / "1.h5")) == contents(two.write(tmp_path / "2.h5"))
    other = scenario.with_settings({"stop.steps": 10}).simulation(threads=1)
    with pytest.raises(ValueError, match="of another scenario"):
        other.restore(later)


def test_what_is_refused(small, tmp_path):
    scenario = concordem.Scenario.from_file(small)
    simulation = scenario.simulation(threads=1)
    simulation.step(5)
    with pytest.raises(ValueError, match="needs the extension .h5"):
        simulation.write(tmp_path / "run.txt")
    assert simulation.write() == tmp_path / "small.h5"
    with pytest.raises(concordem.ResultError, match="already exists. Choose another name, or give overwrite=True"):
        simulation.write()
    simulation.step(5)
    assert simulation.write(overwrite=True) == tmp_path / "small.h5"
    assert concordem.Result(tmp_path / "small.h5").samples["step"][-1] == 10
    with pytest.raises(concordem.ResultError, match="folder"):
        simulation.write(tmp_path / "missing" / "run.h5")
    with pytest.raises(ValueError, match="give a path"):
        concordem.Scenario.from_text(SMALL).simulation(threads=1).write()
    # Nothing is left over, and the simulation goes on.
    assert sorted(p.name for p in tmp_path.iterdir()) == ["small.csv", "small.h5", "small.toml"]
    simulation.step(5)


def test_a_full_disk(small, tmp_path):
    """The simulation keeps everything, and writes when there is room."""
    script = """
import concordem, resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
simulation = concordem.Scenario.from_file(sys.argv[1]).simulation(threads=1)
simulation.step(250)
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, resource.RLIM_INFINITY))
try:
    simulation.write(sys.argv[2])
except concordem.ResultError as error:
    print(error)
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
simulation.write(sys.argv[2])
"""
    given = subprocess.run([sys.executable, "-c", script, small, tmp_path / "run.h5"], capture_output=True, text=True)
    assert given.returncode == 0, given.stderr
    assert "Free some space, and write again; the simulation keeps everything" in given.stdout
    assert len(concordem.Result(tmp_path / "run.h5").samples) == 37
    assert not (tmp_path / "run.h5.parts").exists()


def test_while_another_thread_steps(small, tmp_path):
    simulation = concordem.Scenario.from_file(small).simulation(threads=1)
    thread = threading.Thread(target=simulation.run)
    thread.start()
    refused = 0
    while thread.is_alive():
        try:
            simulation.write(tmp_path / "run.h5", overwrite=True)
        except RuntimeError as error:
            assert "running in another thread" in str(error)
            refused += 1
    thread.join()
    assert refused > 0
    simulation.write(tmp_path / "run.h5", overwrite=True)
    assert concordem.Result(tmp_path / "run.h5").provenance["stopped_because"] == "the given number of steps was reached"


def test_a_forked_child_writes(small, tmp_path):
    simulation = concordem.Scenario.from_file(small).simulation(threads=2)
    simulation.step(210)
    child = os.fork()
    if child == 0:
        code = 1
        try:
            simulation.write(tmp_path / "child.h5")
            code = 0
        finally:
            os._exit(code)
    assert os.waitpid(child, 0)[1] == 0
    simulation.write(tmp_path / "parent.h5")
    assert contents(tmp_path / "child.h5") == contents(tmp_path / "parent.h5")


def test_an_interrupted_run_writes_what_it_has(small, tmp_path):
    simulation = concordem.Scenario.from_file(small).with_settings({"stop.steps": 10**7}).simulation(threads=1)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulation.run()
    result = concordem.Result(simulation.write(tmp_path / "run.h5"))
    assert result.samples["step"][-1] == simulation.state.step > 0


def test_notebooks_show_tables(small, tmp_path):
    scenario = concordem.Scenario.from_file(small)
    simulation = scenario.simulation(threads=1)
    simulation.step(20)
    assert "<pre>" in scenario._repr_html_() and "small" in scenario._repr_html_()
    shown = simulation._repr_html_()
    assert "<td>20</td>" in shown and "not ended" in shown
    assert "not ended: written from Python" in concordem.Result(simulation.write(tmp_path / "a.h5"))._repr_html_()
