"""Scenarios: four ways to write one, and errors."""

import json
import pickle

import concordem
import numpy as np
import pytest
from conftest import TWO


def test_four_ways_are_one(two, tmp_path):
    text = concordem.Scenario.from_text(two.text)
    path = tmp_path / "two.toml"
    path.write_text(two.text)
    file = concordem.Scenario.from_file(path)
    mapping = concordem.Scenario.from_dict(two.to_dict())
    assert text.to_dict() == file.to_dict() == mapping.to_dict() == two.to_dict()
    hashes = {s.simulation().state_hash() for s in (two, text, file, mapping)}
    assert len(hashes) == 1
    assert pickle.loads(pickle.dumps(two)) == two


def test_numbers_of_numpy_are_numbers():
    spheres = np.array([[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3]])
    stop = {"steps": np.int64(400)}
    scenario = concordem.Scenario(**{**TWO, "packing": {"kind": "spheres", "spheres": spheres}, "stop": stop})
    assert scenario.to_dict()["stop"]["steps"] == 400
    assert scenario.simulation().summary.bonds == 1


def test_problems_name_line_key_value_and_remedy():
    text = concordem.Scenario.template("cpm-small").text.replace("young = ", "yuong = ", 1)
    line = next(k for k, row in enumerate(text.splitlines(), 1) if "yuong" in row)
    with pytest.raises(concordem.ScenarioError) as caught:
        concordem.Scenario.from_text(text, name="wrong.toml")
    error = caught.value
    assert isinstance(error, ValueError)
    unknown = next(problem for problem in error.problems if problem.kind == "UnknownKey")
    assert unknown.line == line and unknown.key.endswith("yuong") and "young" in unknown.help
    assert f"wrong.toml:{line}:" in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert again.problems == error.problems and str(again) == str(error)


def test_values_that_no_scenario_has():
    with pytest.raises(TypeError, match=r"packing\.spheres"):
        concordem.Scenario(**{**TWO, "packing": {"kind": "spheres", "spheres": object()}})
    with pytest.raises(concordem.ScenarioError) as caught:
        concordem.Scenario(**{**TWO, "stop": {"steps": -1}})
    assert caught.value.key == "stop.steps" and caught.value.value == "-1"


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        concordem.Scenario.from_file(tmp_path / "missing.toml")
    with pytest.raises(ValueError, match="cpm-small"):
        concordem.Scenario.template("no such")


def test_unstable_time_step_is_refused_at_its_place():
    with pytest.raises(concordem.UnstableError) as caught:
        concordem.Scenario(**{**TWO, "integration": {"time_step": "1 s"}}).simulation()
    assert caught.value.key == "integration.time_step" and "auto" in caught.value.help


def test_every_template_is_a_scenario():
    for name in concordem.Scenario.templates():
        assert concordem.Scenario.template(name).to_dict()["version"] == 1


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError) as caught:
        concordem.Scenario.from_file(tmp_path / "nope")
    assert caught.value.errno == 2 and "nope" in str(caught.value) and "None" not in str(caught.value)


def test_schemas_are_of_scenarios_and_sweeps():
    assert "packing" in json.loads(concordem.schema())["properties"]
    sweep = json.loads(concordem.schema("sweep"))["properties"]
    assert "axis" in sweep and "packing" not in sweep
    with pytest.raises(ValueError, match="sweep"):
        concordem.schema("wing")
