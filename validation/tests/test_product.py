"""The harness as a stranger uses it: own engines by command, in Python, and from a package; own cases; pytest; published formats."""
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from concordem_validate import case as cases
from concordem_validate import cli, mutate, project, registry, report, rounds, runner, start, starter
from concordem_validate.engines import command, concordem, lammps
from concordem_validate.errors import HarnessError, NotInstalled, Unsupported
from conftest import CASE, SCENARIO, Fake, judged, need

PACKAGE = Path(cli.__file__).parent


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """The files of `init`, without ConcorDEM."""
    monkeypatch.setenv(concordem.VARIABLE, "/nowhere/concordem")
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.chdir(tmp_path)
    starter.write(tmp_path)
    case = tmp_path / "cases/collision/case.toml"
    case.write_text(case.read_text().replace('"yade", "concordem"', '"concordem"', 1).replace('["yade", "concordem"]', '["concordem"]'))
    yield tmp_path
    registry.ENGINES.pop("mine", None)


def test_init_gives_a_round_that_agrees_without_our_program(mine, capsys):
    assert cli.main(["run"]) == rounds.AGREES
    out = capsys.readouterr().out
    assert "1 agrees" in out and "1 not installed" in out and "ConcorDEM is not installed" in out
    assert cli.main(["lint"]) == rounds.AGREES
    assert (mine / ".github/workflows/validate.yml").exists() and (mine / ".gitlab-ci.yml").exists()
    # a project gets the workflow files that it lacks, and keeps the rest
    (mine / ".gitlab-ci.yml").unlink()
    (mine / "mine.py").write_text("# mine")
    assert {line.split()[0] for line in starter.write(mine)} == {"kept", "wrote", "next:"}
    assert (mine / ".gitlab-ci.yml").exists() and (mine / "mine.py").read_text() == "# mine"
    (mine / "validate.toml").unlink()
    with pytest.raises(HarnessError, match="exists already"):
        starter.write(mine)


@pytest.mark.parametrize("old, new, cause", [
    ("k * overlap", "1.01 * k * overlap", None), ("steps + 1", "steps // 2", "short"), ("repr(c)", "'nan'", "nan"), ("sys.exit(77)", "sys.exit(77)", ""),
    ('out.writerow(["1", "s"]', 'out.writerow(["1", "ms"]', "error"), ("import csv", "import csv, nothing", "crashed"),
    ("    for step in range", "    sys.exit(0)\n    for step in range", "empty"), ("import csv", "import time; time.sleep(6000)\nimport csv", "timeout"),
])
def test_mistakes_of_a_users_engine_are_verdicts(mine, old, new, cause):
    path = mine / "mine.py"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    made = project.load()
    case = cases.load("collision", mine / "cases").only(["main"], ["analytic"])
    case.time_limit = 2.0 if cause == "timeout" else 20.0
    round_ = runner.Runner(made.output, quiet=True).run([case])
    verdict = next(v for v in round_.verdicts)
    if cause is None:
        # equal spheres exchange their velocities with any spring: the closed form cannot see it
        assert verdict.status == "pass"
    elif cause == "":
        assert verdict.status == "pass"
    else:
        assert (verdict.status, verdict.cause) == ("fail", cause), verdict.message


def test_an_engine_may_refuse_a_scenario(mine):
    made = project.load()
    scenario = mine / "cases/collision/scenario.toml"
    scenario.write_text(scenario.read_text().replace('law = "frictional"', 'law = "frictional"\n\n[bonds]\nlaw = "linear_bond"\ninteraction_ratio = 1.0'))
    round_ = runner.Runner(made.output, quiet=True).run([cases.load("collision", mine / "cases").only(["main"], ["analytic"])])
    outcome = round_.outcomes["collision", "main", "mine"]
    assert outcome.status == "skipped" and "only linear springs" in outcome.message
    assert [v.status for v in round_.verdicts] == ["skipped"] and round_.counts()["fail"] == 0 and round_.exit_code(False) == rounds.NOTHING_CHECKED


def test_what_an_engine_depends_on_is_hashed(mine):
    engine = lambda: project.load() and registry.ENGINES["mine"].version()
    one = engine()
    assert engine() == one
    (mine / "mine.py").write_text((mine / "mine.py").read_text() + "\n")
    assert engine() != one


def test_the_task_has_the_published_format(mine, no_page, tmp_path):
    jsonschema = pytest.importorskip("jsonschema")
    project.load()
    task = cases.load("collision", mine / "cases").tasks[0]
    task.start = start.state(task.scenario, task.folder)
    data = command.task_data(task)
    jsonschema.validate(data, json.loads((PACKAGE / "schema/task-1.json").read_text()))
    assert data["mass"] == pytest.approx([2500 * 4 / 3 * np.pi * 1e-9] * 2) and data["scenario"]["material"][0]["density"] == 2500.0
    assert data["velocity"] == [[1, 0, 0], [0, 0, 0]] and data["steps"] == 2000 and data["time_step"] == 0.5e-6
    command.write_state(tmp_path / "state.h5", data)
    with h5py.File(tmp_path / "state.h5") as file:
        assert file["mass"].attrs["unit"] == "kg" and json.loads(file.attrs["task"])["steps"] == 2000
    assert cli.main(["run", "--json", str(tmp_path / "r.json")]) == rounds.AGREES
    jsonschema.validate(json.loads((tmp_path / "r.json").read_text()), json.loads((PACKAGE / "schema/round-1.json").read_text()))


@pytest.mark.parametrize("text, said", [
    ("cases = [", "validate.toml: "), ('cases = "cases"', "validate.toml:1: `cases` is 'cases'; give a list"),
    ('folders = ["a"]', "validate.toml:1: unknown key folders"), ('cases = ["none"]', "validate.toml:1: there is no folder"),
    ("[engine.mine]\ninputs = []", "validate.toml:1: engine `mine` has no `command`"),
    ('[engine.mine]\ncommand = "./mine"', "validate.toml:2: engine `mine`: `command` has no {output}"),
    ('[engine.mine]\ncommand = 3', "validate.toml:2: `command` is 3; give text or a list"),
    ('[engine.mine]\ncommand = "a {output}"\noutput = "vtk"', "validate.toml:3: `output` is `vtk`; use csv or hdf5"),
    ('[engine.yade]\ncommand = "a {output}"', "the engine `yade` exists already"),
    ('require = ["nobody"]', "validate.toml:1: unknown engine `nobody`"),
])
def test_bad_projects_are_told_with_file_and_line(tmp_path, monkeypatch, capsys, text, said):
    (tmp_path / "cases").mkdir()
    (tmp_path / "validate.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    try:
        assert cli.main(["list"]) == rounds.WRONG_INPUT
    finally:
        registry.ENGINES.pop("mine", None)
    message = capsys.readouterr().err
    assert said in message and len(message.splitlines()) == 1, message


def test_missing_programs_and_inputs_are_told(tmp_path):
    engine = command.CommandEngine("mine", tmp_path, "no-such-program {task} {output}")
    with pytest.raises(NotInstalled, match="`no-such-program` of engine `mine` is missing"):
        engine.version()
    engine = command.CommandEngine("mine", tmp_path, "python3 {task} {output}", inputs=["src/*.cpp"])
    with pytest.raises(HarnessError, match="no file matches `src/"):
        engine.version()


@pytest.mark.parametrize("change, said", [
    (("[[check]]", "[[check"), "case.toml: "), (('peer = "two"', 'peer = "four"'), "case.toml:9: check `force`: `four` is not one of"),
    (("tolerance = 1e-3", 'tolerance = "small"'), "case.toml:11: `tolerance` is 'small'; give a number"),
    (('kind = "series"', 'kind = "curve"'), "case.toml:8: check `force`: `kind` is `curve`"), (('title = "t"', ""), "`title` is missing"),
    (('reference = "one"', 'reference = "none"'), "unknown engine `none`"), (('of = "force"\n', ""), "`of` is missing"),
    (('engines = ["two", "three"]', 'engines = ["two", "three"]\ntier = "slow"'), "case.toml:6: `slow` is not a tier"),
])
def test_bad_cases_are_told_with_file_and_line(tmp_path, monkeypatch, capsys, change, said):
    for name in ("one", "two", "three"):
        monkeypatch.setitem(registry.ENGINES, name, Fake(name))
    (tmp_path / "c/small").mkdir(parents=True)
    (tmp_path / "c/small/scenario.toml").write_text(SCENARIO)
    assert change[0] in CASE
    (tmp_path / "c/small/case.toml").write_text(CASE.replace(*change, 1))
    assert cli.main(["run", "--cases", str(tmp_path / "c")]) == rounds.WRONG_INPUT
    message = capsys.readouterr().err
    assert said in message and len(message.splitlines()) == 1, message


@pytest.mark.parametrize("name, text, said", [
    ("scenario.toml", None, "scenario.toml does not exist"), ("scenario.toml", "version = ", "scenario.toml: Invalid value"),
    ("case.py", "import nothing_of_this_name", "case.py cannot be loaded: ModuleNotFoundError"),
    ("case.py", "def scenario(document):\n    return document['no']\n", "scenario() failed for variant main: KeyError"),
    ("../quirks.toml", "[a]\nengine = 1\n", "quirks.toml:2: `engine` is 1; give text"),
])
def test_bad_files_of_a_case_are_told(tmp_path, monkeypatch, capsys, name, text, said):
    for engine in ("one", "two", "three"):
        monkeypatch.setitem(registry.ENGINES, engine, Fake(engine))
    place = tmp_path / "c/small"
    place.mkdir(parents=True)
    (place / "scenario.toml").write_text(SCENARIO)
    (place / "case.toml").write_text(CASE)
    (place / name).unlink(missing_ok=True) if text is None else (place / name).write_text(text)
    assert cli.main(["run", "--cases", str(tmp_path / "c")]) == rounds.WRONG_INPUT
    assert said in capsys.readouterr().err


def test_engines_of_packages_are_found(monkeypatch):
    class Point:
        name, value = "theirs", "their_package:engine"

        @staticmethod
        def load():
            return Fake("theirs")

    monkeypatch.setattr(registry.metadata, "entry_points", lambda group: [Point] if group == registry.GROUP else [])
    try:
        registry.load_packages()
        assert registry.ENGINES["theirs"].version() == "theirs 1"
    finally:
        registry.ENGINES.pop("theirs", None)

    class Broken(Point):
        @staticmethod
        def load():
            raise ImportError("no module")

    monkeypatch.setattr(registry.metadata, "entry_points", lambda group: [Broken])
    with pytest.raises(HarnessError, match="entry point theirs = their_package:engine: cannot be loaded: ImportError"):
        registry.load_packages()


def test_start_states_without_a_program_are_complete_or_refused(tmp_path):
    task = next(t for t in cases.load("chain-waves").tasks if t.variant == "long-wave")
    own = start.state(task.scenario, task.folder)
    assert len(own.bonds) == 15 and own.dt == 1e-6 and own.velocity[5, 0] > 0
    dense = next(iter(cases.load("cpm-cell").tasks))
    with pytest.raises(Unsupported, match="generated by ConcorDEM"):
        start.state(dense.scenario, dense.folder)
    rows = next(t for t in cases.load("ddem-rows").tasks)
    # the closed form, where there is one
    assert abs(start.state(rows.scenario, rows.folder).dt / 1.0203415e-7 - 1) < 1e-7
    rows.scenario["contacts"] = {"law": "frictional"}
    with pytest.raises(Unsupported, match="the automatic time step is not computed here"):
        start.state(rows.scenario, rows.folder)


def test_a_scenario_that_our_program_does_not_know_still_runs_elsewhere(mine, monkeypatch):
    monkeypatch.delenv(concordem.VARIABLE)
    need("concordem")
    scenario = mine / "cases/collision/scenario.toml"
    scenario.write_text(scenario.read_text().replace("version = 1", "version = 1\n[my_physics]\nmagnetism = 3"))
    made = project.load()
    case = cases.load("collision", mine / "cases")
    round_ = runner.Runner(made.output, quiet=True).run([case.only(["main"], ["analytic"])])
    assert {v.status for v in round_.verdicts} == {"pass"}, [v.message for v in round_.verdicts]
    # where a case asks for it, our program says that it does not know it
    round_ = runner.Runner(made.output, quiet=True).run([case.only(["main"], ["concordem"])])
    assert round_.outcomes["collision", "main", "concordem"].status == "crashed"


def test_pytest_has_a_test_for_each_check(mine):
    ran = subprocess.run([sys.executable, "-m", "pytest", "-p", "concordem_validate.pytest_plugin", "--concordem-cases", "cases", "-v", "-p", "no:cacheprovider"],
                         cwd=mine, capture_output=True, text=True, env={"PYTHONPATH": str(PACKAGE.parent), "PATH": "/usr/bin:/bin", "CONCORDEM": "/nowhere"})
    assert ran.returncode == 0 and "1 passed, 1 skipped" in ran.stdout, ran.stdout + ran.stderr
    assert "collision::main::velocities afterwards::mine-analytic" in ran.stdout
    (mine / "mine.py").write_text((mine / "mine.py").read_text().replace("steps + 1", "steps // 2"))
    ran = subprocess.run([sys.executable, "-m", "pytest", "-p", "concordem_validate.pytest_plugin", "--concordem-cases", "cases", "-q"],
                         cwd=mine, capture_output=True, text=True, env={"PYTHONPATH": str(PACKAGE.parent), "PATH": "/usr/bin:/bin", "CONCORDEM": "/nowhere"})
    assert ran.returncode == 1 and re.search(r"ends at time [\d.e-]+, but the run at 0.001", ran.stdout), ran.stdout + ran.stderr


def test_the_example_of_kratos_refuses_by_name_what_it_does_not_know(tmp_path):
    adapter = PACKAGE.parent / "examples/kratos/kratos.py"
    task = next(t for t in cases.load("chain-waves").tasks)
    task.start = start.state(task.scenario, task.folder)
    (tmp_path / "task.json").write_text(json.dumps(command.task_data(task)))
    ran = subprocess.run([sys.executable, adapter, "task.json", "out.csv"], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == command.UNSUPPORTED and ran.stdout.startswith("kratos: no translation of bonds, prescribe")
    # the example case itself is whole
    made = project.load(adapter.with_name("validate.toml"))
    try:
        case = cases.load("impact", made.roots[0])
        assert len(case.checks) == 7 and case.reference == "kratos"
    finally:
        for name in [n for n in registry.ENGINES if n.startswith("kratos")]:
            registry.ENGINES.pop(name)


def test_the_example_of_lammps_has_bonds_through_the_public_interface(tmp_path, monkeypatch):
    folder = PACKAGE.parent / "examples/lammps"
    need("lammps", "concordem")
    shutil.copytree(folder, tmp_path / "lammps")
    monkeypatch.chdir(tmp_path / "lammps")
    monkeypatch.setenv("PATH", f"{lammps._program().parent}:{os.environ['PATH']}")
    try:
        made = project.load()
        case = cases.load("chain", made.roots[0]).only(["elastic", "breaks"], ["concordem"])
        round_ = runner.Runner(tmp_path / "out", quiet=True).run([case])
        assert [v.status for v in round_.verdicts] == ["pass", "pass"], [v.message for v in round_.verdicts]
        # the chain breaks: its end is elsewhere than in the elastic one
        ends = [round_.outcomes["chain", v, "lammps-bonds"].result().series["position"].values[-1, -1, 0] for v in ("elastic", "breaks")]
        assert ends[1] - ends[0] > 1e-4
        # a bond 5 % too strong breaks some steps later
        path = Path("bonds.py")
        path.write_text(path.read_text().replace("strain = strength /", "strain = 1.05 * strength /"))
        case = cases.load("chain", project.load().roots[0]).only(["breaks"], ["concordem"])
        assert [v.cause for v in runner.Runner(tmp_path / "out", quiet=True).run([case]).verdicts] == ["difference"]
        for change, said in ((dict(linear_bond={"normal_stiffness": 1e5, "shear_stiffness": 1.0}), "no shear spring"),
                             (dict(linear_bond={"normal_stiffness": 1e5, "damping_ratio": 0.1}), "the law's damping_ratio")):
            task = case.tasks[0]
            task.scenario["material"][0].update(change)
            task.start = start.state(task.scenario, task.folder)
            Path("task.json").write_text(json.dumps(command.task_data(task)))
            ran = subprocess.run([sys.executable, "bonds.py", "task.json", "out.csv"], capture_output=True, text=True)
            assert ran.returncode == command.UNSUPPORTED and said in ran.stdout, ran.stdout + ran.stderr
    finally:
        registry.ENGINES.pop("lammps-bonds", None)


@pytest.mark.skipif(not os.environ.get("CONCORDEM_LONG"), reason="long: make test-full")
def test_the_wheel_works_without_the_sources(tmp_path):
    shutil.copytree(PACKAGE.parent, tmp_path / "sources", ignore=shutil.ignore_patterns("__pycache__", "tests", "results", "build", "*.egg-info"))
    python = tmp_path / "venv/bin/python"
    for words in ([sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", tmp_path / "wheel", tmp_path / "sources"],
                  [sys.executable, "-m", "venv", tmp_path / "venv"]):
        subprocess.run(words, check=True)
    subprocess.run([python, "-m", "pip", "install", "-q", next((tmp_path / "wheel").glob("*.whl"))], check=True)
    program = tmp_path / "venv/bin/concordem-validate"
    run = lambda *words: subprocess.run([program, *words], cwd=tmp_path, capture_output=True, text=True, env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)})
    assert len(cases.names()) == sum(" variants, " in line for line in run("list").stdout.splitlines())
    assert run("init", "mine").returncode == 0
    done = subprocess.run([program, "run"], cwd=tmp_path / "mine", capture_output=True, text=True, env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)})
    assert done.returncode == rounds.AGREES, done.stdout + done.stderr
    # our cases without our program: nothing is checked, and that is said
    assert run("run", "lattice-elasticity").returncode == rounds.NOTHING_CHECKED


# checks without a peer


@pytest.fixture
def alone(mine):
    """A case in which the engine is compared with itself on scenarios that must give the same answer."""
    case = mine / "cases/collision/case.toml"
    text = case.read_text()
    head = text[:text.index("[[check]]")].replace('["analytic", "concordem"]', '["mine@rotated", "mine@renumbered", "mine@half-step", "mine@twin", "analytic"]')
    rows = [("rotated", 1e-13), ("renumbered", 1e-13), ("half-step", 2e-3), ("twin", 1e-12)]
    case.write_text(head.replace('["analytic", "yade", "concordem"]', '["mine@rotated"]') + "".join(
        f'[[check]]\nname = "{kind}"\nkind = "series"\npeer = "mine@{kind}"\nof = "position"\nscale = "displacement"\ntolerance = {limit}\n'
        f'reason = "the same answer but for rounding, or the error of the step"\n' for kind, limit in rows)
        + '[[check]]\nname = "velocities"\nkind = "scalar"\npeer = "analytic"\nof = "velocities"\ntolerance = 2.5e-3\nreason = "as in the template"\n')
    return mine


def test_an_engine_is_checked_without_a_peer(alone):
    made = project.load()
    round_ = runner.Runner(made.output, quiet=True).run([cases.load("collision", alone / "cases")])
    assert {v.status for v in round_.verdicts} == {"pass"} and len(round_.verdicts) == 5, [(v.check.name, v.message, v.difference) for v in round_.verdicts]
    found = {v.check.name: v.difference for v in round_.verdicts}
    assert found["half-step"] > 1e-5, "half the step must be seen"
    # a code whose x axis is stiffer is found by no closed form along x, but by turning
    path = alone / "mine.py"
    path.write_text(path.read_text().replace("push = k * overlap", "push = (k if i == 0 else 0.5 * k) * overlap"))

    round_ = runner.Runner(project.load().output, quiet=True).run([cases.load("collision", alone / "cases")])
    assert [v.check.name for v in round_.verdicts if v.status == "fail"] == ["rotated"]
    for kind in ("mine@mirrored", "nobody@twin"):
        (alone / "cases/collision/case.toml").write_text((alone / "cases/collision/case.toml").read_text().replace("mine@twin", kind))
        with pytest.raises(HarnessError):
            cases.load("collision", alone / "cases")


SPRING = """import json, os, pickle, sys
first, task_file, output, checkpoint = sys.argv[1:]
task = json.load(open(task_file))
dt, k = task["time_step"], 4e4
x, v, slow = (pickle.load(open(checkpoint, "rb")) if first == "again" else (1e-3, 0.0, 0.0))
begin = task["steps"] // 2 + 1 if first == "again" else 0
rows = []
for step in range(begin, task["steps"] + 1):
    if step % task["snapshot_interval"] == 0:
        rows.append(f"{step},{x!r}")
    slow += 0.01 * (x - slow)   # a history
    v -= k * (x - 0.5 * slow) * dt
    x += v * dt
pickle.dump(KEPT, open(checkpoint, "wb"))
open(output, "w").write("\\n".join(["step,x", "1,m", *rows]))
"""


@pytest.fixture
def spring(tmp_path, monkeypatch):
    """A code with a history, and a case that stops and continues it; returns what judges it."""
    monkeypatch.setenv(concordem.VARIABLE, "/nowhere/concordem")
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "cases/spring"
    place.mkdir(parents=True)
    (place / "scenario.toml").write_text(SCENARIO)
    (place / "case.toml").write_text(
        'title = "t"\nquestion = "q"\nsource = "s"\nreference = "spring"\nengines = ["spring@restart"]\n[[check]]\nname = "restart"\nkind = "series"\n'
        'peer = "spring@restart"\nof = "x"\ntolerance = 1e-14\nreason = "the same bits, written in full"\n')

    def verdict(kept="(x, v, slow)", restart='restart = "python3 spring.py again {task} {output} {checkpoint}"', command="{checkpoint}", change=None):
        (tmp_path / "spring.py").write_text((change or (lambda text: text))(SPRING.replace("KEPT", kept)))
        (tmp_path / "validate.toml").write_text(f'[engine.spring]\ncommand = "python3 spring.py first {{task}} {{output}} {command}"\n{restart}\n')
        made = project.load()
        registry.ENGINES.pop("spring@restart", None)
        round_ = runner.Runner(made.output, quiet=True).run([cases.load("spring", made.roots[0])])
        return round_.verdicts[0]

    yield verdict
    for name in ("spring", "spring@restart"):
        registry.ENGINES.pop(name, None)


def test_a_restart_is_checked_for_any_command(spring):
    assert (spring().status, spring().difference) == ("pass", 0.0)
    # a history, or a velocity, that is not stored
    for kept in ("(x, v, 0.0)", "(x, 0.0, slow)"):
        assert spring(kept).cause == "difference"
    # a step too many
    assert spring(change=lambda text: text.replace("// 2 + 1 if", "// 2 if")).cause == "difference"
    # what the second part begins with late, or leaves out
    assert spring(change=lambda text: text.replace("// 2 + 1 if", "// 2 + 31 if")).cause in ("short", "error", "difference")
    assert spring(change=lambda text: text.replace('["step,x", "1,m", *rows]', '["step,y" if first == "again" else "step,x", "1,m", *rows]')).cause == "error"


def test_an_engine_that_cannot_restart_says_so(spring, engines):
    verdict = spring(restart="")
    assert verdict.status == "fail" and "has no command `restart`; add it to validate.toml" in verdict.message
    missing = spring(change=lambda text: text.replace("pickle.dump", "0 and pickle.dump"))
    assert missing.status == "fail" and "without writing {checkpoint}" in missing.message, missing.message
    with pytest.raises(HarnessError, match="validate.toml:.*`command` has no {checkpoint}"):
        spring(command="x")
    with pytest.raises(HarnessError, match="`restart` has no {output}"):
        spring(restart='restart = "python3 spring.py {checkpoint}"')
    registry.know("one@restart")
    task = cases.Task("c", "v", Path("."), {"stop": {"steps": 100}, **{}}, None, start=start.state(__import__("tomllib").loads(SCENARIO), Path(".")))
    with pytest.raises(Unsupported, match="cannot stop and continue one; give it a function"):
        registry.ENGINES.pop("one@restart")._run(task, Path("."), 1)


def test_twins_set_the_window_of_a_chaotic_run(tmp_path, monkeypatch):
    """The logistic map doubles a difference at each step: 1e-16 is 1 after some fifty."""
    from concordem_validate.result import Result

    class Chaos(Fake):
        def run(self, task, folder, limit):
            x, places = 0.3 + 1e3 * (task.start.position[-1, 0] - 3e-3), []
            for step in range(101):
                places.append(x)
                # another rounding in the second engine
                x = 4 * x * (1 - x) if self.NAME == "one" else 4 * x - 4 * x * x
                if self.change and step >= 20:
                    x = self.change(x)
            result = Result(self.NAME, 1e-3)
            result.add("x", range(101), places, "1")
            return result

    monkeypatch.setenv(concordem.VARIABLE, "/nowhere/concordem")
    for name in ("one", "two"):
        monkeypatch.setitem(registry.ENGINES, name, Chaos(name))
    place = tmp_path / "cases/chaos"
    place.mkdir(parents=True)
    (place / "scenario.toml").write_text(SCENARIO)
    text = ('title = "t"\nquestion = "q"\nsource = "s"\nreference = "one"\nengines = ["two"]\n[[check]]\nname = "x"\nkind = "series"\npeer = "two"\nof = "x"\n'
            'tolerance = 1e-9\nreason = "rounding until twins part"\n')

    def verdict(more):
        (place / "case.toml").write_text(text + more)
        return runner.Runner(tmp_path / "out", quiet=True).run([cases.load("chaos", tmp_path / "cases")]).verdicts[0]

    assert verdict("").status == "fail"
    good = verdict("twin = 100\n")
    assert good.status == "pass" and "twins part" in good.message, good.message
    # a mistake before the twins part is found
    registry.ENGINES["two"].change, registry.ENGINES["two"].number = lambda x: x * (1 + 1e-6), "2"
    assert verdict("twin = 100\n").cause == "difference"


def test_planted_mistakes_show_what_the_cases_cannot_see(mine, no_page, capsys):
    assert cli.main(["mutate", "--engine", "mine"]) == rounds.FAILED
    out = capsys.readouterr().out
    # equal spheres exchange their velocities whatever their mass, radius, and stiffness are
    assert "no check sees mass 1% too large" in out and "normal_stiffness 1% too large" in out
    assert "no check sees velocity" not in out
    # the spheres do not spin: a mistake that changes nothing is not one that a check has missed
    assert "no check sees angular_velocity" not in out and "no case can show angular_velocity 1% too large" in out
    assert registry.ENGINES["mine"].__class__ is command.CommandEngine


def test_mistakes_are_planted_in_every_variant_that_has_the_number(folder, engines):
    """A variant without a key is no failure, which would count as a mistake that was seen."""
    (folder / "cases/small/case.toml").write_text(
        CASE + '[[variant]]\nname = "plain"\n[[variant]]\nname = "soft"\nchanges = { "material.0.frictional" = { normal_stiffness = 1e5 } }\n')
    case = cases.load("small", folder / "cases")
    # of our fakes nothing depends on the task, so no mistake is seen
    unseen, seen, idle = mutate.survivors(case, "two", lambda: runner.Runner(folder / "out", quiet=True))
    assert "material.0.frictional.normal_stiffness 1% too large" in unseen and not seen
    assert idle == ["velocity 1% too large", "angular_velocity 1% too large"]


def plus(size):
    """A force that is larger by a constant."""
    def apply(result):
        result.series["force"].values = result.series["force"].values + size
    return apply


def write_case(folder, checks, engines='["two"]'):
    (folder / "cases/small/case.toml").write_text(
        f'title = "t"\nquestion = "q"\nsource = "s"\nreference = "one"\nengines = {engines}\n' + checks)


def timed(wall, change=None):
    """A run that takes so many seconds; a function is asked at each run."""
    def apply(result):
        result.numbers["wall_s"] = wall() if callable(wall) else wall
        if change:
            result.series["force"].values[4] = np.nextafter(result.series["force"].values[4], 9)
    return apply


def test_bits_and_speed_are_checks(folder, engines):
    write_case(folder, '[[check]]\nname = "bits"\nkind = "bits"\npeer = "two"\nreason = "the same code"\n'
                       '[[check]]\nname = "speed"\nkind = "speed"\npeer = "two"\ntolerance = 1.05\nreason = "a step gets no slower"\n')
    statuses = lambda: {v.check.name: v.status for v in judged(folder).verdicts}
    engines["one"].change, engines["two"].change = timed(1.04), timed(1.0)
    assert statuses() == {"bits": "pass", "speed": "pass"}
    engines["one"].change, engines["one"].number = timed(1.06, True), "2"
    assert statuses() == {"bits": "fail", "speed": "fail"}
    assert "rounding" in next(v.message for v in judged(folder).verdicts if v.check.name == "bits")


def test_a_check_with_its_own_reference_stays_about_it(folder, engines):
    write_case(folder, '[[check]]\nname = "force"\nkind = "series"\npeer = ["two", "three"]\nof = "force"\ntolerance = 1e-6\nreason = "a tolerance for tests"\n'
                       '[[check]]\nname = "others"\nkind = "series"\nreference = "two"\npeer = "three"\nof = "force"\ntolerance = 1e-9\n'
                       'reason = "a tolerance for tests"\n', '["two", "three"]')
    engines["one"].change = plus(1e-7)
    case = cases.load("small", folder / "cases")
    for changed, pairs in ((case, [("one", "two"), ("one", "three"), ("two", "three")]),
                           (case.all_pairs(), [("one", "two"), ("one", "three"), ("two", "three"), ("two", "three")]),
                           (case.with_reference("three"), [("three", "two"), ("three", "one"), ("two", "three")])):
        round_ = runner.Runner(folder / "out", quiet=True).run([changed])
        assert [(v.reference, v.peer) for v in round_.verdicts] == pairs and {v.status for v in round_.verdicts} == {"pass"}


SPEED = '[[check]]\nname = "speed"\nkind = "speed"\npeer = "two"\nband = [0.5, 1.25]\nrepeats = 3\nreason = "as fast as the other"\n'


def test_a_ratio_of_run_times_has_a_band(folder, engines, no_page):
    write_case(folder, SPEED)
    verdict = lambda: next(v for v in judged(folder).verdicts)
    engines["one"].change, engines["two"].change = timed(1.2), timed(1.0)
    good = verdict()
    assert (good.status, good.difference) == ("pass", 1.2) and "3 ratios" in good.message
    # slower, and so much faster that it cannot have done the same
    for number, (wall, ratio) in enumerate(((1.3, 1.3), (0.4, 0.4))):
        engines["one"].change, engines["one"].number = timed(wall), f"other {number}"
        bad = verdict()
        assert (bad.status, bad.cause, bad.difference) == ("fail", "difference", ratio) and "allowed are 0.5 to 1.25" in bad.message


def test_run_times_are_of_one_round_and_one_machine(folder, engines, no_page, monkeypatch):
    """The machine becomes ten times slower between the runs: each time alone is wrong, the ratio is not."""
    write_case(folder, SPEED)
    pace, order = [1.0], []

    def of(name):
        def wall():
            order.append(name)
            return pace[0]
        return wall

    engines["one"].change, engines["two"].change = timed(of("one")), timed(of("two"))
    assert not judged(folder).failed(True)
    # both once for their results, then in turn, each first as often as the other
    assert order == ["one", "two", "one", "two", "two", "one", "one", "two"]
    pace[0], engines["one"].number = 10.0, "2"
    assert judged(folder).verdicts[0].difference == 1.0, "the stored time of the other engine was taken"
    count = len(order)
    assert not judged(folder).failed(True) and len(order) == count, "times of the same runs are kept"
    # another machine times again
    monkeypatch.setattr("concordem_validate.provenance.processor", lambda: "another processor")
    judged(folder)
    assert len(order) == count + 6


@pytest.mark.parametrize("fault, said, cause", [
    (lambda result: None, "no number `wall_s`", "error"), (timed(1e-4), "too short for a ratio", "blind"), (timed(0.0), "no number `wall_s`", "error")])
def test_a_ratio_that_says_nothing_is_an_error(folder, engines, fault, said, cause):
    write_case(folder, SPEED)
    engines["one"].change, engines["two"].change = timed(1.0), fault
    verdict = judged(folder).verdicts[0]
    assert (verdict.status, verdict.cause) == ("fail", cause) and said in verdict.message


def test_a_report_knows_the_run_times_of_its_round(folder, engines, no_page, capsys):
    write_case(folder, SPEED)
    engines["one"].change, engines["two"].change = timed(1.2), timed(1.0)
    place = ["--cases", str(folder / "cases"), "--output", str(folder / "out")]
    assert cli.main(["run", *place, "small"]) == rounds.AGREES
    runs = engines["one"].runs
    assert cli.main(["report", *place]) == rounds.AGREES and engines["one"].runs == runs
    assert rounds.record(folder / "out")["times"][0]["seconds"] == [[1.2, 1.0]] * 3
    assert cli.main(["merge", str(folder / "out"), *place[:2], "--output", str(folder / "all")]) == rounds.AGREES
    # a round in which they were not timed has no ratio
    data = {**json.loads((folder / "out/round.json").read_text()), "times": []}
    # with the hash of a record that was written so
    (folder / "out/round.json").write_text(json.dumps({**data, "sha256": rounds._seal(data)}))
    assert cli.main(["report", *place]) == rounds.FAILED and "not timed in this round" in capsys.readouterr().out


@pytest.mark.parametrize("old, new, said", [
    ("[0.5, 1.25]", "[1.25, 0.5]", "give `band"), ("[0.5, 1.25]", "[0.5]", "give `band"), ("[0.5, 1.25]", "[0.5, inf]", "give a finite number"),
    ("band = [0.5, 1.25]\n", "", "give either `tolerance`"), ("repeats = 3", "repeats = 0", "give a number from 1"),
    ('kind = "speed"', 'kind = "series"\nof = "force"', "`band` is for"), ('peer = "two"', 'peer = "two"\nreference = "two"', "compared with itself"),
    ('peer = "two"', 'peer = "two"\nreference = "four"', "`four` is not one")])
def test_a_band_that_cannot_fail_is_refused(folder, engines, old, new, said):
    assert old in SPEED
    write_case(folder, SPEED.replace(old, new))
    with pytest.raises(HarnessError, match=said) as error:
        cases.load("small", folder / "cases")
    assert str(folder / "cases/small/case.toml:") in str(error.value)


def test_balances_need_no_peer(folder, engines):
    write_case(folder, "".join(f'[[check]]\nname = "{of}"\nkind = "balance"\nof = "{of}"\ntolerance = 1e-12\nreason = "rounding"\n'
                               for of in ("momentum", "angular_momentum")))

    def orbit(pull):
        """Two masses of 1 and 3 kg on a spring, leapfrog; `pull`: share of the force on the second that is left out."""
        def apply(result):
            m, dt = np.array([1.0, 3.0]), 1e-3
            x, v = np.array([[1.0, 0, 0], [-1.0, 0, 0]]), np.array([[0, 1.0, 0.2], [0, -0.4, 0]])
            xs, vs = [], []
            for step in range(101):
                if step % 10 == 0:
                    xs.append(x.copy())
                    vs.append(v.copy())
                force = -5.0 * (x[0] - x[1])
                v = v + np.array([force, -force * (1 - pull)]) / m[:, None] * dt
                x = x + v * dt
            result.fields["mass"] = (m, "kg")
            result.add("position", range(0, 101, 10), xs, "m")
            result.add("velocity", range(0, 101, 10), vs, "m/s")
        return apply

    engines["one"].change = orbit(0.0)
    assert {v.status for v in judged(folder).verdicts} == {"pass"}, [(v.message, v.difference) for v in judged(folder).verdicts]
    engines["one"].change, engines["one"].number = orbit(1e-6), "2"
    assert {v.cause for v in judged(folder).verdicts} == {"difference"}
    engines["one"].change, engines["one"].number = None, "3"
    assert {v.cause for v in judged(folder).verdicts} == {"error"}


@pytest.mark.parametrize("plane, share", [(False, 0.4), (True, 0.5)])
def test_spins_count_also_in_a_table_without_fields(folder, engines, plane, share):
    """Friction turns two spheres and slows their way past each other; CSV has no radii, so moments of inertia are those of the scenario."""
    if plane:
        path = folder / "cases/small/scenario.toml"
        path.write_text(path.read_text().replace("version = 1", "version = 1\ndimension = 2", 1))
    write_case(folder, '[[check]]\nname = "spins"\nkind = "balance"\nof = "angular_momentum"\ntolerance = 1e-12\nreason = "rounding"\n')
    task = cases.load("small", folder / "cases").tasks[0]
    mass = start.state(task.scenario, task.folder).mass

    def rubbing(inertia, word="angular_velocity"):
        def apply(result):
            dt, force = 1e-3, np.array([0.0, 1e-6, 0])
            x, v, w = np.array([[0.0, 0, 0], [3e-3, 0, 0]]), np.array([[0, 0.1, 0.0], [0, -0.1, 0]]), np.zeros((2, 3))
            samples = []
            for step in range(101):
                if step % 10 == 0:
                    samples.append((x, v, w))
                # at the middle between the spheres
                arm = 0.5 * (x[1] - x[0])
                w = w + np.array([np.cross(arm, -force)] * 2) / inertia[:, None] * dt
                v = v + np.array([-force, force]) / mass[:, None] * dt
                x = x + v * dt
            result.fields.clear()
            for name, unit, values in zip(("position", "velocity", word), ("m", "m/s", "rad/s"), zip(*samples)):
                result.add(name, range(0, 101, 10), values, unit)
        return apply

    def told(rows):
        """With the moments about each axis, as YADE has them."""
        def apply(result):
            rubbing(inertia)(result)
            result.fields["inertia"] = inertia[:, None] * rows, "kg*m^2"
        return apply

    inertia = share * mass * 1e-6
    unequal = np.array([1.0, 2.0, 1.0])
    for number, (change, status) in enumerate((
            (rubbing(inertia), "pass"), (rubbing(1.001 * inertia), "fail"), (rubbing(inertia, "other"), "fail"), (told(np.ones(3)), "pass"),
            (told(1.001 * np.ones(3)), "fail"), (told(unequal), "pass" if plane else "fail"))):
        engines["one"].change, engines["one"].number = change, str(number)
        verdict = judged(folder).verdicts[0]
        assert verdict.status == status, (number, verdict.message, verdict.difference)
        assert verdict.cause == ("" if status == "pass" else "error" if number == 5 else "difference")


def test_a_report_has_the_curves_of_each_check_and_peer(folder, engines):
    """Also of many particles, of which it shows the curves that differ most, and of more than a few checks."""
    def crowd(off):
        def apply(result):
            one = result.series["position"]
            one.values = np.concatenate([one.values + 0.01 * k for k in range(10)], axis=1)
            one.values[-1, 17, 1] += off
        return apply

    engines["one"].change, engines["two"].change, engines["three"].change = crowd(0.0), crowd(3e-9), crowd(0.0)
    more = ("force", "position", "position", "position")
    write_case(folder, "".join(f'[[check]]\nname = "{of} {k}"\nkind = "series"\npeer = ["two", "three"]\nof = "{of}"\ntolerance = 1e-6\n'
                               f'scale = "{"displacement" if of == "position" else "maximum"}"\nreason = "rounding"\n' for k, of in enumerate(more)),
               '["two", "three"]')
    round_ = judged(folder)
    assert {v.status for v in round_.verdicts} == {"pass"}, [v.message for v in round_.verdicts]
    page = report.write(folder / "report.html", [cases.load("small", folder / "cases")], round_, {}).read_text()
    wanted = [f'alt="curves of {of} {k}: one and {peer}"' for k, of in enumerate(more) for peer in ("two", "three")]
    assert [page.count(text) for text in wanted] == [1] * 8
    # sphere 17 has moved along y
    verdict = next(v for v in round_.verdicts if v.check.of == "position" and v.peer == "two")
    x, y = (v.reshape(len(v), -1) for v in verdict.values)
    names = [name for _, name in report._shown(verdict.check, verdict.values[1], x, y)]
    assert "17.y" in names and len(names) == 6


def test_a_history_has_a_curve_for_each_check(folder, engines, no_page, capsys):
    place = ["--cases", str(folder / "cases")]
    for k in range(3):
        engines["two"].change, engines["two"].number = plus(k * 4e-4), str(k)
        assert cli.main(["run", *place, "--output", str(folder / f"round-{k}"), "small"]) == (0 if k < 3 else 1)
    page = folder / "history.html"
    assert cli.main(["history", *(str(folder / f"round-{k}") for k in range(3)), "--page", str(page)]) == 0
    text = page.read_text()
    assert text.count("<svg") == 3 and "round-0" in text and text.index("· force · one and two") < text.index("· positions ·")
    assert cli.main(["history", str(folder / "round-0")]) == rounds.WRONG_INPUT


def test_shards_cover_all_cases_and_failed_cases_run_alone(folder, engines, no_page, capsys):
    for name in ("second", "third"):
        place = folder / "cases" / name
        place.mkdir()
        (place / "scenario.toml").write_text(SCENARIO)
        (place / "case.toml").write_text(CASE)
    (folder / "cases/third/case.toml").write_text(CASE.replace("tolerance = 1e-3", "tolerance = 1e-9", 1))
    engines["two"].change = plus(1e-6)
    place = ["--cases", str(folder / "cases"), "--output", str(folder / "out")]
    seen = []
    for k in (1, 2):
        cli.main(["run", *place, "--shard", f"{k}/2"])
        seen.append({o["case"] for o in rounds.record(folder / "out")["outcomes"]})
    assert seen[0] | seen[1] == {"small", "second", "third"} and not seen[0] & seen[1]
    assert cli.main(["run", *place]) == rounds.FAILED
    assert cli.main(["run", *place, "--failed"]) == rounds.FAILED
    assert {o["case"] for o in rounds.record(folder / "out")["outcomes"]} == {"third"}
    assert cli.main(["run", *place, "--shard", "3/2"]) == rounds.WRONG_INPUT
    assert cli.main(["run", *place, "--engines", "nobody"]) == rounds.WRONG_INPUT
    assert cli.main(["run", *place, "--engines", "three", "small"]) == rounds.AGREES


def test_a_projects_requirements_hold_in_ci(mine, no_page, monkeypatch):
    """A stranger's CI has not all of our engines; he says which it must have."""
    monkeypatch.setenv("CI", "true")
    assert cli.main(["run"]) == rounds.AGREES
    assert cli.main(["run", "--strict"]) == rounds.ENGINE_MISSING
    path = mine / "validate.toml"
    path.write_text(path.read_text().replace('require = ["mine"]', 'require = ["mine", "concordem"]'))
    assert cli.main(["run"]) == rounds.ENGINE_MISSING


def test_files_of_a_case_have_absolute_paths_where_our_program_runs(tmp_path):
    (tmp_path / "anvil.stl").write_text("solid x\nendsolid x\n")
    document = {"packing": {"path": "anvil.stl"}, "wall": [{"name": "anvil.stl", "shape": {"path": "anvil.stl"}}, {"shape": {"path": "none.stl"}}]}
    made = concordem._absolute(document, tmp_path)
    assert made["packing"]["path"] == made["wall"][0]["shape"]["path"] == str(tmp_path / "anvil.stl")
    assert made["wall"][0]["name"] == "anvil.stl" and made["wall"][1]["shape"]["path"] == "none.stl"


def test_decks_of_any_code_are_compared_without_a_scenario_of_ours(tmp_path, monkeypatch):
    """Two commands that read their own decks from the folder of the case; `scenario.toml` says what they like."""
    monkeypatch.setenv(concordem.VARIABLE, "/nowhere/concordem")
    place = tmp_path / "cases/fall"
    place.mkdir(parents=True)
    (place / "scenario.toml").write_text('[deck]\ngravity = "9.81 m/s^2"\n')
    (place / "deck.txt").write_text("9.81\n")
    (place / "case.toml").write_text(
        'title = "t"\nquestion = "q"\nsource = "s"\nreference = "left"\nengines = ["right"]\n[[check]]\nname = "height"\nkind = "series"\npeer = "right"\n'
        'of = "height"\nmeet = "interpolate"\ntolerance = 1e-3\nreason = "linear interpolation between points: g dt²/8 of 5 m"\n')
    for name, step, unit, size in (("left", 0.01, "m", 1), ("right", 0.0125, "mm", 1000)):
        (tmp_path / f"{name}.py").write_text(
            "import sys\ng = float(open(sys.argv[1] + '/deck.txt').read())\nwith open(sys.argv[2], 'w') as out:\n"
            f"    print('time,height', 's,{unit}', sep='\\n', file=out)\n"
            f"    for k in range(round(1 / {step}) + 1):\n        print(k * {step}, -0.5 * g * (k * {step}) ** 2 * {size}, sep=',', file=out)\n")
    (tmp_path / "validate.toml").write_text("".join(
        f'[engine.{name}]\ncommand = "python3 {name}.py {{case}} {{output}}"\nneeds_start = false\n' for name in ("left", "right")))
    monkeypatch.chdir(tmp_path)
    try:
        assert cli.main(["run"]) == rounds.AGREES
        # the deck is an input
        key = {o["path"] for o in rounds.record(tmp_path / "concordem-validate")["outcomes"]}
        (place / "deck.txt").write_text("1.62\n")
        assert cli.main(["run"]) == rounds.AGREES
        assert not key & {o["path"] for o in rounds.record(tmp_path / "concordem-validate")["outcomes"]}
    finally:
        for name in ("left", "right"):
            registry.ENGINES.pop(name, None)
