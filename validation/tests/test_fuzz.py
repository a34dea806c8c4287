"""Files with a small mistake: each is refused in one sentence that names the file, or means what it says. None ends in a traceback."""
import os
import random
import tomllib

import mutations
import pytest
from concordem_validate import cli, project, registry, rounds
from concordem_validate.errors import HarnessError
from concordem_validate.result import Result
from conftest import CASE, SCENARIO, sound

SEEDS = range(200 if os.environ.get("CONCORDEM_LONG") else 25)
MORE = '''
[[check]]
name = "number"
kind = "scalar"
peer = "two"
of = "peak"
scale = "sum"
tolerance = 1e-3
reason = "r"
[[check]]
name = "window"
kind = "series"
peer = ["two", "three"]
of = "force"
over = "time"
norm = "l2"
from = "10 ms"
to = 0.09
tolerance = 1e-3
reason = "r"
[[variant]]
name = "main"
changes = { "material.0.density" = 2400 }
'''
PROJECT = '''cases = ["cases"]
reference = "mine"
require = ["mine", "two"]

[engine.mine]
command = "python3 a.py {task} {output}"
version = "python3 --version"
inputs = ["*.py"]
output = "csv"
environment = { A = "1" }

[engine.other]
command = ["python3", "a.py", "{output}", "{checkpoint}"]
restart = "python3 a.py again {output} {checkpoint}"
'''
QUIRK = '''[mine]
engine = "one"
title = "t"
what = "w"
source = "s"
effect = "e"
aligned = "no"
cases = ["small"]
until = 2030-01-01
'''
CSV = "step,time,force,position.0.x,position.0.y,position.0.z\n1,ms,kN,mm,mm,mm\n0,0,0,0,0,0\n10,0.01,0.2,0.1,0,0\n20,0.02,0.3,0.1,0,0\n"


def one_sentence(text, file):
    text = text.removeprefix("concordem-validate: ").strip()
    assert str(file) in text and "\n" not in text and "Traceback" not in text, text


@pytest.fixture
def run(folder, engines, no_page, capsys, monkeypatch):
    """The exit code of a round of the case `small`, and what it said."""
    monkeypatch.delenv("CI", raising=False)
    (folder / "cases/small/case.py").write_text("def measures(task, result):\n    return {'peak': float(result.series['force'].values.max())}\n")
    (folder / "cases/small/case.toml").write_text(CASE + MORE)

    def apply(command="run", *arguments):
        code = cli.main([command, "--cases", str(folder / "cases"), "--output", str(folder / "out"), *arguments])
        shown = capsys.readouterr()
        assert "internal error" not in shown.out + shown.err, shown.err
        return code, shown.err
    return apply


def keys_of(value):
    """All keys of a document."""
    if isinstance(value, dict):
        return set(value) | {key for item in value.values() for key in keys_of(item)}
    return {key for item in value for key in keys_of(item)} if isinstance(value, list) else set()


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name, text", [("case.toml", CASE + MORE), ("scenario.toml", SCENARIO)])
def test_a_mistake_in_a_case(folder, run, name, text, seed):
    path, (new, mistake) = folder / "cases/small" / name, mutations.mutated(text, seed)
    path.write_text(new)
    code, said = run("run", "small")
    if code == rounds.WRONG_INPUT:
        # a change of a variant may miss what the scenario has lost
        one_sentence(said, path.parent)
    else:
        assert code in (rounds.AGREES, rounds.FAILED, rounds.NOTHING_CHECKED)
        # no misspelled key is ignored
        assert mistake != "key" or keys_of(tomllib.loads(new)) == keys_of(tomllib.loads(text))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mistake_in_a_quirk(folder, run, seed):
    path = folder / "cases/quirks.toml"
    path.write_text(mutations.mutated(QUIRK, seed)[0])
    code, said = run("run", "small")
    if code != rounds.AGREES:
        one_sentence(said, path)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mistake_in_a_record_is_never_read(folder, run, seed):
    assert run("run", "small")[0] == rounds.AGREES
    path = folder / "out" / rounds.RECORD
    old = path.read_text()
    new = mutations.mutated(old, seed)[0]
    path.write_text(new)
    code, said = run("report")
    if code == rounds.WRONG_INPUT:
        one_sentence(said, path)
    else:
        # the same content in another order, or a line twice
        assert code == rounds.AGREES and sorted(set(new.split("\n"))) == sorted(set(old.split("\n")))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mistake_in_the_engines(folder, engines, monkeypatch, seed):
    known = registry.ENGINES
    monkeypatch.setattr(registry, "ENGINES", dict(known))
    path = folder / "validate.toml"
    (folder / "a.py").write_text("print(1)")
    path.write_text(mutations.mutated(PROJECT, seed)[0])
    try:
        project.load(path)
        for name in registry.ENGINES.keys() - known.keys():
            registry.ENGINES[name].version()
    except HarnessError as error:
        one_sentence(str(error), path)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mistake_in_a_table_of_results(tmp_path, seed):
    path = tmp_path / "result.csv"
    path.write_text(mutations.mutated(CSV, seed)[0])
    try:
        read = Result.read(path, 1e-6)
    except HarnessError as error:
        one_sentence(str(error), path)
    else:
        # a misspelled series is another series, which a check then misses; steps and times are never misspelled
        assert not read.series.keys() & {"step", "time"} and len(read.series) <= 3


@pytest.mark.parametrize("seed", SEEDS)
def test_a_damaged_result_is_never_read(tmp_path, seed):
    chance, path = random.Random(seed), tmp_path / "result.h5"
    sound().write(path)
    data = bytearray(path.read_bytes())
    if seed % 3 == 0:
        data = data[:chance.randrange(len(data))]
    else:
        for at in chance.sample(range(len(data)), chance.choice([1, 4, 64])):
            data[at] ^= 1 << chance.randrange(8)
    path.write_bytes(data)
    with pytest.raises(HarnessError) as caught:
        Result.read(path)
    one_sentence(str(caught.value), path)


@pytest.mark.parametrize("change, message", [
    ('command = "python3 a.py {taks} {output}"', "has {taks}; use {task}"), ("restart = []", "`restart` is empty"),
    ('command = ["python3", 3, "{output}"]', "`command` has 3; give texts"), ('command = "python3 \'a.py {output}"', "quotation marks"),
    ('command = "python3 a.py {output}"\nversion = "no-such-program"', "mend `version`"),
    ('command = "python3 a.py {output}"\nenvironment = { A = 1 }', "`environment` has 1; give texts"),
    ('command = "python3 a.py {output}"\ninputs = [1]', "`inputs` has 1; give texts")])
def test_a_wrong_engine_is_told_with_its_remedy(tmp_path, monkeypatch, change, message):
    monkeypatch.setattr(registry, "ENGINES", dict(registry.ENGINES))
    (tmp_path / "cases").mkdir()
    (tmp_path / "a.py").write_text("")
    path = tmp_path / "validate.toml"
    path.write_text(f"[engine.mine]\n{change if 'command' in change else change + chr(10) + 'command = ' + chr(34) + 'python3 a.py {output}' + chr(34)}\n")
    with pytest.raises(HarnessError) as caught:
        project.load(path)
        registry.ENGINES["mine"].version()
    assert message in str(caught.value)
    one_sentence(str(caught.value), path)


@pytest.mark.parametrize("change, message", [
    (("[output]", "[outptu]"), "unknown key outptu; did you mean output?"), (("snapshot_interval", "snapshot_intervall"), "unknown key snapshot_intervall"),
    (("steps = 100", "steps = 0"), "give a whole number from 1"), (('time_step = "1 ms"', "time_step = 0"), "give a time above zero"),
    (("density = 2500", 'density = "heavy"'), "`density`: `heavy` does not begin with a number"), (('name = "m"\n', ""), "a material has no `name`"),
    (('"1 mm"]]', '"1 mm", 3]]'), "[x, y, z, radius]"), (('kind = "spheres"\n', ""), "the packing has no `kind`")])
def test_a_wrong_scenario_is_told_with_its_line(folder, run, change, message):
    path = folder / "cases/small/scenario.toml"
    assert change[0] in SCENARIO
    path.write_text(SCENARIO.replace(*change))
    code, said = run("run", "small")
    assert code == rounds.WRONG_INPUT and message in said and f"{path}:" in said
    one_sentence(said, path)
