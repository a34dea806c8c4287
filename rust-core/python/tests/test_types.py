"""Types of scenarios: editors and mypy take every valid scenario, and find mistakes before a run; the same mistakes are errors at run time."""

import subprocess
import sys
import tomllib
from pathlib import Path

import concordem
import pytest
from concordem import Scenario, tables

GOOD = Path(__file__).resolve().parents[3] / "tests/scenarios/good"
BASE = {
    "packing": '{"kind": "spheres", "spheres": [[0, 0, 0, "1 mm"], ["2 mm", 0, 0, 1e-3]]}',
    "material": '{"name": "glass", "density": 2500, "linear_bond": {"normal_stiffness": "1e6 N/m", "shear_stiffness": 3e5}}',
    "contacts": '{"law": "linear_bond"}',
    "stop": '{"steps": 400}',
}
# Each value is wrong, and the program says what.
WRONG = [
    ("matreial", "[]", "matreial"),
    ("packing", '{"kind": "spheres", "sphreres": [[0, 0, 0, 1e-3]]}', "sphreres"),
    ("packing", '{"kind": "sphere", "spheres": [[0, 0, 0, 1e-3]]}', "sphere"),
    ("packing", '{"kind": "lattice", "lattice": "foc", "radius": 1e-3, "repeats": [1, 1, 1]}', "foc"),
    ("material", '{"name": "m", "density": 1.0, "linear_bond": {"normal_stifness": 1e6, "shear_stiffness": 1e5}}', "normal_stifness"),
    ("material", '{"name": "m"}', "density"),
    ("contacts", '{"law": "frictonal"}', "frictonal"),
    ("stop", '{"steps": "many"}', "many"),
    ("wall", '[tables.Wall(material="glass", shape=tables.WallShapePlane(kind="plane", point=[0, 0, 0], norml=[0, 0, 1]))]', "norml"),
    ("integration", '{"damping": {"kind": "local", "coeficient": 0.3}}', "coeficient"),
]


def call(**values):
    """A call with the text of each value."""
    return f"Scenario({', '.join(f'{key}={value}' for key, value in {**BASE, **values}.items())})"


def documents():
    """Valid scenarios as dictionaries: all templates, and the good files of the program's tests."""
    found = {name: Scenario.template(name).to_dict() for name in Scenario.templates()}
    for path in sorted(GOOD.glob("*.toml")):
        found[path.name] = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    return found


def test_valid_scenarios_have_the_types_and_wrong_ones_not(tmp_path):
    """An unused `type: ignore` is an error, so that each wrong line must be found."""
    pytest.importorskip("mypy")
    lines = ["from concordem import Scenario, tables", "from concordem.tables import ScenarioTables"]
    lines += [f"good_{k}: ScenarioTables = {one!r}" for k, one in enumerate(documents().values())]
    lines += ["Scenario(**good_0)", call()]
    lines += [f"{call(**{key: value})}  # type: ignore" for key, value, _ in WRONG]
    (tmp_path / "scenarios.py").write_text("\n".join(lines) + "\n", encoding="utf-8")
    package = Path(concordem.__file__).parents[1]
    # mypy finds an installed package itself, and refuses its folder here.
    path = {} if package.name == "site-packages" else {"MYPYPATH": str(package)}
    given = subprocess.run(
        [sys.executable, "-m", "mypy", "--warn-unused-ignores", "--ignore-missing-imports", "--cache-dir", str(tmp_path / "cache"), "scenarios.py"],
        cwd=tmp_path, env={**path, "PATH": "/usr/bin:/bin"}, capture_output=True, text=True)
    assert given.returncode == 0, given.stdout[-5000:] + given.stderr[-2000:]
    assert len(documents()) > 20


@pytest.mark.parametrize("key, value, said", WRONG)
def test_wrong_tables_are_errors_at_run_time(key, value, said):
    with pytest.raises(concordem.ScenarioError) as caught:
        eval(call(**{key: value}), {"Scenario": Scenario, "tables": tables})
    assert said in str(caught.value)


@pytest.mark.parametrize("name", Scenario.templates())
def test_tables_survive_toml(name):
    template = Scenario.template(name)
    built = Scenario(**template.to_dict())
    assert Scenario.from_text(built.text).to_dict() == built.to_dict() == template.to_dict()
