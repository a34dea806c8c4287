"""Coupled runs that fail: an error that says why, and the states of both sides in files.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import pickle

import concordem
import numpy as np
import pytest
from concordem import coupling

pytest.importorskip("skfem")

import test_contact_coupling as contact  # noqa: E402
import test_surface_coupling as surface  # noqa: E402
import test_volume_coupling as volume  # noqa: E402


def failed(error, match, folder, coupled, steps=50, **arguments):
    """Whether the run fails so, and its states are in the folder: those of the run at the error."""
    with pytest.raises(error, match=match) as caught:
        coupled.step(steps, **arguments)
    assert f"the states at the error are in {folder}: particles.h5 (step {coupled.simulation.state.step})" in caught.value.__notes__[0]
    simulation = concordem.Simulation.load(folder / "particles.h5")
    assert simulation.state_hash() == coupled.simulation.state_hash()
    return simulation


def read(folder, number=0):
    return pickle.loads((folder / f"elements-{number}.pickle").read_bytes())


def test_an_element_that_is_inverted(tmp_path):
    run, elements, skin = surface.bombarded()
    coupled = coupling.SurfaceCoupling(run, elements, skin, rescue=tmp_path / "r")
    load = np.zeros_like(elements.nodes)
    load[0] = [5e4, 5e4, 5e4]
    failed(concordem.CouplingError, "element .* is inverted; use a finer mesh", tmp_path / "r", coupled, load=load)
    # The elements go on from the file.
    again = surface.block()
    again.restore(read(tmp_path / "r"))
    assert again.steps == elements.steps and np.array_equal(again.displacement, elements.displacement)


def made_up(motion):
    """The elements of `surface.block`, whose displacements and velocities are `motion(nodes, step)`."""
    block = surface.block()
    steps = [0]

    def step(force):
        steps[0] += 1
        return motion(block.nodes, steps[0])

    elements = coupling.CallbackElements(block.nodes, surface.STEP, step, lambda: steps[0], lambda state: steps.__setitem__(0, state))
    skin = coupling.Skin(elements, coupling.Embedding(block.nodes, coupling._embedding._cells_of(block), block.nodes).cells)
    return elements, skin


def test_elements_that_diverge(tmp_path):
    elements, skin = made_up(lambda nodes, step: (np.full_like(nodes, np.nan if step == 3 else 0.0), np.zeros_like(nodes)))
    run = surface.scene(skin.wall("skin", "m"), [[0.01, 0.012, 0.0712, 0.02]])
    coupled = coupling.SurfaceCoupling(run, elements, skin, rescue=tmp_path)
    failed(concordem.CouplingError, "displacement of the callback is not finite in row 0; the finite elements have diverged", tmp_path, coupled)
    assert run.state.step == 3 and read(tmp_path)[2] == 3


def test_a_facet_without_area(tmp_path):
    # Everything is pressed into a line.
    elements, skin = made_up(lambda nodes, step: (-nodes * [1, 1, 0] * (step == 2), np.zeros_like(nodes)))
    run = surface.scene(skin.wall("skin", "m"), [[0.01, 0.012, 0.0712, 0.02]])
    coupled = coupling.SurfaceCoupling(run, elements, skin, rescue=tmp_path)
    failed(ValueError, 'mesh "skin": triangle 0 has no area', tmp_path, coupled)


def test_slaves_that_leave_their_elements(tmp_path):
    run, elements = volume.chain(0.0, 0.0, 0.0), volume.bar()
    coupled = coupling.VolumeCoupling(run, elements, [0, 1], rescue=tmp_path)
    coupled.step(5)
    # Someone else moves the nodes.
    elements.displacement[:] += 1e-6
    failed(concordem.CouplingError, "slave 0 is .* m away from its place in element", tmp_path, coupled)


def test_a_skin_whose_nodes_something_else_moves(tmp_path):
    run, elements, skin = surface.bombarded()
    coupled = coupling.SurfaceCoupling(run, elements, skin, rescue=tmp_path)
    coupled.step(5)
    elements.displacement[:] += 1e-6
    failed(concordem.CouplingError, 'vertex . of the mesh "skin" is .* away from node', tmp_path, coupled)


def test_bodies_pressed_through_their_skins(tmp_path):
    soft = {"frictional": {"normal_stiffness": 1.0, "shear_stiffness": 0.0, "friction_coefficient": 0.0}}
    elements = [contact.block([0, 0, 0]), contact.block([0, 0, 0.1101])]
    elements[1].velocity[:, 2] = -10.0
    bodies = [coupling.ContactBody(f"b{k}", e, soft, 0.01, 0.9) for k, e in enumerate(elements)]
    coupled = coupling.ContactCoupling(contact.simulate(bodies), bodies, rescue=tmp_path)
    failed(concordem.CouplingError, "use stiffer contacts", tmp_path, coupled, 400)
    for k, e in enumerate(elements):
        assert np.array_equal(read(tmp_path, k)[0], e.displacement)


def test_units_and_time_steps_that_do_not_fit():
    run = volume.chain(0.0, 0.0, 0.0)
    lines = np.linspace(-5.0, 1.0, 4), np.linspace(-2.0, 2.0, 3), np.linspace(-2.0, 2.0, 3)
    import skfem

    # Millimeters.
    elements = coupling.ScikitDynamics(skfem.MeshHex.init_tensor(*lines), coupling.Elastic(1e7, 0.3, 2500.0), volume.STEP)
    with pytest.raises(concordem.CouplingError, match="give both in meters"):
        coupling.VolumeCoupling(run, elements, [0, 1])
    with pytest.raises(concordem.CouplingError, match="time step of the particles"):
        coupling.VolumeCoupling(volume.chain(0.0, 0.0, integration={"time_step": volume.STEP / 2}), volume.bar(), [0, 1])


def test_states_that_cannot_be_written_are_named(tmp_path):
    run, elements, skin = surface.bombarded(stop={"steps": 2})
    coupled = coupling.SurfaceCoupling(run, elements, skin, rescue=tmp_path)
    def broken():
        raise RuntimeError("foreign")

    for save in (lambda: (lambda: None), broken):
        elements.save = save
        with pytest.raises(concordem.CouplingError, match="has ended") as caught:
            coupled.step(3)
        assert "only these are in" in caught.value.__notes__[0] and "particles.h5" in caught.value.__notes__[0]
