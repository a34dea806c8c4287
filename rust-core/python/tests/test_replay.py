"""Runs coupled with finite elements, repeated from their recorded motion without them: the same bits."""

import concordem
import numpy as np
import pytest
from concordem import coupling

pytest.importorskip("skfem")

import test_contact_coupling as contact  # noqa: E402
import test_surface_coupling as surface  # noqa: E402
import test_volume_coupling as volume  # noqa: E402


def replay(simulation, tables, folder, steps, threads=1):
    """The scenario of a simulation with the tables [[slave]]."""
    scenario = simulation.scenario.to_dict() | {"slave": tables, "stop": {"steps": steps}}
    return concordem.Scenario.from_dict(scenario, folder).simulation(threads=threads)


def test_slaves_in_elements_repeat_their_motion(tmp_path):
    run = volume.chain(0.0, 2e-4, -1e-4, 3e-4, 0.0, stop={"steps": 300})
    elements = volume.bar()
    elements.velocity[:] = np.cross([10.0, -20.0, 30.0], elements.nodes) + [0.1, 0.2, 0.0]
    coupled = coupling.VolumeCoupling(run, elements, [0, 1], record="slaves")
    coupled.step(300)
    again = replay(run, coupled.write_motion(tmp_path), tmp_path, 300, threads=2)
    again.run()
    assert np.abs(run.state.velocities).max() > 0.1
    assert again.state_hash() == run.state_hash()


def test_a_skin_repeats_its_motion(tmp_path):
    run, elements, skin = surface.bombarded(stop={"steps": 250})
    coupled = coupling.SurfaceCoupling(run, elements, skin, record=True)
    coupled.step(250)
    assert abs(coupled.work) > 0
    again = replay(run, coupled.write_motion(tmp_path), tmp_path, 250, threads=2)
    # In two parts.
    again.step(100)
    again.save(tmp_path / "half.h5")
    again = concordem.Simulation.load(tmp_path / "half.h5", threads=1)
    again.run()
    assert again.state_hash() == run.state_hash()
    with pytest.raises(ValueError, match=r"repeats the motion of a \[\[slave\]\]"):
        again.drive_mesh("skin", np.zeros((len(skin.nodes), 3)))


def test_bodies_in_contact_repeat_their_motion(tmp_path):
    run, bodies = contact.colliding(stop={"steps": 150})
    coupled = coupling.ContactCoupling(run, bodies, record=True)
    coupled.step(150)
    assert coupled.work.any()
    again = replay(run, coupled.write_motion(tmp_path), tmp_path, 150)
    again.run()
    assert again.state_hash() == run.state_hash()


def test_motions_that_do_not_fit_are_refused(tmp_path):
    run = volume.chain(0.0, 0.0, 0.0)
    wall = surface.square()
    mesh = surface.scene(wall, [[0, 0, 1.0, 0.05]])

    def refused(array, match, table=None, of=run, steps=1, error=concordem.ScenarioError):
        if isinstance(array, bytes):
            (tmp_path / "m.npy").write_bytes(array)
        else:
            np.save(tmp_path / "m.npy", array)
        with pytest.raises(error, match=match):
            replay(of, [({"set": "slaves"} if table is None else table) | {"path": "m.npy"}], tmp_path, steps)

    anything = (concordem.ScenarioError, concordem.AssemblyError)
    refused(np.zeros((2, 3, 6)), 'the file has 3 particles, "slaves" has 2', error=anything)
    refused(np.zeros((2, 2, 3)), "3 components per row; .* takes 6", error=anything)
    refused(np.zeros((2, 2, 6)), "ends after 1 steps", steps=2, error=anything)
    refused(np.full((2, 2, 6), np.nan), "entry 0 is not finite", error=anything)
    refused(np.zeros((2, 2, 6), dtype="f4"), "64-bit floating-point", error=anything)
    refused(np.asfortranarray(np.zeros((2, 2, 6))), "Fortran order", error=anything)
    refused(np.zeros((2, 12)), r"has the shape \(2, 12\)", error=anything)
    refused(b"no array", "NumPy's format", error=anything)
    refused(b"\x93NUMPY\x03\x00", "version 3", error=anything)
    good = tmp_path / "good.npy"
    np.save(good, np.zeros((2, 2, 6)))
    refused(good.read_bytes()[:-8], "bytes of values", error=anything)
    refused(np.zeros((2, 2, 6)), "no set has this name", {"set": "others"}, error=anything)
    refused(np.zeros((2, 2, 6)), "gives both", {"set": "slaves", "wall": "plate"}, error=anything)
    refused(np.zeros((2, 2, 6)), "give `set` or `wall`", {}, error=anything)
    refused(np.zeros((2, 4, 5)), "takes 3 or 6", {"wall": "plate"}, mesh, error=anything)
    refused(np.zeros((2, 4, 6)), "triangle 0 has no area", {"wall": "plate"}, mesh, error=anything)
    # Particles whose motion is not prescribed.
    free = volume.chain(0.0, 0.0, 0.0, prescribe=[])
    refused(np.zeros((2, 2, 6)), r"add a \[\[prescribe\]\]", of=free, error=anything)
