"""Methods of the native bonded engine that read a copy of its bonds, in stock YADE: as those of the engine without headers."""

import glob
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, raises
from own_run import TABLES, alone, in_yade, toml

import concordem.yade as bridge
from concordem import YadeError

WORK = os.environ.get("BRIDGE_WORK", "/tmp")
bridge.load_native()


def steps(count):
    for _ in range(count):
        O.step()


def taken_over(native, after=1, update_states=0):
    """Half of the breaking specimen with one of the two engines, taken over after so many steps of YADE."""
    concrete(rate=40.0, spheres=half(), law=dict(omegaThreshold=0.99))
    steps(after)
    return taken_over_now(native, update_states)


def taken_over_now(native, update_states=0):
    if not native:
        return bridge.take_over(update_states=update_states)
    e = BondedEngine_Rust(updateStates=update_states)
    O.engines = O.engines[:3] + [e] + O.engines[3:]
    e.takeOver()
    return O.engines[3]


def motion():
    return np.array([(*b.state.pos, *b.state.vel, *b.state.angVel) for b in O.bodies])


def attributes():
    """Attributes of all interactions that the next steps depend on, by pair."""
    found = {}
    for i in O.interactions:
        p, g = i.phys, i.geom
        found[i.id1, i.id2] = (
            *(p.kappaD, p.omega, p.epsN, p.epsNPl, *p.epsT, *p.epsTPl, p.isCohesive, p.refLength, p.crossSection, p.refPD, p.kn, p.ks),
            *(*p.normalForce, *p.shearForce, g.penetrationDepth, *g.normal),
        )
    return found


def test_contacts_and_forces():
    """The same bonds with the same bits."""
    found = []
    for native in (False, True):
        engine = taken_over(native)
        steps(600)
        tables = engine.contacts()
        x, contacts = engine.forces()
        if not native:
            x, contacts = engine.solver.forces(False)
        found.append((motion(), tables, x, contacts.force, contacts.pair))
    one, two = found
    assert (one[0] == two[0]).all() and set(one[1]) == set(two[1]) == {"cpm", "unbonded"}
    for name, table in one[1].items():
        assert table.tobytes() == two[1][name].tobytes(), name
    assert len(one[1]["cpm"]) < BONDS_OF_HALF and len(one[1]["unbonded"]) > 0
    for k in (2, 3, 4):
        assert (one[k] == two[k]).all()


def lost():
    return [b.state.numBrokenCohesive for b in O.bodies]


def test_losses_before_the_take_over_count():
    """A take-over after bonds have broken: both engines go on with YADE's counts and damage, and give them back."""
    found = []
    for native in (None, False, True):
        concrete(rate=40.0, spheres=half(), law=dict(omegaThreshold=0.99))
        O.engines = O.engines + [CpmStateUpdater(iterPeriod=1)]
        steps(120)
        before = lost()
        engine = None if native is None else taken_over_now(native, update_states=1)
        steps(20)
        after, damage = lost(), [b.state.normDmg for b in O.bodies]
        if engine is not None:
            broken = engine.broken
            engine.give_back()
            assert lost() == after and broken < sum(after) / 2
        found.append((before, after, damage))
    assert found[0][0] == found[1][0] == found[2][0] and sum(found[0][0]) > 200
    yades, free, native = (one[1] for one in found)
    assert yades == free == native and sum(yades) > sum(found[0][0])
    # Sums in another order, 20 steps after the take-over: as in test_bonds.py.
    assert abs(np.array(found[1][2]) - found[0][2]).max() < 1e-8 and found[1][2] == found[2][2]


def test_bonds_are_given_back():
    """YADE goes on from the same interactions, with the same motion."""
    found = []
    for native in (False, True):
        engine = taken_over(native)
        steps(600)
        broken = engine.broken
        counts = engine.give_back()
        assert counts["made"] == counts["written"] == len(O.interactions) > 2500 and broken > 20
        given = lost()
        after = attributes()
        steps(20)
        found.append((after, given, motion(), counts))
        assert O.engines[1].avoidSelfInteractionMask == 0 and all(b.groupMask == 1 for b in O.bodies)
    assert O.engines[3].dead and O.engines[3].bondCount == 0
    one, two = found
    assert one[0] == two[0] and one[1] == two[1] and one[3] == two[3]
    # The order of YADE's sums may differ.
    worst, way = abs(one[2] - two[2])[:, :3].max(), abs(one[2][:, :3] - np.array(half())[:, :3]).max()
    print("given back: %.1e m of %.1e m" % (worst, way))
    assert worst < 1e-9 * way


def test_bonds_are_shown():
    """A step is refused meanwhile; afterwards the run goes on with the same bits."""
    engine = taken_over(True)
    steps(300)
    straight = None
    for shown in (False, True):
        engine = taken_over(True)
        steps(300)
        if shown:
            with engine.interactions():
                assert len(O.interactions) == sum(map(len, engine.contacts().values()))
                pull = sum(i.phys.normalForce.norm() for i in O.interactions)
                with engine.interactions():
                    pass
                for call in (O.step, lambda: O.run(3, True)):
                    with raises(YadeError, "shown as interactions"):
                        call()
            assert pull > 0 and len(O.interactions.own) == 0
        steps(100)
        straight = motion() if straight is None else straight
    assert (motion() == straight).all()


def test_bonds_of_a_scenario_are_shown_not_given_back():
    in_yade(alone("beams"))
    O.engines = O.engines[:3] + [BondedEngine_Rust(scenario=toml("beams"))] + O.engines[3:]
    engine = O.engines[3]
    engine.takeOver()
    steps(50)
    force = np.linalg.norm(engine.forces()[1].force, axis=1)
    with engine.interactions():
        shown = [(i.phys.normalForce + i.phys.shearForce).norm() for i in O.interactions]
    assert len(shown) == engine.bondCount and abs(sum(shown) / force.sum() - 1) < 1e-12
    with raises(YadeError, "stock YADE does not have"):
        engine.give_back()
    steps(5)
    assert engine.bondCount == 3493


HEATED = """
[[material]]
name = "glass"
density = 2500
linear_bond = { normal_stiffness = 2e6, shear_stiffness = 4e5, damping_ratio = 0.05 }
thermal = { specific_heat = 800, conductivity = 1, expansion = 1e-5 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.1
[contacts]
law = "linear_bond"
[[set]]
name = "hot"
selection = { kind = "ids", ids = [0, 1, 2, 3] }
[heat]
model = "disordered"
pairs = "bonds"
temperature = 300
time_factor = 1e5
[[heat.source]]
set = "hot"
power = 5.0
"""


def test_temperatures():
    """Bitwise those of the engine without headers, whose own test compares them with our solver."""
    found = []
    for native in (False, True):
        in_yade(alone("beams"))
        if native:
            O.engines = O.engines[:3] + [BondedEngine_Rust(scenario=HEATED)] + O.engines[3:]
            engine = O.engines[3]
            engine.takeOver()
        else:
            engine = bridge.bond(
                material={
                    "name": "glass",
                    "density": 2500,
                    "linear_bond": {"normal_stiffness": 2e6, "shear_stiffness": 4e5, "damping_ratio": 0.05},
                    "thermal": {"specific_heat": 800, "conductivity": 1, "expansion": 1e-5},
                },
                bonds={"law": "linear_bond", "interaction_ratio": 1.1},
                contacts={"law": "linear_bond"},
                set=[{"name": "hot", "selection": {"kind": "ids", "ids": [0, 1, 2, 3]}}],
                heat={
                    "model": "disordered", "pairs": "bonds", "temperature": 300, "time_factor": 1e5,
                    "source": [{"set": "hot", "power": 5.0}],
                },
            )
        steps(100)
        ids, temperatures = engine.temperatures()
        found.append(dict(zip(ids.tolist(), temperatures.tolist())))
    assert found[0] == found[1] and max(found[0].values()) > 300 + 1e-3
    engine = taken_over(True)
    with raises(ValueError, "no heat flows"):
        engine.temperatures()


def test_files_for_paraview():
    found = []
    for native in (False, True):
        engine = taken_over(native)
        steps(200)
        prefix = os.path.join(WORK, "native" if native else "python")
        texts = []
        for path in engine.write_vtk(prefix):
            with open(path, "rb") as file:
                texts.append(file.read())
        found.append(texts)
    assert found[0] == found[1] and len(found[0]) == 2
    assert glob.glob(os.path.join(WORK, "native-intrs.*.vtp"))


def test_a_dead_loop_gives_no_settings():
    """A dead InteractionLoop behind the one that acts has another law; both engines read the active one."""
    for native in (False, True):
        concrete(spheres=half())
        steps(2)
        other = InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=2)],
            [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=-1)],
            [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.1)],
        )
        other.dead = True
        O.engines = O.engines + [other]
        engine = taken_over_now(native)
        steps(1)
        assert (engine.bondCount if native else engine.bond_count) == BONDS_OF_HALF


def test_refusals():
    e = BondedEngine_Rust()
    concrete()
    for call in (e.contacts, e.temperatures, e.give_back):
        with raises(YadeError, "there are no bonds yet"):
            call()
    import builtins

    builtins.bonded = taken_over(True)
    O.engines = O.engines + [PyRunner(command="bonded.give_back()", iterPeriod=1, initRun=True)]
    with raises(RuntimeError, "within a step"):
        O.step()
    del builtins.bonded


main(globals())
