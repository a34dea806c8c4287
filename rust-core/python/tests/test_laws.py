"""Laws written in Python: they equal the laws in Rust, keep the contracts of the solver, and reject what they return wrongly."""

import numpy as np
import pytest

import concordem
from concordem.laws import Law, Response, check

K_N, K_T, F_N, TANGENT = 1e6, 4e5, 20.0, 0.4


class LinearBond(Law):
    """The linear bond of the library: springs along and across, and a tensile strength."""

    history = {"shear": "vector"}

    def __init__(self, strength=np.inf, energies=True):
        self.strength, self.energies = strength, energies

    def stiffness(self, geometry):
        return K_N, K_T

    def respond(self, contacts):
        normal = K_N * contacts.elongation
        shear = contacts.history["shear"] + K_T * contacts.shear_increment
        broken = normal > self.strength
        stored = {
            "stored_normal": normal**2 / (2 * K_N),
            "stored_shear": (shear**2).sum(1) / (2 * K_T),
        }
        stored["damage"] = np.where(broken, sum(stored.values()), 0.0)
        # The forces of the breaking step are void, and half of its work with them.
        work = normal * (contacts.elongation - contacts.elongation_old) + (shear * contacts.shear_increment).sum(1)
        stored["integration"] = np.where(broken, -0.5 * work, 0.0)
        return Response(normal, shear, {"shear": shear}, broken=broken, energy=stored if self.energies else None)


class Friction(Law):
    """The frictional contact of the library: springs, and Coulomb's limit."""

    history = {"shear": "vector"}

    def stiffness(self, geometry):
        return K_N, K_T

    def respond(self, contacts):
        normal = K_N * contacts.elongation
        trial = contacts.history["shear"] + K_T * contacts.shear_increment
        size = np.linalg.norm(trial, axis=1)
        limit = np.maximum(-TANGENT * normal, 0.0)
        shear = trial * np.where(size > limit, limit / np.maximum(size, 1e-300), 1.0)[:, None]
        return Response(normal, shear, {"shear": shear}, opened=contacts.elongation >= 0)


def lattice(n=4, **tables):
    """A cube of touching spheres that a velocity field bends and stretches."""
    r = 1e-3
    rnd = np.random.default_rng(1)
    places = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
    spheres = [[*(2 * r * p + rnd.uniform(-0.02, 0.02, 3) * r), r] for p in places]
    return concordem.Scenario(
        packing={"kind": "spheres", "spheres": spheres},
        material={
            "name": "m",
            "density": 2500.0,
            "linear_bond": {"normal_stiffness": K_N, "shear_stiffness": K_T, "friction_coefficient": 0.0, **tables.pop("bond", {})},
        },
        bonds={"law": "linear_bond", "interaction_ratio": 1.1},
        contacts={"law": "none"},
        stop={"steps": 400},
        output={"sample_interval": 50},
        **tables,
    )


def start(scenario, **options):
    simulation = scenario.simulation(**options)
    x = simulation.state.positions
    v = simulation.state.writable("velocities")
    v[:, 0] = 400 * x[:, 1] ** 2 / 6e-3 + 1500 * x[:, 0] * (x[:, 2] > 3e-3)
    return simulation


def moved(simulation):
    """Displacements relative to the largest."""
    return np.array(simulation.state.positions)


@pytest.mark.parametrize("strength", [None, 2.0])
def test_a_bond_in_python_equals_the_one_in_rust(strength):
    table = {} if strength is None else {"normal_strength": strength}
    rust = start(lattice(bond=table), threads=1)
    python = start(lattice(), threads=1, bond_law=LinearBond(strength or np.inf))
    for _ in range(4):
        rust.step(100)
        python.step(100)
    bonds = start(lattice()).state.bond_count
    assert python.state.bond_count == rust.state.bond_count and (rust.state.bond_count < 0.8 * bonds) == bool(strength)
    # Sums in another order: roundings of 400 steps, relative to the particles' way.
    way = abs(moved(rust) - np.array(start(lattice()).state.positions)).max()
    assert abs(moved(python) - moved(rust)).max() < 1e-11 * way
    ours, theirs = python.samples, rust.samples
    for name in ("stored_normal", "stored_shear", "damage", "residual"):
        scale = abs(theirs["kinetic"]).max()
        assert abs(ours[name] - theirs[name]).max() < 1e-11 * scale, name


def test_work_counts_as_stored_without_energies():
    """The trapezoidal work of springs is their energy, so the ledger is that of the law in Rust."""
    python = start(lattice(), threads=1, bond_law=LinearBond(2.0, energies=False))
    rust = start(lattice(bond={"normal_strength": 2.0}), threads=1)
    python.run()
    rust.run()
    ours, theirs = python.samples, rust.samples
    scale = theirs["kinetic"].max()
    assert ours["damage"][-1] > 0.01 * scale
    assert abs(ours["residual"] - theirs["residual"]).max() < 1e-11 * scale
    assert abs(ours["damage"] - theirs["damage"]).max() < 1e-11 * scale


def test_a_contact_in_python_equals_the_one_in_rust(tmp_path):
    """Spheres that slide over each other and a wall."""
    tables = {
        "packing": {"kind": "spheres", "spheres": [[0, 0, 1.001e-3, 1e-3], [1.5e-3, 0.2e-3, 2.4e-3, 1e-3], [4e-3, 0, 1.0005e-3, 1e-3]]},
        "material": {
            "name": "m",
            "density": 2500.0,
            "frictional": {"normal_stiffness": K_N, "shear_stiffness": K_T, "friction_coefficient": TANGENT},
        },
        "contacts": {"law": "frictional"},
        "wall": [{"name": "floor", "shape": {"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}, "material": "m"}],
        "set": [{"name": "all", "selection": {"kind": "ids", "ids": [0, 1, 2]}}],
        "initial": [{"set": "all", "velocity": [0.3, 0.1, -0.2]}],
        "stop": {"steps": 300},
        "output": {"sample_interval": 10},
    }
    scenario = concordem.Scenario(**tables)
    rust, python = scenario.simulation(threads=1), scenario.simulation(threads=1, contact_law=Friction())
    # Two spheres touch the floor. A checkpoint continues with the law with which it was written, and with no other.
    rust.step(20)
    python.step(20)
    python.save(tmp_path / "python.h5")
    rust.save(tmp_path / "rust.h5")
    assert concordem.Simulation.load(tmp_path / "python.h5", contact_law=Friction()).state.time == python.state.time
    with pytest.raises(ValueError, match="contacts without a bond of the checkpoint have a law in Python; give it as contact_law"):
        concordem.Simulation.load(tmp_path / "python.h5")
    with pytest.raises(ValueError, match="contacts without a bond of the checkpoint have no law in Python; omit contact_law"):
        concordem.Simulation.load(tmp_path / "rust.h5", contact_law=Friction())
    rust.run()
    python.run()
    assert abs(moved(rust)[:, 2]).max() > 0
    assert abs(moved(python) - moved(rust)).max() < 1e-14
    assert abs(np.array(python.state.angular_velocities) - np.array(rust.state.angular_velocities)).max() < 1e-9 * abs(
        np.array(rust.state.angular_velocities)
    ).max()


def settings():
    """Scenarios with what else a run may have."""
    base = lattice().to_dict()
    flat = [[x, y, 0, r] for x, y, z, r in base["packing"]["spheres"] if z < 1e-3]
    plane = {**base, "dimension": 2, "packing": {"kind": "spheres", "spheres": flat}}
    cell = {
        **base,
        "packing": {**base["packing"], "cell": [8e-3, 8e-3, 8e-3]},
        "loading": {"kind": "cell-strain", "velocity_gradient": [[0, 5, 0], [0, 0, 0], [0, 0, -5]]},
    }
    sets = [{"name": "body", "selection": {"kind": "ids", "ids": [0, 1, 5]}}]
    clump = {**base, "set": sets, "clump": [{"set": "body"}]}
    loads = {**base, "set": sets, "force": [{"set": "body", "force": [0.1, 0, 0.2]}]}
    return {"plane": plane, "cell": cell, "clump": clump, "loads": loads}


@pytest.mark.parametrize("name", ["plane", "cell", "clump", "loads"])
def test_laws_in_python_meet_other_features(name):
    """In 2-D, in a periodic cell that shears, with clumps, and under loads a bond in Python equals the one in Rust, to rounding."""
    scenario = concordem.Scenario.from_dict(settings()[name])
    before = np.array(scenario.simulation().state.positions)
    rust, python = start(scenario, threads=1), start(scenario, threads=1, bond_law=LinearBond())
    rust.run()
    python.run()
    way = abs(moved(rust) - before).max()
    assert way > 1e-7 and abs(moved(python) - moved(rust)).max() < 1e-10 * way
    scale = abs(rust.samples["kinetic"]).max()
    assert abs(python.samples["residual"] - rust.samples["residual"]).max() < 1e-10 * scale


def test_bits_do_not_depend_on_threads_or_restarts(tmp_path):
    law = LinearBond(2.0)
    hashes = set()
    for threads in (1, 2):
        simulation = start(lattice(6), threads=threads, bond_law=law)
        simulation.step(200)
        simulation.save(tmp_path / f"half{threads}.h5")
        simulation.step(200)
        hashes.add(simulation.state_hash())
        again = concordem.Simulation.load(tmp_path / f"half{threads}.h5", bond_law=law)
        again.step(200)
        hashes.add(again.state_hash())
    assert len(hashes) == 1
    with pytest.raises(ValueError, match="have a law in Python; give it as bond_law"):
        concordem.Simulation.load(tmp_path / "half1.h5")


WINDOWS = {"elastic": (-0.4, 0.6, 0.5), "held": (0.3, 0.2, -0.3), "failure": 1.0}


# The suite is Rust, and calls a law as the solver does.
@pytest.mark.once
def test_the_conformance_suite_judges_laws():
    found = check(LinearBond(), **WINDOWS)
    assert found.passed, found.report

    class NotObjective(LinearBond):
        """Keeps the shear force in fixed axes."""

        history = {"x": "scalar", "y": "scalar", "z": "scalar"}

        def respond(self, contacts):
            old = np.stack([contacts.history[axis] for axis in "xyz"], 1)
            shear = old + K_T * contacts.shear_increment
            history = dict(zip("xyz", shear.T))
            return Response(K_N * contacts.elongation, shear, history)

    found = check(NotObjective(), **WINDOWS)
    assert not found.passed and "FAIL" in found.report


class Answers(Law):
    """Answers with a given function."""

    def __init__(self, answer, stiffness=(K_N, K_T)):
        self.answer, self.k = answer, stiffness

    def stiffness(self, geometry):
        return self.k

    def respond(self, contacts):
        return self.answer(contacts)


@pytest.mark.parametrize(
    "law, error, text",
    [
        (Answers(lambda c: 1 / 0), ZeroDivisionError, "division by zero"),
        (Answers(lambda c: 3.0), TypeError, "returned float; return a concordem.laws.Response"),
        (Answers(lambda c: Response(np.zeros(3))), ValueError, r"normal_force has shape \(3,\); give shape"),
        (Answers(lambda c: Response(c.elongation * np.nan)), ValueError, "normal_force is nan in a contact"),
        (Answers(lambda c: Response(0.0, history={"slip": 1.0})), ValueError, "'slip' is no name of its history"),
        (Answers(lambda c: Response(0.0, energy={"heat": 1.0})), ValueError, "'heat' is no energy"),
        (Answers(lambda c: Response(0.0, opened=True)), ValueError, "a bond is opened; say that it is broken"),
        (Answers(lambda c: Response(0.0), stiffness=3.0), TypeError, "return the normal and the shear stiffness"),
        (Answers(lambda c: Response(0.0), stiffness=(-1.0, 0.0)), ValueError, "a stiffness is negative"),
        (LinearBond, TypeError, "bond_law is of type ABCMeta; derive its class from concordem.laws.Law"),
    ],
)
def test_wrong_laws_are_refused(law, error, text):
    with pytest.raises(error, match=text):
        start(lattice(2), bond_law=law).step(2)


def test_laws_without_effect_are_refused():
    with pytest.raises(ValueError, match="contact_law would have no effect; set contacts.law"):
        lattice(2).simulation(contact_law=Friction())
    deformable = {"deformable": {}}
    with pytest.raises(concordem.ConcordemError):
        lattice(2, **deformable).simulation(bond_law=LinearBond())


def test_loads_from_python():
    """A mass on a spring under a force that changes with time: x'' + ω² x = F sin(ω t)/m grows by resonance."""
    scenario = concordem.Scenario(
        packing={"kind": "spheres", "spheres": [[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3]]},
        material={"name": "m", "density": 2500.0, "linear_bond": {"normal_stiffness": K_N, "shear_stiffness": K_T}},
        bonds={"law": "linear_bond", "interaction_ratio": 1.1},
        contacts={"law": "none"},
        set=[{"name": "fixed", "selection": {"kind": "ids", "ids": [0]}}],
        prescribe=[{"set": "fixed", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}],
        integration={"time_step": 2e-8, "damping": {"kind": "none"}},
        stop={"steps": 5000},
        output={"sample_interval": 100},
    )
    simulation = scenario.simulation()
    mass, start_x = simulation.state.masses[1], simulation.state.positions[1, 0]
    omega = np.sqrt(K_N / mass)
    force = np.zeros((2, 3))
    times, way = [], []
    while simulation.stopped is None:
        t = simulation.state.time
        force[1, 0] = 0.1 * np.sin(omega * t)
        simulation.set_loads(force)
        times.append(t)
        way.append(simulation.state.positions[1, 0] - start_x)
        simulation.step()
    t = np.array(times)
    closed = 0.1 / (2 * mass * omega**2) * (np.sin(omega * t) - omega * t * np.cos(omega * t))
    # The load of a step is that of its beginning: ωΔt/2 = 3e-3 late.
    assert abs(np.array(way) - closed).max() < 4e-3 * abs(closed).max()
    samples = simulation.samples
    assert abs(samples["residual"]).max() < 1e-6 * samples["external_work"].max()
    with pytest.raises(ValueError, match="1 forces for 2 particles"):
        simulation.set_loads(np.zeros((1, 3)))
    with pytest.raises(ValueError, match="not finite"):
        simulation.set_loads(force * np.nan)
