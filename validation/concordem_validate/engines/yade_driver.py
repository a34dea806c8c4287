"""Runs in YADE's process: builds the scene of a task, runs it, and writes NumPy arrays.

    CONCORDEM_VALIDATE_TASK=task.json CONCORDEM_VALIDATE_OUT=yade.npz yade -n -x -j1 yade_driver.py

Samples are taken between the contact laws and the integrator: positions and forces of step k, velocities of step k - 1/2.
"""
import json
import math
import os
import sys
import time

import numpy as np
import yade.config
from yade import *
from yade import utils

with open(os.environ["CONCORDEM_VALIDATE_TASK"]) as file:
    task = json.load(file)


def make_material(m):
    m = dict(m)
    kind = m.pop("kind")
    if kind == "cpm":
        m.pop("functor")
        return CpmMat(**m)
    if kind == "frictional":
        return FrictMat(**m)
    if kind == "hertz_mindlin":
        m.pop("restitution")
        return FrictMat(**m)
    if kind == "linear_bond":
        return CohFrictMat(momentRotationLaw=False, isCohesive=True, shearCohesion=1e30, fragile=True, **m)
    # cohesive beam: stiffnesses for equal touching spheres
    r, e, nu, b = task["radius"][0], m["young"], m["poisson"], m["beam_radius"]
    length, area, inertia = 2 * r, math.pi * b**2, math.pi * b**4 / 4
    kn, ks, kr, kt = e * area / length, 12 * e * inertia / length**3, e * inertia / length, e / (2 + 2 * nu) * 2 * inertia / length
    return CohFrictMat(
        young=kn / r, poisson=ks / kn, alphaKr=kr / (r * r * ks), alphaKtw=kt / (r * r * ks), momentRotationLaw=True,
        isCohesive=True, normalCohesion=1e30, shearCohesion=1e30, fragile=False, density=m["density"],
        frictionAngle=0.5, etaRoll=-1, etaTwist=-1)


law = task["law"]


def bodies():
    """All bodies of the task, and engines that turn some of them."""
    materials = [make_material(m) for m in task["materials"]]
    for m in materials:
        O.materials.append(m)
    if task["cell"]:
        O.periodic = True
        O.cell.setBox(*task["cell"])
    for p, (x, r) in enumerate(zip(task["position"], task["radius"])):
        # give a color, because otherwise utils draws a random one and reseeds Python's generator
        b = utils.sphere(x, r, material=materials[task["material"][p]], color=(1, 1, 1))
        b.state.mass, b.state.inertia = task["mass"][p], Vector3(1, 1, 1) * task["inertia"][p]
        b.state.vel, b.state.angVel = Vector3(*task["velocity"][p]), Vector3(*task["spin"][p])
        b.state.blockedDOFs = task["fixed"][p]
        O.bodies.append(b)
    for axis, position, side, velocity, material in task["walls"]:
        b = utils.wall(position, axis, sense=side, material=materials[material], color=(1, 1, 1))
        b.state.vel = Vector3(*velocity)
        O.bodies.append(b)
    turning = []
    for triangles, material, center, spin in task["meshes"]:
        ids = O.bodies.append([utils.facet([Vector3(*v) for v in triangle], material=materials[material], color=(1, 1, 1)) for triangle in triangles])
        if any(spin):
            turning.append(RotationEngine(ids=ids, rotateAroundZero=True, zeroPoint=Vector3(*center), rotationAxis=Vector3(*spin).normalized(),
                                          angularVelocity=Vector3(*spin).norm()))
    for p, (f, m) in enumerate(zip(task["force"], task["moment"])):
        if any(f):
            O.forces.setPermF(p, Vector3(*f))
        if any(m):
            O.forces.setPermT(p, Vector3(*m))
    return turning


def interactions():
    """Functors of geometry, physics, and the law."""
    correction = task["ratcheting_correction"]
    ratio = task["ratio"] if task["bonds"] else 1.0
    if law == "cpm":
        geometry = [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=ratio, avoidGranularRatcheting=correction, label="ig2"),
                    Ig2_Wall_Sphere_ScGeom(noRatch=correction)]
        physics = [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1 if task["bonds"] else 0)]
        response = [Law2_ScGeom_CpmPhys_Cpm(**task["materials"][0]["functor"])]
    elif law == "frictional":
        geometry = [Ig2_Sphere_Sphere_ScGeom(avoidGranularRatcheting=correction, label="ig2"), Ig2_Wall_Sphere_ScGeom(noRatch=correction)]
        physics = [Ip2_FrictMat_FrictMat_FrictPhys()]
        # its shortcut for spheres would also use the arm R - overlap/2 at walls (quirk yade-spherical-bodies)
        response = [Law2_ScGeom_FrictPhys_CundallStrack(sphericalBodies=task["spherical_bodies"])]
    elif law == "hertz_mindlin":
        geometry = [Ig2_Sphere_Sphere_ScGeom(avoidGranularRatcheting=correction, label="ig2"),
                    Ig2_Wall_Sphere_ScGeom(hertzian=True, noRatch=correction), Ig2_Facet_Sphere_ScGeom()]
        # what each pair of materials has; without damping, YADE needs no matchmaker
        how = {}
        if any(e < 1 for *_, e in task["pairs"]):
            how = {"en": MatchMaker(matches=[(i, j, e) for i, j, _, e in task["pairs"]]),
                   "es": MatchMaker(matches=[(i, j, 1.0) for i, j, _, _ in task["pairs"]])}
        if task["interfaces"]:
            how["frictAngle"] = MatchMaker(matches=[(i, j, math.atan(mu)) for i, j, mu, _ in task["pairs"]])
        physics = [Ip2_FrictMat_FrictMat_MindlinPhys(**how)]
        response = [Law2_ScGeom_MindlinPhys_Mindlin()]
    else:
        geometry = [Ig2_Sphere_Sphere_ScGeom6D(interactionDetectionFactor=ratio, avoidGranularRatcheting=correction, label="ig2")]
        physics = [Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(setCohesionNow=True, setCohesionOnNewContacts=False)]
        response = [Law2_ScGeom6D_CohFrictPhys_CohesionMoment(
            always_use_moment_law=law == "cohesive_beam", useIncrementalForm=False)]
    return geometry, physics, response


samples = {name: [] for name in ("sample_steps", "stress", "strain", "contact_force", "whole_stress", "whole_volume", "stored_deformation")}
pictures = {name: [] for name in ("snapshot_steps", "position", "velocity", "angular_velocity", "damage_field")}
count, loading = len(task["position"]), task["loading"]
uniaxial = loading["kind"] == "uniaxial"
only_pair = count == 2 and not task["walls"] and not task["meshes"]


def mean_position(ids):
    return sum(O.bodies[p].state.pos[loading["axis"]] for p in ids) / len(ids)


def height_of_rollers():
    return sum(O.bodies[p].state.pos[loading["across"]] for p in loading["moved"]) / len(loading["moved"])


def sample():
    k = O.iter
    if k % task["sample_interval"]:
        return
    samples["sample_steps"].append(k)
    if uniaxial:
        force = [sum(O.forces.f(p)[loading["axis"]] for p in loading[end]) for end in ("low", "high")]
        samples["stress"].append(0.5 * (force[0] - force[1]) / loading["area"])
        samples["strain"].append((mean_position(loading["high"]) - mean_position(loading["low"]) - length) / length)
    elif loading["kind"] == "flexure":
        held, moved = (sum(O.forces.f(p)[loading["across"]] for p in loading[name]) for name in ("held", "moved"))
        samples["stress"].append(0.5 * (moved - held) * loading["stress"])
        samples["strain"].append((roller - height_of_rollers()) * loading["strain"])
    elif loading["kind"] == "platens":
        k, axis = loading["first"], loading["axis"]
        samples["stress"].append(loading["sign"] * 0.5 * (O.forces.f(k)[axis] - O.forces.f(k + 1)[axis]) / loading["area"])
        samples["strain"].append((O.bodies[k + 1].state.pos[axis] - O.bodies[k].state.pos[axis]) / loading["length"] - 1)
    elif loading["kind"] == "cell-stress":
        axis = loading["axis"]
        samples["stress"].append(utils.getStress()[axis][axis])
        samples["strain"].append(O.cell.trsf[axis][axis] - 1)
        samples["whole_volume"].append(O.cell.volume)
    if task["stress_volume"] is not None:
        # 0 means the volume of the periodic cell, as in YADE
        samples["whole_stress"].append([list(row) for row in np.array(utils.getStress(task["stress_volume"]))])
    if deformation:
        samples["stored_deformation"].append(deformation.energy)
    if only_pair:
        real = [i for i in O.interactions if i.isReal]
        # the force on the second body is the sum of both parts
        f = -(real[0].phys.normalForce + real[0].phys.shearForce) if real else Vector3(0, 0, 0)
        samples["contact_force"].append(list(f if not real or real[0].id1 == 0 else -f))


def picture(last=False):
    k = O.iter
    if k % task["snapshot_interval"] and k != task["steps"] and not last:
        return
    states = [O.bodies[p].state for p in range(count)]
    pictures["snapshot_steps"].append(k)
    pictures["position"].append([list(s.pos) for s in states])
    pictures["velocity"].append([list(s.vel) for s in states])
    pictures["angular_velocity"].append([list(s.angVel) for s in states])
    if law == "cpm":
        broken, links = np.zeros(count), np.zeros(count)
        for i in O.interactions:
            if i.isReal and i.phys.isCohesive:
                for p in (i.id1, i.id2):
                    if p < count:
                        broken[p] += i.phys.omega
                        links[p] += 1
        lost = np.array([s.numBrokenCohesive for s in states], dtype=float)
        pictures["damage_field"].append((broken + lost) / np.maximum(links + lost, 1))


frozen = {}


def freeze():
    """Current contacts with the force on the first body, and the results of YADE's operators."""
    real = [i for i in O.interactions if i.isReal]
    shift = [O.cell.hSize * Vector3(*i.cellDist) if O.periodic else Vector3.Zero for i in real]
    places = [O.bodies[p].state.pos for p in range(len(O.bodies))]
    tensors = lambda all_: np.array([np.array(t).reshape(3, 3) for t in all_])
    frozen.update(
        volume=O.cell.volume if O.periodic else 0.0, position=[list(x) for x in places[:count]], pair=[(i.id1, i.id2) for i in real],
        point=[list(i.geom.contactPoint) for i in real],
        force=[list(-(i.phys.normalForce + i.phys.shearForce)) for i in real],
        branch=[list(places[i.id2] + s - places[i.id1]) for i, s in zip(real, shift)],
        stress=tensors([utils.getStress(task["stress_volume"] or 0)]), particle_stress=tensors(utils.bodyStressTensors()))


class Deformation:
    """Particles with one uniform elastic strain each (Madan 2019, section 2.6), in Python around YADE's bonds.

    After the laws: stress of a particle from the forces at its surface, strain by Hooke's law. Before the next ones: what the two
    particles of a bond widened along their line goes into its overlap, by way of the overlap that YADE takes for plastic.
    """

    def __init__(self, how):
        self.plane, self.strain, self.energy = how["condition"] == "plane-strain", np.zeros((count, 3, 3)), 0.0
        self.load = np.array(how["load"])
        constants = [how["constants"][m] for m in task["material"]]
        self.rigid = np.array([c is None for c in constants])
        self.young, self.poisson = np.array([c or (1.0, 0.0) for c in constants]).T
        r = np.array(task["radius"])
        self.volume = math.pi * r**2 if task["plane"] else 4 / 3 * math.pi * r**3

    def after(self):
        stress = self.load.copy()
        for i in O.interactions:
            if i.isReal:
                n, f = np.array(i.geom.normal), np.array(i.phys.normalForce + i.phys.shearForce)
                # - f at + R n on the first body, f at - R n on the second
                dyad = -0.5 * (np.outer(n, f) + np.outer(f, n))
                stress[i.id1] += task["radius"][i.id1] * dyad
                stress[i.id2] += task["radius"][i.id2] * dyad
        stress /= self.volume[:, None, None]
        trace = np.trace(stress, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        e, nu = self.young[:, None, None], self.poisson[:, None, None]
        self.strain = (1 + nu) / e * (stress - nu * trace) if self.plane else ((1 + nu) * stress - nu * trace) / e
        self.strain[self.rigid] = 0
        if task["plane"]:
            # out-of-plane components do no work: the depth is one
            self.strain[:, 2, :] = self.strain[:, :, 2] = 0
        self.coming = 0.5 * np.sum(self.volume * np.sum(stress * self.strain, axis=(1, 2)))

    def before(self):
        for i in O.interactions:
            if i.isReal:
                n = np.array(O.bodies[i.id2].state.pos - O.bodies[i.id1].state.pos)
                n /= np.linalg.norm(n)
                i.phys.unp = -sum(task["radius"][p] * (n @ self.strain[p] @ n) for p in (i.id1, i.id2))
        self.energy = self.coming


def widen():
    if O.iter:
        deformation.before()


deformation = Deformation(task["deformable"]) if task["deformable"] else None


def record():
    sample()
    picture()
    if task["frozen"] and O.iter == task["steps"]:
        freeze()
    if deformation:
        deformation.after()


# before the first step, also in a run that continues
roller = length = None
if loading["kind"] == "flexure":
    roller = sum(task["position"][p][loading["across"]] for p in loading["moved"]) / len(loading["moved"])
elif uniaxial:
    high, low = (sum(task["position"][p][loading["axis"]] for p in loading[end]) / len(loading[end]) for end in ("high", "low"))
    length = high - low


def begin(phase):
    servo.stressMask, servo.goal, servo.maxStrainRate = phase["mask"], Vector3(*phase["goal"]), Vector3(*phase["fastest"])


def build():
    """The scene after its first step, in which YADE makes bonds."""
    turning = bodies()
    ratio = task["ratio"] if task["bonds"] else 1.0
    geometry, physics, response = interactions()
    O.dt = task["dt"]
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=ratio, label="bo1"), Bo1_Wall_Aabb(), Bo1_Facet_Aabb()]),
        *([PyRunner(command="widen()", iterPeriod=1)] if deformation else []),
        InteractionLoop(geometry, physics, response),
        PyRunner(command="record()", iterPeriod=1, initRun=True),
        *turning,
        NewtonIntegrator(damping=task["damping"], gravity=task["gravity"], label="newton"),
    ]
    if loading["kind"] == "cell-strain":
        # the velocities of the start state already include the gradient
        O.cell.velGrad = Matrix3(*[x for row in loading["velocity_gradient"] for x in row])
        newton.prevVelGrad = O.cell.velGrad
    elif loading["kind"] == "cell-stress":
        # An inertia of the cell of the order of that of its spheres, so that its own vibrations are as fast as theirs.
        controller = PeriTriaxController(dynCell=True, mass=sum(task["mass"]), globUpdate=1, maxUnbalanced=0, relStressTol=0, doneHook="pass", label="servo")
        O.engines = [*O.engines[:-1], controller, O.engines[-1]]
        begin(loading["phases"][0])
    O.step()
    for a, b in task["severed"]:
        # The law of the first step has bonded them, too; they carry nothing yet.
        O.interactions.erase(a, b)
    if task["bonds"]:
        made = sorted(tuple(sorted((i.id1, i.id2))) for i in O.interactions if i.isReal and max(i.id1, i.id2) < count)
        wanted = sorted(tuple(b) for b in task["bonds"])
        if made != wanted:
            print("BONDS DIFFER: %d made by YADE, %d in the start state, %d in common" % (
                len(made), len(wanted), len(set(made) & set(wanted))))
            sys.exit(5)
        bo1.aabbEnlargeFactor = ig2.interactionDetectionFactor = 1


if task["continue"]:
    O.load(task["continue"])
else:
    build()
start = time.perf_counter()
# one more step, because forces and velocities of the last step are read between the laws and the integrator
if loading["kind"] == "cell-stress":
    end = 0
    for phase, following in zip(loading["phases"], loading["phases"][1:]):
        end += phase["steps"]
        O.run(end - O.iter, True)
        begin(following)
O.run(task["steps"] - O.iter + 1, True)
wall = time.perf_counter() - start
if task["keep"]:
    O.save(task["keep"])
out = {name: np.array(values) for name, values in {**samples, **pictures}.items() if values}
out.update({f"frozen_{name}": np.array(values) for name, values in frozen.items()})
# what YADE computed with
spheres = [O.bodies[p] for p in range(count)]
out.update(mass=[b.state.mass for b in spheres], radius=[b.shape.radius for b in spheres], inertia=[tuple(b.state.inertia) for b in spheres],
           time_step=O.dt)
np.savez(os.environ["CONCORDEM_VALIDATE_OUT"], wall_s=wall, version="yade " + yade.config.version, **out)
