"""Bonds of the bonded engine as interactions of YADE, given back or shown, and in files for ParaView, in stock YADE."""
# threads: 1

import base64
import glob
import os
import sys
import tempfile
import xml.etree.ElementTree

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, raises
from yade import utils

import concordem.yade as bridge
from concordem import YadeError

WORK = os.environ.get("BRIDGE_WORK") or tempfile.mkdtemp()
VOLUME = 22e-3 * 22e-3 * 42e-3


def steps(count):
    for _ in range(count):
        O.step()


def array(matrix):
    return np.array([[matrix[i, j] for j in range(3)] for i in range(3)])


def everything():
    """Attributes of all interactions that the next steps depend on, by pair."""
    found = {}
    for i in O.interactions:
        p, g = i.phys, i.geom
        found[i.id1, i.id2] = (
            *(p.kappaD, p.omega, p.epsN, p.epsNPl, *p.epsT, *p.epsTPl, p.isCohesive, p.refLength, p.crossSection, p.refPD, p.kn, p.ks),
            *(p.E, p.G, p.epsCrackOnset, p.epsFracture, p.relResidualStrength, *p.normalForce, *p.shearForce),
            *(g.penetrationDepth, *g.normal, g.refR1, g.refR2, *i.cellDist),
        )
    return found


def elastic_energy():
    """Elastic energy of the springs of all interactions, J. Damage softens tension only."""

    def of(physics, normal):
        tensile = physics.normalForce.dot(normal) < 0
        softened = 1 - physics.omega if tensile else 1
        return 0.5 * (physics.normalForce.squaredNorm() / physics.kn / max(softened, 1e-9) + physics.shearForce.squaredNorm() / physics.ks)

    return sum(of(i.phys, i.geom.normal) for i in O.interactions)


def worst(one, two):
    """Largest difference of each attribute over its largest value."""
    assert set(one) == set(two), "the same pairs interact"
    a, b = (np.array([side[k] for k in sorted(side)], float) for side in (one, two))
    scale = np.abs(a).max(axis=0)
    return (np.abs(a - b).max(axis=0) / np.where(scale > 0, scale, 1)).max()


def test_what_is_taken_and_given_back_is_the_same():
    """Without a step in between, every attribute comes back, and with it energy and stress."""
    concrete(rate=4.0, spheres=half())
    steps(250)
    before, energy, stress = everything(), elastic_energy(), array(utils.getStress(VOLUME))
    assert sum(row[1] > 0 for row in before.values()) > 100, "some bonds are damaged"
    counts = bridge.take_over().give_back()
    assert counts == {"erased": 0, "made": len(before), "written": len(before)}
    assert bridge.engines() == [] and not any("concordem" in getattr(e, "command", "") for e in O.engines)
    # Sums and quotients are formed in another order: a few units in the last place of each attribute's largest value.
    different = worst(before, everything())
    print("taken and given back: %.1e" % different)
    assert different < 1e-12
    assert abs(elastic_energy() - energy) < 1e-12 * energy
    assert abs(array(utils.getStress(VOLUME)) - stress).max() < 1e-12 * abs(stress).max()


def window(between):
    """400 steps of YADE, 100 of `between`, 100 of YADE."""
    concrete(rate=4.0, spheres=half())
    steps(400)
    between()
    steps(100)
    return positions(), everything()


def in_the_engine():
    engine = bridge.take_over()
    steps(100)
    engine.give_back()


def one_bit():
    """YADE alone, with one coordinate of one sphere changed by one unit in the last place."""
    state = O.bodies[500].state
    state.pos = Vector3(math.nextafter(state.pos[0], 1.0), state.pos[1], state.pos[2])
    steps(100)


def test_yade_goes_on_as_if_it_had_never_been_away():
    """Allowed is a hundred times what one bit of one coordinate of 545 spheres makes in YADE itself, as for the hand-over."""
    (x, a), (y, b), (z, c) = window(lambda: steps(100)), window(in_the_engine), window(one_bit)
    moved = abs(x - np.array(half())[:, :3]).max()
    ours, bit = abs(x - y).max() / moved, abs(x - z).max() / moved
    print("positions after the engine: %.1e; after one bit in YADE: %.1e; attributes %.1e, %.1e" % (ours, bit, worst(a, b), worst(a, c)))
    assert sum(row[1] > 0 for row in a.values()) > 100
    assert ours < 100 * bit and worst(a, b) < 100 * worst(a, c)


def test_broken_bonds_and_new_contacts_are_given_back():
    concrete(rate=-20.0, spheres=half(), law=dict(epsSoft=-3e-4, relKnSoft=0.3, omegaThreshold=0.99))
    steps(1200)
    lost = sum(b.state.numBrokenCohesive for b in O.bodies)
    engine = bridge.take_over()
    steps(1500)
    broken, table = engine.broken, engine.contacts()
    assert broken > 0 and len(table["unbonded"]) > 0
    counts = engine.give_back()
    assert counts["made"] == len(table["cpm"]) + len(table["unbonded"])
    loose = [i for i in O.interactions if not i.phys.isCohesive]
    assert len(loose) == len(table["unbonded"]) and all(i.phys.kn > 0 and np.isfinite(i.phys.refLength) for i in loose)
    # Each bond counts at both of its ends, those that YADE broke before the take-over included.
    assert sum(b.state.numBrokenCohesive for b in O.bodies) >= lost + 2 * broken
    before = {(i.id1, i.id2): i.phys.refLength for i in loose}
    steps(1)
    after = {(i.id1, i.id2): i.phys.refLength for i in O.interactions if not i.phys.isCohesive}
    kept = [k for k in before if k in after]
    assert kept and all(before[k] == after[k] for k in kept), "the law did not take them for fresh ones"
    # Stop the driven ends, so that no work is done. Until energy is lost, sums of velocities and forces half a step apart oscillate.
    for b in O.bodies:
        if b.state.blockedDOFs:
            b.state.vel = Vector3.Zero
    energy = [elastic_energy() + utils.kineticEnergy()]
    for _ in range(20):
        steps(10)
        energy.append(elastic_energy() + utils.kineticEnergy())
    print("energy after the hand-back, of that before: " + " ".join("%.3f" % (e / energy[0]) for e in energy[::4]))
    assert max(energy) < 1.01 * energy[0], "no energy comes from the hand-back"


def test_periodic_images_come_back():
    import random

    O.reset()
    O.periodic = True
    O.cell.setBox(0.02, 0.02, 0.02)
    m = CpmMat(**MATERIAL)
    O.materials.append(m)
    rng = random.Random(3)
    for place in np.ndindex(6, 6, 6):
        x = [0.02 / 6 * (n + 0.5 + 0.1 * (rng.random() - 0.5)) for n in place]
        O.bodies.append(utils.sphere(x, 0.02 / 12, material=m, color=(1, 1, 1)))
    bound, geometry = Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5), Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([bound], verletDist=1e-4, allowBiggerThanPeriod=True),
        InteractionLoop([geometry], [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)], [Law2_ScGeom_CpmPhys_Cpm()]),
        NewtonIntegrator(damping=0.2),
    ]
    O.dt = 1e-7
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.0
    O.cell.velGrad = type(O.cell.velGrad)(0, 0.3, 0, 0, 0, 0, 0, 0, 5.0)
    steps(200)
    before = everything()
    assert any(row[-3:] != (0, 0, 0) for row in before.values())
    with bridge.take_over().interactions():
        assert worst(before, everything()) < 1e-12
    (engine,) = bridge.engines()
    engine.give_back()
    assert worst(before, everything()) < 1e-12
    steps(100)
    assert np.isfinite(positions()).all() and len(everything()) == len(before)


def test_bonds_are_shown_to_scripts():
    """Within the block, scripts, VTKRecorder, and YADE's functions see what YADE itself would have; afterwards nothing has changed."""
    concrete(rate=4.0, spheres=half())
    steps(250)
    before, fabric, stress = everything(), array(utils.fabricTensor()[0]), array(utils.getStress(VOLUME))
    engine = bridge.take_over()
    state = engine.solver.state_hash()
    # Without `multiblock`, VTKRecorder of this YADE leaves the number of pieces of the interactions undefined: some runs crash in VTK, also
    # without a bonded engine.
    recorder = VTKRecorder(fileName=os.path.join(WORK, "shown-"), recorders=["spheres", "intr", "cpm"], dead=True, multiblock=True)
    O.engines = O.engines + [recorder]
    for _ in range(2):
        with engine.interactions():
            assert worst(before, everything()) < 1e-12
            assert abs(array(utils.fabricTensor()[0]) - fabric).max() < 1e-12
            assert abs(array(utils.getStress(VOLUME)) - stress).max() < 1e-12 * abs(stress).max(), "not added twice"
            recorder()
            with raises(YadeError, "second time"):
                O.step()
        assert len(O.interactions.own) == 0
    # Spheres and interactions.
    written = glob.glob(os.path.join(WORK, "shown-*", "*.vt[pu]"))
    assert len(written) == 2 and min(map(os.path.getsize, written)) > 50_000, written
    assert engine.solver.state_hash() == state
    steps(100)
    ours = positions()
    concrete(rate=4.0, spheres=half())
    steps(250)
    bridge.take_over()
    steps(100)
    assert (positions() == ours).all(), "the block has no effect on the run"


def test_bonds_are_given_back_in_a_step():
    """By a script behind the engine; one before it would lose the forces of the step."""
    import builtins

    def scene(behind):
        concrete(rate=4.0, spheres=half())
        steps(100)
        builtins.engine = bridge.take_over()
        runner = PyRunner(command="engine.give_back() if engine.attached and O.iter >= 110 else None", iterPeriod=1)
        engines = O.engines
        O.engines = engines + [runner] if behind else engines[:1] + [runner] + engines[1:]
        O.run(50, True)

    scene(True)
    ours = positions()
    assert O.iter == 151 and bridge.engines() == [] and len(O.interactions) > 2900
    concrete(rate=4.0, spheres=half())
    steps(150)
    # Rounding, amplified over 50 steps; the specimen has moved by 1e-5 m.
    assert abs(positions() - ours).max() < 1e-12
    # An error of the script, not of the engine, so YADE reports it.
    with raises(RuntimeError, "has not acted in this step"):
        scene(False)


def test_bonds_are_shown_in_a_step():
    import builtins

    concrete(rate=4.0, spheres=half())
    steps(100)
    builtins.engine, builtins.seen = bridge.take_over(), []

    def look():
        with engine.interactions():
            seen.append(sum(1 for i in O.interactions))

    builtins.look = look
    O.engines = O.engines + [PyRunner(command="look()", iterPeriod=10)]
    O.run(40, True)
    assert len(builtins.seen) == 4 and min(builtins.seen) > 2900 and len(O.interactions.own) == 0


def beam():
    """A row of spheres with beams between them, on a wall; YADE's functors make FrictPhys of them."""
    O.reset()
    m = O.materials.append(FrictMat(young=1e9, poisson=0.3, frictionAngle=0.5, density=2500))
    for k in range(12):
        O.bodies.append(utils.sphere((0.0019 * k, 0.0001 * (k % 3), 0.001), 1e-3, material=m, color=(1, 1, 1)))
    O.bodies.append(utils.wall((0, 0, 0), 2, material=m, color=(1, 1, 1)))
    O.bodies[0].state.blockedDOFs = "xyzXYZ"
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=1e-4),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0.1, gravity=(0, 5, -9.81)),
    ]
    O.dt = 1e-7
    law = {"young": "1 GPa", "poisson": 0.3, "radius_ratio": 0.6, "tensile_strength": "60 MPa"}
    return bridge.bond(
        material={"name": "glass", "density": 2500, "cohesive_beam": law},
        bonds={"law": "cohesive_beam", "interaction_ratio": 1.05},
        ids=range(12),
    )


def test_bonds_of_other_laws_are_shown_with_their_forces():
    engine = beam()
    steps(2000)
    net = np.zeros((12, 3))
    with engine.interactions():
        found = [i for i in O.interactions if i.id1 < 12 and i.id2 < 12]
        assert len(found) == engine.bond_count == 11
        for i in found:
            force = np.array(i.phys.normalForce + i.phys.shearForce)
            net[i.id2] += force
            net[i.id1] -= force
            assert abs(i.phys.shearForce.dot(i.geom.normal)) <= 1e-12 * i.phys.shearForce.norm() + 1e-20
        walls = [i for i in O.interactions if i.id2 == 12 or i.id1 == 12]
        assert walls and all(type(i.phys).__name__ == "FrictPhys" for i in walls)
    assert abs(net).max() > 1e-6
    # The sums per particle are those that the engine gives to YADE.
    ours = dict(zip(engine.solver.bodies()["id"].tolist(), engine.solver.net_forces()[0]))
    assert max(abs(net[k] - ours[k]).max() for k in range(12)) < 1e-12 * abs(net).max()
    with raises(YadeError, "interactions()"):
        engine.give_back()
    steps(10)
    assert engine.bond_count == 11 and any(12 in (i.id1, i.id2) for i in O.interactions), "the wall still acts"


def read(path):
    """The arrays of a file of VTK's XML format."""
    kinds = {"Float64": "<f8", "Int64": "<i8", "UInt8": "<u1"}
    found = {}
    for one in xml.etree.ElementTree.parse(path).iter("DataArray"):
        text, first = one.text.strip(), 12  # 8 bytes are 12 characters
        size = int(np.frombuffer(base64.b64decode(text[:first]), "<u8")[0])
        data = base64.b64decode(text[first:])
        assert len(data) == size
        values = np.frombuffer(data, kinds[one.get("type")])
        width = int(one.get("NumberOfComponents"))
        found[one.get("Name") or "points"] = values.reshape(-1, width) if width > 1 else values
    return found


def test_bonds_are_written_for_paraview():
    def row(i):
        length = (O.bodies[i.id2].state.pos - O.bodies[i.id1].state.pos).norm()
        return *(i.phys.normalForce + i.phys.shearForce), i.phys.omega, length

    concrete(rate=4.0, spheres=half())
    steps(251)
    wanted = {(i.id1, i.id2): row(i) for i in O.interactions}
    concrete(rate=4.0, spheres=half())
    steps(250)
    engine = bridge.take_over()
    steps(1)
    contacts, spheres = (read(path) for path in engine.write_vtk(os.path.join(WORK, "written")))
    assert os.path.exists(os.path.join(WORK, "written-intrs.%d.vtp" % O.iter))
    one, two = np.minimum(contacts["id1"], contacts["id2"]), np.maximum(contacts["id1"], contacts["id2"])
    rows = np.array([wanted[key] for key in zip(one.tolist(), two.tolist())])
    assert len(rows) == len(wanted)
    # YADE's shear force is not quite perpendicular to the normal, so the sum is compared; on the second body of the interaction.
    ends = contacts["points"].reshape(-1, 2, 3)
    normal = ends[:, 1] - ends[:, 0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    force = (contacts["forceN"][:, None] * normal + contacts["forceT"]) * np.where(contacts["id1"] == one, 1, -1)[:, None]
    for name, ours, theirs in (("force", force, rows[:, :3]), ("damage", contacts["damage"], rows[:, 3])):
        error = abs(ours - theirs).max() / abs(theirs).max()
        print("written %s: %.1e" % (name, error))
        # Strains of 1e-4 are differences of lengths.
        assert error < 1e-9, name
    assert abs(contacts["absForceT"] - np.linalg.norm(contacts["forceT"], axis=1)).max() < 1e-12 * contacts["absForceT"].max()
    # Lines are those of the last evaluation. Since then, spheres have moved by one step (6e-7 s), at speeds below 1 m/s.
    assert abs(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) - rows[:, 4]).max() < 1e-6
    assert abs(spheres["points"][np.argsort(spheres["id"])] - positions()).max() < 1e-6
    assert contacts["bonded"].all() and spheres["damage"].max() > 0.01
    try:
        import vtk
    except ImportError:
        print("vtk is not installed: the files were not read by it")
        return
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(os.path.join(WORK, "written-intrs.%d.vtp" % O.iter))
    reader.Update()
    assert reader.GetOutput().GetNumberOfCells() == len(wanted)


main(globals())
