"""Applies YADE's operators to a frozen state: particles, contact points, and forces are put into a scene, and nothing moves.

    STATE=<file> yade -n -x -j1 validation/yade_operators.py

`examples/rigid_box_sampling.rs` writes the state. Values are converted to our order (tensors position first, forces on A). Prints one
JSON object.
"""
import json
import os

import numpy as np
import yade.config
from yade import *
from yade import utils

with open(os.environ["STATE"]) as file:
    state = json.load(file)
for x, r in zip(state["position"], state["radius"]):
    O.bodies.append(utils.sphere(x, r))
for b, mass, v in zip(O.bodies, state["mass"], state["velocity"]):
    b.state.mass, b.state.vel = mass, v
O.engines = [InsertionSortCollider([Bo1_Sphere_Aabb()]),
             InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()],
                             [Law2_ScGeom_FrictPhys_CundallStrack()])]
for (a, b), point, force in zip(state["pair"], state["point"], state["force"]):
    i = utils.createInteraction(a, b)
    assert (i.id1, i.id2) == (a, b)
    i.geom.contactPoint = point
    # YADE stores the force on the second body in two parts; only their sum matters here.
    i.phys.normalForce, i.phys.shearForce = -Vector3(force), Vector3.Zero


def rows(matrix):
    return np.array(matrix).reshape(3, 3)


cells = TesselationWrapper()
cells.triangulate()
cells.computeVolumes()
volume = state["volume"]
fabric = utils.fabricTensor()
print(json.dumps({
    "version": yade.config.version,
    "stress": rows(utils.getStress(volume)).T.tolist(),
    "particle_stress": [rows(m).T.tolist() for m in utils.bodyStressTensors()],
    "fabric": rows(fabric[0] if isinstance(fabric, tuple) else fabric).tolist(),
    "coordination": utils.avgNumInteractions(skipFree=False),
    "porosity": utils.porosity(volume),
    "cell_volume": [cells.volume(k) for k in range(len(O.bodies))],
}))
