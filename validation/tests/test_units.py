"""Units, scenarios, results, and comparisons, without engines."""
import math
import platform
import tomllib

import numpy as np
import pytest
from concordem_validate import case as cases
from concordem_validate import compare, provenance, quirks, scenario
from concordem_validate.errors import HarnessError
from concordem_validate.quantity import si
from concordem_validate.result import Result


@pytest.mark.parametrize("text, value", [
    ("50 mm", 0.05), ("30 GPa", 30e9), ("0.2 us", 2e-7), ("0.2 µs", 2e-7), ("4.8 g/cm^3", 4800.0), ("4800kg/m³", 4800.0),
    ("-3 1/s", -3.0), ("0.4 s^-1", 0.4), ("30 %", 0.3), ("1.5e2 N / mm", 1.5e5), ("1_000 g", 1.0), ("2 kg m^2", 2.0),
    ("2 nN*m", 2e-9), ("180 deg", math.pi), ("30 rpm", math.pi), ("16 cm^3", 16e-6), (3, 3.0), ("225 mm^2", 225e-6),
])
def test_quantities(text, value):
    # derived units have one more rounding than in the program
    assert si(text) == pytest.approx(value, rel=4e-16)


@pytest.mark.parametrize("text", ["30 GPas", "GPa", "30 GPa/", True, [1], "x", "3 m^"])
def test_bad_quantities(text):
    if text == "30 GPa/":
        assert si(text) == 30e9  # the program rejects it before a peer runs
    else:
        with pytest.raises(HarnessError):
            si(text)


def test_scenarios_survive_writing():
    for name in cases.names():
        for task in cases.load(name).tasks:
            assert tomllib.loads(scenario.dumps(task.scenario)) == task.scenario


def test_changes():
    document = {"a": [{"b": 1}], "c": {"d": 2}}
    assert scenario.changed(document, {"a.0.b": 5, "a.1": {"b": 6}, "c.d": None, "e.f": 7}) == {
        "a": [{"b": 5}, {"b": 6}], "c": {}, "e": {"f": 7}}
    assert document == {"a": [{"b": 1}], "c": {"d": 2}}
    with pytest.raises(HarnessError):
        scenario.changed(document, {"a.5.b": 1})


def result(values, steps=None, dt=1e-6):
    one = Result("x", dt)
    one.add("s", range(len(values)) if steps is None else steps, values, "N", "of a test")
    return one


def check(**options):
    return cases.Check(**{**dict(name="c", kind="series", peer="yade", of="s", variants=["*"], reason="r", tolerance=1e-3),
                          **options})


def test_results_survive_writing(tmp_path):
    one = result([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    one.fields["contacts/cpm/area"] = (np.arange(3.0), "m^2")
    one.numbers["wall_s"], one.provenance["seed"] = 1.5, "1"
    one.write(tmp_path / "a.h5")
    two = Result.read(tmp_path / "a.h5")
    assert two.dt == one.dt and two.numbers == one.numbers and two.provenance == one.provenance
    assert np.array_equal(two.series["s"].values, one.series["s"].values) and two.series["s"].unit == "N"
    assert np.array_equal(two.fields["contacts/cpm/area"][0], np.arange(3.0))
    lines, good = compare.files(one, two, 0.0)
    assert good and len(lines) == 1


def test_series_compare_by_step_within_the_window():
    ours, theirs = result([0.0, 1.0, 2.0, 9.0]), result([0.0, 2.0, 3.0], steps=[0, 2, 3])
    steps, growth, _ = compare.series(check(), ours, theirs)
    assert steps.tolist() == [0, 2, 3] and growth.tolist() == [0.0, 0.0, 2.0]
    steps, growth, _ = compare.series(check(to_step=2), ours, theirs)
    assert growth.max() == 0.0
    with pytest.raises(HarnessError, match="window"):
        compare.series(check(to_step=9), ours, theirs)
    with pytest.raises(HarnessError, match="time steps"):
        compare.series(check(), ours, result([0.0, 1.0], dt=2e-6))
    with pytest.raises(HarnessError, match="no series"):
        compare.series(check(of="t"), ours, theirs)
    other = result([0.0, 1.0])
    other.series["s"].unit = "kN"
    with pytest.raises(HarnessError, match="kN"):
        compare.series(check(), ours, other)


def test_files_that_cannot_be_compared_are_not_equal():
    def compared(other, tolerance=0.0):
        lines, good = compare.files(result([0.0, 1.0, 2.0]), other, tolerance)
        return good, "\n".join(lines)

    assert compared(result([0.0, 1.0, 2.0]))[0]
    more, fewer = result([0.0, 1.0, 2.0]), result([0.0, 1.0, 2.0])
    more.add("t", [0], [1.0], "N")
    del fewer.series["s"]
    unit = result([0.0, 1.0, 2.0])
    unit.series["s"].unit = "kN"
    for other, said in (
        (more, "is in the second only"), (fewer, "no common series"), (unit, "units N and kN"),
        (result([[0.0], [1.0], [2.0]]), "shapes"), (result([0.0, 1.0, 2.0], steps=[3, 4, 5]), "no common steps"),
        (result([0.0, 1.0, 2.0], dt=2e-6), "time steps differ"),
        (result([0.0, math.nan, 2.0]), "beyond"), (result([0.0, 1.0, 2.1]), "beyond"),
    ):
        good, text = compared(other, 1e-3)
        assert not good and said in text, text
    # a larger interval is not an error, but is reported
    good, text = compared(result([0.0, 2.0], steps=[0, 2]))
    assert good and "at 2 common steps of 3 and 2" in text


def test_a_peer_that_stands_still_is_no_scale():
    with pytest.raises(HarnessError, match="scale"):
        compare.series(check(scale="displacement"), result([1.0, 1.0]), result([1.0, 1.0]))


def test_known_differences_fail_when_they_vanish_or_grow():
    one = check(tolerance=None, quirk="q", known=[1e-4, 1e-2])
    for difference, status in ((1e-3, "known"), (0.0, "fail"), (0.1, "fail"), (math.nan, "fail")):
        assert compare._settle(compare.Verdict("a", "b", one, "fail"), difference).status == status
    assert compare._settle(compare.Verdict("a", "b", check(), "fail"), math.nan).status == "fail"


def test_confidence_band():
    # mean 2, standard deviation 1, three members: t = 4.303 (table of Student's t)
    mean, half = compare.band([1.0, 2.0, 3.0])
    assert mean == 2.0 and half == pytest.approx(4.303 / math.sqrt(3), rel=1e-12)
    with pytest.raises(HarnessError):
        compare.band([1.0, 2.0])


def test_every_case_and_quirk_is_whole():
    known = quirks.load()
    used = set()
    for name in cases.names():
        one = cases.load(name)
        used |= {c.quirk for c in one.checks} - {None}
        for c in one.checks:
            assert len(c.reason) > 20, f"{name}: the reason of {c.name} is too short"
        assert (one.folder / "README.md").exists(), f"{name} has no README.md"
    for quirk in known.values():
        assert set(quirk["cases"]) <= set(cases.names())
    assert used <= known.keys()


@pytest.mark.parametrize("text, message", [
    ('title="t"\nquestion="q"\nsource="s"\nengines=["yade"]\n[[check]]\nname="c"\nkind="series"\npeer="yade"\nof="x"\ntolerance=1\n',
     "reason"),
    ('title="t"\nquestion="q"\nsource="s"\nengines=["yade"]\n[[check]]\nname="c"\nkind="series"\npeer="yade"\nof="x"\nreason="r"\n',
     "tolerance"),
    ('title="t"\nquestion="q"\nsource="s"\nengines=["pfc"]\n[[check]]\nname="c"\n', "unknown engine"),
    ('title="t"\nquestion="q"\nsource="s"\nengine=["yade"]\n', "unknown key"),
    ('title="t"\nquestion="q"\nsource="s"\nengines=["yade"]\n[[check]]\nname="c"\nkind="series"\npeer="yade"\nof="x"\nreason="r"\n'
     'quirk="none"\nknown=[0,1]\n', "quirks.toml"),
    ('title="t"\nquestion="q"\nsource="s"\nengines=["yade"]\n[[check]]\nname="c"\nkind="series"\npeer="yade"\nof="x"\ntolerance=1\n'
     'reason="r"\ntier="full"\n', "unknown key tier"),
])
def test_bad_cases(tmp_path, text, message):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "case.toml").write_text(text)
    (tmp_path / "a" / "scenario.toml").write_text('version = 1\n[packing]\nkind = "spheres"\n')
    with pytest.raises(HarnessError, match=message):
        cases.load("a", tmp_path)


def test_processor_is_named_with_what_tells_models_apart(tmp_path):
    description = tmp_path / "cpuinfo"
    description.write_text("processor\t: 0\ncpu family\t: 25\nmodel\t\t: 1\nmodel name\t: AMD EPYC\nflags\t\t: fpu avx avx2\n\nprocessor\t: 1\n")
    assert provenance.processor(description) == "AMD EPYC (family 25, model 1, AVX2)"
    description.write_text("CPU implementer\t: 0x41\n")
    assert provenance.processor(description) == provenance.processor(tmp_path / "missing") == platform.machine()
