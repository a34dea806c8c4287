"""Gold data of the smooth joints of YADE's JCFpm, for the tests of joints.

Run as

    GOLD_OUT=<folder> yade -n -x -j1 make_joints_gold.py

Writes joints.bin, in the format of make_gold.py. Made with Debian's YADE 2023.02a; 2025.2.0 gives the same bytes.

Two spheres on two sides of a joint, on prescribed paths: positions and velocities, forces, opening without force, and slip in each step of
`Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM` with `smoothJoint`. The marks of the spheres are set as the examples of YADE do.

The spheres of packing.txt with a joint across, pressed and pulled along z: initial state, bonds, forces on both ends, and cracks.
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


STEP = ["alive", "fresh", "cohesive"] + vector_names("x1", "v1", "w1", "x2", "v2", "w2", "normal_force", "shear_force") + ["rest", "slip"]
CASE = ["r1", "r2", "dt", "kn", "ks", "fn_max", "fs_max", "area", "tan_friction", "tan_dilation", "tensile", "shear", "surface"]

# Relative velocities (along the line of the centers, across, across, in units of about the opening at which a joint of 1 MPa breaks, per 40
# steps) and angular velocities of both spheres (rad/s), one part after the other.
PRESS = (-1.0, 0.0, 0.0)
STILL = ((0, 0, 0), (0, 0, 0))
TURNS = ((40.0, 25.0, -30.0), (-20.0, 50.0, 35.0))
AWAY, BACK = (30.0, 0.0, 0.0), (-32.0, 0.0, 0.0)
LONG = (-0.5, 110.0, 0.0)
PATHS = {
    "pulled": [((0.4, 0.0, 0.0), STILL), ((1.1, 0.1, 0.2), STILL), (AWAY, STILL), (BACK, STILL), ((0.0, 4.0, 1.0), STILL), (AWAY, STILL)],
    "sheared": [((0.1, 3.0, -1.0), STILL), ((0.1, 6.0, -2.0), STILL)],
    "pressed": [((-2.0, 0.0, 0.0), STILL), ((0.0, 14.0, 3.0), STILL), ((-1.0, -6.0, 9.0), STILL), ((0.5, -9.0, 0.0), TURNS),
                ((4.0, 1.0, 0.0), STILL), (BACK, STILL), ((-3.0, 2.0, -2.0), STILL)],
    "turning": [((-2.0, 0.0, 0.0), TURNS), ((-1.0, 1.0, -1.0), TURNS), ((0.4, -1.0, 0.5), TURNS), ((3.0, 0.0, 2.0), TURNS)],
    "later": [((-30.0, 3.0, 0.0), STILL), ((-2.0, 9.0, -4.0), TURNS), ((0.0, -12.0, 2.0), STILL), (AWAY, STILL)],
    "far": [(PRESS, STILL)] + [(LONG, STILL)] * 8,
}
WHOLE = dict(young=1e9, poisson=0.25, tensileStrength=1e6, cohesion=2e6, frictionAngle=0.5, jointNormalStiffness=3e11, jointShearStiffness=1e11,
             jointTensileStrength=1e6, jointCohesion=2e6, jointFrictionAngle=0.5, jointDilationAngle=0.0)
OPEN = dict(jointTensileStrength=0.0, jointCohesion=0.0)
OTHER = dict(jointNormalStiffness=5e11, jointShearStiffness=3e11, jointTensileStrength=8e5, jointCohesion=3e6, jointFrictionAngle=0.4,
             jointDilationAngle=0.15)
# name, path, materials of both, radii, distance over the sum of the radii, angle between the normal of the joint and the line of the centers
CASES = [
    ("pulled", "pulled", {}, {}, (R, R), 1.0, 0.2),
    ("sheared", "sheared", {}, {}, (R, R), 1.0, 0.0),
    ("pressed", "pressed", {}, {}, (R, R), 1.0, 0.3),
    ("turning", "turning", {}, {}, (R, 2 * R), 1.0, 0.5),
    ("steep", "pressed", {}, {}, (R, R), 1.0, 1.1),
    ("open", "pressed", OPEN, OPEN, (R, R), 1.0, 0.3),
    ("dilating", "pressed", dict(jointDilationAngle=0.2), dict(jointDilationAngle=0.2), (2 * R, R), 0.9375, 0.3),
    ("unlike", "pressed", dict(jointDilationAngle=0.3), OTHER, (R, 2 * R), 1.0, 0.4),
    ("gap", "pulled", {}, OTHER, (R, 2 * R), 1.125, 0.3),
    ("tip_of_the_cone", "pulled", dict(jointTensileStrength=0.0), {}, (R, R), 1.0, 0.2),
    ("later", "later", {}, {}, (R, R), 1.03125, 0.4),
    ("later_dilating", "later", dict(OPEN, jointDilationAngle=0.2), dict(OPEN, jointDilationAngle=0.2), (R, 2 * R), 1.03125, 0.6),
    ("far", "far", OPEN, OPEN, (R, R), 1.0, 0.0),
    ("behind", "pressed", dict(jointDilationAngle=0.1), OTHER, (2 * R, R), 1.0, 2.8),
]
STEPS_OF_A_PART = 40


def mark(body, normal):
    """The sphere lies on a joint; `normal` points from the joint to it."""
    body.state.onJoint = True
    body.state.joint = 1
    body.state.jointNormal1 = normal


def two_spheres(name, path, first, second, radii, distance, angle):
    O.reset()
    materials = [JCFpmMat(density=2500, **{**WHOLE, **options}) for options in (first, second)]
    axis = Vector3(0.48, -0.6, 0.64)
    across = Vector3(0.8, 0.64, 0.0).normalized()
    third = axis.cross(across)
    normal = (math.cos(angle) * axis + math.sin(angle) * (0.6 * across + 0.8 * third)).normalized()
    unit = math.pi * 1e-3 * R
    for k, place in enumerate((Vector3(R / 4, R / 8, -R / 2), Vector3(R / 4, R / 8, -R / 2) + distance * sum(radii) * axis)):
        O.materials.append(materials[k])
        O.bodies.append(utils.sphere(place, radii[k], material=materials[k], color=(1, 0, 0)))
        O.bodies[k].state.blockedDOFs = "xyzXYZ"
        mark(O.bodies[k], normal if k else -normal)
    rows = []

    def record():
        try:
            i = O.interactions[0, 1]
            alive = i.isReal
        except IndexError:
            alive = False
        motion = [x for b in O.bodies for v in (b.state.pos, b.state.vel, b.state.angVel) for x in v]
        if alive:
            p = i.phys
            assert p.isOnJoint
            rows.append([1.0, float(i.iterMadeReal == O.iter), float(p.isCohesive)] + motion + list(p.normalForce) + list(p.shearForce)
                        + [p.initD, p.jointCumulativeSliding])
            strengths.append([p.kn, p.ks, p.crossSection, p.tanFrictionAngle, p.tanDilationAngle])
        else:
            rows.append([0.0, 0.0, 0.0] + motion + [0.0] * 8)

    def drive():
        (along, sideways, up), (turn_a, turn_b) = path[min(O.iter // STEPS_OF_A_PART, len(path) - 1)]
        a, b = (b.state for b in O.bodies)
        speed = unit / STEPS_OF_A_PART / DT
        velocity = speed * (along * axis + sideways * across + up * third)
        a.vel, b.vel = -0.25 * velocity, 0.75 * velocity
        a.angVel, b.angVel = Vector3(*turn_a), Vector3(*turn_b)

    global record_now, drive_now
    record_now, drive_now = record, drive
    # Contacts that begin later have none at the start.
    reach = 1.0 if path is PATHS["later"] else 1.25
    strengths = []
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=reach, label="bo1")], verletDist=0.5 * R),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=reach, label="ig2")],
            [Ip2_JCFpmMat_JCFpmMat_JCFpmPhys(cohesiveTresholdIteration=1)],
            [Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM(smoothJoint=True, label="law")],
        ),
        PyRunner(command="record_now()", iterPeriod=1, initRun=True),
        PyRunner(command="drive_now()", iterPeriod=1, initRun=True),
        NewtonIntegrator(damping=0),
    ]
    O.dt = DT
    O.step()
    import builtins

    limits = [0.0, 0.0]
    if rows[0][0]:
        limits = [O.interactions[0, 1].phys.FnMax, O.interactions[0, 1].phys.FsMax]
    builtins.ig2.interactionDetectionFactor = 1.0
    builtins.bo1.aabbEnlargeFactor = 1.0
    for _ in range(STEPS_OF_A_PART * len(path) - 1):
        O.step()
    law = builtins.law
    kn, ks, area, friction, dilation = strengths[0]
    case = [*radii, DT, kn, ks, *limits, area, friction, dilation, law.nbTensCracks, law.nbShearCracks, law.totalCracksSurface]
    return case, [list(normal)], rows


# name, strain rate (1/s), steps, of the joint
WEAK = dict(jointNormalStiffness=2e13, jointShearStiffness=5e12, jointTensileStrength=0.0, jointCohesion=0.0, jointFrictionAngle=0.35,
            jointDilationAngle=0.1)
STRONG = dict(jointNormalStiffness=2e13, jointShearStiffness=1e13, jointTensileStrength=1e6, jointCohesion=3e6, jointFrictionAngle=0.5,
              jointDilationAngle=0.0)
RUNS = [("slipping", -20.0, 500, WEAK), ("cracking", -20.0, 500, STRONG), ("opening", 5.0, 300, STRONG)]
ROCK = dict(young=20e9, poisson=0.3, tensileStrength=6e6, cohesion=12e6, frictionAngle=0.33, residualFrictionAngle=0.2, density=4800)
END_LAYER = 4e-3
DAMPING = 0.3
INTERACTION_RATIO = 1.2


def specimen(rate, steps, joint):
    """Both ends move along z at a constant speed without rotation; the rest starts with the linear velocity field."""
    O.reset()
    rock = JCFpmMat(**ROCK, **joint)
    O.materials.append(rock)
    with open(os.path.join(HERE, "packing.txt")) as file:
        spheres = [[float(x) for x in line.split()] for line in file if not line.startswith("#")]
    low, high = min(s[2] for s in spheres), max(s[2] for s in spheres)
    middle = Vector3(*(0.5 * (min(s[k] for s in spheres) + max(s[k] for s in spheres)) for k in range(3)))
    normal = Vector3(0.6, 0.0, 0.8)
    reach = 2 * INTERACTION_RATIO * max(s[3] for s in spheres)
    ends = ([], [])
    sides = []
    for x, y, z, r in spheres:
        b = O.bodies[O.bodies.append(utils.sphere((x, y, z), r, material=rock, color=(1, 1, 1)))]
        height = (Vector3(x, y, z) - middle).dot(normal)
        side = 0.0
        if abs(height) < reach:
            side = 1.0 if height > 0 else -1.0
            mark(b, side * normal)
        sides.append(side)
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
    # Joints are stiffer than the bonds at half of this.
    O.dt = 0.25 * min(s[3] for s in spheres) * math.sqrt(rock.density / rock.young)
    end = {**{k: -1.0 for k in ends[0]}, **{k: 1.0 for k in ends[1]}}
    initial = [list(b.state.pos) + [b.shape.radius, b.state.mass, b.state.inertia[0]] + list(b.state.vel) + [end.get(b.id, 0.0), sides[b.id]]
               for b in O.bodies]
    curve = []

    def record():
        if O.iter % 10 == 0:
            force = [math.fsum(O.forces.f(k)[2] for k in group) for group in ends]  # sum() depends on the version of Python
            curve.append([O.iter, *force, law.nbTensCracks, law.nbShearCracks])

    global record_now
    record_now = record
    law = Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM(smoothJoint=True)
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
    bonds = sorted([i.id1, i.id2, float(i.phys.isOnJoint)] for i in O.interactions)
    shapes.interactionDetectionFactor = boxes.aabbEnlargeFactor = 1.0
    O.run(steps - 1, True)
    setup = [rock.young, rock.poisson, rock.tensileStrength, rock.cohesion, math.tan(rock.frictionAngle),
             math.tan(rock.residualFrictionAngle), O.dt, DAMPING, rock.jointNormalStiffness, rock.jointShearStiffness,
             rock.jointTensileStrength, rock.jointCohesion, math.tan(rock.jointFrictionAngle), math.tan(rock.jointDilationAngle), *normal]
    return setup, initial, bonds, curve


SETUP = ["young", "poisson", "tensile_strength", "cohesion", "tan_friction", "tan_residual", "dt", "damping", "joint_kn", "joint_ks",
         "joint_tensile_strength", "joint_cohesion", "joint_tan_friction", "joint_tan_dilation"] + vector_names("normal")

with open(os.path.join(OUT, "joints.bin"), "wb") as gold:

    def add(name, columns, rows):
        gold.write(("%s %d %d %s\n" % (name, len(rows), len(columns), ",".join(columns))).encode())
        for row in rows:
            assert len(row) == len(columns), name
            gold.write(struct.pack("<%dd" % len(row), *row))

    gold.write(b"CONCORDEM-GOLD 1\n")
    for name, path, first, second, radii, distance, angle in CASES:
        case, normal, rows = two_spheres(name, PATHS[path], first, second, radii, distance, angle)
        add(name + ".case", CASE, [case])
        add(name + ".joint", vector_names("normal"), normal)
        add(name + ".steps", STEP, rows)
        alive = [row[0] for row in rows]
        ends = sum(a and not b for a, b in zip(alive, alive[1:]))
        sliding = sum(r[0] and not r[2] for r in rows)
        print("%-20s %3d steps, %d ends, %3d without cohesion, cracks %d in tension, %d in shear" % (
            name, len(rows), ends, sliding, *case[10:12]))
    for name, rate, steps, joint in RUNS:
        setup, initial, bonds, curve = specimen(rate, steps, joint)
        add(name + ".setup", SETUP, [setup])
        add(name + ".initial", ["x", "y", "z", "r", "mass", "inertia", "v_x", "v_y", "v_z", "end", "side"], initial)
        add(name + ".bonds", ["id1", "id2", "on_joint"], bonds)
        add(name + ".curve", ["step", "force_low", "force_high", "tensile", "shear"], curve)
        peak = max(curve, key=lambda row: abs(row[1]))
        print("%-20s %d bonds, %d on the joint, peak %.6g N at step %d, then %d cracks in tension, %d in shear; at the end %d, %d, and %.6g N" % (
            name, len(bonds), sum(b[2] for b in bonds), peak[1], peak[0], *peak[3:], *curve[-1][3:], curve[-1][1]))
