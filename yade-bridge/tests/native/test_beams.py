"""The native plugin: cohesive beams by the generated law functor, here on ScGeom6D, in stock YADE. Tolerances are reasoned where they
stand."""

import hashlib
import math
import os
import struct
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import numpy as np

from specimen import *
from harness import main, on_two_threads, raises
from own_run import alone, difference, in_yade
from yade import utils
from yade.minieigenHP import Matrix3, Quaternion, Vector3

import concordem.yade as bridge

WORK = os.environ.get("BRIDGE_WORK", "/tmp")
bridge.load_native()
YOUNG, POISSON, SECTION = 60e9, 0.3, 0.5e-3
LENGTH = 2e-3


def run(count):
    for _ in range(count):
        O.step()


def engines(make_physics=None, law=None, reach=1.1, damping=0.0, gravity=(0, 0, 0)):
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=reach), Bo1_Facet_Aabb()], verletDist=0.5e-3),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom6D(interactionDetectionFactor=reach), Ig2_Facet_Sphere_ScGeom6D()],
            [make_physics or Ip2_CohesiveBeamMat_CohesiveBeamMat_CohesiveBeamPhys_Rust(cohesiveThresholdIter=1)],
            [law or Law2_ScGeom_CohesiveBeamPhys_Rust(), Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=damping, gravity=gravity),
    ]


def law():
    return O.engines[2].lawDispatcher.functors[0]


def maker():
    return O.engines[2].physDispatcher.functors[0]


def material(**options):
    given = dict(young=YOUNG, poisson=POISSON, cohesiveBeamPoisson=POISSON, radius=SECTION, density=2500, frictionAngle=0.3)
    return CohesiveBeamMat_Rust(**{**given, **options})


def row(count, m, free=False):
    """Touching spheres of 1 mm along x."""
    O.reset()
    O.materials.append(m)
    for k in range(count):
        O.bodies.append(utils.sphere((LENGTH * k, 0, 0), LENGTH / 2, material=m, color=(1, 1, 1)))
        if not free:
            O.bodies[k].state.blockedDOFs = "xyzXYZ"


def pair(**options):
    """Two spheres joined by a beam, held; turned and moved by hand."""
    row(2, material(**options))
    O.dt = 1e-9
    engines()
    O.step()
    (beam,) = list(O.interactions)
    return beam


def turn(body, axis, angle):
    O.bodies[body].state.ori = Quaternion(Vector3(*axis).normalized(), angle)


def loads():
    """Forces and torques on both bodies, after a step that moves nothing."""
    O.step()
    return np.array([list(O.forces.f(k)) + list(O.forces.t(k)) for k in (0, 1)])


def stiffness():
    area = math.pi * SECTION**2
    bending = YOUNG * math.pi * SECTION**4 / 4 / LENGTH
    return YOUNG * area / LENGTH, 12 * bending / LENGTH**2, bending, bending / (1 + POISSON)


def digest():
    found = hashlib.sha256()
    for b in O.bodies:
        if b is not None:
            s = b.state
            found.update(struct.pack("<13d", *s.pos, *s.vel, *s.angVel, *[s.ori[k] for k in range(4)]))
    return found.hexdigest()


def test_classes_are_yades():
    m, f = CohesiveBeamMat_Rust(radiusRatio=0.5, tensileStrength=1e6), Law2_ScGeom_CohesiveBeamPhys_Rust(label="beams")
    assert isinstance(m, FrictMat) and isinstance(CohesiveBeamPhys_Rust(), RotStiffFrictPhys)
    assert f.bases == ["ScGeom", "CohesiveBeamPhys_Rust"] and f.broken == 0 and f.error == ""
    assert math.isnan(CohesiveBeamMat_Rust().tensileStrength) and m.dict()["radiusRatio"] == 0.5
    assert {"historyRestDirection", "historyRestRotation", "moment", "crossSection"} <= set(CohesiveBeamPhys_Rust().dict())
    with raises(AttributeError):
        CohesiveBeamMat_Rust(nonsense=1)


def test_stiffnesses_and_simple_states():
    """Closed forms that hold for rotations of any size: tension, twist, circular bending. A few roundings of each."""
    beam = pair()
    k = stiffness()
    for name, wanted in zip(("kn", "ks", "kr", "ktw"), k):
        assert abs(getattr(beam.phys, name) / wanted - 1) < 1e-15 * 8, name
    assert beam.phys.refLength == LENGTH
    O.bodies[1].state.pos = Vector3(LENGTH + 1e-6, 0, 0)
    f = loads()
    # The elongation itself is known to 1e-19 m of 1e-6 m.
    assert abs(f[0, 0] / (k[0] * 1e-6) - 1) < 1e-12 and f[1, 0] == -f[0, 0] and abs(f[:, 1:]).max() == 0
    assert abs(beam.phys.normalForce[0] + f[0, 0]) <= 1e-15 * f[0, 0], "as sustained by the second body"
    O.bodies[1].state.pos = Vector3(LENGTH, 0, 0)
    for angle in (1e-6, 0.3, 2.5):
        turn(1, (1, 0, 0), angle)
        f = loads()
        assert abs(f[0, 3] / (k[3] * angle) - 1) < 1e-9 and f[1, 3] == -f[0, 3], angle
        assert abs(np.delete(f, 3, axis=1)).max() <= 1e-12 * k[3] * angle
    for angle in (1e-3, 0.2, 1.0):
        turn(0, (0, 0, 1), -angle)
        turn(1, (0, 0, 1), angle)
        f = loads()
        assert abs(f[0, 5] / (2 * k[2] * angle) - 1) < 1e-12 and abs(f[1, 5] + f[0, 5]) <= 1e-15 * f[0, 5], angle
        assert abs(beam.phys.moment[2] / f[0, 5] - 1) < 1e-14


def test_both_ends_balance_at_any_rotation():
    """No net force, no net moment about any point: rounding of arms of 2 mm and forces of up to 1e5 N."""
    pair()
    O.bodies[1].state.pos = Vector3(LENGTH * 1.01, 3e-4, -2e-4)
    turn(0, (0.3, -0.5, 0.8), 0.4)
    turn(1, (-0.6, 0.1, 0.7), 0.9)
    f = loads()
    x = np.array([list(O.bodies[k].state.pos) for k in (0, 1)])
    moment = f[:, 3:].sum(axis=0) + np.cross(x, f[:, :3]).sum(axis=0)
    assert abs(f[:, :3].sum(axis=0)).max() == 0 and abs(f).max() > 1e3
    assert abs(moment).max() < 1e-14 * abs(f[:, :3]).max() * LENGTH * 10


def cohesive_frictional(size, steps):
    """YADE's law with the stiffnesses of our beam about the middle of the chord; and ours: loads after the same motion."""
    found = []
    for ours in (False, True):
        if ours:
            m = material()
        else:
            m = CohFrictMat(young=1e9, poisson=0.3, momentRotationLaw=True, normalCohesion=1e20, shearCohesion=1e20, alphaKr=1, alphaKtw=1)
        row(2, m)
        O.dt = 1e-6
        if ours:
            engines()
        else:
            theirs = Law2_ScGeom6D_CohFrictPhys_CohesionMoment(always_use_moment_law=True, useIncrementalForm=False)
            engines(Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(setCohesionNow=True, setCohesionOnNewContacts=True), theirs)
        O.step()
        (i,) = list(O.interactions)
        if not ours:
            i.phys.kn, i.phys.ks, i.phys.kr, i.phys.ktw = stiffness()
            i.phys.normalAdhesion = i.phys.shearAdhesion = i.phys.rollingAdhesion = i.phys.twistingAdhesion = 1e20
        rate = size / (steps * O.dt)
        O.bodies[0].state.angVel = Vector3(0.3, -0.8, 0.5) * rate
        O.bodies[1].state.angVel = Vector3(-0.6, 0.4, 0.9) * rate
        O.bodies[1].state.vel = Vector3(0.2, 0.4, -0.5) * rate * LENGTH
        run(steps)
        # YADE's shear is a sum over steps: one for each move.
        for b in O.bodies:
            b.state.vel = b.state.angVel = Vector3(0, 0, 0)
        found.append(loads())
    return found


def test_yades_cohesive_frictional_law_where_both_must_agree():
    """Equal spheres, small rotations: YADE's moments act at the contact point, which is the middle of the chord, and its shear is
    the sum of small steps. What differs is of second order in the rotation: a tenth of it, a tenth of the relative difference."""
    relative = []
    for size in (1e-3, 1e-4, 1e-5):
        theirs, ours = cohesive_frictional(size, 50)
        scale = abs(ours).max(axis=0)
        relative.append((abs(ours - theirs) / scale).max())
        assert (scale > 0).all(), "every component acts"
    print("against Law2_ScGeom6D_CohFrictPhys_CohesionMoment: relative %s at rotations of 1e-3, 1e-4, 1e-5" % relative)
    assert relative[0] < 5e-3 and relative[1] < 0.11 * relative[0] and relative[2] < 0.11 * relative[1]


def whip(**options):
    """Ten spheres on a string of beams: two act on a sphere, and sums of two have one order."""
    row(10, material(**options), free=True)
    O.trackEnergy = True
    O.dt = 5e-8
    engines()
    for b in O.bodies:
        turn(b.id, (0.2, 0.5, -0.4), 0.1 * b.id)  # rotations before bonding cause no strain
        b.state.vel = Vector3(0, 0.1 * b.id**2, -0.5 * b.id)
        b.state.angVel = Vector3(50.0 * b.id, 0, 300)


def scenario_of_beams(strength):
    """The beams of `material` as a scenario, unbreakable with `strength` None."""
    keys = "young = %r, poisson = %r, radius = %r" % (YOUNG, POISSON, SECTION)
    if strength is not None:
        keys += ", tensile_strength = %r" % strength
    return """
    [[material]]
    name = "rod"
    density = 2500
    cohesive_beam = { %s }
    [bonds]
    law = "cohesive_beam"
    interaction_ratio = 1.05
    [contacts]
    law = "none"
    """ % keys


@on_two_threads
def test_the_solver_itself_in_bits():
    """The functor and the bonded engine, which is our solver, find the same bits, also while beams break."""
    for strength in (None, 1e7):
        whip(**({} if strength is None else {"tensileStrength": strength}))
        # No contacts after breakage, as in the scenario.
        maker().kn = maker().ks = MatchMaker(algo="val", val=0)
        run(3000)
        by_functor, broken, energies = digest(), law().broken, dict(O.energy.items())
        assert maker().error == law().error == ""
        turned = max(b.state.rot().norm() for b in O.bodies)
        assert turned > 0.05, turned
        whip()
        O.engines = O.engines[:3] + [BondedEngine_Rust(scenario=scenario_of_beams(strength))] + O.engines[3:]
        O.engines[3].takeOver()
        run(3000)
        assert digest() == by_functor and O.engines[3].broken == broken, (O.engines[3].broken, broken)
        assert (broken > 0) == (strength is not None), broken
        # Of a beam that breaks, the solver takes the work that was not done in the last step off the damage; the functor books it apart.
        for names in (("Elastic",), ("Damage", "Integration")):
            # Both add nine terms in any order: rounding, over 3,000 steps.
            ours, theirs = sum(energies["cohesiveBeam" + name] for name in names), sum(O.energy["bond" + name] for name in names)
            assert abs(ours - theirs) <= 1e-12 * abs(theirs), (names, ours, theirs)


def radius_of_beams(simulation):
    """Radius of the beams of `own_run`: half the mean radius of the spheres with bonds. The functor's own radiusRatio counts all spheres."""
    x, r = simulation.state.positions, simulation.state.radii
    distance = np.sqrt(((x[:, None] - x[None]) ** 2).sum(axis=2))
    near = distance <= 1.1 * (r[:, None] + r[None])
    bonded = r[near.sum(axis=1) > 1]
    # One after the other, as our solver adds them.
    return 0.5 * (sum(bonded.tolist()) / len(bonded))


def as_own_run(functor_steps, **options):
    """The specimen of `own_run` with the functor."""
    simulation = alone("beams")
    in_yade(simulation)
    m = material(radius=radius_of_beams(simulation), tensileStrength=60e6, **options)
    O.materials.append(m)
    for b in O.bodies:
        b.material = m
    old = O.engines
    engines(damping=old[3].damping)
    run(functor_steps)
    return simulation


@on_two_threads
def test_a_specimen_that_breaks_follows_our_own_run():
    """1,160 spheres, 3,493 beams. YADE adds forces in another order (1e-16 of each), and its integrator rounds otherwise; a
    breaking specimen enlarges that, see tests/yade/test_engine.py."""
    simulation = as_own_run(1)
    O.engines[2].geomDispatcher.functors[0].interactionDetectionFactor = 1.0
    O.engines[1].boundDispatcher.functors[0].aabbEnlargeFactor = 1.0
    # Contacts after breakage are left out, as in our run.
    O.engines[2].lawDispatcher.functors = O.engines[2].lawDispatcher.functors[:1] + [Law2_ScGeom_FrictPhys_CundallStrack()]
    maker().ks = maker().kn = MatchMaker(algo="val", val=0)
    simulation.step(1)
    assert sum(i.isReal for i in O.interactions) == 3493
    for _ in range(6):
        run(100)
        simulation.step(100)
        assert 3493 - law().broken == simulation.state.bond_count
    worst, way = difference(simulation)
    print("functor: after 601 steps and %d broken beams %.1e m of %.1e m" % (law().broken, worst, way))
    assert law().broken > 100 and worst < 5e-10 * way and law().error == maker().error == ""


def histories():
    found = {}
    for i in O.interactions:
        p = i.phys
        found[i.id1, i.id2] = (tuple(p.historyRestDirection), tuple(p.historyRestRotation), p.refLength, tuple(p.moment))
    return found


def test_saved_and_loaded():
    """A swinging rod: history and response are restored. With two beams per sphere, YADE's order of contacts has no effect."""
    for name in ("beams.yade.gz", "beams.xml.bz2"):
        row(8, material(tensileStrength=5e9), free=True)
        O.bodies[0].state.blockedDOFs = "xyzXYZ"
        for b in O.bodies:
            turn(b.id, (0.2, 0.5, -0.4), 0.1 * b.id)  # rotations before bonding cause no strain
        O.dt = 5e-8
        engines(gravity=(0, 0, -1e5))
        run(1000)
        path = os.path.join(WORK, name)
        O.save(path)
        history = histories()
        run(1000)
        straight = digest()
        O.reset()
        O.load(path)
        assert histories() == history and all(max(map(abs, rotation)) > 0.01 for _, rotation, _, _ in history.values())
        assert O.materials[0].tensileStrength == 5e9
        run(1000)
        assert digest() == straight, name
        # A loaded beam keeps its strength. An unbreakable beam has none, which is not a number; XML must store that as well.
        for strength in (5e9, math.nan):
            pair(tensileStrength=strength)
            O.save(path)
            O.load(path)
            found = O.materials[0].tensileStrength
            assert found == strength or math.isnan(found) and math.isnan(strength)
            O.bodies[1].state.pos = Vector3(LENGTH * (1 + 2 * 5e9 / YOUNG), 0, 0)
            O.step()
            assert law().broken == (strength == 5e9) and law().error == ""


def test_breaking_and_the_contact_after_it():
    """A beam breaks at the strength of the material; pressed together again, the spheres have YADE's frictional contact."""
    pair(tensileStrength=30e6)
    O.trackEnergy = True
    O.dt = 1e-7
    O.bodies[1].state.vel = Vector3(0.01, 0, 0)
    work, force = 0.0, 0.0
    while law().broken == 0:
        before = O.bodies[1].state.pos
        O.step()
        now = O.forces.f(1)
        if O.iter > 2:
            work += -0.5 * (force + now).dot(moved)
        force, moved = now, O.bodies[1].state.pos - before
        assert O.iter < 5000
    named = dict(O.energy.items())
    # One step adds v dt k/A = 3e4 Pa.
    elongation = 30e6 / YOUNG * LENGTH
    assert named["cohesiveBeamElastic"] == 0 and abs(named["cohesiveBeamDamage"] / (0.5 * stiffness()[0] * elongation**2) - 1) < 3e-3
    # Energy balance: external work until the last step with a force, plus half of the step in which the beam broke. The displacement of
    # a step, 1e-9 m, is a difference of positions known to 4e-19 m.
    total = named["cohesiveBeamDamage"] + named["cohesiveBeamIntegration"]
    assert abs(total - work) < 1e-9 * work, (total, work)
    O.bodies[1].state.vel = Vector3(-0.05, 0, 0)
    run(1500)
    (contact,) = [i for i in O.interactions if i.isReal]
    assert type(contact.phys).__name__ == "FrictPhys" and contact.geom.penetrationDepth > 0 and O.forces.f(1)[0] > 0
    assert law().broken == 1


def test_facets_and_other_materials():
    """Contacts with a facet or with a sphere of another material are YADE's frictional contacts."""
    row(3, material(young=1e7), free=True)
    O.bodies.append(utils.facet([(-1, -1, -1.1e-3), (1, -1, -1.1e-3), (0, 2, -1.1e-3)], material=O.materials[0], color=(1, 1, 1)))
    other = O.materials.append(FrictMat(young=1e7, frictionAngle=0.3, density=2500))
    O.bodies.append(utils.sphere((0, 0, 2.1e-3), 1e-3, material=O.materials[other], color=(1, 1, 1)))
    O.dt = 1e-6
    engines(reach=1.0001, damping=0.3, gravity=(0, 0, -10))
    O.engines[2].physDispatcher.functors = [maker(), Ip2_FrictMat_FrictMat_FrictPhys()]
    run(20000)
    kinds = {(type(O.bodies[i.id1].shape).__name__, type(i.phys).__name__) for i in O.interactions if i.isReal}
    assert {("Sphere", "CohesiveBeamPhys_Rust"), ("Facet", "FrictPhys"), ("Sphere", "FrictPhys")} <= kinds, kinds
    assert maker().error == law().error == ""


def test_periodic_cell():
    """A beam across the border of a sheared cell has the same response as one inside the cell."""
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
            O.bodies.append(utils.sphere((x, 1e-3, 1e-3), LENGTH / 2, material=m, color=(1, 1, 1)))
            O.bodies[-1].state.blockedDOFs = "xyzXYZ"
        O.dt = 1e-8
        engines(reach=1.05)
        O.step()
        (i,) = [i for i in O.interactions if i.isReal]
        assert abs(i.cellDist[0]) == image
        turn(0, (0, 0, 1), 0.1)
        turn(1, (0, 1, 0), 0.2)
        O.bodies[1].state.pos += Vector3(1e-6, 2e-6, 0)
        found.append(loads())
    # Positions are known to 2e-18 m, and so are branch vectors of 2 mm and the elongations that give the forces.
    assert abs(found[0] - found[1]).max() < 1e-9 * abs(found[0]).max()


def test_yades_operators_and_time_step_see_beams():
    row(5, material(), free=True)
    O.dt = 1e-8
    engines()
    O.engines = O.engines + [GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.5, timeStepUpdateInterval=1)]
    O.bodies[4].state.vel = Vector3(1.0, 0, 0)
    run(30)
    # The stiffest beam determines the time step, which is of the order of sqrt(m/k).
    natural = math.sqrt(O.bodies[0].state.mass / stiffness()[0])
    assert 0.1 * natural < O.dt < natural, (O.dt, natural)
    axial = sum(-i.phys.normalForce.dot(i.geom.normal) * LENGTH for i in O.interactions)
    assert axial > 0 and abs(utils.getStress(1.0)[0, 0] / axial - 1) < 1e-2


def test_energy_is_conserved_in_large_rotations():
    """A free rod that bends and twists by radians conserves energy. YADE's velocities are half a step late, so the sum of kinetic and
    elastic energy oscillates with an amplitude of first order in the step: half the step, half the amplitude."""
    drift = []
    for scale in (1, 2):
        row(4, material(), free=True)
        O.trackEnergy = True
        O.dt = 2e-8 / scale
        engines()
        O.bodies[3].state.vel = Vector3(0, 60.0, 0)
        O.bodies[0].state.angVel = Vector3(3e4, 0, 0)
        found, largest = [], 0
        for _ in range(200):
            run(5 * scale)
            named = dict(O.energy.items())
            found.append(named["cohesiveBeamElastic"] + utils.kineticEnergy())
            largest = max(largest, named["cohesiveBeamElastic"])
        assert largest > 0.2 * found[0]
        drift.append(abs(np.mean(found[150:]) / np.mean(found[10:60]) - 1))
    print("energy of a free rod: drift %s" % drift)
    assert drift[0] < 3e-4 and drift[1] < 0.6 * drift[0]


def test_bodies_that_come_and_go():
    row(10, material(), free=True)
    O.dt = 5e-8
    engines()
    run(10)
    O.bodies.erase(4)
    run(10)
    for k in range(200):
        O.bodies.append(utils.sphere((1 + 0.01 * k, 0, 0), 1e-3, material=O.materials[0], color=(1, 1, 1)))
    O.interactions.erase(7, 8)
    run(10)
    assert sum(type(i.phys).__name__ == "CohesiveBeamPhys_Rust" for i in O.interactions if i.isReal) == 6
    assert law().error == maker().error == ""


@on_two_threads
def test_what_makes_no_sense_stops_the_run():
    def stops(functor, text, count=1000):
        # A run that is restarted without a correction stops again.
        for _ in range(2):
            at = O.iter
            O.run(count, True)
            assert O.iter <= at + 2, "stopped, and the process lives"
        assert text in functor().error, functor().error

    for options, text in (
        (dict(radius=math.nan), "the radius of the beam is missing"),
        (dict(radius=0), "radius = 0 must be positive"),
        (dict(radiusRatio=0.5), "the radius of the beam is given twice"),
        (dict(model="nonsense"), "timoshenko"),
        (dict(bendingTerm="nonsense"), "half-sum"),
        (dict(young=-1), "young = -1"),
        (dict(young=math.nan), "young"),
        (dict(tensileStrength=-1), "tensile_strength"),
        (dict(model="timoshenko", shearCoefficient=-1), "shear_coefficient"),
    ):
        row(2, material(**options))
        O.dt = 1e-9
        engines()
        stops(maker, text)
    row(2, material())
    O.materials.append(material(model="spring"))
    O.bodies[1].material = O.materials[1]
    O.dt = 1e-9
    engines()
    stops(maker, "different `model`")
    # A contact that is not a beam needs its own law.
    row(2, material())
    O.dt = 1e-9
    engines(Ip2_CohesiveBeamMat_CohesiveBeamMat_CohesiveBeamPhys_Rust(cohesiveThresholdIter=0))
    O.engines[2].lawDispatcher.functors = [law()]
    stops(maker, "CundallStrack")
    # Without the Law2 functor of beams.
    row(2, material())
    O.dt = 1e-9
    engines()
    O.engines[2].lawDispatcher.functors = [Law2_ScGeom_FrictPhys_CundallStrack()]
    stops(maker, "no Law2_ScGeom_CohesiveBeamPhys_Rust")
    row(5, material(), free=True)
    O.dt = 5e-8
    engines()
    run(5)
    O.bodies[2].state.vel = Vector3(math.nan, 0, 0)
    stops(law, "the force is not a number")


def memory():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1])


def test_nothing_leaks():
    as_own_run(2)
    path = os.path.join(WORK, "leak.yade.gz")
    O.save(path)
    pages = []
    for cycle in range(40):
        O.load(path)
        run(1)
        O.reset()
        if cycle in (9, 39):
            pages.append(memory())
    # A leak of 3,493 beams of 500 bytes per cycle would be 12,000 pages in 30 cycles.
    print("pages after 10 and after 40 cycles of load and reset:", pages)
    assert pages[1] - pages[0] < 1000


main(globals())
