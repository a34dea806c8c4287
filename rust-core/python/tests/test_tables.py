"""Tables of the package for pandas and xarray."""

import concordem
import numpy as np
import pytest


@pytest.fixture
def broken(two):
    simulation = two.simulation(threads=1)
    x = simulation.state.positions[:, 0]
    simulation.state.writable("velocities")[:, 0] = 5 * np.sign(x - x.mean())
    simulation.run()
    assert len(simulation.events) == 1
    return simulation


def test_pandas(broken):
    pytest.importorskip("pandas")
    events = concordem.to_pandas(broken.events)
    assert list(events.columns)[:7] == ["time", "step", "a", "b", "position_x", "position_y", "position_z"]
    assert events["position_x"][0] == broken.events["position"][0, 0] and events.attrs["units"]["position_x"] == "m"
    samples = concordem.to_pandas(broken.samples)
    assert np.array_equal(samples["kinetic"], broken.samples["kinetic"])
    assert "mode_shares_3" in events and len(concordem.to_pandas(broken.state.contacts()["linear_bond"])) == 0


def test_tensors_have_two_indices():
    pytest.importorskip("pandas")
    table = np.zeros(2, dtype=[("time", "f8"), ("stress", "f8", (3, 3))])
    table["stress"][:, 0, 2] = 5
    frame = concordem.to_pandas(table)
    assert frame["stress_xz"].tolist() == [5, 5] and frame["stress_zx"].tolist() == [0, 0]


def test_xarray(broken):
    pytest.importorskip("xarray")
    events = concordem.to_xarray(broken.events)
    assert events["position"].dims == ("time", "i") and events["position"].attrs["units"] == "m"
    assert events["position"].sel(i="x").values[0] == broken.events["position"][0, 0]


@pytest.mark.parametrize("convert", [concordem.to_pandas, concordem.to_xarray])
def test_what_is_no_table_is_refused(convert):
    for wrong in (np.zeros(3), [1, 2], None):
        with pytest.raises(TypeError, match="give a structured array"):
            convert(wrong)


@pytest.mark.parametrize(("convert", "name"), [(concordem.to_pandas, "pandas"), (concordem.to_xarray, "xarray")])
def test_a_missing_library_is_named(broken, monkeypatch, convert, name):
    monkeypatch.setitem(__import__("sys").modules, name, None)
    with pytest.raises(ImportError, match=f"pip install {name}"):
        convert(broken.samples)
