"""Rounds of several machines, and what a stored round vouches for."""
import shutil

import h5py
import pytest
from concordem_validate import cli, merging, registry, rounds
from conftest import CASE, Fake
from test_product import plus


@pytest.fixture
def three(folder, engines, no_page, monkeypatch):
    """Three cases, and a function that calls the harness on them."""
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.chdir(folder)
    for name in ("second", "third"):
        shutil.copytree(folder / "cases/small", folder / "cases" / name)
    return lambda *words: cli.main([words[0], "--cases", "cases", *words[1:]])


def test_a_merge_needs_all_parts(three, capsys):
    for k in (1, 2, 3):
        assert three("run", "--shard", f"{k}/3", "--output", f"s{k}") == rounds.AGREES
    assert rounds.record("s1")["shard"] == "1/3"
    assert three("merge", "s1", "--output", "all", "--strict") == rounds.NOTHING_CHECKED
    assert three("merge", "s1", "s3", "--output", "two") == rounds.NOTHING_CHECKED
    assert "CASES ARE MISSING" in capsys.readouterr().out
    # a report of it, and a merge with the rest, know that as well
    assert three("report", "--output", "two") == rounds.NOTHING_CHECKED
    assert three("merge", "two", "s2", "--output", "whole") == rounds.AGREES
    assert len({o["case"] for o in rounds.record("whole")["outcomes"]}) == 3


def test_a_part_without_cases_is_good_and_a_merge_of_such_parts_is_not(three, capsys):
    assert three("run", "--shard", "3/4", "small", "--output", "s3") == rounds.AGREES
    assert "part 3/4 has no case" in capsys.readouterr().out
    assert three("merge", "s3", "--output", "all") == rounds.NOTHING_CHECKED


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")])
def test_contradictory_results_are_an_error_that_names_both(three, engines, capsys, order):
    assert three("run", "small", "--output", "a") == rounds.AGREES
    engines["two"].change, engines["two"].number = plus(0.5), "2"
    assert three("run", "small", "--output", "b") == rounds.FAILED
    assert three("merge", *order, "--output", "m") == rounds.WRONG_INPUT
    said = capsys.readouterr().err
    assert "small · main · two differs between" in said and all(f" {name}" in said for name in order)


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")])
def test_a_crash_on_one_machine_is_not_hidden_by_another(three, engines, capsys, order):
    assert three("run", "small", "--output", "a") == rounds.AGREES
    engines["two"].change, engines["two"].number = lambda result: 1 / 0, "2"
    assert three("run", "small", "--output", "b") == rounds.FAILED
    assert three("merge", *order, "--output", "m") == rounds.WRONG_INPUT
    assert "two is" in capsys.readouterr().err


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")])
def test_the_same_results_of_two_machines_are_one(three, engines, order):
    assert three("run", "small", "--output", "a") == three("run", "small", "--output", "b", "--fresh") == rounds.AGREES
    assert three("merge", *order, "--output", "m") == rounds.AGREES


def edited(path):
    with h5py.File(path, "r+") as file:
        file["series/force/values"][3] = 9.0


def test_a_result_that_another_program_edited_is_no_result(three, capsys):
    """HDF5 overwrites the hash at the end of the file."""
    three("run", "small", "--output", "out")
    row = next(o for o in rounds.record("out")["outcomes"] if o["engine"] == "two")
    edited(f"out/{row['path']}")
    assert three("report", "--output", "out") == rounds.FAILED
    assert "has no hash at its end" in capsys.readouterr().out
    # the run is repeated
    before = registry.ENGINES["two"].runs
    assert three("run", "small", "--output", "out") == rounds.AGREES and registry.ENGINES["two"].runs == before + 1


def test_a_whole_result_of_another_round_is_not_that_of_the_record(three, engines, capsys):
    three("run", "small", "--output", "out")
    row = next(o for o in rounds.record("out")["outcomes"] if o["engine"] == "two")
    engines["two"].change = plus(1e-9)
    three("run", "small", "--output", "other")
    shutil.copy(f"other/{row['path']}", f"out/{row['path']}")
    assert three("report", "--output", "out") == rounds.FAILED
    assert "its hash is not that in round.json" in capsys.readouterr().out


def test_run_times_of_two_machines_do_not_depend_on_their_order(folder, engines, monkeypatch):
    for name, pair in (("a", [1.0, 2.0]), ("b", [3.0, 1.0])):
        round_ = rounds.Round(times={("small", "main", "one", "two"): [pair]})
        (folder / name).mkdir()
        rounds.write(folder / name, round_, 0)
    both = [merging.merge([folder / n for n in order], folder / "m")[0].times for order in ("ab", "ba")]
    assert both[0] == both[1] == {("small", "main", "one", "two"): [[1.0, 2.0], [3.0, 1.0]]}


def test_nothing_is_blessed_that_was_not_checked(three, engines, capsys):
    engines["one"].number = None
    assert three("run", "small", "--output", "out") == rounds.NOTHING_CHECKED
    assert three("bless", "v1", "--output", "out") == rounds.WRONG_INPUT
    assert "nothing was checked" in capsys.readouterr().err


def test_a_round_with_a_crash_that_no_check_sees_is_not_blessed_and_counts_a_failure(three, engines, folder, capsys):
    """`0 FAILS` and exit code 1 contradict each other."""
    (folder / "cases/small/case.toml").write_text(CASE.replace('peer = "three"', 'peer = "two"'))
    engines["three"].change = lambda result: 1 / 0
    assert three("run", "small", "--output", "out") == rounds.FAILED
    assert " 1 FAILS" in capsys.readouterr().out
    assert three("bless", "v1", "--output", "out") == rounds.WRONG_INPUT


def test_required_engines_must_compute_something(three, folder, engines, capsys):
    """`require` counts engines that no case uses, and those that skip every case."""
    (folder / "validate.toml").write_text('cases = ["cases"]\nrequire = ["two", "spare"]\n')
    registry.ENGINES["spare"] = Fake("spare")
    assert cli.main(["run"]) == rounds.ENGINE_MISSING
    assert "COMPUTED NOTHING: spare" in capsys.readouterr().out
    assert cli.main(["report"]) == rounds.ENGINE_MISSING
    # who chooses cases has it installed
    assert cli.main(["run", "small"]) == rounds.AGREES
    registry.ENGINES["spare"].number = None
    assert cli.main(["run", "small"]) == rounds.ENGINE_MISSING


def test_all_pairs_name_both(three, folder, engines, capsys):
    (folder / "cases/small/case.toml").write_text(CASE.replace('peer = "two"\nof = "force"', 'peer = ["two", "three"]\nof = "force"', 1))
    assert three("run", "small", "--pairs", "--verbose", "--output", "out") == rounds.AGREES
    assert "force · two and three:" in capsys.readouterr().out
