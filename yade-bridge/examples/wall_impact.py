# A steel sphere hits a concrete wall that stands on the ground under its weight. ConcorDEM computes the bonds of the wall and the contacts
# of its fragments; YADE computes the sphere and the ground.
#
#   yade wall_impact.py          or, without a terminal: yade -n -x wall_impact.py
import random

import concordem.yade
from yade import pack, utils

radius, speed, steps = 1e-2, 25.0, 3000
concrete = O.materials.append(
    CpmMat(young=20e9, poisson=0.2, sigmaT=2.5e6, epsCrackOnset=1e-4, relDuctility=3, frictionAngle=0.7, density=4800)
)
steel = O.materials.append(FrictMat(young=100e9, poisson=0.3, frictionAngle=0.3, density=7800))
# The missile comes first: YADE's functor for its contacts wants the steel first. It starts out of the reach in which bonds are made.
missile = O.bodies[O.bodies.append(utils.sphere((0.1, -2.5 * radius - 0.02, 0.12), 2.5 * radius, material=steel, color=(0, 0, 1)))].state
missile.vel = (0, speed, 0)
chance = random.Random(5)
wall = []
for body in pack.regularHexa(pack.inAlignedBox((0, 0, 0), (0.2, 0.06, 0.2)), radius=radius, gap=0, material=concrete, color=(0.7, 0.7, 0.7)):
    body.state.pos += Vector3(*(0.06 * radius * chance.uniform(-1, 1) for _ in range(3)))
    wall.append(O.bodies.append(body))
ground = min(O.bodies[i].state.pos[2] for i in wall) - radius
O.bodies.append(utils.wall((0, 0, ground), 2, material=steel, color=(1, 0, 0)))

O.dt = 0.4 * PWaveTimeStep()
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5, label="bo1"), Bo1_Wall_Aabb()], verletDist=0.1 * radius),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5, label="ig2"), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1), Ip2_FrictMat_CpmMat_FrictPhys(), Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.97), Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    NewtonIntegrator(damping=0.05, gravity=(0, 0, -9.81)),
]
O.step()
ig2.interactionDetectionFactor = bo1.aabbEnlargeFactor = 1
O.run(2, True)
engine = concordem.yade.take_over(motion=True)             # moves the wall's spheres, too: the same bits, faster
O.run(steps, True)
print("RESULT %d of %d bonds broken, sphere slowed from %g to %.3g m/s" % (
    engine.broken, engine.broken + engine.bond_count, speed, missile.vel[1]))
