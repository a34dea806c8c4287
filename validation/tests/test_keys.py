"""What a stored run depends on: every word of an engine's table, and every file that its code may read."""
import sys

import pytest
from concordem_validate import case as cases
from concordem_validate import lint, registry
from concordem_validate.engines.command import CommandEngine
from concordem_validate.errors import HarnessError


def version(home, command="python3 code.py {task} {output}", **table):
    return CommandEngine("mine", home, command, **table).version()


@pytest.fixture
def home(tmp_path):
    (tmp_path / "code.py").write_text("import helper\nprint(helper.factor)\n")
    (tmp_path / "helper.py").write_text("factor = 1.0\n")
    return tmp_path


@pytest.mark.parametrize("before, after", [
    (dict(command="python3 code.py {output} 1.0"), dict(command="python3 code.py {output} 1.5")), (dict(environment={"FAC": "1"}), dict(environment={"FAC": "2"})),
    (dict(output="csv"), dict(output="hdf5")), (dict(needs_start=True), dict(needs_start=False)),
    (dict(), dict(restart="python3 code.py {checkpoint} {output}", command="python3 code.py {output} {checkpoint}")),
])
def test_every_word_of_the_table_counts(home, before, after):
    assert version(home, **before) == version(home, **before) != version(home, **after)


def test_variables_that_choose_libraries_count(home, monkeypatch):
    before = version(home)
    monkeypatch.setenv("LD_LIBRARY_PATH", "/another")
    assert version(home) != before


@pytest.mark.parametrize("inputs", [(), ("code.py",)])
def test_modules_beside_a_script_count_with_and_without_inputs(home, inputs):
    before = version(home, inputs=inputs)
    (home / "helper.py").write_text("factor = 1.5\n")
    assert version(home, inputs=inputs) != before


def test_what_a_module_imports_counts_too(home):
    (home / "helper.py").write_text("from deeper import factor\n")
    (home / "deeper.py").write_text("factor = 1.0\n")
    before = version(home, inputs=["code.py"])
    (home / "deeper.py").write_text("factor = 1.5\n")
    assert version(home, inputs=["code.py"]) != before


def test_data_beside_a_script_count_but_rounds_and_cases_do_not(home):
    (home / "table.dat").write_text("1")
    before = version(home)
    for place in ("out/runs/a.h5", "cases/one/case.toml", ".git/HEAD", "__pycache__/code.pyc", "env/pyvenv.cfg"):
        (home / place).parent.mkdir(parents=True, exist_ok=True)
        (home / place).write_text("x")
    (home / "out/runs/.round").touch()
    assert version(home) == before
    (home / "table.dat").write_text("2")
    assert version(home) != before


@pytest.mark.parametrize("command", ["python3 -m package {output}", "env {python} -m package {output}"])
def test_modules_that_python_runs_count(tmp_path, command):
    place = tmp_path / "lib/package"
    place.mkdir(parents=True)
    for name in ("__init__", "__main__", "inner"):
        (place / f"{name}.py").write_text("x = 1\n")
    command = command.replace("{python}", sys.executable)
    one = lambda: version(tmp_path, command, environment={"PYTHONPATH": str(tmp_path / "lib")}, inputs=["lib/package/__init__.py"])
    before = one()
    (place / "inner.py").write_text("x = 2\n")
    assert one() != before


@pytest.mark.parametrize("word", ["--config={file}", "{file}", "a={file},b=2"])
def test_files_within_words_count(tmp_path, word):
    (tmp_path / "options").write_text("1.0")
    (tmp_path / "code.py").write_text("")
    command = ["python3", "code.py", "{output}", word.replace("{file}", str(tmp_path / "options"))]
    before = version(tmp_path, command, inputs=["code.py"])
    (tmp_path / "options").write_text("1.5")
    assert version(tmp_path, command, inputs=["code.py"]) != before


def test_a_program_behind_a_launcher_counts(tmp_path, monkeypatch):
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin/mydem"
    program.write_text("#!/bin/sh\necho 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/usr/bin:/bin")
    before = version(tmp_path, "env mydem {output}")
    program.write_text("#!/bin/sh\necho 2\n")
    assert version(tmp_path, "env mydem {output}") != before


def test_a_folder_with_too_many_files_is_refused_without_inputs(home):
    (home / "many").mkdir()
    for k in range(4001):
        (home / "many" / str(k)).touch()
    with pytest.raises(HarnessError, match="more than 4000 files.*`inputs`"):
        version(home)
    assert version(home, inputs=["code.py"])


def test_links_of_a_virtual_environment_stay_links(home):
    """A virtual environment knows itself by the place of its `python3`, a link."""
    (home / "env").mkdir()
    (home / "env/python3").symlink_to(sys.executable)
    engine = CommandEngine("mine", home, "nice env/python3 code.py {output}")
    assert engine._command(engine.words, {})[1] == str(home / "env/python3")
    (home / "version").symlink_to(sys.executable)
    assert engine._command(["version", "--version"], {})[0] == str(home / "version")


@pytest.mark.parametrize("kind", ["copy", "comment", "link", "env", "one"])
def test_two_names_of_one_program_are_found(folder, engines, monkeypatch, kind):
    """Comments and names change no program."""
    (folder / "code.py").write_text("import helper\n")
    (folder / "helper.py").write_text("x = 1\n")
    second = {"env": "env python3 code.py {output}", "one": "python3 code.py {output}"}.get(kind, "python3 other.py {output}")
    if kind == "link":
        (folder / "other.py").symlink_to("code.py")
    else:
        (folder / "other.py").write_text("import helper\n" + ("# mine\n" if kind == "comment" else ""))
    for name, command in (("one", "python3 code.py {output}"), ("two", second)):
        monkeypatch.setitem(registry.ENGINES, name, CommandEngine(name, folder, command))
    found = lambda: "\n".join(lint.same_programs(cases.load("small", folder / "cases")))
    assert "engines one and two are the same program" in found()
    monkeypatch.setitem(registry.ENGINES, "two", CommandEngine("two", folder, second + " --law other"))
    assert not found()


def test_the_same_start_script_with_other_modules_is_another_program(folder, engines, monkeypatch):
    for name, text in (("one", "x = 1\n"), ("two", "x = 2\n")):
        (folder / name).mkdir()
        (folder / name / "code.py").write_text("import solver\n")
        (folder / name / "solver.py").write_text(text)
        monkeypatch.setitem(registry.ENGINES, name, CommandEngine(name, folder, f"python3 {name}/code.py {{output}}"))
    assert not list(lint.same_programs(cases.load("small", folder / "cases")))
