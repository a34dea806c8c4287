"""The long studies and their make targets: no old results with a new commit, no ignored failure, no skipped peer."""
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
    """The study with temporary folders and a program that writes one point, `young` = 2."""
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
    # an unfinished sweep continues, and its duration is unknown
    (elastic.FILES / "ratios.h5.points").write_text("journal")
    _, seconds = elastic.run("ratios", None, resume=True)
    assert seconds is None and (elastic.FILES / "ratios.h5.points").exists()
    elastic.run("ratios", None, resume=False)
    assert not (elastic.FILES / "ratios.h5.points").exists()


@pytest.mark.parametrize("change, message", [
    (lambda points: None, None),
    (lambda points: points[0].update(dynamic_by_static_minus_1=-3e-6), "dynamics by statics.*does not hold"),
    (lambda points: points[0].update(young_by_affine=1.01), "relaxed E over affine E.*does not hold"),
    (lambda points: points[8].update(closed_by_young=1.0395), "holds; remove it from KNOWN"),
    (lambda points: points[8].update(closed_by_young=1.0425), "must be between"),
    (lambda points: points[0].update(problems=["a mechanism"]), "a mechanism"),
    (lambda points: [point.update({"interaction ratio": 1.05}) for point in points], "not checked"),
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
    # the label shows uncommitted changes
    monkeypatch.setattr(provenance, "of_program", lambda program: "b" * 40 + "+changes")
    assert provenance.label("program") == "b" * 40 + "+changes"


def test_the_commit_of_a_program_is_read_from_its_results():
    need("concordem")
    from concordem_validate.engines import concordem
    assert re.fullmatch(r"[0-9a-f]{40}(\+changes)?|working", provenance.of_program(concordem.program()))
    assert re.fullmatch(r"[0-9a-f]{40}(\+changes)?", provenance.of_tree())


STEPS = re.search(r"^TEST_STEPS := (.*)$", (ROOT / "Makefile").read_text(), re.M).group(1).split()


def test_every_study_of_make_does_something():
    """A file of functions alone would pass without a word."""
    root = Path(__file__).parents[2]
    studies = set(re.findall(r"validation/(\w+)\.py", (root / "Makefile").read_text()))
    assert len(studies) > 10
    for study in sorted(studies):
        assert '\nif __name__ == "__main__":\n' in (root / "validation" / f"{study}.py").read_text(), study


# The recorder does not follow the recursive make calls of `test`, so they are requested by name.
@pytest.mark.parametrize("targets, least", [(["test"], 5), (["test-build", *STEPS], 13), (["validate-full"], 9)])
def test_every_command_of_make_takes_a_missing_peer_for_a_failure(tmp_path, targets, least):
    """Run make with a shell that records the commands and the value of CI."""
    log = tmp_path / "log"
    recorder = script(tmp_path / "shell", f'#!/bin/sh\necho "CI=$CI $*" >> {log}\n')
    environment = {name: value for name, value in os.environ.items() if name not in ("CI", "MAKEFLAGS", "MAKELEVEL")}
    subprocess.run(["make", "-s", f"SHELL={recorder}", *targets], cwd=ROOT, env=environment, check=True)
    lines = log.read_text().splitlines()
    assert len(lines) >= least and all(line.startswith("CI=1 ") for line in lines), lines


def on_record():
    return json.loads((ROOT / "validation/results/rigid_box_sampling.json").read_text())["cases"]


@pytest.mark.parametrize("number, change, message", [
    (0, lambda case: case["A1"].update(ratio=1.11), "A1: the strain"),
    (2, lambda case: case["A1"].update(largest_other_over_zz=0.071), "A1: other components.*is expected"),
    (0, lambda case: case["A1"].update(largest_other_over_zz=0.069), "A1: other components.*remove the case"),
    (0, lambda case: case["A2"].update(internal_over_clipped_trace=0.9), "A2"),
    (0, lambda case: case["A3"].update(rigid_force=1e-13), "A3"),
    (0, lambda case: case["A6"].update(balance=1e-11), "A6"),
    (0, lambda case: case["A7"].update(singular_values=[1.0, 1e-4, 0.0]), "A7"),
    (0, lambda case: case["A8"].update(stress=1e-11), "A8: stress"),
    (0, lambda case: case.update(A8={"skipped": "YADE is not installed"}), "A8: stress"),
])
def test_the_rigid_box_is_held_to_its_acceptance(number, change, message):
    module = study("rigid_box_sampling")
    cases = on_record()
    assert not [what for case in cases for what in module.failures(case, True)]
    change(cases[number])
    wrong = module.failures(cases[number], True)
    assert wrong and re.search(message, wrong[0])


def test_the_rigid_box_needs_yade_where_it_is_strict(tmp_path, monkeypatch):
    module = study("rigid_box_sampling")
    monkeypatch.setenv("PATH", str(tmp_path))
    skipped = module.in_yade("none", strict=False)
    assert not module.failures(on_record()[0] | {"A8": skipped}, False)
    with pytest.raises(SystemExit, match="apt install yade"):
        module.in_yade("none", strict=True)
    # an existing build may be of another commit
    monkeypatch.setattr("sys.argv", ["rigid_box_sampling.py", "--full", "--built"])
    with pytest.raises(SystemExit):
        module.main()


def change_all(cases, change):
    for name, case in cases.items():
        if re.fullmatch(r"low, 19 mm, placement \d, interface 1", name):
            change(case)


@pytest.mark.parametrize("change, message", [
    (lambda case: case["geometry"].update(aggregates=133), "133 aggregates; the source has 134"),
    (lambda case: case["geometry"].update(volume_fraction=0.25), "of the volume"),
    (lambda case: case["tension"].update(young_pa=1.01 * case["tension"]["young_pa"]), "E is 1.0.. of that with 9.5 mm"),
    (lambda case: case["tension"].update(peak_stress_pa=1.3 * case["tension"]["peak_stress_pa"]), "f_t is"),
    (lambda case: case["compression"].update(peak_stress_pa=0.9 * case["compression"]["peak_stress_pa"]), "f_c does not rise"),
])
def test_the_mesoscale_is_held_to_its_source(change, message):
    module = study("mesoscale")
    cases = json.loads(module.RESULTS.read_text())["cases"]
    assert not module.check_geometry(cases) + module.check_published(cases)
    change_all(cases, change)
    wrong = module.check_geometry(cases) + module.check_published(cases)
    assert any(re.search(message, one) for one in wrong), wrong


def test_mixes_of_equal_geometry_run_once(tmp_path, monkeypatch):
    module = study("mesoscale")
    ran = []
    monkeypatch.setattr(module, "test", lambda program, text, options: (ran.append(text), ({"particles": 1}, {"steps": 1}))[1])
    known = {}
    module.study([("low", 12.5, 1, 1), ("high", 12.5, 1, 1), ("high", 9.5, 1, 1)], 50.0, known, lambda: None, {"commit": "commit", "machine": "machine"}, None, [])
    assert len(ran) == 4 and len(known) == 3
    assert known["high, 12.5 mm, placement 1, interface 1"]["same_as"] == "low, 12.5 mm, placement 1, interface 1"


@pytest.mark.parametrize("change, message", [
    (lambda cases: cases["cell, oedometer, seed 1"].update(last_stress_pa=4.8e5), "oedometer, seed 1"),
    (lambda cases: cases["cell, uniaxial modulus, seed 2"].update(last_stress_pa=4.4e5), "uniaxial modulus, seed 2"),
    (lambda cases: [cases[f"beam 10 mm, notch 0, seed {s}"].update(peak_stress_pa=4e6) for s in (1, 2, 3)], "modulus of rupture"),
])
def test_the_laboratory_is_held_to_its_statements(change, message):
    module = study("laboratory")
    cases = json.loads(module.RESULTS.read_text())["cases"]
    assert not module.check_record(cases)
    change(cases)
    assert any(re.search(message, one) for one in module.check_record(cases))


def change_kind(cases, start, change):
    for name, case in cases.items():
        if re.fullmatch(rf"{start}, seed \d", name):
            change(case)


@pytest.mark.parametrize("start, change, message", [
    ("pressed", lambda case: case.update(b=1.9), "pressed: b-values"),
    ("pressed", lambda case: case["b_of"].update(larger=[1.45, 200]), "1.45 from larger magnitudes"),
    ("pressed, large", lambda case: case["b_of"].update(after_peak=[2.3, 2000]), "does not fall at the peak"),
    ("in cycles", lambda case: case["reloadings"][1].update(felicity_ratio=0.97), "Felicity ratios at 0.7"),
    ("in cycles, slow", lambda case: case["reloadings"][2].update(emissions_below=1), "3 when loaded again"),
    ("thrown, 14 m/s", lambda case: case.update({"Gaudin–Schuhmann": {"exponent": 1.0}}), "Gaudin–Schuhmann: exponents"),
])
def test_emissions_and_fragments_are_held_to_their_statements(start, change, message):
    module = study("acoustic_emission")
    cases = json.loads(module.RESULTS.read_text())["cases"]
    assert not module.check_record(cases)
    change_kind(cases, start, change)
    assert any(re.search(message, one) for one in module.check_record(cases))


@pytest.mark.parametrize("start, change, message", [
    ("exponential, 4 mm", lambda case: case.update(fracture_energy_j_per_m2=1.3 * case["fracture_energy_j_per_m2"]), "^fracture energies: "),
    ("exponential, 1 mm", lambda case: case.update(last_stress_over_peak=0.1), "not broken at the end"),
    ("half the rate", lambda case: case.update(fracture_energy_j_per_m2=1.05 * case["fracture_energy_j_per_m2"]), "half the rate"),
    ("brittle, 1 mm", lambda case: case.update(fracture_energy_j_per_m2=5.0), "of brittle bonds"),
    ("cell of 640 spheres, modulus 4", lambda case: case.update(peak_stress_pa=3e6), "slopes of the strength"),
])
def test_rock_is_held_to_its_statements(start, change, message):
    module = study("rock_fracture")
    cases = json.loads(module.RESULTS.read_text())["cases"]
    assert not module.check_record(cases)
    for name, case in cases.items():
        if name.startswith(start):
            change(case)
    assert any(re.search(message, one) for one in module.check_record(cases))


@pytest.mark.parametrize("name", ["specimens", "distributed_specimen", "mesoscale", "laboratory"])
def test_specimens_of_another_commit_are_not_recorded(tmp_path, monkeypatch, name):
    module = study(name)
    monkeypatch.setattr(provenance, "of_tree", lambda: "b" * 40)
    monkeypatch.setattr(provenance, "of_program", lambda program: "a" * 40)
    monkeypatch.setattr(module, "RESULTS", tmp_path / "results.json")
    monkeypatch.setattr("sys.argv", [name, "--full"])
    program = script(tmp_path / "program", "#!/bin/sh\nexit 3\n")
    if name != "distributed_specimen":
        monkeypatch.setattr(module, "PROGRAM", program)
    else:
        monkeypatch.setattr(module.concordem, "program", lambda: program)
    with pytest.raises(SystemExit, match="was built as commit"):
        module.main()
    assert not module.RESULTS.exists()
