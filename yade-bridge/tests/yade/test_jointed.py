"""Jointed cohesive frictional spheres (JCFpmMat), taken over: stock YADE's numbers in pairs and packings, until and after they crack, and its counts and
records of cracks."""

import math
import os
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from jointed_scene import *
from harness import main, on_two_threads, raises

import concordem.yade as bridge
from concordem import YadeError

#: Of the largest force or displacement. Both programs round differently; a step of a pair has some ten roundings of 1e-16, and its history sums 400 of them.
PAIR = 1e-12
#: Of the largest displacement. Many bodies: sums in another order, which cracks amplify. Measured: 5e-13 after 400 steps, 1e-12 in a cell.
MANY = 1e-10
#: Of the largest force on an end, until the peak. Measured: 1e-12 in tension, 1.3e-11 in compression after 95 cracks, which amplify rounding.
PEAK = 1e-9


def law():
    return O.engines[2].lawDispatcher.functors[0]


def loads():
    return np.array([[*O.forces.f(b.id), *O.forces.t(b.id)] for b in O.bodies])


COUNTS = ("nbTensCracks", "nbShearCracks", "totalTensCracksE", "totalShearCracksE", "totalCracksSurface")


def counts():
    """What YADE's law and states have counted."""
    of_law = [getattr(law(), name) for name in COUNTS] + [law().cracksFileExist]
    return np.array(of_law, float), np.array([[b.state.nbInitBonds, b.state.nbBrokenBonds, b.state.damageIndex] for b in O.bodies if isinstance(b.shape, Sphere)])


def same_counts(wanted, found, tolerance=PAIR):
    # YADE adds to the counters of its law and of the particles without a lock: on two threads it now and then loses a crack of some forty,
    # or a bond or a crack of a particle; so before the take-over, as well.
    races = O.numThreads > 1
    for one, two in zip(wanted, found):
        lost = 0.1 * abs(one) if races and one is wanted[0] else 0
        apart = (two - one > lost + tolerance * abs(one)) | (one - two > tolerance * abs(one))
        if races and one is wanted[1]:
            rows = apart.any(axis=1)
            missed = (two - one)[rows, :2]
            assert rows.sum() <= 3 and (abs(missed).sum(axis=1) == 1).all(), (one[rows], two[rows])
        else:
            assert not apart.any(), (one[apart], two[apart])


def ride(steps, ours, motion=None, start=3, **scene):
    """Loads of a pair in every step, by prescribed velocities: `motion(step)` gives those of the second body."""
    pair(**scene)
    found, engine = [], None
    for step in range(steps):
        if ours and step == start:
            engine = bridge.take_over()
        state = O.bodies[1].state
        state.vel, state.angVel = (Vector3(*part) for part in motion(step))
        O.bodies[0].state.angVel = Vector3(0.3, -0.2, 0.1) * state.angVel.norm()
        O.step()
        found.append(loads())
    return np.array(found), counts(), engine


def compare(motion, steps=400, tolerance=PAIR, counted_too=True, **scene):
    wanted, counted, _ = ride(steps, False, motion, **scene)
    found, ours, engine = ride(steps, True, motion, **scene)
    for part in (slice(0, 3), slice(3, 6)):
        scale = abs(wanted[..., part]).max()
        difference = abs(found - wanted)[..., part].max()
        assert difference <= tolerance * scale or scale == 0, f"{difference:.1e} of {scale:.1e}"
    if counted_too:
        same_counts(counted, ours)
    return wanted, counted, engine


TENSION = lambda step: ((0.2, 0.13, 0.6) if step < 200 else (-0.2, -0.13, -0.6), (0, 0, 0))
SHEAR = lambda step: ((1.2 if step < 250 else -1.2, 0.1, -0.4), (0, 0, 0))
PRESSED = lambda step: ((-0.1 + (0.8 if step > 60 else 0), -0.05, -0.3 if step < 300 else 0.5), (3, 2, 0))
MIXED = lambda step: ((0.3, 0.1, 0.25 * math.cos(step / 60)), (9 * math.sin(step / 40), 5, -8))
MOTIONS = dict(tension=TENSION, shear=SHEAR, pressed=PRESSED, mixed=MIXED)
STRONG = dict(tensileStrength=1e12, cohesion=1e12)


@on_two_threads
def test_pairs_that_hold():
    for name, motion in MOTIONS.items():
        for scene in (dict(), dict(ratcheting=False), dict(distance=1.4, overlap=-0.2), dict(six=True)):
            wanted, _, engine = compare(motion, material=STRONG, unequal=True, **scene)
            assert engine.bond_count == 1 and abs(wanted).max() > 1, name


def test_pairs_that_crack():
    """In tension and in shear; the spheres slide, part, and touch again."""
    seen = np.zeros(2)
    for name, motion in MOTIONS.items():
        for scene in (dict(), dict(distance=1.4, overlap=-0.2), dict(law=dict(neverErase=True)), dict(law=dict(neverErase=True), distance=1.4, overlap=-0.2)):
            for material in (dict(), dict(tensileStrength=0), *([] if "distance" in scene else [dict(cohesion=0)])):
                _, counted, engine = compare(motion, material=material, unequal=True, **scene)
                # Without cohesion, some bonds crack before the take-over.
                assert engine.bond_count == 0 and engine.broken == 1 - ("cohesion" in material and engine.broken == 0), (name, scene, material)
                assert counted[0][:2].sum() == 1
                seen += counted[0][:2]
            # Without shear stiffness, YADE's energy of a crack is 0/0.
            compare(motion, material=dict(poisson=0), counted_too=False, **scene)
    assert seen.min() > 5, seen


def test_pairs_of_other_kinds():
    """Of two types, without bond, bonds of all new contacts."""
    for name, motion in MOTIONS.items():
        _, counted, engine = compare(motion, material=dict(cohesion=0, tensileStrength=0))
        assert engine.bond_count == 0 and counted[0][:2].sum() == 0
        for law in (dict(), dict(neverErase=True)):
            _, counted, engine = compare(motion, physics=dict(cohesiveTresholdIteration=-1), law=law, unequal=True)
        if name == "tension":
            # neverErase: the first contact goes on.
            assert counted[1][0, 0] == 1
    _, counted, _ = compare(TENSION, physics=dict(cohesiveTresholdIteration=-1))
    # The bond that the spheres got when they touched again cracked, too.
    assert counted[1][0, 0] > 2 and counted[0][0] > 1, counted


def test_strengths_of_single_contacts():
    """What a script has set in a contact, before and after the take-over, acts as in stock YADE."""

    def run(ours):
        pair(distance=1.4, overlap=-0.1)
        physics = O.interactions[0, 1].phys
        physics.FnMax, physics.initD, physics.tanFrictionAngle = 30.0, physics.initD - 1e-6, 0.9
        found, engine = [], bridge.take_over() if ours else None
        for step in range(300):
            if step == 40:
                for i in O.interactions:
                    i.phys.FsMax, i.phys.ks = 25.0, 0.5 * i.phys.ks
                    i.phys.crossSection *= 2
            O.bodies[1].state.vel, O.bodies[1].state.angVel = Vector3(0.3, 0, 0.1), Vector3(5, 0, 3)
            O.step()
            found.append(loads())
        return np.array(found), O.interactions.countReal(), counts()

    wanted, found = run(False), run(True)
    assert abs(wanted[0] - found[0]).max() < PAIR * abs(wanted[0]).max() and wanted[1] == found[1] == 0
    same_counts(wanted[2], found[2])
    assert wanted[2][0][:2].sum() == 1


def attributes(contact):
    """Of a contact."""
    geometry, physics = contact.geom, contact.phys
    rows = {"cellDist": contact.cellDist, "isReal": contact.isReal}
    rows.update((name, getattr(geometry, name)) for name in ("normal", "penetrationDepth", "contactPoint", "refR1", "refR2"))
    rows.update((name, value) for name, value in physics.dict().items() if name not in ("clusterInts", "nearbyInts", "originalEvent"))
    return {name: np.array([*value] if hasattr(value, "__len__") else value, float) for name, value in rows.items()}


def state_of_contacts():
    return {(i.id1, i.id2): attributes(i) for i in O.interactions if i.isReal}


def same_contacts(wanted, found, tolerance=1e-9):
    assert wanted.keys() == found.keys(), sorted(set(wanted) ^ set(found))[:5]
    names = next(iter(wanted.values()))
    for name in names:
        one, two = (np.array([row[name] for row in of.values()]) for of in (wanted, {pair: found[pair] for pair in wanted}))
        scale = max(abs(one).max(), 1e-30)
        assert abs(one - two).max() <= tolerance * scale, f"{name}: {abs(one - two).max():.1e} of {scale:.1e}"


def displacements():
    return np.array([[*(b.state.pos - b.state.refPos), *b.state.ori.toRotationVector()] for b in O.bodies])


def run(steps, ours=False, **scene):
    take = {name: scene.pop(name) for name in ("motion", "threads") if name in scene}
    lattice(**scene)
    engine = bridge.take_over(**take) if ours else None
    O.run(steps, True)
    return displacements(), state_of_contacts(), counts(), engine


def differ(wanted, found):
    return max(abs(wanted - found)[:, part].max() / abs(wanted[:, part]).max() for part in (slice(0, 3), slice(3, 6)))


#: Beyond the weaker strength the specimens crack in tension, and, pressed, in shear, where they slide on.
WEAK = dict(rate=-3.0, shift=0.3, distance=1.35, material=dict(cohesion=4e4))
SCENES = (dict(rate=1.0), WEAK, dict(WEAK, law=dict(neverErase=True)), dict(six=True, ratcheting=False))


@on_two_threads
def test_a_packing_that_cracks():
    for motion in (False, True):
        for scene in SCENES:
            wanted, contacts, counted, _ = run(400, **scene)
            found, ours, ours_counted, engine = run(400, True, motion=motion, **scene)
            assert differ(wanted, found) < MANY, differ(wanted, found)
            same_contacts(contacts, ours)
            same_counts(counted, ours_counted, 1e-9)
            assert engine.bond_count == sum(i.phys.isCohesive for i in O.interactions)
            assert counted[0][int("material" in scene)] > 20, counted[0]


def curve(ours, rate, steps=1500, every=10):
    """Force on the upper end and cracks in tension and shear, every few steps."""
    lattice(counts=(5, 5, 9), damping=0.4, **dict(WEAK if rate < 0 else {}, rate=rate))
    top = [b.id for b in O.bodies if b.state.blockedDOFs and b.state.pos[2] > 0.1]
    if ours:
        bridge.take_over()
    found = []
    for _ in range(steps // every):
        O.run(every, True)
        found.append([sum(O.forces.f(k)[2] for k in top), law().nbTensCracks, law().nbShearCracks])
    return np.array(found)


def test_specimens_to_the_peak():
    """225 spheres, pulled and pressed beyond the peak."""
    for rate in (0.3, -0.6):
        wanted, found = curve(False, rate), curve(True, rate)
        size = abs(wanted[:, 0])
        peak = int(size.argmax())
        error = abs(wanted[:, 0] - found[:, 0]) / size.max()
        assert 5 < peak < len(size) - 5 and size[-1] < 0.8 * size[peak]
        assert error[: peak + 1].max() < PEAK
        assert np.array_equal(wanted[: peak + 1, 1:], found[: peak + 1, 1:]) and wanted[-1, 1:].sum() > 50


def test_threads_give_the_same_bits():
    one, two = (run(200, True, threads=threads)[0] for threads in (1, 3))
    assert np.array_equal(one, two)


def test_a_periodic_cell():
    wanted, contacts, counted, _ = run(300, periodic=True)
    found, ours, ours_counted, engine = run(300, True, periodic=True)
    assert differ(wanted, found) < MANY, differ(wanted, found)
    same_contacts(contacts, ours)
    same_counts(counted, ours_counted, 1e-9)
    assert abs(np.array(utils.getStress()).T - engine.stress()).max() < 1e-9 * abs(engine.stress()).max()


def test_new_contacts_and_other_bodies():
    """Fragments and a box: contacts that begin later, between spheres and with what stays YADE's."""

    def fall(ours):
        weak = dict(tensileStrength=1e4, cohesion=1e4)
        lattice(counts=(3, 3, 3), rate=0.0, material=weak, before=lambda: setattr(O.engines[-1], "gravity", Vector3(2000, 0, -4000)))
        O.bodies.append(utils.box((0, 0, -1.2 * RADIUS), (1, 1, RADIUS), fixed=True, material=O.materials[0]))
        for b in O.bodies:
            if isinstance(b.shape, Sphere):
                b.state.blockedDOFs = ""
        if ours:
            bridge.take_over()
        O.run(900, True)
        return displacements(), sorted((i.id1, i.id2) for i in O.interactions if i.isReal), counts()

    wanted, found = fall(False), fall(True)
    # Impacts amplify rounding.
    assert differ(wanted[0], found[0]) < 1e-7, differ(wanted[0], found[0])
    assert wanted[1] == found[1]
    same_counts(wanted[2], found[2], 1e-7)
    assert wanted[2][0][:2].sum() > 20


def record(ours, name, motion=False, **scene):
    """Lines of the record of cracks, by step and bodies' place."""
    os.chdir(tempfile.mkdtemp())
    lattice(law=dict(recordCracks=True, Key=name), **scene)
    O.run(5, True)
    if ours:
        bridge.take_over(motion=motion)
    O.run(395, True)
    with open(f"cracks_{name}.txt") as file:
        header, *lines = file.read().splitlines()
    return header, np.array([[float(x) for x in line.split()] for line in lines]), lines


def test_records_of_cracks():
    """The file of YADE's law, line by line; cracks of one step are in another order."""
    for scene in (dict(), WEAK):
        wanted = record(False, "stock", **scene)
        for motion in (False, True):
            found = record(True, "ours", motion, **scene)
            assert wanted[0] == found[0] and len(wanted[1]) > 20
            one, two = (rows[np.lexsort((*rows[:, 2:5].round(6).T, rows[:, 0]))] for rows in (wanted[1], found[1]))
            assert np.array_equal(one[:, [0, 1, 5, 6, 11]], two[:, [0, 1, 5, 6, 11]])
            for part in (slice(2, 5), slice(7, 10), slice(10, 11)):
                assert abs(one[:, part] - two[:, part]).max() < 1e-9 * abs(one[:, part]).max()
    # As text, where nothing has been rounded differently: iteration, time, kind, size.
    fields = [{" ".join(line.split()[k] for k in (0, 1, 5, 6)) for line in lines} for lines in (wanted[2], found[2])]
    assert fields[0] == fields[1]


def test_a_record_goes_on():
    """With cracksFileExist, lines are added to the file; without, it begins anew."""
    for goes_on in (False, True):
        texts = []
        for ours in (False, True):
            os.chdir(tempfile.mkdtemp())
            with open("cracks_.txt", "w") as file:
                file.write("before\n")
            lattice(law=dict(recordCracks=True, cracksFileExist=goes_on))
            if ours:
                bridge.take_over()
            O.run(300, True)
            with open("cracks_.txt") as file:
                texts.append([line.split()[0] for line in file])
        assert texts[0] == texts[1] and (texts[0][0] == "before") == goes_on and len(texts[0]) > 10, texts


def test_save_and_load():
    lattice()
    engine = bridge.take_over()
    O.run(100, True)
    path = os.path.join(tempfile.mkdtemp(), "scene.yade.gz")
    O.save(path)
    O.saveTmp("kept")
    count = engine.bond_count
    O.run(150, True)
    wanted, contacts, counted = displacements(), state_of_contacts(), counts()
    for load in (lambda: O.load(path), lambda: O.loadTmp("kept")):
        load()
        assert bridge.engines()[0].bond_count == count
        O.run(150, True)
        assert np.array_equal(displacements(), wanted)
        same_contacts(contacts, state_of_contacts(), 0.0)
        same_counts(counted, counts(), 0.0)


def test_give_back():
    for scene in (dict(), dict(WEAK, law=dict(neverErase=True)), dict(physics=dict(cohesiveTresholdIteration=-1))):
        wanted, contacts, counted, _ = run(300, **scene)
        lattice(**scene)
        engine = bridge.take_over()
        O.run(150, True)
        before = state_of_contacts()
        with engine.interactions():
            same_contacts(before, {(i.id1, i.id2): attributes(i) for i in O.interactions}, 1e-15)
        assert engine.give_back()["written"] == len(before)
        same_contacts(before, state_of_contacts(), 1e-15)
        O.run(150, True)
        assert differ(wanted, displacements()) < MANY
        same_contacts(contacts, state_of_contacts())
        same_counts(counted, counts(), 1e-9)


def test_scripts():
    """Scripts erase contacts and bodies, ask functions of YADE, and let engines of YADE read contacts."""

    def script(ours):
        lattice(rate=1.0)
        engine = bridge.take_over() if ours else None
        O.run(50, True)
        for one, two in sorted((i.id1, i.id2) for i in O.interactions)[::9]:
            O.interactions.erase(one, two)
        for i in O.interactions:
            i.phys.FnMax *= 0.9
        O.engines = O.engines[:-1] + [GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.3, timeStepUpdateInterval=3)] + O.engines[-1:]
        O.run(100, True)
        asked = [utils.unbalancedForce(), O.interactions.countReal(), len(O.bodies[30].intrs()), O.dt, *(x for row in np.array(utils.getStress(1e-4)) for x in row)]
        O.bodies.erase(44)
        O.run(50, True)
        return np.array([[*(b.state.pos - b.state.refPos)] for b in O.bodies if b is not None]), np.array(asked), len(list(O.interactions)), law().nbTensCracks

    wanted, found = script(False), script(True)
    assert abs(wanted[0] - found[0]).max() < MANY * abs(wanted[0]).max()
    assert (abs(wanted[1] - found[1]) <= 1e-9 * abs(wanted[1]).clip(1e-12)).all(), (wanted[1], found[1])
    assert wanted[2:] == found[2:]


def test_refusals():
    def refused(text, change, **scene):
        lattice(counts=(2, 2, 2), **scene)
        change()
        with raises(YadeError, text):
            bridge.take_over()

    physics, geometry = (lambda: O.engines[2].physDispatcher.functors[0]), (lambda: O.engines[2].geomDispatcher.functors[0])
    refused("recordMoments", lambda: setattr(law(), "recordMoments", True))
    refused("useStrainEnergy", lambda: setattr(law(), "useStrainEnergy", False))
    refused("cohesiveTresholdIteration", lambda: setattr(physics(), "cohesiveTresholdIteration", 100))
    refused("xSectionWeibullShapeParameter", lambda: setattr(physics(), "xSectionWeibullShapeParameter", 3.0), physics=dict(cohesiveTresholdIteration=-1))
    refused("interactionDetectionFactor", lambda: setattr(geometry(), "interactionDetectionFactor", 1.2))
    refused("trackEnergy", lambda: setattr(O, "trackEnergy", True))
    O.trackEnergy = False
    refused("onJoint", lambda: setattr(O.bodies[3].state, "onJoint", True))
    refused("isOnJoint", lambda: setattr(next(iter(O.interactions)).phys, "isOnJoint", True))
    lattice(counts=(2, 2, 2))
    with raises(YadeError, "JCFpmMat follow YADE's law"):
        bridge.take_over(mode="thesis")
    for change, back in (
        (lambda: setattr(law(), "smoothJoint", True), lambda: setattr(law(), "smoothJoint", False)),
        (lambda: setattr(law(), "neverErase", True), lambda: setattr(law(), "neverErase", False)),
        (lambda: setattr(physics(), "cohesiveTresholdIteration", 50), lambda: setattr(physics(), "cohesiveTresholdIteration", 1)),
        (lambda: setattr(O.materials[0], "tensileStrength", 1.0), lambda: setattr(O.materials[0], "tensileStrength", MATERIAL["tensileStrength"])),
        (lambda: setattr(next(iter(O.interactions)).phys, "isOnJoint", True), lambda: setattr(next(iter(O.interactions)).phys, "isOnJoint", False)),
    ):
        lattice(counts=(2, 2, 2))
        bridge.take_over()
        O.run(5, True)
        change()
        with raises(YadeError, "take"):
            O.run(5, True)
        back()
        O.run(5, True)


def test_bodies_put_on_a_joint_later():
    lattice(counts=(2, 2, 2))
    engine = bridge.take_over()
    with raises(YadeError, "give_back"):
        O.bodies[1].state.onJoint = True
    assert not O.bodies[1].state.onJoint
    engine.give_back()
    O.bodies[1].state.onJoint = True
    with raises(YadeError, "onJoint"):
        bridge.take_over()


def test_the_doctor():
    for good in (True, False):
        lattice(counts=(2, 2, 3), rate=0.0)
        law().recordMoments = not good
        (finding,) = bridge.doctor(quiet=True, script="")
        try:
            bridge.take_over()
            assert good and finding.verdict == "followed" and "12 spheres of JCFpmMat with 20 contacts" in finding.why, finding
        except YadeError as error:
            assert not good and finding.verdict == "refused" and str(error) == finding.why


main(globals())
