"""Couplings with finite elements: laws at points, finite elements, the hand-over.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import threading

import concordem
import numpy as np
import pytest
from concordem import coupling
from concordem.coupling._protocol import cross
from test_cells import cell_scenario, rotation

LAW = coupling.DamagePlastic(30e9, 0.2, 30e6, 3e6, 200.0)


def skfem():
    return pytest.importorskip("skfem")


def test_cross_products_have_the_bits_of_numpy():
    random = np.random.default_rng(3)
    a, b = random.normal(size=(2, 4, 5, 3)) * 10.0 ** random.integers(-8, 8, size=(2, 4, 5, 3))
    for left, right in ((a, b), (a[:, :1], b), (a, b[0, 0]), (a[0, 0], b[0, 0])):
        assert cross(left, right).tobytes() == np.cross(left, right).tobytes()


# ---- The damage-plastic model --------------------------------------------------------------------------------------------------


def test_points_are_independent_and_states_continue_bit_by_bit():
    random = np.random.default_rng(1)
    first = random.normal(scale=3e-4, size=(50, 3, 3))
    first += first.transpose(0, 2, 1)
    one = LAW.update(first, np.zeros((50, 8)), 0.1)
    assert one.stress.shape == (50, 3, 3) and one.tangent.shape == (50, 6, 6) and one.damage.max() > 0.1
    second = first * 1.2
    whole = LAW.update(second, one.state, 0.1)
    # One point at a time, from states that went through a file's bytes.
    states = np.frombuffer(one.state.tobytes()).reshape(50, 8)
    for k in range(50):
        alone = LAW.update(second[k : k + 1], states[k : k + 1], np.array([0.1]))
        assert np.array_equal(alone.stress[0], whole.stress[k]) and np.array_equal(alone.tangent[0], whole.tangent[k])
    assert LAW.update(second, one.state, 0.1, tangent=False).tangent is None


def test_point_errors_name_the_point_and_the_remedy():
    strain = np.zeros((3, 3, 3))
    strain[2, 0, 0] = np.nan
    with pytest.raises(concordem.ContinuumError, match="number 2: the strain is not finite"):
        LAW.update(strain, np.zeros((3, 8)), 0.1)
    with pytest.raises(concordem.ContinuumError, match="snaps back"):
        LAW.update(np.zeros((1, 3, 3)), np.zeros((1, 8)), 0.7)
    with pytest.raises(concordem.ContinuumError, match="compressive_strength is -3"):
        coupling.DamagePlastic(30e9, 0.2, -30e6, 3e6, 100.0)
    for strain, state, size in [
        (np.zeros((2, 3, 3)), np.zeros((1, 8)), 0.1),
        (np.zeros((2, 3, 3)), np.zeros((2, 7)), 0.1),
        (np.zeros((2, 2, 3)), np.zeros((2, 8)), 0.1),
        (np.zeros((2, 3, 3)), np.zeros((2, 8)), [0.1]),
    ]:
        with pytest.raises(ValueError, match="shape|rows"):
            LAW.update(strain, state, size)
    with pytest.raises(ValueError, match='give "printed" or "coded"'):
        coupling.handover_damage(np.zeros((1, 3, 3)), "code")


def test_hand_over_returns_the_stress():
    stress = np.diag([-5e6, 1e6, 0.5e6])[None]
    states = LAW.hand_over(stress, [0.2], 0.1)
    update = LAW.update(np.zeros((1, 3, 3)), states, 0.1)
    assert np.allclose(update.stress, stress, rtol=1e-12, atol=1e-6) and update.damage[0] == pytest.approx(0.2, rel=1e-12)
    # Table 6.1 of Stránský 2018, and the same links with the coded formula: 12/2 for 15/2.
    printed = coupling.handover_tensor(np.eye(3), [1.0, 0.0, 0.0])
    assert np.allclose(np.diag(printed), [2, -0.5, -0.5], atol=1e-15)
    assert np.allclose(np.diag(coupling.handover_tensor(np.eye(3), [1.0, 0.0, 0.0], "coded")), [1.5, -0.5, -0.5], atol=1e-15)


def test_hand_over_of_a_specimen_takes_its_mean_stress(concrete, two):
    specimen = concrete.simulation()
    specimen.step(400)
    positions = specimen.state.positions
    low, high = positions.min(axis=0), positions.max(axis=0)
    region = concordem.operators.Region.box(low * 0.5 + high * 0.5 - 4e-3, low * 0.5 + high * 0.5 + 4e-3)
    given = coupling.hand_over(specimen, LAW, [region], 0.1)
    stress = concordem.operators.region_stress(positions, specimen.forces().contacts, region).stress
    assert np.allclose(given.stress[0], 0.5 * (stress + stress.T), rtol=1e-12, atol=1e-6) and np.abs(stress).max() > 1e4
    bonds = specimen.bonds()
    inside = np.array([region.contains(point) for point in bonds.midpoint])
    assert given.bonds[0] == inside.sum() > 100
    tensor = concordem.operators.damage_tensor(bonds.normal[inside], bonds.lost_strength[inside])
    assert np.allclose(given.damage_tensor[0], tensor, rtol=0, atol=1e-13)
    start = LAW.update(np.zeros((1, 3, 3)), given.states, 0.1)
    assert np.allclose(start.stress, given.stress, rtol=1e-9, atol=1.0)
    # Twice the volume, half the stress.
    twice = coupling.hand_over(specimen, LAW, [region], 0.1, volumes=[2 * region.volume])
    assert np.allclose(twice.stress, 0.5 * given.stress, rtol=1e-12, atol=1e-9)
    with pytest.raises(concordem.CouplingError, match="region 0 contains no bond"):
        coupling.hand_over(specimen, LAW, [concordem.operators.Region.sphere(high + 1, 1e-3)], 0.1)
    with pytest.raises(concordem.CouplingError, match="law cpm"):
        coupling.hand_over(two.simulation(), LAW, [region], 0.1)
    with pytest.raises(concordem.CouplingError, match="RepresentativeCells"):
        coupling.hand_over(cell_scenario().simulation(), LAW, [region], 0.1)


def test_motion_set_from_outside_moves_prescribed_particles_only(two):
    tables = two.to_dict() | {
        "set": [{"name": "left", "selection": {"kind": "box", "minimum": [-1, -1, -1], "maximum": [1e-4, 1, 1]}}],
        "prescribe": [{"set": "left", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}],
    }
    simulation = concordem.Scenario.from_dict(tables).simulation()
    velocity, angular = np.full((2, 3), 1e-3), np.full((2, 3), 2.0)
    simulation.set_motion(velocity, angular)
    start = simulation.state.positions.copy()
    simulation.step(1)
    dt = simulation.state.time_step
    assert np.allclose(simulation.state.positions[0] - start[0], velocity[0] * dt, rtol=1e-9)
    assert np.array_equal(simulation.state.angular_velocities[0], angular[0])
    # The bond had no strain in the first step, so the free particle has not moved.
    assert np.array_equal(simulation.state.positions[1], start[1])
    for bad in [(velocity[:1], angular), (velocity * np.nan, angular)]:
        with pytest.raises(ValueError):
            simulation.set_motion(*bad)


# ---- Finite elements -----------------------------------------------------------------------------------------------------------

KINDS = ["hex", "tet", "quad", "tri"]


def block(kind, counts=(3, 2, 2), size=(1.0, 0.8, 0.6)):
    fem = skfem()
    lines = [np.linspace(0, s, n + 1) for n, s in zip(counts, size)]
    return {"hex": lambda: fem.MeshHex.init_tensor(*lines), "tet": lambda: fem.MeshTet.init_tensor(*lines),
            "quad": lambda: fem.MeshQuad.init_tensor(*lines[:2]), "tri": lambda: fem.MeshTri.init_tensor(*lines[:2])}[kind]()


def elements(kind, material=None, **options):
    plane = {} if kind in ("hex", "tet") else {"plane": "strain"}
    return coupling.ScikitDynamics(block(kind), material or coupling.Elastic(1e9, 0.3, 2000.0), **(plane | options))


def test_integration_points_are_in_their_elements():
    fem = coupling.ScikitDynamics(skfem().MeshHex.init_tensor([0, 2], [0, 2], [0, 2, 4]), coupling.Elastic(1e6, 0.2, 1.0))
    fem.displacement[:] = 0.1 * fem.nodes
    points = fem.points()
    # Gauss points of two per axis, at 1 -+ 1/sqrt(3), stretched by 1.1.
    gauss = 1.1 * (1 + np.array([-1, 1]) / np.sqrt(3))
    assert np.allclose(np.unique(np.round(points[:8], 12)), gauss, rtol=0, atol=1e-12)
    assert np.allclose(np.unique(np.round(points[8:, 2], 12)), gauss + 2.2, rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_rotation_gives_no_stress_and_affine_stretch_the_exact_force(kind):
    fem = elements(kind)
    turn = rotation([0, 0, 2.0]) if fem.dimension == 2 else rotation([1.0, 2.0, -0.5])
    fem._displacement = fem.nodes @ turn.T - fem.nodes
    # Rounding of 1e9 Pa.
    assert np.abs(fem.internal_forces()).max() < 1e-5
    # Stretch, then rotation: P = F S with the closed form of S.
    stretch = np.diag([1.01, 0.98, 1.0])
    gradient = turn @ stretch
    fem._displacement = fem.nodes @ (gradient - np.eye(3)).T
    strain = 0.5 * (stretch**2 - np.eye(3))
    lame, shear = 1e9 * 0.3 / (1.3 * 0.4), 1e9 / 2.6
    stress = gradient @ (lame * np.trace(strain) * np.eye(3) + 2 * shear * strain)
    forces = fem.internal_forces()
    right = np.isclose(fem.nodes[:, 0], 1.0)
    area = 0.8 * (1.0 if fem.dimension == 2 else 0.6)
    assert np.allclose(forces[right].sum(axis=0), stress[:, 0] * area, rtol=1e-9, atol=1e-3)
    # Sum of forces and of moments: rounding of 1e7 N.
    place = fem.nodes + fem.displacement
    assert np.abs(forces.sum(axis=0)).max() < 1e-6 and np.abs(np.cross(place, forces).sum(axis=0)).max() < 1e-6
    assert fem.mass.sum() == pytest.approx(2000.0 * 0.8 * (1.0 if fem.dimension == 2 else 0.6), rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_energy_and_momentum_balance(kind):
    fem = elements(kind, safety=0.5)
    random = np.random.default_rng(4)
    plane = fem.dimension == 2
    fem.velocity[:] = random.normal(size=fem.nodes.shape) * [1, 1, 0 if plane else 1]
    force = 1e3 * random.normal(size=fem.nodes.shape) * [1, 1, 0 if plane else 1]
    before, impulse = fem.momentum(), np.zeros(3)
    total = fem.kinetic_energy
    worst = 0.0
    for _ in range(400):
        fem.step(force)
        impulse += fem.time_step * force.sum(axis=0)
        worst = max(worst, abs(fem.balance))
        total = max(total, fem.kinetic_energy + abs(fem.internal_work))
    assert np.abs(fem.momentum() - before - impulse).max() < 1e-10 * np.abs(impulse).max() + 1e-9
    assert worst < 1e-11 * total


@pytest.mark.parametrize("kind", KINDS)
def test_work_of_internal_forces_is_stored(kind):
    fem = elements(kind, safety=0.4)
    fem.velocity[:, 0] = 10 * fem.nodes[:, 0] * fem.nodes[:, 1]
    start = fem.kinetic_energy
    for _ in range(100):
        fem.step()
    # The last half step is open.
    work = fem.internal_work + 0.5 * fem.time_step * np.vdot(fem.internal_forces(), fem.velocity)
    assert fem.stored_energy() > 0.01 * start
    # Measured 1e-5 and less, of the order (omega dt)² of the slow modes; without the half step it is 1e-2.
    assert abs(work - fem.stored_energy()) < 1e-4 * start


def test_angular_momentum_is_conserved_without_loads():
    fem = elements("hex", safety=0.5)
    fem.velocity[:] = np.cross([0.0, 30.0, 50.0], fem.nodes) + np.random.default_rng(5).normal(size=fem.nodes.shape)
    start = fem.angular_momentum()
    for _ in range(300):
        fem.step()
    # Internal forces have no moment about any point: P F^T is symmetric. The rest is rounding.
    assert np.abs(fem.angular_momentum() - start).max() < 1e-10 * np.abs(start).max()


def test_wave_in_a_bar_has_its_speed():
    fem = skfem()
    young, density, count = 1e9, 2000.0, 80
    mesh = fem.MeshHex.init_tensor(np.linspace(0, 1, count + 1), np.linspace(0, 0.02, 2), np.linspace(0, 0.02, 2))
    bar = coupling.ScikitDynamics(mesh, coupling.Elastic(young, 0.0, density), fixed=mesh.p[0] == 0)
    bar.velocity[:, 0] = 1e-3 * np.sin(np.pi * mesh.p[0] / 2)
    tip = int(np.argmax(mesh.p[0]))
    history = []
    for _ in range(2200):
        bar.step()
        history.append(bar.displacement[tip, 0])
    history = np.array(history)
    k = np.nonzero((history[:-1] > 0) & (history[1:] <= 0))[0]
    zeros = (k + history[k] / (history[k] - history[k + 1])) * bar.time_step
    period = np.diff(zeros).mean()
    # Mass lumping lowers the frequency by (pi/4/80)²/6, the time step raises it by as much at the stable one: less than 2e-5 together.
    assert period == pytest.approx(4 / np.sqrt(young / density), rel=2e-5)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_cantilever_has_the_frequency_of_quadratic_elements(plane):
    fem = skfem()
    from scipy.sparse.linalg import eigsh
    from skfem.models.elasticity import linear_elasticity

    young, poisson, density, height = 1e9, 0.3, 2000.0, 0.1
    shear, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    if plane == "stress":
        lame = 2 * lame * shear / (lame + 2 * shear)

    def lines(along, across):
        return fem.MeshQuad.init_tensor(np.linspace(0, 1, along + 1), np.linspace(0, height, across + 1))

    basis = fem.Basis(lines(40, 4), fem.ElementVector(fem.ElementQuad2()))
    stiffness = linear_elasticity(lame, shear).assemble(basis)
    mass = fem.BilinearForm(lambda u, v, w: density * (u[0] * v[0] + u[1] * v[1])).assemble(basis)
    free = basis.complement_dofs(basis.get_dofs(lambda x: x[0] == 0))
    square, mode = eigsh(stiffness[free][:, free], 1, mass[free][:, free], sigma=0.0)
    exact, shape = float(np.sqrt(square[0])), np.zeros(basis.N)
    shape[free] = mode[:, 0]
    probe = basis.interpolator(shape)

    errors = []
    for along, across in [(20, 2), (40, 4)]:
        mesh = lines(along, across)
        beam = coupling.ScikitDynamics(mesh, coupling.Elastic(young, poisson, density), plane=plane, fixed=mesh.p[0] == 0)
        beam.velocity[:, :2] = 1e-3 * probe(mesh.p).reshape(2, -1).T
        beam.velocity[beam.fixed] = 0
        tip = int(np.argmax(mesh.p.sum(axis=0)))
        values = [0.0]
        while len(values) < 3 or values[-1] * values[1] > 0:
            beam.step()
            values.append(beam.displacement[tip, 1])
        half = beam.time_step * (len(values) - 2 + values[-2] / (values[-2] - values[-1]))
        errors.append(np.pi / half / exact - 1)
    # Elements of first order lock in shear; their error falls as the square of the size, and the extrapolation leaves the next order.
    assert 3.0 < errors[0] / errors[1] < 5.0 and abs((4 * errors[1] - errors[0]) / 3) < 5e-3, errors


def test_saved_elements_continue_bit_by_bit():
    fem = elements("hex", coupling.Damaging(LAW, 2400.0), damping=5.0)
    fem.velocity[:] = 8 * fem.nodes
    for _ in range(60):
        fem.step()
    assert fem.material.damage.max() > 0
    saved = fem.save()
    for _ in range(20):
        fem.step()
    end = fem.displacement.copy(), fem.material.states.copy(), fem.balance
    fem.restore(saved)
    for _ in range(20):
        fem.step()
    assert np.array_equal(fem.displacement, end[0]) and np.array_equal(fem.material.states, end[1]) and fem.balance == end[2]


def test_prescribed_motion_does_the_work_of_the_energy():
    mesh = block("hex")
    ends = np.isclose(mesh.p[0], 0) | np.isclose(mesh.p[0], 1)
    fem = coupling.ScikitDynamics(mesh, coupling.Elastic(1e9, 0.0, 2000.0), fixed=ends, damping=2000.0)
    fem.prescribed[np.isclose(mesh.p[0], 1), 0] = 1e-3 / (2000 * fem.time_step)
    for _ in range(2000):
        fem.step()
    fem.prescribed[:] = 0
    for _ in range(3000):
        fem.step()
    # E/2 eps_Green² V: the strain is 1e-3, and the damping at this rate took its part of the work.
    strain = 1e-3 + 0.5e-6
    assert fem.stored_energy() == pytest.approx(0.5e9 * strain**2 * 0.48, rel=1e-6)
    assert fem.internal_work == pytest.approx(fem.stored_energy(), rel=1e-4)
    assert fem.prescribed_work == pytest.approx(fem.internal_work + fem.damping_loss, rel=1e-9)


def test_bad_meshes_and_numbers_are_refused():
    fem = skfem()
    mesh = fem.MeshTet().refined(1)
    places = mesh.p.copy()
    places[:, mesh.t[0, 0]] = places[:, mesh.t[1, 0]]
    with pytest.raises(concordem.CouplingError, match="has no volume"):
        coupling.ScikitDynamics(fem.MeshTet(places, mesh.t), coupling.Elastic(1e9, 0.2, 1.0))
    hexes = fem.MeshHex().refined(1)
    crossed = hexes.t.copy()
    crossed[[0, 1], 0] = crossed[[1, 0], 0]
    with pytest.raises(concordem.CouplingError, match="element 0 .* inverted at a corner"):
        coupling.ScikitDynamics(fem.MeshHex(hexes.p, crossed), coupling.Elastic(1e9, 0.2, 1.0))
    with pytest.raises(ValueError, match="plane"):
        coupling.ScikitDynamics(fem.MeshQuad(), coupling.Elastic(1e9, 0.2, 1.0))
    with pytest.raises(ValueError, match="first order"):
        coupling.ScikitDynamics(fem.MeshLine(), coupling.Elastic(1e9, 0.2, 1.0))
    with pytest.raises(concordem.CouplingError, match="at most the stable one"):
        elements("hex", time_step=1.0)
    with pytest.raises(concordem.ContinuumError, match="refine the mesh"):
        elements("hex", coupling.Damaging(coupling.DamagePlastic(30e9, 0.2, 30e6, 3e6, 50.0), 2400.0))
    with pytest.raises(ValueError, match="Elastic material"):
        elements("quad", coupling.Damaging(LAW, 2400.0), plane="stress")
    for arguments in [{"young": 0.0, "poisson": 0.2}, {"young": 1e9, "poisson": 0.5}, {"stiffness": np.eye(5)}, {"stiffness": -np.eye(6)}, {}]:
        with pytest.raises(ValueError):
            coupling.Elastic(density=1.0, **arguments)
    body = elements("tet")
    body.velocity[0] = -1e5
    with pytest.raises(concordem.CouplingError, match="inverted"):
        for _ in range(100):
            body.step()
    with pytest.raises(ValueError, match=r"force has shape \(1, 3\)"):
        body.step(np.zeros((1, 3)))


def test_cells_as_material_follow_the_elements():
    # One hexahedron in uniform strain, driven by prescribed nodes, with a cell in each of its eight points.
    mesh = skfem().MeshHex()
    cells = coupling.RepresentativeCells(cell_scenario(), 8)
    material = coupling.CellMaterial(cells, steps=4)
    fem = coupling.ScikitDynamics(mesh, material, fixed=np.ones(8, bool))
    fem.prescribed[:, 2] = 1e-5 * mesh.p[2] / (200 * fem.time_step)
    for _ in range(200):
        fem.step()
    fem.prescribed[:] = 0
    # At rest after 100 steps.
    for _ in range(150):
        fem.step()
    modulus = cells.stiffness()[0][2, 2]
    top = fem.internal_forces()[mesh.p[2] == 1, 2].sum()
    # Geometry changes by the strain, 1e-5, times the stiffness ratio.
    assert top == pytest.approx(1e-5 * modulus, rel=1e-4)
    with pytest.raises(concordem.CouplingError, match="8 cells for 64"):
        coupling.ScikitDynamics(mesh.refined(1), coupling.CellMaterial(coupling.RepresentativeCells(cell_scenario(), 8)))


# ---- Your own finite elements, and checks of pairs -----------------------------------------------------------------------------


def test_callback_elements_are_checked():
    calls = []

    def step(force):
        calls.append(force.copy())
        return force * 2, force

    own = coupling.CallbackElements([[0, 0, 0], [1, 0, 0]], 1e-3, step)
    assert isinstance(own, coupling.FiniteElements)
    own.step([[1, 0, 0], [0, 0, 0]])
    assert own.displacement[0, 0] == 2 and own.velocity[0, 0] == 1 and len(calls) == 1
    with pytest.raises(concordem.CouplingError, match="save and restore"):
        own.save()
    with pytest.raises(ValueError, match=r"displacement of the callback has shape \(1, 3\)"):
        coupling.CallbackElements([[0, 0, 0], [1, 0, 0]], 1e-3, lambda force: (force[:1], force)).step()
    with pytest.raises(concordem.CouplingError, match="not finite in row 1"):
        coupling.CallbackElements([[0, 0, 0], [1, 0, 0]], 1e-3, lambda force: (force, [[0, 0, 0], [np.nan, 0, 0]])).step()


def test_pairs_that_do_not_fit_are_refused():
    own = coupling.CallbackElements([[0, 0, 0], [1, 1, 1]], 1e-3, lambda force: (force, force))
    particles = np.array([[1.0, 1, 1], [2, 2, 2]])
    assert coupling.check_pair(own, particles, 1e-4, 0.1) == 10
    with pytest.raises(concordem.CouplingError, match="in meters"):
        coupling.check_pair(own, particles * 1e4, 1e-4, 1e9)
    with pytest.raises(concordem.CouplingError, match="apart"):
        coupling.check_pair(own, particles + 1, 1e-4, 0.1)
    with pytest.raises(concordem.CouplingError, match="give the elements"):
        coupling.check_pair(own, particles, 3e-4, 0.1)


def test_pictures_read_back(tmp_path):
    vtk = pytest.importorskip("vtk")
    mesh = block("hex")
    order = [6, 2, 0, 3, 7, 4, 1, 5]
    coupling.write_vtk(tmp_path / "a.vtu", mesh.p.T, mesh.t.T[:, order], "hexahedron",
                       {"u": mesh.p.T * 0.1}, {"damage": np.arange(mesh.t.shape[1])})
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "a.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfPoints() == mesh.p.shape[1] and grid.GetNumberOfCells() == mesh.t.shape[1]
    quality = vtk.vtkCellSizeFilter()
    quality.SetInputData(grid)
    quality.Update()
    volume = quality.GetOutput().GetCellData().GetArray("Volume")
    total = sum(volume.GetValue(k) for k in range(mesh.t.shape[1]))
    # A wrong order of nodes gives another volume.
    assert total == pytest.approx(0.48, rel=1e-9)
    coupling.write_vtk(tmp_path / "b.vtu", [[0, 0, 0], [1, 2, 3]], point_data={"radius": [1, 2]})
    with pytest.raises(ValueError, match="3 rows|rows; give 2"):
        coupling.write_vtk(tmp_path / "c.vtu", [[0, 0, 0], [1, 2, 3]], point_data={"radius": [1, 2, 3]})


def test_elements_can_run_in_threads():
    own = [elements("quad") for _ in range(2)]
    for fem in own:
        fem.velocity[:, 0] = fem.nodes[:, 1]
    threads = [threading.Thread(target=lambda fem=fem: [fem.step() for _ in range(50)]) for fem in own]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(own[0].displacement, own[1].displacement)


# ---- Examples of the book ------------------------------------------------------------------------------------------------------


def test_layers_of_the_multiscale_column_have_their_oedometric_stress(import_example):
    multiscale_column = import_example("multiscale_column")
    rows, _, balance = multiscale_column.column(1e-4, 150)
    # Measured 0.9998, 0.9992, 0.9998 of the modulus: the geometry of the cells changes by the strain times some 10.
    for row in rows:
        assert row["stress"] == pytest.approx(row["modulus"] * row["strain"], rel=2e-3)
    # In equilibrium the same force passes through all layers.
    assert rows[0]["stress"] == pytest.approx(rows[2]["stress"], rel=1e-5)
    assert balance < 1e-12


def test_layers_are_checked():
    one = coupling.Elastic(1e9, 0.2, 1.0)
    with pytest.raises(ValueError, match="do not fit"):
        coupling.Layers([one, one], [0, 0, 0])
    with pytest.raises(concordem.CouplingError, match="one index per element"):
        elements("hex", coupling.Layers([one], [0] * 11))
    # Equal layers are one material, bit for bit.
    plain, layered = elements("hex", one), elements("hex", coupling.Layers([one, one], [0, 1] * 6))
    for fem in (plain, layered):
        fem.velocity[:] = fem.nodes
        for _ in range(10):
            fem.step()
    assert np.array_equal(plain.displacement, layered.displacement)
