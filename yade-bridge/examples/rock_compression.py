# Uniaxial compression of rock (JCFpm): YADE bonds and presses the specimen, ConcorDEM computes the bonds; cracks are counted and recorded as by YADE.
#
#   yade rock_compression.py          or, without a terminal: yade -n -x rock_compression.py
import random

import concordem.yade
from yade import pack, plot, utils

radius, size, rate, steps = 3e-3, (0.04, 0.04, 0.08), -2.0, 4000

# The specimen: a dense lattice with random offsets.
rock = O.materials.append(
    JCFpmMat(young=60e9, poisson=0.3, density=4000, frictionAngle=radians(30), residualFrictionAngle=radians(25), tensileStrength=8e6, cohesion=25e6)
)
chance = random.Random(7)
for body in pack.regularHexa(pack.inAlignedBox((0, 0, 0), size), radius=radius, gap=0, material=rock, color=(0.7, 0.7, 0.7)):
    body.state.pos += Vector3(*(0.2 * radius * chance.uniform(-1, 1) for _ in range(3)))
    body.state.refPos = body.state.pos
    O.bodies.append(body)
ends = utils.uniaxialTestFeatures(axis=2)

O.dt = 0.5 * PWaveTimeStep()
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.3, label="bo1")], verletDist=0.05 * radius),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.3, label="ig2")],
        [Ip2_JCFpmMat_JCFpmMat_JCFpmPhys(cohesiveTresholdIteration=1)],
        [Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM(recordCracks=True, Key="rock", label="law")],
    ),
    NewtonIntegrator(damping=0.4),
    UniaxialStrainer(
        strainRate=rate, axis=2, asymmetry=0, posIds=ends["posIds"], negIds=ends["negIds"], crossSectionArea=ends["area"],
        blockDisplacements=False, blockRotations=False, setSpeeds=True, label="strainer",
    ),
    PyRunner(iterPeriod=50, command="record()", label="recorder"),
]

O.step()                                                   # YADE creates the bonds ...
ig2.interactionDetectionFactor = bo1.aabbEnlargeFactor = 1
engine = concordem.yade.take_over()                        # ... and ConcorDEM computes them from now on


def record():
    plot.addData(strain=-strainer.strain, stress=-strainer.avgStress, tensile=law.nbTensCracks, shear=law.nbShearCracks)


O.run(steps, True)
with open("cracks_rock.txt") as file:                      # YADE's file: iteration, time, place, 1 in tension or 2 in shear, size, normal, energy
    lines = sum(1 for line in file) - 1
print("RESULT f_c = %.3g MPa, %d cracks in tension and %d in shear, %d in the file, %d bonds whole" % (
    max(plot.data["stress"]) / 1e6, law.nbTensCracks, law.nbShearCracks, lines, engine.bond_count))
plot.plots = {"strain": ("stress", None, "tensile", "shear")}    # plot.plot() in a terminal shows the curves
