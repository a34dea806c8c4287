"""The bonded engine without headers in stock YADE, with any number of threads."""

import os
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, on_two_threads, on_two_threads_only, raises
from own_run import TABLES, alone, difference, in_yade
from yade import utils

import concordem
import concordem.yade as bridge
from concordem import YadeError

WORK = os.environ.get("BRIDGE_WORK") or tempfile.mkdtemp()
TENSION = dict(rate=3.0)


def steps(count):
    for _ in range(count):
        O.step()


def engine_from_one_thread(**options):
    """The engine in a scene whose history does not depend on YADE's threads: right after bonding."""
    concrete(**TENSION)
    return bridge.take_over(**options)


@on_two_threads
def test_it_equals_yade_to_rounding():
    """Until the peak (step 200 at this rate, tests/physics/yade_trajectory.rs); with two threads YADE's own sums differ from
    run to run by as much."""
    concrete(**TENSION)
    steps(100)
    x = positions()
    engine = bridge.take_over()
    assert engine.bond_count == 6595 and len(O.interactions.own) == 0
    steps(100)
    ours = positions()
    assert len(O.interactions.own) == 0, "YADE's collider leaves the bodies to us"
    concrete(**TENSION)
    steps(200)
    moved = abs(positions() - np.array(packing())[:, :3]).max()
    different = abs(ours - positions()).max() / moved
    print("engine against YADE after 100 of its steps: %.1e" % different)
    # Measured 1e-12 on one thread: sums in another order.
    assert different < 1e-9
    assert abs(ours - x).max() > 0.1 * moved


@on_two_threads
def test_bits_do_not_depend_on_threads():
    """Starts from a saved scene, because YADE's earlier sums depend on its threads. run.sh runs one thread first; the other runs start
    from its files and compare with them."""
    path, note = os.path.join(WORK, "start.yade.gz"), os.path.join(WORK, "hash")
    if O.numThreads == 1 or not os.path.exists(path):
        engine_from_one_thread(kinematics="finite", mode="thesis")
        bridge.save(path)
    hashes = []
    for threads in (1, 2, 3):
        (engine,) = bridge.load(path, threads=threads)
        steps(300)
        hashes.append(engine.solver.state_hash() + repr(positions().sum(axis=0).tolist()))
    assert hashes[0] == hashes[1] == hashes[2]
    if O.numThreads == 1:
        with open(note, "w") as file:
            file.write(hashes[0])
    elif os.path.exists(note):
        with open(note) as file:
            assert file.read() == hashes[0], "with -j%d other bits than with -j1" % O.numThreads


@on_two_threads_only
def test_waiting_threads_make_room():
    """Steps of 11,600 spheres take milliseconds, so before each one the spinning threads of YADE's loops are stopped; YADE's next loop
    starts new ones. With one thread of ours they keep running. Results are bitwise equal."""
    spheres = packing()
    height = max(s[2] + s[3] for s in spheres) - min(s[2] - s[3] for s in spheres)
    tower = [[x, y, z + k * height, r] for k in range(10) for x, y, z, r in spheres]
    path, hashes = os.path.join(WORK, "tower.yade.gz"), []
    concrete(spheres=tower, **TENSION)
    bridge.take_over()
    bridge.save(path)
    for threads in (1, 2):
        (engine,) = bridge.load(path, threads=threads)
        steps(3)
        before = set(os.listdir("/proc/self/task"))
        steps(3)
        begun = set(os.listdir("/proc/self/task")) - before
        assert len(begun) == (O.numThreads - 1 if threads > 1 else 0), (threads, begun)
        hashes.append(engine.solver.state_hash() + repr(positions().sum(axis=0).tolist()))
    assert hashes[0] == hashes[1]


def test_save_and_load_go_on_with_the_same_bits():
    engine = engine_from_one_thread()
    steps(150)
    path = os.path.join(WORK, "scene.yade.gz")
    files = bridge.save(path)
    assert len(files) == 2 and all(os.path.exists(file) for file in files)
    steps(50)
    x, state, bonds = positions(), engine.solver.state_hash(), engine.bond_count
    (engine,) = bridge.load(path)
    assert engine.bond_count == bonds and O.iter == 151
    steps(50)
    assert (positions() == x).all() and engine.solver.state_hash() == state
    # A scene loaded without its bonds stops with an error; so does one that has advanced since.
    O.load(path)
    os.rename(files[1], files[1] + ".away")
    with raises(YadeError, "are missing"):
        bridge.load(path)
    os.rename(files[1] + ".away", files[1])
    engine = bridge.load(path)[0]
    steps(1)
    with bridge._hooks.plain():
        O.save(path)
    with raises(YadeError, "does not belong"):
        bridge.load(path)


def test_a_scene_without_its_bonds_stops():
    from concordem.yade import _engine

    engine_from_one_thread()
    path = os.path.join(WORK, "bare.yade.gz")
    O.save(path)
    O.load(path)
    _engine._registered.clear()
    with raises(RuntimeError, "concordem.yade.load"):
        O.step()


def test_bodies_that_go_away_stop_the_run():
    for number in (100, 0):
        engine_from_one_thread()
        steps(3)
        # Behind the back of the bridge, which lets the engine follow.
        type(O.bodies).erase.__wrapped__(O.bodies, number)
        with raises(RuntimeError, "was deleted or replaced"):
            O.step()
        bridge._engine._registered["bonds"].remove()
        steps(2)
    # A new body has no effect, even if the list of bodies moves in memory.
    engine = engine_from_one_thread()
    steps(3)
    for k in range(3000):
        O.bodies.append(utils.sphere((1 + 0.01 * k, 0, 0), 1e-3, material=O.materials[0], color=(1, 1, 1)))
    steps(3)
    assert engine.bond_count == 6595
    O.bodies.erase(2000)
    steps(3)


def test_other_scenes_and_reset():
    engine = engine_from_one_thread()
    steps(2)
    done = engine.solver.steps
    O.switchScene()
    O.reset()
    assert engine.solver.steps == done
    # O.reset deleted the engine's scene, so a new engine may have the same name.
    other = engine_from_one_thread()
    steps(2)
    assert other.solver.steps == 2 and engine.solver.steps == done


def test_nan_and_errors_of_the_solver_are_exceptions():
    engine_from_one_thread()
    steps(2)
    O.bodies[5].state.vel = Vector3(math.nan, 0, 0)
    with raises(RuntimeError, "body 5"):
        O.step()


def test_engines_that_read_interactions_are_rejected():
    concrete(**TENSION)
    good = O.engines
    for engine, text in (
        (PDFEngine(iterPeriod=10), "forces()"),
        (LawTester(), "no replacement"),
        (ParallelEngine([ForceResetter(), PDFEngine()]), "PDFEngine"),
        (ParallelEngine([GlobalStiffnessTimeStepper()]), "take it out of the ParallelEngine"),
    ):
        O.engines = good + [engine]
        with raises(YadeError, text):
            bridge.take_over()
    O.engines = good + [VTKRecorder(recorders=["spheres", "velocity"], fileName=os.path.join(WORK, "v"), iterPeriod=5)]
    bridge.take_over()
    steps(6)
    assert any(name.startswith("v") and name.endswith(".vtu") for name in os.listdir(WORK))


def test_states_are_written_in_place_of_yades_updater():
    concrete(**TENSION)
    O.engines = O.engines + [CpmStateUpdater(iterPeriod=10)]
    bridge.take_over(update_states=20)
    assert O.engines[-1].dead
    steps(200)
    assert max(b.state.normDmg for b in O.bodies) > 0


@on_two_threads
def test_contacts_with_other_bodies_stay_yades():
    """A wall presses on the specimen: YADE computes only the wall's contacts."""
    concrete(**TENSION)
    low = min(b.state.pos[2] - b.shape.radius for b in O.bodies)
    wall = O.bodies.append(utils.wall((0, 0, low + 1e-5), 2, material=O.materials[0], color=(1, 1, 1)))
    O.engines[1].boundDispatcher.functors = O.engines[1].boundDispatcher.functors + [Bo1_Wall_Aabb()]
    O.engines[2].geomDispatcher.functors = O.engines[2].geomDispatcher.functors + [Ig2_Wall_Sphere_ScGeom()]
    steps(20)
    assert any(wall in (i.id1, i.id2) for i in O.interactions if i.isReal)
    engine = bridge.take_over()
    assert engine.bond_count == 6595
    for _ in range(10):
        steps(10)
        assert all(wall in (i.id1, i.id2) for i in O.interactions.own)
    assert any(i.isReal for i in O.interactions.own)


def test_breakage_goes_on_in_the_engine():
    concrete(rate=40.0, law=dict(omegaThreshold=0.99))
    engine = bridge.take_over(kinematics="finite", mode="thesis", update_states=100)
    steps(1000)
    assert engine.broken > 100 and engine.bond_count == 6595 - engine.broken
    assert sum(b.state.numBrokenCohesive for b in O.bodies) > 100
    tables = engine.contacts()
    assert len(tables["cpm"]) == engine.bond_count and set(tables) == {"cpm", "unbonded"}
    assert len(O.interactions.own) == 0


def test_beams_and_walls_in_one_scene():
    """A cantilever of cohesive beams falls on a facet: our engine computes the beams, YADE the contact with the facet."""
    O.reset()
    m = FrictMat(young=1e7, poisson=0.3, frictionAngle=0.5, density=2000)
    O.materials.append(m)
    for k in range(10):
        O.bodies.append(utils.sphere((0.2 * k, 0, 0.3), 0.1, material=m, color=(1, 1, 1)))
    O.bodies.append(utils.facet([(-9, -9, 0), (9, -9, 0), (0, 18, 0)], material=m, color=(1, 1, 1)))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=0.01),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(gravity=(0, 0, -9.81), damping=0.3),
    ]
    O.bodies[0].state.blockedDOFs = "xyzXYZ"
    O.dt = 1e-4
    tables = dict(
        material={"name": "rod", "density": 2000, "cohesive_beam": {"young": 2e6, "poisson": 0.3, "radius_ratio": 0.5}},
        bonds={"law": "cohesive_beam", "interaction_ratio": 1.05},
        contacts={"law": "none"},
    )
    with raises(YadeError, "for stable bonds"):
        O.dt = 1.0
        bridge.bond(**tables)
    O.dt = 1e-4
    with raises(YadeError, "not a sphere"):
        bridge.bond(ids=[0, 10], **tables)
    engine = bridge.bond(**tables)
    assert engine.bond_count == 9
    # Ends 1,000 steps after the tip has come to rest.
    steps(9000)
    z = [O.bodies[k].state.pos[2] for k in range(10)]
    assert z[0] == 0.3 > z[1] > z[2] > z[3] > 0.1, z
    assert abs(z[9] - 0.1) < 0.01, "the tip lies on the facet"
    assert any(O.bodies[k].state.rot().norm() > 0.05 for k in range(10)), "beams turn their bodies"
    touching = list(O.interactions.own)
    assert touching and all(10 in (i.id1, i.id2) for i in touching)
    x, contacts = engine.forces()
    assert len(contacts.pair) == 9 and np.abs(contacts.moment).max() > 0


def same_as_alone(kind):
    """The engine follows our own run of the same specimen, through fracture. The forces of equal motion are the same bits;
    YADE's integrator rounds otherwise (a few 1e-16 of each kick), which a breaking specimen enlarges (measured: beams 2e-11 of the
    way, deformable particles 2e-12)."""
    simulation = alone(kind)
    in_yade(simulation)
    engine = bridge.bond(**TABLES[kind])
    assert engine.bond_count == simulation.state.bond_count == 3493
    for _ in range(6):
        steps(100)
        simulation.step(100)
        assert engine.bond_count == simulation.state.bond_count
    worst, way = difference(simulation)
    print("%s: after 600 steps and %d broken bonds %.1e m of %.1e m" % (kind, engine.broken, worst, way))
    assert engine.broken > 100 and worst < 5e-10 * way


def test_beams_follow_our_own_run():
    same_as_alone("beams")


def test_deformable_particles_follow_our_own_run():
    """Reactions at the ends strain their particles, so the engine must read YADE's blockedDOFs."""
    same_as_alone("deformable")


def test_heated_bonds_follow_our_own_run():
    """Heat flows along the bonds of YADE's bodies, bonds expand, and dashpots heat their particles, as in our own run, also after a
    restart. Temperatures see the motion, which YADE's integrator rounds otherwise, only through the heat of dashpots."""
    TABLES["heated"] = dict(
        material={
            "name": "glass",
            "density": 2500,
            "linear_bond": {"normal_stiffness": 2e6, "shear_stiffness": 4e5, "damping_ratio": 0.05},
            "thermal": {"specific_heat": 800, "conductivity": 1, "expansion": 1e-5},
        },
        bonds={"law": "linear_bond", "interaction_ratio": 1.1},
        contacts={"law": "linear_bond"},
        set=[{"name": "hot", "selection": {"kind": "ids", "ids": list(range(200))}}],
        heat={
            "model": "disordered", "pairs": "bonds", "temperature": 300, "time_factor": 1e5, "dissipation": True,
            "source": [{"set": "hot", "power": 5.0}],
        },
    )
    simulation = alone("heated", rate=3.0)
    in_yade(simulation)
    engine = bridge.bond(**TABLES.pop("heated"))
    steps(200)
    path = os.path.join(WORK, "heated.yade.gz")
    bridge.save(path)
    (engine,) = bridge.load(path)
    steps(200)
    simulation.step(400)
    ids, theirs = engine.temperatures()
    state = simulation.state
    found, ours = np.empty(len(ids)), np.empty(len(ids))
    found[ids], ours[state.ids] = theirs, state.temperatures
    worst, warmed = abs(found - ours).max(), abs(ours - 300)
    print("heated: %.1e K of %.1e K" % (worst, warmed.max()))
    assert np.ptp(ours) > 1e-2 and worst < 1e-9 * warmed.max(), (worst, warmed.max())
    worst, way = difference(simulation)
    assert worst < 5e-10 * way, (worst, way)


def test_beams_and_deformable_particles_are_saved():
    for kind in TABLES:
        in_yade(alone(kind))
        engine = bridge.bond(**TABLES[kind])
        steps(300)
        path = os.path.join(WORK, kind + ".yade.gz")
        bridge.save(path)
        steps(100)
        x, state, broken = positions(), engine.solver.state_hash(), engine.broken
        (engine,) = bridge.load(path)
        steps(100)
        assert (positions() == x).all() and engine.solver.state_hash() == state and engine.broken == broken > 0


def test_uniaxial_strainer_loads_the_engine():
    """YADE's UniaxialStrainer: the force at its ends comes from our bonds."""
    ends = concrete(rate=0.0)
    O.engines = O.engines + [
        UniaxialStrainer(
            posIds=ends[1], negIds=ends[0], axis=2, strainRate=2.0, blockDisplacements=True, blockRotations=True,
            crossSectionArea=22e-3 * 22e-3, label="strainer",
        )
    ]
    engine = bridge.take_over()
    steps(200)
    strainer = O.engines[-1]
    modulus = strainer.avgStress / strainer.strain
    print("modulus by the strainer: %.3e Pa" % modulus)
    # The same run with YADE's bonds.
    ends = concrete(rate=0.0)
    O.engines = O.engines + [
        UniaxialStrainer(
            posIds=ends[1], negIds=ends[0], axis=2, strainRate=2.0, blockDisplacements=True, blockRotations=True,
            crossSectionArea=22e-3 * 22e-3,
        )
    ]
    steps(200)
    theirs = O.engines[-1].avgStress / O.engines[-1].strain
    assert abs(modulus / theirs - 1) < 1e-6 and engine.broken == 0


@on_two_threads
def test_run_in_the_background():
    engine = engine_from_one_thread()
    O.run(200)
    with raises(YadeError, "in the background"):
        bridge.snapshot()
    O.wait()
    assert engine.solver.steps == 200 and O.iter == 201
    bridge.snapshot()


def test_removing_gives_the_bodies_back():
    engine = engine_from_one_thread()
    steps(3)
    engine.remove()
    assert all(type(e).__name__ != "PyRunner" for e in O.engines)
    assert O.engines[1].avoidSelfInteractionMask == 0 and O.bodies[3].groupMask == 1
    steps(3)
    assert len(O.interactions) > 0, "YADE's collider sees the bodies again"
    assert engine.solver.steps == 3


def test_a_scene_that_ended_is_never_taken_for_a_new_one():
    """YADE may put a new scene, its container, and its bodies where the former ones were. Its script sets engines as if nothing had been."""

    O.reset()

    def pair():
        O.bodies.append([sphere((0, 0, z), 1e-3, material=O.materials.append(CpmMat(young=1e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=30))) for z in (0, 1.9e-3)])
        O.engines = [
            ForceResetter(),
            InsertionSortCollider([Bo1_Sphere_Aabb()]),
            InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=2)], [Law2_ScGeom_CpmPhys_Cpm()]),
            NewtonIntegrator(),
        ]
        O.dt = 1e-9
        steps(2)

    # A reset that we do not see, as in YADE's window.
    unseen = type(O).reset.__wrapped__.__get__(O)
    for way in (unseen, O.reset, O.resetThisScene):
        for _ in range(40):
            pair()
            engine = bridge.take_over()
            assert bridge.engines() == [engine]
            way()
            # The former container still is at its address, so that no other one can be, or we have forgotten it.
            assert len(engine._held) == 2 if way is unseen else engine._held is None
            assert not bridge.engines()
            pair()
            assert not bridge.engines()
            O.reset()


def test_nothing_leaks():
    in_yade(alone("beams"))
    bridge.bond(**TABLES["beams"])
    path = os.path.join(WORK, "leak.yade.gz")
    bridge.save(path)
    pages = []
    for cycle in range(50):
        bridge.load(path)
        steps(1)
        O.reset()
        if cycle in (9, 49):
            with open("/proc/self/statm") as file:
                pages.append(int(file.read().split()[1]))
    # A leak of 3,493 bonds of 200 bytes and 1,160 bodies per cycle would be 10,000 pages in 40 cycles.
    print("pages after 10 and after 50 cycles of load and reset:", pages)
    assert pages[1] - pages[0] < 1000


main(globals())
