"""Scenes of jointed cohesive frictional spheres (JCFpmMat), created with YADE's functors."""

import random

from yade import *
from yade import utils
from yade.minieigenHP import Matrix3, Vector3

MATERIAL = dict(young=1e7, poisson=0.4, frictionAngle=0.5, residualFrictionAngle=0.3, density=2500, tensileStrength=1e5, cohesion=1.5e5)
RADIUS = 0.01


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
    """Spheres on a jittered grid, bonded to their neighbors; the ends are pulled apart along z, or the cell is deformed."""
    chance = random.Random(seed)
    O.reset()
    for young in (1.0, 2.5):
        O.materials.append(JCFpmMat(**{**MATERIAL, "young": MATERIAL["young"] * young, **(material or {})}))
    step = spacing * RADIUS
    length = step * counts[2]
    O.periodic = periodic
    if periodic:
        O.cell.hSize = Matrix3(step * counts[0], 0, 0, 0, step * counts[1], 0, 0, 0, length)
        O.cell.velGrad = Matrix3(0, 0.5 * rate, 0, 0, 0, 0, 0, 0, rate)
    for k in range(counts[0] * counts[1] * counts[2]):
        x, y, z = k % counts[0], k // counts[0] % counts[1], k // (counts[0] * counts[1])
        place = [(n + 0.5) * step + shift * RADIUS * chance.uniform(-1, 1) for n in (x, y, z)]
        body = O.bodies[O.bodies.append(utils.sphere(place, RADIUS, material=O.materials[(x + y + z) % 2], color=(1, 1, 1)))]
        if not periodic:
            body.state.vel = Vector3(0, 0, rate * (place[2] - 0.5 * length))
            if z in (0, counts[2] - 1):
                body.state.blockedDOFs = "zXYZ"
    O.engines = engines(law, physics, distance=distance, **more)
    O.dt = 0.3 * utils.PWaveTimeStep()
    if before:
        before()
    bond()
