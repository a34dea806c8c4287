"""Gold data of YADE's concrete law, for the conformance tests of ConcorDEM.

Run as

    GOLD_OUT=<folder> GOLD_PART=<law|specimen|all> yade -n -x -j1 make_gold.py

With GOLD_LAW=Law2_ScGeom_CpmPhys_Rust, the law of ConcorDEM's native plugin is used instead; it must give the same bytes.
Made with Debian's YADE 2023.02a on one thread: with more, YADE sums forces in an order that changes from run to run.

Writes files of named tables of real numbers. A file is the line `CONCORDEM-GOLD 1`, then for each table one line

    name rows columns name_of_column_1,name_of_column_2,...

followed by rows*columns little-endian doubles, row by row.

law_tester.bin    two spheres on prescribed paths, every option of the law: inputs and outputs of each step
specimen.bin      uniaxial tests of 1,000 spheres: sampled contacts in windows of consecutive steps
trajectory.bin    the same tests: initial state, stress-strain curves, later states, for the comparison of solvers
packing.txt       the spheres (x y z r), input; written once by GOLD_PART=packing
"""
import math
import os
import random
import struct
import sys

import yade.wrapper
from yade import *
from yade import pack, utils

HERE = os.path.dirname(os.path.abspath(sys.argv[0] if sys.argv[0].endswith(".py") else __file__))
OUT = os.environ.get("GOLD_OUT", HERE)
PART = os.environ.get("GOLD_PART", "all")
LAW_CLASS = os.environ.get("GOLD_LAW", "Law2_ScGeom_CpmPhys_Cpm")
if LAW_CLASS.endswith("_Rust"):
    from concordem.yade import load_native

    load_native()
Law2 = getattr(yade.wrapper, LAW_CLASS)


class Tables:
    """A file of named tables of real numbers."""

    def __init__(self, path):
        self.file = open(path, "wb")
        self.file.write(b"CONCORDEM-GOLD 1\n")

    def add(self, name, columns, rows):
        head = "%s %d %d %s\n" % (name, len(rows), len(columns), ",".join(columns))
        self.file.write(head.encode())
        for row in rows:
            assert len(row) == len(columns), (name, len(row), len(columns))
            self.file.write(struct.pack("<%dd" % len(row), *row))

    def close(self):
        self.file.close()


def vector_names(*names):
    return [name + "_" + axis for name in names for axis in "xyz"]


MOTION = vector_names("x1", "v1", "w1", "x2", "v2", "w2")
GEOMETRY = ["penetration"] + vector_names("normal", "shear_increment")
OUTPUT = (
    ["eps_n", "eps_n_plastic", "kappa", "omega", "residual", "sigma_n"]
    + vector_names("eps_t", "eps_t_plastic", "sigma_t", "normal_force", "shear_force")
)
ALIVE = ["alive", "fresh"] + MOTION + GEOMETRY + OUTPUT
CONSTANTS = [
    "id1", "id2", "r1", "r2", "cohesive", "young", "shear_modulus", "tan_friction", "cohesion", "eps_crack_onset",
    "eps_fracture", "shear_contribution", "iso_prestress", "dam_law", "never_damage", "length", "reference_penetration",
    "area", "kn", "ks",
]
MATERIAL = [
    "young", "poisson", "friction_angle", "sigma_t", "eps_crack_onset", "rel_ductility", "shear_contribution", "dam_law",
    "never_damage", "iso_prestress",
]
LAW = ["omega_threshold", "eps_soft", "rel_kn_soft", "ratcheting", "dt", "shift_x", "shift_y", "shift_z"]


def material_row(m):
    return [
        m.young, m.poisson, m.frictionAngle, m.sigmaT, m.epsCrackOnset, m.relDuctility, m.equivStrainShearContrib,
        m.damLaw, float(m.neverDamage), m.isoPrestress,
    ]


def constants_row(i):
    p, g = i.phys, i.geom
    return [
        i.id1, i.id2, g.refR1, g.refR2, float(p.isCohesive), p.E, p.G, p.tanFrictionAngle, p.undamagedCohesion,
        p.epsCrackOnset, p.epsFracture, p.equivStrainShearContrib, p.isoPrestress, p.damLaw, float(p.neverDamage),
        p.refLength, p.refPD, p.crossSection, p.kn, p.ks,
    ]


def motion_row(id1, id2):
    row = []
    for state in (O.bodies[id1].state, O.bodies[id2].state):
        row += list(state.pos) + list(state.vel) + list(state.angVel)
    return row


def find(id1, id2):
    """The real interaction of two bodies, or None."""
    try:
        i = O.interactions[id1, id2]
    except IndexError:
        return None
    return i if i.isReal else None


def contact_row(id1, id2, i):
    """All inputs and outputs of the law in this step, recorded between law and integrator."""
    if i is None:
        return [0.0, 0.0] + motion_row(id1, id2) + [math.nan] * (len(GEOMETRY) + len(OUTPUT))
    assert (i.id1, i.id2) == (id1, id2)
    g, p = i.geom, i.phys
    row = [1.0, float(i.iterMadeReal == O.iter)] + motion_row(id1, id2)
    row += [g.penetrationDepth] + list(g.normal) + list(g.shearInc)
    row += [p.epsN, p.epsNPl, p.kappaD, p.omega, p.relResidualStrength, p.sigmaN]
    row += list(p.epsT) + list(p.epsTPl) + list(p.sigmaT) + list(p.normalForce) + list(p.shearForce)
    return row


def material(**options):
    values = dict(
        young=30e9, poisson=0.2, frictionAngle=0.67, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=30, density=4800
    )
    values.update(options)
    return CpmMat(**values)


# ---------------------------------------------------------------------------------------------------------------------
# two spheres

# relative displacements (normal, shear, shear) and rotations (twist, bending, bending) at the ends of the path's parts
GENERAL = (
    [(1.6e-4, 0, 0), (1.2e-4, 3e-4, 1e-4), (-3e-4, 8e-4, -2e-4), (-8e-4, -8e-4, 3e-4), (6e-4, -2e-4, 0),
     (-1e-4, 4e-4, 4e-4)],
    [(0, 0, 0), (2e-4, 1e-4, -1e-4), (-5e-3, 4e-4, 3e-3), (1e-2, -2e-3, 1e-3), (0, 0, 0), (3e-3, 2e-2, -1e-2)],
)
TENSION = (
    [(0.9e-4, 0, 0), (1.4e-4, 5e-5, -2e-5), (0.2e-4, 2e-4, 1e-4), (1e-3, 3e-4, 0), (-2e-4, 5e-4, 1e-3), (8e-3, 1e-3, 0)],
    [(1e-4, 0, 0), (0, 0, 0), (0, 1e-4, 2e-4), (0, 0, 0), (0, 0, 0), (0, 0, 0)],
)
TURNING = (
    [(-2e-4, 1e-4, 0), (-2e-4, 0.3, 0), (-4e-4, 0.3, 0.5), (1e-4, 0.2, 0.4), (3e-4, 0, 0), (0, 0, 0)],
    [(0, 0, 0), (0.2, 0.3, -0.1), (0.5, -0.4, 0.2), (0, 0, 0), (-0.7, 0.1, 0.9), (0, 0, 0)],
)
PRESSED = (
    [(-4e-4, 1e-4, 0), (-6e-4, 9e-4, 1e-4), (-5e-5, 9e-4, -9e-4), (2e-4, 0, 0)],
    [(1e-4, 0, 2e-4), (0, 3e-4, 0), (-2e-4, 0, 1e-4), (0, 0, 0)],
)
STEPS_OF_A_PART = 18

SOFT = dict(epsSoft=-2e-4, relKnSoft=0.3)
# name, path, options of the material, of the second material (None: the same), of the law, of the scene
CASES = [
    ("exponential", GENERAL, dict(), None, dict(), dict()),
    ("linear", GENERAL, dict(damLaw=0), None, dict(), dict()),
    ("exponential_shear", GENERAL, dict(equivStrainShearContrib=0.5), None, dict(), dict()),
    ("linear_shear", GENERAL, dict(damLaw=0, equivStrainShearContrib=0.5), None, dict(), dict()),
    ("soft", GENERAL, dict(), None, SOFT, dict()),
    ("soft_linear_shear", GENERAL, dict(damLaw=0, equivStrainShearContrib=0.5), None, SOFT, dict()),
    ("soft_flat", GENERAL, dict(), None, dict(epsSoft=-2e-4, relKnSoft=0.0), dict()),
    ("soft_falling", GENERAL, dict(), None, dict(epsSoft=-2e-4, relKnSoft=-0.2), dict()),
    ("threshold", TENSION, dict(), None, dict(omegaThreshold=0.95), dict()),
    ("threshold_linear", TENSION, dict(damLaw=0), None, dict(omegaThreshold=0.95), dict()),
    ("threshold_shear", TENSION, dict(equivStrainShearContrib=1.0), None, dict(omegaThreshold=0.9), dict()),
    ("linear_to_the_end", TENSION, dict(damLaw=0), None, dict(), dict()),
    ("exponential_to_the_end", TENSION, dict(relDuctility=3), None, dict(), dict()),
    ("confined", GENERAL, dict(isoPrestress=-3e6), None, dict(), dict()),
    ("stretched", TENSION, dict(isoPrestress=1e6), None, dict(omegaThreshold=0.9), dict()),
    ("confined_soft", GENERAL, dict(isoPrestress=-8e6), None, SOFT, dict()),
    ("never_damage", TENSION, dict(neverDamage=True), None, dict(omegaThreshold=0.5), dict()),
    ("loose", GENERAL, dict(), None, dict(), dict(cohesive=False)),
    ("loose_soft", PRESSED, dict(), None, SOFT, dict(cohesive=False)),
    ("loose_pressed", PRESSED, dict(), None, dict(), dict(cohesive=False, radii=(1e-3, 0.6e-3))),
    ("loose_confined", PRESSED, dict(isoPrestress=-3e6), None, dict(), dict(cohesive=False)),
    ("unequal_radii", GENERAL, dict(), None, dict(), dict(radii=(1e-3, 0.37e-3))),
    ("gap", GENERAL, dict(), None, dict(), dict(radii=(1e-3, 0.8e-3), distance=1.41)),
    ("overlap", GENERAL, dict(), None, SOFT, dict(radii=(0.7e-3, 1.3e-3), distance=0.93)),
    ("unlike_materials", GENERAL, dict(),
     dict(young=17e9, poisson=0.31, sigmaT=1.7e6, epsCrackOnset=2.3e-4, relDuctility=7, frictionAngle=0.4,
          isoPrestress=-1e6, equivStrainShearContrib=0.3), SOFT, dict(radii=(1e-3, 0.9e-3))),
    ("unlike_damage_laws", TENSION, dict(damLaw=0), dict(damLaw=1, young=25e9), dict(omegaThreshold=0.97), dict()),
    ("unlike_never_damage", TENSION, dict(), dict(neverDamage=True, sigmaT=5e6), dict(), dict()),
    ("plain_arms", GENERAL, dict(), None, dict(), dict(ratcheting=False, radii=(1e-3, 0.8e-3), distance=1.3)),
    ("turning", TURNING, dict(), None, dict(), dict()),
    ("turning_plain_arms", TURNING, dict(damLaw=0), None, SOFT, dict(ratcheting=False, distance=1.2)),
    ("periodic", GENERAL, dict(), None, SOFT, dict(periodic=True)),
]


def two_spheres(tables, name, path, options, second, law, scene):
    """Drive one contact with YADE's LawTester and record each step."""
    O.reset()
    r1, r2 = scene.get("radii", (1e-3, 1e-3))
    cohesive = scene.get("cohesive", True)
    periodic = scene.get("periodic", False)
    ratcheting = scene.get("ratcheting", True)
    distance = (r1 + r2) * scene.get("distance", 1.0)
    first = material(**options)
    other = first if second is None else material(**second)
    O.materials.append(first)
    if other is not first:
        O.materials.append(other)
    # an axis with no zero components
    axis = Vector3(0.48, -0.6, 0.64)
    origin = Vector3(0.2e-3, 0.3e-3, -0.1e-3)
    end = origin + distance * axis
    shift = Vector3(0, 0, 0)
    if periodic:
        # B lies outside the cell image of A: its image one period along y is the neighbor
        O.periodic = True
        O.cell.hSize = Matrix3(0.01, 0, 0, 0, 0.008, 0, 0, 0, 0.012)
        end += Vector3(0, 0.008, 0)
        shift = Vector3(0, -0.008, 0)
    O.bodies.append(utils.sphere(origin, r1, material=first, color=(1, 0, 0)))
    O.bodies.append(utils.sphere(end, r2, material=other, color=(0, 1, 0)))
    for b in O.bodies:
        b.state.blockedDOFs = "xyzXYZ"
    reach = 1.5 if distance > r1 + r2 else 1.01
    # LawTester's pathSteps are the lengths of the parts
    steps = [STEPS_OF_A_PART] * len(path[0])
    tester = LawTester(ids=[0, 1], disPath=[Vector3(*x) for x in path[0]], rotPath=[Vector3(*x) for x in path[1]],
                       pathSteps=steps)
    rows, constants = [], []

    def record():
        i = find(0, 1)
        rows.append(contact_row(0, 1, i))
        if i is None:
            tester.dead = True
        elif not constants:
            constants.append(constants_row(i))

    global record_now
    record_now = record
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=reach)], verletDist=0.5e-3),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=reach, avoidGranularRatcheting=ratcheting)],
            [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=10 if cohesive else 0)],
            [Law2(**law)],
        ),
        PyRunner(command="record_now()", iterPeriod=1, initRun=True),
        tester,
        NewtonIntegrator(damping=0),
    ]
    O.dt = 1.3e-7
    while len(rows) <= sum(steps) and not tester.dead:
        O.step()
    functor = O.engines[2].lawDispatcher.functors[0]
    tables.add(name + ".materials", MATERIAL, [material_row(first), material_row(other)])
    tables.add(name + ".law", LAW, [[functor.omegaThreshold, functor.epsSoft, functor.relKnSoft, float(ratcheting), O.dt]
                                    + list(shift)])
    tables.add(name + ".constants", CONSTANTS, constants)
    tables.add(name + ".steps", ALIVE, rows)
    return rows


def make_law():
    tables = Tables(os.path.join(OUT, "law_tester.bin"))
    for case in CASES:
        rows = two_spheres(tables, *case)
        last = rows[-1] if rows[-1][0] else rows[-2]
        column = ALIVE.index
        print("%-24s %4d steps, ended %s, kappa %.3e omega %.4f eps_n_plastic %.3e |eps_t_plastic| %.3e" % (
            case[0], len(rows), "alive " if rows[-1][0] else "erased", last[column("kappa")], last[column("omega")],
            last[column("eps_n_plastic")], Vector3(*last[column("eps_t_plastic_x"):][:3]).norm()))
    tables.close()


# ---------------------------------------------------------------------------------------------------------------------
# a specimen of about 1,000 spheres

# name, strain rate (1/s), steps, options of the law, starts of the windows of recorded steps, steps of the snapshots
RUNS = [
    ("tension", 3.0, 3000, dict(), (0, 600, 1200, 1800, 2990), (100, 1000, 3000)),
    ("compression", -20.0, 2000, dict(), (0, 1000, 1990), (100, 1000, 2000)),
    ("softening", -20.0, 3000, dict(epsSoft=-3e-4, relKnSoft=0.3, omegaThreshold=0.99), (1000, 1800, 2600),
     (100, 1000, 3000)),
]
WINDOW = 5
SAMPLES = 36
SPECIMEN_MATERIAL = dict(young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=10, frictionAngle=0.67)
END_LAYER = 4e-3
DAMPING = 0.3
INTERACTION_RATIO = 1.5


def make_packing():
    """Spheres of 1.2 mm, +-20 %, in a box of 22 x 22 x 42 mm."""
    box = pack.inAlignedBox((0, 0, 0), (22e-3, 22e-3, 42e-3))
    random.seed(1)
    spheres = pack.randomDensePack(box, radius=1.2e-3, rRelFuzz=0.2, spheresInCell=500, color=(1, 1, 1), seed=1)
    with open(os.path.join(OUT, "packing.txt"), "w") as file:
        file.write("# x y z r in m; random dense packing cropped to a box of 22 x 22 x 42 mm\n")
        for b in spheres:
            file.write("%r %r %r %r\n" % (*b.state.pos, b.shape.radius))
    print(len(spheres), "spheres")


def read_packing():
    with open(os.path.join(HERE, "packing.txt")) as file:
        return [[float(x) for x in line.split()] for line in file if not line.startswith("#")]


def specimen(rate, law):
    """Both ends move along z at a constant speed without rotation; the rest starts with the linear velocity field."""
    O.reset()
    m = material(**SPECIMEN_MATERIAL)
    O.materials.append(m)
    spheres = read_packing()
    for x, y, z, r in spheres:
        O.bodies.append(utils.sphere((x, y, z), r, material=m, color=(1, 1, 1)))
    low, high = min(s[2] for s in spheres), max(s[2] for s in spheres)
    middle, length = 0.5 * (low + high), high - low
    ends = ([], [])
    for b in O.bodies:
        z = b.state.pos[2]
        speed = rate * (z - middle)
        if z < low + END_LAYER:
            ends[0].append(b.id)
            speed = -0.5 * rate * length
        elif z > high - END_LAYER:
            ends[1].append(b.id)
            speed = 0.5 * rate * length
        b.state.vel = Vector3(0, 0, speed)
    for group in ends:
        for k in group:
            O.bodies[k].state.blockedDOFs = "zXYZ"
    O.dt = 0.6 * min(s[3] for s in spheres) * math.sqrt(m.density / m.young)
    O.engines = [
        ForceResetter(),
        # a distance sufficient for the whole test, because each later run of the collider would change the order of the sums
        InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=INTERACTION_RATIO, label="bo1")], verletDist=1.5e-3,
                              label="collider"),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=INTERACTION_RATIO, label="ig2")],
            [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)],
            [Law2(**law)],
        ),
        PyRunner(command="record_now()", iterPeriod=1, initRun=True),
        NewtonIntegrator(damping=DAMPING),
    ]
    return m, ends, length


def interesting(rows, cohesive):
    """Class of a contact: the rarest event that happens to it in the window."""
    column = ALIVE.index
    alive = [row[0] for row in rows]
    if 0.0 in alive:
        return "lost"
    if any(row[1] for row in rows) and O.iter > 2 * WINDOW:
        return "born"
    first, last = rows[0], rows[-1]
    if not cohesive:
        return "loose"
    if last[column("omega")] == 1.0:
        return "spent"
    if last[column("eps_n_plastic")] != first[column("eps_n_plastic")]:
        return "softens"
    if last[column("eps_t_plastic_x")] != first[column("eps_t_plastic_x")]:
        return "slips"
    if last[column("omega")] != first[column("omega")]:
        return "damages"
    if last[column("omega")] > 0:
        return "damaged"
    return "elastic"


def choose(rows_of, constants):
    """SAMPLES contacts of all classes, drawn with a fixed seed."""
    kinds = {}
    for key in sorted(rows_of):
        kinds.setdefault(interesting(rows_of[key], constants[key][4]), []).append(key)
    rng = random.Random(7)
    for keys in kinds.values():
        rng.shuffle(keys)
    chosen = []
    while len(chosen) < min(SAMPLES, len(rows_of)):
        for kind in sorted(kinds):
            if kinds[kind] and len(chosen) < SAMPLES:
                chosen.append(kinds[kind].pop())
    return sorted(chosen), {kind: len(keys) for kind, keys in sorted(kinds.items())}


BODY = vector_names("x", "v", "w")
BOND = ["kappa"] + vector_names("eps_t", "eps_t_plastic")


def run_specimen(samples, trajectory, name, rate, steps, law, windows, snapshots):
    m, ends, length = specimen(rate, law)
    curve = []
    window = {}  # pair and step it was made in -> rows
    constants = {}
    report = []

    def collect():
        live = {}
        for i in O.interactions:
            live[i.id1, i.id2, i.iterMadeReal] = i
        for key in list(window):
            # a contact of this window that no longer exists gets its last row now
            if key not in live and window[key][-1][0]:
                window[key].append(contact_row(key[0], key[1], None))
        for key, i in live.items():
            window.setdefault(key, []).append(contact_row(key[0], key[1], i))
            constants[key] = constants_row(i)

    def record():
        step = O.iter
        if any(start <= step < start + WINDOW for start in windows):
            collect()
            if step + 1 in [start + WINDOW for start in windows]:
                chosen, kinds = choose(window, constants)
                report.append("%d: %s" % (step, kinds))
                for key in chosen:
                    rows = window[key]
                    table = "%s.%d.%d-%d" % (name, step + 1 - WINDOW, key[0], key[1])
                    if key[2] > 0:
                        table += ".%d" % key[2]
                    samples.add(table + ".constants", CONSTANTS, [constants[key]])
                    samples.add(table + ".steps", ALIVE, rows)
                window.clear()
                constants.clear()
        if step % 10 == 0:
            force = [sum(O.forces.f(k)[2] for k in group) for group in ends]
            strain = (O.bodies[ends[1][0]].state.pos[2] - O.bodies[ends[0][0]].state.pos[2]) / reach - 1.0
            curve.append([step, strain, force[0], force[1]])

    def snapshot():
        # after the integrator: positions of step n go with velocities of n - 1/2
        rows = [list(b.state.pos) + list(b.state.vel) + list(b.state.angVel) for b in O.bodies]
        trajectory.add("%s.bodies.%d" % (name, O.iter), BODY, rows)
        # bonds in the order of the table `bonds`, broken ones as NaN, then contacts formed later
        width = len(BOND) if O.iter == snapshots[-1] else 1
        alive, later = {}, []
        for i in O.interactions:
            p = i.phys
            row = [p.kappaD] + list(p.epsT) + list(p.epsTPl)
            if i.iterMadeReal == 0:
                alive[i.id1, i.id2] = row[:width]
            else:
                later.append([i.id1, i.id2, i.iterMadeReal] + row[:width])
        trajectory.add("%s.bonds.%d" % (name, O.iter), BOND[:width],
                       [alive.get((row[0], row[1]), [math.nan] * width) for row in bonds])
        trajectory.add("%s.later.%d" % (name, O.iter), ["id1", "id2", "born"] + BOND[:width], sorted(later))

    reach = O.bodies[ends[1][0]].state.pos[2] - O.bodies[ends[0][0]].state.pos[2]
    functor = O.engines[2].lawDispatcher.functors[0]
    samples.add(name + ".materials", MATERIAL, [material_row(m)])
    samples.add(name + ".law", LAW, [[functor.omegaThreshold, functor.epsSoft, functor.relKnSoft, 1.0, O.dt, 0, 0, 0]])
    trajectory.add(name + ".setup", ["dt", "damping", "interaction_ratio", "strain_rate", "length", "steps"],
                   [[O.dt, DAMPING, INTERACTION_RATIO, rate, length, steps]])
    end = {k: -1.0 for k in ends[0]}
    end.update({k: 1.0 for k in ends[1]})
    trajectory.add(
        name + ".initial", ["x", "y", "z", "r", "mass", "inertia", "v_x", "v_y", "v_z", "end"],
        [list(b.state.pos) + [b.shape.radius, b.state.mass, b.state.inertia[0]] + list(b.state.vel)
         + [end.get(b.id, 0.0)] for b in O.bodies])
    global record_now
    record_now = record
    bonds = []
    while O.iter < steps:
        O.step()
        if O.iter == 1:
            bo1.aabbEnlargeFactor = ig2.interactionDetectionFactor = 1
            # in the order in which YADE visits them and sums their forces
            bonds = [[i.id1, i.id2, i.phys.refLength] for i in O.interactions]
            if name == RUNS[0][0]:
                trajectory.add("bonds", ["id1", "id2", "length"], bonds)  # the same in all runs
        if O.iter in snapshots:
            snapshot()
    assert collider.numAction == 1, "the order of interactions has changed during the test"
    trajectory.add(name + ".curve", ["step", "strain", "force_low", "force_high"], curve)
    peak = (max if rate > 0 else min)(curve, key=lambda row: row[3] * -1.0)
    print("%s: %d bodies, %d contacts at the end, %d runs of the collider, largest end force %.4e N at strain %.4e" % (
        name, len(O.bodies), sum(1 for i in O.interactions), collider.numAction, peak[3], peak[1]))
    for line in report:
        print("   kinds not taken:", line)


def make_specimen():
    samples = Tables(os.path.join(OUT, "specimen.bin"))
    trajectory = Tables(os.path.join(OUT, "trajectory.bin"))
    for run in RUNS:
        run_specimen(samples, trajectory, *run)
    samples.close()
    trajectory.close()


if PART == "packing":
    make_packing()
if PART in ("law", "all"):
    make_law()
if PART in ("specimen", "all"):
    make_specimen()
