"""Wrong codes that a check could still call equal: each must be found, and with its cause."""
import numpy as np
import pytest
from concordem_validate import baseline, cli, compare, merging, norms, rounds, runner, start
from concordem_validate import case as cases
from concordem_validate.errors import HarnessError, Incomparable
from conftest import CASE, SCENARIO, judged, sound

REASON = 'reason = "a tolerance for tests"\n'


def causes(folder, check, more="", before=""):
    """Causes of the verdicts of a case with one check between the engines one and two."""
    (folder / "cases/small/case.toml").write_text(
        'title = "t"\nquestion = "q"\nsource = "s"\nreference = "one"\nengines = ["two"]\n' + before + f"[[check]]\n{check}{REASON}{more}")
    round_ = judged(folder)
    return [v.cause or v.status for v in round_.verdicts]


def short(result):
    """Only the first sample of everything."""
    for one in result.series.values():
        one.steps, one.values = one.steps[:1], one.values[:1]


def still(result):
    for one in result.series.values():
        one.values[:] = one.values[:1]


BITS = 'name = "bits"\nkind = "bits"\npeer = "two"\n'
SPEED = 'name = "speed"\nkind = "speed"\npeer = "two"\nrepeats = 1\ntolerance = 2.0\n'


@pytest.mark.parametrize("change, cause", [(None, "pass"), (short, "short"), (still, "blind")])
def test_equal_bits_of_runs_that_do_nothing_say_nothing(folder, engines, change, cause):
    engines["one"].change = engines["two"].change = change
    assert causes(folder, BITS) == [cause]


@pytest.mark.parametrize("change, cause", [(None, "pass"), (short, "short")])
def test_a_run_that_ends_early_is_not_fast(folder, engines, change, cause):
    def timed(result):
        result.numbers["wall_s"] = 1.0
        if change:
            change(result)

    engines["one"].change = engines["two"].change = timed
    assert causes(folder, SPEED) == [cause]


def test_the_timed_run_must_be_the_compared_one(folder, engines):
    """A run that ends early only when it is timed."""
    def timed(result):
        result.numbers["wall_s"] = 1.0
        if engines["one"].runs > 1:
            short(result)

    engines["one"].change = timed
    engines["two"].change = lambda result: result.numbers.update(wall_s=1.0)
    assert causes(folder, SPEED) == ["error"]


SCALAR = 'name = "number"\nkind = "scalar"\npeer = "two"\nof = "a"\nscale = "1 N"\ntolerance = 1e-3\n'


@pytest.mark.parametrize("numbers, more, cause", [
    ((1.0, 1.0), "", "pass"), ((0.0, 0.0), "", "blind"), ((0.0, 0.0), "may_be_zero = true\n", "pass"), ((0.1, 0.0), "", "difference"),
])
def test_two_zeros_are_no_agreement(folder, engines, numbers, more, cause):
    for engine, value in zip(("one", "two"), numbers):
        engines[engine].change = lambda result, value=value: result.numbers.update(a=value)
    assert causes(folder, SCALAR, more) == [cause]


def test_numbers_of_runs_with_one_sample_are_refused(folder, engines):
    def number(result):
        short(result)
        result.numbers["a"] = 1.0

    engines["one"].change = engines["two"].change = number
    assert causes(folder, SCALAR) == ["short"]


ENSEMBLE = 'name = "number"\nkind = "ensemble"\npeer = "two"\nof = "a"\ntolerance = 1e-2\n'
MEMBERS = "".join(f'[[variant]]\nname = "m{k}"\nchanges = {{ "title" = "{k}" }}\n' for k in range(4))


@pytest.mark.parametrize("scatter, cause", [(1e-3, "pass"), (0.0, "blind")])
def test_members_that_are_one_run_are_no_ensemble(folder, engines, monkeypatch, scatter, cause):
    (folder / "cases/small/scenario.toml").write_text('title = "t"\n' + SCENARIO)
    for engine in engines.values():
        def run(task, *_, engine=engine):
            result = sound(engine.NAME)
            result.numbers["a"] = 1.0 + scatter * int(task.scenario["title"])
            return result
        monkeypatch.setattr(engine, "run", run)
    assert causes(folder, ENSEMBLE, before=MEMBERS) == [cause]


# curves

def test_a_peak_has_a_sign_and_a_particle():
    x = np.linspace(0, 1, 11)
    curve = np.sin(3 * x)
    peak = norms.NORMS["peak"]
    assert peak(x, curve, curve, 1.0) == 0 and peak(x, -curve, curve, 1.0) > 0.9
    two = np.stack([np.outer(curve, [1, 0, 0]), np.outer(0.5 * curve, [0, 1, 0])], axis=1)
    assert peak(x, two[:, ::-1], two, 1.0) > 0.4
    # the closed form: a tenth more at the peak
    assert peak(x, 1.1 * curve, curve, curve.max()) == pytest.approx(0.1)


def rigid(shape):
    """Two particles, or one, that turn about the origin, and whose distance changes by `shape`."""
    def change(result):
        angle = 5e-3 * result.series["position"].steps
        distance = 1 + shape * angle
        one = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) * distance[:, None]
        result.series["position"].values = np.stack([one, -one], axis=1)
    return change


SHAPE = 'name = "shape"\nkind = "series"\npeer = "two"\nof = "position"\nscale = "displacement"\nframe = "rigid"\ntolerance = 1e-3\n'


def test_a_shape_that_does_not_change_is_no_check(folder, engines):
    engines["one"].change = engines["two"].change = rigid(0.1)
    assert causes(folder, SHAPE) == ["pass"]
    for name in ("one", "two"):
        engines[name].change, engines[name].number = rigid(0.0), "2"
    assert causes(folder, SHAPE) == ["blind"]

    def alone(result):
        rigid(0.1)(result)
        result.series["position"].values = result.series["position"].values[:, :1]

    # a single particle can always be moved onto another
    for name in ("one", "two"):
        engines[name].change, engines[name].number = alone, "3"
    assert causes(folder, SHAPE) == ["error"]


TWINS = 'name = "positions"\nkind = "series"\npeer = "two"\nof = "position"\nscale = "displacement"\ntolerance = 1e-3\ntwin = 10.0\n'


@pytest.mark.parametrize("growth, cause", [(1e-9, "pass"), (0.1, "blind")])
def test_twins_that_part_at_once_allow_nothing(folder, engines, monkeypatch, growth, cause):
    """An engine whose bits change from run to run, or that is unstable, would agree with everything."""

    def run(task, *_):
        result = sound("one")
        moved = [float(str(v).split()[0]) for v in task.scenario["packing"]["spheres"][-1][:1]]
        if moved != [3.0]:
            result.series["position"].values[1:] += growth
        return result

    monkeypatch.setattr(engines["one"], "run", run)
    assert causes(folder, TWINS) == [cause]


def test_a_length_of_a_bond_that_is_no_number_is_refused():
    one = start.Start(1.0, np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)), np.ones(2), np.ones(2), np.zeros(2, int), np.array([[0, 1]]),
                      np.array([np.nan]), np.zeros(0))
    other = start.Start(**{**one.__dict__, "reference_length": np.array([1.0])})
    start._same_bonds(other, other, False)
    with pytest.raises(Incomparable, match="length of a bond"):
        start._same_bonds(one, other, False)


@pytest.mark.parametrize("text, said", [
    ('quirk = "q"\nknown = [0, 0.5]\n', "may be zero is not known"), ("tolerance = 1e-3\ntwin = inf\n", "`twin` is inf; give a finite number"),
])
def test_limits_that_let_everything_pass_are_refused(folder, engines, text, said):
    (folder / "cases/quirks.toml").write_text(
        '[q]\nengine = "two"\ntitle = "t"\nwhat = "w"\nsource = "s"\neffect = "e"\naligned = "a"\ncases = ["small"]\n')
    check = 'name = "force"\nkind = "series"\npeer = "two"\nof = "force"\n'
    with pytest.raises(HarnessError, match=said):
        causes(folder, check + text)


# rounds

def test_results_of_another_state_of_the_case_are_stale(folder, engines, no_page, monkeypatch, capsys):
    monkeypatch.delenv("CI", raising=False)
    place = ["--cases", str(folder / "cases"), "--output", str(folder / "out")]
    assert cli.main(["run", *place, "small"]) == rounds.AGREES
    # texts and tolerances may change
    path = folder / "cases/small/case.toml"
    path.write_text(CASE.replace('question = "q"', 'question = "another"'))
    assert cli.main(["report", *place]) == rounds.AGREES
    scenario = folder / "cases/small/scenario.toml"
    scenario.write_text(scenario.read_text().replace("density = 2500", "density = 5777"))
    assert cli.main(["report", *place]) == rounds.FAILED
    assert "the case has changed since this run" in capsys.readouterr().out
    assert cli.main(["merge", str(folder / "out"), *place[:2], "--output", str(folder / "all")]) == rounds.FAILED


def test_a_wrong_start_state_of_one_machine_stays_wrong(folder, engines):
    round_ = judged(folder)
    for name, status in (("left", "fail"), ("right", "pass")):
        one = compare.Verdict("small", "main", runner.Check(**runner.START), status)
        (folder / name).mkdir()
        rounds.write(folder / name, rounds.Round(round_.outcomes, round_.verdicts, [one]), 0)
    for order in (["left", "right"], ["right", "left"]):
        _, starts = merging.merge([folder / name for name in order], folder / "both")
        assert [s["status"] for s in starts] == ["fail"]


def test_a_baseline_misses_what_a_round_no_longer_runs(folder, engines):
    rounds.write(folder / "out", judged(folder), 0)
    baseline.bless(folder / "out", folder / "base/v1")
    few = judged(folder)
    del few.outcomes["small", "main", "three"]
    assert [(v.status, v.reference) for v in baseline.against(few, folder / "base/v1") if v.status != "pass"] == [("fail", "three")]
    assert {v.status for v in baseline.against(few, folder / "base/v1", few=True)} == {"pass"}
    few.outcomes = {("other", *key[1:]): outcome for key, outcome in few.outcomes.items()}
    with pytest.raises(HarnessError, match="nothing is compared with it"):
        baseline.against(few, folder / "base/v1")


def test_compare_sees_fields(tmp_path, capsys):
    for name, mass in (("a", 1.0), ("b", 1.0), ("c", 1.01)):
        one = sound()
        one.fields["mass"] = (np.full(2, mass), "kg")
        one.write(tmp_path / f"{name}.h5")
    compared = lambda name: cli.main(["compare", str(tmp_path / "a.h5"), str(tmp_path / f"{name}.h5"), "--tolerance", "1e-3"])
    assert compared("b") == rounds.AGREES
    capsys.readouterr()
    assert compared("c") == rounds.FAILED and "beyond" in next(line for line in capsys.readouterr().out.splitlines() if line.startswith("mass"))


def test_a_mistake_in_one_engine_makes_only_that_engine_run_again(folder, engines):
    case = cases.load("small", folder / "cases")
    one = runner.Runner(folder / "out", quiet=True)
    key = lambda engine, plant: one.key(runner.replace(case.tasks[0], plant=plant), engine)
    monkeyed = {"two": [still]}
    assert key("one", {}) == key("one", monkeyed) and key("two", {}) != key("two", monkeyed)
    # also on a turned scenario
    assert cases.know("two@rotated") and key("two@rotated", {}) != key("two@rotated", monkeyed)
