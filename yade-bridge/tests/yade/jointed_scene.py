"""Scenes of jointed cohesive frictional spheres (JCFpmMat), created with YADE's functors."""

from cohesive_scene import RADIUS, grid
from yade import *
from yade import utils
from yade.minieigenHP import Vector3

MATERIAL = dict(young=1e7, poisson=0.4, frictionAngle=0.5, residualFrictionAngle=0.3, density=2500, tensileStrength=1e5, cohesion=1.5e5)


def engines(law=None, physics=None, damping=0.2, ratcheting=True, distance=1.0, six=False):
    """YADE's engines for such spheres."""
    shapes = Ig2_Sphere_Sphere_ScGeom6D if six else Ig2_Sphere_Sphere_ScGeom
    return [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=distance), Bo1_Box_Aabb()], verletDist=0.2 * RADIUS),
        InteractionLoop(
            [shapes(avoidGranularRatcheting=ratcheting, interactionDetectionFactor=distance), Ig2_Box_Sphere_ScGeom()],
            [Ip2_JCFpmMat_JCFpmMat_JCFpmPhys(**{"cohesiveTresholdIteration": 1, **(physics or {})})],
            [Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM(**(law or {}))],
        ),
        NewtonIntegrator(damping=damping),
    ]


def bond():
    """One step that bonds what is near; later contacts begin where spheres overlap."""
    O.step()
    O.engines[2].geomDispatcher.functors[0].interactionDetectionFactor = 1
    O.engines[1].boundDispatcher.functors[0].aabbEnlargeFactor = 1


def pair(material=None, law=None, physics=None, unequal=False, distance=1.0, overlap=0.04, **more):
    """Two spheres, bonded in the first step, with prescribed motion. `overlap`: a fraction of the sum of the radii."""
    O.reset()
    O.materials.append(JCFpmMat(**{**MATERIAL, **(material or {})}))
    radius = 0.7 * RADIUS if unequal else RADIUS
    if unequal:
        O.materials.append(JCFpmMat(**{**MATERIAL, "young": 3e7, "poisson": 0.2, "frictionAngle": 0.3, "cohesion": 9e4, **(material or {})}))
    branch = Vector3(0.3, 0.2, 0.9).normalized() * ((1 - overlap) * (RADIUS + radius))
    for place, r, m in zip((Vector3.Zero, branch), (RADIUS, radius), (0, -1)):
        body = O.bodies[O.bodies.append(utils.sphere(place, r, material=O.materials[m], color=(1, 1, 1)))]
        body.state.blockedDOFs = "xyzXYZ"
    O.engines = engines(law, physics, distance=distance, **more)
    O.dt = 1e-5
    bond()


def lattice(counts=(4, 4, 6), rate=2.0, material=None, law=None, physics=None, shift=0.03, seed=1, spacing=2.02, distance=1.2, before=None, periodic=False, **more):
    """The grid, bonded between neighbors."""
    materials = [JCFpmMat(**{**MATERIAL, "young": MATERIAL["young"] * young, **(material or {})}) for young in (1.0, 2.5)]
    grid(materials, counts, rate, shift, seed, spacing, periodic)
    O.engines = engines(law, physics, distance=distance, **more)
    O.dt = 0.3 * utils.PWaveTimeStep()
    if before:
        before()
    bond()
