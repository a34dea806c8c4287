"""What the take-over of concrete refuses, in stock YADE: the bonded engine without headers and, where the plugin has been built, the
native one, with the same words."""
# threads: 1

import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, raises
from yade import utils

import concordem.yade as bridge
from concordem import YadeError
from concordem.yade import _concrete, _memory

#: The tests in Debian 13 build the plugin into this folder, so there it must be found.
FORMS = (False, True) if os.environ.get("CONCORDEM_YADE_PLUGINS") else (False,)
if True in FORMS:
    bridge.load_native()
print("forms:", len(FORMS))
PREFIX = "BondedEngine_Rust: "


def lattice():
    """A few spheres that touch, so that a scene takes milliseconds."""
    r = 3e-3
    return [[2 * r * i, 2 * r * j, 2 * r * k, r] for k in range(6) for j in range(3) for i in range(3)]


def scene(**options):
    concrete(**{"spheres": lattice(), **options})
    for _ in range(2):
        O.step()


def taken_over(native):
    if not native:
        return bridge.take_over()
    e = BondedEngine_Rust()
    O.engines = O.engines[:-1] + [e] + O.engines[-1:]
    e.takeOver()
    return O.engines[-2]


def refused(do, *texts, forms=FORMS):
    """After `do`, every form refuses the scene with one line that contains the texts, and leaves the interactions; returns the line."""
    lines = set()
    for native in forms:
        scene()
        do()
        count = len(O.interactions)
        with raises(RuntimeError if native else YadeError) as caught:
            taken_over(native)
        line = str(caught.value)
        if native:
            assert line.startswith(PREFIX), line
            line = line[len(PREFIX) :]
        lines.add(line)
        assert len(O.interactions) == count
    assert len(lines) == 1, lines
    (line,) = lines
    for text in texts:
        assert text in line and "\n" not in line, (text, line)
    return line


def first():
    return next(iter(O.interactions))


def loop(lists):
    """Puts an InteractionLoop with these functors in place of the one of the scene."""

    def do():
        O.engines = O.engines[:2] + [InteractionLoop(*lists())] + O.engines[3:]

    return do


def test_parameters_of_a_contact_are_those_of_its_materials():
    """A script has changed one attribute of one contact, by far more than rounding (1e-16). The engine without headers follows
    (test_followed.py); there is no third damage law."""

    def change(name, value):
        def do():
            i = first()
            changed.update(ids=(i.id1, i.id2), was=getattr(i.phys, name))
            setattr(i.phys, name, value(getattr(i.phys, name)))

        return do

    changed = {}
    native = FORMS[1:]
    for name in ("E", "G", "tanFrictionAngle", "undamagedCohesion", "epsCrackOnset", "epsFracture") if native else ():
        line = refused(change(name, lambda x: (1 + 1e-6) * x), f" has {name} = ", "set it back, or set the materials", forms=native)
        assert all(str(number) in line.partition(" has ")[0] for number in changed["ids"]), line
        # Rust and Python write the digits of a number alike, but not its exponent.
        found, given = line.partition(f" has {name} = ")[2].split(", but its materials give ")
        assert abs(float(found) / changed["was"] - 1 - 1e-6) < 1e-12 and abs(float(given.partition(",")[0]) / changed["was"] - 1) < 1e-12, line
    for name, value, text in (
        ("equivStrainShearContrib", 0.25, "0.25, but its materials give 0,"),
        ("isoPrestress", 1e5, "100000, but its materials give 0,"),
        ("damLaw", 0, "0, but its materials give 1,"),
        ("damLaw", 2, "2, but its materials give 1,"),
        ("neverDamage", True, "1, but its materials give 0,"),
    ):
        forms = FORMS if value == 2 else native
        if not forms:
            continue
        line = refused(change(name, lambda _: value), f" has {name} = {text}", "set it back, or set the materials", forms=forms)
        assert all(str(number) in line.partition(" has ")[0] for number in changed["ids"]), line
    # The lengths of the contact belong together, and to the radii of the bodies.
    refused(change("refLength", lambda x: 1.001 * x), "do not change only one of them")
    refused(change("refPD", lambda x: x + 1e-6), "do not change only one of them")
    refused(change("refLength", lambda _: np.nan), "has not been evaluated by its law")
    refused(lambda: setattr(O.bodies[5].shape, "radius", 1.001 * O.bodies[5].shape.radius), "do not change radii after bonding")


def test_parameters_of_the_materials_are_used():
    """What is refused in contacts acts if the materials have it: each attribute alone changes the motion of 20 steps in tension, in which
    damage grows, by 5 to 11 % of the way. Sums in another order differ by rounding (in test_bonds.py, by 1e-10 after 100 steps)."""

    def end(native, **special):
        scene(rate=40.0, material=dict(MATERIAL, **special))
        start = positions()
        if native is not None:
            taken_over(native)
        for _ in range(20):
            O.step()
        return positions(), abs(positions() - start).max()

    plain, way = end(None)
    for special in (dict(equivStrainShearContrib=0.25), dict(isoPrestress=-1e6), dict(damLaw=0), dict(neverDamage=True)):
        yades, _ = end(None, **special)
        assert abs(yades - plain).max() > 0.02 * way, special
        for native in FORMS:
            worst = abs(end(native, **special)[0] - yades).max()
            print(special, "native" if native else "without headers", "%.1e m of %.1e m" % (worst, way))
            assert worst < 1e-9 * way


def test_damage_laws():
    for law in (2, -1):
        refused(lambda: setattr(O.materials[0], "damLaw", law), f"damLaw of the material of body 0 is {law}; give 0 or 1")

    def two():
        O.bodies[5].material = CpmMat(**MATERIAL, damLaw=0)

    refused(two, "different damLaw", "give both the same")


def test_images():
    def move(image):
        def do():
            # A script cannot set it in every version of YADE.
            _concrete.write_images(np.array([_memory.address_of(first())], np.uint64), [image])
            assert tuple(first().cellDist) == image

        return do

    for image in ((0, -128, 0), (0, 0, 128)):
        line = refused(move(image), "spans more than 127 periodic cells", "O.cell.wrap")
        assert f"the contact of bodies {first().id1} and {first().id2} " in line, line


def test_functors():
    ig2, ip2, law2 = Ig2_Sphere_Sphere_ScGeom, Ip2_CpmMat_CpmMat_CpmPhys, Law2_ScGeom_CpmPhys_Cpm
    for lists, missing in (
        (lambda: ([], [ip2()], [law2()]), "Ig2_Sphere_Sphere_ScGeom"),
        (lambda: ([ig2()], [], [law2()]), "Ip2_CpmMat_CpmMat_CpmPhys"),
        (lambda: ([ig2()], [ip2()], []), "Law2_ScGeom_CpmPhys_Cpm"),
        (lambda: ([ig2()], [ip2()], [Law2_ScGeom_FrictPhys_CundallStrack()]), "Law2_ScGeom_CpmPhys_Cpm"),
    ):
        refused(loop(lists), f"InteractionLoop has no {missing}", "add it, or bond the spheres with bond()")

    def no_loop():
        O.engines = O.engines[:2] + O.engines[3:]

    def dead_loop():
        O.engines[2].dead = True

    def two_loops():
        O.engines = O.engines[:3] + [InteractionLoop([ig2()], [ip2()], [law2()])] + O.engines[3:]

    for do in (no_loop, dead_loop):
        refused(do, "O.engines has no active InteractionLoop; add one with Ig2_Sphere_Sphere_ScGeom, Ip2_CpmMat_CpmMat_CpmPhys, Law2")
    refused(two_loops, "O.engines has 2 active engines InteractionLoop; keep exactly one")

    def setting(dispatcher, name, value):
        return lambda: setattr(getattr(O.engines[2], dispatcher).functors[0], name, value)

    refused(
        setting("geomDispatcher", "interactionDetectionFactor", 1.5),
        "so new contacts would start at a distance; set it to 1 after the bonds have been created",
    )
    refused(setting("physDispatcher", "cohesiveThresholdIter", -1), "cohesiveThresholdIter is negative")
    if native := FORMS[1:]:
        # The engine without headers waits (test_late.py).
        refused(setting("physDispatcher", "cohesiveThresholdIter", 100), "YADE creates bonds until iteration 100 (cohesiveThresholdIter)", forms=native)
    refused(lambda: O.interactions.clear(), "there are no bonds to take over; let YADE create them first")


def test_spheres():
    """Concrete are the spheres with CpmMat and CpmState; one that has only one of the two is refused."""

    def other_state():
        O.bodies[5].state = State()

    def other_material():
        O.bodies[7].material = FrictMat()

    refused(other_state, "body 5 has CpmMat and State, but a sphere of concrete has CpmMat and CpmState; give it both, or neither")
    refused(other_material, "body 7 has FrictMat and CpmState, but a sphere of concrete has CpmMat and CpmState; give it both, or neither")
    # Spheres with neither, and other shapes, stay YADE's.
    found = set()
    for native in FORMS:
        scene()
        O.bodies.append(utils.sphere((1, 1, 1), 3e-3, material=FrictMat(), color=(1, 1, 1)))
        O.bodies.append(utils.facet([(2, 2, 2), (2, 2, 1), (2, 1, 2)], material=CpmMat(**MATERIAL), color=(1, 1, 1)))
        bonds = sum(i.isReal for i in O.interactions)
        engine = taken_over(native)
        O.step()
        found.add((len(engine.forces()[0]), engine.bondCount if native else engine.bond_count))
        assert found == {(len(lattice()), bonds)}, (found, bonds)


def test_contacts_of_other_functors():
    def physics():
        i = first()
        changed[:] = i.id1, i.id2
        i.phys = FrictPhys()

    changed = []
    line = refused(physics, "has FrictPhys and ScGeom, but a contact of concrete has CpmPhys and ScGeom; between spheres of CpmMat use only Ip2_CpmMat_CpmMat_CpmPhys")
    assert "the contact of bodies %d and %d " % tuple(changed) in line, line


main(globals())
