"""Operators on arrays: identities, zero copies, errors."""

import concordem
import numpy as np
import pytest
from concordem import operators as op

RANDOM = np.random.default_rng(7)


@pytest.fixture(scope="module")
def cloud():
    """Random particles, with contacts between close ones and random forces."""
    x = RANDOM.random((200, 3))
    a, b = np.triu_indices(200, 1)
    near = np.linalg.norm(x[b] - x[a], axis=1) < 0.25
    a, b = a[near], b[near]
    branch = x[b] - x[a]
    point = x[a] + 0.4 * branch
    force, moment = RANDOM.normal(size=branch.shape), RANDOM.normal(size=branch.shape)
    return x, op.Contacts(np.stack([a, b], 1).astype(np.uint32), branch, point, force, moment)


def test_region_stress_is_the_branch_sum(cloud):
    x, c = cloud
    found = op.region_stress(x, c, op.Region.all(2.0))
    # Sums of a thousand terms: 1e-16 times their number.
    assert np.allclose(found.stress, np.einsum("ci,cj->ij", c.branch, c.force) / 2.0, rtol=0, atol=1e-12)
    assert found.full == len(c.pair) and found.partial == 0


def test_particle_moments_add_up_to_the_branch_sum(cloud):
    x, c = cloud
    moments = op.particle_moments(x, c)
    expected = np.zeros((200, 3, 3))
    np.add.at(expected, c.pair[:, 0], np.einsum("ci,cj->cij", c.point - x[c.pair[:, 0]], c.force))
    np.add.at(expected, c.pair[:, 1], np.einsum("ci,cj->cij", c.point - x[c.pair[:, 1]], -c.force))
    assert np.allclose(moments, expected, atol=1e-13)
    whole = op.region_stress(x, c, op.Region.all(1.0)).stress
    assert np.allclose(moments.sum(0), whole, atol=1e-12)
    assert np.allclose(op.region_stress_from_particles(x, moments, op.Region.all(1.0)), whole, atol=1e-12)
    half = op.particle_moments(x, c, partition="half-branch").sum(0)
    assert np.allclose(half, whole, atol=1e-12)


def test_grids_of_regions_add_up(cloud):
    x, c = cloud
    boxes = op.Region.grid([-1, -1, -1], [2, 2, 2], [2, 3, 2])
    total = sum(op.region_stress(x, c, box).stress * box.volume for box in boxes)
    assert np.allclose(total, op.region_stress(x, c, op.Region.all(1.0)).stress, atol=1e-11)


def test_affine_motion_is_found_exactly(cloud):
    x, _ = cloud
    gradient = np.array([[1e-3, 2e-3, 0], [-1e-3, 0, 3e-3], [0, 1e-3, -2e-3]])
    u = x @ gradient.T + [0.1, 0.2, 0.3]
    fit = op.affine_fit(x, u, op.Region.all(1.0))
    assert np.allclose(fit.gradient, gradient, atol=1e-14)
    assert np.allclose(fit.displacement(x), u, atol=1e-14)
    assert np.allclose(fit.strain, (gradient + gradient.T) / 2, atol=1e-14)
    mesh = op.delaunay(x)
    for found in (op.cell_strain(mesh, x, u), op.bagi_strain(mesh, x, u)):
        assert np.allclose(found.gradient, gradient, atol=1e-12)
    assert np.allclose(op.boundary_strain(mesh, x, u), gradient, atol=1e-12)
    assert mesh.cells.shape == (len(mesh), 4) and mesh.cells.max() == 199


def test_power_balances(cloud):
    x, c = cloud
    v, w = RANDOM.normal(size=(200, 3)), RANDOM.normal(size=(200, 3))
    fit = op.affine_fit(x, v, op.Region.all(1.0), rotation=w)
    report = op.power(x, c, v, w, fit, 1.0)
    assert abs(report.contacts - report.stress - report.couple - report.gap) < 1e-10 * abs(report.contacts)


def test_couple_stresses_agree_where_they_should(cloud):
    x, c = cloud
    force, moment = op.resultants(x, c)
    by_wrenches = op.couple_stress_from_resultants(x, force, moment, 1.0, [0.5, 0.5, 0.5])
    conjugate = op.conjugate_stress(x, c, op.Region.box([-9, -9, -9], [9, 9, 9]), [0.5, 0.5, 0.5])
    assert np.allclose(by_wrenches, conjugate.couple_stress * conjugate.volume, atol=1e-11)
    assert conjugate.contacts == len(c.pair)


def test_diagrams_fill_their_domain(cloud):
    x, _ = cloud
    diagram = op.power_diagram(x, np.zeros(200), low=[0, 0, 0], high=[1, 1, 1])
    assert abs(diagram.volumes.sum() - 1.0) < 1e-12
    assert op.solid_fraction(x, diagram.volumes, op.Region.all(1.0)) == pytest.approx(1.0, abs=1e-12)


def test_coarse_grained_mass_is_conserved(cloud):
    x, c = cloud
    grid = np.stack(np.meshgrid(*[np.linspace(-0.5, 1.5, 41)] * 3), -1).reshape(-1, 3)
    fields = op.coarse_grain(x, c, np.ones(200), np.zeros((200, 3)), 0.3, grid)
    # Sum over a grid of six points per support: the kernel's third derivative jumps at its end, error 1e-3.
    assert fields.density.sum() * 0.05**3 == pytest.approx(200, rel=2e-3)


def test_acoustic_emissions_group_breaks():
    time, x = [0.0, 1.0, 1.0, 5.0], [[0.0, 0, 0], [0.5, 0, 0], [9.0, 0, 0], [0.0, 0, 0]]
    found = op.acoustic_emissions(time, x, [1.0, 3.0, 1e3, 0.0], [0.0, 1.0, 0.5, 0.0], distance=1.0, duration=2.0)
    assert isinstance(found, op.Emissions)
    assert found.breaks.tolist() == [2, 1, 1] and found.duration.tolist() == [1.0, 0.0, 0.0]
    assert found.position[0, 0] == 0.375 and found.shear_share[0] == 0.75
    assert found.magnitude[1] == pytest.approx(2 - 3.2) and np.isneginf(found.magnitude[2])
    assert op.b_value(found.magnitude) is None
    magnitudes = 2 - np.log10((np.arange(1000) + 0.5) / 1000) / 1.5
    value = op.b_value(magnitudes, completeness=2.0)
    assert value.b == pytest.approx(1.5, rel=1e-3) and value.events == 1000 and value.error == value.b / np.sqrt(1000)
    with pytest.raises(concordem.OperatorError, match="energy"):
        op.acoustic_emissions(time, x, [1.0], [0.0] * 4, distance=1.0, duration=2.0)
    with pytest.raises(concordem.OperatorError, match="duration"):
        op.acoustic_emissions(time, x, [1.0] * 4, [0.0] * 4, distance=1.0, duration=0.0)


def test_reloadings_and_sources():
    found = op.reloadings([0, 1, 2, 3, 4, 5], [0.0, 10, 2, 12, 1, 11], [0.6, 1.25, 2.7], drop=0.2)
    assert isinstance(found, op.Reloadings)
    assert found.former.tolist() == [10.0, 12.0] and found.least.tolist() == [2.0, 1.0]
    assert found.felicity[0] == pytest.approx(0.9) and np.isnan(found.felicity[1]) and np.isnan(found.onset[1])
    # One bond that breaks in tension: a line force, 1/3 expansion and 2/3 dipole.
    tensor = op.moment_tensor([[-5.0, 0, 0], [5, 0, 0]], [[-1e-3, 0, 0], [1e-3, 0, 0]])
    assert np.allclose(tensor, np.diag([1e-2, 0, 0]), rtol=0, atol=1e-17)
    source = op.source_mechanism(tensor)
    assert (source.isotropic, source.dipole, source.double_couple) == pytest.approx((1 / 3, 2 / 3, 0))
    assert source.moment == pytest.approx(1e-2 / np.sqrt(2))
    for bad in (np.nan, np.inf):
        with pytest.raises(concordem.OperatorError):
            op.reloadings([0.0, bad], [1.0, 2.0], [])
        with pytest.raises(concordem.OperatorError, match="drop"):
            op.reloadings([0.0, 1.0], [1.0, 2.0], [], drop=bad)
        with pytest.raises(concordem.OperatorError):
            op.source_mechanism(np.full((3, 3), bad))
        with pytest.raises(concordem.OperatorError):
            op.moment_tensor([[bad, 0, 0]], [[0.0, 0, 0]])
        with pytest.raises(concordem.OperatorError, match="completeness"):
            op.b_value(np.ones(20), completeness=bad)


def test_cracks_have_directions():
    angle = np.radians(30)
    area = 2e-6 * np.array([[np.cos(angle), np.sin(angle), 0]] * 3 + [[0, 0, 1]])
    found = op.crack_directions(area)
    assert isinstance(found, op.CrackDirections) and found.area == pytest.approx(8e-6)
    assert found.principal == pytest.approx([0.75, 0.25, 0]) and found.density.shape == (320,)
    assert found.directions[0] == pytest.approx([np.cos(angle), np.sin(angle), 0])
    rose = op.crack_rose(area)
    assert rose.shape == (24,) and rose[4] == pytest.approx(6e-6) and rose.sum() == rose[4]
    for bad in (np.nan, np.inf):
        with pytest.raises(concordem.OperatorError):
            op.crack_directions([[bad, 0, 0]])
        with pytest.raises(concordem.OperatorError):
            op.crack_rose([[bad, 0, 0]])
    with pytest.raises(concordem.OperatorError, match="bins"):
        op.crack_rose(area, bins=0)
    with pytest.raises(concordem.OperatorError, match="axis"):
        op.crack_rose(area, axis=3)


def test_fragments_are_sieved():
    x = [[0.0, 0, 0], [2, 0, 0], [9, 0, 0]]
    found = op.fragments([7, 7, 9], x, [1.0] * 3, [2.0] * 3, [[1.0, 0, 0], [3, 0, 0], [0, 0, 5]])
    assert isinstance(found, op.Fragments)
    assert found.number.tolist() == [7, 9] and found.particles.tolist() == [2, 1] and found.mass.tolist() == [4.0, 2.0]
    assert found.velocity.tolist() == [[2.0, 0, 0], [0, 0, 5.0]] and found.position[0].tolist() == [1.0, 0, 0]
    assert found.axes[0] == pytest.approx([2 * np.sqrt(6), 2, 2]) and found.axes[1] == pytest.approx([2, 2, 2])
    assert found.sphere == pytest.approx([2 * np.cbrt(2), 2])
    plane = op.fragments([7, 7, 9], x, [1.0] * 3, [2.0] * 3, np.zeros((3, 3)), dimension=2)
    assert plane.axes[0] == pytest.approx([2 * np.sqrt(5), 2, 0]) and plane.sphere[0] == pytest.approx(2 * np.sqrt(2))
    curve = op.sieve_curve([2.0, 1, 4], [2.0, 1, 1])
    assert curve.size.tolist() == [1, 2, 4] and curve.passing.tolist() == [0.25, 0.75, 1]
    share = (np.arange(2000) + 0.5) / 2000
    fit = op.rosin_rammler(3 * (-np.log(1 - share)) ** (1 / 1.5), np.ones(2000))
    assert isinstance(fit, op.SieveFit) and abs(fit.size - 3) < fit.size_error and abs(fit.exponent - 1.5) < fit.exponent_error
    size, debris = 3 * np.maximum(share, 0.5) ** 2, share < 0.5
    assert op.gaudin_schuhmann(size, np.ones(2000), debris).exponent == pytest.approx(0.5, rel=1e-2)
    assert op.gaudin_schuhmann(size, np.ones(2000)).exponent > 0.8
    assert op.rosin_rammler([1.0, 2.0], [1.0, 1.0]) is None
    for law in (op.rosin_rammler, op.gaudin_schuhmann, op.sieve_curve):
        for bad in (np.nan, np.inf, 0.0):
            with pytest.raises(concordem.OperatorError, match="size"):
                law([1.0, bad], [1.0, 1.0])
            with pytest.raises(concordem.OperatorError, match="mass"):
                law([1.0, 2.0], [1.0, bad])
    with pytest.raises(concordem.OperatorError, match="radius"):
        op.fragments([7], x[:1], [np.nan], [1.0], x[:1])


def test_small_ones(cloud):
    x, c = cloud
    assert op.coordination(x, c).sum() == 2 * len(c.pair)
    assert np.trace(op.fabric(x, c, op.Region.all(1.0)).tensor) == pytest.approx(1, abs=1e-12)
    assert np.allclose(op.axial([[0, 1, 0], [0, 0, 1], [1, 0, 0]]), [1, 1, 1])
    assert np.allclose(op.particle_volumes([1.0, 2.0]), 4 / 3 * np.pi * np.array([1, 8]))
    normals = RANDOM.normal(size=(500, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    tensor = np.diag([0.1, 0.2, 0.3])
    damage = np.einsum("ci,ij,cj->c", normals, tensor, normals)
    assert np.allclose(op.damage_tensor(normals, damage, exact=True), tensor, atol=1e-12)
    assert op.isotropic_moduli(3.0, 1.0, 1.0, 0.25) == pytest.approx((2.75 / 4.25, 0.75 / 4.25))
    assert op.strength_damage(0.5, 2e-4, 1e-4) == 0.0
    assert np.allclose(op.cosserat_strain(np.zeros((3, 3)), [0, 0, 1]), [[0, -1, 0], [1, 0, 0], [0, 0, 0]])
    strain = op.particle_strain(np.diag([1.0, 0, 0]), 2.0, 0.25)
    assert np.allclose(strain, np.diag([0.5, -0.125, -0.125]))
    assert op.platen_strain(0.0, 1e-3, 0.1) == pytest.approx(1e-2)


def test_refusals_name_what_is_wrong(cloud):
    x, c = cloud
    with pytest.raises(concordem.OperatorError, match="force") as caught:
        op.region_stress(x, c._replace(force=c.force[:-1]), op.Region.all(1.0))
    assert caught.value.kind == "Length" and isinstance(caught.value, ValueError)
    with pytest.raises(concordem.OperatorError, match="particle 199"):
        op.coordination(x[:-1], c._replace(pair=np.array([[0, 199]]), branch=x[:1], point=x[:1], force=x[:1], moment=None))
    with pytest.raises(ValueError, match=r"\(n, 3\)"):
        op.region_stress(x[:, :2], c, op.Region.all(1.0))
    with pytest.raises(TypeError, match="float64"):
        op.region_stress(x.astype(str), c, op.Region.all(1.0))
    with pytest.raises(ValueError, match="-1"):
        op.coordination(x, c._replace(pair=-np.ones((len(c.pair), 2), int)))
    with pytest.raises(TypeError):
        op.coordination(x, c._replace(pair=c.pair.astype(float)))
    with pytest.raises(concordem.OperatorError, match="volume"):
        op.region_stress(x, c, op.Region.all(0.0))
    with pytest.raises(ValueError, match="half-crossing"):
        op.region_stress(x, c, op.Region.all(1.0), truncation="half")


def test_layout_and_type_do_not_matter(cloud):
    x, c = cloud
    wanted = op.region_stress(x, c, op.Region.all(1.0)).stress
    lists = op.Contacts(*(column.tolist() for column in c))
    fortran = op.Contacts(c.pair.astype(np.int64), *(np.asfortranarray(column) for column in c[1:]))
    for other in (lists, fortran):
        assert np.array_equal(op.region_stress(np.asfortranarray(x), other, op.Region.all(1.0)).stress, wanted)
