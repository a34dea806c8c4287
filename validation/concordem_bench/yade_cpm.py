"""YADE's side of the comparison: a concrete specimen in tension. Also our bonded engine inside YADE.

    BENCH='{"packing": ..., ...}' yade -n -x -jN yade_cpm.py

`BENCH` holds `packing` (text, `x y z r` per line, m), `ratio`, `steps`, `warmup`, `rate` (1/s), `ductility`, `break_at` (damage), `engine` (null: YADE's own
law; otherwise [kinematics, mode, motion] of our bonded engine), and the material as in `rust-core/app/examples/speed`. Spheres closer than
ratio*(r1+r2) are bonded in the first step. Both ends along z move apart at a constant speed, the rest starts with the linear velocity
field. Prints one JSON object: seconds of the measured steps by YADE's timers and by the processor, and the state at the end.
"""
import json
import math
import os
import time

import yade.config
from yade import *
from yade import utils

wanted = json.loads(os.environ["BENCH"])
with open(wanted["packing"]) as file:
    spheres = [[float(x) for x in line.split()[:4]] for line in file if line.strip() and not line.startswith("#")]
m = CpmMat(young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=wanted["ductility"],
           frictionAngle=math.atan(0.8), density=4800)
O.materials.append(m)
for x, y, z, r in spheres:
    O.bodies.append(utils.sphere((x, y, z), r, material=m, color=(1, 1, 1)))
low, high = min(s[2] for s in spheres), max(s[2] for s in spheres)
extent = high - low
layer = 2 * max(s[3] for s in spheres)
upper = []
for b in O.bodies:
    along = b.state.pos[2] - low
    speed = wanted["rate"] * (along - 0.5 * extent)
    if along < layer or extent - along < layer:
        speed = math.copysign(0.5 * wanted["rate"] * extent, speed)
        b.state.blockedDOFs = "zXYZ"
        if speed > 0:
            upper.append(b.id)
    b.state.vel = Vector3(0, 0, speed)
O.dt = 0.5 * min(s[3] for s in spheres) * math.sqrt(m.density / m.young)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=wanted["ratio"], label="bo1")]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=wanted["ratio"], label="ig2")],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=2)],
        [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=wanted["break_at"])],
        label="loop",
    ),
    NewtonIntegrator(damping=0.3, label="newton"),
]
O.step()
bo1.aabbEnlargeFactor = ig2.interactionDetectionFactor = 1
O.step()
bonds = sum(1 for i in O.interactions)
start = [Vector3(b.state.refPos) for b in O.bodies]
engine = None
if wanted["engine"]:
    import concordem.yade

    kinematics, mode, motion = wanted["engine"]
    engine = concordem.yade.take_over(kinematics=kinematics, mode=mode, motion=motion)
for _ in range(wanted["warmup"] - 2):
    O.step()
O.timingEnabled = True
for each in O.engines:
    each.execTime = 0
began = time.process_time()
O.run(wanted["steps"], True)
processor = time.process_time() - began
print("RESULT " + json.dumps({
    "program": "yade " + yade.config.version,
    "threads": O.numThreads,
    "bonds": bonds,
    "loop_s": sum(each.execTime for each in O.engines) * 1e-9,
    "processor_s": processor,
    "state": {
        "grip_force": sum(O.forces.f(k)[2] for k in upper),
        "rms_displacement": math.sqrt(
            sum((b.state.pos - x).squaredNorm() for b, x in zip(O.bodies, start)) / len(start)),
        "bonds": engine.bond_count if engine else sum(1 for i in O.interactions if i.phys.isCohesive),
    },
}))
