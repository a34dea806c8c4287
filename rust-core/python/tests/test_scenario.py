"""Scenarios: four ways to write one, and errors."""

import json
import pickle
import warnings

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


def test_settings_replace_keys():
    scenario = concordem.Scenario.template("cpm-small")
    other = scenario.with_settings(
        {"material[0].cpm.young": np.float64(2e10), "loading.strain_rate": "0.2 1/s", "packing.seed": 3}
    )
    tables = other.to_dict()
    assert tables["material"][0]["cpm"]["young"] == 2e10
    assert tables["loading"]["strain_rate"] == "0.2 1/s"
    assert tables["packing"]["seed"] == 3
    assert scenario == concordem.Scenario.template("cpm-small") != other
    assert pickle.loads(pickle.dumps(other)) == other
    with pytest.raises(concordem.ScenarioError, match="yuong"):
        scenario.with_settings({"material[0].cpm.yuong": 1e10})
    with pytest.raises(ValueError, match="there is no item `7`"):
        scenario.with_settings({"material[7].cpm.young": 1e10})
    # Messages begin with the door that was used, and positions are those in it.
    with pytest.raises(concordem.ScenarioError) as info:
        scenario.with_settings({"packing.seed": 3, "loading.strain_rate": "5x"})
    shown = 'with_settings({"loading.strain_rate": "5x"})'
    assert str(info.value).startswith(f"{shown}: loading.strain_rate"), info.value
    assert (info.value.line, info.value.problems[0].column) == (1, shown.index('"5x"') + 1)
    with pytest.raises(ValueError, match=r"^with_settings\(\{\"packing\": 1\}\): "):
        scenario.with_settings({"packing": 1})
    with pytest.raises(ValueError, match="empty key"):
        scenario.with_settings({"": 1})
    with pytest.raises(TypeError, match="cannot remove"):
        scenario.with_settings({"packing.seed": None})
    with pytest.raises(TypeError, match="not a mapping"):
        scenario.with_settings(["packing.seed=3"])


def test_numbers_of_numpy_are_numbers():
    spheres = np.array([[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3]])
    stop = {"steps": np.int64(400)}
    scenario = concordem.Scenario(**{**TWO, "packing": {"kind": "spheres", "spheres": spheres}, "stop": stop})
    assert scenario.to_dict()["stop"]["steps"] == 400
    assert scenario.simulation().summary.bonds == 1


def test_arrays_are_lists_in_any_layout_and_hidden_numbers_are_refused():
    spheres = np.array([[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3]])

    def text_of(given):
        return concordem.Scenario(**{**TWO, "packing": {"kind": "spheres", "spheres": given}}).text

    wanted = text_of(spheres.tolist())
    assert "spheres = [[0.0, 0.0, 0.0, 0.001], [0.002, 0.0, 0.0, 0.001]]" in wanted
    for given in (spheres, np.asfortranarray(spheres), np.repeat(spheres, 2, axis=0)[::2], list(spheres), tuple(map(tuple, spheres))):
        assert text_of(given) == wanted
    with pytest.raises(TypeError, match="packing\\.spheres.*MaskedConstant"):
        text_of(np.ma.array(spheres, mask=[[0, 1, 0, 0], [0, 0, 0, 0]]))


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


def concrete(**tables):
    """Concrete with an interface, from dictionaries alone."""
    cpm = dict(young=25e9, shear_ratio=0.2, crack_onset_strain=1e-4, relative_ductility=30, cohesion=3e6, friction_coefficient=0.8)
    return concordem.Scenario(
        packing=dict(kind="lattice", lattice="fcc", radius=1e-3, shape=dict(kind="box", size=[0.019, 0.019, 0.019])),
        material=[
            dict(name="mortar", density=4800, cpm=cpm),
            dict(name="stone", density=5600, cpm=cpm | dict(young=62.5e9, crack_onset_strain=2e-4, cohesion=15e6)),
        ],
        interface=dict(between=["mortar", "stone"], of="mortar", factors=dict(stiffness=0.5, strength=0.5, ductility=0.1)),
        bonds=dict(law="cpm", interaction_ratio=1.5),
        contacts=dict(law="cpm"),
        loading=dict(kind="uniaxial", strain_rate=20, initial_velocity_field=True),
        stop=dict(steps=150),
        **tables,
    )


def test_phases_are_arrays():
    """Materials and aggregates as arrays give the run of the same aggregates bit for bit, also between two of them."""
    places = [[-0.004, 0, 0, 0.0035], [0.0035, 0.001, 0, 0.0038]]
    shapes = concrete(aggregates=dict(group=[dict(material="stone", spheres=places)]))
    centers = shapes.pack().positions
    aggregate = np.zeros(len(centers), int)
    for number, (x, y, z, radius) in reversed(list(enumerate(places, 1))):
        aggregate[np.linalg.norm(centers - [x, y, z], axis=1) <= radius] = number
    arrays = concrete(phases=dict(materials=np.minimum(aggregate, 1), aggregates=aggregate))
    assert {np.count_nonzero(aggregate == number) > 5 for number in (0, 1, 2)} == {True}
    runs = [shapes.simulation(), arrays.simulation()]
    assert runs[0].state_hash() == runs[1].state_hash()
    for run in runs:
        run.run()
    assert runs[0].state_hash() == runs[1].state_hash()
    assert np.count_nonzero(runs[0].bonds().damage) > 100
    assert shapes.simulation().state_hash() != concrete(phases=dict(materials=np.minimum(aggregate, 1))).simulation().state_hash()
    with pytest.raises(concordem.ScenarioError, match="give one per sphere"):
        concrete(phases=dict(materials=[0, 1])).simulation()


def slipping(keys):
    """Hash of two bonded spheres that slip on each other, with these keys of friction."""
    cpm = dict(young=25e9, shear_ratio=0.2, crack_onset_strain=1e-4, relative_ductility=30, cohesion=0)
    simulation = concordem.Scenario(
        packing=dict(kind="spheres", spheres=[[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3]]),
        material=dict(name="m", density=4800, cpm=cpm | keys),
        bonds=dict(law="cpm", interaction_ratio=1.5),
        contacts=dict(law="cpm"),
        stop=dict(steps=40),
    ).simulation()
    simulation.state.writable("velocities")[1] = -0.1, 1, 0.3
    simulation.run()
    return simulation.state_hash()


def test_friction_arrives_in_the_law_as_it_is_written():
    """Coefficients that differ in their last bits give different states, so nothing is rounded on the way to the law."""
    coefficients = 0.8 + np.spacing(0.8) * np.arange(16)
    assert len({slipping(dict(friction_coefficient=float(f))) for f in coefficients}) == len(coefficients)
    with_unit = slipping(dict(friction_angle="45 deg"))
    assert slipping(dict(friction_angle=np.pi / 4)) == with_unit != slipping(dict(friction_coefficient=1.001))


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


DOUBTFUL = {
    **TWO,
    "material": {**TWO["material"], "frictional": {"normal_stiffness": 1e6, "shear_stiffness": 1e6}},
    # Twice the distance of the spheres is not reached by this ratio.
    "packing": {"kind": "spheres", "spheres": [[0, 0, 0, "1 mm"], ["4 mm", 0, 0, "1 mm"]]},
}


def texts(caught):
    assert all(issubclass(each.category, concordem.ConcordemWarning) for each in caught)
    return [str(each.message) for each in caught]


def test_every_way_to_a_scenario_warns_once(tmp_path):
    """Unused tables are found in the text, missing bonds only when the scenario is built."""
    with pytest.warns(concordem.ConcordemWarning) as caught:
        scenario = concordem.Scenario(**DOUBTFUL)
    assert len(caught) == 1 and "material[0].frictional" in texts(caught)[0]
    assert caught[0].filename == __file__ and issubclass(concordem.ConcordemWarning, UserWarning)
    problem = caught[0].message.problem
    assert problem.kind == "Warning" and problem.key == "material[0].frictional" and "remove the table" in problem.help
    (tmp_path / "doubtful.toml").write_text(scenario.text)
    for make in (
        lambda: concordem.Scenario.from_dict(DOUBTFUL),
        lambda: concordem.Scenario.from_text(scenario.text),
        lambda: concordem.Scenario.from_file(tmp_path / "doubtful.toml"),
    ):
        with pytest.warns(concordem.ConcordemWarning) as caught:
            make()
        assert len(caught) == 1 and "neither bonds nor contacts use this law" in texts(caught)[0]
    # The packing needs no bonds, so it adds no warning: pytest makes any other warning an error.
    assert len(scenario.pack().radii) == 2
    with pytest.warns(concordem.ConcordemWarning) as caught:
        simulation = scenario.simulation()
    assert len(caught) == 1 and "there are no bonds" in texts(caught)[0]
    simulation.step(10)
    simulation.save(tmp_path / "half.h5")
    with pytest.warns(concordem.ConcordemWarning) as caught:
        concordem.Simulation.load(tmp_path / "half.h5")
    assert [("frictional" in text, "no bonds" in text) for text in texts(caught)] == [(True, False), (False, True)]


def test_elastic_constants_warn_of_ties():
    data = {
        "packing": {"kind": "lattice", "lattice": "fcc", "radius": "1 mm", "repeats": [2, 2, 2], "shape": {"kind": "periodic"}},
        "material": TWO["material"],
        "bonds": {"law": "linear_bond", "interaction_ratio": 1.0},
        "contacts": {"law": "none"},
        "stop": {"steps": 1},
    }
    scenario = concordem.Scenario(**data)
    with pytest.warns(concordem.ConcordemWarning, match="as long as the longest that the interaction ratio allows") as caught:
        concordem.elastic_constants(scenario)
    assert len(caught) == 1 and caught[0].message.problem.key == "bonds.interaction_ratio"


def test_warnings_can_be_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error", concordem.ConcordemWarning)
        with pytest.raises(concordem.ConcordemWarning, match="frictional"):
            concordem.Scenario(**DOUBTFUL)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        concordem.Scenario(**DOUBTFUL).simulation()
    assert not caught
