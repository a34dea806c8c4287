"""The native plugin: classes generated from laws (laws.cpp), in stock YADE. Tolerances are reasoned where they stand."""

import hashlib
import math
import os
import struct
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, on_two_threads
from yade import utils
from yade.minieigenHP import Quaternion, Vector3

import concordem.yade as bridge

WORK = os.environ.get("BRIDGE_WORK", "/tmp")
bridge.load_native()
RADIUS = 1e-3


def run(count):
    for _ in range(count):
        O.step()


def engines(make_physics, law, reach=1.1, gravity=(0, 0, 0)):
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=reach)], verletDist=0.5e-3),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=reach)], [make_physics], [law, Law2_ScGeom_FrictPhys_CundallStrack()]),
        NewtonIntegrator(damping=0, gravity=gravity),
    ]


def functors():
    loop = O.engines[2]
    return loop.physDispatcher.functors[0], loop.lawDispatcher.functors[0]


def row(count, m):
    O.reset()
    O.materials.append(m)
    for k in range(count):
        O.bodies.append(utils.sphere((2 * RADIUS * k, 0, 0), RADIUS, material=m, color=(1, 1, 1)))


def digest():
    found = hashlib.sha256()
    for b in O.bodies:
        s = b.state
        found.update(struct.pack("<13d", *s.pos, *s.vel, *s.angVel, *[s.ori[k] for k in range(4)]))
    return found.hexdigest()


def whip(m, maker, law):
    """Ten spheres on a string of bonds: two act on a sphere, and sums of two have one order."""
    row(10, m)
    for b in O.bodies:
        b.state.ori = Quaternion(Vector3(0.2, 0.5, -0.4).normalized(), 0.1 * b.id)
    O.dt = 5e-8
    engines(maker, law)
    O.trackEnergy = True
    for b in O.bodies:
        b.state.vel = Vector3(0, 0.1 * b.id**2, -0.5 * b.id)
        b.state.angVel = Vector3(50.0 * b.id, 0, 300)


def generated_whip(**options):
    m = CohesiveBeamMat_Rust(**{**dict(young=60e9, poisson=0.3, cohesiveBeamPoisson=0.3, radius=0.5e-3, density=2500), **options})
    whip(m, Ip2_CohesiveBeamMat_CohesiveBeamMat_CohesiveBeamPhys_Rust(cohesiveThresholdIter=1), Law2_ScGeom_CohesiveBeamPhys_Rust())


def test_attributes_are_keys_and_fields():
    m = CohesiveBeamMat_Rust(model="timoshenko", shearCoefficient=0.9)
    assert isinstance(m, FrictMat) and m.dict()["shearCoefficient"] == 0.9 and math.isnan(m.radiusRatio)
    assert {"historyRestDirection", "historyRestRotation", "refLength", "moment"} <= set(CohesiveBeamPhys_Rust().dict())
    assert Law2_ScGeom_HertzMindlinPhys_Rust().bases == ["ScGeom", "HertzMindlinPhys_Rust"]


@on_two_threads
def test_mistakes_are_named():
    for options, wanted in (
        (dict(radius=math.nan), "the radius of the beam is missing"),
        (dict(model="iron"), "unknown variant `iron`"),
        (dict(young=-1.0), "young = -1 must be positive and finite"),
        (dict(hydrostaticStrength=1e6), "functors cannot use hydrostatic_strength"),
    ):
        generated_whip(**options)
        run(2)
        assert wanted in functors()[0].error, (wanted, functors()[0].error)


def test_saved_and_loaded():
    for name in ("laws.yade.gz", "laws.xml.bz2"):
        generated_whip()
        run(1000)
        path = os.path.join(WORK, name)
        O.save(path)
        run(1000)
        straight = digest()
        O.reset()
        O.load(path)
        run(1000)
        assert digest() == straight and functors()[1].error == "", name


def test_a_contact_without_a_bond():
    """Two spheres collide by the Hertz contact; their speeds part as the restitution says. 1e-3: some 1,000 steps per contact, the
    dashpot lags by half of one."""
    for restitution in (1.0, 0.7):
        m = HertzMindlinMat_Rust(young=1e9, poisson=0.2, restitution=restitution, density=2500)
        row(2, m)
        O.bodies[1].state.pos = Vector3(2.1 * RADIUS, 0, 0)
        O.bodies[0].state.vel = Vector3(0.5, 0, 0)
        O.dt = 2e-8
        engines(Ip2_HertzMindlinMat_HertzMindlinMat_HertzMindlinPhys_Rust(), Law2_ScGeom_HertzMindlinPhys_Rust(), reach=1.0)
        run(20000)
        maker, law = functors()
        assert maker.error == law.error == ""
        apart = O.bodies[1].state.vel[0] - O.bodies[0].state.vel[0]
        assert abs(apart / (0.5 * restitution) - 1) < 1e-3 and not any(i.isReal for i in O.interactions), apart


main(globals())
