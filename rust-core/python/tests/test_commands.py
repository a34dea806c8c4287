"""The commands of the program as functions: objects, exceptions with its messages, progress, interruption, threads, and fork."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import concordem
import numpy as np
import pytest

from test_written import SMALL, contents, program


@pytest.fixture(autouse=True)
def no_stored_packings(monkeypatch):
    monkeypatch.setenv("CONCORDEM_CACHE", "off")


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture
def finished(small):
    """A finished run."""
    return concordem.run(small, threads=1)


def test_check(small):
    seen = []
    found = concordem.check(small, threads=1, progress=lambda stage, share: seen.append(stage))
    assert found.summary == concordem.Scenario.from_file(small).simulation(threads=1).summary
    assert found.steps == 900 and found.limited_by == "steps"
    assert found.estimated_time == pytest.approx(900 * found.time_per_step)
    assert found.facts["particles"] == f"{found.summary.particles}" and "time step" in found.facts
    printed = program("check", "-q", "-j", "1", small).stdout
    assert all(name in printed for name in found.facts)


def test_errors_are_those_of_the_program(small, tmp_path):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(SMALL.replace('"25 GPa"', '"25 GN"'))
    for function in (concordem.check, concordem.run):
        with pytest.raises(concordem.ScenarioError) as caught:
            function(wrong)
        assert caught.value.key == "material[0].cpm.young" and caught.value.line > 0
        with pytest.raises(FileNotFoundError):
            function(tmp_path / "missing.toml")
        with pytest.raises(TypeError, match="give a Scenario, or the path"):
            function(3)
    with pytest.raises(concordem.UnstableError, match="stability bound"):
        concordem.check(concordem.Scenario.from_file(small).with_settings({"integration.time_step": "1 ms"}))
    with pytest.raises(ValueError, match="threads is 0; give 1 to 1024"):
        concordem.run(small, threads=0)
    with pytest.raises(ValueError, match="x.txt: a result is an HDF5 file"):
        concordem.run(small, tmp_path / "x.txt")
    with pytest.raises(ValueError, match="give a path"):
        concordem.run(concordem.Scenario.from_text(SMALL))
    with pytest.raises(concordem.ResultError, match="there is no run"):
        concordem.resume(tmp_path / "missing.h5")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["small.toml", "wrong.toml"]


def test_run(small, tmp_path):
    assert program("run", "-q", "-j", "1", small, "-o", tmp_path / "program.h5").returncode == 0
    shares = []
    result = concordem.run(small, threads=1, progress=lambda stage, share: shares.append((stage, share)))
    assert result.path == tmp_path / "small.h5"
    assert contents(result.path) == contents(tmp_path / "program.h5")
    with pytest.raises(concordem.ResultError, match="give overwrite=True"):
        concordem.run(small, threads=1)
    # A scenario without a file, whose paths are relative to a folder; and a run that continues another one.
    scenario = concordem.Scenario.from_text(SMALL.replace("steps = 900", "steps = 1000"), folder=tmp_path)
    further = concordem.run(scenario, tmp_path / "further.h5", start=result.path, threads=2)
    assert further.provenance["continues"] == str(result.path)
    assert further.samples["step"][-1] == 1000


def test_warnings_and_notes_arrive(small, tmp_path):
    unused = "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 1e5 }"
    small.write_text(SMALL.replace("density = 2500", f"density = 2500\n{unused}"))
    with pytest.warns(concordem.ConcordemWarning) as caught:
        concordem.run(small, threads=1)
    problems = [warning.message.problem for warning in caught if warning.message.problem]
    assert any(problem.key == "material[0].linear_bond" for problem in problems)


def interrupted(script, *arguments):
    """Run a script that gets Ctrl-C when it prints a line."""
    process = subprocess.Popen(
        [sys.executable, "-c", script, *map(str, arguments)], stdout=subprocess.PIPE, text=True, env=os.environ | {"CONCORDEM_CACHE": "off"}
    )
    assert process.stdout.readline() == "now\n"
    process.send_signal(signal.SIGINT)
    rest = process.communicate(timeout=60)[0]
    return process.returncode, rest


BEGIN = """
import signal, sys, threading
signal.signal(signal.SIGINT, signal.default_int_handler)
import concordem
shown = []
def seen(stage, share):
    if stage == wanted and not shown:
        shown.append(1)
        print("now", flush=True)
"""


@pytest.mark.once
def test_ctrl_c_leaves_a_checkpoint(small, tmp_path):
    small.write_text(SMALL.replace("steps = 900", "steps = 60000"))
    script = BEGIN + """
wanted = "running"
try:
    concordem.run(sys.argv[1], threads=1, progress=seen)
except KeyboardInterrupt:
    print("stopped")
"""
    assert interrupted(script, small) == (0, "stopped\n")
    assert (tmp_path / "small.h5.parts").is_dir() and not (tmp_path / "small.h5").exists()
    with pytest.raises(concordem.ResultError, match="unfinished run. Continue it with `concordem resume`, or discard it with overwrite=True"):
        concordem.run(small, threads=1)


@pytest.mark.once
def test_resume_gives_the_result_of_one_go(small, tmp_path):
    whole = tmp_path / "whole.toml"
    for path in (small, whole):
        path.write_text(SMALL.replace("steps = 900", "steps = 20000"))
    script = BEGIN + """
wanted = "running"
try:
    concordem.run(sys.argv[1], threads=1, progress=seen)
except KeyboardInterrupt:
    print("stopped")
"""
    assert interrupted(script, small) == (0, "stopped\n")
    result = concordem.resume(small, threads=2)
    one, two = contents(result.path), contents(concordem.run(whole, threads=1).path)
    apart = {name for name in one.keys() | two.keys() if one.get(name) != two.get(name)}
    assert apart <= {"provenance@scenario_file"}
    with pytest.warns(concordem.ConcordemWarning, match="is finished; there is nothing to resume"):
        assert concordem.resume(small).path == result.path


@pytest.mark.once
def test_ctrl_c_while_the_packing_is_made(small, tmp_path):
    small.write_text(SMALL.replace("count = 150", "count = 20000"))
    script = BEGIN.replace("stage == wanted and ", "") + """
wanted = None
try:
    concordem.run(sys.argv[1], threads=1, progress=seen)
except KeyboardInterrupt:
    print("stopped")
"""
    assert interrupted(script, small) == (0, "stopped\n")
    assert [p.name for p in tmp_path.iterdir()] == ["small.toml"]


def test_a_progress_function_that_fails_stops_the_run(small):
    def seen(stage, share):
        raise RuntimeError("enough")

    small.write_text(SMALL.replace("steps = 900", "steps = 60000"))
    with pytest.raises(RuntimeError, match="enough"):
        concordem.run(small, threads=1, progress=seen)


@pytest.mark.once
def test_threads_beside_each_other(small, tmp_path):
    """Runs in several threads do not wait for each other, and give the same."""
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda k: concordem.run(small, tmp_path / f"{k}.h5", threads=1 + k % 2), range(4)))
    assert len({result.state_hash for result in results}) == 1
    free = threading.Event()
    thread = threading.Thread(target=lambda: (concordem.run(small, tmp_path / "free.h5", threads=1), free.set()))
    thread.start()
    ticks = 0
    while not free.wait(0.001):
        ticks += 1
    thread.join()
    assert ticks > 5, "the interpreter's lock was held"


def job(path):
    return concordem.run(path, path.with_suffix(f".{os.getpid()}.h5"), threads=2).state_hash


@pytest.mark.once
def test_forked_children(small, finished):
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert set(pool.map_async(job, [small] * 2).get(timeout=60)) == {finished.state_hash}


def test_measure(finished, small):
    region = {"kind": "sphere", "center": [0, 0, 0], "radius": "3 mm"}
    found = concordem.measure(finished, "region-stress", region=region)
    simulation = concordem.Scenario.from_file(small).simulation(threads=1)
    simulation.run()
    np.testing.assert_allclose(found["stress"], simulation.sample("region-stress", region=region)["stress"], rtol=1e-12, atol=1e-6)
    tables = concordem.measure(finished.path)
    assert list(tables) == ["region-stress"] and np.array_equal(tables["region-stress"]["stress"], found["stress"])
    with pytest.raises(concordem.ScenarioError, match=r'measure\("region-stress", radius=3\).*radius'):
        concordem.measure(finished, "region-stress", radius=3)
    with pytest.raises(ValueError, match="no particle and no contact lies in the region"):
        concordem.measure(finished, "region-stress", region=region | {"center": [1, 1, 1]})
    with pytest.raises(ValueError, match="region without operator"):
        concordem.measure(finished, region=region)
    with pytest.raises(concordem.ResultError, match="does not exist"):
        concordem.measure(small.with_name("missing.h5"), "fabric")


def test_report_and_export(finished, tmp_path):
    page = concordem.report(finished, reference="none")
    assert page == tmp_path / "small.html" and "small" in page.read_text()
    with pytest.raises(concordem.ResultError, match="overwrite=True"):
        concordem.report([finished, finished.path])
    assert concordem.report([finished, finished.path], tmp_path / "two.html") == tmp_path / "two.html"
    with pytest.raises(ValueError, match='reference is "all"; give one of auto, none, specimen-1, specimen-4'):
        concordem.report(finished, tmp_path / "x.html", reference="all")
    with pytest.raises(ValueError, match="there is no result to report on"):
        concordem.report([])
    with pytest.raises(TypeError, match="give a Result, or the path"):
        concordem.report(3)
    files = concordem.export(finished)
    assert files and all(path.is_file() for path in files)
    with pytest.raises(concordem.ResultError, match="overwrite=True"):
        concordem.export(finished)
    assert concordem.export(finished, overwrite=True) == files
    with pytest.raises(ValueError, match='format is "stl"; give one of vtk, lammps, cracks, heat-network'):
        concordem.export(finished, "stl")


SWEEP = """
version = 1
scenario = "small.toml"
study = "run"
results = ["max stress", "last broken"]
[[axis]]
key = "loading.strain_rate"
values = ["10 1/s", "20 1/s"]
"""


@pytest.mark.once
def test_sweep(small, tmp_path):
    (tmp_path / "rates.toml").write_text(SWEEP)
    found = concordem.sweep(tmp_path / "rates.toml", threads=2)
    assert found.path == tmp_path / "rates.h5" and found.page.is_file() and found.problems == {}
    assert list(found.axes) == ["loading.strain_rate"] and len(found.axes["loading.strain_rate"]) == 2
    assert concordem.units(found.points) == {"max_stress": "Pa", "last_broken": "1"}
    fast = concordem.Scenario.from_file(small).with_settings({"loading.strain_rate": "20 1/s"}).simulation(threads=1)
    fast.run()
    assert found.points["max_stress"][1] == fast.samples["stress"].max()
    with pytest.raises(concordem.ResultError, match="overwrite=True"):
        concordem.sweep(tmp_path / "rates.toml")
    with pytest.raises(concordem.ScenarioError, match="this is a scenario, not a sweep"):
        concordem.sweep(small)


ENSEMBLE = """
version = 1
scenario = "small.toml"
study = "run"
results = ["max stress"]
sampling = { method = "latin-hypercube", count = 3 }
[[axis]]
name = "rate"
key = "loading.strain_rate"
linear = { from = 10, to = 20 }
[[axis]]
key = "title"
values = ["a", "b"]
[[curve]]
name = "stress-strain"
x = "strain"
y = "stress"
from = 0
to = 1
count = 11
"""


@pytest.mark.once
def test_sweep_with_samples_and_curves(small, tmp_path):
    (tmp_path / "ensemble.toml").write_text(ENSEMBLE)
    found = concordem.sweep(tmp_path / "ensemble.toml")
    rates = found.axes["rate"]
    assert list(rates[::2]) == list(rates[1::2]) and len(set(rates)) == 3 and found.axes["title"] == ["a", "b"] * 3
    assert sorted(int((rate - 10) / 10 * 3) for rate in rates[::2]) == [0, 1, 2]
    curve = found.curves["stress-strain"]
    assert isinstance(curve, concordem.Curve)
    assert (curve.x_name, curve.y_name, curve.x_unit, curve.y_unit) == ("strain", "stress", "1", "Pa")
    assert curve.x.shape == (11,) and curve.y.shape == (6, 11) and curve.x[10] == 1
    assert np.isfinite(curve.y[:, 0]).all() and np.isnan(curve.y[:, 10]).all()
    assert (curve.y[0::2, 0] == curve.y[1::2, 0]).all()


def test_explain():
    (key,) = concordem.explain("loading.strain_rate")[:1]
    assert key.path == "loading.strain_rate" and "1/s" in key.value + key.description
    with pytest.raises(ValueError, match="did you mean"):
        concordem.explain("loading.strain_rat")


def test_characterise(finished):
    assert concordem.characterise(finished.path)["spheres"] > 50


@pytest.mark.filterwarnings("ignore:.*broken bonds are not drawn")
@pytest.mark.once
def test_pictures_are_those_of_the_program(finished, tmp_path):
    """Each option of `concordem render` and `concordem plot`, byte by byte, and what is refused."""
    pairs = [
        (dict(), []),
        (dict(show=["particles", "cracks"], view="-y"), ["--show", "particles,cracks", "--view=-y"]),
        (dict(show="bonds", color="opening", view=(1, -2, 0.5)), ["--show", "bonds", "--color", "opening", "--view", "1,-2,0.5"]),
        (dict(slice="y=0.5 mm", color="stress-zz", range=(-1e6, 2e6)), ["--slice", "y=0.5 mm", "--color", "stress-zz", "--range=-1e6,2e6"]),
        (dict(cut=["x", "y=1 mm"], magnify=10, size=(300, 400)), ["--cut", "x", "--cut", "y=1 mm", "--magnify", "10", "--size", "300x400"]),
        (dict(time=0.0, size=300), ["--time", "0 s", "--size", "300"]),
        (dict(animate=2, rate=5, size=300), ["--animate=2", "--rate", "5", "--size", "300"]),
    ]
    for k, (options, arguments) in enumerate(pairs):
        ours, theirs = tmp_path / f"a{k}.png", tmp_path / f"b{k}.png"
        assert concordem.render(finished, ours, **options) == ours
        found = program("render", finished.path, "-o", theirs, *arguments)
        assert found.returncode == 0, found.stderr
        assert ours.read_bytes() == theirs.read_bytes() and len(ours.read_bytes()) > 1000, options
    assert concordem.render(finished) == tmp_path / "small.png"
    with pytest.raises(concordem.ResultError, match="overwrite=True"):
        concordem.render(finished)
    for options, message in (
        (dict(show="spheres"), 'show has "spheres"; give some of particles, bonds, cracks, walls, cell'),
        (dict(show="walls"), "no particles, bonds, or cracks to draw"),
        (dict(view="up"), "view: write x, y, z"),
        (dict(view=(0, 0, 0)), "view: write x, y, z"),
        (dict(slice="y=2 s"), "slice: "),
        (dict(size=20), "size: write a width"),
        (dict(time="1 mm"), "time: "),
        (dict(time=float("nan")), "time: "),
        (dict(time=0, animate=True), "either time or animate"),
        (dict(animate=1), "animate is 1; give True, or 2 to 1000 images"),
        (dict(range=(0, float("inf"))), "give two finite numbers"),
        (dict(range=(0, 1, 2)), r"range is \(0, 1, 2\); give two finite numbers"),
        (dict(color="mood"), "mood"),
        (dict(output="x.jpg"), "need the extension .png"),
    ):
        with pytest.raises(ValueError, match=message):
            concordem.render(finished, **{"output": tmp_path / "no.png", **options})
    for options, message in ((dict(show=3), "show has 3; give names"), (dict(slice=("y",)), "slice is .*; give a text")):
        with pytest.raises(TypeError, match=message):
            concordem.render(finished, tmp_path / "no.png", **options)
    assert not (tmp_path / "no.png").exists()
    for name, options, arguments in (("a.svg", dict(compression=True), ["--compression"]), ("a.pdf", dict(x="time", y="stress"), ["--x", "time", "--y", "stress"])):
        ours, theirs = tmp_path / name, tmp_path / f"b{name}"
        assert concordem.figure([finished, finished.path], ours, **options) == ours
        found = program("plot", finished.path, finished.path, "-o", theirs, *arguments)
        assert found.returncode == 0, found.stderr
        assert ours.read_bytes() == theirs.read_bytes()
    with pytest.raises(ValueError, match="a figure is .svg or .pdf"):
        concordem.figure(finished, "x.png")
    with pytest.raises(ValueError, match="an edge is from 40 mm"):
        concordem.figure(finished, tmp_path / "x.svg", size="1 mm,2 mm")
    with pytest.raises(ValueError, match="there is no result to draw"):
        concordem.figure([])
