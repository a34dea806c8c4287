"""Motions of [[slave]] in two and three dimensions, beside clumps, loads, and operators, through a restart and with other threads."""

import concordem
import numpy as np
import pytest

STEP, STEPS = 2e-6, 400


def scenario(dimension, **tables):
    """A chain whose first two particles are slaves, with a load on the last one, and a clump that falls on its middle."""
    spheres = [[2e-3 * k, 0.0, 0.0, 1e-3] for k in range(8)]
    return {
        "dimension": dimension,
        "packing": {"kind": "spheres", "spheres": spheres},
        "material": {"name": "m", "density": 2500.0, "linear_bond": {"normal_stiffness": 1e4, "shear_stiffness": 3e3},
                     "frictional": {"normal_stiffness": 1e4, "shear_stiffness": 5e3, "friction_coefficient": 0.4}},
        "bonds": {"law": "linear_bond", "interaction_ratio": 1.1},
        "contacts": {"law": "frictional"},
        "clump": [{"spheres": [[8e-3, 2.4e-3, 0, 1e-3], [9e-3, 2.4e-3, 0, 1e-3]], "velocity": [0.3, -2.0, 0.0], "angular_velocity": [0, 0, 50.0]}],
        "set": [{"name": "slaves", "selection": {"kind": "ids", "ids": [0, 1]}}, {"name": "last", "selection": {"kind": "ids", "ids": [7]}}],
        "prescribe": [{"set": "slaves", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}],
        "force": [{"set": "last", "force": [0.5, 1.0, 0.0], "moment": [0, 0, 1e-4]}],
        "sample": [{"name": "pull", "operator": "set-force", "interval": 50, "set": "slaves"}],
        "integration": {"time_step": STEP, "gravity": [0, -9.81, 0]},
        "output": {"sample_interval": 50},
        "stop": {"steps": STEPS},
    } | tables


def motion(dimension):
    """Entries of the file: the slaves swing and turn, in the plane or in space."""
    time = STEP * np.arange(STEPS + 1)
    wave = np.sin(2 * np.pi * 2e3 * time)
    entries = np.zeros((STEPS + 1, 2, 6))
    entries[..., 0], entries[..., 1], entries[..., 5] = 0.2 * wave[:, None], -0.1 * wave[:, None], 40 * wave[:, None]
    if dimension == 3:
        entries[..., 2], entries[..., 3] = 0.15 * wave[:, None], 20 * wave[:, None]
    return entries


@pytest.mark.parametrize("dimension", [2, 3])
def test_slaves_move_as_their_file_says_beside_clumps_and_loads(tmp_path, dimension):
    entries = motion(dimension)
    np.save(tmp_path / "m.npy", entries)
    # The same motion, given in Python before each step.
    driven = concordem.Scenario.from_dict(scenario(dimension), tmp_path).simulation(threads=1)
    rows = [int(np.nonzero(driven.state.ids == k)[0][0]) for k in (0, 1)]
    for k in range(STEPS):
        velocity, spin = np.array(driven.state.velocities), np.array(driven.state.angular_velocities)
        velocity[rows], spin[rows] = entries[k + 1, :, :3], entries[k + 1, :, 3:]
        driven.set_motion(velocity, spin)
        driven.step()
    tables = scenario(dimension, slave=[{"set": "slaves", "path": "m.npy"}])
    one = concordem.Scenario.from_dict(tables, tmp_path).simulation(threads=1)
    one.run()
    assert one.state_hash() == driven.state_hash()
    for name in one.operator_samples:
        for column in one.operator_samples[name].dtype.names:
            assert np.array_equal(one.operator_samples[name][column], driven.operator_samples[name][column])
    # The file moves the slaves, the clump hits the chain (gravity alone would speed it up), the load has moved the end.
    path = STEP * entries[1:, :, :3].sum(axis=0)
    places = np.array(one.state.positions)[np.argsort(one.state.ids)]
    assert np.abs(path).max() > 1e-7
    assert np.allclose(places[:2], [[0, 0, 0], [2e-3, 0, 0]] + path, rtol=0, atol=1e-16)
    assert np.array(one.state.velocities)[one.state.ids >= 8, 1].max() > -1.9
    assert abs(places[7, 1]) > 1e-7
    if dimension == 2:
        assert not np.array(one.state.velocities)[:, 2].any()
    # In two parts, with two threads.
    half = concordem.Scenario.from_dict(tables, tmp_path).simulation(threads=2)
    half.step(137)
    half.save(tmp_path / "half.h5")
    second = concordem.Simulation.load(tmp_path / "half.h5", threads=2)
    second.run()
    assert second.state_hash() == one.state_hash()


def test_slaves_that_leave_the_plane_or_belong_to_a_clump_are_refused(tmp_path):
    np.save(tmp_path / "m.npy", motion(3))
    slave = [{"set": "slaves", "path": "m.npy"}]
    with pytest.raises((concordem.ScenarioError, concordem.AssemblyError), match="nothing moves out of the plane"):
        concordem.Scenario.from_dict(scenario(2, slave=slave), tmp_path).simulation()
    members = [{"name": "slaves", "selection": {"kind": "ids", "ids": [8, 9]}}, {"name": "last", "selection": {"kind": "ids", "ids": [7]}}]
    with pytest.raises((concordem.ScenarioError, concordem.AssemblyError), match="belongs to clump"):
        concordem.Scenario.from_dict(scenario(3, slave=slave, set=members), tmp_path).simulation()
    with pytest.raises((concordem.ScenarioError, concordem.AssemblyError), match="is not prescribed; add"):
        concordem.Scenario.from_dict(scenario(3, slave=slave, set=members, prescribe=[]), tmp_path).simulation()
