"""Scenarios and examples for all tests."""

import importlib
import signal
from pathlib import Path

import concordem
import pytest


def pytest_configure(config):
    config.addinivalue_line("markers", "once: says the same of every interpreter, so that test.sh runs it in the first one only")


TWO = {
    "packing": {"kind": "spheres", "spheres": [[0, 0, 0, "1 mm"], ["2 mm", 0, 0, "1 mm"]]},
    "material": {
        "name": "glass",
        "density": "2500 kg/m^3",
        "linear_bond": {"normal_stiffness": "1e6 N/m", "shear_stiffness": "3e5 N/m", "normal_strength": "20 N"},
    },
    "bonds": {"law": "linear_bond", "interaction_ratio": 1.1},
    "contacts": {"law": "linear_bond"},
    "stop": {"steps": 400},
}


@pytest.fixture
def two() -> concordem.Scenario:
    """Two bonded spheres."""
    return concordem.Scenario(**TWO)


@pytest.fixture
def concrete() -> concordem.Scenario:
    """About a thousand spheres of concrete in tension, until bonds break; of a cell of 100 spheres, since each simulation makes its own."""
    return concordem.Scenario.template("cpm-small").with_settings({"packing.count": 100})


@pytest.fixture(scope="session")
def import_example():
    """Function that imports an example of the couplings by its name. The test is skipped without scikit-fem (Debian's own Python)."""

    def load(name):
        pytest.importorskip("skfem")
        folder = Path(__file__).resolve().parents[1] / "examples"
        if not folder.exists():
            pytest.skip("the examples are not beside the tests")
        with pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(folder)
            return importlib.import_module(name)

    return load


@pytest.fixture(autouse=True)
def interruptible():
    """Enable Ctrl-C as in a terminal, because background processes ignore SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
