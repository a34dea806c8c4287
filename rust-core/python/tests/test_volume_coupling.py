"""Volume coupling: points in elements, forces and moments on nodes, particles that move with elements.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import concordem
import numpy as np
import pytest
from concordem import coupling

TETRAHEDRON = np.array([[0, 0, 0], [1, 0.1, 0], [0.1, 1.2, 0], [0, 0.2, 0.9]])
HEXAHEDRON = np.array([[0, 0, 0], [1, 0, 0.1], [1.1, 1, 0], [0, 0.9, 0], [0, 0.1, 1], [1, 0, 1.2], [1, 1, 1], [-0.1, 1, 1]])


# ---- Points in elements --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("corners", [TETRAHEDRON, HEXAHEDRON], ids=["tet", "hex"])
def test_force_moment_and_power_are_those_of_the_points(corners):
    random = np.random.default_rng(1)
    share = random.dirichlet(np.ones(len(corners)), size=20)
    points = share @ corners
    embedding = coupling.Embedding(corners, [list(range(len(corners)))], points)
    displacement = 0.05 * random.normal(size=corners.shape)
    assert np.allclose(embedding.positions(np.zeros_like(corners)), points, rtol=0, atol=1e-14)
    force, moment = random.normal(size=(20, 3)), random.normal(size=(20, 3))
    gradients = embedding.gradients(displacement)
    nodal = embedding.distribute(force, moment, gradients)
    places, present = embedding.positions(displacement), corners + displacement
    # Rounding of sums of about 20 terms of size 1 to 10.
    assert np.allclose(nodal.sum(axis=0), force.sum(axis=0), rtol=0, atol=1e-12)
    assert np.allclose(np.cross(present, nodal).sum(axis=0), (np.cross(places, force) + moment).sum(axis=0), rtol=0, atol=1e-12)
    velocity = random.normal(size=corners.shape)
    moved, spin = embedding.motion(velocity, gradients)
    assert np.vdot(nodal, velocity) == pytest.approx(np.vdot(force, moved) + np.vdot(moment, spin), rel=1e-12)
    # A rigid motion: v = a + w x x.
    moved, spin = embedding.motion([1.0, 2.0, 3.0] + np.cross([0.3, -0.2, 0.5], present), gradients)
    assert np.allclose(spin, [0.3, -0.2, 0.5], rtol=0, atol=1e-13)
    assert np.allclose(moved, [1.0, 2.0, 3.0] + np.cross([0.3, -0.2, 0.5], places), rtol=0, atol=1e-13)


def test_points_and_elements_that_do_not_fit_are_refused():
    cells = [[0, 1, 2, 3]]
    with pytest.raises(concordem.CouplingError, match="point 1 at .* lies in no element"):
        coupling.Embedding(TETRAHEDRON, cells, [[0.1, 0.2, 0.1], [2, 2, 2]])
    with pytest.raises(concordem.CouplingError, match="lies in no element"):
        # Inside the box around the element, outside the element.
        coupling.Embedding(TETRAHEDRON, cells, [[0.9, 1.1, 0.8]])
    with pytest.raises(ValueError, match=r"\(m, 4\) or \(m, 8\)"):
        coupling.Embedding(TETRAHEDRON, [[0, 1, 2]], [[0.1, 0.2, 0.1]])
    with pytest.raises(ValueError, match="from 0 to 3"):
        coupling.Embedding(TETRAHEDRON, [[0, 1, 2, 4]], [[0.1, 0.2, 0.1]])
    embedding = coupling.Embedding(TETRAHEDRON, cells, [[0.1, 0.2, 0.1]])
    with pytest.raises(concordem.CouplingError, match="element 0 is inverted"):
        embedding.gradients(-2 * TETRAHEDRON * [1, 0, 0])


# ---- Particles in elements -----------------------------------------------------------------------------------------------------

STEP = 4e-6


def chain(*offsets, slave_end=0.5e-3, **tables):
    """Bonded spheres of 1 mm at x = -2, 0, 2, ... mm; those up to `slave_end` are prescribed."""
    spheres = [[2e-3 * (k - 1), offset, 0.0, 1e-3] for k, offset in enumerate(offsets)]
    return concordem.Scenario(**({
        "packing": {"kind": "spheres", "spheres": spheres},
        "material": {"name": "m", "density": 2500.0, "linear_bond": {"normal_stiffness": 1e4, "shear_stiffness": 3e3}},
        "bonds": {"law": "linear_bond", "interaction_ratio": 1.1},
        "contacts": {"law": "none"},
        "set": [{"name": "slaves", "selection": {"kind": "box", "minimum": [-1, -1, -1], "maximum": [slave_end, 1, 1]}}],
        "prescribe": [{"set": "slaves", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}],
        "integration": {"time_step": STEP},
        "stop": {"steps": 10**9},
    } | tables)).simulation(threads=1)


def bar(kind="Hex", young=1e7, poisson=0.3, along=3, across=2, **options):
    fem = pytest.importorskip("skfem")
    side = np.linspace(-2e-3, 2e-3, across + 1)
    lines = [np.linspace(-5e-3, 1e-3, along + 1), side, side]
    mesh = getattr(fem, f"Mesh{kind}").init_tensor(*lines)
    return coupling.ScikitDynamics(mesh, coupling.Elastic(young, poisson, 2500.0), STEP, **options)


def momenta(elements, simulation, slaves):
    """Linear and angular momentum of elements and free particles, at the half step."""
    state = simulation.state
    free = ~np.isin(state.ids, slaves)
    momentum = state.masses[free, None] * state.velocities[free]
    middle = state.positions[free] - 0.5 * STEP * state.velocities[free]
    spin = state.inertias[free].reshape(free.sum(), -1)[:, :1] * state.angular_velocities[free]
    return elements.momentum() + momentum.sum(axis=0), elements.angular_momentum() + (np.cross(middle, momentum) + spin).sum(axis=0)


# Beams have moments besides forces.
BEAMS = {"material": {"name": "m", "density": 2500.0, "cohesive_beam": {"young": 1e7, "poisson": 0.2, "radius_ratio": 0.9}},
         "bonds": {"law": "cohesive_beam", "interaction_ratio": 1.1}}


DEFORMABLE = {"material": {"name": "m", "density": 2500.0, "linear_bond": {"normal_stiffness": 1e4, "shear_stiffness": 3e3},
                           "deformable": {"young": 2e7, "poisson": 0.25}}}


@pytest.mark.parametrize(("kind", "tables"), [("Hex", {}), ("Tet", {}), ("Hex", BEAMS), ("Hex", DEFORMABLE)],
                         ids=["hex", "tet", "beams", "deformable"])
def test_momentum_and_work_pass_the_interface_without_loss(kind, tables):
    simulation = chain(0.0, 2e-4, -1e-4, 3e-4, 0.0, **tables)
    elements = bar(kind)
    elements.velocity[:] = np.cross([10.0, -20.0, 30.0], elements.nodes) + [0.1, 0.2, 0.0]
    volume = coupling.VolumeCoupling(simulation, elements, [0, 1])
    volume.step()
    start = momenta(elements, simulation, volume.slaves)
    kinetic = elements.kinetic_energy
    largest, lost = np.zeros(3), np.zeros(3)
    for _ in range(500):
        volume.step()
        last = volume.last
        sizes = [np.abs(last.force).max(), np.abs(last.moment).max(), abs(last.work)]
        largest = np.maximum(largest, sizes)
        lost = np.maximum(lost, [np.abs(last.lost_force).max(), np.abs(last.lost_moment).max(), abs(last.lost_work)])
    # Rounding of sums over tens of terms.
    assert (lost < 1e-13 * largest).all(), lost / largest
    end = momenta(elements, simulation, volume.slaves)
    # The free particles were at rest, and have taken up a part.
    assert abs(volume.work) > 1e-3 * kinetic
    for before, after in zip(start, end):
        # Rounding of 500 steps.
        assert np.abs(after - before).max() < 1e-11 * np.abs(before).max()
    assert abs(elements.balance) < 1e-11 * kinetic


@pytest.mark.parametrize("tables", [{}, BEAMS], ids=["springs", "beams"])
def test_work_of_the_interface_is_a_term_of_both_ledgers(tables):
    # One slave: bonds between slaves store a part of the boundary work that the elements do not see.
    simulation = chain(0.0, 2e-4, -1e-4, 3e-4, 0.0, slave_end=-1e-3, **tables, output={"sample_interval": 1})
    elements = bar()
    elements.velocity[:] = np.cross([10.0, -20.0, 30.0], elements.nodes) + [0.1, 0.2, 0.0]
    volume = coupling.VolumeCoupling(simulation, elements, [0])

    def motion():
        rows = np.isin(simulation.state.ids, [0])
        return np.array(simulation.state.velocities[rows]), np.array(simulation.state.angular_velocities[rows])

    def held(before):
        """Kinetic energy of the slaves at the instant between two half steps: the prescribed motion gives it to them."""
        state, now = simulation.state, motion()
        rows = np.isin(state.ids, [0])
        inertia = state.inertias.reshape(len(state), -1)[rows, :1]
        return 0.5 * float((state.masses[rows, None] * before[0] * now[0]).sum() + (inertia * before[1] * now[1]).sum())

    start = held(motion())
    volume.step(299)
    last = motion()
    nodal = volume.embedding.distribute(*volume.forces(), volume.embedding.gradients(elements.displacement))
    volume.step()
    assert volume.work == pytest.approx(elements.external_work, rel=1e-12)
    # The ledger of the particles ends at the last instant of forces, half a step before the work.
    half = 0.5 * STEP * float(np.vdot(nodal, elements.velocity))
    given = simulation.samples["boundary_work"][-1] - (held(last) - start)
    size = np.abs(simulation.samples["boundary_work"]).max()
    assert abs(volume.work) > 1e-3 * size
    # The trapezoidal rule of the bonds errs by up to (omega dt)^2/12 = 3e-3 of the energy that swings; measured 5e-6.
    assert given == pytest.approx(-(volume.work - half), rel=1e-4)
    # Both ledgers close, that of the particles with this error.
    assert abs(elements.balance) < 1e-11 * elements.kinetic_energy
    assert np.abs(simulation.samples["residual"]).max() < 1e-3 * size


def test_walls_and_loads_on_free_particles_give_their_impulse():
    # A chain with its bar flies along x; a plane stops its end, and a load pulls the middle along y.
    plane = {"name": "stop", "material": "m", "shape": {"kind": "plane", "point": [7.01e-3, 0, 0], "normal": [-1, 0, 0]}}
    sets = [{"name": "slaves", "selection": {"kind": "ids", "ids": [0, 1]}}, {"name": "middle", "selection": {"kind": "ids", "ids": [3]}}]
    simulation = chain(*[0.0] * 5, contacts={"law": "linear_bond"}, wall=[plane], set=sets, force=[{"set": "middle", "force": [0, 0.02, 0]}])
    elements = bar()
    elements.velocity[:] = [0.05, 0, 0]
    simulation.state.writable("velocities")[:] = [0.05, 0, 0]
    volume = coupling.VolumeCoupling(simulation, elements, [0, 1])
    start, given, touched = momenta(elements, simulation, volume.slaves)[0], np.zeros(3), 0
    for _ in range(300):
        on_wall = simulation.forces().walls.force
        touched += len(on_wall) > 0 and bool(on_wall.any())
        given += STEP * (on_wall.sum(axis=0) + [0, 0.02, 0])
        volume.step()
    assert touched > 20
    # Rounding of 300 steps.
    assert np.abs(momenta(elements, simulation, volume.slaves)[0] - start - given).max() < 1e-12 * np.abs(start).max()


def pulled(**options):
    """Chain of five spheres, two of them in a bar; the last one is prescribed."""
    sets = {"slaves": ([-1, -1, -1], [5e-4, 1, 1]), "end": ([5e-3, -1, -1], [1, 1, 1])}
    return chain(
        *[0.0] * 5, integration={"time_step": STEP, "damping": {"kind": "local", "coefficient": 0.2}},
        set=[{"name": name, "selection": {"kind": "box", "minimum": low, "maximum": high}} for name, (low, high) in sets.items()],
        prescribe=[{"set": "slaves", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]},
                   {"set": "end", "velocity": options.get("velocity", [0, 0, 0]), "angular_velocity": [0, 0, 0]}],
    )


def test_other_prescribed_particles_keep_their_velocity():
    simulation = pulled(velocity=[1e-4, 0, 0])
    volume = coupling.VolumeCoupling(simulation, bar(), [0, 1])
    volume.step(50)
    assert simulation.state.positions[np.argmax(simulation.state.ids), 0] == pytest.approx(6e-3 + 50 * STEP * 1e-4, rel=1e-12)


@pytest.mark.parametrize(("along", "error"), [(6, 0.0), (3, -0.25)], ids=["slave at a node", "slave between nodes"])
def test_chain_and_bar_in_tension_have_the_stiffness_of_the_chain(along, error):
    # A bar with the stiffness of the chain, E A = k l, without lateral strain. Its section is one element, so the force is uniform in it.
    # At nodes the extension is exact. In the middle of an element of length h, F goes to its two ends, and the shape functions cut the
    # kink of the displacement: F h/4 EA are missing, a quarter of a bond.
    area, stiffness, spacing, pull = 4e-3**2, 1e4, 2e-3, 1e-7
    ends = {"fixed": np.isclose(bar(along=along, across=1).nodes[:, 0], -5e-3)}
    elements = bar(young=stiffness * spacing / area, poisson=0.0, along=along, across=1, damping=1e4, **ends)
    simulation = pulled()
    volume = coupling.VolumeCoupling(simulation, elements, [0, 1])
    still, moving = np.zeros((5, 3)), np.zeros((5, 3))
    moving[simulation.state.ids == 4] = [pull / (100 * STEP), 0, 0]
    volume.step(100, motion=(moving, still))
    volume.step(1000, motion=(still, still))
    order = np.argsort(simulation.state.ids)
    shift = simulation.state.positions[order, 0] - spacing * np.arange(-1, 4)
    # Three bonds from the end to the slave, and 2.5 bonds' lengths of the bar. The strain of 1e-5 changes the stiffness of
    # the bar by as much: measured 8e-6.
    force = stiffness * pull / (3 + 2.5 + error)
    assert volume.last.force[0] == pytest.approx(force, rel=1e-4)
    assert shift[1] == pytest.approx((2.5 + error) * force / stiffness, rel=1e-4)


def test_translation_gives_no_force():
    simulation = chain(0.0, 0.0, 0.0)
    elements = bar()
    elements.velocity[:] = [0.3, -0.1, 0.2]
    simulation.state.writable("velocities")[:] = [0.3, -0.1, 0.2]
    volume = coupling.VolumeCoupling(simulation, elements, [0, 1])
    for _ in range(200):
        volume.step()
        # Stiffness times rounding of positions, 1e4 N/m times 1e-18 m, over 200 steps.
        assert np.abs(volume.last.force).max() < 1e-11


def test_run_continues_bit_by_bit(tmp_path):
    def start():
        elements = bar()
        elements.velocity[:] = np.cross([10.0, -20.0, 30.0], elements.nodes)
        return elements

    simulation, elements = chain(0.0, 2e-4, -1e-4, **BEAMS), start()
    volume = coupling.VolumeCoupling(simulation, elements, [0, 1])
    volume.step(40)
    simulation.save(tmp_path / "half.h5")
    saved = elements.save()
    volume.step(40)
    second, other = concordem.Simulation.load(tmp_path / "half.h5", threads=2), start()
    other.restore(saved)
    coupling.VolumeCoupling(second, other, [0, 1], reference=volume.reference).step(40)
    assert second.state_hash() == simulation.state_hash()
    assert np.array_equal(other.displacement, elements.displacement) and np.array_equal(other.velocity, elements.velocity)
    with pytest.raises(concordem.CouplingError, match="away from its place|lies in no element"):
        coupling.VolumeCoupling(second, other, [0, 1])


def test_walls_clumps_cells_and_planes_at_slaves_are_refused():
    floor = {"name": "floor", "shape": {"kind": "plane", "point": [0, 0, -1e-3], "normal": [0, 0, 1]}, "material": "m"}
    falling = bar()
    falling.velocity[:] = [0, 0, -0.5]
    touched = coupling.VolumeCoupling(chain(0.0, 0.0, contacts={"law": "linear_bond"}, wall=[floor]), falling, [0])
    with pytest.raises(concordem.CouplingError, match="a wall touches slave 0"):
        touched.step(5)
    clump = {"material": "m", "spheres": [[-2e-3, 0, 0, 5e-4], [-1.5e-3, 0, 0, 5e-4]]}
    far = {"kind": "spheres", "spheres": [[0.1, 0, 0, 1e-3], [0.102, 0, 0, 1e-3]]}
    with pytest.raises(concordem.CouplingError, match="slave 2 belongs to a clump"):
        coupling.VolumeCoupling(chain(packing=far, clump=[clump], set=[], prescribe=[]), bar(), [2, 3])
    fem = pytest.importorskip("skfem")
    plane = coupling.ScikitDynamics(fem.MeshQuad.init_tensor(np.linspace(-5e-3, 1e-3, 4), np.linspace(-2e-3, 2e-3, 3)),
                                    coupling.Elastic(1e7, 0.3, 2500.0), STEP, plane="strain")
    with pytest.raises(ValueError, match="elements in space"):
        coupling.VolumeCoupling(chain(0.0, 0.0), plane, [0])
    cell = concordem.Scenario(
        packing={"kind": "lattice", "lattice": "sc", "radius": "1 mm", "repeats": [2, 2, 2], "shape": {"kind": "periodic"}},
        material={"name": "m", "density": 2500.0, "linear_bond": {"normal_stiffness": 1e4, "shear_stiffness": 3e3}},
        bonds={"law": "linear_bond", "interaction_ratio": 1.1}, contacts={"law": "none"}, stop={"steps": 10}).simulation()
    with pytest.raises(concordem.CouplingError, match="remove the periodic cell"):
        coupling.VolumeCoupling(cell, bar(), [0])
    discs = {"material": {"name": "m", "density": 2500.0, "linear_bond": {"normal_stiffness": 1e4, "shear_stiffness": 3e3}}, "dimension": 2}
    with pytest.raises(concordem.CouplingError, match="remove dimension = 2"):
        coupling.VolumeCoupling(chain(0.0, 0.0, **discs), bar(), [0])


def test_pairs_that_do_not_fit_are_refused():
    elements = bar()
    with pytest.raises(concordem.CouplingError, match="no particle with the id 7"):
        coupling.VolumeCoupling(chain(0.0, 0.0), elements, [0, 7])
    with pytest.raises(concordem.CouplingError, match="point 2 at .* lies in no element"):
        coupling.VolumeCoupling(chain(0.0, 0.0, 0.0), elements, [0, 1, 2])
    with pytest.raises(concordem.CouplingError, match="time step of the particles"):
        coupling.VolumeCoupling(chain(0.0, 0.0, integration={"time_step": STEP / 2}), elements, [0, 1])
    with pytest.raises(concordem.CouplingError, match="does not rotate|away from its place"):
        # Not prescribed.
        free = coupling.VolumeCoupling(chain(0.0, 0.0, slave_end=-1e-3), elements, [0, 1])
        elements.velocity[:] = np.cross([0, 0, 50.0], elements.nodes)
        free.step(3)
    plane = coupling.CallbackElements(np.array(HEXAHEDRON) * 1e-3, STEP, lambda force: (force, force))
    with pytest.raises(ValueError, match="give cells"):
        coupling.VolumeCoupling(chain(0.0, 0.0), plane, [1])


@pytest.mark.parametrize(("overlap", "low", "high"), [(0.0, 0.8, 1.4), (1.0, 0.6, 1.4)])
def test_a_wave_reflects_as_the_overlap_lets_it(import_example, overlap, low, high):
    wave_overlap = import_example("wave_overlap")
    back, beyond, theory = wave_overlap.reflected(overlap, 8)
    # The theory is for a continuous bar. Dispersion of the chain adds a fifth at 8 spacings (a third at 6, a seventh at 10).
    assert low * theory < back < high * theory
    # What does not come back goes through.
    assert back + beyond == pytest.approx(1.0, abs=1e-3)
    # Half a spacing of overlap replaces the missing half of the particle.
    best, _, _ = wave_overlap.reflected(0.5, 8)
    assert best < 0.1 * back


def test_damping_takes_from_a_wave_what_its_way_through_the_elements_does(import_example):
    # Mass damping of a times the angular frequency: energies fall by exp(-2 pi a) per wavelength. The packet goes 3.5 wavelengths to the slave;
    # what is reflected has gone 7 at the end.
    wave_overlap = import_example("wave_overlap")
    (back, beyond, _), (damped, arrived, _) = (wave_overlap.reflected(0.0, 6, damping) for damping in (0.0, 0.03))
    # The packet is long: the parts of it that go farther and less far do not cancel. Measured 0.95 and 0.98.
    assert damped / back == pytest.approx(np.exp(-2 * np.pi * 7 * 0.03), rel=0.1)
    assert arrived / beyond == pytest.approx(np.exp(-2 * np.pi * 3.5 * 0.03), rel=0.04)


def test_forces_of_a_border_are_those_of_its_contacts():
    simulation = chain(0.0, 2e-4, -1e-4, 3e-4, 0.0, **BEAMS)
    simulation.state.writable("velocities")[:] = np.random.default_rng(2).normal(size=(5, 3))
    simulation.step(20)
    every, rows = simulation.forces().contacts, [1, 2]
    crosses = np.isin(every.pair, rows).sum(axis=1) == 1
    assert 0 < crosses.sum() < len(crosses)
    border = simulation.forces(border=rows).contacts
    for one, other in zip(border, every):
        assert np.array_equal(one, other[crosses])
    assert len(simulation.forces(border=[]).contacts.force) == 0
    with pytest.raises(ValueError, match="border names row 5, but there are 5 particles"):
        simulation.forces(border=[5])
