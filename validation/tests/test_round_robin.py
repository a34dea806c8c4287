"""The page of the round robin is made from its record, and the record is whole."""
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
import pytest
import round_robin
from concordem_validate import case as cases
from concordem_validate import runner


def test_the_page_is_that_of_the_record():
    data = json.loads(round_robin.RESULTS.read_text())
    assert round_robin.PAGE.read_text() == round_robin.page(data)
    assert [name for name in round_robin.IMPACTS + round_robin.BULK if name not in data] == []


def test_the_record_has_every_engine_and_no_failure():
    data = json.loads(round_robin.RESULTS.read_text())
    for name, one in data.items():
        case = cases.load(name)
        assert not one["not_done"] and {v["status"] for v in one["verdicts"]} <= {"pass", "known"}, name
        # of the long cases one peer is enough
        left_out = one.get("left_out", []) if name in round_robin.FULL else []
        wanted = {(task.variant, e) for task in case.tasks for e in [case.reference, *case.engines_of[task.variant]]
                  if e not in round_robin.TIMELESS and e not in left_out}
        assert {(t["variant"], t["engine"]) for t in one["times"]} == wanted and all(t["processor_s"] > 0 for t in one["times"]), name
        # the tolerances of today
        checks = {c.name: c.tolerance for c in case.checks if c.tolerance is not None and c.kind != "speed"}
        assert all(v["tolerance"] in {c.tolerance for c in case.checks if c.name == v["check"]} for v in one["verdicts"] if "tolerance" in v), checks


def test_a_failure_and_a_missing_engine_are_on_the_page():
    verdict = dict(variant="main", check="spin", reference="concordem", peer="yade", status="fail", cause="difference", difference=0.5, tolerance=0.1)
    one = dict(title="T", source="s", times=[dict(variant="main", engine="yade", processor_s=1.25, particles=3, steps=7)], date="2026-01-01T00", processor="p",
               verdicts=[verdict, {**verdict, "variant": "b", "difference": None, "status": "missing"}], not_done={"main · liggghts": "crashed: it broke"})
    text = round_robin.page({"a": one})
    assert "| spin | ConcorDEM | YADE | 5.0e-01 | 1.0e-01 | FAILS |" in text and "| a | 3 | 7 | 1.25 |" in text
    assert "Not done: main · liggghts: crashed: it broke." in text


def test_an_interrupted_study_keeps_finished_runs_with_their_seconds(folder, engines):
    task = cases.load("small", folder / "cases").tasks[0]
    once = lambda name: round_robin.timed(runner.Runner(folder / "out", quiet=True, jobs=1), task, name, 10)
    outcome, seconds = once("one")
    assert outcome.status == "done" and seconds >= 0 and engines["one"].runs == 1
    note = round_robin._note(outcome)
    note.write_text("12.5")
    assert once("one")[1] == 12.5 and engines["one"].runs == 1
    # a run of another study has no seconds: it is measured
    note.unlink()
    assert once("one")[1] != 12.5 and engines["one"].runs == 2
    engines["two"].number = None
    assert once("two")[0].status == "missing" and once("two")[1] is None


def test_estimates_scale_with_spheres_and_steps():
    """A program that takes 1 s to start and makes a million steps of a sphere in a second."""
    times = lambda seconds, particles, steps: dict(times=[dict(engine="yade", processor_s=seconds, particles=particles, steps=steps)])
    small = {name: times(1.0 + 0.4, 400, 1000) for name in round_robin.BULK}
    lines = round_robin._estimates({round_robin.START: times(1.0, 10, 1), **small})
    rows = lines[lines.index("| Published | Steps | YADE, hours |") + 2:]
    for row, (label, spheres, steps, _) in zip(rows, round_robin.PUBLISHED, strict=True):
        assert row.startswith(f"| {label} | {steps:,} | ") and float(row.split("|")[3]) == pytest.approx(spheres * steps * 1e-6 / 3600, rel=0.05)
    # a larger case, with half the speed, tells more
    larger = round_robin._estimates({round_robin.START: times(1.0, 10, 1), **small, "penetration-25000": times(1.0 + 2.0, 1000, 1000)})
    assert larger[-1] != lines[-1] and larger[-6:-3] == lines[-6:-3]
    assert float(larger[-1].split("|")[3]) == pytest.approx(100_001 * 200_000 * 2e-6 / 3600, rel=0.05)


def test_the_picture_has_the_recorded_curves_of_all_codes():
    data = json.loads(round_robin.RESULTS.read_text())
    for name in round_robin.BULK:
        for label, by_engine in data[name]["curves"].items():
            assert set(by_engine) == {"concordem", "yade", "liggghts"}, label
            assert all(len(x) == len(y) > 8 for x, y in by_engine.values()) and len({len(x) for x, _ in by_engine.values()}) == 1, label
