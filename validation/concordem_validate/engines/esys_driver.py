"""Runs in ESyS-Particle's processes: builds the beams of task.json, computes the steps, and writes out.json.

    mpirun -np 2 esysparticle esys_driver.py
"""
import json
import math

from esys.lsm import LsmMpi, RotBondPrms
from esys.lsm.util import BoundingBox, Vec3

with open("task.json") as file:
    task = json.load(file)
r, count = task["radius"], len(task["position"])
low = [min(x[k] for x in task["position"]) - 20 * r for k in range(3)]
high = [max(x[k] for x in task["position"]) + 20 * r for k in range(3)]
with open("start.geo", "w") as file:
    box = " ".join(repr(c) for c in (*low, *high))
    file.write(f"LSMGeometry 1.2\nBoundingBox {box}\nPeriodicBoundaries 0 0 0\nDimension 3D\nBeginParticles\nSimple\n{count}\n")
    for p, x in enumerate(task["position"]):
        file.write(" ".join(repr(float(c)) for c in (*x, r)) + f" {p} {int(p in task['held'])}\n")
    file.write(f"EndParticles\nBeginConnect\n{len(task['bonds'])}\n")
    file.writelines(f"{a} {b} 0\n" for a, b in task["bonds"])
    file.write("EndConnect\n")
sim = LsmMpi(numWorkerProcesses=1, mpiDimList=[1, 1, 1])
sim.initNeighbourSearch(particleType="RotSphere", gridSpacing=3 * r, verletDist=0.5 * r)
sim.setSpatialDomain(BoundingBox(Vec3(*low), Vec3(*high)))
sim.setNumTimeSteps(task["steps"])
sim.setTimeStepSize(task["dt"])
sim.readGeometry("start.geo")
# quirk esys-pi: the program computes masses with this π
sim.setParticleDensity(tag=0, mask=0, Density=task["mass"] / (4 / 3 * 3.141592654 * r**3))
never = dict.fromkeys(("normalBrkForce", "shearBrkForce", "torsionBrkForce", "bendingBrkForce"), 1e30)
sim.createInteractionGroup(RotBondPrms(
    name="beams", normalK=task["normal"], shearK=task["shear"], torsionK=task["twist"], bendingK=task["bending"], tag=0, scaling=False,
    **never))
for p in range(count):
    if any(task["velocity"][p]):
        sim.setParticleVelocity(p, Vec3(*task["velocity"][p]))
    if any(task["spin"][p]):
        sim.setParticleAngularVelocity(p, Vec3(*task["spin"][p]))
if task["held"]:
    sim.setParticleNonDynamic(1)  # particles with this tag
out = {"mass": [p.getMass() for p in sorted(sim.getParticleList(), key=lambda p: p.getId())], "step": [], "position": [], "velocity": [], "angular_velocity": []}


def picture(step):
    particles = sorted(sim.getParticleList(), key=lambda p: p.getId())
    components = lambda v: [v[0], v[1], v[2]]
    out["step"].append(step)
    out["position"].append([components(p.getPosn()) for p in particles])
    out["velocity"].append([components(p.getLinearVelocity()) for p in particles])
    out["angular_velocity"].append([components(p.getAngularVelocity()) for p in particles])


picture(0)
for step in range(1, task["steps"] + 1):
    sim.runTimeStep()
    if step % task["interval"] == 0 or step == task["steps"]:
        picture(step)
with open("out.json", "w") as file:
    json.dump(out, file)
sim.exit()
