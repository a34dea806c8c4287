# A concrete block is pulled apart between two layers of spheres that move at a constant speed. ConcorDEM computes the bonds and moves the
# spheres; YADE's scripts run when they are due. Afterwards YADE goes on with its own law.
#
#   yade pulled_apart.py          or, without a terminal: yade -n -x pulled_apart.py
import random

import concordem.yade
from yade import pack, plot

radius, size, rate, steps = 3e-3, (0.03, 0.03, 0.06), 10.0, 3000
concrete = O.materials.append(
    CpmMat(young=30e9, poisson=0.2, sigmaT=3.5e6, epsCrackOnset=1.1e-4, relDuctility=3, frictionAngle=atan(0.8), density=4800)
)
chance = random.Random(7)
upper = []
for body in pack.regularHexa(pack.inAlignedBox((0, 0, 0), size), radius=radius, gap=0, material=concrete):
    body.state.pos += Vector3(*(0.12 * radius * chance.uniform(-1, 1) for _ in range(3)))
    number, z = O.bodies.append(body), body.state.pos[2]
    body.state.vel = (0, 0, rate * (z - size[2] / 2))
    if min(z, size[2] - z) < 3 * radius:
        body.state.vel = (0, 0, math.copysign(rate * size[2] / 2, z - size[2] / 2))
        body.state.blockedDOFs = "zXYZ"
        if z > size[2] / 2:
            upper.append(number)

O.dt = 0.6 * PWaveTimeStep()
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5, label="bo1")]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5, label="ig2")],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)],
        [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.97)],
    ),
    NewtonIntegrator(damping=0.3),
]
O.step()                                                   # YADE creates the bonds ...
ig2.interactionDetectionFactor = bo1.aabbEnlargeFactor = 1
O.run(2, True)
engine = concordem.yade.take_over(motion=True)             # ... and ConcorDEM computes them and moves the spheres from now on


def record():
    plot.addData(time=O.time, force=-sum(O.forces.f(k)[2] for k in upper))


O.engines += [PyRunner(iterPeriod=50, command="record()"), PyRunner(iterPeriod=1000, command="engine.write_vtk('pulled')")]
O.run(steps, True)
broken, intact = engine.broken, engine.bond_count
engine.give_back()                                         # the bonds are interactions of YADE again
O.run(10, True)
print("RESULT largest force %.4g N, %d of %d bonds broken, %d interactions" % (
    max(plot.data["force"]), broken, broken + intact, O.interactions.countReal()))
