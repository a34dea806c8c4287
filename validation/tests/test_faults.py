"""Faults planted in results, cases, programs, caches, and start states: each must be caught, and with its cause."""
import copy
import json
import time

import numpy as np
import pytest
from concordem_validate import baseline, cli, compare, lint, registry, report, rounds, runner, start
from concordem_validate import case as cases
from concordem_validate.engines import concordem
from concordem_validate.engines.command import CommandEngine
from concordem_validate.errors import Crashed, HarnessError, Incomparable, TimedOut
from concordem_validate.result import Result
from conftest import CASE, Fake, judged, need, sound


def force(change):
    """Change the values of a force."""
    def apply(result):
        result.series["force"].values = change(result.series["force"].values.copy())
    return apply


def position(change):
    def apply(result):
        result.series["position"].values = change(result.series["position"].values.copy())
    return apply


def cut(count, name="force"):
    def apply(result):
        one = result.series[name]
        one.steps, one.values = one.steps[:count], one.values[:count]
    return apply


def shifted(result):
    """The values of the sample before."""
    one = result.series["force"]
    one.values[1:] = one.values[:-1].copy()


def late(result):
    result.series["force"].steps = result.series["force"].steps + 10


def hole(result):
    one = result.series["force"]
    one.steps, one.values = np.delete(one.steps, 5), np.delete(one.values, 5)


def unordered(result):
    one = result.series["force"]
    one.steps[4], one.steps[5] = one.steps[5], one.steps[4]


def another_step(result):
    result.dt *= 1.01


def unit(name):
    def apply(result):
        result.series["force"].unit = name
    return apply


def with_nan(result):
    result.series["force"].values[7] = np.nan


def with_infinity(result):
    result.series["force"].values[7] = np.inf


def empty(result):
    result.series.clear()
    result.numbers.clear()


def without_samples(result):
    cut(0)(result)


def without_series(result):
    del result.series["force"]


def crash(result):
    raise Crashed("it broke")


def hang(result):
    raise TimedOut("stopped after the time limit")


def bug(result):
    raise ZeroDivisionError("in the engine")


RESULTS = {
    "a run that ends after one sample": (cut(1), "short"),
    "a run that ends one sample early": (cut(10), "short"),
    "a series without samples": (without_samples, "empty"),
    "an empty result": (empty, "empty"),
    "a result without the series": (without_series, "error"),
    "a value that is not a number": (with_nan, "nan"),
    "an infinite value": (with_infinity, "nan"),
    "values shifted by one sample": (shifted, "difference"),
    "steps shifted by one sample": (late, "short"),
    "a sample left out": (hole, "error"),
    "samples in a wrong order": (unordered, "error"),
    "another time step": (another_step, "short"),
    "kN in place of N, without saying so": (force(lambda v: v / 1000), "difference"),
    "N that are called kN": (unit("kN"), "difference"),
    "N that are called Pa": (unit("Pa"), "error"),
    "the other sign": (force(lambda v: -v), "difference"),
    "rounding to four digits": (position(np.vectorize(lambda x: float(f"{x:.3e}"))), "difference"),
    "zeros": (force(lambda v: 0 * v), "error"),
    "the first value, held": (force(lambda v: 0 * v + v[0]), "blind"),
    "particles exchanged": (position(lambda v: v[:, ::-1]), "difference"),
    "x and y exchanged": (position(lambda v: v[:, :, [1, 0, 2]]), "difference"),
    "another seed": (force(lambda v: v + 0.01 * np.random.default_rng(1).standard_normal(len(v))), "difference"),
    "an offset in time": (force(lambda v: 0.3 + np.sin(20 * (np.arange(11) * 0.01 - 0.002)) + 0.005 * np.arange(11)), "difference"),
    "a particle too many": (position(lambda v: np.concatenate([v, v[:, :1]], axis=1)), "error"),
    "a crash": (crash, "crashed"),
    "a hang": (hang, "timeout"),
    "an exception": (bug, "error"),
}


@pytest.mark.parametrize("fault", RESULTS)
def test_a_wrong_result_is_caught(folder, engines, fault):
    change, cause = RESULTS[fault]
    assert not judged(folder).failed(True), "the case fails without a fault"
    engines["two"].change, engines["two"].number = change, "2"
    round_ = judged(folder)
    bad = [v for v in round_.verdicts if v.status == "fail"]
    assert {v.peer for v in bad} == {"two"} and cause in {v.cause for v in bad}, [(v.cause, v.message) for v in bad]
    assert round_.exit_code(strict=False) == rounds.FAILED
    # the others are judged all the same
    assert any(v.status == "pass" and v.peer == "three" for v in round_.verdicts)


def test_kilonewtons_that_say_so_agree(folder, engines):
    def kilo(result):
        result.series["force"].values, result.series["force"].unit = result.series["force"].values / 1000, "kN"

    engines["two"].change = kilo
    assert not judged(folder).failed(True)


def test_all_engines_that_end_early_are_caught(folder, engines):
    for engine in engines.values():
        engine.change = cut(5)
    causes = {v.cause for v in judged(folder).verdicts if v.check.of == "force"}
    assert causes == {"short"}


def changed(text, *pairs):
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


BLIND = {
    "a tolerance above the signal": ("tolerance = 1e-3", 'tolerance = 5.0\nscale = "1 N"'),
    "a relative tolerance of one": ("tolerance = 1e-3", "tolerance = 1.0"),
    "a check of the first point alone": ("tolerance = 1e-3", "tolerance = 1e-3\nto_step = 0"),
    "a reference compared with itself": ('engines = ["two", "three"]', 'engines = ["one", "two", "three"]'),
    "a check of no variant": ("tolerance = 1e-3", 'tolerance = 1e-3\nvariants = ["other"]'),
    "a tolerance that is a text": ("tolerance = 1e-3", 'tolerance = "1e-3"'),
    "a tolerance below zero": ("tolerance = 1e-3", "tolerance = -1"),
    "no reason": ('reason = "a tolerance for tests"', 'reason = " "'),
    "a known difference without quirk": ("tolerance = 1e-3", "known = [0, 1e-3]"),
    "an unknown norm": ("tolerance = 1e-3", 'tolerance = 1e-3\nnorm = "mean"'),
}


@pytest.mark.parametrize("fault", BLIND)
def test_a_check_that_cannot_fail_is_an_error(folder, engines, fault):
    (folder / "cases/small/case.toml").write_text(changed(CASE, BLIND[fault]))
    try:
        round_ = judged(folder)
    except HarnessError as error:
        # one sentence with the file
        assert str(folder / "cases/small/case.toml") in str(error)
        return
    assert {v.cause for v in round_.verdicts} & {"blind", "short"} and round_.failed(True)


def test_a_check_of_a_constant_is_an_error(folder, engines):
    for engine in engines.values():
        engine.change = force(lambda v: 0 * v + 3.0)
    assert {v.cause for v in judged(folder).verdicts if v.check.of == "force"} == {"blind"}
    assert any("constant" in line for line in _lint(folder))
    text = CASE.replace('of = "force"\n', 'of = "force"\nconstant = true\n')
    (folder / "cases/small/case.toml").write_text(text)
    assert not judged(folder).failed(True)
    # now the constant itself is checked
    engines["two"].change, engines["two"].number = force(lambda v: 0 * v + 3.1), "2"
    assert {v.cause for v in judged(folder).verdicts if v.status == "fail"} == {"difference"}


def _lint(folder):
    case = cases.load("small", folder / "cases")
    round_ = judged(folder)
    rounds.write(folder / "out", round_, 1)
    return lint.find([case], folder / "out")


def test_lint_finds_engines_that_nothing_compares_and_doubles(folder, engines):
    (folder / "cases/small/case.toml").write_text(CASE.replace('peer = "three"', 'peer = "two"'))
    text = "\n".join(_lint(folder))
    assert "runs three, but no check compares it" in text
    (folder / "cases/small/case.toml").write_text(CASE.replace('name = "force of the third"', 'name = "force"').replace('peer = "three"', 'peer = "two"'))
    assert "is there twice" in "\n".join(_lint(folder))


def test_two_names_of_one_command_are_refused(folder, engines, monkeypatch):
    (folder / "code.py").write_text("print(1)")
    for name in ("one", "two"):
        monkeypatch.setitem(registry.ENGINES, name, CommandEngine(name, folder, "python3 code.py {task} {output}"))
    assert "same program" in "\n".join(lint.same_programs(cases.load("small", folder / "cases")))
    assert cli.main(["run", "--cases", str(folder / "cases"), "--output", str(folder / "out")]) == rounds.WRONG_INPUT


def test_a_peer_that_does_not_run_is_named(folder, engines, no_page, monkeypatch, capsys):
    monkeypatch.delenv("CI", raising=False)
    engines["two"].number = None
    round_ = judged(folder)
    assert round_.exit_code(strict=False) == rounds.AGREES and round_.exit_code(strict=True) == rounds.ENGINE_MISSING
    assert round_.exit_code(strict=False, require=["two"]) == rounds.ENGINE_MISSING
    assert cli.main(["run", "--cases", str(folder / "cases"), "--output", str(folder / "out"), "small"]) == rounds.AGREES
    assert "buy it" in capsys.readouterr().out


def test_nothing_checked_is_no_success(folder, engines, no_page, monkeypatch, capsys):
    monkeypatch.delenv("CI", raising=False)
    for engine in engines.values():
        engine.number = None
    assert cli.main(["run", "--cases", str(folder / "cases"), "--output", str(folder / "out"), "small"]) == rounds.NOTHING_CHECKED
    assert "NOTHING WAS CHECKED" in capsys.readouterr().out
    # our own cases without ConcorDEM, as with a wrong CONCORDEM
    assert cli.main(["run", "--output", str(folder / "out"), "lattice-elasticity"]) == rounds.NOTHING_CHECKED


def test_a_case_that_raises_does_not_end_the_round(folder, engines):
    place = folder / "cases/broken"
    place.mkdir()
    (place / "scenario.toml").write_text((folder / "cases/small/scenario.toml").read_text())
    (place / "case.toml").write_text(CASE.replace('kind = "series"', 'kind = "scalar"', 1))
    (place / "case.py").write_text("def measures(task, result):\n    return {'force': [][1]}\n")
    both = [cases.load(name, folder / "cases") for name in ("broken", "small")]
    round_ = runner.Runner(folder / "out", quiet=True).run(both)
    bad = [v for v in round_.verdicts if v.status == "fail"]
    assert [(v.case, v.cause) for v in bad] == [("broken", "error")] and "case.py:2: IndexError" in bad[0].message
    assert any(v.case == "small" and v.status == "pass" for v in round_.verdicts)


# what is stored


def test_two_stored_files_exchanged_are_caught(folder, engines):
    round_ = judged(folder)
    paths = [o.path for o in round_.outcomes.values() if o.engine in ("two", "three")]
    texts = [p.read_bytes() for p in paths]
    for path, text in zip(paths, reversed(texts)):
        path.write_bytes(text)
    with pytest.raises(Incomparable, match="exchanged"):
        round_.outcomes["small", "main", "two"].result()
    # a new round makes them again
    runs = engines["two"].runs
    assert not judged(folder).failed(True) and engines["two"].runs == runs + 1


def test_a_truncated_file_is_made_again_and_is_no_result(folder, engines):
    round_ = judged(folder)
    path = round_.outcomes["small", "main", "two"].path
    path.write_bytes(path.read_bytes()[:700])
    bad = [v for v in compare.judge(cases.load("small", folder / "cases"), round_.outcomes) if v.status == "fail"]
    assert {v.peer for v in bad} == {"two"} and "damaged" in bad[0].message
    assert not judged(folder).failed(True) and engines["two"].runs == 2


@pytest.mark.parametrize("name", ["spheres.dat", "mesh.stl", "curve.csv", "data.h5", "sub/more.npz", "case.py", "scenario.toml"])
def test_every_file_of_a_case_counts(folder, engines, name):
    path = folder / "cases/small" / name
    path.parent.mkdir(exist_ok=True)
    text = path.read_text() if path.exists() else ""
    path.write_text(text + "\n# 1\n")
    judged(folder)
    runs = engines["two"].runs
    judged(folder)
    assert engines["two"].runs == runs, "a round without changes runs again"
    path.write_text(text + "\n# 2\n" if name != "scenario.toml" else text.replace("steps = 100", "steps = 110"))
    judged(folder)
    assert engines["two"].runs == runs + 1


def test_a_file_outside_of_the_case_counts_too(folder, engines):
    (folder / "shared.txt").write_text("0 0 0 1e-3\n3e-3 0 0 1e-3\n")
    scenario = folder / "cases/small/scenario.toml"
    a, b = scenario.read_text().split("[packing]\n")
    rest = b[b.index("[[material]]"):]
    scenario.write_text(a + '[packing]\nkind = "file"\npath = "../../shared.txt"\n' + rest)
    judged(folder)
    (folder / "shared.txt").write_text("0 0 0 1e-3\n4e-3 0 0 1e-3\n")
    judged(folder)
    assert engines["two"].runs == 2


def test_another_version_of_an_engine_runs_again(folder, engines):
    judged(folder)
    engines["two"].number = "2"
    judged(folder)
    assert (engines["one"].runs, engines["two"].runs) == (1, 2)


def test_programs_are_known_by_what_they_load(tmp_path):
    from concordem_validate import programs
    package = tmp_path / "site" / "some_code"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("value = 1\n")
    wrapper = tmp_path / "wrapper"
    wrapper.write_text(f'#!/bin/sh\nPYTHONPATH={tmp_path}/site exec python3 -m some_code "$@"\n')
    one = programs.identity(wrapper)
    assert programs.identity(wrapper) == one
    (package / "__init__.py").write_text("value = 2\n")
    assert programs.identity(wrapper) != one
    # a program of the same name that comes first in PATH
    other = tmp_path / "other"
    other.write_text("#!/bin/sh\nexit 0\n")
    assert programs.identity(other) != programs.identity(wrapper)


def test_a_doctored_yade_first_in_path_is_another_yade(tmp_path, monkeypatch):
    need("yade")
    sound_version = registry.ENGINES["yade"].version()
    program = tmp_path / "yade"
    program.write_text("#!/bin/sh\necho Yade version: 2023.02a\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    assert registry.ENGINES["yade"].version() != sound_version


# baselines


def test_an_old_baseline_names_what_changed(folder, engines, capsys):
    judged_round = judged(folder)
    rounds.write(folder / "out", judged_round, 0)
    baseline.bless(folder / "out", folder / "base/v1")
    with pytest.raises(HarnessError, match="exists already"):
        baseline.bless(folder / "out", folder / "base/v1")
    again = baseline.against(judged(folder), folder / "base/v1")
    assert len(again) == 3 and {v.status for v in again} == {"pass"}
    engines["two"].change, engines["two"].number = position(lambda v: v + 1e-9 * (np.arange(11) >= 4)[:, None, None] * [[0], [1]]), "2"
    bad = [v for v in baseline.against(judged(folder), folder / "base/v1") if v.status == "fail"]
    assert [v.reference for v in bad] == ["two"]
    assert "first at step 40, particle 1" in bad[0].message and "changed: engine" in bad[0].message
    assert {v.status for v in baseline.against(judged(folder), folder / "base/v1", 1e-3)} == {"pass"}
    # a baseline whose file was changed is none
    next((folder / "base/v1").glob("*.h5")).write_bytes(b"x")
    with pytest.raises(HarnessError, match="not the file that was blessed"):
        baseline.load(folder / "base/v1")


def test_a_failed_round_is_not_blessed(folder, engines):
    engines["two"].change = force(lambda v: -v)
    rounds.write(folder / "out", judged(folder), 1)
    with pytest.raises(HarnessError, match="checks of the round failed"):
        baseline.bless(folder / "out", folder / "base/v1")


# start states


def wrong(name, change):
    def apply(one):
        setattr(one, name, change(copy.deepcopy(getattr(one, name))))
    return apply


STARTS = {
    "density": wrong("mass", lambda m: m * 5777 / 2500),
    "density by a thousandth of a per cent": wrong("mass", lambda m: m * 1.00001),
    "radius": wrong("radius", lambda r: r * 2),
    "millimeters for meters": wrong("position", lambda x: x * 1000),
    "time step": wrong("dt", lambda dt: dt * 1.01),
    "a bond too few": wrong("bonds", lambda b: b[:-1]),
    "a bond of another pair": wrong("bonds", lambda b: np.concatenate([b[:-1], [[0, len(b)]]])),
    "length of a bond": wrong("reference_length", lambda v: v * 1.0001),
    "velocity": wrong("velocity", lambda v: v * 1.001),
}


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    need("concordem")
    task = next(t for t in cases.load("chain-waves").tasks if t.variant == "long-wave")
    return task, concordem.export_start(task, tmp_path_factory.mktemp("start"))


@pytest.mark.parametrize("fault", STARTS)
def test_a_wrong_start_state_is_caught(exported, fault):
    task, one = exported
    assert "15 bonds" in start.compare(one, task.scenario, task.folder)[0]
    one = copy.deepcopy(one)
    STARTS[fault](one)
    with pytest.raises(Incomparable) as error:
        start.compare(one, task.scenario, task.folder)
    assert error.value.cause == "start"


def test_a_wrong_density_of_ours_fails_the_case_although_the_peers_agree(tmp_path):
    """The peers get the mass from us, so only the start state can tell."""
    need("concordem")
    case = cases.load("chain-waves").only(["long-wave"], ["analytic"])
    density = [lambda document: {**document, "material": [{**document["material"][0], "density": 5777}]}]
    round_ = runner.Runner(tmp_path, quiet=True).run([case], plant={"concordem": density, "start": [STARTS["density"]]})
    assert {v.status for v in round_.verdicts} == {"pass"}
    assert [v.cause for v in round_.starts] == ["start"] and round_.exit_code(False) == rounds.FAILED


# the command `compare`


def test_compare_knows_short_runs_units_nan_and_csv(tmp_path, capsys):
    def compared(a, b, *options):
        code = cli.main(["compare", str(a), str(b), *options])
        return code, capsys.readouterr().out

    sound().write(tmp_path / "a.h5")
    for name, change, said in (("short", cut(1), "ends early"), ("nan", with_nan, "not a finite number"), ("pa", unit("Pa"), "different things")):
        other = sound()
        change(other)
        other.write(tmp_path / f"{name}.h5")
        code, out = compared(tmp_path / "a.h5", tmp_path / f"{name}.h5", "--tolerance", "1e-3")
        assert code == rounds.FAILED and said in out, out
    curve = sound()
    rows = [f"{k * 0.01!r},{float(v) / 1000!r}" for k, v in enumerate(curve.series["force"].values)]
    (tmp_path / "a.csv").write_text("\n".join(["time,force", "s,kN", *rows]))
    del curve.series["position"]
    curve.write(tmp_path / "b.h5")
    assert compared(tmp_path / "a.csv", tmp_path / "b.h5", "--tolerance", "1e-12")[0] == rounds.AGREES
    # half the interval, in ms
    fine = [f"{k * 5!r},{np.interp(k / 2, range(11), curve.series['force'].values)!r}" for k in range(21)]
    (tmp_path / "fine.csv").write_text("\n".join(["time,force", "ms,N", *(row.replace("np.float64(", "").replace(")", "") for row in fine)]))
    assert compared(tmp_path / "fine.csv", tmp_path / "b.h5", "--tolerance", "1e-12")[0] == rounds.AGREES
    assert cli.main(["compare", str(tmp_path / "a.h5"), str(tmp_path / "a.h5")]) == rounds.WRONG_INPUT


@pytest.mark.parametrize("text, said", [
    ("", "no numbers"), ("time,force\ns,N\n", "no numbers"), ("time,force\n0,1.5\n1,2\n", "must give a unit"),
    ("time,force\ns,N\n0,1\n1\n", "1 values for 2 columns"), ("time,force\ns,N\n0,1\n1,x\n", "`x` in column `force`"),
    ("time,force\ns,parsec\n0,1\n1,2\n", "unknown unit"), ("time,force\ns,\n0,1\n1,2\n", "no unit"), ("force,a\nN,N\n0,1\n1,2\n", "neither a column"),
    ("time,force,force\ns,N,N\n0,1,1\n1,2,2\n", "twice"), ("time,p.0.x,p.2.x\ns,m,m\n0,1,1\n1,2,2\n", "not whole"),
    ("time,force\nN,N\n0,1\n1,2\n", "give a time"),
])
def test_bad_csv_is_told_with_its_place(tmp_path, text, said):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(HarnessError, match=said) as error:
        Result.read(path)
    assert str(path) in str(error.value)


def test_hdf5_without_units_or_of_another_kind_is_refused(tmp_path):
    import h5py
    sound().write(tmp_path / "a.h5")
    # as another program writes it, without our hash at the end
    (tmp_path / "a.h5").write_bytes((tmp_path / "a.h5").read_bytes()[:-len("sha256:") - 64])
    with h5py.File(tmp_path / "a.h5", "a") as file:
        del file["series/force/values"].attrs["unit"]
    with pytest.raises(Incomparable, match="series `force` has no attribute `unit`"):
        Result.read(tmp_path / "a.h5")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(Incomparable, match="is no result of the harness"):
        Result.read(tmp_path / "b.h5")
    (tmp_path / "c.h5").write_bytes(b"\x89HDF\r\n\x1a\n and then nothing")
    with pytest.raises(Incomparable, match="cannot be read"):
        Result.read(tmp_path / "c.h5")


def test_rounds_may_share_a_folder(folder, engines):
    from concurrent.futures import ThreadPoolExecutor
    engines["two"].change = lambda result: time.sleep(0.05)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: judged(folder).failed(True), range(8)))
    assert not any(found)


def test_the_odd_one_out_is_named(folder, engines):
    (folder / "cases/small/case.toml").write_text(CASE.replace('"force of the third"', '"force"'))
    engines["one"].change = force(lambda v: 1.1 * v)
    assert compare.odd_one_out(judged(folder).verdicts) == [("small", "main", "force", "one")]
    engines["one"].change, engines["one"].number = None, "2"
    engines["two"].change, engines["two"].number = force(lambda v: 1.1 * v), "2"
    assert compare.odd_one_out(judged(folder).verdicts) == [("small", "main", "force", "two")]


def test_any_engine_can_be_the_reference(folder, engines):
    engines["two"].change = force(lambda v: 1.1 * v)
    case = cases.load("small", folder / "cases").with_reference("three")
    round_ = runner.Runner(folder / "out", quiet=True).run([case])
    pairs = {(v.reference, v.peer, v.check.name): v.status for v in round_.verdicts}
    assert pairs["three", "two", "force"] == "fail" and pairs["three", "one", "force of the third"] == "pass"
    case = cases.load("small", folder / "cases").all_pairs()
    assert {frozenset(c.pair) for c in case.checks} == {frozenset(("one", "two")), frozenset(("one", "three"))}


def test_reports_need_no_engine(folder, engines, monkeypatch, capsys):
    monkeypatch.delenv("CI", raising=False)
    place = ["--cases", str(folder / "cases"), "--output", str(folder / "out")]
    assert cli.main(["run", *place, "small"]) == 0
    for engine in engines.values():
        engine.number = None
    files = [folder / name for name in ("j.xml", "r.json", "b.svg")]
    assert cli.main(["report", *place, "--junit", str(files[0]), "--json", str(files[1]), "--badge", str(files[2])]) == 0
    assert '<testsuite name="small" tests="3" failures="0"' in files[0].read_text()
    data = json.loads(files[1].read_text())
    assert data["exit_code"] == 0 and data["counts"]["pass"] == 3 and "3 agree" in files[2].read_text()
    assert "<h1>Validation</h1>" in (folder / "out/report.html").read_text()
    # a machine without the second engine and one without the third
    monkeypatch.setattr(report, "write", lambda path, *_: path)
    for name in ("left", "right"):
        (folder / name).mkdir()
    for name, lacks in (("left", "two"), ("right", "three")):
        for engine in engines.values():
            engine.number = None if engine.NAME == lacks else "1"
        assert cli.main(["run", *place[:2], "--output", str(folder / name), "small"]) == 0
    assert cli.main(["merge", str(folder / "left"), str(folder / "right"), *place[:2], "--output", str(folder / "both"), "--strict"]) == 0
    assert "3 agrees" in capsys.readouterr().out


def test_fake_engines_are_engines():
    registry.add("fake-for-a-test", Fake("fake-for-a-test"), "a test")
    try:
        with pytest.raises(HarnessError, match="exists already"):
            registry.add("fake-for-a-test", Fake("fake-for-a-test"), "a test")
        with pytest.raises(HarnessError, match="no function version and run"):
            registry.add("no-engine", object(), "a test")
    finally:
        del registry.ENGINES["fake-for-a-test"]
