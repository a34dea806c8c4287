# Three-point bending of a notched concrete beam on rollers of facets: ConcorDEM computes the bonds of the beam, YADE the steel rollers
# and their contacts.
#
#   yade notched_beam.py          or, without a terminal: yade -n -x notched_beam.py
import math
import random

import concordem.yade
from yade import geom, pack, plot

radius, roller_radius, speed, steps = 3e-3, 8e-3, 0.3, 4000
length, width, height = 0.12, 0.02, 0.036

concrete = O.materials.append(
    CpmMat(young=30e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=3, frictionAngle=0.7, density=4800)
)
steel = O.materials.append(FrictMat(young=200e9, poisson=0.3, frictionAngle=0.3, density=7800))
notch = pack.inAlignedBox((length / 2 - 4e-3, -1, -1), (length / 2 + 4e-3, 1, 0.3 * height))
chance = random.Random(3)
beam = []
for body in pack.regularHexa(
    pack.inAlignedBox((0, 0, 0), (length, width, height)) - notch, radius=radius, gap=0, material=concrete, color=(0.7, 0.7, 0.7)
):
    body.state.pos += Vector3(*(0.08 * radius * chance.uniform(-1, 1) for _ in range(3)))
    beam.append(O.bodies.append(body))
places = [O.bodies[i].state.pos for i in beam]
left, right = min(x[0] for x in places) + 3 * radius, max(x[0] for x in places) - 3 * radius


def roller(x, below):
    """A cylinder of facets that touches the beam at x, from below or above."""
    near = [p[2] for p in places if abs(p[0] - x) < 1.2 * radius]
    z = min(near) - radius - roller_radius if below else max(near) + radius + roller_radius
    axis = Quaternion((1, 0, 0), math.pi / 2)
    return O.bodies.append(
        geom.facetCylinder((x, width / 2, z), radius=roller_radius, height=2 * width, segmentsNumber=24, orientation=axis, wallMask=4,
                           material=steel, color=(1, 0, 0), wire=False)
    )


supports = roller(left, True) + roller(right, True)
load = roller(length / 2, False)
for i in load:
    O.bodies[i].state.vel = (0, 0, -speed)

O.dt = 0.5 * PWaveTimeStep()
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5, label="bo1"), Bo1_Facet_Aabb()], verletDist=0.1 * radius),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5, label="ig2"), Ig2_Facet_Sphere_ScGeom()],
        [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1), Ip2_FrictMat_CpmMat_FrictPhys(), Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.97), Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    NewtonIntegrator(damping=0.3),
    PyRunner(iterPeriod=50, command="record()"),
]
O.step()
ig2.interactionDetectionFactor = bo1.aabbEnlargeFactor = 1
O.run(2, True)
engine = concordem.yade.take_over()


def record():
    plot.addData(
        deflection=speed * O.time,
        load=sum(O.forces.f(i)[2] for i in load),
        reaction=-sum(O.forces.f(i)[2] for i in supports),
        broken=engine.broken,
    )


O.run(steps, True)
print("RESULT peak load %.3g N, largest reaction %.3g N, %d bonds broken" % (
    max(plot.data["load"]), max(plot.data["reaction"]), engine.broken))
plot.plots = {"deflection": ("load", "reaction")}
