"""The native plugin's linear bonds between deformable particles in stock YADE. Comments give the reasons of tolerances."""

import hashlib
import math
import os
import struct
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import numpy as np

from specimen import *
from harness import main, on_two_threads, raises
from own_run import DAMPING, TABLES, alone, in_yade, toml
from yade import utils
from yade.minieigenHP import Matrix3, Vector3

import concordem
import concordem.yade as bridge

WORK = os.environ.get("BRIDGE_WORK", "/tmp")
bridge.load_native()
RADIUS = 1e-3
LENGTH = 2 * RADIUS
STIFFNESS = 2e6
#: A particle between two contacts is 2 pi R E/3 = 1.26e7 N/m: the ratio that decides about the lag, 2 k_n/k_p, is 0.32.
YOUNG, POISSON = 6e9, 0.25


def run(count):
    for _ in range(count):
        O.step()


def engines(reach=1.05, damping=0.0, make_physics=None, **options):
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=reach), Bo1_Facet_Aabb()], verletDist=0.2e-3),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=reach), Ig2_Facet_Sphere_ScGeom()],
            [make_physics or Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust(cohesiveThresholdIter=1)],
            [Law2_ScGeom_LinearBondPhys_Rust(), Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        DeformableParticles_Rust(**options),
        NewtonIntegrator(damping=damping),
    ]


def law():
    return O.engines[2].lawDispatcher.functors[0]


def maker():
    return O.engines[2].physDispatcher.functors[0]


def without_late_contacts():
    """All bonds exist: new contacts start where spheres touch and exert no force, as in runs with contacts.law = "none"."""
    O.engines[2].geomDispatcher.functors[0].interactionDetectionFactor = 1.0
    O.engines[1].boundDispatcher.functors[0].aabbEnlargeFactor = 1.0
    maker().ks = maker().kn = MatchMaker(algo="val", val=0)


def material(**options):
    springs = dict(normalStiffness=STIFFNESS, shearStiffness=STIFFNESS / 5)
    defaults = dict(particleYoung=YOUNG, particlePoisson=POISSON, density=2500, frictionAngle=0.3, **springs)
    return LinearBondMat_Rust(**{**defaults, **options})


def spheres(places, m):
    O.reset()
    O.materials.append(m)
    for x in places:
        O.bodies.append(utils.sphere(x, RADIUS, material=m, color=(1, 1, 1)))


def row(count, **options):
    """Touching spheres along x with prescribed motion."""
    spheres([(LENGTH * k, 0, 0) for k in range(count)], material(**options))
    for b in O.bodies:
        b.state.blockedDOFs = "xyzXYZ"
    O.dt = 1e-9


def zigzag(count):
    """Positions of touching spheres in a zigzag, whose bonds slide and rotate under tension."""
    lean = 0.35
    aside, along = LENGTH * math.sin(lean), math.sqrt((LENGTH * math.cos(lean)) ** 2 - 1e-8)
    return [(aside * (k % 2), 1e-4 * k, along * k) for k in range(count)]


#: For spheres of 1 mm: a time step well below the bound of the stiffest vibration, 2 sqrt(m/4k).
MASS = 2500 * 4 / 3 * math.pi * RADIUS**3
STEP = 0.2 * math.sqrt(MASS / STIFFNESS)


def chain(count=12, **options):
    """A free zigzag whose ends fly apart, the faster the farther out: its force grows for some fifty steps."""
    spheres(zigzag(count), material(**options))
    O.dt = STEP
    for b in O.bodies:
        b.state.vel = Vector3(0.1 * math.sin(b.id), 0.05 * math.cos(b.id), 0.2 * (b.id - (count - 1) / 2))


def digest():
    found = hashlib.sha256()
    for b in O.bodies:
        if b is not None:
            s = b.state
            found.update(struct.pack("<13d", *s.pos, *s.vel, *s.angVel, *[s.ori[k] for k in range(4)]))
            if isinstance(s, DeformableState_Rust):
                found.update(struct.pack("<18d", *s.stress, *s.widening, *s.wideningBefore))
    return found.hexdigest()


def test_classes_are_yades():
    m, f, e = material(), Law2_ScGeom_LinearBondPhys_Rust(label="bonds"), DeformableParticles_Rust(label="strains")
    assert isinstance(m, FrictMat) and isinstance(LinearBondPhys_Rust(), FrictPhys) and isinstance(e, GlobalEngine)
    assert f.bases == ["ScGeom", "LinearBondPhys_Rust"] and f.broken == 0 and f.error == ""
    assert LinearBondMat_Rust().particleYoung == LinearBondMat_Rust().normalStrength == math.inf and e.condition == "solid"
    assert isinstance(m.newAssocState(), DeformableState_Rust)
    assert {"refLength", "direction", "shearDisplacement", "normalDashpot"} <= set(LinearBondPhys_Rust().dict())
    with raises(AttributeError):
        LinearBondMat_Rust(nonsense=1)


def stretched(condition, count, elongation):
    """A row with prescribed motion and the same elongation in all bonds; also returns 2 k_n/k_p, the ratio of the lag."""
    stiffness = {
        "solid": 2 * math.pi * RADIUS * YOUNG / 3,
        "plane-strain": math.pi * YOUNG / (2 * (1 - POISSON**2)),
        "plane-stress": math.pi * YOUNG / 2,
    }[condition]
    bond = 0.16 * stiffness
    row(count, normalStiffness=bond)
    engines(condition=condition)
    O.step()
    for b in O.bodies:
        b.state.pos += Vector3(elongation * b.id, 0, 0)
    return bond, 2 * bond / stiffness


def forces():
    return {(i.id1, i.id2): i.phys.force for i in O.interactions if i.isReal}


def test_stretched_row_and_every_step_on_the_way():
    """docs/book/theory/deformable-particles.md: 1/k = 1/k_n + 2/k_p with k_p of Madan 2019 (2.72), and the forces of successive steps of the lagged
    scheme f (1 - (-r)^k), r = 2 k_n/k_p. The elongation of 1e-6 m is the difference of places up to 1e-2 m, known to 2e-18 m."""
    for condition in ("solid", "plane-strain", "plane-stress"):
        bond, ratio = stretched(condition, 5, 1e-6)
        final = bond * 1e-6 / (1 + ratio)
        for k in range(1, 41):
            O.step()
            for f in forces().values():
                assert abs(f[0] / (final * (1 - (-ratio) ** k)) - 1) < 1e-11 and f[1] == f[2] == 0, (condition, k, f)
        assert ratio**40 < 1e-16
        for b in O.bodies:
            # Equal forces from both sides, of a neighbor or of the reaction.
            stress = b.state.stress
            area = math.pi * RADIUS / 2 if condition != "solid" else 2 / 3 * math.pi * RADIUS**2
            assert abs(stress[0] * area / final - 1) < 1e-11 and max(abs(stress[k]) for k in range(1, 6)) == 0, (condition, stress)
            across = b.state.widening[1] / b.state.widening[0]
            wanted = -POISSON / (1 - POISSON) if condition == "plane-strain" else -POISSON
            assert abs(across - wanted) < 1e-14 and (b.state.widening[2] == 0) == (condition != "solid"), (condition, across)


def test_a_free_row_at_rest():
    """The ends are pulled apart and held, and damping brings the rest to rest: all bonds have the force of springs in series."""
    row(10)
    for k in range(1, 9):
        O.bodies[k].state.blockedDOFs = ""
    O.dt = STEP
    engines(damping=0.3)
    O.step()
    O.bodies[9].state.pos += Vector3(9e-6, 0, 0)
    run(6000)
    particle = 2 * math.pi * RADIUS * YOUNG / 3
    wanted = 1e-6 / (1 / STIFFNESS + 2 / particle)
    found = [f[0] for f in forces().values()]
    print("row at rest: %.1e" % max(abs(f / wanted - 1) for f in found))
    # Tolerance: the remaining vibration; measured at most 1e-12.
    assert len(found) == 9 and max(abs(f / wanted - 1) for f in found) < 1e-9


TEXT = """
[[material]]
name = "ceramic"
density = 2500
linear_bond = { normal_stiffness = %r, shear_stiffness = %r, damping_ratio = 0.05, normal_strength = 3.0, shear_strength = 2.0 }
deformable = { young = %r, poisson = %r }
[bonds]
law = "linear_bond"
interaction_ratio = 1.05
[contacts]
law = "none"
[deformable]
condition = "solid"
dashpots = %s
"""


@on_two_threads
def test_the_bonded_engine_in_bits():
    """A chain in tension until it breaks. Sums over two bonds do not depend on the order, so law and pass are bitwise equal to the bonded
    engine."""
    for dashpots in (False, True):
        found, broken = [], []
        for functor in (True, False):
            chain(dampingRatio=0.05, normalStrength=3.0, shearStrength=2.0)
            engines(dashpots=dashpots)
            if not functor:
                text = TEXT % (STIFFNESS, STIFFNESS / 5, YOUNG, POISSON, str(dashpots).lower())
                bonds = BondedEngine_Rust(scenario=text)
                rest = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()]), InteractionLoop([], [], [])]
                O.engines = rest + [bonds, NewtonIntegrator(damping=0)]
                bonds.takeOver()
            steps = []
            for _ in range(3000):
                O.step()
                if functor and O.iter == 1:
                    without_late_contacts()
                steps.append(b"".join(struct.pack("<6d", *b.state.pos, *b.state.angVel) for b in O.bodies))
            found.append(steps)
            broken.append(law().broken if functor else bonds.broken)
        assert broken[0] == broken[1] >= 1, broken
        turned = max(b.state.rot().norm() for b in O.bodies)
        differing = [k for k, (one, two) in enumerate(zip(*found)) if one != two]
        assert turned > 0.01 and not differing, (turned, differing[:3])


def own(places, rate, **bond):
    """Our own run of spheres drawn apart along z."""
    scenario = concordem.Scenario(
        packing={"kind": "spheres", "spheres": [[*x, RADIUS] for x in places]},
        material={
            "name": "ceramic",
            "density": 2500,
            "linear_bond": {"normal_stiffness": STIFFNESS, "shear_stiffness": STIFFNESS / 5, **bond},
            "deformable": {"young": YOUNG, "poisson": POISSON},
        },
        bonds={"law": "linear_bond", "interaction_ratio": 1.05},
        contacts={"law": "none"},
        deformable={"condition": "solid"},
        loading={"kind": "uniaxial", "axis": "z", "strain_rate": rate, "layer_thickness": 1.5 * RADIUS},
        integration={"damping": {"kind": "local", "coefficient": DAMPING}, "safety": 0.2},
        stop={"steps": 10**9},
    )
    return scenario.simulation(threads=1)


def with_functor(simulation, m, reach):
    """The same particles with the Law2 functor and the pass, with the bonds of our solver's run."""
    bonds = simulation.state.bond_count
    in_yade(simulation)
    O.materials.append(m)
    for b in O.bodies:
        old = b.state
        b.material = m
        b.state = m.newAssocState()
        b.state.pos, b.state.vel, b.state.mass, b.state.inertia = old.pos, old.vel, old.mass, old.inertia
        b.state.blockedDOFs = old.blockedDOFs
    engines(reach=reach, damping=DAMPING)
    O.step()
    assert sum(type(i.phys).__name__ == "LinearBondPhys_Rust" for i in O.interactions if i.isReal) == bonds
    without_late_contacts()
    simulation.step(1)


def apart(simulation, start):
    """Largest difference of a coordinate between our run and the scene, and the longest way of a particle, m."""
    s = simulation.state
    ours = np.empty((len(s.ids), 3))
    ours[s.ids] = s.positions
    return abs(ours - np.array([list(b.state.pos) for b in O.bodies])).max(), abs(ours - start).max()


def test_a_row_follows_our_own_run():
    """Law, pass, and kinematics are the same code and sums of two have one order; YADE's integrator rounds otherwise (damping factors,
    1/m), and a coordinate of 3 cm is rounded in each of 2,001 steps, half a last digit at most: 7e-15 m if all were to one side.
    Bonds break on the way. Measured: 4.5e-16 m and, with the time step of a later version, 9.8e-16 m."""
    start = np.array(zigzag(16))
    simulation = own(start.tolist(), 60.0, damping_ratio=0.05, normal_strength=3.0, shear_strength=2.0)
    with_functor(simulation, material(dampingRatio=0.05, normalStrength=3.0, shearStrength=2.0), 1.05)
    for _ in range(20):
        run(100)
        simulation.step(100)
        assert simulation.state.bond_count == 15 - law().broken
    worst, way = apart(simulation, start)
    print("row: after 2001 steps and %d broken bonds %.1e m of %.1e m" % (law().broken, worst, way))
    assert law().broken >= 1 and worst < 2001 * 2**-53 * abs(start).max() and law().error == maker().error == ""


@on_two_threads
def test_a_specimen_that_breaks_follows_our_own_run():
    """1,160 spheres, 3,493 bonds, without contacts after breakage. YADE adds forces in another order (1e-16 of each), the pass adds virials
    by ids, and YADE's integrator rounds differently; a breaking specimen amplifies that, see tests/yade/test_engine.py."""
    TABLES["bonds alone"] = {**TABLES["deformable"], "contacts": {"law": "none"}}
    simulation = alone("bonds alone")
    table, particle = TABLES["deformable"]["material"]["linear_bond"], TABLES["deformable"]["material"]["deformable"]
    m = LinearBondMat_Rust(
        density=2500,
        normalStiffness=table["normal_stiffness"],
        shearStiffness=table["shear_stiffness"],
        dampingRatio=table["damping_ratio"],
        normalStrength=table["normal_strength"],
        shearStrength=table["shear_strength"],
        particleYoung=particle["young"],
        particlePoisson=particle["poisson"],
    )
    with_functor(simulation, m, 1.1)
    for _ in range(10):
        run(100)
        simulation.step(100)
        assert 3493 - law().broken == simulation.state.bond_count
    worst, way = apart(simulation, np.array(packing())[:, :3])
    print("specimen: after 1001 steps and %d broken bonds %.1e m of %.1e m" % (law().broken, worst, way))
    assert law().broken > 100 and worst < 5e-10 * way and law().error == maker().error == ""
    # Same comparison for the strains, including reactions at the ends.
    stress = np.array([list(b.state.stress) for b in O.bodies])
    assert (abs(stress).max(axis=1) > 0).mean() > 0.9


def test_stiff_particles_are_rigid_ones():
    """Particles of 1e30 Pa with the pass are bitwise equal to rigid ones without it."""
    found = set()
    for options in (dict(particleYoung=1e30), dict(particleYoung=math.inf)):
        chain(dampingRatio=0.05, normalStrength=3.0, shearStrength=2.0, **options)
        engines()
        if options["particleYoung"] == math.inf:
            O.engines = O.engines[:3] + O.engines[4:]
        O.step()
        without_late_contacts()
        run(2000)
        found.add(b"".join(struct.pack("<9d", *b.state.pos, *b.state.vel, *b.state.angVel) for b in O.bodies))
        assert law().broken >= 1 and law().error == ""
    assert len(found) == 1


@on_two_threads
def test_saved_and_loaded():
    """Save and load in the middle of a run, before a bond breaks; results are bitwise equal for any number of threads."""
    for name in ("deformable.yade.gz", "deformable.xml.bz2"):
        chain(dampingRatio=0.05, normalStrength=3.0, shearStrength=2.0)
        engines()
        O.step()
        without_late_contacts()
        run(20)
        path = os.path.join(WORK, name)
        O.save(path)
        early = law().broken
        run(2000)
        straight, broken = digest(), law().broken
        O.reset()
        O.load(path)
        assert law().broken == early < broken
        i = next(i for i in O.interactions if i.isReal)
        assert i.phys.shearStrength == 2.0 and i.phys.shearDisplacement.norm() > 0 and O.bodies[i.id1].state.stress.norm() > 0
        run(2000)
        assert digest() == straight and law().broken == broken, name
    # A run of this script with -j1 and one with -j2 leave the same hash: inside.sh compares them.
    print("BITS deformable chain: %s" % straight)


@on_two_threads
def test_the_pass_does_not_depend_on_threads():
    """Many bonds per particle, prescribed motion: strains are bitwise equal for one, two, and three threads of the pass, and any -j."""
    found = set()
    for threads in (1, 2, 3):
        O.reset()
        m = material()
        O.materials.append(m)
        for x, y, z, r in packing():
            O.bodies.append(utils.sphere((x, y, z), r, material=m, color=(1, 1, 1)))
        for b in O.bodies:
            b.state.blockedDOFs = "xyzXYZ"
            b.state.vel = Vector3(*(100 * b.state.pos))
        O.dt = 1e-8
        engines(reach=1.1, threads=threads)
        run(20)
        found.add(hashlib.sha256(b"".join(struct.pack("<6d", *b.state.widening) for b in O.bodies)).hexdigest())
    print("BITS strains of a held specimen: %s" % next(iter(found)))
    assert len(found) == 1, found
    bonded = {body for i in O.interactions if i.isReal for body in (i.id1, i.id2)}
    assert {b.id for b in O.bodies if b.state.widening.norm() > 0} == bonded and len(bonded) > 1000


def test_periodic_cell():
    """A bond across the border of a sheared cell has the same response as one inside the cell."""
    found = []
    for offset in (5e-3, 9.4e-3):
        O.reset()
        O.periodic = True
        O.cell.hSize = Matrix3(1e-2, 1e-3, 0, 0, 1e-2, 0, 0, 0, 1e-2)
        m = material()
        O.materials.append(m)
        second = offset + LENGTH
        image = 1 if second > 1e-2 else 0
        for x in (offset, second - image * 1e-2):
            O.bodies.append(utils.sphere((x, 1e-3, 1e-3), RADIUS, material=m, color=(1, 1, 1)))
            O.bodies[-1].state.blockedDOFs = "xyzXYZ"
        O.dt = 1e-8
        engines()
        O.step()
        (i,) = [i for i in O.interactions if i.isReal]
        assert abs(i.cellDist[0]) == image
        O.bodies[1].state.pos += Vector3(1e-6, 2e-6, 0)
        run(3)
        found.append(np.array([list(O.forces.f(k)) + list(O.forces.t(k)) + list(1e-6 * O.bodies[k].state.stress) for k in (0, 1)]))
    # Positions are known to 2e-18 m, and so are elongations of 1e-6 m.
    assert abs(found[0] - found[1]).max() < 1e-9 * abs(found[0]).max() and abs(found[0]).max() > 0.1


@on_two_threads
def test_the_ledger_closes():
    """A row is pulled until it breaks: the external work is in O.energy, including dashpots, lag, and the outer halves of the end particles.
    The displacement of a step, 4e-9 m, is a difference of positions known to 1e-18 m; errors have both signs."""
    row(3, dampingRatio=0.05, normalStrength=3.0)
    O.trackEnergy = True
    O.dt = 1e-7
    engines()
    O.step()
    for b in O.bodies:
        b.state.vel = Vector3(0.02 * b.id, 0, 0)
    work, before, largest = 0.0, None, 0.0
    while law().broken == 0:
        places = [b.state.pos for b in O.bodies]
        O.step()
        now = [O.forces.f(k) for k in range(3)]
        if before:
            work += sum(-0.5 * (f + g).dot(move) for f, g, move in zip(before, now, moves))
        before, moves = now, [b.state.pos - x for b, x in zip(O.bodies, places)]
        named = {name: value for name, value in O.energy.items() if name != "kinetic"}  # prescribed, and constant
        largest = max(largest, named["deformationElastic"])
        assert O.iter < 5000
    # The bonds are broken; the particles still have the strain of the last step.
    assert law().broken == 2
    for name in ("linearBondDamage", "linearBondViscous", "deformationElastic", "deformationReactions", "deformationLag"):
        assert named[name] != 0, (name, named)
    assert named["linearBondElastic"] == 0 and largest > 0.05 * work
    total = sum(named.values())
    print("ledger: %.6e J put in, %.1e J missing; %s" % (work, total - work, named))
    assert abs(total - work) < 1e-9 * work, (total, work, named)


def test_facets_and_late_contacts():
    """After bonding and with a facet, YADE's frictional contact acts; it strains no particle."""
    spheres([(0, 0, 0), (LENGTH, 0, 0), (0, 0, 2.5e-3)], material(young=1e7))
    O.bodies.append(utils.facet([(-1, -1, -1.01e-3), (1, -1, -1.01e-3), (0, 2, -1.01e-3)], material=O.materials[0], color=(1, 1, 1)))
    O.dt = 1e-6
    engines(reach=1.001, damping=0.3)
    O.engines[4].gravity = (0, 0, -10)
    kinds = set()
    for _ in range(2000):
        run(10)
        kinds |= {(type(O.bodies[i.id1].shape).__name__, type(i.phys).__name__) for i in O.interactions if i.isReal}
    assert {("Sphere", "LinearBondPhys_Rust"), ("Facet", "FrictPhys"), ("Sphere", "FrictPhys")} <= kinds, kinds
    assert O.bodies[2].state.stress.norm() == 0 and O.bodies[0].state.stress.norm() > 0
    assert maker().error == law().error == ""


def test_bodies_that_come_and_go():
    chain()
    engines()
    run(10)
    O.bodies.erase(4)
    run(10)
    for k in range(50):
        O.bodies.append(utils.sphere((1 + 0.01 * k, 0, 0), RADIUS, material=O.materials[0], color=(1, 1, 1)))
    O.interactions.erase(7, 8)
    run(10)
    assert sum(type(i.phys).__name__ == "LinearBondPhys_Rust" for i in O.interactions if i.isReal) == 8
    assert law().error == maker().error == ""


def stops(functor, text):
    """The run stops with an error, and so does the next one; the process continues."""
    for _ in range(2):
        at = O.iter
        O.run(1000, True)
        assert O.iter <= at + 2, "the run did not stop"
    assert text in functor().error, functor().error


@on_two_threads
def test_invalid_parameters_stop_the_run():
    # Invalid particle parameters also stop the engine.
    for options, text in (
        (dict(particleYoung=-1), "particleYoung = -1"),
        (dict(particleYoung=math.nan), "particleYoung = NaN"),
        (dict(particlePoisson=0.7), "particlePoisson = 0.7"),
    ):
        row(2, **options)
        engines()
        with raises(RuntimeError, text):
            O.step()
        assert text in maker().error
    for options, text in (
        (dict(normalStiffness=math.nan), "normal_stiffness"),
        (dict(shearStiffness=-1), "shear_stiffness"),
        (dict(dampingRatio=-1), "damping_ratio"),
        (dict(normalStrength=0), "normal_strength"),
    ):
        row(2, **options)
        engines()
        stops(maker, text)
    # No pass, a dead one, one before the forces, two.
    strains = DeformableParticles_Rust
    for change, text in (
        (lambda e: e[:3] + e[4:], "no active DeformableParticles_Rust"),
        (lambda e: e[:3] + [strains(dead=True)] + e[4:], "no active DeformableParticles_Rust"),
        (lambda e: e[:2] + [strains()] + e[2:3] + e[4:], "after InteractionLoop"),
        (lambda e: e[:3] + [strains(), strains()] + e[4:], "more than one"),
    ):
        row(2)
        engines()
        O.engines = change(O.engines)
        loop = next(e for e in O.engines if isinstance(e, InteractionLoop))
        if text == "no active DeformableParticles_Rust":
            stops(lambda: loop.physDispatcher.functors[0], text)
        else:
            with raises(RuntimeError, text):
                O.step()
    # Disabled later.
    row(2)
    engines()
    run(3)
    O.engines[3].dead = True
    stops(law, "DeformableParticles_Rust has not run")
    row(2)
    engines(condition="plane")
    with raises(RuntimeError, "plane-strain"):
        O.step()
    # Another material, another state.
    row(2)
    engines()
    run(2)
    O.bodies[1].state = State()
    with raises(RuntimeError, "newAssocState"):
        O.step()
    # An unbonded contact needs its own law, and a bond its functor.
    row(2)
    engines(make_physics=Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust(cohesiveThresholdIter=0))
    O.engines[2].lawDispatcher.functors = [law()]
    stops(maker, "CundallStrack")
    row(2)
    engines()
    O.engines[2].lawDispatcher.functors = [Law2_ScGeom_FrictPhys_CundallStrack()]
    stops(maker, "no Law2_ScGeom_LinearBondPhys_Rust")
    chain()
    engines()
    run(5)
    next(i for i in O.interactions if i.isReal).phys.kn = math.nan
    stops(law, "normal_stiffness")
    chain()
    engines()
    run(5)
    O.bodies[2].state.vel = Vector3(math.nan, 0, 0)
    stops(law, "not finite")
    O.reset()
    m = material()
    O.materials.append(m)
    O.bodies.appendClumped([utils.sphere((0, 0, 0), RADIUS, material=m), utils.sphere((LENGTH, 0, 0), RADIUS, material=m)])
    O.bodies.append(utils.sphere((0, LENGTH, 0), RADIUS, material=m))
    O.dt = 1e-9
    engines()
    stops(maker, "clump")


def memory():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1])


def test_nothing_leaks():
    O.reset()
    m = material()
    O.materials.append(m)
    for x, y, z, r in packing():
        O.bodies.append(utils.sphere((x, y, z), r, material=m, color=(1, 1, 1)))
    O.dt = 1e-8
    engines(reach=1.1)
    run(2)
    path = os.path.join(WORK, "leak.yade.gz")
    O.save(path)
    pages = []
    for cycle in range(40):
        O.load(path)
        run(1)
        O.reset()
        if cycle in (9, 39):
            pages.append(memory())
    # A leak of 3,493 bonds of 600 bytes per cycle would be 15,000 pages in 30 cycles.
    print("pages after 10 and after 40 cycles of load and reset:", pages)
    assert pages[1] - pages[0] < 1000


main(globals())
