"""Coupled runs that fail: an error that says why, and the states of both sides in files.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import pickle
import signal

import concordem
import numpy as np
import pytest
from concordem import coupling
from concordem.coupling import precice

pytest.importorskip("skfem")

import test_cells as cells_of  # noqa: E402
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
    skin = coupling.Skin(elements, coupling._embedding._cells_of(block))
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


def spinning(run=None):
    """A spinning bar with a chain of beams, or with this simulation of one."""
    elements = volume.bar()
    elements.velocity[:] = np.cross([10.0, -20.0, 30.0], elements.nodes)
    run = volume.chain(0.0, 2e-4, -1e-4, **volume.BEAMS) if run is None else run
    return run, elements


def went_on(folder, steps):
    """The volume coupling of `spinning`, from the files, after further steps."""
    run, elements = spinning(run=concordem.Simulation.load(folder / "particles.h5", threads=2))
    coupling.restore_elements(elements, folder)
    coupled = coupling.VolumeCoupling(run, elements, [0, 1], reference=np.load(folder / "reference.npy"))
    coupled.step(steps)
    return run, elements


def test_a_volume_coupling_goes_on_from_the_files_of_a_failure(tmp_path):
    whole, elements = spinning()
    coupling.VolumeCoupling(whole, elements, [0, 1]).step(60)
    run, failing = spinning()
    coupled = coupling.VolumeCoupling(run, failing, [0, 1], rescue=tmp_path)
    coupled.step(25)
    # A load that is not finite is refused before the nodes move: both sides are still at one instant.
    step, failing.step = failing.step, lambda force: step(force + np.nan)
    with pytest.raises(concordem.CouplingError, match="is not finite") as caught:
        coupled.step()
    assert "particles.h5 (step 25), reference.npy, elements-0.pickle" in caught.value.__notes__[0]
    again, other = went_on(tmp_path, 35)
    assert again.state_hash() == whole.state_hash()
    assert np.array_equal(other.displacement, elements.displacement) and np.array_equal(other.velocity, elements.velocity)


def test_a_run_goes_on_after_ctrl_c_with_the_same_bits(tmp_path):
    whole, elements = spinning()
    coupling.VolumeCoupling(whole, elements, [0, 1]).step(60)
    run, interrupted = spinning()
    coupled = coupling.VolumeCoupling(run, interrupted, [0, 1], rescue=tmp_path)
    step = interrupted.step

    def press(force):
        if interrupted.steps == 30:
            # In the middle of a step: the elements have not moved yet.
            signal.raise_signal(signal.SIGINT)
        step(force)

    interrupted.step = press
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt) as caught:
        coupled.step(60)
    assert signal.getsignal(signal.SIGINT) is before
    # The step was finished on both sides.
    assert run.state.step == interrupted.steps == 31
    assert "particles.h5 (step 31), reference.npy" in caught.value.__notes__[0]
    again, other = went_on(tmp_path, 29)
    assert again.state_hash() == whole.state_hash()
    assert np.array_equal(other.displacement, elements.displacement)
    # The interrupted coupling itself goes on, too.
    coupled.step(29)
    assert run.state_hash() == whole.state_hash()


def test_a_second_ctrl_c_acts_at_once(tmp_path):
    run, elements = spinning()
    coupled = coupling.VolumeCoupling(run, elements, [0, 1], rescue=tmp_path)

    def hangs(force):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("the second one is not heard")

    elements.step = hangs
    with pytest.raises(KeyboardInterrupt):
        coupled.step()
    assert (tmp_path / "particles.h5").exists()


@pytest.mark.parametrize("layers", [False, True])
def test_cells_at_integration_points_are_in_the_files(tmp_path, layers):
    import skfem

    def start():
        mesh = skfem.MeshHex.init_tensor([0, 1e-2], [0, 1e-2], [0, 1e-2, 2e-2])
        cells = coupling.RepresentativeCells(cells_of.lattice_scenario(normal_strength=1.0), 8 if layers else 16)
        material = coupling.CellMaterial(cells, 2)
        if layers:
            material = coupling.Layers([coupling.Elastic(1e7, 0.2, 2000.0), material], [0, 1])
        return coupling.ScikitDynamics(mesh, material, safety=0.5), cells

    elements, cells = start()
    elements.velocity[:, 2] = 0.5 * elements.nodes[:, 2]
    for _ in range(5):
        elements.step()
    names = coupling.write_elements(elements, tmp_path)
    assert names == ["elements-0.pickle", "elements-0-cells-0"]
    other, others = start()
    coupling.restore_elements(other, tmp_path)
    assert others.state_hashes() == cells.state_hashes()
    for one in (elements, other):
        for _ in range(5):
            one.step()
    assert others.state_hashes() == cells.state_hashes() and np.array_equal(other.displacement, elements.displacement)
    # The last bond is lost: the cells keep their states, and both sides can still be written.
    elements.fixed[:] = True
    elements.prescribed[:] = 2e-4 / elements.time_step * elements.nodes
    with pytest.raises(concordem.ContinuumError, match="lost its last bond"):
        for _ in range(20):
            elements.step()
    (tmp_path / "after").mkdir()
    coupling.write_elements(elements, tmp_path / "after")
    coupling.restore_elements(other, tmp_path / "after")
    assert others.state_hashes() == cells.state_hashes() and other.steps == elements.steps


def test_a_run_that_ends_leaves_both_sides_at_one_step(tmp_path):
    elements = volume.bar()
    coupled = coupling.VolumeCoupling(volume.chain(0.0, 0.0, stop={"steps": 2}), elements, [0], rescue=tmp_path)
    failed(concordem.CouplingError, "has ended; give", tmp_path, coupled)
    assert elements.steps == coupled.simulation.state.step == 2


def test_surface_and_contact_couplings_end_a_step_before_ctrl_c(tmp_path):
    run, elements, skin = surface.bombarded()
    bodies_run, bodies = contact.colliding()
    for coupled, sides in [(coupling.SurfaceCoupling(run, elements, skin, rescue=tmp_path / "s"), [elements]),
                           (coupling.ContactCoupling(bodies_run, bodies, rescue=tmp_path / "c"), [body.elements for body in bodies])]:
        step = sides[-1].step

        def press(force):
            if sides[-1].steps == 3:
                signal.raise_signal(signal.SIGINT)
            step(force)

        sides[-1].step = press
        with pytest.raises(KeyboardInterrupt):
            coupled.step(10)
        assert {side.steps for side in sides} == {coupled.simulation.state.step} == {4}
    other, others = contact.colliding()
    for number, body in enumerate(others):
        coupling.restore_elements(body.elements, tmp_path / "c", number)
        assert np.array_equal(body.elements.velocity, bodies[number].elements.velocity)


LATTICE = {"kind": "lattice", "lattice": "sc", "radius": "1 mm", "repeats": [2, 2, 2]}
SPRING = {"name": "m", "density": 2500.0, "linear_bond": {"normal_stiffness": 1e4, "shear_stiffness": 3e3}}
GLASS = SPRING | {"thermal": {"conductivity": 1.0, "specific_heat": 900.0}}
DISCS = {"kind": "spheres", "spheres": [[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3]]}
COUPLINGS = {
    "contact": lambda simulation: coupling.ContactCoupling(simulation, []),
    "surface": lambda simulation: coupling.SurfaceCoupling(simulation, None, None),
    "volume": lambda simulation: coupling.VolumeCoupling(simulation, None, [0]),
    "preCICE": lambda simulation: precice.VolumeParticipant.__bases__[0](simulation, None, "Particle-Mesh", [], [], np.zeros((1, 3)), None),
}


@pytest.mark.parametrize("name", COUPLINGS)
@pytest.mark.parametrize(
    ("tables", "remedy"),
    [({"packing": LATTICE | {"shape": {"kind": "periodic"}}}, "remove the periodic cell"),
     ({"packing": DISCS, "dimension": 2}, "remove dimension = 2"),
     ({"packing": LATTICE, "material": GLASS, "heat": {"model": "ordered", "temperature": 293.0}}, r"remove \[heat\]")],
)
def test_every_coupling_refuses_what_it_does_not_know(name, tables, remedy):
    scenario = {"material": SPRING, "bonds": {"law": "linear_bond", "interaction_ratio": 1.1}, "contacts": {"law": "none"}, "stop": {"steps": 10}}
    simulation = concordem.Scenario(**(scenario | tables)).simulation()
    with pytest.raises(concordem.CouplingError, match=remedy):
        COUPLINGS[name](simulation)
