"""Gold data of YADE's JCFpm, for the tests of the law `jointed`.

Run as

    GOLD_OUT=<folder> yade -n -x -j1 make_jointed_gold.py

Writes jointed.bin, in the format of make_gold.py. Made with Debian's YADE 2023.02a; 2025.2.0 gives the same bytes.

Two spheres on prescribed paths: inputs and outputs of `Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM` and of the geometry functor before
it, in each step. Radii are powers of two and moduli round numbers, so that the stiffnesses are exact in any order of the factors.

The spheres of packing.txt, pulled and pressed along z beyond the peak: initial state, bonds, forces on both ends, and cracks by mode.
"""
import math
import os
import struct
import sys

from yade import *
from yade import utils

HERE = os.path.dirname(os.path.abspath(sys.argv[0] if sys.argv[0].endswith(".py") else __file__))
OUT = os.environ.get("GOLD_OUT", HERE)
R = 2.0**-10
DT = 2.0**-22


def vector_names(*names):
    return [name + "_" + axis for name in names for axis in "xyz"]


STEP = (
    ["alive", "fresh", "cohesive"] + vector_names("x1", "v1", "w1", "x2", "v2", "w2") + ["penetration"]
    + vector_names("normal", "shear_increment", "normal_force", "shear_force")
)
CASE = ["r1", "r2", "ratcheting", "dt", "kn", "ks", "fn_max", "fs_max", "tan_friction", "tan_residual", "tensile", "shear", "surface"]
MATERIAL = ["young", "poisson", "tensile_strength", "cohesion"]

# Relative velocities (along the line of the centers, across, across, in units of the elongation at which a bond of 1 MPa breaks, per 40
# steps) and angular velocities of both spheres (rad/s), one part after the other.
PULL, PRESS = (1.4, 0.0, 0.0), (-1.0, 0.0, 0.0)
STILL = ((0, 0, 0), (0, 0, 0))
TURNS = ((40.0, 25.0, -30.0), (-20.0, 50.0, 35.0))
AWAY, BACK = (30.0, 0.0, 0.0), (-32.0, 0.0, 0.0)
PATHS = {
    "pulled": [(PULL, STILL), ((0.5, 0.1, 0.2), STILL), (AWAY, STILL), (BACK, STILL), ((0.0, 4.0, 1.0), STILL), (AWAY, STILL)],
    "sheared": [((0.3, 6.0, -2.0), STILL), ((0.2, 6.0, -2.0), STILL)],
    "pressed": [(PRESS, STILL), ((0.0, 14.0, 3.0), STILL), ((-1.0, -6.0, 9.0), STILL), ((0.5, -9.0, 0.0), TURNS), ((4.0, 1.0, 0.0), STILL),
                (BACK, STILL), ((-3.0, 2.0, -2.0), STILL)],
    "turning": [((-2.0, 0.0, 0.0), TURNS), ((-1.0, 1.0, -1.0), TURNS), ((0.4, -1.0, 0.5), TURNS), ((3.0, 0.0, 2.0), TURNS)],
}
WHOLE = dict(young=1e9, poisson=0.25, tensileStrength=1e6, cohesion=2e6, frictionAngle=0.5, residualFrictionAngle=0.25)
# name, path, materials of both, radii, distance over the sum of the radii, avoidGranularRatcheting
CASES = [
    ("pulled", "pulled", {}, {}, (R, R), 1.0, True),
    ("sheared", "sheared", {}, {}, (R, R), 1.0, True),
    ("pressed", "pressed", {}, {}, (R, R), 1.0, True),
    ("turning", "turning", {}, {}, (R, R), 1.0, True),
    ("gap", "pulled", {}, {}, (R, 2 * R), 1.125, True),
    ("overlap", "pressed", {}, {}, (2 * R, R), 0.9375, True),
    ("unlike", "pressed", {}, dict(young=3e9, poisson=0.5, tensileStrength=8e5, cohesion=3e6, frictionAngle=0.25,
                                   residualFrictionAngle=0.125), (R, 2 * R), 1.0, True),
    ("unlike_turning", "turning", {}, dict(young=3e9, poisson=0.5, cohesion=1e6), (R, 2 * R), 1.0, True),
    ("plain_arms", "turning", {}, {}, (R, 2 * R), 1.0625, False),
    ("plain_arms_pressed", "pressed", {}, {}, (R, R), 1.0, False),
    ("tip_of_the_cone", "pulled", dict(tensileStrength=0.0), dict(tensileStrength=0.0), (R, R), 1.0, True),
    ("tip_sheared", "sheared", dict(tensileStrength=0.0), dict(tensileStrength=0.0), (R, R), 1.0, True),
    ("smooth", "pressed", dict(poisson=0.0), dict(poisson=0.0), (R, R), 1.0, True),
    ("without_cohesion", "pressed", dict(cohesion=0.0), dict(cohesion=0.0), (R, R), 1.0, True),
    ("without_residual", "pressed", dict(residualFrictionAngle=-1.0), dict(residualFrictionAngle=-1.0), (R, R), 1.0, True),
    ("loose", "pressed", {}, dict(type=1), (R, R), 0.9375, True),
    ("loose_turning", "turning", {}, dict(type=1), (R, 2 * R), 0.9375, True),
]
STEPS_OF_A_PART = 40


def two_spheres(path, first, second, radii, distance, ratcheting):
    O.reset()
    materials = [JCFpmMat(density=2500, **{**WHOLE, **options}) for options in (first, second)]
    axis = Vector3(0.48, -0.6, 0.64)
    across = Vector3(0.8, 0.64, 0.0).normalized()
    third = axis.cross(across)
    # The unit of the path: elongation at which a bond of 1 MPa breaks, with E = 1 GPa.
    unit = math.pi * 1e-3 * R
    for k, place in enumerate((Vector3(R / 4, R / 8, -R / 2), Vector3(R / 4, R / 8, -R / 2) + distance * sum(radii) * axis)):
        O.materials.append(materials[k])
        O.bodies.append(utils.sphere(place, radii[k], material=materials[k], color=(1, 0, 0)))
        O.bodies[k].state.blockedDOFs = "xyzXYZ"
    rows = []

    def record():
        try:
            i = O.interactions[0, 1]
            alive = i.isReal
        except IndexError:
            alive = False
        motion = [x for b in O.bodies for v in (b.state.pos, b.state.vel, b.state.angVel) for x in v]
        if alive:
            g, p = i.geom, i.phys
            rows.append([1.0, float(i.iterMadeReal == O.iter), float(p.isCohesive)] + motion + [g.penetrationDepth] + list(g.normal)
                        + list(g.shearInc) + list(p.normalForce) + list(p.shearForce))
        else:
            rows.append([0.0, 0.0, 0.0] + motion + [0.0] * 13)

    def drive():
        (along, sideways, up), (turn_a, turn_b) = path[min(O.iter // STEPS_OF_A_PART, len(path) - 1)]
        a, b = (b.state for b in O.bodies)
        speed = unit / STEPS_OF_A_PART / DT
        velocity = speed * (along * axis + sideways * across + up * third)
        a.vel, b.vel = -0.25 * velocity, 0.75 * velocity
        a.angVel, b.angVel = Vector3(*turn_a), Vector3(*turn_b)

    global record_now, drive_now
    record_now, drive_now = record, drive
    reach = 1.25
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=reach, label="bo1")], verletDist=0.5 * R),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=reach, avoidGranularRatcheting=ratcheting, label="ig2")],
            [Ip2_JCFpmMat_JCFpmMat_JCFpmPhys(cohesiveTresholdIteration=1)],
            [Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM(label="law")],
        ),
        PyRunner(command="record_now()", iterPeriod=1, initRun=True),
        PyRunner(command="drive_now()", iterPeriod=1, initRun=True),
        NewtonIntegrator(damping=0),
    ]
    O.dt = DT
    O.step()
    import builtins

    phys = O.interactions[0, 1].phys
    strengths = [phys.kn, phys.ks, phys.FnMax, phys.FsMax]
    builtins.ig2.interactionDetectionFactor = 1.0
    builtins.bo1.aabbEnlargeFactor = 1.0
    for _ in range(STEPS_OF_A_PART * len(path) - 1):
        O.step()
    law = builtins.law
    whole, residual = (math.tan(min(angle(m) for m in materials)) for angle in (
        lambda m: m.frictionAngle, lambda m: m.residualFrictionAngle if m.residualFrictionAngle >= 0 else m.frictionAngle))
    case = [*radii, float(ratcheting), DT, *strengths, whole, residual, law.nbTensCracks, law.nbShearCracks, law.totalCracksSurface]
    return case, [[m.young, m.poisson, m.tensileStrength, m.cohesion] for m in materials], rows


# name, strain rate (1/s), steps
RUNS = [("tension", 5.0, 400), ("compression", -20.0, 600)]
ROCK = dict(young=20e9, poisson=0.3, tensileStrength=6e6, cohesion=12e6, frictionAngle=0.33, residualFrictionAngle=0.2, density=4800)
END_LAYER = 4e-3
DAMPING = 0.3
INTERACTION_RATIO = 1.2


def specimen(rate, steps):
    """Both ends move along z at a constant speed without rotation; the rest starts with the linear velocity field."""
    O.reset()
    rock = JCFpmMat(**ROCK)
    O.materials.append(rock)
    with open(os.path.join(HERE, "packing.txt")) as file:
        spheres = [[float(x) for x in line.split()] for line in file if not line.startswith("#")]
    low, high = min(s[2] for s in spheres), max(s[2] for s in spheres)
    ends = ([], [])
    for x, y, z, r in spheres:
        b = O.bodies[O.bodies.append(utils.sphere((x, y, z), r, material=rock, color=(1, 1, 1)))]
        place = z
        if z < low + END_LAYER:
            ends[0].append(b.id)
            place = low
        elif z > high - END_LAYER:
            ends[1].append(b.id)
            place = high
        b.state.vel = Vector3(0, 0, rate * (place - 0.5 * (low + high)))
    for k in ends[0] + ends[1]:
        O.bodies[k].state.blockedDOFs = "zXYZ"
    O.dt = 0.6 * min(s[3] for s in spheres) * math.sqrt(rock.density / rock.young)
    end = {**{k: -1.0 for k in ends[0]}, **{k: 1.0 for k in ends[1]}}
    initial = [list(b.state.pos) + [b.shape.radius, b.state.mass, b.state.inertia[0]] + list(b.state.vel) + [end.get(b.id, 0.0)]
               for b in O.bodies]
    curve = []

    def record():
        if O.iter % 10 == 0:
            force = [math.fsum(O.forces.f(k)[2] for k in group) for group in ends]  # sum() depends on the version of Python
            curve.append([O.iter, *force, law.nbTensCracks, law.nbShearCracks])

    global record_now
    record_now = record
    law = Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM()
    boxes = Bo1_Sphere_Aabb(aabbEnlargeFactor=INTERACTION_RATIO)
    shapes = Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=INTERACTION_RATIO)
    O.engines = [
        ForceResetter(),
        # a distance sufficient for the whole test, because each later run of the collider would change the order of the sums
        InsertionSortCollider([boxes], verletDist=1.5e-3),
        InteractionLoop([shapes], [Ip2_JCFpmMat_JCFpmMat_JCFpmPhys(cohesiveTresholdIteration=1)], [law]),
        PyRunner(command="record_now()", iterPeriod=1, initRun=True),
        NewtonIntegrator(damping=DAMPING),
    ]
    O.step()
    bonds = sorted([i.id1, i.id2, i.geom.refR1 + i.geom.refR2 - i.geom.penetrationDepth] for i in O.interactions)
    shapes.interactionDetectionFactor = boxes.aabbEnlargeFactor = 1.0
    O.run(steps - 1, True)
    setup = [rock.young, rock.poisson, rock.tensileStrength, rock.cohesion, math.tan(rock.frictionAngle),
             math.tan(rock.residualFrictionAngle), O.dt, DAMPING]
    return setup, initial, bonds, curve


with open(os.path.join(OUT, "jointed.bin"), "wb") as gold:

    def add(name, columns, rows):
        gold.write(("%s %d %d %s\n" % (name, len(rows), len(columns), ",".join(columns))).encode())
        for row in rows:
            assert len(row) == len(columns), name
            gold.write(struct.pack("<%dd" % len(row), *row))

    gold.write(b"CONCORDEM-GOLD 1\n")
    for name, path, first, second, radii, distance, ratcheting in CASES:
        case, materials, rows = two_spheres(PATHS[path], first, second, radii, distance, ratcheting)
        add(name + ".case", CASE, [case])
        add(name + ".materials", MATERIAL, materials)
        add(name + ".steps", STEP, rows)
        alive = [row[0] for row in rows]
        ends = sum(a and not b for a, b in zip(alive, alive[1:]))
        sliding = sum(r[0] and not r[2] for r in rows)
        print("%-20s %3d steps, %d ends, %3d without cohesion, cracks %d in tension, %d in shear" % (
            name, len(rows), ends, sliding, *case[10:12]))
    for name, rate, steps in RUNS:
        setup, initial, bonds, curve = specimen(rate, steps)
        add(name + ".setup", MATERIAL + ["tan_friction", "tan_residual", "dt", "damping"], [setup])
        add(name + ".initial", ["x", "y", "z", "r", "mass", "inertia", "v_x", "v_y", "v_z", "end"], initial)
        add(name + ".bonds", ["id1", "id2", "length"], bonds)
        add(name + ".curve", ["step", "force_low", "force_high", "tensile", "shear"], curve)
        peak = max(curve, key=lambda row: abs(row[1]))
        print("%-20s %d bonds, peak %.6g N at step %d, then %d cracks in tension, %d in shear; at the end %d, %d, and %.6g N" % (
            name, len(bonds), peak[1], peak[0], *peak[3:], *curve[-1][3:], curve[-1][1]))
