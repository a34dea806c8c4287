"""Concrete scenes for the tests of the bridge, created with YADE's functors."""

import math
import os

# Before YADE's names come in: __file__ is one of them.
PACKING = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../tests/golden/yade/packing.txt")

import yade.wrapper
from yade import *
from yade import utils
from yade.minieigenHP import Vector3

MATERIAL = dict(young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=10, frictionAngle=0.67)


def packing():
    """The 1,160 spheres of the gold data."""
    with open(PACKING) as file:
        return [[float(x) for x in line.split()] for line in file if not line.startswith("#")]


#: Bonds of the 1,160 spheres, and of their lower half.
BONDS, BONDS_OF_HALF = 6595, 2967


def half():
    """The 545 spheres of the lower half, for tests of which the size says nothing: with both ends, all kinds of bonds, and as many tiles of bonds (of
    1,024) as threads. Only the whole has more than one tile of particles, hence tests on several threads take it."""
    return [sphere for sphere in packing() if sphere[2] < 0.02]


#: YADE's own functors of concrete.
STOCK = ("Ip2_CpmMat_CpmMat_CpmPhys", "Law2_ScGeom_CpmPhys_Cpm")


def concrete(rate=3.0, spheres=None, verlet=1.5e-3, law=None, damping=0.3, material=None, functors=STOCK, before=None):
    """A prism in tension (rate > 0) or compression: both ends move along z, the rest starts with the linear field."""
    make_physics, make_law = (getattr(yade.wrapper, name) for name in functors)
    O.reset()
    m = CpmMat(**(material or MATERIAL))
    O.materials.append(m)
    spheres = spheres or packing()
    low, high = min(s[2] for s in spheres), max(s[2] for s in spheres)
    middle, length = 0.5 * (low + high), high - low
    ends = ([], [])
    for x, y, z, r in spheres:
        number = O.bodies.append(utils.sphere((x, y, z), r, material=m, color=(1, 1, 1)))
        state = O.bodies[number].state
        speed = rate * (z - middle)
        if z < low + 4e-3 or z > high - 4e-3:
            upper = z > middle
            ends[upper].append(number)
            speed = (0.5 if upper else -0.5) * rate * length
            state.blockedDOFs = "zXYZ"
        state.vel = Vector3(0, 0, speed)
    O.dt = 0.6 * min(s[3] for s in spheres) * math.sqrt(m.density / m.young)
    reach = 1.5
    bound, geometry = Bo1_Sphere_Aabb(aabbEnlargeFactor=reach), Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=reach)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([bound], verletDist=verlet),
        InteractionLoop(
            [geometry],
            [make_physics(cohesiveThresholdIter=1)],
            [make_law(**(law or {}))],
        ),
        NewtonIntegrator(damping=damping),
    ]
    if before:
        before()
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.0
    return ends


def positions():
    """Positions of all bodies."""
    import numpy as np

    return np.array([tuple(b.state.pos) for b in O.bodies])


def history():
    """Histories by pair, from YADE's Python."""
    found = {}
    for i in O.interactions:
        p = i.phys
        found[i.id1, i.id2] = (p.kappaD, p.omega, p.epsN, p.epsNPl, *p.epsT, *p.epsTPl, p.isCohesive)
    return found
