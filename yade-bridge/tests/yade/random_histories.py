"""Random scripts that meddle with spheres under a law with histories (CohFrictMat, JCFpmMat) in mid-run, for test_random_cohesive.py and
test_random_jointed.py: actions that both have, and the comparison with stock YADE."""

import collections
import math
import os
import random

import numpy as np
from yade import *
from yade import utils
from yade.minieigenHP import Vector3

import concordem.yade as bridge
from concordem import YadeError

COUNT = int(os.environ.get("CONCORDEM_SCRIPTS", "20"))
FIRST = int(os.environ.get("CONCORDEM_SEED", "1"))
RADIUS = 0.01
#: Of the largest displacement; beyond it, a script may differ by a hundred times what one bit of one coordinate makes in stock YADE.
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
    kinds = [may_be_refused if chance.random() < 0.12 else followed for _ in range(chance.randrange(2, 7))]
    actions = sorted(((chance.randrange(1, 90), chance.choice(kind), chance.randrange(1 << 30)) for kind in kinds), key=lambda action: action[0])
    return chance, actions


def ahead(goal):
    if O.iter < goal:
        O.run(goal - O.iter, True)


def run(case, lattice, cohesive, ours, nudged=False):
    """Displacements at the end, the pairs, and whether each has cohesion; or the refusal."""
    lattice(**case["scene"])
    O.run(20, True)
    start = O.iter
    taken = []
    if nudged:
        state = O.bodies[37].state
        state.pos = Vector3(math.nextafter(state.pos[0], 1.0), state.pos[1], state.pos[2])
    try:
        if ours:
            bridge.take_over(motion=case["motion"])
        for step, action, seed in case["actions"]:
            ahead(start + step)
            action(random.Random(seed), dict(motion=case["motion"]) if ours else None)
            taken.append(action.__name__)
        ahead(start + 100)
    except YadeError as error:
        assert ours
        return "refused", str(error), taken
    found = np.array([tuple(b.state.pos - b.state.refPos) for b in O.bodies if b is not None])
    return "ran", (found, sorted((i.id1, i.id2, cohesive(i.phys)) for i in O.interactions if i.isReal)), taken


def compare(script, lattice, cohesive, may_be_refused):
    """Compare many scripts. `script(number)`: a dict of actions, scene, and motion; `cohesive`: what tells whether a contact has cohesion."""
    followed, refused, worst, sensitive = collections.Counter(), collections.Counter(), 0.0, 0
    for number in range(FIRST, FIRST + COUNT):
        case = script(number)
        names = [(step, action.__name__) for step, action, _ in case["actions"]]
        try:
            kind, found, taken = run(case, lattice, cohesive, ours=True)
            if kind == "refused":
                may = {action.__name__ for action in may_be_refused}
                blamed = [name for _, name in names[: len(taken) + 1] if name in may]
                assert (blamed or case["motion"]) and "\n" not in found and len(found) > 40, found
                refused[blamed[-1] if blamed else "motion"] += 1
                continue
            _, wanted, _ = run(case, lattice, cohesive, ours=False)
            scale = abs(wanted[0]).max()
            difference = abs(wanted[0] - found[0]).max() / scale
            allowed = TOLERANCE
            if difference > allowed:
                other = run(case, lattice, cohesive, ours=False, nudged=True)[1][0]
                bit = abs(wanted[0] - other).max() / scale
                print(f"script {number}: {difference:.1e}, one bit in stock YADE makes {bit:.1e}")
                sensitive += 1
                allowed = 100 * bit
            assert difference < allowed, f"displacements differ by {difference:.1e}"
            if difference > TOLERANCE:
                continue
            assert wanted[1] == found[1], f"contacts differ: {sorted(set(wanted[1]) ^ set(found[1]))[:6]}"
            worst = max(worst, difference)
            followed.update(taken)
        except Exception as error:
            raise AssertionError(f"script {number}: {case}: {type(error).__name__}: {error}") from error
    print("followed", dict(followed))
    print("refused", dict(refused))
    print("largest difference: %.1e" % worst)
    if COUNT >= 20:
        assert sensitive < COUNT // 5 + 1, "most scripts say something"
        assert len(followed) > 10 and sum(followed.values()) > 2 * COUNT and refused
