"""Scenes of cohesive and frictional spheres (CohFrictMat), created with YADE's functors."""

import random

from yade import *
from yade import log, utils
from yade.minieigenHP import Matrix3, Vector3

MATERIAL = dict(young=1e7, poisson=0.4, frictionAngle=0.5, density=2500, normalCohesion=2e5, shearCohesion=1.5e5, momentRotationLaw=True, etaRoll=0.1, etaTwist=0.15)
RADIUS = 0.01
# In every step YADE 2023.02a says that moments in total are no plastic ones.
log.setLevel("Law2_ScGeom6D_CohFrictPhys_CohesionMoment", log.FATAL)


def engines(law=None, physics=None, damping=0.2, ratcheting=True):
    """YADE's engines for such spheres."""
    return [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], verletDist=0.2 * RADIUS),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom6D(avoidGranularRatcheting=ratcheting), Ig2_Box_Sphere_ScGeom6D()],
            [Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(**{"setCohesionNow": True, **(physics or {})})],
            [Law2_ScGeom6D_CohFrictPhys_CohesionMoment(**(law or {}))],
        ),
        NewtonIntegrator(damping=damping),
    ]


def bond():
    """One step that bonds what touches, and one more, in which YADE itself ends it."""
    O.step()
    O.engines[2].physDispatcher.functors[0].setCohesionNow = False
    O.step()


def pair(material=None, law=None, physics=None, unequal=False, ratcheting=True):
    """Two spheres that overlap, bonded, with prescribed motion."""
    O.reset()
    O.materials.append(CohFrictMat(**{**MATERIAL, **(material or {})}))
    radius = 0.7 * RADIUS if unequal else RADIUS
    if unequal:
        O.materials.append(CohFrictMat(**{**MATERIAL, **(material or {}), "young": 3e7, "poisson": 0.2, "frictionAngle": 0.3}))
    places = ((0, 0, 0), (0.3 * RADIUS, 0.2 * RADIUS, (0.93 * (RADIUS + radius) ** 2 - 0.13 * RADIUS**2) ** 0.5))
    for place, r, m in zip(places, (RADIUS, radius), (0, -1)):
        body = O.bodies[O.bodies.append(utils.sphere(place, r, material=O.materials[m], color=(1, 1, 1)))]
        body.state.blockedDOFs = "xyzXYZ"
    O.engines = engines(law, physics, ratcheting=ratcheting)
    O.dt = 1e-5
    bond()


def grid(materials, counts, rate, shift, seed, spacing, periodic):
    """Spheres of two materials on a jittered grid; the ends are pulled apart along z, or the cell is deformed."""
    chance = random.Random(seed)
    O.reset()
    O.materials.append(materials)
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


def lattice(counts=(4, 4, 6), rate=2.0, material=None, law=None, physics=None, shift=0.01, seed=1, spacing=1.98, before=None, periodic=False):
    """The grid, bonded where spheres touch."""
    materials = [CohFrictMat(**{**MATERIAL, "young": MATERIAL["young"] * young, **(material or {})}) for young in (1.0, 2.5)]
    grid(materials, counts, rate, shift, seed, spacing, periodic)
    O.engines = engines(law, physics)
    O.dt = 0.3 * utils.PWaveTimeStep()
    if before:
        before()
    bond()
