"""Takes over the bonds of a small scene with both bonded engines, in YADE; prints a line that `prebuilt` looks for."""

import math
import sys

from yade import utils

import concordem.yade

concordem.yade.load_native()


def scene():
    """A cube of 27 touching spheres of concrete, two layers of which move apart."""
    O.reset()
    material = O.materials.append(CpmMat(young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=10, frictionAngle=0.6))
    for k in range(27):
        number = O.bodies.append(utils.sphere((2e-3 * (k % 3), 2e-3 * (k // 3 % 3), 2e-3 * (k // 9)), 1e-3, material=material, color=(1, 1, 1)))
        O.bodies[number].state.vel = Vector3(0, 0, 0.1 * (k // 9))
    bound, geometry = Bo1_Sphere_Aabb(aabbEnlargeFactor=1.1), Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.1)
    O.dt = 0.3 * 1e-3 * math.sqrt(O.materials[material].density / O.materials[material].young)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([bound], verletDist=1e-4),
        InteractionLoop([geometry], [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)], [Law2_ScGeom_CpmPhys_Cpm()]),
        NewtonIntegrator(damping=0.1),
    ]
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1


found = []
for native in (True, False):
    scene()
    if native:
        O.engines = O.engines[:3] + [BondedEngine_Rust()] + O.engines[3:]
        O.engines[3].takeOver()
        bonds = O.engines[3].bondCount
    else:
        bonds = concordem.yade.take_over().bond_count
    O.run(50, True)
    found.append((bonds, [tuple(b.state.pos) for b in O.bodies]))
assert found[0] == found[1], "both engines give the same bits"
assert found[0][1][26][2] > 4e-3, "the spheres move"
# Three times 18 pairs of neighbors touch.
print("TRIED", found[0][0], "bonds with", concordem.yade.__file__)
sys.stdout.flush()
