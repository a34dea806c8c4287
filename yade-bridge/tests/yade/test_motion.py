"""Bonded bodies that the engine moves in place of NewtonIntegrator (motion=True), in stock YADE: the bits of NewtonIntegrator."""

import os
import random
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, on_two_threads, raises
from own_run import TABLES, alone, in_yade
from yade import utils

import concordem.yade as bridge
from concordem.yade import _lending
from concordem import YadeError

WORK = os.environ.get("BRIDGE_WORK") or tempfile.mkdtemp()


def steps(count):
    for _ in range(count):
        O.step()


def motion():
    """Position, velocity, angular velocity, and orientation of all bodies."""
    states = [body.state for body in O.bodies]
    return np.array([(*s.pos, *s.vel, *s.angVel, *(s.ori[k] for k in range(4))) for s in states])


def integrator():
    return next(e for e in O.engines if isinstance(e, NewtonIntegrator))


def same_bits(scene, count, **options):
    """Compare a run in which NewtonIntegrator moves the bodies with one in which the engine does; return both engines."""
    found = []
    for ours in (False, True):
        scene()
        engine = bridge.take_over(motion=ours, **options)
        steps(count)
        found.append((motion(), engine.solver.state_hash(), engine))
    (one, state, first), (two, other, second) = found
    assert (one == two).all() and state == other, abs(one - two).max()
    return first, second


def scattered(damp_gravity):
    """Spheres that never meet, with every combination of blocked degrees of freedom, damping, inertia, and angular velocities from 1e-9 to
    1e5 rad/s, under permanent forces."""
    chance = random.Random(7)
    O.reset()
    O.materials.append(FrictMat(young=1e6, density=1000))

    def vector(size):
        return Vector3(*(chance.gauss(0, size) for _ in range(3)))

    for k in range(600):
        number = O.bodies.append(utils.sphere((10 * (k % 20), 10 * (k // 20), 0), chance.uniform(0.1, 0.2), material=O.materials[0]))
        state = O.bodies[number].state
        state.vel, state.angVel = vector(1), vector(10 ** chance.uniform(-9, 5)) if k % 5 else Vector3(0, 0, 0)
        state.ori = Quaternion(vector(1).normalized(), chance.uniform(0, 6))
        state.inertia = Vector3(*(chance.uniform(0.1, 1) for _ in range(3)))
        state.isDamped = bool(k % 4)
        if k % 3:
            state.blockedDOFs = "xyzXYZ" if k % 7 == 0 else "".join(c for c in "xyzXYZ" if chance.random() < 0.3)
        O.forces.setPermF(number, vector(100))
        O.forces.setPermT(number, vector(10))
    O.dt = 1e-4
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=0.01),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]),
        NewtonIntegrator(damping=0.3, gravity=(1, -2, -9.81), dampGravity=damp_gravity),
    ]


@on_two_threads
def test_bits_of_every_setting():
    stiff = {"name": "any", "density": 1000, "linear_bond": {"normal_stiffness": 1.0, "shear_stiffness": 1.0}}
    for damp_gravity in (True, False):
        found = []
        for ours in (False, True):
            scattered(damp_gravity)
            start = motion()
            if ours:
                bridge.bond(material=stiff, contacts={"law": "linear_bond"}, integration={"time_step": "100 us"}, motion=True)
            steps(20)
            # Settings and states may change at any time.
            integrator().damping, integrator().gravity = 0.1, Vector3(0, 0, -5)
            O.bodies[3].state.vel = Vector3(1, 2, 3)
            O.bodies[4].state.blockedDOFs = "xY"
            O.forces.setPermF(5, Vector3(-50, 0, 0))
            steps(20)
            found.append(motion())
        assert (found[0] == found[1]).all() and integrator().dead
        assert (found[0] != start).any(axis=1).sum() > 500


def use_threads(count):
    for engine in O.engines:
        engine.ompThreads = count


def breaking(spheres=None):
    """The specimen, by default its half, after one step of YADE on one thread, because YADE's sums depend on its threads."""
    concrete(rate=40.0, spheres=spheres or half(), law=dict(omegaThreshold=0.99), before=lambda: use_threads(1))
    use_threads(-1)


def whole():
    """More than 1,024 particles, which several threads share."""
    breaking(packing())


@on_two_threads
def test_bits_of_a_breaking_specimen():
    one, two = same_bits(whole, 800)
    assert one.broken == two.broken > 100
    same_bits(whole, 300, kinematics="finite", mode="thesis")
    assert integrator().dead and integrator().mask == -1


def runner(command, **period):
    return PyRunner(command=command, **period)


def test_steps_at_once():
    """O.run computes up to 64 steps at once, but for engines that are due: they see the same steps, times, motions, and forces."""
    import builtins

    def look(name):
        seen.append((name, O.iter, O.time, tuple(O.bodies[300].state.pos), tuple(O.forces.f(300)), tuple(O.bodies[3].state.ori[k] for k in range(4))))

    def kick():
        O.bodies[300].state.vel += Vector3(0.01, 0, 0)

    builtins.look, builtins.kick = look, kick
    found = []
    for ours in (False, True):
        breaking()
        seen = []
        before = [runner("look('before')", iterPeriod=13)]
        after = [
            runner("look('after')", iterPeriod=7),
            runner("look('late')", iterPeriod=20, firstIterRun=50),
            runner("look('thrice')", iterPeriod=30, nDo=3),
            runner("look('time')", virtPeriod=33.3 * O.dt),
            runner("kick()", iterPeriod=50),
        ]
        O.engines = before + O.engines + after
        engine = bridge.take_over(motion=ours, update_states=40)
        O.run(400, True)
        O.engines = [e for e in O.engines if getattr(e, "command", "") not in {e.command for e in before + after}]
        O.timingEnabled = True
        (mine,) = [e for e in _lending.raw_engines() if getattr(e, "command", "") == engine.command]
        mine.execCount = 0
        O.run(300, True)
        O.timingEnabled = False
        found.append((seen, O.iter, O.time, motion(), [b.state.normDmg for b in O.bodies], engine.solver.state_hash()))
        assert mine.execCount == 300 if not ours else mine.execCount < 150, mine.execCount
    del builtins.look, builtins.kick
    for k, (one, two) in enumerate(zip(*found)):
        assert (one == two).all() if k == 3 else one == two, k
    assert len(found[0][0]) > 100 and max(found[0][4]) > 0


def meddled(meddle, place, ours, count=200):
    """A run in which `meddle` is called every 17 steps by a PyRunner at this place of O.engines; its iteration, motion, and error."""
    import builtins

    builtins.meddle = meddle
    breaking([s for s in packing() if s[2] < 0.0125])
    engines = O.engines
    where = {"first": 0, "before": 1, "after": len(engines)}[place]
    O.engines = engines[:where] + [runner("meddle()", iterPeriod=17)] + engines[where:]
    engine = bridge.take_over(motion=ours)
    stopped = ""
    until = O.iter + count
    for _ in range(20):
        try:
            O.run(until - O.iter, True)
        except RuntimeError as error:
            stopped = f"{type(error).__name__}: {error}"
            break
        if O.iter >= until:
            break
    del builtins.meddle
    O.trackEnergy = False
    found = O.iter, O.time, motion(), stopped, engine.broken, [tuple(O.forces.f(b.id)) for b in O.bodies if b.id in (3, 300)]
    return found


def change(what):
    """A function that changes something of body 300, the integrator, or the scene."""

    def do():
        s = O.bodies[300].state
        if what == "time step":
            O.dt *= 0.97
        elif what == "mass":
            s.mass, s.inertia = 1.3 * s.mass, 0.8 * s.inertia
        elif what == "blocked":
            s.blockedDOFs = "" if s.blockedDOFs else "xyY"
        elif what == "velocity":
            s.vel, s.angVel = s.vel + Vector3(0.02, 0, 0), s.angVel + Vector3(0, 3, 0)
        elif what == "position":
            s.pos, s.ori = s.pos + Vector3(1e-7, 0, 0), Quaternion(Vector3(0, 0, 1), 0.1) * s.ori
        elif what == "force":
            O.forces.addF(300, Vector3(40, 0, 0))
            O.forces.addT(300, Vector3(0, 0.01, 0))
        elif what == "permanent force":
            O.forces.setPermF(300, Vector3(5e-4 * O.iter, 0, 0))
        elif what == "damping":
            integrator().damping, integrator().gravity = 0.9 * integrator().damping, integrator().gravity + Vector3(0, 0, -900)
        elif what == "undamped":
            s.isDamped = not s.isDamped
        elif what == "pause":
            O.pause()
        elif what == "stop":
            O.stopAtIter = O.iter + 3
        elif what == "exception" and O.iter > 60:
            raise ValueError("of the script")
        elif what == "engine":
            O.engines = O.engines + [runner("O.bodies[301].state.vel += Vector3(0, 0.003, 0)", iterPeriod=5 + len(O.engines))]
        elif what == "another period":
            mine = next(e for e in O.engines if getattr(e, "command", "") == "meddle()")
            mine.iterPeriod = 11 if mine.iterPeriod == 17 else 17
            s.vel += Vector3(0, 0, 0.02)

    return do


def test_scripts_that_meddle():
    """A script within the run changes what moves the bodies: the same bits as without motion, in joined steps, too."""
    untouched = meddled(change("nothing"), "after", True)
    for what in (
        *("time step", "mass", "blocked", "velocity", "position", "force", "permanent force", "damping", "undamped", "pause", "stop", "exception"),
        *("engine", "another period"),
    ):
        # Forces act from behind ForceResetter. YADE itself deletes those that come earlier or later only if they were summed in between.
        for place in ("first", "before", "after") if what != "force" else ("before",):
            one, two = meddled(change(what), place, False), meddled(change(what), place, True)
            for k, (yades, ours) in enumerate(zip(one, two)):
                assert (yades == ours).all() if k == 2 else yades == ours, (what, place, k)
            if what not in ("pause", "stop", "exception"):
                assert (untouched[2] != two[2]).any(), (what, place, "it has an effect")
            assert (what == "exception") == bool(two[3]), (what, two[3])


def test_what_cannot_go_on_is_refused_in_joined_steps():
    def track():
        O.trackEnergy = True

    def periodic():
        O.periodic = True

    def erase():
        type(O.bodies).erase.__wrapped__(O.bodies, 300)

    def state():
        O.bodies[300].state = CpmState()

    def far():
        O.bodies[300].state.pos = Vector3(1e30, 0, 0)

    def twice():
        bridge.take_over(name="others", motion=True)

    def remove():
        bridge.engines()[0].remove()

    # O.trackEnergy has no effect on the motion, so it is seen at the next deep check.
    for meddle, text, longest in (
        (track, "O.trackEnergy = False", 64),
        (periodic, "eriodic", 1),
        (erase, "body 300 was deleted or replaced", 1),
        (state, "body 300 was deleted or replaced", 1),
        (far, "body 300 is 1e30 m from the origin", 1),
        (twice, "excluded from contacts by the collider's avoidSelfInteractionMask, as bodies of a bonded engine are", 0),
        (remove, "within a step", 0),
    ):
        for place in ("before", "after"):
            at = []

            def once():
                if not at and O.iter > 40:
                    at.append(O.iter)
                    meddle()

            found = meddled(once, place, True)
            O.periodic = False
            assert text in found[3], (text, found[3])
            assert len(at) == 1 and found[0] <= at[0] + longest, (text, at, found[0])


def test_a_body_that_comes_and_touches():
    """A script adds a sphere that flies into the specimen, erases it, and adds it again."""
    found = []
    for ours in (False, True):
        O.reset()
        concrete(rate=0.0, spheres=[s for s in packing() if s[2] < 0.02], before=lambda: use_threads(1))
        O.engines[2].physDispatcher.functors = O.engines[2].physDispatcher.functors + [Ip2_FrictMat_FrictMat_FrictPhys()]
        O.engines[2].lawDispatcher.functors = O.engines[2].lawDispatcher.functors + [Law2_ScGeom_FrictPhys_CundallStrack()]
        top = max((b.state.pos[2] + b.shape.radius, b.id) for b in O.bodies)
        above = O.bodies[top[1]].state.pos
        bridge.take_over(motion=ours)
        steel = FrictMat(young=25e9, poisson=0.3, frictionAngle=0.3, density=7800)
        import builtins

        def come():
            number = O.bodies.append(utils.sphere((above[0], above[1], top[0] + 1.0005e-3), 1e-3, material=steel))
            O.bodies[number].state.vel = Vector3(0, 0, -30)
            added.append(number)

        def script():
            if O.iter // 10 in (4, 20):
                come()
            if O.iter // 10 == 15:
                O.bodies.erase(added[0])

        added, builtins.script, touched = [], script, []
        builtins.touched = touched
        O.engines = O.engines + [
            runner("script()", iterPeriod=10),
            runner("touched.append(sum(i.isReal for i in O.interactions))", iterPeriod=10),
        ]
        O.run(400, True)
        found.append((O.iter, [tuple(b.state.pos) for b in O.bodies if b], list(touched), added))
    assert max(found[0][2]) > 0 and len(found[0][3]) == 2
    assert found[0] == found[1]


def test_permanent_forces_and_single_steps_are_not_joined():
    found = []
    for ours in (False, True):
        breaking()
        bridge.take_over(motion=ours)
        O.run(70, True)
        O.forces.setPermF(300, Vector3(0.5, 0, 0))
        O.run(70, True)
        O.forces.reset(True)
        steps(3)
        assert O.iter == 144
        O.run(70, True)
        found.append(motion())
    assert (found[0] == found[1]).all()


def test_an_error_within_joined_steps():
    """It names the step, and leaves motion and clock of that step."""
    found = []
    for ours in (False, True):
        breaking()
        bridge.take_over(motion=ours)
        O.bodies[300].state.vel = Vector3(0, 0, 1e16)
        with raises(RuntimeError, "m from the origin") as caught:
            O.run(100, True)
        found.append((O.iter, str(caught.value), motion()))
    assert found[0][:2] == found[1][:2] and (found[0][2] == found[1][2]).all()


@on_two_threads
def test_bits_with_many_threads_of_ours():
    """More than 1,024 particles are moved by several threads."""
    hashes = set()
    for threads in (1, 2, 3):
        whole()
        bridge.take_over(motion=True, threads=threads)
        steps(100)
        hashes.add(motion().tobytes())
    assert len(hashes) == 1


def wall_under_impact():
    """A block of spheres on the ground, hit by a heavy sphere that YADE moves; the contacts with both are YADE's."""
    O.reset()
    chance = random.Random(5)
    m = CpmMat(young=20e9, poisson=0.2, sigmaT=2.5e6, epsCrackOnset=1e-4, relDuctility=3, frictionAngle=0.7, density=4800)
    steel = FrictMat(young=100e9, poisson=0.3, frictionAngle=0.3, density=7800)
    O.materials.append(m)
    O.materials.append(steel)
    r = 0.01
    O.bodies.append(utils.sphere((0.05, -2.5 * r - 0.012, 0.05), 2.5 * r, material=steel))
    O.bodies[0].state.vel = (0, 25, 0)
    block = [(x, y, z) for x in range(5) for y in range(3) for z in range(5)]
    for place in block:
        O.bodies.append(utils.sphere([2 * r * c + 0.06 * r * chance.uniform(-1, 1) for c in place], r, material=m))
    O.bodies.append(utils.wall((0, 0, -1.06 * r), 2, material=steel))
    O.dt = 0.4 * r * math.sqrt(m.density / m.young)
    bound, geometry = Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5), Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([bound, Bo1_Wall_Aabb()], verletDist=0.1 * r),
        InteractionLoop(
            [geometry, Ig2_Wall_Sphere_ScGeom()],
            [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1), Ip2_FrictMat_CpmMat_FrictPhys(), Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.97), Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0.05, gravity=(0, 0, -9.81)),
    ]
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1
    steps(2)


def test_bits_beside_other_bodies():
    """YADE moves the missile and keeps the wall, and its collider searches in the same steps."""
    found = []
    for ours in (False, True):
        wall_under_impact()
        engine = bridge.take_over(motion=ours)
        searches = []
        for _ in range(1500):
            O.step()
            searches.append(O.engines[1].numAction)
        found.append((motion(), searches, engine.broken))
    assert (found[0][0] == found[1][0]).all()
    assert found[0][1] == found[1][1] and found[0][1][-1] > 5
    assert found[0][2] == found[1][2] > 10
    newton, mask = integrator(), integrator().mask
    assert not newton.dead and mask > 0
    assert [body.id for body in O.bodies if body.groupMask & mask] == [0, 76]
    engine.remove()
    assert newton.mask == -1 and all(body.groupMask == 1 for body in O.bodies)


def test_bodies_that_come_later_move():
    """A sphere created during the run, in a scene without and with other bodies."""
    for scene in (breaking, wall_under_impact):
        found = []
        for ours in (False, True):
            scene()
            bridge.take_over(motion=ours)
            steps(5)
            number = O.bodies.append(utils.sphere((0.3, 0.3, 0.3), 0.01, material=O.materials[0]))
            O.bodies[number].state.vel = Vector3(0, 0, -3)
            steps(20)
            found.append(motion())
        assert (found[0] == found[1]).all()
        assert not integrator().dead and found[0][number][2] < 0.3


def test_strainer_and_its_stress():
    found = []
    for ours in (False, True):
        ends = concrete(rate=0.0)
        O.engines = O.engines + [
            UniaxialStrainer(
                posIds=ends[1], negIds=ends[0], axis=2, strainRate=2.0, blockDisplacements=True, blockRotations=True,
                crossSectionArea=22e-3 * 22e-3,
            )
        ]
        bridge.take_over(motion=ours)
        steps(200)
        found.append((motion(), O.engines[-1].avgStress))
    assert (found[0][0] == found[1][0]).all() and found[0][1] == found[1][1] != 0


def test_beams_and_deformable_particles():
    for kind in TABLES:
        found = []
        for ours in (False, True):
            in_yade(alone(kind))
            engine = bridge.bond(**TABLES[kind], motion=ours)
            steps(400)
            found.append((motion(), engine.broken))
        assert (found[0][0] == found[1][0]).all() and found[0][1] == found[1][1] > 0, kind


def test_saved_and_loaded():
    for scene, name in ((breaking, "alone"), (wall_under_impact, "beside")):
        scene()
        bridge.take_over(motion=True)
        steps(200)
        path = os.path.join(WORK, f"motion-{name}.yade.gz")
        bridge.save(path)
        steps(100)
        straight = motion()
        (engine,) = bridge.load(path)
        steps(100)
        assert (motion() == straight).all(), name
        engine.remove()
        assert not integrator().dead and integrator().mask == -1


def test_given_back_and_shown():
    """YADE goes on as from an engine without motion."""
    found = []
    for ours in (False, True):
        breaking()
        engine = bridge.take_over(motion=ours)
        steps(100)
        with engine.interactions():
            shown = sum(i.phys.normalForce.norm() for i in O.interactions)
        steps(50)
        engine.give_back()
        assert not integrator().dead and integrator().mask == -1
        steps(50)
        found.append((motion(), shown))
    assert (found[0][0] == found[1][0]).all() and found[0][1] == found[1][1] > 0


def test_what_it_cannot_do_is_refused():
    def refused(text, change, **options):
        breaking()
        change()
        start, engines = motion(), len(O.engines)
        with raises(YadeError, text):
            bridge.take_over(motion=True, **options)
        assert not integrator().dead and len(O.engines) == engines and all(b.groupMask < 4 for b in O.bodies)
        assert (motion() == start).all()

    def track():
        O.trackEnergy = True

    def aspherical():
        O.bodies[9].aspherical = True

    def between():
        O.engines = O.engines[:3] + [PyRunner(command="pass", iterPeriod=1)] + O.engines[3:]

    def apart():
        for k in (1, 2):
            O.bodies[O.bodies.append(utils.sphere((k, 0, 0), 0.01, material=FrictMat()))].groupMask = k

    refused("O.trackEnergy = False", track)
    O.trackEnergy = False
    refused("body 9 is aspherical", aspherical)
    refused("PyRunner between", between)
    refused("would with the common bit", apart)


def test_changes_during_the_run_are_refused():
    def alive():
        integrator().dead = False

    def another():
        O.engines = O.engines[:-1] + [NewtonIntegrator()]

    def masked():
        integrator().mask = 1

    def track():
        O.trackEnergy = True

    for change, text in ((alive, "would move twice"), (another, "another NewtonIntegrator"), (masked, "would move twice"), (track, "trackEnergy")):
        breaking()
        bridge.take_over(motion=True)
        steps(3)
        change()
        for call in (lambda: O.run(5, True), lambda: steps(17)):
            with raises(RuntimeError, text):
                call()
        O.trackEnergy = False
    # Within a step, the bodies would move twice.
    import builtins

    breaking()
    builtins.bonded = bridge.take_over(motion=True)
    O.engines = O.engines + [PyRunner(command="bonded.remove()", iterPeriod=1, initRun=True)]
    with raises(RuntimeError, "within a step"):
        O.step()
    del builtins.bonded


main(globals())
