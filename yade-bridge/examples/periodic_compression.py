# Compression of a periodic cell of concrete. PeriTriaxController would not find the bonds; a PyRunner drives the cell with the engine's
# stress instead: prescribed strain rate along z, no stress across it.
#
#   yade periodic_compression.py          or, without a terminal: yade -n -x periodic_compression.py
import random

import concordem.yade
from yade import plot, utils

radius, count, rate, steps = 3e-3, 7, -2.0, 2500
concrete = O.materials.append(
    CpmMat(young=30e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=10, frictionAngle=0.7, density=4800)
)
step = 2 * radius * 0.99
O.periodic = True
O.cell.setBox(count * step, count * step, count * step)
chance = random.Random(2)
for k in range(count**3):
    place = [step * (n + 0.5) + 0.1 * radius * chance.uniform(-1, 1) for n in (k % count, k // count % count, k // count**2)]
    O.bodies.append(utils.sphere(place, radius, material=concrete, color=(1, 1, 1)))

O.dt = 0.4 * PWaveTimeStep()
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5, label="bo1")], verletDist=0.05 * radius, allowBiggerThanPeriod=True),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5, label="ig2")],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)],
        [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.97)],
    ),
    NewtonIntegrator(damping=0.3),
    PyRunner(iterPeriod=10, command="servo()"),
]
O.step()
ig2.interactionDetectionFactor = bo1.aabbEnlargeFactor = 1
O.run(2, True)
engine = concordem.yade.take_over()


def servo():
    sigma = engine.stress()
    # Expand where the cell is compressed sideways; the gain is a strain rate per stress.
    side = [max(-1.0, min(1.0, -1e-6 * sigma[k, k])) for k in range(2)]
    O.cell.velGrad = Matrix3(side[0], 0, 0, 0, side[1], 0, 0, 0, rate)
    plot.addData(strain=O.cell.trsf[2, 2] - 1, stress=sigma[2, 2], side=sigma[0, 0], broken=engine.broken)


O.run(steps, True)
print("RESULT f_c = %.3g MPa, largest lateral stress %.2g of it, %d bonds broken" % (
    -min(plot.data["stress"]) / 1e6, max(map(abs, plot.data["side"])) / -min(plot.data["stress"]), engine.broken))
plot.plots = {"strain": ("stress", "side")}
