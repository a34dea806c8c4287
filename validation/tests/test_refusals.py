"""What must not pass, or end in a traceback: results, limits, names, and arguments that a stranger has tried."""
import os
import subprocess
import sys
import xml.dom.minidom
from pathlib import Path

import h5py
import numpy as np
import pytest
from concordem_validate import case as cases
from concordem_validate import cli, meeting, outputs, process, project, registry, rounds, runner, scenario
from concordem_validate.engines.command import CommandEngine
from concordem_validate.errors import HarnessError, Incomparable, Refused, Unsupported
from concordem_validate.result import Result
from conftest import CASE, SCENARIO, judged
from test_product import write_case

SPAN = meeting.Span(steps=200, beyond=0, interval=10, dt=0.5)


@pytest.mark.parametrize("steps, said", [
    (np.arange(0, 201, 10), None), (np.arange(0, 201, 5), None), ([0, 200], None), ([1, 50, 201], None),
    # 200 is no multiple of 7: the rest is less than an interval
    (np.arange(0, 200, 7), None), ([0, 110], "ends at"), ([0, 68, 135], "ends at"), ([0, *range(110, 126)], "ends at"), (np.arange(0, 200, 30), "ends at"),
    (np.arange(0, 191, 10), "ends at"), (np.arange(10, 201, 10), "begins at"), ([-10, 0, 200], "begins at"), ([0, 100, 240], "goes on to"),
])
@pytest.mark.parametrize("over", ["time", "step"])
def test_a_series_covers_its_run(steps, said, over):
    x = np.array(steps, float) * (0.5 if over == "time" else 1.0)
    if said is None:
        meeting.covers("it", x, over, SPAN)
    else:
        with pytest.raises(Incomparable, match=said):
            meeting.covers("it", x, over, SPAN)


def test_a_run_that_stops_at_a_time_may_go_on_to_its_next_record():
    meeting.covers("it", np.array([0.0, 104.0]), "time", meeting.Span(200, 10, 10, 0.5))
    with pytest.raises(Incomparable, match="goes on"):
        meeting.covers("it", np.array([0.0, 106.0]), "time", meeting.Span(200, 10, 10, 0.5))


def sampled(keep):
    """Only some samples of the force, in all engines."""
    def change(result):
        one = result.series["force"]
        one.steps, one.values = one.steps[keep], one.values[keep]
    return change


@pytest.mark.parametrize("keep, cause", [([0, 6], "short"), (slice(1, None), "short"), ([0, 3, 7], "short"), (slice(None), "")])
def test_engines_that_all_cover_a_part_only_do_not_agree(folder, engines, keep, cause):
    write_case(folder, '[[check]]\nname = "f"\nkind = "series"\npeer = "two"\nof = "force"\nmeet = "interpolate"\ntolerance = 1e-3\nreason = "r"\n')
    for engine in engines.values():
        engine.change = sampled(keep)
    assert judged(folder).verdicts[0].cause == cause


def test_an_interpolated_curve_has_no_hole(folder, engines):
    write_case(folder, '[[check]]\nname = "f"\nkind = "series"\npeer = "two"\nof = "force"\nmeet = "interpolate"\ntolerance = 0.5\nreason = "r"\n')

    def hole(result):
        fine = np.arange(0, 101)
        keep = np.array([*range(20), 100])
        result.add("force", fine[keep], np.interp(fine, result.series["force"].steps, result.series["force"].values)[keep], "N")
    engines["two"].change = hole
    verdict = judged(folder).verdicts[0]
    assert verdict.cause == "short" and "no sample between time 0.019 and 0.1" in verdict.message


def test_all_values_are_finite_also_between_common_points(folder, engines):
    def finer(result):
        result.add("force", np.arange(0, 101, 5), np.interp(np.arange(0, 101, 5), result.series["force"].steps, result.series["force"].values), "N")
        result.series["force"].values[7] = np.nan
    engines["two"].change = finer
    verdict = judged(folder).verdicts[0]
    assert (verdict.status, verdict.cause) == ("fail", "nan")


@pytest.mark.parametrize("old, new, said", [
    ("tolerance = 1e-3", "tolerance = inf", "`tolerance` is inf; give a finite number"), ("tolerance = 1e-3", "tolerance = nan", "finite"),
    ("tolerance = 1e-3", 'tolerance = 1e-3\nscale = inf', "`scale` is inf"), ("tolerance = 1e-3", 'tolerance = 1e-3\nscale = "1e999 N"', "finite"),
    ("tolerance = 1e-3", 'tolerance = 1e-3\nscale = "-1 N"', "above zero"), ("tolerance = 1e-3", "tolerance = 1e-3\nfrom = nan", "`from` is nan"),
    ('kind = "series"', 'kind = "bits"', "`bits` are the same or not"), ('title = "t"', 'title = "t"\ntime_limit_s = -5', "above zero"),
    ('engines = ["two", "three"]', "engines = [5]", "`engines` has 5; give text"), ("[[check]]", '[[variant]]\nname = "../x"\n[[check]]', "part of names of files"),
    ('peer = "two"', "peer = [5]", "`peer` has 5"),
])
def test_limits_that_nothing_exceeds_and_wrong_types_are_told_with_their_place(folder, engines, capsys, old, new, said):
    (folder / "cases/small/case.toml").write_text(CASE.replace(old, new, 1))
    for command in ("lint", "run"):
        assert cli.main([command, "--cases", str(folder / "cases"), "--output", str(folder / "out")]) == rounds.WRONG_INPUT
        text = capsys.readouterr().err
        assert said in text and "case.toml:" in text and len(text.splitlines()) == 1


def test_checks_that_are_no_tables_are_told(folder, engines):
    (folder / "cases/small/case.toml").write_text(CASE.partition("[[check]]")[0] + 'check = ["x"]\n')
    with pytest.raises(HarnessError, match="case.toml:6: `check` has 'x'; give a table"):
        cases.load("small", folder / "cases")


@pytest.mark.parametrize("text, said", [
    ("require = [5]", "validate.toml:1: `require` has 5"), ("cases = [5]", "validate.toml:1: `cases` has 5"),
    ('[engine."a/b"]\ncommand = "a {output}"', "part of names of files"), ('[engine."a@b"]\ncommand = "a {output}"', "marks self-checks"),
])
def test_bad_names_and_types_of_a_project_are_told(tmp_path, text, said):
    (tmp_path / "cases").mkdir()
    (tmp_path / "validate.toml").write_text(text)
    with pytest.raises(HarnessError) as error:
        project.load(tmp_path / "validate.toml")
    assert said in str(error.value)


@pytest.mark.parametrize("words", [["--jobs", "-3"], ["--jobs", "0"], ["--time-factor", "nan"], ["--against", "v", "--tolerance", "inf"],
                                   ["--against", "v", "--tolerance", "-1"]])
def test_numbers_of_the_command_line_are_numbers(words, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(["run", *words])
    assert end.value.code == 2 and "is no" in capsys.readouterr().err


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_an_output_that_is_a_file_is_told(folder, engines, capsys, place):
    (folder / "file").write_text("")
    assert cli.main(["run", "--cases", str(folder / "cases"), "--output", str(folder / place)]) == rounds.WRONG_INPUT
    assert "file" in capsys.readouterr().err


HEAD = "step,time,force,position.0.x,position.0.y,position.0.z\n1,s,N,m,m,m\n"


@pytest.mark.parametrize("text, said", [
    (HEAD + "0,0,1_0,0,0,0\n", "`1_0` in column `force` is not a number"), (HEAD + "0,0,١,0,0,0\n", "is not a number"),
    (HEAD.replace("force", "position.00.x") + "0,0,1,0,0,0\n", "`00` in column `position.00.x` is no id"),
    (HEAD.replace("force", "position.٠.x") + "0,0,1,0,0,0\n", "is no id of a particle"), (HEAD.replace("force", "position.².x") + "0,0,1,0,0,0\n", "is no id"),
    (HEAD + "0,0,1,0,0,0\n7,0.010,1,0,0,0\n", "step 7 has the time 0.01 s, but 0.007 s by the time step"),
    (HEAD + "0,0," + "1" * 140000 + ",0,0,0\n", "is no table of numbers"), ((HEAD + "0,0,ö,0,0,0\n").encode("latin-1"), "is not UTF-8"),
])
def test_bad_tables_are_told_in_a_sentence(tmp_path, text, said):
    path = tmp_path / "r.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(Incomparable) as error:
        Result.read(path, 1e-3)
    assert said in str(error.value)


def test_a_mark_of_the_order_of_bytes_is_no_name(tmp_path):
    (tmp_path / "r.csv").write_bytes(b"\xef\xbb\xbf" + (HEAD + "0,0,1,0,0,0\n").encode())
    assert set(Result.read(tmp_path / "r.csv", 1e-3).series) == {"force", "position"}


def hdf5(path, kind):
    with h5py.File(path, "w") as file:
        file.attrs.update(format="something else 9" if kind == "format" else "concordem-validate result 1", engine="x", time_step_s=1e-3,
                          numbers='{"measures": {"force": 1.0}}' if kind == "measures" else "{}")
        if kind == "link":
            file["series"] = h5py.ExternalLink(str(path.with_name("other.h5")), "series")
        else:
            group = file.create_group("series/force")
            group["step"] = np.arange(3)
            group["values"] = np.zeros(3)
            group["values"].attrs["unit"] = "N"


@pytest.mark.parametrize("kind, said", [("format", "has the format 'something else 9'"), ("link", "is a link to another file")])
def test_hdf5_of_another_format_or_file_is_refused(tmp_path, kind, said):
    hdf5(tmp_path / "r.h5", kind)
    with pytest.raises(Incomparable) as error:
        Result.read(tmp_path / "r.h5")
    assert said in str(error.value)


def commanded(folder, text, output="csv", limit=20):
    """A round of an engine that is a script."""
    (folder / "code.py").write_text("import os, sys\ntask, out = sys.argv[1:]\n" + text)
    registry.ENGINES["two"] = CommandEngine("two", folder, "python3 code.py {task} {output}", output=output)
    case = cases.load("small", folder / "cases")
    case.time_limit = limit
    return runner.Runner(folder / "out", quiet=True, jobs=1).run([case])


@pytest.mark.parametrize("text, said", [
    ("os.mkfifo(out)", "is no plain file"), ("os.mkdir(out)", "is no plain file"), ("os.symlink('/dev/zero', out)", "is a link to /dev/zero"),
    ("os.symlink(task, out)", "is a link"),
])
def test_only_plain_files_are_read_and_kept(folder, engines, text, said):
    outcome = commanded(folder, f"os.symlink('/dev/zero', 'zero'); open('note', 'w').write('x'); os.truncate(os.open('large', os.O_CREAT | os.O_RDWR), 1 << 40)\n"
                                f"{text}\n").outcomes["small", "main", "two"]
    keep = folder / "out/failed/small.main.two"
    assert outcome.status == "error" and said in outcome.message and str(keep) in outcome.message
    assert (keep / "note").read_text() == "x" and not (keep / "zero").exists() and not (keep / "large").exists()
    assert "large: 1099511627776 bytes" in (keep / "left-out.txt").read_text() and "zero: no plain file" in (keep / "left-out.txt").read_text()


def test_an_engine_gives_no_measures_in_place_of_the_case(folder, engines):
    hdf5(folder / "made.h5", "measures")
    outcome = commanded(folder, f"import shutil; shutil.copy({str(folder / 'made.h5')!r}, out)\n", "hdf5").outcomes["small", "main", "two"]
    assert outcome.status == "error" and "`measures`, which is of closed forms" in outcome.message


def test_a_refusal_is_a_skip_that_fails_nothing(folder, engines):
    round_ = commanded(folder, "print('no walls'); sys.exit(77)\n")
    assert round_.outcomes["small", "main", "two"].status == "skipped"
    assert {v.status for v in round_.verdicts} == {"skipped", "pass"} and round_.exit_code(False) == rounds.AGREES


def test_colored_output_gives_files_that_can_be_read(folder, engines, no_page, capsys, monkeypatch):
    (folder / "code.py").write_text("print('\\033[31merror: b\\0ad\\x08 \\udcff\\x1b]0;t\\x07input\\033[0m'.encode(errors='replace').decode()); raise SystemExit(1)")
    registry.ENGINES["two"] = CommandEngine("two", folder, "python3 code.py {output}")
    code = cli.main(["run", "--cases", str(folder / "cases"), "--output", str(folder / "out"), "--junit", str(folder / "v.xml"), "--badge", str(folder / "v.svg"),
                     "--json", str(folder / "v.json")])
    assert code == rounds.FAILED
    for name in ("v.xml", "v.svg"):
        xml.dom.minidom.parse(str(folder / name))
    assert "error: bad" in (folder / "v.xml").read_text()
    for text in ((folder / "v.xml").read_text(), (folder / "v.json").read_text(), capsys.readouterr().out):
        assert "\x1b" not in text and "[31m" not in text and "u001b" not in text


def test_names_with_control_characters_give_xml(folder, engines):
    round_ = judged(folder)
    round_.verdicts[0].check.name, round_.verdicts[0].message = "a\x00\x1b[1m\ud800b", "c\x08d"
    xml.dom.minidom.parseString(outputs.junit(round_).encode())


def test_logs_are_read_at_their_end(tmp_path):
    with open(tmp_path / "log.txt", "w") as file:
        file.truncate(1 << 36)
        file.seek(1 << 36)
        file.write("\nlast words\n")
    assert process.tail(tmp_path / "log.txt", 1) == "Last output: last words"
    with pytest.raises(Refused, match="too cold"):
        process.run(["sh", "-c", "echo too cold; exit 77"], tmp_path, 5, refusal=77)


@pytest.mark.parametrize("text, said", [
    ("def measures(task, result):\n    return None\n", "case.py: `measures` returned None for one in variant main; return a table"),
    ("def measures(task, result):\n    return {'p': 'fast'}\n", "`p` of one is 'fast'; give numbers"),
])
def test_measures_of_another_kind_are_told(folder, engines, text, said):
    write_case(folder, '[[check]]\nname = "p"\nkind = "scalar"\npeer = "two"\nof = "p"\ntolerance = 1e-3\nreason = "r"\n')
    (folder / "cases/small/case.py").write_text(text)
    verdict = judged(folder).verdicts[0]
    assert verdict.status == "fail" and said in verdict.message.replace(str(folder / "cases/small") + "/", "")


def test_an_engine_that_returns_no_result_is_told(folder, engines, monkeypatch):
    monkeypatch.setattr(engines["two"], "run", lambda task, folder, limit: None)
    assert "the function `run` of two returned NoneType; return a Result" in judged(folder).outcomes["small", "main", "two"].message


@pytest.mark.parametrize("old, new, said", [
    ('"1 ms"', '"0.5 um"', "scenario.toml:11: `time_step`: `0.5 um`"), ('"3 mm", 0, 0, "1 mm"', '"3 mm", 0, 0, "-1 mm"', "scenario.toml:4: `spheres` has the radius -1 mm"),
    ("density = 2500", 'density = "2500 kg/m^2"', "scenario.toml:7: `density`"),
    ("[contacts]", '[[set]]\nname = "a"\nselection = { kind = "ids", ids = [9] }\n[contacts]', "scenario.toml:10: the set `a` has the id 9; give ids from 0 to 1"),
    ("[contacts]", '[[prescribe]]\nset = "left"\nvelocity = [0, 0, 0]\n[contacts]', "scenario.toml:9: there is no set `left`; the sets are none"),
])
def test_mistakes_of_scenarios_are_told_with_file_and_line(tmp_path, old, new, said):
    assert old in SCENARIO
    (tmp_path / "scenario.toml").write_text(SCENARIO.replace(old, new))
    with pytest.raises(HarnessError) as error:
        scenario.load(tmp_path / "scenario.toml")
    assert said in str(error.value)


def test_a_key_that_an_engine_does_not_know_is_told_with_its_line(folder, engines):
    place = folder / "cases/small/scenario.toml"
    place.write_text(SCENARIO.replace("density = 2500", "density = 2500\nfrictional = { normal_stifness = 1e5 }"))

    def refuse(result):
        raise Unsupported("two: no translation of the law's normal_stifness")
    engines["two"].change = refuse
    assert judged(folder).outcomes["small", "main", "two"].message == f"two: no translation of the law's normal_stifness ({place}:8)"


def test_two_zero_curves_compare_nothing(tmp_path, capsys):
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("time,force\ns,N\n0,0\n1,0\n")
    assert cli.main(["compare", str(tmp_path / "a.csv"), str(tmp_path / "b.csv")]) == rounds.FAILED
    assert "zero in both" in capsys.readouterr().out


def test_a_reader_that_closes_its_pipe_is_no_mistake_of_a_path():
    read, write = os.pipe()
    os.close(read)
    ran = subprocess.run([sys.executable, "-m", "concordem_validate", "list"], stdout=write, stderr=subprocess.PIPE, text=True,
                         env={**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[1])})
    os.close(write)
    assert (ran.returncode, ran.stderr) == (141, "")
