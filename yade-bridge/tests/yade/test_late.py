"""Bonds that YADE makes after the take-over, against stock YADE: bodies that settle first and are bonded then, and more bonds in mid-run. While YADE makes
them, its law computes all contacts, and the bonded engine waits."""

import builtins
import os
import random
import sys
import tempfile
import warnings

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, on_two_threads, raises
from yade import utils

import concordem.yade as bridge
from concordem import YadeError

#: Of the largest displacement. Sums in another order differ by 1e-16 of a force in every step; spheres that strike each other, and bonds that break,
#: amplify it. Measured: 1e-10 at -j2, 3e-12 at -j1.
TOLERANCE = 1e-9


def loose(limit, speed=8.0):
    """Spheres of concrete with gaps of 2 to 4 % of the radius, which fly together; contacts that begin before iteration `limit` are bonds."""
    O.reset()
    chance = random.Random(5)
    m = O.materials.append(CpmMat(**MATERIAL))
    middle = np.array([5e-3, 5e-3, 7e-3])
    for place in np.ndindex(5, 5, 7):
        x = np.array([2.03e-3 * n + chance.uniform(-1e-5, 1e-5) for n in place])
        number = O.bodies.append(utils.sphere(x.tolist(), 1e-3, material=O.materials[m], color=(1, 1, 1)))
        O.bodies[number].state.vel = Vector3(*(speed * (middle - x) / 7e-3))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(label="bo")], verletDist=2e-4, label="collider"),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom(label="ig")], [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=limit, label="ip")], [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.9)]),
        NewtonIntegrator(damping=0.3, label="newton"),
    ]
    O.dt = 0.4 * utils.PWaveTimeStep()


def pull():
    """Pull what has been bonded apart."""
    for b in O.bodies:
        b.state.vel = Vector3(*(150 * (b.state.pos - Vector3(4e-3, 4e-3, 6e-3))))


def taken(**options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return bridge.take_over(**options)


def both(run, tolerance=TOLERANCE):
    """`run(take)` in stock YADE and with the bonded engine has the same displacements and contacts; returns what the bonded engine tells."""
    found = []
    for take in (lambda **options: None, taken):
        told = run(take)
        moved = np.array([tuple(b.state.pos - b.state.refPos) for b in O.bodies])
        contacts = sorted((i.id1, i.id2, i.phys.isCohesive) for i in O.interactions if i.isReal)
        damage = sorted(i.phys.omega for i in O.interactions if i.isReal)
        found.append((moved, contacts, damage, sum(b.state.numBrokenCohesive for b in O.bodies), told))
    stock, ours = found
    scale = abs(stock[0]).max()
    worst = abs(stock[0] - ours[0]).max() / scale
    print("largest difference %.1e, %d bonds, %d lost" % (worst, sum(c[2] for c in stock[1]), stock[3]))
    assert worst < tolerance, worst
    assert stock[1] == ours[1] and stock[3] == ours[3]
    # Damage runs from 0 to 1 within a strain of 1e-3, of which the tolerance is a millionth.
    assert np.allclose(stock[2], ours[2], rtol=0, atol=1e3 * tolerance)
    assert sum(c[2] for c in ours[1]) > 50 and stock[3] > 20
    return ours[4]


@on_two_threads
def test_bodies_that_settle_first():
    """The limit lies ahead of take_over(), in one run and in single steps."""

    def run(take, single):
        loose(150)
        engine = take()
        had = []
        for count in (100, 60, 140):
            if single:
                for _ in range(count):
                    O.step()
            else:
                O.run(count, True)
            had.append(engine is not None and not engine._waits and engine.bond_count)
        pull()
        O.run(100, True)
        return had

    for single in (False, True):
        had = both(lambda take: run(take, single))
        assert not had[0] and had[1] > 100, had


@on_two_threads
def test_more_bonds_later():
    """A script sets both attributes in mid-run, and sets the distance back; twice, and with CpmStateUpdater replaced."""

    def bonded(count, until):
        ip.cohesiveThresholdIter = O.iter + until
        bo.aabbEnlargeFactor = ig.interactionDetectionFactor = 1.05
        O.engines[1].doSort = True
        O.run(count, True)
        bo.aabbEnlargeFactor = ig.interactionDetectionFactor = 1.0

    def run(take):
        loose(90)
        O.engines = O.engines + [CpmStateUpdater(iterPeriod=20)]
        O.run(100, True)
        engine = take(update_states=20)
        steps = []
        O.run(30, True)
        for until in (3, 2):
            bonded(3, until)
            O.run(40, True)
            if engine is not None:
                assert not engine._waits and O.engines[4].dead
                steps.append(engine.solver.steps)
        pull()
        O.run(80, True)
        return steps

    # What it computes since the last take-over: the bonds are there one step after the last one was made.
    steps = both(run)
    assert steps == [40, 40], steps


def test_from_a_script_in_the_loop():
    """A PyRunner at the end bonds what touches from the next step on; the engine goes on in the step after."""

    def run(take):
        loose(90)
        builtins.ip = ip
        O.engines = O.engines + [PyRunner(command="setattr(ip, 'cohesiveThresholdIter', O.iter + 11) if O.iter == 140 else None", iterPeriod=1)]
        O.run(100, True)
        engine = take()
        O.run(100, True)
        return engine and engine.solver.steps

    # 40 steps before, 10 of YADE's, and the rest since the last take-over, in step 150.
    assert both(run) == 49


def test_set_before_the_engine_acts():
    """In a PyRunner ahead of InteractionLoop, the bonds of this step would be missing."""
    loose(90)
    builtins.ip = ip
    O.run(100, True)
    taken()
    O.engines = [PyRunner(command="setattr(ip, 'cohesiveThresholdIter', O.iter + 11)", iterPeriod=1)] + O.engines
    with raises(Exception, "has not acted in this step"):
        O.run(5, True)
    assert ip.cohesiveThresholdIter == 90


def test_what_is_said():
    """The take-over warns; what the engine does not have is refused by name; some scripts are refused."""
    loose(150)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        engine = bridge.take_over()
    (line,) = [str(w.message) for w in told if "take_over()" in str(w.message)]
    assert "YADE makes bonds until iteration 150 (cohesiveThresholdIter)" in line and "\n" not in line
    for ask in (lambda: engine.bond_count, lambda: engine.broken, engine.contacts, engine.forces, lambda: engine.stress(1.0), engine.give_back):
        with raises(YadeError, "has no bonds now: YADE makes bonds until iteration 150"):
            ask()
    assert [e.name for e in bridge.engines()] == ["bonds"] and len(O.engines) == 4
    with raises(YadeError, 'already is a bonded engine "bonds"'):
        taken()
    O.run(10, True)
    engine.remove()
    assert not bridge.engines() and len(O.engines) == 4
    with raises(YadeError, "motion=True starts between two runs"):
        taken(motion=True)
    ip.cohesiveThresholdIter = -1
    with raises(YadeError, "is negative"):
        taken()
    ip.cohesiveThresholdIter = 90
    O.run(100, True)
    taken(motion=True)
    with raises(YadeError, "with motion=True cannot wait"):
        ip.cohesiveThresholdIter = O.iter + 10
    assert ip.cohesiveThresholdIter == 90
    O.run(5, True)


def test_no_bonds_are_made():
    """The engine ends with a warning, and YADE goes on."""
    loose(20, speed=0.0)
    taken()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        O.run(30, True)
    assert any("YADE has made no bonds" in str(w.message) for w in told) and not bridge.engines()
    O.run(5, True)


def test_a_saved_scene_waits_on():
    """O.save while the engine waits, before YADE has made a contact, whose history it would lose; after O.load, all goes on."""
    path = os.path.join(tempfile.mkdtemp(), "late.yade.gz")

    def run(take):
        loose(150)
        take()
        O.run(5, True)
        assert not any(i.isReal for i in O.interactions)
        O.save(path)
        O.load(path)
        O.run(155, True)
        pull()
        O.run(60, True)
        return [e.solver.steps for e in bridge.engines()]

    assert both(run) == [70]


main(globals())
