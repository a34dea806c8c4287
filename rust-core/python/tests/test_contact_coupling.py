"""The contact coupling: bodies of finite elements that touch each other under the contact laws of the particles.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""


import concordem
import numpy as np
import pytest
from concordem import coupling

STEP = 2e-5
LAW = {"frictional": {"normal_stiffness": 2e3, "shear_stiffness": 1e3, "friction_coefficient": 0.4, "damping_ratio": 0.05}}


def block(center, kind="Hex", size=0.1, cells=2, turned=0.0, step=STEP, axis=(1, 1, 0), **options):
    """A cube of rubber, turned about an axis."""
    fem = pytest.importorskip("skfem")
    line = np.linspace(-0.5 * size, 0.5 * size, cells + 1)
    mesh = getattr(fem, f"Mesh{kind}").init_tensor(line, line, line)
    cross = np.cross(np.eye(3), np.array(axis) / np.linalg.norm(axis))
    rotation = np.eye(3) - np.sin(turned) * cross + (1 - np.cos(turned)) * cross @ cross
    mesh = type(mesh)((rotation @ mesh.p) + np.array(center)[:, None], mesh.t)
    return coupling.ScikitDynamics(mesh, coupling.Elastic(2e6, 0.2, 1000.0), step, **options)


def simulate(bodies, threads=1, particles=None, of_particles=None, velocities=(), step=STEP, **tables):
    made = coupling.contact_tables(bodies, "frictional", particles, of_particles)
    sets = [{"name": f"p{k}", "selection": {"kind": "ids", "ids": [k]}} for k in range(len(velocities))]
    made["set"] += sets
    initial = [{"set": f"p{k}", "velocity": list(v)} for k, v in enumerate(velocities)]
    return concordem.Scenario(**(made | {
        "initial": initial, "integration": {"time_step": step}, "output": {"sample_interval": 1}, "stop": {"steps": 10**9},
    } | tables)).simulation(threads=threads)


def colliding(kind="Hex", radius=(0.015, 0.015), threads=1, turned=0.7, law=LAW, **more):
    """Two cubes that meet edge on face, spinning; a sphere comes between them."""
    elements = [block([0, 0, 0], kind), block([0.02, 0.01, 0.151], kind, turned=turned)]
    elements[0].velocity[:] = np.cross([1.0, -2.0, 3.0], elements[0].nodes)
    elements[1].velocity[:] = [0.1, 0.2, -1.5]
    bodies = [coupling.ContactBody(f"b{k}", e, law, r, 0.8) for k, (e, r) in enumerate(zip(elements, radius))]
    material = {"density": 2500.0} | law
    run = simulate(bodies, threads, [[-0.03, -0.03, 0.0705, 0.02]], material, [[0, 0, -2.0]], **more)
    return run, bodies


def momenta(bodies, state, free):
    """Linear and angular momentum of all elements and of the free particles, at the half step."""
    momentum = state.masses[free, None] * state.velocities[free]
    middle = state.positions[free] - 0.5 * STEP * state.velocities[free]
    spin = state.inertias[free].reshape(free.sum(), -1)[:, :1] * state.angular_velocities[free]
    linear = momentum.sum(axis=0) + sum(body.elements.momentum() for body in bodies)
    angular = (np.cross(middle, momentum) + spin).sum(axis=0) + sum(body.elements.angular_momentum() for body in bodies)
    return linear, angular


# ---- Spheres on a skin -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["Hex", "Tet"])
def test_spheres_cover_their_skin_and_pass_force_moment_and_power(kind):
    elements = block([0.1, 0, 0], kind, turned=0.3)
    skin = coupling.Skin(elements)
    spheres = coupling.SkinSpheres(skin, 0.02)
    random = np.random.default_rng(2)
    # No point of the skin is farther from a center than half a radius.
    weights, triangle = random.dirichlet(np.ones(3), size=4000), random.integers(len(skin.triangles), size=4000)
    points = np.einsum("kc,kci->ki", weights, skin.positions[skin.triangles[triangle]])
    centers = spheres.positions(skin.positions)
    distance = np.linalg.norm(points[:, None] - centers[None], axis=2).min(axis=1)
    assert 0.7 * 0.01 < distance.max() <= 0.01 * (1 + 1e-12)
    assert spheres.widest(skin.positions) <= 0.01 * (1 + 1e-12)
    # No two are at one place.
    gaps = np.linalg.norm(centers[:, None] - centers[None], axis=2) + np.eye(len(centers))
    assert gaps.min() > 1e-3
    force, moment = random.normal(size=(2, len(spheres), 3))
    places = skin.positions + 1e-3 * random.normal(size=skin.positions.shape)
    nodal = spheres.distribute(places, force, moment)
    centers = spheres.positions(places)
    # Rounding of sums of about a thousand terms of size 1 to 100.
    assert np.allclose(nodal.sum(axis=0), force.sum(axis=0), rtol=0, atol=1e-10)
    assert np.allclose(np.cross(places, nodal).sum(axis=0), (np.cross(centers, force) + moment).sum(axis=0), rtol=0, atol=1e-10)
    velocity = random.normal(size=places.shape)
    moved, spin = spheres.motion(places, velocity)
    assert np.vdot(nodal, velocity) == pytest.approx(np.vdot(force, moved) + np.vdot(moment, spin), rel=1e-10)
    moved, spin = spheres.motion(places, [1.0, 2.0, 3.0] + np.cross([0.3, -0.2, 0.5], places))
    assert np.allclose(spin, [0.3, -0.2, 0.5], rtol=0, atol=1e-12)
    assert np.allclose(moved, [1.0, 2.0, 3.0] + np.cross([0.3, -0.2, 0.5], centers), rtol=0, atol=1e-12)


# ---- Conservation ----------------------------------------------------------------------------------------------------------------


SMOOTH = {"frictional": {"normal_stiffness": 2e3, "shear_stiffness": 0.0, "friction_coefficient": 0.0}}


@pytest.mark.parametrize(("kind", "radius", "law"), [("Hex", (0.015, 0.015), LAW), ("Tet", (0.015, 0.015), LAW), ("Hex", (0.015, None), SMOOTH)],
                         ids=["hex", "tet", "spheres on one body, no friction"])
def test_momentum_and_energy_pass_between_bodies_without_loss(kind, radius, law):
    run, bodies = colliding(kind, radius, law=law)
    contact = coupling.ContactCoupling(run, bodies)
    free = run.state.ids == 0
    start = momenta(bodies, run.state, free)
    kinetic = 0.5 * float(run.state.masses[free] @ (run.state.velocities[free] ** 2).sum(axis=1))
    energy = kinetic + sum(body.elements.kinetic_energy for body in bodies)
    moving = np.abs(bodies[1].elements.momentum()).max()

    def motion():
        return np.array(run.state.velocities[~free]), np.array(run.state.angular_velocities[~free])

    def held(before):
        """Kinetic energy at the instant between two half steps of the spheres on the skins, which the prescribed motion gives them."""
        state, now = run.state, motion()
        inertia = state.inertias.reshape(len(state), -1)[~free, :1]
        return 0.5 * float((state.masses[~free, None] * before[0] * now[0]).sum() + (inertia * before[1] * now[1]).sum())

    last_motion = motion()
    before_run = held(last_motion)
    largest, pair = np.zeros(2), 0.0
    for _ in range(500):
        last_motion = motion()
        contact.step()
        largest = np.maximum(largest, [np.abs(exchange.force).max() for exchange in contact.last])
        pair = max(pair, np.abs(contact.last[0].force + contact.last[1].force).max())
        for before, after in zip(start, momenta(bodies, run.state, free)):
            # Rounding of up to 500 steps.
            assert np.abs(after - before).max() < 1e-12 * moving
    assert (largest > 20).all()
    # The sphere takes a part of the momentum: the forces on the bodies are a pair only where it does not touch.
    assert pair > 1
    last = run.samples[-1]
    # The work of the contacts on the bodies is that of the boundary on contacts and particles; the ledger ends at the last instant of
    # forces, half a step before the work. With friction it differs by the moments times the change of the spins in half a step: the core
    # has the spins of the vertices one step before.
    half = sum(0.5 * STEP * float(np.vdot(e.nodal, b.elements.velocity[b.skin.nodes])) for e, b in zip(contact.last, bodies))
    given = last["boundary_work"] - (held(last_motion) - before_run)
    assert half - contact.work.sum() == pytest.approx(given, rel=1e-8 if law is SMOOTH else 0.02)
    assert abs(contact.work.sum()) > 0.01 * energy
    # The trapezoidal rule errs by (omega dt)^2/12: omega of the sphere is 0.02/dt and less.
    assert np.abs(run.samples["residual"]).max() < 1e-4 * energy
    for body, work in zip(bodies, contact.work):
        assert work == pytest.approx(body.elements.external_work, rel=1e-12)
        assert abs(body.elements.balance) < 1e-12 * energy


def test_a_rigid_motion_of_all_bodies_makes_no_force():
    elements = [block([0, 0, 0]), block([0, 0, 0.1105])]
    for e in elements:
        e.velocity[:] = [0.3, -0.1, 0.2]
    bodies = [coupling.ContactBody(f"b{k}", e, LAW, 0.01, 0.8) for k, e in enumerate(elements)]
    contact = coupling.ContactCoupling(simulate(bodies), bodies)
    contact.step(100)
    assert not contact.work.any() and not contact.impulse.any()
    # So does a body alone, whose spheres lie on its own mesh.
    alone = [coupling.ContactBody("b", block([0, 0, 0]), LAW, 0.02)]
    alone[0].elements.velocity[:] = np.cross([3.0, 1.0, 2.0], alone[0].elements.nodes)
    contact = coupling.ContactCoupling(simulate(alone), alone)
    contact.step(50)
    assert not contact.work.any() and not contact.last[0].nodal.any()


def test_edges_that_cross_do_not_pass_through_each_other():
    # Two cubes, one standing on an edge along x, one with its upper edge along y: no node comes near the other cube.
    height = 0.1 / np.sqrt(2) + 0.001
    made = [block([0, 0, -height], turned=np.pi / 4, axis=(0, 1, 0), cells=1), block([0, 0, height + 0.011], turned=np.pi / 4, axis=(1, 0, 0), cells=1)]
    for elements, speed in zip(made, (0.5, -0.5)):
        elements.velocity[:, 2] = speed
    bodies = [coupling.ContactBody(f"b{k}", e, LAW, 0.012, 0.8) for k, e in enumerate(made)]
    contact = coupling.ContactCoupling(simulate(bodies), bodies)
    least = np.inf
    for _ in range(900):
        contact.step()
        top, bottom = bodies[0].vertices[:, 2].max(), bodies[1].vertices[:, 2].min()
        least = min(least, bottom - top)
        if contact.impulse[1, 2] > 0.5 * made[1].mass.sum() * 0.5 and made[1].momentum()[2] > 0 > made[0].momentum()[2]:
            break
    assert contact.impulse[1, 2] > 0.5 * made[1].mass.sum() * 0.5
    assert made[1].momentum()[2] > 0 > made[0].momentum()[2]
    # The edges never met.
    assert least > 0.0


def test_a_coupled_run_continues_bit_by_bit(tmp_path):
    run, bodies = colliding()
    contact = coupling.ContactCoupling(run, bodies)
    contact.step(200)
    assert np.abs(contact.impulse).max() > 0
    run.save(tmp_path / "half.h5")
    saved = [body.elements.save() for body in bodies]
    contact.step(100)
    second = concordem.Simulation.load(tmp_path / "half.h5", threads=2)
    _, others = colliding()
    for body, state in zip(others, saved):
        body.elements.restore(state)
    coupling.ContactCoupling(second, others).step(100)
    assert second.state_hash() == run.state_hash()
    for one, other in zip(bodies, others):
        assert np.array_equal(one.elements.displacement, other.elements.displacement)
        assert np.array_equal(one.elements.velocity, other.elements.velocity)
    with pytest.raises(concordem.CouplingError, match="m away from its place"):
        coupling.ContactCoupling(second, colliding()[1])


def test_a_body_falls_on_a_plane_of_the_scenario():
    # The spheres of the skin touch other walls, too; their forces go to the nodes.
    elements = block([0, 0, 0])
    elements.velocity[:, 2] = -0.5
    bodies = [coupling.ContactBody("b", elements, LAW, 0.015, 0.8)]
    made = coupling.contact_tables(bodies)
    plane = {"name": "floor", "material": "floor", "shape": {"kind": "plane", "point": [0, 0, -0.0655], "normal": [0, 0, 1]}}
    run = simulate(bodies, wall=[*made["wall"], plane], material=[*made["material"], {"name": "floor", "density": 1000.0} | LAW])
    contact = coupling.ContactCoupling(run, bodies)
    start, given = elements.momentum(), np.zeros(3)
    for _ in range(700):
        given += STEP * run.forces().walls.force.sum(axis=0)
        contact.step()
    # It bounces; the nodes got what the plane gave.
    assert elements.momentum()[2] > 0.2 * abs(start[2])
    assert np.abs(elements.momentum() - start - given).max() < 1e-12 * abs(start[2])
    assert np.abs(contact.impulse[0] - given).max() < 1e-12 * abs(start[2])


def test_clumps_and_deformable_particles_are_refused():
    bodies = [coupling.ContactBody("b", block([0, 0, 0]), LAW, 0.02)]
    clump = [{"material": "b", "spheres": [[1.0, 0, 0, 0.02], [1.02, 0, 0, 0.02]]}]
    with pytest.raises(concordem.CouplingError, match=r"remove \[\[clump\]\]"):
        coupling.ContactCoupling(simulate(bodies, clump=clump), bodies)
    soft = [material | {"deformable": {"young": 1e7, "poisson": 0.2}} for material in coupling.contact_tables(bodies)["material"]]
    with pytest.raises(concordem.CouplingError, match="remove material.deformable"):
        coupling.ContactCoupling(simulate(bodies, material=soft), bodies)


# ---- Closed forms ----------------------------------------------------------------------------------------------------------------


@pytest.fixture
def example(import_example):
    return import_example("contact_bodies")


@pytest.mark.parametrize("longer", [1.0, 2.0])
def test_bars_that_collide_follow_wave_theory(example, longer):
    result = example.two_bars(longer)
    # The contact, as stiff as one brick, and the waves of the bricks blur the front over three bricks of 40, at both ends.
    assert result["contact_time"] == pytest.approx(1.0, abs=3 / 40)
    assert result["restitution"] == pytest.approx(1.0 / longer, abs=0.03)
    assert result["plateau"] == pytest.approx(1.0, abs=0.02)


def test_a_rigid_sphere_on_a_block_has_the_force_of_hertz(example):
    result = example.hertz(0.08, steps=450)
    # Two bricks per radius of the contact are too stiff: 6 % here.
    assert 0.95 < result["force"] < 1.1
    # At rest.
    assert result["kinetic"] < 1e-3


def test_three_balls_keep_momentum_and_energy(example):
    rows, _ = example.three_balls(steps=380)
    assert np.max(rows["force"], axis=0).min() > 1e6
    assert max(rows["lost"]) < 1e-13 and max(rows["lost_angular"]) < 1e-13
    # Both energies are half a step apart: force times speed times half a step, 5 MN, 5 m/s, 0.25 ms, over 1.4 MJ.
    assert np.abs(rows["balance"]).max() < 0.005
    assert rows["contacts"][-1] > 0.01


# ---- What does not fit -----------------------------------------------------------------------------------------------------------


def test_bodies_that_do_not_fit_are_refused():
    elements = [block([0, 0, 0]), block([0, 0, 0.15])]
    bodies = [coupling.ContactBody(f"b{k}", e, LAW, 0.02) for k, e in enumerate(elements)]
    with pytest.raises(ValueError, match="radius is 0"):
        coupling.ContactBody("a", elements[0], LAW, 0.0)
    with pytest.raises(ValueError, match="cover is 1.5"):
        coupling.ContactBody("a", elements[0], LAW, 0.02, cover=1.5)
    with pytest.raises(ValueError, match='a name other than "particles"'):
        coupling.ContactBody("particles", elements[0], LAW, 0.02)
    with pytest.raises(ValueError, match="each with a name of its own"):
        coupling.contact_tables([bodies[0], bodies[0]])
    with pytest.raises(ValueError, match="nothing would touch"):
        coupling.contact_tables([coupling.ContactBody("a", elements[0], LAW)])
    with pytest.raises(ValueError, match="both particles and their material"):
        coupling.contact_tables(bodies, particles=[[0, 0, 1.0, 0.01]])
    with pytest.raises(concordem.CouplingError, match="must be equal: fix integration.time_step"):
        coupling.ContactCoupling(simulate(bodies, step=STEP / 2), bodies)
    run = simulate(bodies)
    with pytest.raises(concordem.CouplingError, match='no mesh of the scenario is named "other"'):
        coupling.ContactCoupling(run, [bodies[0], coupling.ContactBody("other", elements[1], LAW, 0.02)])
    with pytest.raises(concordem.CouplingError, match="away from its place"):
        # The other order.
        coupling.ContactCoupling(run, [coupling.ContactBody("b0", block([0, 0, 0.5]), LAW, 0.02), bodies[1]])
    with pytest.raises(concordem.CouplingError, match="the bodies more spheres"):
        coupling.ContactCoupling(run, [*bodies, coupling.ContactBody("b2", block([0, 0, 1]), LAW, 0.02)])
    with pytest.raises(ValueError, match="1 loads for 2 bodies"):
        coupling.ContactCoupling(run, bodies).step(1, [None])
    stopped = coupling.ContactCoupling(simulate(bodies, stop={"steps": 2}), bodies)
    with pytest.raises(concordem.CouplingError, match="has ended"):
        stopped.step(3)


def test_contacts_that_fail_are_errors():
    # Soft contacts: the body is pressed through its shell.
    soft = {"frictional": {"normal_stiffness": 1.0, "shear_stiffness": 0.0, "friction_coefficient": 0.0}}
    elements = [block([0, 0, 0]), block([0, 0, 0.1101])]
    elements[1].velocity[:, 2] = -2.0
    bodies = [coupling.ContactBody(f"b{k}", e, soft, 0.01, 0.9) for k, e in enumerate(elements)]
    with pytest.raises(concordem.CouplingError, match="use stiffer contacts, larger spheres"):
        coupling.ContactCoupling(simulate(bodies), bodies).step(400)
    # Stiff contacts under a load: unstable. With the guard of the energy of the run, that guard may be first.
    stiff = {"frictional": {"normal_stiffness": 8e7, "shear_stiffness": 0.0, "friction_coefficient": 0.0}}
    elements = [block([0, 0, 0]), block([0, 0, 0.11])]
    bodies = [coupling.ContactBody(f"b{k}", e, stiff, 0.01, 0.9) for k, e in enumerate(elements)]
    run = simulate(bodies, integration={"time_step": STEP, "allow_energy_error": True})
    load = np.zeros_like(elements[1].nodes)
    load[:, 2] = -1.0
    with pytest.raises(concordem.CouplingError, match="use a smaller time step, softer contacts"):
        coupling.ContactCoupling(run, bodies).step(400, [-load, load])
    # A skin that stretches until its spheres leave gaps.
    stretched = [coupling.ContactBody("b", block([0, 0, 0]), LAW, 0.02, 0.9)]
    contact = coupling.ContactCoupling(simulate(stretched), stretched)
    stretched[0].elements.velocity[:] = 3e3 * stretched[0].elements.nodes
    with pytest.raises(concordem.CouplingError, match="its spheres leave gaps"):
        contact.step(20)


# ---- Materials that do not touch -------------------------------------------------------------------------------------------------


def test_excluded_materials_pass_through_each_other():
    def scene(exclude, **more):
        spheres = [[0, 0, 0, 0.01], [0.0195, 0, 0, 0.01], [0.1, 0, 0.0095, 0.01]]
        return concordem.Scenario(**({
            "packing": {"kind": "spheres", "spheres": spheres},
            "material": [{"name": "a", "density": 1000.0} | LAW, {"name": "b", "density": 1000.0} | LAW],
            "contacts": {"law": "frictional", "exclude": exclude},
            "wall": [{"name": "floor", "material": "b", "shape": {"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}}],
            "set": [{"name": "second", "selection": {"kind": "ids", "ids": [1]}, "material": "b"}],
            "integration": {"time_step": STEP}, "stop": {"steps": 10},
        } | more))

    with pytest.raises(concordem.ScenarioError, match="deep in the wall"):
        scene([["a", "b"]]).simulation().step()
    run = scene([["a", "b"], ["b", "b"]]).simulation()
    run.step(5)
    forces = run.forces()
    assert len(forces.contacts.force) == 0 and len(forces.walls.force) == 0 and not run.state.velocities.any()
    with pytest.raises(concordem.ScenarioError, match="no material has this name"):
        scene([["a", "c"]])
    with pytest.raises(concordem.ScenarioError, match="names the same pair twice"):
        scene([["a", "b"], ["b", "a"]])
