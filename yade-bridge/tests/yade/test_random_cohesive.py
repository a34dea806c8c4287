"""Random scripts that meddle with cohesive and frictional spheres (CohFrictMat) in mid-run, as test_random_scripts.py does with concrete: each does in
stock YADE what it does with a bonded engine, or is refused in one sentence. 20 per run; CONCORDEM_SCRIPTS sets another number, CONCORDEM_SEED the first one."""
# threads: 1

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import random_histories as common
from cohesive_scene import *
from harness import main
from random_histories import contacts, law, physics


def strength(chance, ours):
    for i in contacts(chance, 20):
        i.phys.normalAdhesion *= chance.uniform(0.2, 2)
        i.phys.shearAdhesion *= chance.uniform(0.2, 2)
        i.phys.cohesionDisablesFriction = chance.random() < 0.5


def plastic(chance, ours):
    for i in contacts(chance, 10):
        i.phys.fragile, i.phys.unpMax = False, chance.choice([-1, 2e-4])
        i.phys.unp = 1e-6


def stiffness(chance, ours):
    for i in contacts(chance, 20):
        for name in ("kn", "ks", "kr", "ktw"):
            setattr(i.phys, name, getattr(i.phys, name) * chance.uniform(0.5, 1))


def rolling(chance, ours):
    for i in contacts(chance, 20):
        i.phys.momentRotationLaw = not i.phys.momentRotationLaw
        i.phys.maxRollPl = chance.choice([-1, 1e-3])


def cohesion(chance, ours):
    for i in contacts(chance, 8):
        if hasattr(physics(), "setCohesion"):
            physics().setCohesion(i, chance.random() < 0.5, chance.random() < 0.5)
        else:
            i.phys.cohesionBroken = not i.phys.cohesionBroken


def ask(chance, ours):
    assert O.interactions.countReal() == sum(1 for i in O.interactions if i.isReal)
    utils.unbalancedForce(), utils.fabricTensor(), law().elasticEnergy(), utils.getStress(1.0)


def cohesion_now(chance, ours):
    physics().setCohesionNow = True


def later_cohesion(chance, ours):
    physics().setCohesionOnNewContacts = not physics().setCohesionOnNewContacts


def other_law(chance, ours):
    law().useIncrementalForm = not law().useIncrementalForm


def mark(chance, ours):
    for i in contacts(chance, 1):
        i.phys.initCohesion = True


# In this order, numbers of scripts keep their meaning.
FOLLOWED = (
    *(common.erase_contacts, common.erase_bodies, strength, plastic, stiffness, rolling, cohesion, ask, common.throw, common.push, common.hold, common.newton),
    *(common.time_step, common.stepper, common.keep, common.back_and_forth, common.look),
)
MAY_BE_REFUSED = (cohesion_now, later_cohesion, other_law, common.softer_material, common.grow, common.clump, mark)


def script(number):
    chance, actions = common.drawn(number, FOLLOWED, MAY_BE_REFUSED)
    scene = dict(
        rate=chance.choice([2.0, 4.0, -3.0]),
        law=chance.choice([{}, dict(useIncrementalForm=True), dict(useIncrementalForm=True, always_use_moment_law=True), dict(shear_creep=True, creep_viscosity=1e5)]),
        material=chance.choice([{}, dict(fragile=False), dict(momentRotationLaw=False), dict(normalCohesion=2e6, shearCohesion=2e6)]),
        physics=dict(setCohesionOnNewContacts=chance.random() < 0.4),
    )
    return dict(actions=actions, scene=scene, motion=chance.random() < 0.3)


def test_random_scripts():
    common.compare(script, lattice, lambda physics: not physics.cohesionBroken, MAY_BE_REFUSED)


main(globals())
