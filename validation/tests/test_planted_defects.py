"""Defects planted in law parameters, translations, and results: the listed case must detect each of them.

Laws cannot be rebuilt here, so a defect of a law is planted where it has the same effect: in the scenario ConcorDEM alone gets, in
the closed form written independently, or in ConcorDEM's result. Every test first needs the sound case to pass.
"""
import math
import os

import numpy as np
import pytest
from concordem_validate import case as cases
from concordem_validate import compare, plants, runner, scenario
from conftest import FOLDER, need



def ours(**changes):
    return lambda document: scenario.changed(document, {k.replace("__", "."): v for k, v in changes.items()})


def result(name, change):
    def apply(one):
        one.series[name].values = change(one.series[name].values)

    return apply


def halve(name):
    return result(name, lambda values: 0.5 * values)


def one_step_late(one):
    values = one.series["contact_force"].values
    values[1:] = values[:-1].copy()


def shear_reversed(values):
    values = values.copy()
    values[:, 1] *= -1
    return values


def exchange(a, b):
    """Swap two properties in LIGGGHTS' input script."""
    return lambda deck: deck.replace(f" {a} ", " \0 ").replace(f" {b} ", f" {a} ").replace(" \0 ", f" {b} ")


def times(name, factor):
    def change(data):
        values = np.asarray(data[name], dtype=float) * factor
        data[name] = values.tolist()

    return change


def without(word):
    """Remove the lines of LIGGGHTS' input script that begin with these words."""
    return lambda deck: "\n".join(line for line in deck.splitlines() if not line.startswith(word)) + "\n"


def other(a, b):
    """Replace a word in LIGGGHTS' input script."""
    def change(deck):
        assert a in deck, a
        return deck.replace(a, b)

    return change


def no_own_inertia(module):
    """The fragment as points: without the spheres' own moments of inertia."""
    rigid = module._rigid

    def changed(task):
        radius = task.start.radius
        task.start.radius = 0 * radius
        try:
            return rigid(task)
        finally:
            task.start.radius = radius

    module._rigid = changed


def friction_not_its_angle(data):
    for m in data["materials"]:
        m["frictionAngle"] = np.tan(m["frictionAngle"])


def operator(name, change, width=9):
    """Change a tensor computed by an operator."""
    def apply(one):
        values = np.array(one.numbers["measures"][name]).reshape(-1, width)
        one.numbers["measures"][name] = change(values).ravel().tolist()

    return apply


def transposed(values):
    return values.reshape(-1, 3, 3).transpose(0, 2, 1)


def constants(change):
    """Change Young's modulus and Poisson's ratio of the particles in YADE's loop."""
    def apply(data):
        data["deformable"]["constants"] = [change(*c) for c in data["deformable"]["constants"]]

    return apply


def without_loads(data):
    data["deformable"]["load"] = (0 * np.array(data["deformable"]["load"])).tolist()


def no_rotary_inertia(module):
    """Dispersion with a tenth of the spheres' rotary inertia."""
    springs = module._springs

    def changed(task):
        ks, kb, length, mass, inertia, bending, shear = springs(task)
        return ks, kb, length, mass, 0.1 * inertia, bending, shear

    module._springs = changed


# defect | case, variant, peer | where it is planted
DEFECTS = {
    "sign of the spins, hence of moments": ("pair-kinematics", "moving", "yade", dict(yade=[times("spin", -1)])),
    "sign of the shear force": ("cpm-bond", "shear-confined", "yade",
                                {"result:concordem": [result("contact_force", shear_reversed)]}),
    "factor one half in the stored energy": ("conservation", "main", "analytic",
                                             {"result:concordem": [halve("stored_normal")]}),
    "inertia of a shell": ("linear-oblique", "yade-kinematics", "yade", dict(yade=[times("inertia", 5 / 3)])),
    "time step twice as long": ("cpm-bond", "cyclic", "yade", dict(yade=[times("dt", 2.0)])),
    "ratcheting correction on": ("linear-oblique", "yade-kinematics", "yade",
                                 dict(yade=[lambda data: data.update(ratcheting_correction=True)])),
    "history not turned with the contact": ("linear-oblique", "finite", "analytic", dict(module=[
        lambda module: setattr(module, "_turn", lambda vector, old, new: vector)])),
    "friction coefficient taken for its angle": ("linear-oblique", "yade-kinematics", "yade",
                                                 dict(yade=[friction_not_its_angle])),
    "the other damage law": ("cpm-bond", "tension-exponential", "table",
                             dict(concordem=[ours(material__0__cpm__damage_law="linear")])),
    "slip counted in YADE's way in the thesis form": ("cpm-bond", "thesis-cyclic-shear", "analytic",
                                                      dict(concordem=[ours(material__0__cpm__mode="yade-public")])),
    "mass of the packing in place of the spheres'": ("cpm-bond", "cyclic", "yade", dict(yade=[times("mass", 0.62)])),
    "forces one step late": ("cpm-bond", "tension-exponential", "yade", {"result:concordem": [one_step_late]}),
    "shear and normal stiffness exchanged": ("linear-oblique", "finite", "liggghts", dict(liggghts=[exchange("kn", "kt")])),
    "restitution of 0.9 in place of 0.98": ("hertz-oblique", "main", "analytic", dict(
        concordem=[ours(material__0__hertz_mindlin__restitution=0.9, material__1__hertz_mindlin__restitution=0.9)])),
    "shear ratio of 0.39 in place of 0.4": ("lattice-elasticity", "fcc-0-4", "analytic",
                                            dict(concordem=[ours(material__0__linear_bond__shear_stiffness=0.39)])),
    "a beam 0.1 % too thick": ("beam-cantilever", "swing", "analytic",
                               dict(concordem=[ours(material__0__cohesive_beam__radius="1.001 mm")])),
    "Young's modulus divided by 1 - ν²": ("hertz-normal", "spheres", "analytic",
                                          dict(concordem=[ours(material__0__hertz_mindlin__poisson=0.0)])),
    "damping twice": ("cpm-uniaxial", "tension", "yade", dict(concordem=[ours(integration__damping__coefficient=0.6)])),
    "arm of friction at walls half way through the overlap": ("slip-to-roll", "yade-kinematics", "yade", dict(
        yade=[lambda data: data.update(spherical_bodies=True)])),
    "strength of a bond 1 % too high": ("bar-fracture", "main", "analytic", dict(
        concordem=[ours(material__0__linear_bond__normal_strength="2.02 N")])),
    "stiffness of a bond 0.01 % too high": ("chain-waves", "short-wave", "analytic", dict(
        concordem=[ours(material__0__linear_bond__normal_stiffness=1.0001e5)])),
    "density 0.1 % too high beyond the critical step": ("chain-waves", "beyond-critical", "analytic", dict(
        concordem=[ours(material__0__density=2502.5)])),
    "spheres without inertia of their own": ("conservation", "one-fragment", "analytic", dict(module=[no_own_inertia])),
    "bonds of the wrong law in LIGGGHTS": ("beam-cantilever", "kick", "liggghts", dict(
        concordem=[ours(material__0__cohesive_beam__model="timoshenko")])),
    "the held end let go in LIGGGHTS": ("beam-cantilever", "kick", "liggghts", dict(liggghts=[without("fix held")])),
    "YADE's kinematics for ours in LIGGGHTS": ("cpm-bond", "thesis-cyclic-shear", "liggghts", dict(
        liggghts=[other("kinematics finite", "kinematics yade")])),
    "walls in the default kinematics whatever is asked for": ("slip-to-roll", "yade-kinematics", "yade", dict(
        concordem=[ours(kinematics="finite")])),
    "the plain arm at walls for the ratcheting one": ("slip-to-roll", "yade-ratcheting", "yade", dict(
        concordem=[ours(kinematics="yade")])),
    "sign of the stress of particles": ("operators", "heap", "yade", {"result:concordem": [operator("particle_stress", np.negative)]}),
    "stress of particles not transposed": ("operators", "heap", "yade", {"result:concordem": [operator("particle_stress", transposed)]}),
    "stress of a sheared cell not transposed": ("operators", "cell", "yade", {"result:concordem": [operator("stress", transposed)]}),
    "order of components of LIGGGHTS' stress": ("operators", "cloud-liggghts", "liggghts", {"result:concordem": [
        operator("particle_stress", lambda values: values[:, [0, 1, 2, 3, 5, 4]], 6)]}),
    "sign of the particle's stress in its strain": ("ddem-peers", "block", "yade", dict(yade=[constants(lambda e, nu: (-e, nu))])),
    "Poisson's ratio of the particles 0.01 % too high": ("ddem-peers", "bar-plane-stress", "yade", dict(
        concordem=[ours(material__0__deformable__poisson=1.0001 * 0.35)])),
    "loads that do not strain their particles": ("ddem-peers", "bar-plane-strain", "yade", dict(yade=[without_loads])),
    "particles a million times less stiff in the stiff limit": ("ddem-peers", "stiff-contacts", "liggghts", dict(
        concordem=[ours(material__0__deformable__young="1e14 Pa")])),
    "bending spring of ESyS-Particle taken for whole": ("beam-cantilever", "strong-kick", "esys", dict(esys=[times("bending", 0.5)])),
    "twist spring 0.1 % too stiff against LAMMPS": ("beam-cantilever", "twist", "lammps", dict(
        concordem=[ours(material__0__cohesive_beam__poisson=0.24875)])),
    "a beam 0.01 % too thick against LAMMPS": ("bending-waves", "strong", "lammps", dict(
        concordem=[ours(material__0__cohesive_beam__radius="1.0001 mm")])),
    "rotary inertia left out of the waves": ("bending-waves", "packet", "analytic", dict(module=[no_rotary_inertia])),
    "a beam without its notch": ("notched-beam", "notched", "yade", dict(concordem=[ours(cut="__remove__")])),
    "a notch that is 0.5 mm too deep": ("notched-beam", "slit", "yade", dict(
        concordem=[ours(cut__0__shape__maximum=["1.1 mm", "6 mm", "-1.5 mm"])])),
    "a strip narrower by 5 %": ("notched-beam", "notched", "yade", dict(concordem=[ours(loading__strip_width="2.85 mm")])),
    "lateral stress 2 % too high": ("triaxial-cell", "confined", "yade", dict(concordem=[ours(loading__stress=[
        ["-5.1 MPa", 0, 0], [0, "-5.1 MPa", 0], [0, 0, "-5 MPa"]])])),
    "a servo that may not follow": ("triaxial-cell", "confined", "yade", dict(concordem=[ours(loading__maximum_strain_rate="0.5 1/s")])),
    "plates that close 0.1 % too fast": ("splitting-disc", "disc", "yade", dict(concordem=[ours(loading__closing_velocity="300.3 mm/s")])),
    "one plate at rest in LIGGGHTS": ("splitting-disc", "lattice", "liggghts", dict(liggghts=[without("fix move_upper")])),
    "friction at LIGGGHTS' plates": ("splitting-disc", "lattice", "liggghts", dict(liggghts=[other(
        "coefficientFriction peratomtypepair 1 0.0", "coefficientFriction peratomtypepair 1 0.8")])),
    "conductivity 0.01 % too high": ("heat-lattice", "one-material", "analytic", dict(
        concordem=[ours(material__0__thermal__conductivity=1.10011)])),
    "heat capacities exchanged in LIGGGHTS": ("heat-lattice", "two-materials", "liggghts", dict(
        liggghts=[other("thermalCapacity peratomtype 800.0 400.0", "thermalCapacity peratomtype 400.0 800.0")])),
    "conductivity of bonds 0.01 % too high": ("heat-bonds", "main", "liggghts", dict(
        concordem=[ours(material__0__thermal__conductivity=1.10011)])),
    "expansion of bonds 0.01 % too high": ("heat-bonds", "main", "liggghts", dict(
        concordem=[ours(material__0__thermal__expansion=1.0001e-5)])),
    "resistance of contacts 0.01 % too high": ("heat-collisions", "resistance", "liggghts", dict(
        concordem=[ours(heat__contact__resistance=1.0001e-4)])),
    "conductivity 0.01 % too high in LAMMPS": ("heat-collisions", "constriction", "lammps", dict(
        lammps=[other("heat radius 7.0", "heat radius 7.0007")])),
    "friction 1 % too high in a settling bed": ("granular-settling", "sliding", "analytic", dict(
        concordem=[ours(material__0__hertz_mindlin__friction_coefficient=0.505)])),
    "Poisson's ratio of a sphere 10 % too high": ("hertz-oblique", "main", "analytic", dict(
        concordem=[ours(material__0__hertz_mindlin__poisson=1.1 * 0.23)])),
    "restitution 0.05 % too low": ("hertz-restitution", "main", "analytic", dict(concordem=[ours(**{
        f"material__{k}__hertz_mindlin__restitution": 0.9995 * e for k, e in enumerate((0.2, 0.4, 0.6, 0.8, 1.0))})])),
    "restitution on a plane 0.05 % too low": ("hertz-oblique", "main", "analytic", dict(concordem=[ours(
        material__0__hertz_mindlin__restitution=0.9995 * 0.98, material__1__hertz_mindlin__restitution=0.9995 * 0.98)])),
    "strength of lattices 0.05 % too high": ("lattice-strength", "fcc", "analytic", dict(
        concordem=[ours(material__0__linear_bond__normal_strength="0.10005 N")])),
    "ductility 2 % too high": ("notched-beam", "notched", "yade", dict(concordem=[ours(material__0__cpm__relative_ductility=30.6)])),
    "shear ratio 0.1 % too high": ("triaxial-cell", "confined", "yade", dict(concordem=[ours(material__0__cpm__shear_ratio=0.2002)])),
    "stress with the other sign": ("cpm-uniaxial", "tension", "yade",
                                   {"result:concordem": [result("stress", np.negative)]}),
}

# Each takes 7 to 40 s, and another defect of the same case and peer is planted in every run: only with CONCORDEM_LONG=1.
LONG = {
    "lateral stress 2 % too high", "loads that do not strain their particles", "damping twice", "a beam without its notch",
    "sign of the particle's stress in its strain", "a strip narrower by 5 %", "ductility 2 % too high", "shear ratio 0.1 % too high",
}


# The same path takes another time, so one series ends before the other, which is a verdict without a difference.
ENDS_EARLY = {"time step twice as long"}


def is_measured(verdict):
    """Whether a check found a difference beyond its tolerance. A check that could not compare did not."""
    low, high = verdict.check.known or (0.0, verdict.check.tolerance)
    return math.isfinite(verdict.difference) and not low <= verdict.difference <= high


@pytest.mark.parametrize("defect", DEFECTS)
def test_planted_defect_is_caught(defect):
    name, variant, peer, plant = DEFECTS[defect]
    if defect in LONG and not os.environ.get("CONCORDEM_LONG"):
        pytest.skip("long: make test-full")
    need("concordem", peer, *(["operators"] if name == "operators" else []))
    sound = cases.load(name).only([variant], [peer])
    made = runner.Runner(FOLDER, quiet=True)
    round_ = made.run([sound])
    assert not round_.failed(True), f"the case fails without a defect: {[v for v in round_.verdicts if v.status == 'fail']}"
    planted = cases.load(name).only([variant], [peer])
    plant = dict(plant)
    if changes := plant.pop("module", []):
        for change in changes:
            change(planted.module)
        plant["analytic"] = changes  # changes the hash, so that no stored run is reused
    for task in planted.tasks:
        # a wrong run is compared with the peer, not with itself on two threads
        task.check_threads = task.check_threads and "concordem" not in plant
    round_ = made.run([planted], plant=plant)
    assert all(o.status == "done" for o in round_.outcomes.values()), [o.message for o in round_.outcomes.values()]
    failed = [v for v in round_.verdicts if v.status == "fail"]
    caught = [v for v in failed if is_measured(v) or (defect in ENDS_EARLY and "ends early" in v.message)]
    assert caught, f"{name} · {variant} · {peer} does not detect it" + "".join(f"; {v.check.name}: {v.message}" for v in failed)
    print(f"{defect}: caught by {name} · {variant} · {peer}: " + "; ".join(
        f"{v.check.name} {v.difference:.1e}" for v in caught))


def test_another_defect_is_planted_beside_each_long_one():
    for defect in LONG:
        name, _, peer, _ = DEFECTS[defect]
        assert any(DEFECTS[other][0] == name and DEFECTS[other][2] == peer for other in DEFECTS.keys() - LONG), defect


def test_a_planted_change_is_known_by_what_it_does():
    def by_name(step):
        scope = {"__name__": "planted"}
        exec(f"def helper(data): return data + {step}\ndef change(data): return helper(data)", scope)
        return scope["change"]

    one = plants.fingerprint(times("dt", 1.001))
    assert plants.fingerprint(times("dt", 1.001)) == one
    for another in (times("dt", 1.0001), times("mass", 1.001), without("dt")):
        assert plants.fingerprint(another) != one
    # what it is given, and what it calls
    assert plants.fingerprint(constants(lambda e, nu: (e, nu))) != plants.fingerprint(constants(lambda e, nu: (-e, nu)))
    assert plants.fingerprint(by_name(1)) == plants.fingerprint(by_name(1)) != plants.fingerprint(by_name(2))


def test_a_comparison_that_fails_has_caught_nothing():
    check = cases.Check("c", "series", "yade", "s", ["*"], "r", tolerance=1e-3)
    for difference, measured in ((1e-2, True), (math.nan, False), (math.inf, False), (1e-4, False)):
        assert is_measured(compare.Verdict("a", "b", check, "fail", difference)) is measured
    check = cases.Check("c", "series", "yade", "s", ["*"], "r", quirk="q", known=[1e-4, 1e-2])
    for difference, measured in ((0.0, True), (1e-3, False), (1.0, True), (math.nan, False)):
        assert is_measured(compare.Verdict("a", "b", check, "fail", difference)) is measured
