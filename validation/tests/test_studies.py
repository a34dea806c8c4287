"""The long studies and what runs them: no old results under a new commit, no failed check that passes, no skipped peer."""
import importlib.util
import json
import os
import re
import subprocess
from pathlib import Path

import pytest
from concordem_validate import provenance
from conftest import need

ROOT = Path(__file__).parents[2]


def study(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "validation" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def script(path, text):
    path.write_text(text)
    path.chmod(0o755)
    return path


@pytest.fixture
def elastic(tmp_path, monkeypatch):
    """The study with folders of its own and a program that writes one point, `young` = 2."""
    module = study("elastic")
    program = script(tmp_path / "program", "#!/bin/sh\n"
                     "echo x > \"$4\"; printf 'young,problem\\n2.0,\\n' > \"${4%.h5}.csv\"\n")
    for name, value in dict(PROGRAM=program, FILES=tmp_path / "sweeps", RESULTS=tmp_path / "elastic.json").items():
        monkeypatch.setattr(module, name, value)
    return module


def test_finished_sweeps_of_old_are_run_again(elastic):
    elastic.FILES.mkdir()
    (elastic.FILES / "ratios.h5").write_text("old")
    (elastic.FILES / "ratios.csv").write_text("young,problem\n1.0,\n")
    rows, seconds = elastic.run("ratios", None, resume=True)
    assert [row["young"] for row in rows] == [2.0] and seconds is not None
    # an unfinished one goes on, and its time is not that of the sweep
    (elastic.FILES / "ratios.h5.points").write_text("journal")
    _, seconds = elastic.run("ratios", None, resume=True)
    assert seconds is None and (elastic.FILES / "ratios.h5.points").exists()
    elastic.run("ratios", None, resume=False)
    assert not (elastic.FILES / "ratios.h5.points").exists()


@pytest.mark.parametrize("change, message", [
    (lambda points: None, None),
    (lambda points: points[0].update(dynamic_by_static_minus_1=-3e-6), "dynamics by statics.*does not hold"),
    (lambda points: points[0].update(young_by_affine=1.01), "relaxed E over affine E.*does not hold"),
    (lambda points: points[8].update(closed_by_young=1.0395), "holds again"),
    (lambda points: points[8].update(closed_by_young=1.0425), "is known not to hold, but to lie within"),
    (lambda points: points[0].update(problems=["a mechanism"]), "a mechanism"),
    (lambda points: [point.update({"interaction ratio": 1.05}) for point in points], "not looked at"),
])
def test_a_check_of_elastic_constants_that_fails_is_an_error(elastic, monkeypatch, change, message):
    on_record = json.loads((ROOT / "validation/results/elastic.json").read_text())["dynamics"]
    change(on_record["points"])
    elastic.RESULTS.write_text(json.dumps({"dynamics": on_record}))
    monkeypatch.setattr("sys.argv", ["elastic.py", "--full", "--only", "dynamics"])
    if message is None:
        elastic.main()
    else:
        with pytest.raises(SystemExit, match=message):
            elastic.main()


def test_verdicts_on_record_are_those_of_the_points_on_record():
    module = study("elastic")
    for name, result in json.loads((ROOT / "validation/results/elastic.json").read_text()).items():
        verdicts = module.checks(name, result["points"])
        assert verdicts == result["checks"] and not module.failures(name, result["points"], verdicts), name


def test_a_program_of_another_commit_gives_no_figures_for_the_record(elastic, tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "of_tree", lambda: "b" * 40)
    monkeypatch.setattr(provenance, "of_program", lambda program: "a" * 40)
    monkeypatch.setattr("sys.argv", ["elastic.py", "--full", "--only", "ratios"])
    with pytest.raises(SystemExit, match="a{40}.*b{40}.*cargo build"):
        elastic.main()
    assert not elastic.RESULTS.exists()
    # changes that are not committed are in the label
    monkeypatch.setattr(provenance, "of_program", lambda program: "b" * 40 + "+changes")
    assert provenance.label("program") == "b" * 40 + "+changes"


def test_the_commit_of_a_program_is_read_from_its_results():
    need("concordem")
    from concordem_validate.engines import concordem
    assert re.fullmatch(r"[0-9a-f]{40}(\+changes)?|working", provenance.of_program(concordem.program()))
    assert re.fullmatch(r"[0-9a-f]{40}(\+changes)?", provenance.of_tree())


@pytest.mark.parametrize("target", ["test", "validate-full"])
def test_every_command_of_make_takes_a_missing_peer_for_a_failure(tmp_path, target):
    """make is given a shell that writes down what it would run, and with which CI."""
    log = tmp_path / "log"
    recorder = script(tmp_path / "shell", f'#!/bin/sh\necho "CI=$CI $*" >> {log}\n')
    environment = {name: value for name, value in os.environ.items() if name not in ("CI", "MAKEFLAGS", "MAKELEVEL")}
    subprocess.run(["make", "-s", f"SHELL={recorder}", target], cwd=ROOT, env=environment, check=True)
    lines = log.read_text().splitlines()
    assert len(lines) > 9 and all(line.startswith("CI=1 ") for line in lines), lines
