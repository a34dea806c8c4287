"""The new laws in the bonded engine of stock YADE: `NEW_LAW_PULL=PULL.TOML NEW_LAW_OUT=OUT.JSON yade -n -x in_yade.py`."""
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from yade import *
from yade import utils
from yade.minieigenHP import Vector3

import concordem.yade as bridge
from two_particles import EVERY, Adhesion, Hinge


def scene(spheres, motions, blocked, dt, material):
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
            [Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0),
    ]


def of_engine(engine):
    contacts = engine.forces()[1]
    assert contacts.pair.tolist() == [[0, 1]]
    return contacts.force[0].tolist() + contacts.moment[0].tolist()


def adhesion(case):
    motions = [([case.speed, 0, 0], [0, 0, 0]), ([0, 0, 0], [0, 0, 0])]
    scene(case.spheres, motions, "", case.dt, FrictMat(density=case.density))
    bridge.bond(material={"name": "powder", "density": case.density, "adhesive": case.material}, contacts={"law": "adhesive"})
    place = lambda: [list(O.bodies[k].state.pos) for k in (0, 1)]
    tension, positions = 0.0, [place()]
    for step in range(1, case.steps + 1):
        O.step()
        tension = max(tension, O.forces.f(0)[0])
        if step % EVERY == 0:
            positions.append(place())
    return dict(tension=tension, positions=positions)


def hinge(case, motion):
    spheres = [[0, 0, 0, case.radius], [case.length, 0, 0, case.radius]]
    scene(spheres, case.motions[motion], "xyzXYZ", case.dt, FrictMat(density=case.density))
    engine = bridge.bond(
        material={"name": "m", "density": case.density, "hinge": case.material}, bonds={"law": "hinge", "interaction_ratio": 1.01})
    rows = []
    for step in range(case.steps + 1):
        O.step()
        # The forces of this step are those of the positions at its beginning.
        if step and step % EVERY == 0:
            rows.append(of_engine(engine))
    return dict(rows=rows)


# YADE runs scripts with locals of their own, which comprehensions do not see.
found = {"adhesion": adhesion(Adhesion(os.environ["NEW_LAW_PULL"]))}
for name in Hinge.motions:
    found[name] = hinge(Hinge(), name)
with open(os.environ["NEW_LAW_OUT"], "w") as file:
    json.dump(found, file)
