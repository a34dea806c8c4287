# Uniaxial tension of a concrete prism: YADE makes the specimen and pulls it with its UniaxialStrainer; ConcorDEM computes the bonds.
#
#   yade uniaxial.py          or, without a terminal: yade -n -x uniaxial.py
import random

import concordem.yade
from yade import pack, plot, utils

radius, size, rate, steps = 3e-3, (0.045, 0.045, 0.09), 0.4, 4000

# The specimen: a dense lattice with random offsets.
concrete = O.materials.append(
    CpmMat(young=30e9, poisson=0.2, sigmaT=3.5e6, epsCrackOnset=1.1e-4, relDuctility=4, frictionAngle=atan(0.8), density=4800)
)
chance = random.Random(7)
for body in pack.regularHexa(pack.inAlignedBox((0, 0, 0), size), radius=radius, gap=0, material=concrete, color=(0.7, 0.7, 0.7)):
    body.state.pos += Vector3(*(0.12 * radius * chance.uniform(-1, 1) for _ in range(3)))
    body.state.refPos = body.state.pos
    O.bodies.append(body)
ends = utils.uniaxialTestFeatures(axis=2)

O.dt = 0.6 * PWaveTimeStep()
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5, label="bo1")], verletDist=0.05 * radius),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5, label="ig2")],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)],
        [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.97)],
    ),
    NewtonIntegrator(damping=0.3, label="newton"),
    UniaxialStrainer(
        strainRate=rate, axis=2, asymmetry=0, posIds=ends["posIds"], negIds=ends["negIds"], crossSectionArea=ends["area"],
        blockDisplacements=False, blockRotations=False, setSpeeds=True, label="strainer",
    ),
    PyRunner(iterPeriod=50, command="record()", label="recorder"),
]

O.step()                                                   # YADE creates the bonds ...
ig2.interactionDetectionFactor = bo1.aabbEnlargeFactor = 1
O.run(2, True)
engine = concordem.yade.take_over(update_states=500)       # ... and ConcorDEM computes them from now on


def record():
    plot.addData(strain=strainer.strain, stress=strainer.avgStress, broken=engine.broken)


O.run(steps, True)
stress, strain = plot.data["stress"], plot.data["strain"]
peak = max(stress)
first = next(k for k, sigma in enumerate(stress) if sigma > 0.3 * peak)
print("RESULT E = %.3g GPa, f_t = %.3g MPa, %d of %d bonds broken" % (
    stress[first] / strain[first] / 1e9, peak / 1e6, engine.broken, engine.broken + engine.bond_count))
plot.plots = {"strain": ("stress",)}                       # plot.plot() in a terminal shows the curve
