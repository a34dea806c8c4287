"""Units, scenarios, results, and comparisons, without engines."""
import math
import platform
import tomllib

import numpy as np
import pytest
from concordem_validate import case as cases
from concordem_validate import compare, difference, lint, meeting, norms, provenance, quirks, scenario
from concordem_validate.errors import HarnessError
from concordem_validate.quantity import base, factor, si
from concordem_validate.result import Result


@pytest.mark.parametrize("text, value", [
    ("50 mm", 0.05), ("30 GPa", 30e9), ("0.2 us", 2e-7), ("0.2 µs", 2e-7), ("4.8 g/cm^3", 4800.0), ("4800kg/m³", 4800.0),
    ("-3 1/s", -3.0), ("0.4 s^-1", 0.4), ("30 %", 0.3), ("1.5e2 N / mm", 1.5e5), ("1_000 g", 1.0), ("2 kg m^2", 2.0),
    ("2 nN*m", 2e-9), ("180 deg", math.pi), ("30 rpm", math.pi), ("16 cm^3", 16e-6), (3, 3.0), ("225 mm^2", 225e-6), ("20 ps", 2e-11), ("6 km/s*ms", 6.0),
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
    lines, good = difference.files(one, two, 0.0)
    assert good and len(lines) == 2


def compared(one, ours, theirs):
    pair, number = compare.series(one, ours, theirs)
    return pair.steps.tolist(), pair.growth.tolist(), number


def test_series_meet_in_time_within_the_window():
    ours, theirs = result([0.0, 1.0, 2.0, 9.0]), result([0.0, 2.0, 3.0], steps=[0, 2, 3])
    assert compared(check(), ours, theirs) == ([0, 2, 3], [0.0, 0.0, 2.0], 2.0)
    assert compared(check(to_step=2), ours, theirs)[2] == 0.0
    assert compared(check(last=2e-6), ours, theirs)[0] == [0, 2]
    for one, other, message in (
        (check(to_step=9), theirs, "window"), (check(), result([0.0, 1.0], dt=2e-6), "ends early"), (check(of="t"), theirs, "no series"),
        (check(over="step"), result([0.0, 1.0, 2.0, 9.0], dt=2e-6), "time steps differ"), (check(from_step=1, last=5.0), theirs, "window"),
    ):
        with pytest.raises(HarnessError, match=message):
            compare.series(one, ours, other)
    # twice the step and half the samples are the same curve
    assert compared(check(), result([0.0, 1.0, 2.0, 3.0, 4.0]), result([0.0, 2.0, 4.0], dt=2e-6))[:2] == ([0, 2, 4], [0.0, 0.0, 0.0])
    # a series that ends before the run
    with pytest.raises(HarnessError, match="but the run at"):
        compare.series(check(), ours, theirs, span=meeting.Span(10, 0, 1, 1e-6))
    # the last sample of an interval may lie before the end
    compare.series(check(), result([0.0, 1.0, 2.0], steps=[0, 3, 6]), result([0.0, 1.0, 2.0], steps=[0, 3, 6]), span=meeting.Span(8, 0, 3, 1e-6))


def test_units_are_converted_or_refused():
    ours, theirs = result([0.0, 1.0, 2.0]), result([0.0, 1e-3, 2e-3])
    theirs.series["s"].unit = "kN"
    assert compared(check(), ours, theirs)[2] == pytest.approx(0.0, abs=1e-15)
    theirs.series["s"].unit = "Pa"
    with pytest.raises(HarnessError, match="Pa and N measure different things"):
        compare.series(check(), ours, theirs)
    for one, other, size in (("kN", "N", 1e3), ("N/mm^2", "MPa", 1.0), ("m/s", "mm/ms", 1.0), ("rpm", "rad/s", math.pi / 30), ("%", "1", 0.01)):
        assert factor(one, other) == pytest.approx(size, rel=1e-15)
    for unit, name in (("kN/mm^2", "Pa"), ("mm", "m"), ("g/cm^3", "kg/m^3"), ("kN*m", "J"), ("1/ms", "1/s"), ("rpm", "rad/s")):
        assert base(unit) == name


def test_curves_are_interpolated_where_the_case_says_so_and_never_beyond():
    def curve(x, y):
        one = result(y)
        one.add("strain", range(len(x)), x, "1")
        return one

    strain = np.linspace(0, 1, 11)
    ours, theirs = curve(strain, strain**2), curve(np.linspace(0, 1, 101), np.linspace(0, 1, 101) ** 2)
    with pytest.raises(HarnessError, match="ends early"):
        compare.series(check(), ours, theirs)
    over = check(over="strain", meet="interpolate")
    assert compare.series(over, ours, theirs)[1] < 1e-15
    # between the points of the coarser curve nothing is invented: it gives the points
    assert len(compare.series(over, theirs, ours)[0].x) == 11
    # compression: the axis falls
    assert compare.series(over, curve(-strain, strain**2), curve(-np.linspace(0, 1, 101), np.linspace(0, 1, 101) ** 2))[1] < 1e-15
    short = curve(np.linspace(0, 0.8, 81), np.linspace(0, 0.8, 81) ** 2)
    with pytest.raises(HarnessError, match="ends early"):
        compare.series(over, ours, short)
    pair, _ = compare.series(check(over="strain", meet="interpolate", last=0.7), ours, short)
    assert pair.x.max() == pytest.approx(0.7)
    back = curve(np.array([0, 0.5, 0.4, 1.0]), np.arange(4.0))
    with pytest.raises(HarnessError, match="does not run one way"):
        compare.series(over, back, theirs)


def test_norms_have_their_closed_forms():
    x = np.linspace(0, 1, 1001)
    a, b = np.sin(2 * np.pi * x) + 0.1, np.sin(2 * np.pi * x)
    wanted = {"max": 0.1, "l2": 0.1, "end": 0.1, "peak": 0.1, "peak-place": 0.0, "area": 0.1 / (2 / np.pi)}
    for name, value in wanted.items():
        assert norms.NORMS[name](x, a, b, 1.0) == pytest.approx(value, rel=1e-5, abs=1e-12), name
    pulse = lambda middle: np.exp(-(((x - middle) / 0.05) ** 2))
    assert norms.NORMS["peak-place"](x, pulse(0.5), pulse(0.4), 1.0) == pytest.approx(0.1, abs=1e-9)
    step = lambda at: np.clip((x - at) / 0.1, 0, 1)
    assert norms.NORMS["arrival"](x, step(0.3), step(0.2), 1.0) == pytest.approx(0.1, abs=1e-9)
    wave = lambda n: np.sin(2 * np.pi * n * np.arange(256) / 256)
    assert norms.NORMS["spectrum"](np.arange(256.0), wave(5), wave(5), 1.0) == 0.0
    assert norms.NORMS["spectrum"](np.arange(256.0), wave(6), wave(5), 1.0) == pytest.approx(1.0)
    # a spectrum does not see the phase
    assert norms.NORMS["spectrum"](np.arange(256.0), np.roll(wave(5), 3), wave(5), 1.0) < 1e-12


def test_particles_are_matched_by_place_and_shapes_without_rigid_motion():
    rng = np.random.default_rng(1)
    places = rng.random((6, 3)) + rng.random((4, 6, 3)).cumsum(axis=0) * 1e-2
    ours, theirs = Result("a", 1.0), Result("b", 1.0)
    order = rng.permutation(6)
    ours.add("position", range(4), places, "m")
    theirs.add("position", range(4), places[:, order], "m")
    one = dict(of="position", scale="1 mm")
    assert compare.series(check(**one), ours, theirs)[1] > 1 and compare.series(check(**one, match="place"), ours, theirs)[1] == 0.0
    c, s = math.cos(0.3), math.sin(0.3)
    turned = places @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [1, 2, 3]
    theirs.add("position", range(4), turned, "m")
    assert compare.series(check(**one, frame="rigid"), ours, theirs)[1] < 1e-10
    mirrored = places * [1, 1, -1]
    theirs.add("position", range(4), mirrored, "m")
    assert compare.series(check(**one, frame="rigid"), ours, theirs)[1] > 1e-2


def test_files_that_cannot_be_compared_are_not_equal():
    def compared(other, tolerance=0.0):
        lines, good = difference.files(result([0.0, 1.0, 2.0]), other, tolerance)
        return good, "\n".join(lines)

    assert compared(result([0.0, 1.0, 2.0]))[0]
    more, fewer = result([0.0, 1.0, 2.0]), result([0.0, 1.0, 2.0])
    more.add("t", [0], [1.0], "N")
    del fewer.series["s"]
    unit = result([0.0, 1.0, 2.0])
    unit.series["s"].unit = "kN"
    for other, said in (
        (more, "is in the second only"), (fewer, "no common series"), (unit, "beyond"),
        (result([[0.0], [1.0], [2.0]]), "shape"), (result([0.0, 1.0, 2.0], steps=[3, 4, 5]), "ends early"),
        (result([0.0, 1.0, 2.0], dt=2e-6), "ends early"), (result([0.0]), "ends early"),
        (result([0.0, math.nan, 2.0]), "not a finite number"), (result([0.0, 1.0, 2.1]), "beyond"),
    ):
        good, text = compared(other, 1e-3)
        assert not good and said in text, text
    # a larger interval is not an error, but is reported
    good, text = compared(result([0.0, 2.0], steps=[0, 2]))
    assert good and "at 2 common points of 3 and 2" in text


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


def test_independent_samples_have_the_interval_of_welch():
    # equal variances of 1 and sizes of 3: four degrees of freedom, t = 2.776
    mean, half = compare.welch([1.0, 2.0, 3.0], [2.0, 3.0, 4.0])
    assert mean == -1.0 and half == pytest.approx(2.776 * math.sqrt(2 / 3), rel=1e-12)
    # one of them exact: two degrees of freedom
    assert compare.welch([1.0, 2.0, 3.0], [2.0] * 9)[1] == pytest.approx(4.303 / math.sqrt(3), rel=1e-12)


def test_a_known_difference_expires():
    import datetime
    one = check(tolerance=None, quirk="q", known=[1e-4, 1e-2], until=datetime.date(2020, 1, 1))
    verdict = compare._settle(compare.Verdict("a", "b", one, "fail"), 1e-3)
    assert (verdict.status, verdict.cause) == ("fail", "expired") and "2020-01-01" in verdict.message
    one.until = datetime.date(2999, 1, 1)
    assert compare._settle(compare.Verdict("a", "b", one, "fail"), 1e-3).status == "known"


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


def test_no_check_of_ours_is_idle():
    found = [line for name in cases.names() for line in lint.find([cases.load(name)])]
    assert not found, "\n".join(found)


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
    (tmp_path / "a" / "scenario.toml").write_text('version = 1\n[packing]\nkind = "spheres"\nspheres = []\n')
    with pytest.raises(HarnessError, match=message):
        cases.load("a", tmp_path)


def test_processor_is_named_with_what_tells_models_apart(tmp_path):
    description = tmp_path / "cpuinfo"
    description.write_text("processor\t: 0\ncpu family\t: 25\nmodel\t\t: 1\nmodel name\t: AMD EPYC\nflags\t\t: fpu avx avx2\n\nprocessor\t: 1\n")
    assert provenance.processor(description) == "AMD EPYC (family 25, model 1, AVX2)"
    description.write_text("CPU implementer\t: 0x41\n")
    assert provenance.processor(description) == provenance.processor(tmp_path / "missing") == platform.machine()
