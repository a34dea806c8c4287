"""Representative cells: stress and stiffness, states in files, micro simulations of preCICE."""

import concordem
import numpy as np
import pytest
from concordem import coupling



def rotation(vector):
    """Rotation about a vector, by its angle in rad."""
    angle = np.linalg.norm(vector)
    x, y, z = np.asarray(vector) / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


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
        "young": "25 GPa", "shear_ratio": 0.2, "crack_onset_strain": 1e-4, "relative_ductility": 10, "cohesion": "1 GPa",
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
    work = cells.response().work
    cells.deform(gradients(*(2 * strains)), 20)
    others = coupling.RepresentativeCells(cell_scenario(), 3, threads=2)
    others.read(tmp_path / "states")
    assert others.state_hashes() == hashes
    assert np.array_equal(others.response().work, work)
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


def test_lattice_cell_follows_at_once():
    # No particle of a lattice leaves the uniform field, so no relaxation is needed: the stress is that of the stretched springs.
    cells = coupling.RepresentativeCells(lattice_scenario(), 1)
    stretch = 1e-5
    cells.deform(np.eye(3)[None] * (1 + stretch), 1)
    response = cells.response()
    # q = sum of l f over the volume: 6 bonds per particle of length 2r(1+e) with the force k 2r e; volume per particle 4 sqrt(2) r³.
    wanted = 6 * 2e-3 * (1 + stretch) * 1e6 * 2e-3 * stretch / (3 * 4 * np.sqrt(2) * 1e-9 * (1 + stretch) ** 3)
    assert np.allclose(response.stress[0], wanted * np.eye(3), rtol=1e-9, atol=1e-9 * wanted)
    # Work of springs that do not turn, half of force times elongation: exact but for the rounding of positions over the elongation, also while
    # the cell moves.
    energy = 6 * 32 * 0.5 * 1e6 * (2e-3 * stretch) ** 2
    assert response.work[0] == pytest.approx(energy, rel=1e-9)
