"""Start states: what ConcorDEM's peers get from it is compared with the scenario, in every case; a mistake in any of it must be found."""
import copy
import math

import numpy as np
import pytest
from concordem_validate import case as cases
from concordem_validate import runner, scenario, stability, start
from concordem_validate.engines import concordem
from concordem_validate.errors import HarnessError, Incomparable, Unsupported
from concordem_validate.quantity import si
from conftest import FOLDER, need

FAST = [name for name in cases.names() if cases.load(name).tier == "fast"]
# a random packing is the program's; its radii, density, overlaps, and contacts are checked
OF_THE_PROGRAM = {"places in the packing"}


def tasks(name):
    return [task for task in cases.load(name).tasks if task.command != "elastic"]


@pytest.fixture(scope="module")
def exported():
    """Start states of the program, stored for the rounds as well."""
    need("concordem")
    made = runner.Runner(FOLDER, quiet=True)
    return lambda task: made.start_of(copy.copy(task))


def scaled(name, factor):
    def apply(one):
        values = getattr(one, name)
        if not np.any(values):
            return False
        setattr(one, name, values * factor)
    return apply


def without_bond(one):
    if not len(one.bonds):
        return False
    one.bonds, one.reference_length = one.bonds[:-1], one.reference_length[:-1]


def bond_of_another_pair(one):
    if not len(one.bonds):
        return False
    pairs = {tuple(pair) for pair in one.bonds.tolist()}
    free = next(((a, b) for a in range(len(one.radius)) for b in range(a + 1, len(one.radius)) if (a, b) not in pairs), None)
    if free is None:
        return False
    one.bonds = np.concatenate([one.bonds[:-1], [free]])


def bond_lengths(one):
    return scaled("reference_length", 1.0001)(one)


def another_material(one):
    if len(one.material) < 2:
        return False
    one.material = one.material.copy()
    one.material[-1] += 1


def particle_lost(one):
    for name in ("position", "velocity", "angular_velocity", "radius", "mass", "material"):
        setattr(one, name, getattr(one, name)[:-1])
    if len(one.bonds):
        kept = (one.bonds < len(one.radius)).all(axis=1)
        one.bonds, one.reference_length = one.bonds[kept], one.reference_length[kept]


# each gives False where a case has no such thing
MISTAKES = {
    "density": scaled("mass", 1 + 1e-9),
    "radius": scaled("radius", 1.001),
    "millimeters for meters": scaled("position", 1e-3),
    "places": scaled("position", 1.003),
    "time step": scaled("dt", 1.001),
    "a bond too few": without_bond,
    "a bond of another pair": bond_of_another_pair,
    "length of the bonds": bond_lengths,
    "velocity": scaled("velocity", 1.001),
    "angular velocity": scaled("angular_velocity", 1.001),
    "material": another_material,
    "a particle too few": particle_lost,
}
# Lengths of bonds with heat follow the temperatures, which the start state does not have. One sphere less in a random specimen is another
# specimen, which all peers get.
NOT_SEEN = {("heat-bonds", "length of the bonds"), ("notched-beam", "a particle too few"), ("splitting-disc", "a particle too few")}


@pytest.mark.parametrize("name", FAST)
def test_every_mistake_in_a_start_state_is_found_in_every_case(exported, name):
    for task in tasks(name):
        sound, missed = exported(task), []
        words, alone = start.compare(sound, task.scenario, task.folder)
        assert set(alone) <= OF_THE_PROGRAM, f"{task.variant}: {alone}"
        assert {"mass", "time step", "velocity"} <= set(words) and ("bonds" not in task.scenario or any("bonds" in word for word in words))
        for label, plant in MISTAKES.items():
            one = copy.deepcopy(sound)
            if plant(one) is False or (name, label) in NOT_SEEN:
                continue
            try:
                start.compare(one, task.scenario, task.folder)
                missed.append(label)
            except Incomparable as error:
                assert error.cause == "start", error
        assert not missed, f"{task.variant}: {missed}"


def cells(**changes):
    return {key.replace("__", "."): value for key, value in changes.items()}


# case, variant, what a program that reads the scenario wrongly would build
READINGS = {
    "density of all that is bonded": ("chain-waves", "long-wave", cells(material__0__density=5777)),
    "density where particles collide": ("linear-oblique", "finite", cells(material__0__density=5777)),
    "density of concrete": ("cpm-bond", "tension-exponential", cells(material__0__density=5777)),
    "density where bonds break": ("bar-fracture", "main", cells(material__0__density=5777)),
    "density of a random packing": ("cpm-cell", "plain", cells(material__0__density=5777)),
    "radius of a random packing": ("cpm-cell", "plain", cells(packing__radius="1.001 mm")),
    "reach of the bonds": ("cpm-cell", "plain", cells(bonds__interaction_ratio=1.49)),
    "size of a specimen": ("cpm-uniaxial", "tension", cells(packing__shape__size=["15 mm", "15 mm", "28 mm"])),
    "friction of the compaction": ("cpm-cell", "plain", cells(packing__friction=0.5)),
    "kind of lattice": ("lattice-strength", "fcc", cells(packing__lattice="hcp")),
    "rows of a lattice": ("ddem-peers", "bar-plane-strain", cells(packing__repeats=[9, 21, 1])),
    "radius of a lattice": ("ddem-peers", "bar-plane-strain", cells(packing__radius="1.0001 mm")),
    "automatic step of another stiffness": ("ddem-rows", "row-rigid", cells(material__0__linear_bond__normal_stiffness="7.1e10 N/m")),
    "automatic step of another damping": ("ddem-rows", "bar", cells(material__0__linear_bond__damping_ratio=0.69)),
    "automatic step of stiffer particles": ("ddem-rows", "row-plane-strain", cells(material__0__deformable__young="210 GPa")),
    "automatic step of iterated strains": ("ddem-rows", "row-plane-strain", cells(deformable__update="iterated")),
    "speed of the loading": ("cpm-uniaxial", "tension", cells(loading__strain_rate="1.001 1/s")),
}


@pytest.mark.parametrize("reading", READINGS)
def test_a_program_that_misreads_a_scenario_is_found(reading, tmp_path):
    need("concordem")
    name, variant, changes = READINGS[reading]
    task = next(task for task in tasks(name) if task.variant == variant)
    misread = copy.copy(task)
    misread.scenario = scenario.changed(task.scenario, changes)
    assert misread.scenario != task.scenario
    with pytest.raises(Incomparable) as error:
        start.compare(concordem.export_start(misread, tmp_path), task.scenario, task.folder)
    assert error.value.cause == "start"


def chain(count=8, **law):
    """A chain of spheres on linear springs without a given step."""
    return {"packing": {"kind": "spheres", "spheres": [[2e-3 * k, 0, 0, 1e-3] for k in range(count)]}, "contacts": {"law": "none"},
            "material": [{"name": "m", "density": 2500, "linear_bond": {"normal_stiffness": 1e5, "shear_stiffness": 0, **law}}],
            "bonds": {"law": "linear_bond", "interaction_ratio": 1.1}, "stop": {"steps": 1}}


def test_the_automatic_step_is_that_of_the_closed_form(tmp_path):
    # a free chain of n masses: ω = 2 √(k/m) cos(π/2n); shorter by √(1 + ζ²) - ζ with dashpots
    mass = 2500 * 4 / 3 * math.pi * 1e-9
    frequency = 2 * math.sqrt(1e5 / mass) * math.cos(math.pi / 16)
    assert math.isclose(start.state(chain(), tmp_path).dt, 0.8 * 2 / frequency, rel_tol=1e-13)
    zeta = 0.3 * math.sqrt(0.5 * mass / 1e5) * frequency
    assert math.isclose(start.state(chain(damping_ratio=0.3), tmp_path).dt, 1.6 / frequency * (math.sqrt(1 + zeta**2) - zeta), rel_tol=1e-13)
    # two spheres that turn: a shear spring with arms r moves 2 (u + r φ), so ω² = 2 k_t (1/m + r²/I) = 7 k_t/m, above 2 k_n/m
    pair = start.state(chain(2, shear_stiffness=1e5), tmp_path)
    assert math.isclose(pair.dt, 1.6 / math.sqrt(7e5 / mass), rel_tol=1e-12)
    for change in (dict(contacts={"law": "frictional"}), dict(integration={"damping": {"kind": "local"}}), dict(wall=[{}])):
        with pytest.raises(Unsupported, match="give integration.time_step"):
            start.state({**chain(), **change}, tmp_path)


@pytest.mark.parametrize("document", [
    chain(), chain(5, shear_stiffness=4e4, damping_ratio=0.2),
    {**chain(3), "material": [{"name": "m", "density": 900, "linear_bond": {"normal_stiffness": 3e4, "shear_stiffness": 3e4}}]}])
def test_the_program_has_the_same_automatic_step(document, tmp_path):
    need("concordem")
    task = cases.Task("chain", "main", tmp_path, {"version": 1, **document}, None)
    one = concordem.export_start(task, tmp_path)
    assert math.isclose(one.dt, start.state(document, tmp_path).dt, rel_tol=stability.TOLERANCE)
    assert start.compare(one, task.scenario, tmp_path)[1] == []


def test_what_is_not_checked_is_said(tmp_path):
    need("concordem")
    document = {**chain(), "version": 1, "contacts": {"law": "frictional"}}
    document["material"][0]["frictional"] = {"normal_stiffness": 1e5, "shear_stiffness": 1e5}
    task = cases.Task("chain", "main", tmp_path, document, None)
    made = runner.Runner(tmp_path / "out", quiet=True)
    made.start_of(task)
    verdict = made.start_verdicts["chain", "main"]
    assert verdict.status == "pass" and verdict.message.endswith("; of ConcorDEM alone: time step"), verdict.message


def times(name, factor):
    def apply(data):
        data[name] = (np.asarray(data[name], float) * factor).tolist()
    return apply


def heavier(deck):
    assert "read_data data.txt" in deck
    return deck.replace("read_data data.txt", "read_data data.txt\nset atom 3 density 2501")


# engine, case, variant, what it computes with, what it says
OF_PEERS = {
    "mass in YADE": ("yade", "chain-waves", "long-wave", times("mass", 1 + 1e-6), "mass of the run of yade"),
    "inertia in YADE": ("yade", "linear-oblique", "yade-kinematics", times("inertia", 5 / 3), "inertia of the run of yade"),
    "radius in YADE": ("yade", "chain-waves", "long-wave", times("radius", 1 + 1e-6), "radius of the run of yade"),
    "step in YADE": ("yade", "chain-waves", "long-wave", times("dt", 1 + 1e-6), "the run of yade has a time step"),
    "mass in LIGGGHTS": ("liggghts", "linear-oblique", "finite", heavier, "mass of the run of liggghts"),
    "mass in LAMMPS": ("lammps", "beam-cantilever", "twist", lambda deck: deck.replace(
        "read_data data.txt", "read_data data.txt\nset atom 3 density 9"), "mass of the run of lammps"),
    "mass in ESyS-Particle": ("esys", "beam-cantilever", "strong-kick", times("mass", 1 + 1e-6), "mass of the run of esys"),
}


@pytest.mark.parametrize("fault", OF_PEERS)
def test_what_a_peer_computes_with_is_read_back(fault, tmp_path):
    """Masses, radii, inertia, and step of a result are those that the peer has, not those that it was to get."""
    engine, name, variant, plant, said = OF_PEERS[fault]
    need("concordem", engine)
    case = cases.load(name).only([variant], [engine])
    made = runner.Runner(FOLDER, quiet=True)
    sound = made.run([case]).starts
    assert [v.status for v in sound] == ["pass"] and f"; {engine} has the same " in sound[0].message, sound[0].message
    planted = made.run([cases.load(name).only([variant], [engine])], plant={engine: [plant]}).starts
    assert [v.cause for v in planted] == ["start"] and said in planted[0].message, planted[0].message


@pytest.mark.parametrize("text", ["500000 ps", "0.5 us", "5e-7", "0.5 m*mm/m^2*ms", "1e-6 J*s/N*m^2*m/m^2"])
def test_the_program_reads_units_as_the_harness_does(text, tmp_path):
    """A slash divides by the one unit after it."""
    need("concordem")
    task = cases.Task("chain", "main", tmp_path, {**chain(), "version": 1, "integration": {"time_step": text}}, None)
    try:
        one = concordem.export_start(task, tmp_path)
    except HarnessError:
        with pytest.raises(HarnessError):
            start.state(task.scenario, tmp_path)
        return
    assert one.dt == start.state(task.scenario, tmp_path).dt


@pytest.mark.parametrize("change, said", [
    (dict(integration={"time_step": "0.5 m"}), "0.5 m.*give values in s"), (dict(integration={"time_step": "0.5 uss"}), "unknown unit `uss`"),
    (dict(material=[{"name": "m", "density": "2500 kg"}]), "2500 kg.*give values in kg/m"),
    (dict(packing={"kind": "spheres", "spheres": [["1 mm", 0, 0, "1 g"]]}), "1 g.*give values in m")])
def test_a_unit_that_measures_something_else_is_refused(change, said, tmp_path):
    document = {**chain(), "integration": {"time_step": "0.5 us"}, **change}
    with pytest.raises(HarnessError, match=said):
        start.state(document, tmp_path)
    assert start.state({**chain(), "integration": {"time_step": "0.5 us"}}, tmp_path).dt == si("0.5 us", "s") == 5e-7


@pytest.mark.parametrize("name, variant", [("linear-oblique", "finite"), ("ddem-rows", None)])
def test_our_own_moments_of_inertia_are_read_back(name, variant, tmp_path):
    """Those that the solver turns particles with, not those that follow from the masses."""
    need("concordem")
    task = next(t for t in cases.load(name).tasks if variant in (None, t.variant))
    task.scenario["stop"], task.check_threads = {"steps": 2}, False
    one, plane = concordem.export_start(task, tmp_path), task.scenario.get("dimension", 3) == 2
    result = concordem.run(task, tmp_path, 100)
    assert "inertia" in start.compare_run(result, one, plane)
    values, unit = result.fields["inertia"]
    result.fields["inertia"] = values * (1 + 1e-6), unit
    with pytest.raises(HarnessError, match="inertia of the run of concordem"):
        start.compare_run(result, one, plane)
