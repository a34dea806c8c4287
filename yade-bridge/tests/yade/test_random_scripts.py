"""Random scripts that meddle with bonds in mid-run: each does in stock YADE what it does with a bonded engine, or is refused in one sentence.

A script is a list of actions at random steps. O.interactions.eraseNonReal() is not among them: after it, stock YADE misses contacts of spheres that come
closer until its collider sorts anew (1 % of the displacements in 60 steps). 30 per run; more of them: random_scripts.py.
"""
# threads: 1

import os
import random
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main
from yade import utils

from random_scripts import *

import concordem.yade as bridge

#: Of the largest displacement. Sums in another order differ by 1e-16 of a force, which breaking bonds amplify.
TOLERANCE = 1e-6


def bonds(chance, count):
    """Some bonds, the same in both programs."""
    every = sorted(((i.id1, i.id2) for i in O.interactions if i.phys.isCohesive))
    return [O.interactions[pair] for pair in chance.sample(every, min(count, len(every)))]


def spheres(chance, count):
    every = [b.id for b in O.bodies if b is not None and isinstance(b.shape, Sphere) and not b.state.blockedDOFs]
    return [O.bodies[k] for k in chance.sample(every, min(count, len(every)))]


def loop():
    return next(e for e in O.engines if type(e).__name__ == "InteractionLoop")


# -- actions: each gets a source of chance and whether a bonded engine has the bonds ---------------------------------------------


def erase_bonds(chance, ours):
    for i in bonds(chance, 10):
        O.interactions.erase(i.id1, i.id2)


def erase_bodies(chance, ours):
    for b in spheres(chance, 3):
        O.bodies.erase(b.id)


def erase_all(chance, ours):
    O.interactions.clear()


def damage(chance, ours):
    for i in bonds(chance, 20):
        i.phys.setDamage(chance.uniform(0.1, 0.9))


def strength(chance, ours):
    for i in bonds(chance, 20):
        i.phys.undamagedCohesion *= chance.uniform(0.1, 2)
        i.phys.epsCrackOnset *= chance.uniform(0.8, 2)


def stiffness(chance, ours):
    for i in bonds(chance, 20):
        factor = chance.uniform(0.5, 1)
        i.phys.E *= factor
        i.phys.G *= factor


def unbond(chance, ours):
    for i in bonds(chance, 5):
        i.phys.isCohesive = False


def area(chance, ours):
    for i in bonds(chance, 10):
        i.phys.crossSection *= 0.7


def count(chance, ours):
    assert O.interactions.countReal() == sum(1 for _ in O.interactions)


def ask(chance, ours):
    utils.unbalancedForce(), utils.fabricTensor(), loop().lawDispatcher.functors[0].elasticEnergy()


def throw(chance, ours):
    """A sphere of the same concrete at the specimen."""
    number = O.bodies.append(utils.sphere((-2.3e-3, chance.uniform(1e-3, 6e-3), chance.uniform(4e-3, 1e-2)), 1e-3, material=O.materials[0], color=(1, 1, 1)))
    O.bodies[number].state.vel = Vector3(8, 0, 0)


def wall(chance, ours):
    O.bodies.append(utils.wall((0, 0, -0.95e-3), 2, material=O.materials[0], color=(1, 1, 1)))


def push(chance, ours):
    for b in spheres(chance, 4):
        b.state.vel += Vector3(*(chance.uniform(-1, 1) for _ in range(3)))


def shift(chance, ours):
    for b in spheres(chance, 2):
        b.state.pos += Vector3(*(chance.uniform(-1e-7, 1e-7) for _ in range(3)))


def hold(chance, ours):
    for b in spheres(chance, 3):
        b.state.blockedDOFs = "xyz"
        b.state.vel = Vector3.Zero


def newton(chance, ours):
    O.engines[-1].damping = chance.uniform(0.1, 0.5)
    O.engines[-1].gravity = (0, chance.uniform(-1000, 1000), 0)


def time_step(chance, ours):
    O.dt *= 0.5


def stepper(chance, ours):
    k = next(k for k, e in enumerate(O.engines) if type(e).__name__ == "NewtonIntegrator")
    O.engines = O.engines[:k] + [GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.4, timeStepUpdateInterval=chance.choice([1, 5]))] + O.engines[k:]


def updater(chance, ours):
    O.engines = [CpmStateUpdater(iterPeriod=7)] + O.engines if chance.random() < 0.5 else O.engines[:-1] + [CpmStateUpdater(iterPeriod=7)] + O.engines[-1:]


def skin(chance, ours):
    next(e for e in O.engines if type(e).__name__ == "InsertionSortCollider").verletDist = 3e-4


def saves_all():
    """Whether YADE has no contacts of concrete of its own, whose histories a saved scene lacks."""
    return not any(i.isReal for i in O.interactions.own)


def keep(chance, ours):
    """Save and load, after which stock YADE would have lost the histories: there it is left out."""
    if ours and saves_all():
        O.saveTmp("kept")
        O.run(3, True)
        O.loadTmp("kept")


def files(chance, ours):
    if ours and saves_all():
        path = os.path.join(tempfile.mkdtemp(), "scene.yade.gz")
        O.save(path)
        O.load(path)


def back_and_forth(chance, ours):
    if ours:
        for engine in bridge.engines():
            # After O.interactions.clear(), there is nothing to take over again.
            if engine.bond_count:
                engine.give_back()
                bridge.take_over(motion=ours["motion"])


def look(chance, ours):
    for engine in bridge.engines() if ours else []:
        with engine.interactions():
            assert len(O.interactions) > 0


def other_material(chance, ours):
    for b in spheres(chance, 1):
        b.material = O.materials[O.materials.append(CpmMat(**dict(MATERIAL, young=20e9)))]


def softer_material(chance, ours):
    O.materials[0].young *= 0.9


def grow(chance, ours):
    utils.growParticles(1.001)


def clump(chance, ours):
    O.bodies.clump([b.id for b in spheres(chance, 2)])


def connect(chance, ours):
    one, two = spheres(chance, 2)
    if not O.interactions.has(one.id, two.id):
        utils.createInteraction(one.id, two.id)


def functor(chance, ours):
    loop().lawDispatcher.functors[0].epsSoft = -2e-4


def unmask(chance, ours):
    spheres(chance, 1)[0].groupMask = 1


def other_collider(chance, ours):
    O.engines = [e if type(e).__name__ != "InsertionSortCollider" else InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]) for e in O.engines]


def reorder(chance, ours):
    O.engines = O.engines[1:] + O.engines[:1]


def sleep(chance, ours):
    loop().dead = True


def zero(chance, ours):
    O.resetTime()


def renew(chance, ours):
    """O.engines from the start, by the numbers of the script."""
    O.engines = O.engines[:3] + [O.engines[3]] + O.engines[4:]


def bond_later(chance, ours):
    """What touches in the next steps is bonded."""
    loop().physDispatcher.functors[0].cohesiveThresholdIter = O.iter + chance.randrange(2, 20)


def bond_now(chance, ours):
    """The same at a distance, with the bonds that YADE makes in one step."""
    collider = next(e for e in O.engines if type(e).__name__ == "InsertionSortCollider")
    bound, geometry = collider.boundDispatcher.functors[0], loop().geomDispatcher.functors[0]
    loop().physDispatcher.functors[0].cohesiveThresholdIter = O.iter + 2
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.1
    collider.doSort = True
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.0


def by_number(chance, ours):
    O.engines[3].dict(), setattr(O.engines[2], "label", "theLoop")


FOLLOWED = (
    *(erase_bonds, erase_bodies, erase_all, damage, strength, stiffness, unbond, area, count, ask, throw, wall, push, shift, hold, newton),
    *(time_step, stepper, updater, skin, keep, files, back_and_forth, look, renew, by_number, bond_later, bond_now),
)
MAY_BE_REFUSED = (other_material, softer_material, grow, clump, connect, functor, unmask, other_collider, reorder, sleep, zero)


def script(number):
    """The actions of a script, by step, and its scene."""
    chance = random.Random(number)
    return dict(
        actions=actions(chance, FOLLOWED, MAY_BE_REFUSED),
        rate=chance.choice([4.0, 12.0, -20.0]),
        law=chance.choice([None, dict(omegaThreshold=0.95), dict(epsSoft=-3e-4, relKnSoft=0.3)]),
        motion=chance.random() < 0.3,
        within=chance.random() < 0.3,
        single=chance.random() < 0.2,
    )


def run(case, ours, nudged=False):
    """Displacements at the end, pairs and lost bonds, and the actions. `nudged`: one bit of a coordinate is another."""
    import builtins

    chance = random.Random(1)
    concrete(rate=case["rate"], law=case["law"], spheres=[[*(2e-3 * n + chance.uniform(-1e-4, 1e-4) for n in place), 1e-3] for place in np.ndindex(4, 4, 7)])
    O.engines = O.engines[:1] + [InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=1.5e-3)] + O.engines[2:]
    old = O.engines[2]
    O.engines = (
        O.engines[:2]
        + [InteractionLoop(old.geomDispatcher.functors + [Ig2_Wall_Sphere_ScGeom()], old.physDispatcher.functors, old.lawDispatcher.functors)]
        + O.engines[3:]
    )
    O.run(60, True)
    if nudged:
        nudge()

    def one(step, action, chance):
        if case["within"] and action in (erase_bonds, damage, push, erase_bodies, count, ask):
            # From a PyRunner of this step.
            builtins.act = lambda: action(chance, ours) if O.iter == step else None
            O.engines = O.engines + [PyRunner(command="act()", iterPeriod=1)]
            ahead(step + 1)
            O.engines = O.engines[:-1]
        else:
            ahead(step, case["single"])
            action(chance, dict(motion=case["motion"]) if ours else None)

    taken = taken_actions(case, one, ours)
    found = np.array([tuple(b.state.pos - b.state.refPos) for b in O.bodies if b is not None])
    pairs = sorted((i.id1, i.id2) for i in O.interactions if i.isReal)
    return found, {"pairs": pairs, "lost bonds": sum(b.state.numBrokenCohesive for b in O.bodies if b is not None and isinstance(b.state, CpmState))}, taken


def test_random_scripts():
    scripts = how_many(30)
    followed, refused, sensitive = compare(script, run, MAY_BE_REFUSED, scripts, TOLERANCE)
    if scripts >= 30:
        assert sensitive < scripts // 5, "most scripts say something"
        assert len(followed) > 12 and sum(followed.values()) > 2 * scripts and len(refused) > 2


main(globals())
