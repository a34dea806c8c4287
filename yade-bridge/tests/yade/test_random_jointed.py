"""Random scripts that meddle with jointed cohesive frictional spheres (JCFpmMat) in mid-run, as test_random_scripts.py does with concrete: each does in
stock YADE what it does with a bonded engine, or is refused in one sentence. 20 per run; CONCORDEM_SCRIPTS sets another number, CONCORDEM_SEED the first one."""
# threads: 1

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import random_histories as common
from jointed_scene import *
from harness import main
from random_histories import contacts, law, physics


def strength(chance, ours):
    for i in contacts(chance, 20):
        i.phys.FnMax *= chance.uniform(0.2, 2)
        i.phys.FsMax *= chance.uniform(0.2, 2)
        i.phys.tanFrictionAngle = chance.uniform(0.1, 1)


def stiffness(chance, ours):
    for i in contacts(chance, 20):
        i.phys.kn *= chance.uniform(0.5, 1)
        i.phys.ks *= chance.uniform(0.5, 1)


def length(chance, ours):
    for i in contacts(chance, 10):
        i.phys.initD += chance.uniform(-1e-6, 1e-6)


def cohesion(chance, ours):
    """Bonds become contacts without cohesion, and back."""
    for i in contacts(chance, 8):
        i.phys.isCohesive = not i.phys.isCohesive
        i.phys.isBroken = not i.phys.isCohesive


def ask(chance, ours):
    assert O.interactions.countReal() == sum(1 for i in O.interactions if i.isReal)
    assert law().nbTensCracks >= 0 and sum(b.state.damageIndex for b in O.bodies if b is not None and isinstance(b.shape, Sphere)) >= 0
    utils.unbalancedForce(), utils.fabricTensor(), utils.getStress(1.0)


def later_bonds(chance, ours):
    physics().cohesiveTresholdIteration = chance.choice([-1, O.iter + 50])


def other_law(chance, ours):
    law().neverErase = not law().neverErase


def moments(chance, ours):
    law().recordMoments = True


def joint(chance, ours):
    for i in contacts(chance, 1):
        i.phys.isOnJoint = True
    law().smoothJoint = True


FOLLOWED = (*common.FOLLOWED, strength, stiffness, length, cohesion, ask)
MAY_BE_REFUSED = (*common.MAY_BE_REFUSED, later_bonds, other_law, moments, joint)


def script(number):
    chance, actions = common.drawn(number, FOLLOWED, MAY_BE_REFUSED)
    scene = dict(
        rate=chance.choice([0.5, 1.0, -3.0]),
        shift=chance.choice([0.03, 0.3]),
        distance=1.35,
        law=dict(neverErase=chance.random() < 0.3),
        material=chance.choice([{}, dict(cohesion=4e4), dict(tensileStrength=0), dict(tensileStrength=2e6, cohesion=2e6)]),
        physics=dict(cohesiveTresholdIteration=chance.choice([1, 1, -1])),
    )
    return dict(actions=actions, scene=scene, motion=chance.random() < 0.3)


def test_random_scripts():
    common.compare(script, lattice, lambda physics: physics.isCohesive, MAY_BE_REFUSED)


main(globals())
