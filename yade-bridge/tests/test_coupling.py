"""Couplings with finite elements: laws at points, representative cells, finite elements, the hand-over.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import threading

import concordem
import numpy as np
import pytest
from concordem import coupling

LAW = coupling.DamagePlastic(30e9, 0.2, 30e6, 3e6, 200.0)


def skfem():
    return pytest.importorskip("skfem")


def rotation(vector):
    """Rotation about a vector, by its angle in rad."""
    angle = np.linalg.norm(vector)
    x, y, z = np.asarray(vector) / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


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


# ---- Representative cells ------------------------------------------------------------------------------------------------------


def cell_scenario(**tables):
    cpm = {"young": "4 MPa", "shear_ratio": 0.2, "crack_onset_strain": 1.0, "relative_ductility": 10, "cohesion": "1 GPa",
           "friction_coefficient": 0.0}
    return concordem.Scenario(**({
        "packing": {"kind": "random-dense", "count": 60, "radius": "10 mm", "seed": 1, "shape": {"kind": "periodic", "tiles": [1, 1, 1]}},
        "material": {"name": "m", "density": "2000 kg/m^3", "cpm": cpm},
        "bonds": {"law": "cpm", "interaction_ratio": 1.5},
        "contacts": {"law": "cpm"},
        "integration": {"damping": {"kind": "local", "coefficient": 0.2}},
        "stop": {"steps": 10**9},
    } | tables))


def gradients(*strains):
    """Deformation gradients of small strains, components 11, 22, 33, 23, 31, 12 with engineering shears."""
    result = np.tile(np.eye(3), (len(strains), 1, 1))
    for gradient, (a, b, c, d, e, f) in zip(result, strains):
        gradient += [[a, f / 2, e / 2], [f / 2, b, d / 2], [e / 2, d / 2, c]]
    return result


def test_relaxed_cells_have_the_stress_of_their_stiffness():
    cells = coupling.RepresentativeCells(cell_scenario(), 6)
    strain = 1e-6
    strains = strain * np.eye(6)
    cells.deform(gradients(*strains), 400)
    cells.deform(gradients(*strains), 4000)
    response = cells.response()
    stress = response.stress
    found = np.stack([stress[:, i, j] for i, j in [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)]], axis=0) / strain
    wanted = cells.stiffness()[0]
    # The strain of 1e-6 changes the geometry by as much, times the stiffness ratio.
    assert np.abs(found - wanted).max() < 1e-5 * wanted.max()
    # In equilibrium the stress is symmetric, and the work is the elastic energy, up to what damping took.
    assert np.abs(stress - stress.transpose(0, 2, 1)).max() < 1e-6 * np.abs(stress).max()
    energy = 0.5 * np.diag(wanted) * strain**2 * response.volume
    assert (response.work > 0.98 * energy).all() and (response.work < 1.05 * energy).all()
    assert np.allclose(cells.deformation_gradient, gradients(*strains), rtol=0, atol=1e-14)


def test_rigid_rotation_of_a_cell_gives_no_stress():
    cells = coupling.RepresentativeCells(cell_scenario(), 1)
    for k in range(1, 21):
        cells.deform(rotation([0.0, 0.0, 0.05 * k])[None], 400)
    cells.deform(cells.deformation_gradient, 4000)
    # Between two gradients the cell follows the chord, which shortens it by 0.05²/8; it ends without strain.
    assert np.abs(cells.response().stress).max() < 1e-5 * cells.stiffness()[0].max()


def test_cells_do_not_depend_on_threads_and_continue_bit_by_bit():
    strains = 1e-3 * np.random.default_rng(2).normal(size=(5, 6))
    hashes = []
    for threads in (1, 2, 3):
        cells = coupling.RepresentativeCells(cell_scenario(), 5, threads=threads)
        cells.deform(gradients(*strains), 20)
        saved = cells.save()
        cells.deform(gradients(*(2 * strains)), 20)
        hashes.append(cells.state_hashes())
        cells.restore(saved)
        assert cells.state_hashes() != hashes[-1]
        cells.deform(gradients(*(2 * strains)), 20)
        assert cells.state_hashes() == hashes[-1]
    assert hashes[0] == hashes[1] == hashes[2]
    assert len(set(hashes[0])) == 5


def test_damage_of_a_cell_is_seen():
    brittle = {"name": "m", "density": "2000 kg/m^3", "cpm": {
        "young": "4 MPa", "shear_ratio": 0.2, "crack_onset_strain": 1e-4, "relative_ductility": 10, "cohesion": "1 GPa",
        "friction_coefficient": 0.0}}
    cells = coupling.RepresentativeCells(cell_scenario(material=brittle), 1)
    cells.deform(gradients([0, 0, 1e-3, 0, 0, 0]), 2000)
    response = cells.response()
    tensor = response.damage_tensor[0]
    assert tensor[2, 2] > 0.3 and tensor[2, 2] > tensor[0, 0] + 0.1
    coded = cells.response("coded").damage_tensor[0]
    assert np.allclose(1.25 * coded + 0.25 * np.trace(coded) * np.eye(3), tensor, atol=1e-13)


def test_bad_cells_are_refused():
    with pytest.raises(concordem.ContinuumError, match=r"\[loading\].*remove it"):
        moved = {"kind": "cell-strain", "velocity_gradient": [[0, 0, 0], [0, 0, 0], [0, 0, 1]]}
        coupling.RepresentativeCells(cell_scenario(loading=moved))
    with pytest.raises(concordem.ContinuumError, match="no periodic cell"):
        coupling.RepresentativeCells(cell_scenario(packing={"kind": "spheres", "spheres": [[0, 0, 0, 0.01], [0.02, 0, 0, 0.01]]}))
    cells = coupling.RepresentativeCells(cell_scenario(stop={"steps": 30}), 2)
    with pytest.raises(concordem.ContinuumError, match="number 1.*determinant -1.*inverted"):
        cells.deform(np.stack([np.eye(3), np.diag([1.0, 1, -1])]))
    with pytest.raises(ValueError, match="3 gradients for 2 cells"):
        cells.deform(np.tile(np.eye(3), (3, 1, 1)))
    with pytest.raises(concordem.ContinuumError, match="at least 1"):
        cells.deform(np.tile(np.eye(3), (2, 1, 1)), 0)
    with pytest.raises(concordem.ContinuumError, match="has ended at step 30"):
        cells.deform(np.tile(np.eye(3), (2, 1, 1)), 50)
    with pytest.raises(ValueError, match="2 states for 1 cells"):
        coupling.RepresentativeCells(cell_scenario(), 1).restore(cells.save())


def test_states_in_files_continue_bit_by_bit(tmp_path):
    strains = 1e-3 * np.random.default_rng(2).normal(size=(3, 6))
    cells = coupling.RepresentativeCells(cell_scenario(), 3)
    cells.deform(gradients(*strains), 20)
    hashes = cells.write(tmp_path / "states")
    assert hashes == cells.state_hashes()
    cells.deform(gradients(*(2 * strains)), 20)
    others = coupling.RepresentativeCells(cell_scenario(), 3, threads=2)
    others.read(tmp_path / "states")
    assert others.state_hashes() == hashes
    others.deform(gradients(*(2 * strains)), 20)
    assert others.state_hashes() == cells.state_hashes()
    # What does not fit leaves the cells as they are.
    now = others.state_hashes()
    with pytest.raises(ValueError, match="cell-00002.h5 exists, but there are only 2 cells"):
        coupling.RepresentativeCells(cell_scenario(), 2).read(tmp_path / "states")
    with pytest.raises(concordem.ResultError, match="cell-00003"):
        coupling.RepresentativeCells(cell_scenario(), 4).read(tmp_path / "states")
    with pytest.raises((ValueError, concordem.ScenarioError), match="damping"):
        other = cell_scenario(integration={"damping": {"kind": "local", "coefficient": 0.3}})
        coupling.RepresentativeCells(other, 3).read(tmp_path / "states")
    path = tmp_path / "states" / "cell-00001.h5"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(concordem.ResultError, match="changed since it was written"):
        others.read(tmp_path / "states")
    assert others.state_hashes() == now


def test_tangent_of_a_cell_is_the_derivative_of_its_stress():
    # A lattice follows at once: at the start its tangent is the elastic tensor, which depends on the symmetric part of the gradient.
    cells = coupling.RepresentativeCells(lattice_scenario(), 1)
    material = coupling.CellMaterial(cells)
    hashes = cells.state_hashes()
    tangent = material.tangent(np.eye(3)[None])[0]
    assert cells.state_hashes() == hashes
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)]
    # For changes without rotation: the particles follow a rotation of the cell in later steps, not at once.
    found = np.array([[0.5 * (tangent[i, j, k, l] + tangent[i, j, l, k]) for k, l in pairs] for i, j in pairs])
    found = 0.5 * (found + np.array([[0.5 * (tangent[j, i, k, l] + tangent[j, i, l, k]) for k, l in pairs] for i, j in pairs]))
    wanted = cells.stiffness()[0]
    # Differences of 1e-6 change the geometry by as much.
    assert np.abs(found - wanted).max() < 1e-5 * wanted.max()
    # A random packing on its way: what the tangent leaves of the change of the stress, over that change, falls with the change.
    # Without damping: local damping depends on the signs of velocities, and has no derivative.
    material = coupling.CellMaterial(coupling.RepresentativeCells(cell_scenario(integration={}), 1), steps=50)
    material.stress(gradients([0, 0, 2e-2, 0, 0, 0]))
    base = gradients([0, 0, 3e-2, 0, 0, 0])
    tangent = material.tangent(base)[0]
    saved = material.save()
    change = np.random.default_rng(4).normal(size=(3, 3))
    left = []
    for size in (2e-3, 1e-3):
        stresses = []
        for factor in (0.0, size):
            stresses.append(material.stress(base + factor * change)[0])
            material.restore(saved)
        rest = stresses[1] - stresses[0] - np.einsum("ijkl,kl->ij", tangent, size * change)
        left.append(np.linalg.norm(rest) / np.linalg.norm(stresses[1] - stresses[0]))
    # Contacts of unbonded particles begin and end on the way, so not exactly by half.
    assert left[0] < 0.2 and left[1] < 0.7 * left[0]
    with pytest.raises(ValueError, match="difference is 0"):
        material.tangent(base, 0.0)


def test_cells_are_micro_simulations_of_precice():
    # The contract of the Micro Manager: built with a number, solved, saved, and restored, one object per point. A stand-in for the
    # manager: two coupling iterations of a time step, then the next.
    micro = coupling.micro_simulation(lattice_scenario(), steps=1, tangent=True)
    points = [micro(k) for k in range(2)]
    assert [point.get_global_id() for point in points] == [0, 1]
    wanted = coupling.RepresentativeCells(lattice_scenario(), 1).stiffness()[0]
    first = {}
    for point in points:
        strain = 1e-6 * (point.get_global_id() + 1) * np.array([1.0, -0.5, 0.2, 0.4, -0.3, 0.1])
        macro = {"strains1to3": strain[:3], "strains4to6": strain[3:]}
        saved = point.get_state()
        again = []
        for _ in range(2):
            point.set_state(saved)
            again.append(point.solve(macro, 1e-3))
        for name in again[0]:
            assert np.array_equal(again[0][name], again[1][name])
        stress = np.concatenate([again[1]["stresses1to3"], again[1]["stresses4to6"]])
        # The strain changes the geometry by 2e-6.
        assert np.allclose(stress, wanted @ strain, rtol=0, atol=1e-5 * np.abs(wanted @ strain).max())
        upper = np.concatenate([again[1][f"cmat{k}"] for k in range(1, 8)])
        assert np.allclose(upper, wanted[np.triu_indices(6)], rtol=0, atol=2e-5 * wanted.max())
        first[point.get_global_id()] = stress
    assert not np.allclose(first[0], first[1])
    for macro, match in [({"strains1to3": [0, 0, 0]}, "gives no strains4to6"), ({"strains1to3": [0, 0], "strains4to6": [0, 0, 0]}, "two vectors"),
                         ({"strains1to3": [0, 0, np.nan], "strains4to6": [0, 0, 0]}, "finite")]:
        with pytest.raises(concordem.CouplingError, match=match):
            points[0].solve(macro, 1e-3)
    with pytest.raises(concordem.CouplingError, match="it must be positive"):
        points[0].solve({"strains1to3": [0] * 3, "strains4to6": [0] * 3}, 0.0)


def lattice_scenario(**spring):
    spring = {"normal_stiffness": 1e6, "shear_stiffness": 1e5} | spring
    return cell_scenario(
        packing={"kind": "lattice", "lattice": "fcc", "radius": "1 mm", "repeats": [2, 2, 2], "shape": {"kind": "periodic"}},
        material={"name": "m", "density": "2500 kg/m^3", "linear_bond": spring},
        bonds={"law": "linear_bond", "interaction_ratio": 1.01},
        contacts={"law": "none"},
    )


def test_cell_that_loses_its_last_bond_is_an_error_and_can_be_written(tmp_path):
    # All bonds of the lattice are stretched alike.
    cells = coupling.RepresentativeCells(lattice_scenario(normal_strength=1.0), 1)
    cells.deform(np.eye(3)[None] * (1 + 2e-4), 10)
    with pytest.raises(concordem.ContinuumError, match="lost its last bond"):
        cells.deform(np.eye(3)[None] * (1 + 2e-3), 10)
    # The states stay, can be written, and are read by other cells.
    hashes = cells.write(tmp_path)
    others = coupling.RepresentativeCells(lattice_scenario(normal_strength=1.0), 1)
    others.read(tmp_path)
    assert others.state_hashes() == hashes == cells.state_hashes()
    assert others.response().bonds[0] == cells.response().bonds[0] == 0


def test_particles_of_a_cell_follow_its_edges():
    cells = coupling.RepresentativeCells(lattice_scenario(), 2)
    before = cells.particles(1)
    stretch = np.diag([1.0, 1.0, 1.0001])
    cells.deform(np.stack([np.eye(3), stretch]), 4)
    after = cells.particles(1)
    assert np.allclose(after.edges, stretch @ before.edges, rtol=1e-14, atol=0)
    # A lattice follows its cell: shares of the edges stay, up to the square of the strain of 1e-4.
    shares = [np.linalg.solve(one.edges, one.position.T) for one in (before, after)]
    assert np.allclose(shares[0], shares[1], rtol=0, atol=1e-8) and np.abs(after.position - before.position).max() > 1e-7
    assert np.array_equal(after.radius, np.full(len(after.position), 1e-3))
    # The other cell is at rest, up to rounding of forces without a load.
    assert np.allclose(cells.particles(0).position, before.position, rtol=0, atol=1e-18)
    with pytest.raises(ValueError, match="cell is 2, but there are 2 cells"):
        cells.particles(2)


def test_integration_points_are_in_their_elements():
    fem = coupling.ScikitDynamics(skfem().MeshHex.init_tensor([0, 2], [0, 2], [0, 2, 4]), coupling.Elastic(1e6, 0.2, 1.0))
    fem.displacement[:] = 0.1 * fem.nodes
    points = fem.points()
    # Gauss points of two per axis, at 1 -+ 1/sqrt(3), stretched by 1.1.
    gauss = 1.1 * (1 + np.array([-1, 1]) / np.sqrt(3))
    assert np.allclose(np.unique(np.round(points[:8], 12)), gauss, rtol=0, atol=1e-12)
    assert np.allclose(np.unique(np.round(points[8:, 2], 12)), gauss + 2.2, rtol=0, atol=1e-12)


def test_lattice_cell_follows_at_once():
    # No particle of a lattice leaves the uniform field, so no relaxation is needed: the stress is that of the stretched springs.
    cells = coupling.RepresentativeCells(lattice_scenario(), 1)
    stretch = 1e-5
    cells.deform(np.eye(3)[None] * (1 + stretch), 1)
    response = cells.response()
    # q = sum of l f over the volume: 6 bonds per particle of length 2r(1+e) with the force k 2r e; volume per particle 4 sqrt(2) r³.
    wanted = 6 * 2e-3 * (1 + stretch) * 1e6 * 2e-3 * stretch / (3 * 4 * np.sqrt(2) * 1e-9 * (1 + stretch) ** 3)
    assert np.allclose(response.stress[0], wanted * np.eye(3), rtol=1e-9, atol=1e-9 * wanted)
    # Work of springs, half of force times elongation; the step books its half at the end position with the next one. In one step, the
    # trapezoidal rule errs by the change of the geometry, three times the stretch.
    cells.deform(np.eye(3)[None] * (1 + stretch), 1)
    energy = 6 * 32 * 0.5 * 1e6 * (2e-3 * stretch) ** 2
    assert cells.response().work[0] == pytest.approx(energy, rel=1e-4)


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
    for _ in range(1000):
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
    rows, _, balance = multiscale_column.column(1e-4, 400)
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
