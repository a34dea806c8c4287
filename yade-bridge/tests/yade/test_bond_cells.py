"""`bond` in periodic cells and with clumps, against stock YADE's concrete and closed forms."""

import os
import random
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, on_two_threads, raises
from yade import utils

import concordem.yade as bridge
from concordem import YadeError

#: The law of stock YADE, with its formulation and its kinematics.
CONCRETE = dict(
    material={
        "name": "concrete",
        "density": 4800,
        "cpm": {
            "mode": "yade-public",
            "young": MATERIAL["young"],
            "shear_ratio": MATERIAL["poisson"],
            "cohesion": MATERIAL["sigmaT"],
            "friction_angle": MATERIAL["frictionAngle"],
            "crack_onset_strain": MATERIAL["epsCrackOnset"],
            "relative_ductility": MATERIAL["relDuctility"],
            "damage_law": "exponential",
            "omega_threshold": 1.0,
        },
    },
    bonds={"law": "cpm", "interaction_ratio": 1.5},
    contacts={"law": "cpm"},
    kinematics="yade-ratcheting",
)
#: Of the largest displacement: sums in another order, 1e-16 of a force in each step, until bonds are damaged.
TOLERANCE = 1e-9


def array(matrix):
    return np.array([[matrix[i, j] for j in range(3)] for i in range(3)])


def scene(size, clumps=(), reach=1.0, edge=None, damping=0.2):
    """Spheres of concrete on a lattice with random offsets, in a periodic cell if it has an `edge`; `clumps`: lists of bodies."""
    O.reset()
    if edge:
        O.periodic = True
        O.cell.setBox(edge, edge, edge)
    chance = random.Random(3)
    m = O.materials.append(CpmMat(**{**MATERIAL, "density": 4800}))
    for place in np.ndindex(*size):
        x = [2e-3 * (n + 0.5) + chance.uniform(-1e-4, 1e-4) for n in place]
        O.bodies.append(utils.sphere(x, 1e-3, material=O.materials[m], color=(1, 1, 1)))
    for members in clumps:
        O.bodies.clump(members)
    O.dt = 0.3 * utils.PWaveTimeStep()
    # NewtonIntegrator moves the members of clumps to their places.
    O.engines = [ForceResetter(), NewtonIntegrator()]
    O.step()
    bound, geometry = Bo1_Sphere_Aabb(aabbEnlargeFactor=reach), Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=reach)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([bound], verletDist=2e-4, allowBiggerThanPeriod=True),
        InteractionLoop([geometry], [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=2)], [Law2_ScGeom_CpmPhys_Cpm()]),
        NewtonIntegrator(damping=damping),
    ]
    return bound, geometry


def both(run, **options):
    """What `run()` returns in stock YADE, where the first step makes the bonds, and with `bond`."""
    bound, geometry = scene(**options, reach=1.5)
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.0
    stock = run()
    scene(**options)
    bridge.bond(**CONCRETE)
    O.step()
    return stock, run()


def moved():
    return np.array([tuple(b.state.pos - b.state.refPos) for b in O.bodies])


def close(stock, ours, tolerance=TOLERANCE):
    for one, two in zip(stock, ours):
        one, two = np.asarray(one, float), np.asarray(two, float)
        assert one.shape == two.shape and abs(one).max() > 0
        worst = abs(one - two).max() / abs(one).max()
        print("largest difference %.1e" % worst)
        assert worst < tolerance, worst


@on_two_threads
def test_a_cell_of_concrete():
    """Strains and shear of the cell, until bonds are damaged, and its stress; bonds across the borders."""

    def run():
        rows = []
        for rate in ((30, 0, 0, 0, -10, 0, 0, 0, 5), (0, 40, 0, 0, 0, 20, 0, 0, 0), (60, 0, 0, 0, 60, 0, 0, 0, 60)):
            O.cell.velGrad = Matrix3(*map(float, rate))
            O.run(60, True)
            rows.append(array(utils.getStress()).reshape(-1))
        across = sum(1 for i in O.interactions if tuple(i.cellDist) != (0, 0, 0))
        return rows, moved(), [O.interactions.countReal(), across]

    stock, ours = both(run, size=(5, 5, 5), edge=1e-2)
    assert stock[2][1] > 100
    close(stock, ours)
    (engine,) = bridge.engines()
    assert np.allclose(engine.stress(), array(utils.getStress()).T, rtol=1e-9)


def test_a_lattice_in_closed_form():
    """A cubic lattice of linear bonds of stiffness k and length d: the stress of a strain e along an axis is k e / d."""
    O.reset()
    O.periodic = True
    d, k, n = 2e-3, 1e6, 4
    O.cell.setBox(n * d, n * d, n * d)
    m = O.materials.append(FrictMat(density=2000))
    for place in np.ndindex(n, n, n):
        O.bodies.append(utils.sphere([d * (x + 0.25) for x in place], d / 2, material=O.materials[m], color=(1, 1, 1)))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()], allowBiggerThanPeriod=True),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]),
        NewtonIntegrator(),
    ]
    O.dt = 1e-7
    engine = bridge.bond(
        material={"name": "rods", "density": 2000, "linear_bond": {"normal_stiffness": k, "shear_stiffness": 0.3 * k, "normal_strength": 1e6, "shear_strength": 1e6}},
        bonds={"law": "linear_bond", "interaction_ratio": 1.01},
        contacts={"law": "none"},
    )
    assert engine.bond_count == 3 * n**3
    O.cell.velGrad = Matrix3(10, 0, 0, 0, -4, 0, 0, 0, 0)
    O.run(200, True)
    found = engine.stress()
    # Lengths of the cell after 200 steps; forces of the last step act over lengths of the present one (1e-6 of them per step).
    e = [O.cell.trsf[i, i] - 1 for i in range(3)]
    area = [d * d * (1 + e[j]) * (1 + e[l]) for j, l in ((1, 2), (0, 2), (0, 1))]
    for i in range(3):
        wanted = k * d * e[i] / area[i]
        assert abs(found[i, i] - wanted) <= 0.01 * max(abs(wanted), 1.0), (i, found[i, i], wanted)
    off = found - np.diag(np.diag(found))
    assert abs(off).max() < 1e-9 * abs(found).max()


@on_two_threads
def test_clumps():
    """Clumps of spheres in concrete that is pulled apart: no bonds within them, as in stock YADE, which moves them."""
    members = [[0, 1, 4], [50, 51], [30, 34, 46]]

    def run():
        for b in O.bodies:
            if b.isStandalone or b.isClump:
                b.state.vel = Vector3(0, 0, 60 * (b.state.pos[2] - 8e-3))
        O.run(120, True)
        inside = sum(1 for i in O.interactions if any({i.id1, i.id2} <= set(c) for c in members))
        assert inside == 0
        spin = [tuple(O.bodies[c[0]].state.angVel) for c in members]
        return moved(), spin, [O.interactions.countReal()]

    # Without YADE's damping, which turns on the sign of a spin that is 0 but for rounding in the first step.
    stock, ours = both(run, size=(4, 4, 8), clumps=members, damping=0.0)
    close(stock, ours)


def test_they_are_saved():
    """In a cell, with a clump: the same bits after O.load."""
    path = os.path.join(tempfile.mkdtemp(), "cell.yade.gz")
    scene(size=(5, 5, 5), edge=1e-2, clumps=[[0, 1], [60, 61]])
    bridge.bond(**CONCRETE)
    O.cell.velGrad = Matrix3(30, 5, 0, 0, -10, 0, 0, 0, 5)
    O.run(30, True)
    O.save(path)
    O.run(30, True)
    straight = moved()
    O.load(path)
    O.run(30, True)
    assert (moved() == straight).all() and bridge.engines()[0].bond_count > 100


def test_what_is_refused():
    scene(size=(5, 5, 5), edge=1e-2)
    O.bodies[3].state.pos += Vector3(1e-2, 0, 0)
    with raises(YadeError, "body 3 is outside of the periodic cell"):
        bridge.bond(**CONCRETE)
    O.bodies[3].state.pos = O.cell.wrap(O.bodies[3].state.pos)
    O.cell.hSize = Matrix3(1e-2, 1e-3, 0, 0, 1e-2, 0, 0, 0, 1e-2)
    with raises(YadeError, "needs a rectangular periodic cell"):
        bridge.bond(**CONCRETE)
    scene(size=(4, 4, 4), clumps=[[0, 1]])
    soft = {"name": "soft", "density": 4800, "linear_bond": {"normal_stiffness": 1e6, "shear_stiffness": 1e5}, "deformable": {"young": 60e9, "poisson": 0.25}}
    with raises(YadeError, "spheres of clumps are rigid"):
        bridge.bond(material=soft, bonds={"law": "linear_bond", "interaction_ratio": 1.1}, deformable={"condition": "solid"})


main(globals())
