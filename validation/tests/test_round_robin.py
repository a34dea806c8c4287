"""The page of the round robin is made from its record, and the record is whole."""
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
import round_robin
from concordem_validate import case as cases


def test_the_page_is_that_of_the_record():
    data = json.loads(round_robin.RESULTS.read_text())
    assert round_robin.PAGE.read_text() == round_robin.page(data)
    assert [name for name in round_robin.IMPACTS + round_robin.BULK if name not in data] == []


def test_the_record_has_every_engine_and_no_failure():
    data = json.loads(round_robin.RESULTS.read_text())
    for name, one in data.items():
        case = cases.load(name)
        assert not one["not_done"] and {v["status"] for v in one["verdicts"]} <= {"pass", "known"}, name
        wanted = {(task.variant, e) for task in case.tasks for e in [case.reference, *case.engines_of[task.variant]] if e not in round_robin.TIMELESS}
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
