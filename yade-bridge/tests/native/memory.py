"""What memory.sh runs under valgrind: small scenes of every class of the plugin."""


import concordem.yade as bridge
from yade import utils

bridge.load_native()

ROD = """
[[material]]
name = "rod"
density = 2500
%s
[bonds]
law = "%s"
interaction_ratio = 1.1
[contacts]
law = "none"
%s
"""
SCENARIOS = (
    ROD % ('cohesive_beam = { young = 6e10, poisson = 0.3, radius_ratio = 0.5, tensile_strength = 1e8 }', "cohesive_beam", ""),
    ROD
    % (
        "linear_bond = { normal_stiffness = 2e6, shear_stiffness = 4e5, normal_strength = 50 }\n"
        "deformable = { young = 6e10, poisson = 0.25 }",
        "linear_bond",
        "[deformable]\ncondition = \"solid\"",
    ),
)


def run(count):
    for _ in range(count):
        O.step()


def scene(material, make_geometry, make_physics, laws, side=3):
    """A cube of touching spheres, pulled apart."""
    O.reset()
    O.materials.append(material)
    for i in range(side):
        for j in range(side):
            for k in range(side):
                O.bodies.append(utils.sphere((2e-3 * i, 2e-3 * j, 2e-3 * k), 1e-3, material=material, color=(1, 1, 1)))
                O.bodies[-1].state.vel = Vector3(0, 0, 3.0 * (k - 1))
                if k != 1:
                    O.bodies[-1].state.blockedDOFs = "z"
    O.dt = 2e-8
    O.trackEnergy = True
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.1, label="bound")], verletDist=0.5e-3),
        InteractionLoop([make_geometry(interactionDetectionFactor=1.1, label="geometry")], [make_physics], laws),
        NewtonIntegrator(damping=0.2),
    ]


def again(steps):
    """Saved, gone, loaded, and on."""
    O.save("/tmp/scene.yade.gz")
    O.reset()
    O.load("/tmp/scene.yade.gz")
    run(steps)
    O.reset()


def concrete(law, physics=None):
    material = CpmMat(young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=3, frictionAngle=0.67)
    scene(material, Ig2_Sphere_Sphere_ScGeom, physics or Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1), [law])
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.0


concrete(Law2_ScGeom_CpmPhys_Rust(omegaThreshold=0.9, checkEvery=5), Ip2_CpmMat_CpmMat_CpmPhys_Rust(cohesiveThresholdIter=1))
run(60)
assert sum(b.state.numBrokenCohesive for b in O.bodies) > 0
again(10)
concrete(Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.9))
O.engines = O.engines[:3] + [BondedEngine_Rust(updateStates=10)] + O.engines[3:]
run(10)
assert O.engines[3].stress(1e-7).trace() != 0
run(50)
assert O.engines[3].broken > 0
again(10)

beams = CohesiveBeamMat_Rust(young=6e10, poisson=0.3, radiusRatio=0.5, tensileStrength=1e8, density=2500)
laws = [Law2_ScGeom_CohesiveBeamPhys_Rust(), Law2_ScGeom_FrictPhys_CundallStrack()]
make_beams = Ip2_CohesiveBeamMat_CohesiveBeamMat_CohesiveBeamPhys_Rust(cohesiveThresholdIter=1)
scene(beams, Ig2_Sphere_Sphere_ScGeom6D, make_beams, laws)
run(60)
assert laws[0].broken > 0
again(10)

springs = dict(normalStiffness=2e6, shearStiffness=4e5, normalStrength=1)
ceramic = LinearBondMat_Rust(particleYoung=6e10, particlePoisson=0.25, density=2500, **springs)
laws = [Law2_ScGeom_LinearBondPhys_Rust(), Law2_ScGeom_FrictPhys_CundallStrack()]
bonds = Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust(cohesiveThresholdIter=1)
scene(ceramic, Ig2_Sphere_Sphere_ScGeom, bonds, laws)
O.engines = O.engines[:3] + [DeformableParticles_Rust()] + O.engines[3:]
run(4)
assert all(b.state.wideningBefore.norm() > 0 for b in O.bodies)
run(56)
assert laws[0].broken > 0
again(10)

for text in SCENARIOS:
    material = FrictMat(young=1e9, poisson=0.2, frictionAngle=0.3, density=2500)
    scene(material, Ig2_Sphere_Sphere_ScGeom, Ip2_FrictMat_FrictMat_FrictPhys(), [Law2_ScGeom_FrictPhys_CundallStrack()])
    O.engines = O.engines[:3] + [BondedEngine_Rust(scenario=text)] + O.engines[3:]
    O.engines[3].takeOver()
    run(60)
    assert O.engines[3].bondCount > 0
    try:
        type(O.bodies).erase.__wrapped__(O.bodies, 5)
        O.step()
        raise SystemExit("a body that is gone was not noticed")
    except RuntimeError:
        O.engines[3].release()
    again(1)
print("DONE")
