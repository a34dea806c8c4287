"""What scripts do beside the bonds while a bonded engine has them, against stock YADE: engines that read interactions, bodies that come and go,
parameters of single contacts, materials without strength."""
# threads: 1

import builtins
import glob
import math
import os
import random
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, raises
from yade import utils

import concordem.yade as bridge
from concordem import YadeError
from concordem.yade import _lending

VOLUME = 1e-6


def lattice(size=(5, 5, 9)):
    chance = random.Random(1)
    return [[*(2e-3 * n + chance.uniform(-1e-4, 1e-4) for n in place), 1e-3] for place in np.ndindex(*size)]


def block(rate=4.0, steps=150, **options):
    concrete(**{"rate": rate, "spheres": lattice(), **options})
    O.run(steps, True)


def behind_loop(*engines):
    """Put engines behind InteractionLoop, where users put them."""
    O.engines = O.engines[:3] + list(engines) + O.engines[3:]


def array(matrix):
    return np.array([[matrix[i, j] for j in range(3)] for i in range(3)])


def close(one, two, tolerance=1e-9):
    one, two = np.asarray(one, float), np.asarray(two, float)
    assert one.shape == two.shape, (one.shape, two.shape)
    assert (np.isnan(one) == np.isnan(two)).all()
    scale = np.nanmax(np.abs(one), initial=0)
    worst = np.nanmax(np.abs(one - two), initial=0) / (scale or 1)
    assert worst < tolerance, worst


def moved(x):
    """Displacements, so that a difference is compared with them and not with the size of the specimen."""
    return x - np.array([tuple(b.state.refPos) for b in O.bodies if b is not None])


def both(run):
    """What `run(take)` returns in stock YADE, where `take` does nothing, and with the bonded engine."""
    return run(lambda **options: None), run(bridge.take_over)


# -- engines that read interactions ------------------------------------------------------------------------------------


def test_the_time_step_is_that_of_yade():
    """GlobalStiffnessTimeStepper finds the stiffnesses of the bonds, in every step and in every tenth."""
    for interval in (1, 10):

        def run(take, interval=interval):
            block()
            behind_loop(GlobalStiffnessTimeStepper(timeStepUpdateInterval=interval, timestepSafetyCoefficient=0.4, label="stepper"))
            O.run(3, True)
            take()
            steps = []
            for _ in range(10):
                O.run(7, True)
                steps.append(O.dt)
            assert 0 < O.dt < 1e-6
            return steps, moved(positions())

        stock, ours = both(run)
        close(stock[0], ours[0])
        close(stock[1], ours[1])
        assert len(set(stock[0])) > 1, "the stiffnesses change"


def test_the_time_step_after_a_block():
    """`with engine.interactions():` exchanges the collider; the stepper finds the bonds again behind it."""

    def run(take):
        block()
        behind_loop(GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.4))
        O.run(3, True)
        take()
        O.run(3, True)
        for engine in bridge.engines():
            with engine.interactions():
                assert O.interactions.countReal() > 100
        # Softer bonds, a longer step.
        for i in O.interactions:
            i.phys.E, i.phys.G, i.phys.kn, i.phys.ks = 0.5 * i.phys.E, 0.5 * i.phys.G, 0.5 * i.phys.kn, 0.5 * i.phys.ks
        O.interactions.erase(60, 61)
        O.run(5, True)
        for i in sorted(O.interactions, key=lambda i: (i.id1, i.id2))[::2]:
            O.interactions.erase(i.id1, i.id2)
        O.run(20, True)
        return [O.dt], moved(positions())

    stock, ours = both(run)
    close(stock[0], ours[0])
    close(stock[1], ours[1], 1e-7)


def test_the_numbers_of_engines_stay():
    """What the bonded engine adds is not seen by a script, and ends with it."""
    block()
    behind_loop(GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.4), CpmStateUpdater(iterPeriod=5))
    before = [type(e).__name__ for e in O.engines]
    e = bridge.take_over()
    assert [type(e).__name__ for e in O.engines] == before
    assert len(_lending.raw_engines()) == len(O.engines) + 5
    O.run(10, True)
    O.engines = O.engines[:4] + [PyRunner(command="pass", iterPeriod=1)] + O.engines[4:]
    assert len(_lending.raw_engines()) == len(O.engines) + 5
    O.run(10, True)
    e.give_back()
    assert len(_lending.raw_engines()) == len(O.engines) == len(before) + 1
    O.run(5, True)
    # Of bond(), whose law YADE does not have, nothing is lent.
    concrete(spheres=[(0, 0, k * 2e-3, 1e-3) for k in range(6)], rate=0.0)
    O.interactions.clear()
    behind_loop(GlobalStiffnessTimeStepper())
    with raises(YadeError, "GlobalStiffnessTimeStepper"):
        bridge.bond(
            material={"name": "rod", "density": 2000, "cohesive_beam": {"young": 2e9, "poisson": 0.3, "radius_ratio": 0.5}},
            bonds={"law": "cohesive_beam", "interaction_ratio": 1.05},
        )


def states():
    return [(b.state.normDmg, b.state.numBrokenCohesive, *array(b.state.stress).reshape(-1)) for b in O.bodies]


def test_states_and_files_are_those_of_yade():
    """CpmStateUpdater and VTKRecorder now and then, with and without `motion`, in one run and with O.step()."""

    def run(take, motion=False, single=False):
        folder = tempfile.mkdtemp()
        block(rate=12.0, law=dict(omegaThreshold=0.95))
        recorder = VTKRecorder(iterPeriod=25, fileName=folder + "/v-", recorders=["spheres", "intr", "cpm"], ascii=True, multiblock=True)
        O.engines = O.engines + [CpmStateUpdater(iterPeriod=10), recorder]
        take(**(dict(motion=True) if motion else {}))
        if single:
            for _ in range(75):
                O.step()
        else:
            O.run(75, True)
        files = sorted(glob.glob(folder + "/v-*/*.vt[pu]"))
        assert len(files) >= 4 and min(map(os.path.getsize, files)) > 10_000, files
        sizes = [len(open(file).read().split()) for file in files]
        return np.array(states()), sizes, O.interactions.countReal()

    stock = run(lambda **options: None)
    assert stock[0][:, 0].max() > 0.1 and stock[0][:, 1].sum() > 10
    for options in ({}, dict(motion=True), dict(single=True)):
        ours = run(bridge.take_over, **options)
        close(stock[0], ours[0], 1e-8)
        assert stock[1:] == ours[1:], options


def test_lost_bonds_are_counted_in_the_states():
    """Stock YADE's law counts in the states of the bodies; without CpmStateUpdater, too, and beside contacts of YADE's own."""

    def run(take):
        block(rate=20.0, law=dict(omegaThreshold=0.9))
        had = sum(b.state.numBrokenCohesive for b in O.bodies)
        take()
        lost = []
        for _ in range(6):
            O.run(40, True)
            lost.append([b.state.numBrokenCohesive for b in O.bodies])
        assert sum(lost[-1]) > had + 50
        return lost

    stock, ours = both(run)
    assert stock == ours
    with raises(YadeError, "numBrokenCohesive of a body cannot be set"):
        O.bodies[0].state.numBrokenCohesive = 0
    # They stay after the engine.
    bridge.engines()[0].remove()
    assert [b.state.numBrokenCohesive for b in O.bodies] == ours[-1]


def cell(before=None):
    """A periodic cell of concrete."""
    O.reset()
    O.periodic = True
    O.cell.setBox(0.02, 0.02, 0.02)
    m = CpmMat(**MATERIAL)
    O.materials.append(m)
    rng = random.Random(3)
    for place in np.ndindex(6, 6, 6):
        x = [0.02 / 6 * (n + 0.5 + 0.1 * (rng.random() - 0.5)) for n in place]
        O.bodies.append(utils.sphere(x, 0.02 / 12, material=m, color=(1, 1, 1)))
    bound, geometry = Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5), Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([bound], verletDist=1e-4, allowBiggerThanPeriod=True),
        InteractionLoop([geometry], [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)], [Law2_ScGeom_CpmPhys_Cpm()]),
        NewtonIntegrator(damping=0.2),
    ]
    O.dt = 1e-7
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.0
    O.run(5, True)


def test_controllers_of_the_cell():
    """Stress-controlled cells follow the same path; the hook at the goal finds every bond once."""
    pull = dict(maxStrainRate=(2, 2, 2), stressMask=6, goal=(5e-5, 0, 0), globUpdate=5, maxUnbalanced=1e9, absStressTol=1e5)
    path = dict(goal=(2e-4, 0, 0, 0, 1e-4, 0), stressMask=0b000110, nSteps=60, maxStrain=1e-2)

    def controlled(make, steps):
        def run(take):
            cell()
            builtins.goals = []
            O.engines = O.engines + [make()]
            take()
            rows = []
            for _ in range(steps // 10):
                O.run(10, True)
                rows.append([*array(O.cell.velGrad).reshape(-1), *array(O.cell.trsf).reshape(-1), *array(utils.getStress()).reshape(-1)])
            return np.array(rows), list(builtins.goals), moved(positions())

        def apart(stock, ours):
            scale = np.repeat([abs(stock[0][:, k : k + 9]).max() for k in (0, 9, 18)], 9)
            return (abs(stock[0] - ours[0]).max(axis=0) / scale).max()

        # Of 36 runs of the same scene with Peri3dController, one differs from all others in stock YADE, and one, by the same numbers, beside the engine.
        for _ in range(3):
            stock, ours = both(run)
            if apart(stock, ours) <= 1e-6:
                break
        assert apart(stock, ours) <= 1e-6, apart(stock, ours)
        close(stock[2], ours[2], 1e-6)
        assert stock[1] == ours[1]
        return stock

    hook = "goals.append((O.iter, O.interactions.countReal(), sum(1 for i in O.interactions)))"
    found = controlled(lambda: PeriTriaxController(doneHook=hook, **pull), 300)
    assert found[1] and abs(found[0][-1][9] - 1) > 4e-5, (found[1], found[0][-1])
    controlled(lambda: Peri3dController(doneHook=hook, **path), 50)
    controlled(lambda: PeriIsoCompressor(charLen=1e-3, stresses=[-1e5, -2e5], maxUnbalanced=1e9, globalUpdateInt=5), 100)
    cell()
    bridge.take_over()
    for call in (O.cell.flipCell, utils.flipCell):
        with raises(YadeError, "flipCell"):
            call()


def test_an_engine_that_a_script_calls():
    """A dead recorder or updater that a PyRunner calls finds the bonds; one that cannot is refused."""

    def run(take):
        block(rate=12.0)
        O.engines = O.engines + [CpmStateUpdater(dead=True, label="updater")]
        take()
        O.run(10, True)
        O.engines[-1]()
        return states()

    stock, ours = both(run)
    close(stock, ours, 1e-8)
    with raises(YadeError, "PDFEngine reads O.interactions"):
        PDFEngine()()


def test_an_error_in_an_engine_takes_the_bonds_back():
    """A hook that fails, in a step in which the bonds are lent."""
    cell()
    O.engines = O.engines + [PeriTriaxController(goal=(0, 0, 0), stressMask=0, maxUnbalanced=1e9, doneHook="1/0", maxStrainRate=(1, 1, 1))]
    bridge.take_over()
    count = O.interactions.countReal()
    for _ in range(2):
        try:
            O.step()
        except Exception as error:
            assert "ZeroDivision" in str(error) or "division" in str(error), error
        assert len(O.interactions.own) == 0 and O.interactions.countReal() == count


def test_saved_scenes_go_on():
    """O.save with helpers in O.engines, and the same bits after O.load."""
    path = os.path.join(tempfile.mkdtemp(), "followed.yade.gz")
    block()
    behind_loop(GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.4, timeStepUpdateInterval=3))
    O.engines = O.engines + [CpmStateUpdater(iterPeriod=7)]
    bridge.take_over()
    O.run(20, True)
    O.save(path)
    O.run(40, True)
    straight, dt, damage = positions(), O.dt, states()
    O.load(path)
    O.run(40, True)
    assert (positions() == straight).all() and O.dt == dt and states() == damage


def test_contact_points_are_those_of_the_step():
    """In a PyRunner behind NewtonIntegrator, from O.interactions and in the block; of InteractionLoop, before the motion, which is a thousand times the
    difference allowed."""

    def points():
        return np.array([i.geom.contactPoint for i in sorted(O.interactions, key=lambda i: (i.id1, i.id2))])

    def run(take, shown=False):
        block(rate=20.0)
        take()
        builtins.found = []

        def look():
            if shown:
                with bridge.engines()[0].interactions():
                    found.append(points())
            else:
                found.append(points())

        builtins.look = look
        O.engines = O.engines + [PyRunner(command="look()", iterPeriod=5)]
        O.run(11, True)
        return found[0], found[1]

    stock = run(lambda: None)
    assert abs(stock[0] - stock[1]).max() > 1e-9
    for motion in (False, True):
        for shown in (False, True):
            for one, two in zip(stock, run(lambda motion=motion: bridge.take_over(motion=motion), shown)):
                assert abs(one - two).max() < 1e-15


# -- bodies -------------------------------------------------------------------------------------------------------------


def erode():
    """Erase the bodies of one corner."""
    for b in list(O.bodies):
        if b is not None and b.state.refPos[0] < 1e-3 and b.state.refPos[1] < 1e-3 and not b.state.blockedDOFs:
            O.bodies.erase(b.id)


def deposit():
    """Two spheres of the same concrete that hit the specimen, and each other."""
    for x in (4e-3, 4.4e-3):
        number = O.bodies.append(utils.sphere((-1.9e-3, x, 8e-3 + (x - 4e-3) * 4.2), 1e-3, material=O.materials[0], color=(1, 1, 1)))
        O.bodies[number].state.vel = Vector3(4, 0, 0)


def test_bodies_that_come_and_go():
    for change, rate in ((erode, 4.0), (deposit, 4.0), (lambda: (erode(), deposit()), -20.0)):

        def run(take, change=change, rate=rate):
            block(rate=rate)
            take()
            O.run(30, True)
            change()
            O.run(150, True)
            counts = O.interactions.countReal()
            alive = np.array([tuple(b.state.pos) for b in O.bodies if b is not None])
            return moved(alive), counts, sum(b.state.numBrokenCohesive for b in O.bodies if b is not None)

        stock = run(lambda: None)
        for motion in (False, True):
            ours = run(lambda motion=motion: bridge.take_over(motion=motion))
            close(stock[0], ours[0], 1e-8)
            assert stock[1:] == ours[1:]
            # Given back, nothing of YADE's own is lost.
            (e,) = bridge.engines()
            e.give_back()
            O.run(2, True)
            assert abs(O.interactions.countReal() - stock[1]) < 0.02 * stock[1]


def test_bodies_erased_within_a_step():
    def run(take):
        block()
        builtins.erode_once = lambda: erode() if O.iter == 170 else None
        take()
        O.engines = O.engines + [PyRunner(command="erode_once()", iterPeriod=1)]
        O.run(100, True)
        return moved(np.array([tuple(b.state.pos) for b in O.bodies if b is not None]))

    stock, ours = both(run)
    close(stock, ours, 1e-8)


def test_contacts_of_new_bodies_survive_a_block():
    """Spheres of concrete that a script has added since have contacts of YADE, also with bonded ones."""
    block()
    e = bridge.take_over()
    deposit()
    O.run(120, True)
    own = sorted((i.id1, i.id2) for i in O.interactions.own)
    assert own
    with e.interactions():
        pass
    assert sorted((i.id1, i.id2) for i in O.interactions.own) == own
    e.give_back()
    assert all(O.interactions.has(*pair) for pair in own)


def test_clumps_masks_and_colliders_are_refused():
    for change, text in (
        (lambda: O.bodies.clump([3, 4]), "O.bodies.clump(): body 3 belongs to a bonded engine"),
        (lambda: (setattr(O.bodies[5], "groupMask", 1), O.run(2, True)), "body 5 has groupMask=1 without the bit"),
        (lambda: (setattr(O.engines[1], "avoidSelfInteractionMask", 0), O.run(2, True)), "avoidSelfInteractionMask=0 without the bit"),
        (lambda: (setattr(O.engines[1], "avoidSelfInteractionMask", O.engines[1].avoidSelfInteractionMask | 1), O.run(2, True)), "with which YADE makes no contacts"),
        (lambda: (setattr(O.bodies[5], "groupMask", O.bodies[5].groupMask ^ 5), O.run(2, True)), "which in YADE do not touch each other"),
        (
            lambda: (setattr(O, "engines", [O.engines[0], InsertionSortCollider([Bo1_Sphere_Aabb()])] + O.engines[2:]), O.step()),
            "InsertionSortCollider has avoidSelfInteractionMask=0",
        ),
    ):
        block()
        bridge.take_over()
        O.run(3, True)
        with raises(YadeError, text):
            change()


# -- parameters ----------------------------------------------------------------------------------------------------------


def mesoscale():
    """Stiffness, strength, and onset of each contact as a script sets them: aggregates of two sizes of cell, and an interface."""
    for i in O.interactions:
        x = 0.5 * (O.bodies[i.id1].state.refPos + O.bodies[i.id2].state.refPos)
        stone = math.sin(900 * x[0]) * math.sin(900 * x[1]) * math.sin(900 * x[2]) > 0
        if stone:
            i.phys.E *= 3
            i.phys.G *= 3
            i.phys.undamagedCohesion *= 2
        else:
            i.phys.epsCrackOnset *= 0.7
            i.phys.epsFracture *= 0.5
            i.phys.tanFrictionAngle *= 0.8
        if (i.id1 + i.id2) % 17 == 0:
            i.phys.neverDamage = True


def test_contacts_with_parameters_of_their_own():
    """Set before the take-over, after it, or within a step; saved, erased beside, and given back."""
    path = os.path.join(tempfile.mkdtemp(), "own.yade.gz")

    def run(take, late=False, rate=6.0):
        block(rate=rate, steps=5)
        if not late:
            mesoscale()
        take()
        O.run(20, True)
        if late:
            mesoscale()
        # Longer, bonds without strength amplify rounding: 5e-10 of the displacements after 100 steps, 3e-7 after 200.
        O.run(40, True)
        O.interactions.erase(*next((i.id1, i.id2) for i in O.interactions if i.id1 == 100))
        O.run(40, True)
        rows = sorted((i.id1, i.id2, i.phys.E, i.phys.epsCrackOnset, i.phys.omega, i.phys.Fn, i.phys.neverDamage) for i in O.interactions)
        return moved(positions()), np.array(rows, float), utils.unbalancedForce()

    for late, rate in ((False, 6.0), (True, 6.0), (False, -20.0)):
        stock, ours = both(lambda take, late=late, rate=rate: run(take, late, rate))
        close(stock[0], ours[0], 1e-8)
        close(stock[1][:, :2], ours[1][:, :2], 1e-15)
        for column in range(2, 7):
            close(stock[1][:, column], ours[1][:, column], 1e-7)
        assert len(set(stock[1][:, 2])) == 2 and stock[1][:, 4].max() > 0.5
    (e,) = bridge.engines()
    O.save(path)
    O.run(30, True)
    straight = positions()
    O.load(path)
    O.run(30, True)
    assert (positions() == straight).all()
    before = {(i.id1, i.id2): (i.phys.E, i.phys.epsFracture, i.phys.neverDamage) for i in O.interactions}
    (e,) = bridge.engines()
    with e.interactions():
        assert before == {(i.id1, i.id2): (i.phys.E, i.phys.epsFracture, i.phys.neverDamage) for i in O.interactions}
    e.give_back()
    assert before == {(i.id1, i.id2): (i.phys.E, i.phys.epsFracture, i.phys.neverDamage) for i in O.interactions}


def test_materials_without_strength_or_ductility():
    """Brittle bonds (relDuctility = 0), and bonds that never damage, without other values: without sigmaT, they have no shear stress."""
    nothing = {name: value for name, value in MATERIAL.items() if name not in ("sigmaT", "epsCrackOnset", "relDuctility")}
    for material, rate, steps in (
        (dict(MATERIAL, relDuctility=0), 20.0, 300),
        (dict(MATERIAL, relDuctility=0), -20.0, 300),
        # Other materials without sigmaT end stock YADE in an assertion.
        (dict(nothing, neverDamage=True), 6.0, 200),
        (dict(nothing, neverDamage=True, sigmaT=3e6), -20.0, 200),
    ):

        def run(take, material=material, rate=rate, steps=steps):
            block(rate=rate, steps=20, material=material)
            take()
            O.run(steps, True)
            rows = sorted((i.id1, i.id2, i.phys.omega, i.phys.Fn, i.phys.shearForce.norm(), i.phys.relResidualStrength) for i in O.interactions)
            return moved(positions()), np.array(rows, float), O.interactions.countReal()

        stock, ours = both(run)
        assert stock[2] == ours[2], (material, stock[2], ours[2])
        close(stock[0], ours[0], 1e-7)
        for column in range(2, 6):
            close(stock[1][:, column], ours[1][:, column], 1e-6)
        if material.get("relDuctility") == 0 and rate > 0:
            assert stock[1][:, 2].max() == 1.0, "some bonds are broken at once"


# -- stresses --------------------------------------------------------------------------------------------------------------


def test_stress_with_walls():
    """A column of spheres between two walls carries F L / V, as getStress says; walls and facets end the branches."""
    O.reset()
    O.materials.append(FrictMat(young=1e7, poisson=0.5, frictionAngle=0.4, density=2500))
    r = 0.01
    for k in range(4):
        O.bodies.append(utils.sphere((0, 0, r * (2 * k + 1) * 0.999), r, color=(1, 1, 1)))
    O.bodies.append(utils.wall((0, 0, 0), 2, sense=1, color=(1, 1, 1)))
    top = 8 * r * 0.999 - 2e-6
    O.bodies.append(utils.facet([(-1, -1, top), (1, -1, top), (0, 2, top)], color=(1, 1, 1)))
    for b in O.bodies:
        if isinstance(b.shape, Sphere):
            b.state.blockedDOFs = "xyXYZ"
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Facet_Aabb()]),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0.7),
    ]
    O.dt = 0.3 * utils.PWaveTimeStep()
    O.run(5000, True)
    yades, ours = array(utils.getStress(VOLUME)).T, bridge.snapshot().region_stress(volume=VOLUME).stress
    force = -O.forces.f(4)[2]
    print("stress of a column:", yades[2, 2], ours[2, 2], "F L / V", -force * 8 * r * 0.999 / VOLUME)
    assert abs(ours[2, 2] - yades[2, 2]) < 1e-4 * abs(yades[2, 2]) and yades[2, 2] < -1e5
    assert abs(ours[2, 2] + abs(force) * top / VOLUME) < 1e-3 * abs(ours[2, 2])


main(globals())
