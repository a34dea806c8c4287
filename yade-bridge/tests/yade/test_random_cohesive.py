"""Random scripts that meddle with cohesive and frictional spheres (CohFrictMat) in mid-run, as test_random_scripts.py does with concrete: each does in
stock YADE what it does with a bonded engine, or is refused in one sentence. 20 per run; CONCORDEM_SCRIPTS sets another number, CONCORDEM_SEED the first one."""
# threads: 1

import collections
import math
import os
import random
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from cohesive_scene import *
from harness import main

import concordem.yade as bridge
from concordem import YadeError

COUNT = int(os.environ.get("CONCORDEM_SCRIPTS", "20"))
FIRST = int(os.environ.get("CONCORDEM_SEED", "1"))
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


def cohesion_now(chance, ours):
    physics().setCohesionNow = True


def later_cohesion(chance, ours):
    physics().setCohesionOnNewContacts = not physics().setCohesionOnNewContacts


def other_law(chance, ours):
    law().useIncrementalForm = not law().useIncrementalForm


def softer_material(chance, ours):
    O.materials[0].young *= 0.9


def grow(chance, ours):
    utils.growParticles(1.001)


def clump(chance, ours):
    O.bodies.clump([b.id for b in spheres(chance, 2)])


def mark(chance, ours):
    for i in contacts(chance, 1):
        i.phys.initCohesion = True


FOLLOWED = (
    *(erase_contacts, erase_bodies, strength, plastic, stiffness, rolling, cohesion, ask, throw, push, hold, newton, time_step, stepper, keep),
    *(back_and_forth, look),
)
MAY_BE_REFUSED = (cohesion_now, later_cohesion, other_law, softer_material, grow, clump, mark)


def script(number):
    chance = random.Random(number)
    kinds = [MAY_BE_REFUSED if chance.random() < 0.12 else FOLLOWED for _ in range(chance.randrange(2, 7))]
    actions = sorted(((chance.randrange(1, 90), chance.choice(kind), chance.randrange(1 << 30)) for kind in kinds), key=lambda action: action[0])
    return dict(
        actions=actions,
        rate=chance.choice([2.0, 4.0, -3.0]),
        law=chance.choice([{}, dict(useIncrementalForm=True), dict(useIncrementalForm=True, always_use_moment_law=True), dict(shear_creep=True, creep_viscosity=1e5)]),
        material=chance.choice([{}, dict(fragile=False), dict(momentRotationLaw=False), dict(normalCohesion=2e6, shearCohesion=2e6)]),
        physics=dict(setCohesionOnNewContacts=chance.random() < 0.4),
        motion=chance.random() < 0.3,
    )


def ahead(goal):
    if O.iter < goal:
        O.run(goal - O.iter, True)


def run(case, ours, nudged=False):
    """Displacements at the end, the pairs, and whether each has cohesion; or the refusal."""
    lattice(rate=case["rate"], law=case["law"], material=case["material"], physics=case["physics"])
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
    return "ran", (found, sorted((i.id1, i.id2, i.phys.cohesionBroken) for i in O.interactions if i.isReal)), taken


def test_random_scripts():
    followed, refused, worst, sensitive = collections.Counter(), collections.Counter(), 0.0, 0
    for number in range(FIRST, FIRST + COUNT):
        case = script(number)
        names = [(step, action.__name__) for step, action, _ in case["actions"]]
        try:
            kind, found, taken = run(case, ours=True)
            if kind == "refused":
                may = {action.__name__ for action in MAY_BE_REFUSED}
                blamed = [name for _, name in names[: len(taken) + 1] if name in may]
                assert (blamed or case["motion"]) and "\n" not in found and len(found) > 40, found
                refused[blamed[-1] if blamed else "motion"] += 1
                continue
            _, wanted, _ = run(case, ours=False)
            scale = abs(wanted[0]).max()
            difference = abs(wanted[0] - found[0]).max() / scale
            allowed = TOLERANCE
            if difference > allowed:
                other = run(case, ours=False, nudged=True)[1][0]
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


main(globals())
