"""Random scripts that meddle with spheres under a law with histories (CohFrictMat, JCFpmMat) in mid-run, for test_random_cohesive.py and
test_random_jointed.py: actions that both have, and the comparison with stock YADE."""

import random

import numpy as np
import random_scripts
from yade import *
from yade import utils
from yade.minieigenHP import Vector3

import concordem.yade as bridge

RADIUS = 0.01
#: Of the largest displacement.
TOLERANCE = 1e-7


def contacts(chance, count):
    every = sorted((i.id1, i.id2) for i in O.interactions if i.isReal and isinstance(O.bodies[i.id2].shape, Sphere) and isinstance(O.bodies[i.id1].shape, Sphere))
    return [O.interactions[pair] for pair in chance.sample(every, min(count, len(every)))]


def spheres(chance, count):
    every = [b.id for b in O.bodies if b is not None and isinstance(b.shape, Sphere) and not b.state.blockedDOFs]
    return [O.bodies[k] for k in chance.sample(every, min(count, len(every)))]


def law():
    return O.engines[2].lawDispatcher.functors[0]


def physics():
    return O.engines[2].physDispatcher.functors[0]


# -- actions ----------------------------------------------------------------------------------------------------------


def erase_contacts(chance, ours):
    for i in contacts(chance, 10):
        O.interactions.erase(i.id1, i.id2)


def erase_bodies(chance, ours):
    for b in spheres(chance, 3):
        O.bodies.erase(b.id)


def throw(chance, ours):
    """A sphere of the same material at the specimen."""
    number = O.bodies.append(utils.sphere((-2.3 * RADIUS, chance.uniform(1, 6) * RADIUS, chance.uniform(3, 9) * RADIUS), RADIUS, material=O.materials[0], color=(1, 1, 1)))
    O.bodies[number].state.vel = Vector3(8, 0, 0)


def push(chance, ours):
    for b in spheres(chance, 4):
        b.state.vel += Vector3(*(chance.uniform(-1, 1) for _ in range(3)))
        b.state.angVel += Vector3(*(chance.uniform(-40, 40) for _ in range(3)))


def hold(chance, ours):
    for b in spheres(chance, 3):
        b.state.blockedDOFs, b.state.vel = "xyzXYZ", Vector3.Zero


def newton(chance, ours):
    O.engines[-1].damping = chance.uniform(0.1, 0.5)
    O.engines[-1].gravity = (0, chance.uniform(-1000, 1000), 0)


def time_step(chance, ours):
    O.dt *= 0.5


def stepper(chance, ours):
    O.engines = O.engines[:-1] + [GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.3, timeStepUpdateInterval=chance.choice([1, 5]))] + O.engines[-1:]


def keep(chance, ours):
    """Save and load; stock YADE keeps the histories of its own contacts of this law."""
    if ours and not any(i.isReal for i in O.interactions.own):
        O.saveTmp("kept")
        O.run(3, True)
        O.loadTmp("kept")


def back_and_forth(chance, ours):
    for engine in bridge.engines() if ours else []:
        if len(engine.contacts()["unbonded"]):
            engine.give_back()
            bridge.take_over(motion=ours["motion"])


def look(chance, ours):
    for engine in bridge.engines() if ours else []:
        with engine.interactions():
            assert len(O.interactions) >= 0


def softer_material(chance, ours):
    O.materials[0].young *= 0.9


def grow(chance, ours):
    utils.growParticles(1.001)


def clump(chance, ours):
    O.bodies.clump([b.id for b in spheres(chance, 2)])


FOLLOWED = (erase_contacts, erase_bodies, throw, push, hold, newton, time_step, stepper, keep, back_and_forth, look)
MAY_BE_REFUSED = (softer_material, grow, clump)


def drawn(number, followed, may_be_refused):
    """The chance of a script, and its actions with their steps and seeds."""
    chance = random.Random(number)
    return chance, random_scripts.actions(chance, followed, may_be_refused)


def run(case, lattice, cohesive, ours, nudged=False):
    """Displacements at the end, the pairs with whether each has cohesion, and the actions."""
    lattice(**case["scene"])
    O.run(20, True)
    if nudged:
        random_scripts.nudge()

    def one(step, action, chance):
        random_scripts.ahead(step)
        action(chance, dict(motion=case["motion"]) if ours else None)

    taken = random_scripts.taken_actions(case, one, ours)
    found = np.array([tuple(b.state.pos - b.state.refPos) for b in O.bodies if b is not None])
    return found, {"contacts": sorted((i.id1, i.id2, cohesive(i.phys)) for i in O.interactions if i.isReal)}, taken


def compare(script, lattice, cohesive, may_be_refused):
    """Compare many scripts. `script(number)`: a dict of actions, scene, and motion; `cohesive`: what tells whether a contact has cohesion."""

    def one(case, ours, nudged=False):
        return run(case, lattice, cohesive, ours, nudged)

    count = random_scripts.how_many(20)
    followed, refused, sensitive = random_scripts.compare(script, one, may_be_refused, count, TOLERANCE)
    if count >= 20:
        assert sensitive < count // 5 + 1, "most scripts say something"
        assert len(followed) > 10 and sum(followed.values()) > 2 * count and refused
