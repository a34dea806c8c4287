"""Speed of YADE's own concrete law on a given packing.

    YADE_PACKING=<file> [YADE_RATIO=1.5] [YADE_STEPS=500] [YADE_STRAIN_RATE=0.05] yade -n -x -j1 yade_cpm_speed.py

The packing is text, one sphere `x y z r` a line (m), `#` starts a comment. Spheres closer than ratio*(r1+r2) are bonded
in the first step. The two ends along the longest axis move apart at a constant speed, the rest starts with the linear
velocity field. Prints one JSON object: nanoseconds per bond and step, of whole steps and of the InteractionLoop
alone (geometry functor, law, and force sums), from YADE's timers; best and median of ten parts of the run.
"""
import json
import math
import os
import time

import yade.config
from yade import *
from yade import utils

PACKING = os.environ["YADE_PACKING"]
RATIO = float(os.environ.get("YADE_RATIO", "1.5"))
STEPS = int(os.environ.get("YADE_STEPS", "500"))
RATE = float(os.environ.get("YADE_STRAIN_RATE", "0.05"))
PARTS = 10

with open(PACKING) as file:
    spheres = [[float(x) for x in line.split()[:4]] for line in file if line.strip() and not line.startswith("#")]
m = CpmMat(young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=30, frictionAngle=math.atan(0.8),
           density=4800)
O.materials.append(m)
for x, y, z, r in spheres:
    O.bodies.append(utils.sphere((x, y, z), r, material=m, color=(1, 1, 1)))
extent = [max(s[k] for s in spheres) - min(s[k] for s in spheres) for k in range(3)]
axis = extent.index(max(extent))
low = min(s[axis] for s in spheres)
layer = 2 * max(s[3] for s in spheres)
for b in O.bodies:
    along = b.state.pos[axis] - low
    velocity = [0.0, 0.0, 0.0]
    velocity[axis] = RATE * (along - 0.5 * extent[axis])
    if along < layer or along > extent[axis] - layer:
        velocity[axis] = math.copysign(0.5 * RATE * extent[axis], velocity[axis])
        b.state.blockedDOFs = "xyz"[axis] + "XYZ"
    b.state.vel = Vector3(*velocity)
O.dt = 0.5 * min(s[3] for s in spheres) * math.sqrt(m.density / m.young)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=RATIO, label="bo1")]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=RATIO, label="ig2")],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=2)],
        [Law2_ScGeom_CpmPhys_Cpm()],
        label="loop",
    ),
    NewtonIntegrator(damping=0.3, label="newton"),
]
O.step()
bo1.aabbEnlargeFactor = ig2.interactionDetectionFactor = 1
O.step()
bonds = sum(1 for i in O.interactions)
pairs = len(O.interactions)
O.timingEnabled = True
share = max(1, STEPS // PARTS)
parts = {"wall": [], "engines": [], "loop": [], "newton": []}
for _ in range(PARTS):
    for engine in O.engines:
        engine.execTime = 0
    start = time.perf_counter()
    O.run(share, True)
    # O.run polls about every 40 ms while it waits; the timers of the engines do not have that error
    parts["wall"].append((time.perf_counter() - start) * 1e9 / share)
    parts["engines"].append(sum(engine.execTime for engine in O.engines) / share)
    parts["loop"].append(loop.execTime / share)
    parts["newton"].append(newton.execTime / share)


def median(values):
    ordered = sorted(values)
    return 0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])


per_bond = {
    name: {"best": min(values) / bonds, "median": median(values) / bonds} for name, values in parts.items()
}
print("RESULT " + json.dumps({
    "program": "yade " + yade.config.version,
    "threads": O.numThreads,
    "spheres": len(spheres),
    "bonds": bonds,
    "pairs_in_list": pairs,
    "bonds_after": sum(1 for i in O.interactions),
    "steps": share * PARTS,
    "dt_s": O.dt,
    "ns_per_bond_and_step": per_bond["engines"],
    "ns_per_bond_and_step_interaction_loop": per_bond["loop"],
    "ns_per_bond_and_step_newton": per_bond["newton"],
    "ns_per_bond_and_step_wall": per_bond["wall"],
    "strain_reached": RATE * O.time,
}))
