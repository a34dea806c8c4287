"""Meshes that Python moves, and the surface coupling: particles that touch the skin of finite elements.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import concordem
import numpy as np
import pytest
from concordem import coupling

STEP = 2e-5
SQUARE = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]


def scene(wall, spheres, velocities=None, threads=1, step=STEP, stiffness=2e4, **tables):
    """Spheres and a wall, or walls, with friction; velocities by sphere."""
    names = [f"s{k}" for k in range(len(spheres))]
    return concordem.Scenario(**({
        "packing": {"kind": "spheres", "spheres": spheres},
        "material": {"name": "m", "density": 2500.0, "frictional": {
            "normal_stiffness": stiffness, "shear_stiffness": 0.5 * stiffness, "friction_coefficient": 0.4, "damping_ratio": 0.05}},
        "contacts": {"law": "frictional"},
        "wall": wall if isinstance(wall, list) else [wall],
        "set": [{"name": name, "selection": {"kind": "ids", "ids": [k]}} for k, name in enumerate(names)],
        "initial": [{"set": name, "velocity": list(v)} for name, v in zip(names, velocities or [[0, 0, 0]] * len(names))],
        "integration": {"time_step": step},
        "output": {"sample_interval": 1},
        "stop": {"steps": 10**9},
    } | tables)).simulation(threads=threads)


def square(vertices=SQUARE, triangles=((0, 1, 2), (0, 2, 3)), **more):
    shape = {"kind": "mesh", "vertices": [list(v) for v in vertices], "triangles": [list(t) for t in triangles]}
    return {"name": "plate", "material": "m", "shape": shape} | more


# ---- Meshes --------------------------------------------------------------------------------------------------------------------


def test_a_mesh_is_driven_and_placed_alike():
    # The plate rises, tilts, and stretches under a sphere. Driven before each step, or placed after it, it does the same work.
    spheres = [[0.01, 0.02, 0.0099, 0.01]]
    runs = []
    for place in (False, True):
        run = scene(square(), spheres)
        start = np.array(SQUARE)
        velocity = np.array([[0.3, 0, 1.0], [0.5, 0, 1.1], [0.5, 0.1, 1.2], [0.3, 0.1, 1.0]])
        # The first step has no step before it.
        run.place_mesh("plate", start, velocity)
        for k in range(200):
            if place:
                run.step()
                run.place_mesh("plate", run.mesh("plate").positions + STEP * velocity, velocity)
            else:
                run.drive_mesh("plate", velocity)
                run.step()
        runs.append(run)
    driven, placed = runs
    assert np.abs(driven.state.velocities).max() > 0.1
    assert np.array_equal(driven.state.positions, placed.state.positions)
    assert np.array_equal(driven.mesh("plate").positions, placed.mesh("plate").positions)
    assert np.array_equal(driven.mesh("plate").forces, placed.mesh("plate").forces)
    work = [run.samples["boundary_work"] for run in runs]
    # The same products, added in another order.
    assert work[0][-1] > 1e-4 and np.allclose(*work, rtol=1e-12, atol=0)
    for run in runs:
        residual = np.abs(run.samples["residual"]).max()
        # The trapezoidal rule errs by (omega dt)^2/12 of the energy: omega dt = 0.028 and less.
        assert residual < 1e-4 * work[0][-1]


def test_a_belt_without_velocities_stands_as_in_the_source():
    # Stransky's module moves the facets and does not set their velocities: the belt passes under the sphere without friction.
    speeds = []
    for scale in (1.0, 0.0):
        run = scene(square(), [[0.01, 0.02, 0.00999, 0.01]], integration={"time_step": STEP, "gravity": [0, 0, -9.81]})
        velocity = np.tile([0.5, 0.0, 0.0], (4, 1))
        run.place_mesh("plate", SQUARE, scale * velocity)
        for _ in range(1000):
            run.step()
            run.place_mesh("plate", run.mesh("plate").positions + STEP * velocity, scale * velocity)
        speeds.append(run.state.velocities[0, 0])
    # Sliding would last 0.5/(3.5 * 0.4 * 9.81) = 0.036 s; the sphere bounces by its first overlap. Half a step of the first contact is
    # missing in 0.02 s. Under the standing belt, rounding remains.
    assert speeds[0] == pytest.approx(0.4 * 9.81 * 0.02, rel=0.1) and abs(speeds[1]) < 1e-14


def test_forces_on_vertices_are_those_on_the_particles():
    run = scene(square(), [[0.01, 0.02, 0.01, 0.01], [-0.05, 0.03, 0.01, 0.01]], [[0.3, 0, -1.0], [0, -0.2, -1.0]])
    run.step(5)
    for _ in range(20):
        places, centers = run.mesh("plate").positions, run.state.positions.copy()
        run.step()
        force, torque = run.net_forces()
        on_mesh = run.mesh("plate").forces
        assert np.abs(force).max() > 1
        # Rounding of forces of 10 N.
        assert np.abs(on_mesh.sum(axis=0) + force.sum(axis=0)).max() < 1e-13
        moment = np.cross(places, on_mesh).sum(axis=0) + (np.cross(centers, force) + torque).sum(axis=0)
        assert np.abs(moment).max() < 1e-14


@pytest.mark.parametrize("threads", [1, 2])
def test_a_run_with_a_mesh_continues_bit_by_bit(tmp_path, threads):
    motion = {"rotation": [0.1, 0, 0.5], "center": [0.0, 0.01, 0.0], "displacement": [0, 0, 2e-3], "history": "up",
              "vertices": [[0, 0, 0], [1e-3, 0, 0], [1e-3, 0, 1e-3], [0, 0, 0]]}
    history = {"name": "up", "shape": {"kind": "table", "points": [[0, 0], [4e-3, 1], [8e-3, 0.5]]}}
    spheres = [[0.02 * x, 0.02 * y, 0.0101, 0.01] for x in (-1, 0, 1) for y in (-1, 0, 1)]

    def start(count):
        return scene(square(motion=motion), spheres, [[0.2, 0.1, 0]] * 9, threads=count, history=[history])

    whole = start(1)
    largest = 0.0
    for _ in range(400):
        whole.step()
        largest = max(largest, np.abs(whole.mesh("plate").forces).max())
    half = start(threads)
    half.step(137)
    half.save(tmp_path / "half.h5")
    second = concordem.Simulation.load(tmp_path / "half.h5", threads=threads)
    second.step(400 - 137)
    assert largest > 1
    assert second.state_hash() == whole.state_hash()
    with pytest.raises(ValueError, match="follows the `motion`"):
        whole.drive_mesh("plate", np.zeros((4, 3)))


def test_motion_of_a_scenario_has_its_closed_form():
    motion = {"rotation": [0, 0, "90 deg"], "center": [0.1, 0, 0], "displacement": [0, 0, "3 mm"], "history": "up",
              "vertices": [[0.1, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]}
    history = {"name": "up", "shape": {"kind": "table", "points": [[0, 2], [1e-3, 3]]}}
    run = scene(square(motion=motion), [[0, 0, 1.0, 0.05]], history=[history])
    run.step(25)
    # Half way: vertices move before they rotate by 45 degrees about the center, over a change of the factor of one half.
    own = np.array(SQUARE)
    own[0, 0] += 0.05
    c = np.sqrt(0.5)
    arm = own - [0.1, 0, 0]
    expected = np.stack([0.1 + c * (arm[:, 0] - arm[:, 1]), c * (arm[:, 0] + arm[:, 1]), arm[:, 2] + 1.5e-3], axis=1)
    assert np.allclose(run.mesh("plate").positions, expected, rtol=0, atol=1e-15)
    run.step(100)
    rest = run.mesh("plate")
    assert np.allclose(rest.positions[1], [0.1 - -0.1 * 1.0, 0, 3e-3], rtol=0, atol=1e-15) and not rest.velocities.any()


def test_meshes_that_do_not_fit_are_refused():
    far = [[0, 0, 1.0, 0.05]]
    run = scene(square(), far)
    with pytest.raises(ValueError, match=r'no wall named "floor" is a mesh; meshes of the scenario: \["plate"\]'):
        run.mesh("floor")
    with pytest.raises(ValueError, match="3 velocities for the 4 vertices"):
        run.drive_mesh("plate", np.zeros((3, 3)))
    with pytest.raises(ValueError, match="the velocity of vertex 2 is not finite"):
        run.drive_mesh("plate", [[0, 0, 0], [0, 0, 0], [0, np.nan, 0], [0, 0, 0]])
    with pytest.raises(ValueError, match="triangle 0 has no area"):
        run.place_mesh("plate", np.array(SQUARE) * [0, 1, 1], np.zeros((4, 3)))
    assert np.array_equal(run.mesh("plate").positions, SQUARE)
    run.drive_mesh("plate", np.full((4, 3), 1e4))
    with pytest.raises(concordem.SolverError, match="vertex 0 moves .* in one step, more than the smallest radius"):
        run.step()
    for wall, message in [
        (square(triangles=[[0, 1, 2], [0, 2, 2], [0, 2, 3]]), "triangle 1 has no area"),
        (square(triangles=[[0, 1, 2]]), "vertex 3 belongs to no triangle"),
        (square(triangles=[[0, 1, 2], [0, 2, 9]]), "names vertex 9, but there are only 4"),
        (square(velocity=[0, 0, 1.0]), "a mesh moves by its vertices"),
        ({"name": "w", "material": "m", "shape": {"kind": "mesh"}}, "neither a file nor vertices"),
        (square(motion={"history": "up", "displacement": [0, 0, 0]}), "moves no vertex"),
        (square(motion={"history": "down", "displacement": [0, 0, 1.0]}), "down"),
        (square(motion={"history": "up", "rotation": [0, 0, 1.0]}), "the rotation has no center"),
        (square(motion={"history": "up", "vertices": [[0, 0, 1.0]]}), "1 rows for 4 vertices"),
        ({"name": "w", "material": "m", "shape": {"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]},
          "motion": {"history": "up", "displacement": [0, 0, 1.0]}}, "only the vertices of a mesh have a motion"),
    ]:
        history = [{"name": "up", "shape": {"kind": "table", "points": [[0, 0], [1, 1]]}}]
        with pytest.raises((concordem.ScenarioError, concordem.AssemblyError), match=message):
            scene(wall, far, **({"history": history} if "motion" in wall else {}))


def test_in_the_plane_a_mesh_stands_upright():
    upright = square([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]])
    discs = {"packing": {"kind": "spheres", "spheres": [[0.00995, 0.0, 0.0, 0.01]]}, "dimension": 2}
    run = scene(upright, [[0, 0, 0, 1]], **discs)
    run.step()
    assert run.mesh("plate").forces[:, 0].sum() == pytest.approx(-1.0, rel=1e-12)
    assert np.abs(run.mesh("plate").forces[:, 2]).max() == 0
    with pytest.raises(ValueError, match="vertices do not move along z"):
        run.drive_mesh("plate", np.ones((4, 3)))
    with pytest.raises(concordem.ScenarioError, match="not perpendicular to the plane"):
        scene(square(), [[0, 0, 0, 1]], **discs)


# ---- Surface coupling ----------------------------------------------------------------------------------------------------------


def block(kind="Hex", size=0.1, cells=2, step=STEP, **options):
    """A cube of rubber around the origin."""
    fem = pytest.importorskip("skfem")
    line = np.linspace(-0.5 * size, 0.5 * size, cells + 1)
    mesh = getattr(fem, f"Mesh{kind}").init_tensor(line, line, line)
    return coupling.ScikitDynamics(mesh, coupling.Elastic(2e6, 0.2, 1000.0), step, **options)


def bombarded(kind="Hex", threads=1, place=None, **tables):
    """A free block that spins, hit by three spheres."""
    elements = block(kind)
    elements.velocity[:] = np.cross([1.0, -2.0, 3.0], elements.nodes)
    skin = coupling.Skin(elements)
    spheres = [[0.01, 0.012, 0.0712, 0.02], [-0.0712, 0.01, -0.02, 0.02], [0.03, 0.0712, 0.01, 0.02]]
    run = scene(skin.wall("skin", "m"), spheres, [[0.5, 0, -2.0], [2.0, 0.3, 0], [0, -2.0, -0.4]], threads=threads, **tables)
    return run, elements, skin


def momenta(elements, state):
    momentum = state.masses[:, None] * state.velocities
    middle = state.positions - 0.5 * STEP * state.velocities
    spin = state.inertias.reshape(len(state), -1)[:, :1] * state.angular_velocities
    return elements.momentum() + momentum.sum(axis=0), elements.angular_momentum() + (np.cross(middle, momentum) + spin).sum(axis=0)


@pytest.mark.parametrize("kind", ["Hex", "Tet"])
def test_momentum_and_energy_pass_the_skin_without_loss(kind):
    run, elements, skin = bombarded(kind)
    surface = coupling.SurfaceCoupling(run, elements, skin)
    start = momenta(elements, run.state)
    moving = run.state.masses @ run.state.velocities
    energy = elements.kinetic_energy + 0.5 * float(run.state.masses @ (run.state.velocities**2).sum(axis=1))
    largest = 0.0
    for _ in range(600):
        surface.step()
        largest = max(largest, np.abs(surface.last.force).max())
        now = momenta(elements, run.state)
        for before, after in zip(start, now):
            # Rounding of up to 600 steps.
            assert np.abs(after - before).max() < 1e-12 * np.abs(moving).max()
    assert largest > 50
    # What the elements got, the particles lost.
    lost = moving - run.state.masses @ run.state.velocities
    assert np.abs(surface.impulse).max() > 0.1 * np.abs(moving).max() and np.allclose(surface.impulse, lost, rtol=0, atol=1e-13)
    # The work of the skin is a term of both ledgers. That of the particles ends with the half step before the last forces.
    half = 0.5 * STEP * float(np.vdot(surface.last.nodal, elements.velocity[skin.nodes]))
    assert surface.work == pytest.approx(elements.external_work, rel=1e-12)
    assert run.samples["boundary_work"][-1] == pytest.approx(-(surface.work - half), rel=1e-9)
    assert abs(surface.work) > 0.02 * energy
    # Each ledger closes; the trapezoidal rule for the contacts errs by (omega dt)^2/12, omega dt = 0.02.
    assert abs(elements.balance) < 1e-12 * energy
    assert np.abs(run.samples["residual"]).max() < 1e-4 * energy


FRICTION = {"normal_stiffness": 2e4, "shear_stiffness": 1e4, "friction_coefficient": 0.4, "damping_ratio": 0.05}
# Beside the three spheres: particles that deform, a clump, and a wall that another sphere hits.
BESIDE = {
    "deformable": {"material": {"name": "m", "density": 2500.0, "frictional": FRICTION, "deformable": {"young": 2e6, "poisson": 0.25}}},
    "clump": {"clump": [{"material": "m", "spheres": [[0.01, -0.08, 0.0, 0.015], [0.02, -0.08, 0.0, 0.015]], "velocity": [0, 2.0, 0]}]},
}


@pytest.mark.parametrize("tables", BESIDE.values(), ids=BESIDE)
def test_momentum_passes_the_skin_beside_other_features(tables):
    run, elements, skin = bombarded(**tables)
    surface = coupling.SurfaceCoupling(run, elements, skin)
    start, moving = momenta(elements, run.state), run.state.masses @ run.state.velocities
    surface.step(400)
    now = momenta(elements, run.state)
    # Rounding of 400 steps. Members of a clump do not have their own angular velocities at the half step: 2e-8.
    for before, after, tolerance in zip(start, now, (1e-13, 1e-7 if "clump" in tables else 1e-13)):
        assert np.abs(after - before).max() < tolerance * np.abs(moving).max()
    assert np.abs(surface.impulse).max() > 0.1 * np.abs(moving).max()


def test_another_wall_takes_its_own_momentum():
    elements = block()
    skin = coupling.Skin(elements)
    plane = {"name": "plane", "material": "m", "shape": {"kind": "plane", "point": [0.4, 0, 0], "normal": [-1, 0, 0]}}
    spheres, velocities = [[0.01, 0.012, 0.0712, 0.02], [0.3795, 0, 0, 0.02]], [[0.5, 0, -2.0], [2.0, 0, 0]]
    run = scene([skin.wall("skin", "m"), plane], spheres, velocities)
    surface = coupling.SurfaceCoupling(run, elements, skin)
    surface.step(400)
    by_id = np.array(run.state.velocities)[np.argsort(run.state.ids)]
    # The second sphere has come back from the plane; the first one gave the elements what it lost.
    assert by_id[1, 0] < -1.0 and np.abs(surface.impulse).max() > 1e-3
    lost = run.state.masses[0] * (np.array(velocities[0]) - by_id[0])
    assert np.allclose(surface.impulse, lost, rtol=0, atol=1e-13)
    assert np.allclose(elements.momentum(), surface.impulse, rtol=0, atol=1e-13)


def test_a_rigid_motion_of_the_skin_makes_no_force():
    elements = block()
    skin = coupling.Skin(elements)
    run = scene(skin.wall("skin", "m"), [[0.01, 0.012, 0.0701, 0.02]], [[0.3, -0.1, 0.2]])
    elements.velocity[:] = [0.3, -0.1, 0.2]
    surface = coupling.SurfaceCoupling(run, elements, skin)
    surface.step(300)
    assert surface.work == 0 and not surface.impulse.any()


def test_a_weight_on_a_block_has_its_indentation():
    # A sphere rests on a clamped block: the skin carries its weight, and the mean displacement of the nodes is that of the weight.
    elements = block(damping=200.0, fixed=np.isclose(block().nodes[:, 2], -0.05))
    skin = coupling.Skin(elements)
    integration = {"time_step": STEP, "gravity": [0, 0, -9.81], "damping": {"kind": "local", "coefficient": 0.3}}
    run = scene(skin.wall("skin", "m"), [[0.0, 0.0, 0.07, 0.02]], integration=integration)
    surface = coupling.SurfaceCoupling(run, elements, skin)
    surface.step(12000)
    weight = float(run.state.masses[0]) * 9.81
    assert surface.last.force[2] == pytest.approx(-weight, rel=1e-4)
    # The sphere is above the node in the middle of the top.
    top = np.argmin(np.linalg.norm(elements.nodes - [0, 0, 0.05], axis=1))
    unit = np.zeros_like(elements.nodes)
    unit[top, 2] = -weight
    alone = block(damping=200.0, fixed=elements.fixed)
    for _ in range(12000):
        alone.step(unit)
    assert elements.displacement[top, 2] == pytest.approx(alone.displacement[top, 2], rel=1e-3)
    overlap = 0.07 - 0.02 + 0.02 - (run.state.positions[0, 2] - elements.displacement[top, 2])
    assert overlap == pytest.approx(weight / 2e4, rel=1e-3)


def test_a_coupled_run_continues_bit_by_bit(tmp_path):
    run, elements, skin = bombarded()
    surface = coupling.SurfaceCoupling(run, elements, skin)
    surface.step(150)
    run.save(tmp_path / "half.h5")
    saved = elements.save()
    surface.step(100)
    second = concordem.Simulation.load(tmp_path / "half.h5", threads=2)
    other = block()
    start = coupling.Skin(other)
    other.restore(saved)
    coupling.SurfaceCoupling(second, other, start).step(100)
    assert second.state_hash() == run.state_hash()
    assert np.array_equal(other.displacement, elements.displacement) and np.array_equal(other.velocity, elements.velocity)
    with pytest.raises(concordem.CouplingError, match="away from node"):
        coupling.SurfaceCoupling(second, block(), start)


def test_skins_and_pairs_that_do_not_fit_are_refused():
    elements = block()
    skin = coupling.Skin(elements)
    # 26 of 27 nodes, 24 faces with two triangles each; 9 nodes on the top.
    assert len(skin.nodes) == 26 and skin.triangles.shape == (48, 3)
    normals = np.cross(*(skin.positions[skin.triangles[:, k]] - skin.positions[skin.triangles[:, 0]] for k in (1, 2)))
    assert (np.einsum("ij,ij->i", normals, skin.positions[skin.triangles].mean(axis=1)) > 0).all()
    top = coupling.Skin(elements, where=np.isclose(elements.nodes[:, 2], 0.05))
    assert len(top.nodes) == 9 and len(top.triangles) == 8
    tet = coupling.Skin(block("Tet"))
    normals = np.cross(*(tet.positions[tet.triangles[:, k]] - tet.positions[tet.triangles[:, 0]] for k in (1, 2)))
    assert 0.5 * np.linalg.norm(normals, axis=1).sum() == pytest.approx(0.06, rel=1e-12)
    with pytest.raises(concordem.CouplingError, match="would be empty"):
        coupling.Skin(elements, where=np.zeros(27, dtype=bool))
    far = [[0, 0, 1.0, 0.05]]
    with pytest.raises(concordem.CouplingError, match="has 9 vertices, the skin 26"):
        coupling.SurfaceCoupling(scene(top.wall("top", "m"), far), elements, skin)
    with pytest.raises(concordem.CouplingError, match="must be equal: fix integration.time_step"):
        coupling.SurfaceCoupling(scene(skin.wall("skin", "m"), far, step=STEP / 2), elements, skin)
    plane = {"name": "w", "material": "m", "shape": {"kind": "plane", "point": [0, 0, -1], "normal": [0, 0, 1]}}
    with pytest.raises(concordem.CouplingError, match="has 0 meshes"):
        coupling.SurfaceCoupling(scene(plane, far), elements, skin)
    other = skin.wall("skin", "m")
    other["shape"]["triangles"][0] = other["shape"]["triangles"][0][::-1]
    with pytest.raises(concordem.CouplingError, match="other triangles"):
        coupling.SurfaceCoupling(scene(other, far), elements, skin)
    heat = {"model": "contacts", "temperature": 293.0, "contact": {"constriction": True}}
    material = {"name": "m", "density": 2500.0, "frictional": FRICTION, "thermal": {"conductivity": 1.0, "specific_heat": 900.0}}
    with pytest.raises(concordem.CouplingError, match=r"the elements take no heat; remove \[heat\]"):
        coupling.SurfaceCoupling(scene(skin.wall("skin", "m"), far, heat=heat, material=material), elements, skin)
    stopped = coupling.SurfaceCoupling(scene(skin.wall("skin", "m"), far, stop={"steps": 2}), elements, skin)
    with pytest.raises(concordem.CouplingError, match="has ended"):
        stopped.step(3)


def test_spheres_touch_the_bent_beam_outside_its_outline(import_example):
    surface_beam = import_example("surface_beam")
    rows, elements, _ = surface_beam.run()
    force = np.array(rows["force"])
    stale = np.array(surface_beam.run(follow=False)[0]["force"])
    # With a skin that stays behind, only the first sphere ever touches the beam.
    assert stale[:, 0].max() > 1e4 and stale[:, 1:].max() == 0
    assert force[:, 1].max() > 1e4 and max(rows["reach"]) > 1.02
    # Momentum of the spheres goes to the beam up to rounding of 1,500 steps.
    assert max(rows["drift"]) < 1e-12
    assert np.abs(rows["balance"]).max() < 1e-9 * rows["elements"][-1]
