"""Speed comparisons: other physics stops them, goals and pages show the record, instruction counts have a bound on both sides."""
import importlib.util
import json
from pathlib import Path

import pytest
from concordem_bench import measure, report
from concordem_bench.cases import Case, Check, Ratio

ROOT = Path(__file__).parents[2]


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "validation" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def side(ns, force):
    details = {"bytes_per_bond": 152, "scratch_bytes_per_bond": 25.0, "loop_s": 1.0, "steps": 1, "stages_ns": {"bonds": ns}}
    return lambda: {"ns": next(ns) if hasattr(ns, "__next__") else ns, "process_s": 1.0, "contacts": 10, "state": {"force": force},
                    "details": details if not hasattr(ns, "__next__") else {}}


def case(force):
    check = Check(("theirs", "ours"), "force", 1e-3, "A reason.")
    return Case("two", "two programs", {"theirs": side(iter([300.0, 100.0, 200.0]), force), "ours": side(10.0, 1.0)},
                [Ratio("theirs / ours", ("theirs", "ours"), 15)], [check])


def test_ratio_is_the_median_of_rounds():
    found = measure.run(case(1.0005), 3, lambda text: None)
    assert found["ratios"][0]["median"] == 20.0
    assert found["checks"][0]["difference"] == pytest.approx(0.0005, rel=1e-3)


@pytest.mark.parametrize("force", [1.01, 0.0, float("nan"), -1.0])
def test_other_physics_stops_the_case(force):
    with pytest.raises(SystemExit, match="force of theirs"):
        measure.run(case(force), 3, lambda text: None)


def test_memory_and_start_are_figures_of_one_program():
    run = {"ns": 1.0, "process_s": 1.0, "wall_s": 4.5, "contacts": 1, "state": {}, "details": {"peak_bytes_per_particle": 1700.0}}
    ratios = [Ratio("kB", ("ours", "ours"), 1.6, at_least=False, value="memory"), Ratio("s", ("ours", "ours"), 5, at_least=False, value="wall_s")]
    found = measure.run(Case("figures", "one program", {"ours": lambda: run}, ratios), 1, lambda text: None)
    assert [ratio["median"] for ratio in found["ratios"]] == [1.7, 4.5]


def test_page_shows_the_record():
    found = measure.run(case(1.0), 3, lambda text: None)
    record = {"machine": "m", "date": "d", "commit": "c" * 40, "seconds": 60, "rounds": 3, "load_average": [0, 1], "cases": {"two": found},
              "memory": {"read_bytes_per_s": 10e9, "copy_bytes_per_s": 20e9}}
    begin, end = report.marks("figures")
    page = report.insert(f"before\n{begin}\nold\n{end}\nafter\n", record)
    assert "old" not in page and "| theirs / ours | 20.00 | 10.00 to 30.00 | ≥ 15 |" in page and page.endswith("after\n")
    assert report.insert(page, record) == page
    found["ratios"][0]["median"] = 14.9
    assert "≥ 15, missed" in report.insert(page, record)
    found["ratios"][0]["goal"] = None
    assert "| 10.00 to 30.00 | none |" in report.insert(page, record)


def test_page_of_the_docs_shows_the_records():
    record = json.loads((ROOT / "validation/results/speed.json").read_text())
    for page in script("speed").PAGES:
        assert report.insert(page.read_text(), record) == page.read_text(), page
    page = script("instructions").PAGE.read_text()
    assert script("instructions").insert(page) == page
    assert script("../tests/new_law/speed").insert(page) == page


def test_summary_names_what_the_record_measures():
    """The rows of the summary name a program and a number of threads; the record's case must have the same."""
    record = json.loads((ROOT / "validation/results/speed.json").read_text())
    for case, number, _, _, program, threads in report.SUMMARY:
        ratio = record["cases"][case]["ratios"][number]
        assert ratio["name"].startswith(program.split(",")[0] + " / our"), (case, ratio["name"])
        assert ("2 threads" in record["cases"][case]["what"]) == (threads == 2), case


def test_more_and_fewer_instructions_than_recorded_are_errors():
    instructions = script("instructions")
    known = {"compiler": "rustc 1", "counts": {"cpm": 100.0}}
    problems = lambda count, compiler="rustc 1", name="cpm": instructions.problems({name: count}, known, compiler)
    assert not problems(101.9) and not problems(98.1)
    assert problems(102.1) and problems(97.9) and problems(100.0, name="new law")
    assert not problems(110.0, "rustc 2") and problems(116.0, "rustc 2")
