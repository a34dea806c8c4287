"""A concrete specimen in YADE, loaded and measured as in our scenario.

    YADE_PACKING=<file> [YADE_LAYER=2.2e-3] [YADE_DIRECTION=tension] yade -n -x -j1 validation/yade_specimen.py

The packing is text, `x y z r` per line in m (from `concordem pack`). Material, time step, damping, rates, and stops are
those of the templates cpm-specimen-tension and cpm-specimen-compression; end layers contain all centers within YADE_LAYER
of the outermost surfaces; stress is half the difference of the layers' forces over 50 mm x 50 mm, strain the change of
the distance of their mean positions. Prints one JSON object.
"""
import json
import math
import os
import time

import yade.config
from yade import *
from yade import utils

PACKING = os.environ["YADE_PACKING"]
LAYER = float(os.environ.get("YADE_LAYER", "2.2e-3"))
DIRECTION = os.environ.get("YADE_DIRECTION", "tension")
RATE, DROP = {"tension": (0.4, 0.2), "compression": (-3.0, 0.7)}[DIRECTION]
AREA, RATIO, INTERVAL = 2.5e-3, 1.5, 10

with open(PACKING) as file:
    spheres = [[float(x) for x in line.split()[:4]] for line in file if line.strip() and not line.startswith("#")]
m = CpmMat(young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=30, frictionAngle=math.atan(0.8),
           density=4800)
O.materials.append(m)
for x, y, z, r in spheres:
    O.bodies.append(utils.sphere((x, y, z), r, material=m))
low, high = min(s[2] - s[3] for s in spheres), max(s[2] + s[3] for s in spheres)
ends = [[b.id for b in O.bodies if inside(b.state.pos[2])]
        for inside in (lambda z: z - low <= LAYER, lambda z: high - z <= LAYER)]


def place(ids):
    return sum(O.bodies[i].state.pos[2] for i in ids) / len(ids)


bottom, top = place(ends[0]), place(ends[1])
length, middle = top - bottom, 0.5 * (top + bottom)
half = 0.5 * RATE * length
for b in O.bodies:
    b.state.vel = Vector3(0, 0, max(-abs(half), min(abs(half), RATE * (b.state.pos[2] - middle))))
for ids, velocity in zip(ends, (-half, half)):
    for i in ids:
        O.bodies[i].state.blockedDOFs = "z"
        O.bodies[i].state.vel = Vector3(0, 0, velocity)
O.dt = 0.24787e-6
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=RATIO, label="bo1")]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=RATIO, label="ig2")],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=2)],
        [Law2_ScGeom_CpmPhys_Cpm()],
    ),
    NewtonIntegrator(damping=0.3),
]
start = time.perf_counter()
O.step()
bo1.aabbEnlargeFactor = ig2.interactionDetectionFactor = 1
bonds = sum(1 for i in O.interactions)
curve, peak = [], 0.0
while True:
    O.run(INTERVAL, True)
    # YADE's forces belong to the step just done; the strain of those forces is that before the step's motion.
    strain = (place(ends[1]) - place(ends[0]) - length) / length - RATE * O.dt
    force = [sum(O.forces.f(i)[2] for i in ids) for ids in ends]
    stress = 0.5 * (force[0] - force[1]) / AREA
    curve.append((strain, stress))
    peak = max(peak, abs(stress))
    if abs(stress) <= DROP * peak and len(curve) > 20 or abs(strain) > 5e-3 or O.iter >= 10000:
        break
best = max(range(len(curve)), key=lambda k: abs(curve[k][1]))
fit = [point for point in curve[:best] if abs(point[1]) <= 0.3 * peak]
mean = [sum(p[k] for p in fit) / len(fit) for k in (0, 1)]
young = sum((e - mean[0]) * (s - mean[1]) for e, s in fit) / sum((e - mean[0]) ** 2 for e, _ in fit)
print("RESULT " + json.dumps({
    "program": "yade " + yade.config.version, "direction": DIRECTION, "layer_m": LAYER, "spheres": len(spheres),
    "bonds": bonds, "young_pa": young, "peak_stress_pa": curve[best][1], "strain_at_peak": curve[best][0],
    "steps": O.iter, "wall_s": round(time.perf_counter() - start, 1),
}))
