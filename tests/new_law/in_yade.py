"""The new laws in stock YADE: `NEW_LAW_PULL=PULL.TOML NEW_LAW_OUT=OUT.JSON yade -n -x in_yade.py`. By the bonded engine; with
NEW_LAW_NATIVE set by the native functors, whose classes are generated from the laws."""
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from yade import *
from yade import utils
from yade.minieigenHP import Vector3

import concordem.yade as bridge
from two_particles import EVERY, Adhesion, Hinge

NATIVE = "NEW_LAW_NATIVE" in os.environ
if NATIVE:
    bridge.load_native()


def scene(spheres, motions, blocked, dt, material, maker=None, law=None):
    O.reset()
    m = O.materials.append(material)
    for (x, y, z, r), (v, w) in zip(spheres, motions):
        state = O.bodies[O.bodies.append(utils.sphere((x, y, z), r, material=m, color=(1, 1, 1)))].state
        state.vel, state.angVel, state.blockedDOFs = Vector3(*v), Vector3(*w), blocked
    O.dt = dt
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.01)]),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.01)],
            [maker or Ip2_FrictMat_FrictMat_FrictPhys()],
            [law or Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0),
    ]


def attributes(keys):
    """Keys of a scenario as attributes of YADE: normal_stiffness is normalStiffness."""
    camel = lambda key: key.split("_")[0] + "".join(word.capitalize() for word in key.split("_")[1:])
    return {camel(key): value for key, value in keys.items()}


def functors():
    loop = O.engines[2]
    return (loop.physDispatcher.functors[0], loop.lawDispatcher.functors[0]) if NATIVE else ()


def stopped_by(*functors):
    for functor in functors:
        assert functor.error == "", functor.error


def of_engine(engine):
    contacts = engine.forces()[1]
    assert contacts.pair.tolist() == [[0, 1]]
    return contacts.force[0].tolist() + contacts.moment[0].tolist()


def of_functor():
    (contact,) = [i for i in O.interactions if i.isReal]
    assert (contact.id1, contact.id2) == (0, 1)
    # Forces of YADE act on the second body.
    return list(-(contact.phys.normalForce + contact.phys.shearForce)) + list(contact.phys.moment)


def adhesion(case):
    motions = [([case.speed, 0, 0], [0, 0, 0]), ([0, 0, 0], [0, 0, 0])]
    if NATIVE:
        material = AdhesiveMat_Rust(density=case.density, **attributes(case.material))
        maker, law = Ip2_AdhesiveMat_AdhesiveMat_AdhesivePhys_Rust(), Law2_ScGeom_AdhesivePhys_Rust()
        scene(case.spheres, motions, "", case.dt, material, maker, law)
    else:
        scene(case.spheres, motions, "", case.dt, FrictMat(density=case.density))
        bridge.bond(material={"name": "powder", "density": case.density, "adhesive": case.material}, contacts={"law": "adhesive"})
    place = lambda: [list(O.bodies[k].state.pos) for k in (0, 1)]
    tension, positions = 0.0, [place()]
    for step in range(1, case.steps + 1):
        O.step()
        tension = max(tension, O.forces.f(0)[0])
        if step % EVERY == 0:
            positions.append(place())
    stopped_by(*functors())
    return dict(tension=tension, positions=positions)


def hinge(case, motion):
    spheres = [[0, 0, 0, case.radius], [case.length, 0, 0, case.radius]]
    if NATIVE:
        material = HingeMat_Rust(density=case.density, **attributes(case.material))
        maker, law = Ip2_HingeMat_HingeMat_HingePhys_Rust(cohesiveThresholdIter=1), Law2_ScGeom_HingePhys_Rust()
        scene(spheres, case.motions[motion], "xyzXYZ", case.dt, material, maker, law)
    else:
        scene(spheres, case.motions[motion], "xyzXYZ", case.dt, FrictMat(density=case.density))
        engine = bridge.bond(
            material={"name": "m", "density": case.density, "hinge": case.material}, bonds={"law": "hinge", "interaction_ratio": 1.01})
    rows = []
    for step in range(case.steps + 1):
        O.step()
        # The forces of this step are those of the positions at its beginning.
        if step and step % EVERY == 0:
            rows.append(of_functor() if NATIVE else of_engine(engine))
    stopped_by(*functors())
    return dict(rows=rows)


# YADE runs scripts with locals of their own, which comprehensions do not see.
found = {"adhesion": adhesion(Adhesion(os.environ["NEW_LAW_PULL"]))}
for name in Hinge.motions:
    found[name] = hinge(Hinge(), name)
with open(os.environ["NEW_LAW_OUT"], "w") as file:
    json.dump(found, file)
