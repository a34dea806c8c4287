"""O.interactions of a scene with a bonded engine, in stock YADE: it answers with the bonds, whose attributes are those of stock YADE, and what
a script changes in them acts. The engine without headers and, where the plugin has been built, the native one."""
# threads: 1

import os
import random
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from harness import main, raises
from yade import utils

import concordem.yade as bridge
from concordem import YadeError

#: The tests in Debian 13 build the plugin into this folder, so there it must be found.
FORMS = (False, True) if os.environ.get("CONCORDEM_YADE_PLUGINS") else (False,)
if True in FORMS:
    bridge.load_native()
print("forms:", len(FORMS))
#: What no bond has: the slip of YADE's last step, and the iterations in which YADE made the interaction.
UNKNOWN = {"geom.shearInc", "iterBorn", "iterMadeReal"}


def taken_over(native, **options):
    if not native:
        return bridge.take_over(**options)
    e = BondedEngine_Rust()
    place = next(k for k, engine in enumerate(O.engines) if type(engine).__name__ == "InteractionLoop") + 1
    O.engines = O.engines[:place] + [e] + O.engines[place:]
    e.takeOver()
    return O.engines[place]


#: Attributes that are numbers or have numbers, by class.
_numeric = {}


def numbers(thing, prefix=""):
    """Every attribute that is a number or has numbers."""
    if type(thing) not in _numeric:
        values = {name: getattr(thing, name) for name in dir(thing) if not name.startswith("_")}
        _numeric[type(thing)] = [
            name for name, value in values.items() if isinstance(value, (bool, int, float)) or (hasattr(value, "__len__") and not isinstance(value, str))
        ]
    found = {}
    for name in _numeric[type(thing)]:
        value = getattr(thing, name)
        found[prefix + name] = (float(value),) if isinstance(value, (bool, int, float)) else tuple(float(x) for x in value)
    return found


def attributes():
    """Every attribute of every interaction, by pair."""
    found = {}
    for i in O.interactions:
        found[i.id1, i.id2] = {**numbers(i), **numbers(i.geom, "geom."), **numbers(i.phys, "phys.")}
    return found


def worst(one, two):
    """Largest difference of each attribute over its largest value in the scene."""
    assert set(one) == set(two), "the same pairs interact"
    found = {}
    for name in next(iter(one.values())):
        if name in UNKNOWN:
            continue
        a, b = (np.array([side[pair][name] for pair in sorted(side)]) for side in (one, two))
        scale = 1.0 if name == "phys.omega" else np.abs(a).max()
        # Attributes that the law leaves alone are NaN or 0 in both.
        assert (np.isnan(a) == np.isnan(b)).all(), name
        found[name] = np.nanmax(np.abs(a - b), initial=0) / (scale if scale > 0 else 1)
    return found


def block(rate=4.0, **options):
    """A small specimen after 250 steps, damaged in its middle."""
    chance = random.Random(1)
    spheres = [[*(2e-3 * n + chance.uniform(-1e-4, 1e-4) for n in place), 1e-3] for place in np.ndindex(5, 5, 9)]
    concrete(**{"rate": rate, "spheres": spheres, **options})
    O.run(250, True)


def test_every_attribute_is_that_of_stock_yade():
    """The same scene, with and without a bonded engine; the engine's sums are in another order. In tension with damage, in compression with
    slip and crushing, and with isotropic prestress."""
    for options in (dict(rate=4.0, spheres=sorted(packing(), key=lambda s: s[2])[:300]), dict(rate=-20.0, law=dict(epsSoft=-3e-4, relKnSoft=0.3)), dict(material=dict(MATERIAL, isoPrestress=-1e6))):
        block(**options)
        O.run(3, True)
        stock = attributes()
        assert len(stock) > 1000 and len(next(iter(stock.values()))) > 40
        for native in FORMS:
            block(**options)
            taken_over(native)
            O.run(3, True)
            found = worst(stock, attributes())
            name = max(found, key=found.get)
            print(options, "native" if native else "without headers", len(found), "attributes, worst:", name, "%.1e" % found[name])
            assert found[name] < 1e-12, (name, found[name])
            assert all(type(i.phys) is CpmPhys and type(i.geom) is ScGeom for i in O.interactions)


def periodic():
    O.reset()
    O.periodic = True
    O.cell.setBox(0.02, 0.02, 0.02)
    m = CpmMat(**MATERIAL)
    O.materials.append(m)
    rng = random.Random(3)
    for place in np.ndindex(6, 6, 6):
        x = [0.02 / 6 * (n + 0.5 + 0.1 * (rng.random() - 0.5)) for n in place]
        O.bodies.append(utils.sphere(x, 0.02 / 12, material=m, color=(1, 1, 1)))
    bound, geometry = Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5), Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([bound], verletDist=1e-4, allowBiggerThanPeriod=True),
        InteractionLoop([geometry], [Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)], [Law2_ScGeom_CpmPhys_Cpm()]),
        NewtonIntegrator(damping=0.2),
    ]
    O.dt = 1e-7
    O.step()
    bound.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.0
    O.cell.velGrad = type(O.cell.velGrad)(0, 0.3, 0, 0, 0, 0, 0, 0, 5.0)
    O.run(200, True)


def test_periodic_images():
    """The strain of a bond is a difference of positions, which are up to a thousand times its elongation: 1e-16 becomes 1e-11 of the largest."""
    periodic()
    O.run(3, True)
    stock = attributes()
    assert any(row["cellDist"] != (0, 0, 0) for row in stock.values())
    for native in FORMS:
        periodic()
        taken_over(native)
        O.run(3, True)
        found = worst(stock, attributes())
        name = max(found, key=found.get)
        print(name, "%.1e" % found[name])
        assert found[name] < 1e-10, (name, found[name])


def test_all_ways_to_ask():
    """Each way gives what YADE gives, with contacts of YADE's own beside the bonds."""

    def scene():
        concrete(spheres=half())
        wall = O.bodies.append(utils.wall(min(s[2] - s[3] for s in packing()) + 3e-4, 2, material=O.materials[0]))
        O.engines = O.engines[:1] + [InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=1.5e-3)] + O.engines[2:]
        loop = O.engines[2]
        O.engines = O.engines[:2] + [InteractionLoop(loop.geomDispatcher.functors + [Ig2_Wall_Sphere_ScGeom()], loop.physDispatcher.functors, loop.lawDispatcher.functors)] + O.engines[3:]
        O.run(20, True)
        return wall

    def answers(wall):
        pair = lambda i: (i.id1, i.id2)  # noqa: E731
        pairs = sorted(pair(i) for i in O.interactions)
        return dict(
            pairs=pairs,
            walls=sum(wall in p for p in pairs),
            real=O.interactions.countReal(),
            all=sorted(pair(i) for i in O.interactions.all(onlyReal=True)),
            nth=sorted(pair(O.interactions.nth(k)) for k in range(O.interactions.countReal())),
            one=[pair(O.interactions[p]) for p in pairs[:50]] + [pair(O.interactions[p[::-1]]) for p in pairs[:50]],
            has=[O.interactions.has(*p) for p in pairs[:50]] + [O.interactions.has(0, wall), O.interactions.has(3, 4000)],
            of_body=[sorted(map(pair, O.interactions.withBody(b.id))) for b in O.bodies],
            intrs=[sorted(map(pair, b.intrs())) for b in O.bodies],
        )

    wall = scene()
    stock = answers(wall)
    assert stock["walls"] > 3
    for native in FORMS:
        scene()
        e = taken_over(native)
        assert native or e._mirror is None, "made only for a script that asks"
        O.step()
        ours = answers(wall)
        assert ours == stock, [name for name in stock if stock[name] != ours[name]]
        assert len(O.interactions) >= len(stock["pairs"]) and O.interactions.nth(0) and isinstance(O.interactions.all(), list)
        assert (1, 999999) not in stock["pairs"]
        with raises(IndexError):
            O.interactions[1, 999999]
        e.give_back()
        assert type(O.interactions).__module__.startswith("yade") and O.interactions.countReal() == stock["real"], "YADE's own again"


def test_a_contact_that_opens_and_closes_between_two_looks():
    """It is another one, with a reference length of its own: an edit of any bond must not give it the old one."""

    def run(native):
        concrete(rate=0.0, damping=0.0, spheres=[(0, 0, 0, 1e-3), (0, 0, 2e-3, 1e-3), (0, 0, 3.9e-3, 1e-3), (0, 2e-3, 0, 1e-3)])
        for b in O.bodies:
            b.state.blockedDOFs = ""
        if native is not None:
            taken_over(native)
        O.interactions.erase(1, 2)
        O.run(2, True)
        seen = []
        O.bodies[2].state.vel = Vector3(0, 0, 0.1)
        for _ in range(6):
            contact = O.interactions[1, 2] if O.interactions.has(1, 2, True) else None
            seen.append((contact.phys.refLength, contact.phys.isCohesive, contact.phys.kn) if contact else None)
            O.interactions[0, 1].phys.setDamage(0.1 + 0.05 * len(seen))
            O.run(3, True)
        return seen, [tuple(b.state.pos) for b in O.bodies]

    stock, x = run(None)
    assert len({row for row in stock if row}) > 2
    for native in FORMS:
        seen, y = run(native)
        assert [row is None for row in seen] == [row is None for row in stock]
        assert np.allclose([row for row in seen if row], [row for row in stock if row], rtol=1e-12, atol=0)
        assert abs(np.array(x) - np.array(y)).max() < 1e-15


def test_it_ends_with_the_engine():
    block()
    e = bridge.take_over()
    O.step()
    assert O.interactions.countReal() > 500
    e.remove()
    assert O.interactions.countReal() == 0 and utils.fabricTensor is not None
    for native in FORMS:
        block()
        taken_over(native)
        O.interactions.countReal()
        O.reset()
        assert len(O.interactions) == 0
        # The same steps in another scene, so that nothing tells the two engines apart but the scene.
        block(rate=-4.0)
        taken_over(native)
        assert sum(i.phys.sigmaN for i in O.interactions) < 0
    before = O.interactions.countReal()
    file = os.path.join(os.environ.get("BRIDGE_WORK", "/tmp"), "container.yade.gz")
    if not FORMS[-1]:
        O.save(file)
        O.reset()
        O.load(file)
        assert O.interactions.countReal() == before


def test_values_are_those_of_the_step():
    """In a PyRunner before the engine, those of the last step; behind it, those of this one; in a run in the background, those of some step."""
    for native in FORMS:
        block()
        taken_over(native)
        import builtins

        builtins.seen = []
        builtins.look = lambda: builtins.seen.append((O.iter, sum(i.phys.kappaD for i in O.interactions)))
        runner = lambda: PyRunner(command="look()", iterPeriod=1, initRun=True)  # noqa: E731
        O.engines = O.engines[:1] + [runner()] + O.engines[1:] + [runner()]
        O.run(5, True)
        first, second = builtins.seen[2::2], builtins.seen[1:-1:2]
        assert len(first) == 4 and [value for _, value in first] == [value for _, value in second]
        assert len({value for _, value in first}) == 4
    O.run(2000)
    damages = [sum(i.phys.omega for i in O.interactions) for _ in range(20)]
    O.pause()
    O.wait()
    assert all(one <= two for one, two in zip(damages, damages[1:]))


def test_a_script_and_a_pyrunner_read_at_once():
    """In two threads; afterwards, objects that the script has kept still have the values of the present step."""
    import builtins

    builtins.look = lambda: sum(i.phys.kappaD for i in O.interactions)
    for native in FORMS:
        block(rate=60.0)
        taken_over(native)
        O.engines = O.engines + [PyRunner(command="look()", iterPeriod=1, initRun=True)]
        O.run(40)
        read = 0
        while O.running:
            sum(i.phys.omega for i in O.interactions)
            read += 1
        O.wait()
        assert read > 1, read
        kept = [(i, i.geom, i.phys) for i in O.interactions]
        before = [p.omega for _, _, p in kept]
        O.run(20, True)
        now = {(i.id1, i.id2): (i.phys.omega, i.geom.penetrationDepth) for i in O.interactions}
        assert all((p.omega, g.penetrationDepth) == now[i.id1, i.id2] for i, g, p in kept if i.isReal)
        assert sum(i.isReal for i, _, _ in kept) <= len(now) and [p.omega for i, _, p in kept] != before


# -- changes --------------------------------------------------------------------------------------------------------------


def pairs_of_notch():
    """Contacts that cross half of the middle plane."""
    x = positions()
    z = 0.5 * (x[:, 2].min() + x[:, 2].max())
    return sorted((i.id1, i.id2) for i in O.interactions if (x[i.id1][2] - z) * (x[i.id2][2] - z) < 0 and x[i.id1][0] < 0.005)


def cut():
    for pair in pairs_of_notch():
        O.interactions.erase(*pair)


def weaken():
    for k, i in enumerate(sorted(O.interactions, key=lambda i: (i.id1, i.id2))):
        if k % 5 == 0:
            i.phys.setDamage(0.5)
        if k % 7 == 0:
            i.phys.crossSection *= 0.5
        if k % 11 == 0:
            i.phys.isCohesive = False
        # What the law computes anew in each step acts neither in YADE nor here.
        i.phys.normalForce = Vector3(1, 2, 3)


def meddled(native, change, rate, motion=False, within=False):
    """150 steps after a change between two steps, or within one; native None: YADE alone."""
    import builtins

    block(rate=rate)
    if native is not None:
        engine = taken_over(native, **(dict(motion=True) if motion else {}))
    O.run(50, True)
    if within:
        builtins.change_once = lambda: change() if O.iter == 310 else None
        O.engines = O.engines + [PyRunner(command="change_once()", iterPeriod=1)]
        O.run(10, True)
    else:
        change()
    count = O.interactions.countReal()
    O.run(100, True)
    if native is False:
        assert engine.bond_count == sum(i.phys.isCohesive for i in O.interactions)
    return positions(), count, history()


def test_changes_of_bonds_act_as_in_yade():
    for change, rate in ((cut, 4.0), (cut, -20.0), (weaken, 4.0), (lambda: O.interactions.clear(), -20.0)):
        stock = {False: meddled(None, change, rate), True: meddled(None, change, rate, within=True)}
        way = 0.5e-3
        for native in FORMS:
            for motion, within in ((False, False), (True, False), (False, True)) if not native else ((False, False),):
                x, count, bonds = stock[within]
                y, ours, found = meddled(native, change, rate, motion, within)
                print("%.1e of the way" % (abs(x - y).max() / way), count, native, motion, within)
                assert ours == count and set(found) == set(bonds)
                assert abs(x - y).max() < 1e-9 * way


def test_what_cannot_be_followed_is_refused_by_name():
    def first():
        return next(iter(O.interactions))

    def stiffness():
        first().phys.E *= 0.5

    def inactive():
        first().isActive = False

    def other_physics():
        first().phys = FrictPhys()

    for native in FORMS:
        # The engine without headers follows (test_followed.py).
        for change, text in (((stiffness, "E of the contact of bodies 0 and 1"),) if native else ()) + ((inactive, "isActive of"), (other_physics, "phys of")):
            block()
            taken_over(native)
            O.step()
            change()
            for _ in range(2):
                with raises(YadeError, text):
                    O.step()
        block()
        taken_over(native)
        with raises(YadeError, "createInteraction(3, 4): both bodies belong to a bonded engine"):
            utils.createInteraction(3, 4)
        if native:
            # An object of an earlier step has neither the values of this one, nor an effect.
            kept = first()
            O.run(3, True)
            kept.phys.setDamage(0.7)
            with raises(YadeError, "kappaD of the contact of bodies 0 and 1 was changed in an object of an earlier step"):
                O.interactions.countReal()


def watched(ours, within=False, before=False, back=False):
    """What objects that a script has kept from the start say now and then, and what changes in them do. `ours`: not in stock YADE; `within`:
    a PyRunner reads them; `before`: they are from before the take-over; `back`: YADE gets the bonds back in mid-run. Returns the rows, and the positions."""
    import builtins

    block(rate=60.0 if back else -100.0, law=dict(omegaThreshold=0.5))
    if ours and not before:
        e = bridge.take_over()
    kept = [O.interactions[pair] for pair in sorted((i.id1, i.id2) for i in O.interactions if i.isReal)[::3]]
    parts = [(i.geom, i.phys) for i in kept]
    if ours and before:
        e = bridge.take_over()
    rows = []

    def read():
        """The odd ones by the objects themselves, the others by parts, where they are not those of a contact that has ended."""
        rows.append([])
        for k, (i, (geometry, physics)) in enumerate(zip(kept, parts)):
            g, p = (geometry, physics) if k % 2 and i.isReal and i.phys == physics and not back else (i.geom, i.phys)
            rows[-1].append((1, p.omega, p.normalForce[2], g.penetrationDepth, p.isCohesive) if i.isReal else (0,) * 5)

    builtins.read_kept = read
    if within:
        O.engines = O.engines + [PyRunner(command="read_kept()", iterPeriod=10, initRun=True)]
    for turn in range(6):
        O.run(30, True)
        if not within:
            read()
        if turn in (1, 3):
            for i, (_, physics) in list(zip(kept, parts))[turn::7]:
                physics = i.phys if back else physics
                if i.isReal and physics.isCohesive:
                    physics.setDamage(0.5 + 0.4 * i.phys.omega)
                    i.phys.crossSection *= 0.9
        if back and ours and turn in (2, 4):
            if turn == 2:
                e.give_back()
            else:
                e = bridge.take_over()
    return np.array(rows, float), positions()


def test_kept_objects():
    """An object of an interaction, or of its parts, that a script has kept from an earlier step has the values of the present one, and what the script
    changes in it acts, as in stock YADE. Some of the contacts end."""
    for options in (dict(), dict(within=True), dict(before=True), dict(before=True, within=True), dict(back=True)):
        rows, x = watched(False, **options)
        ended = (rows[..., 0] == 0).sum(axis=1)
        assert options.get("back") or 10 < ended[0] < ended[-1] < len(rows[0]) - 10, ended
        ours, y = watched(True, **options)
        assert ours.shape == rows.shape
        if options.get("back"):
            # Those of bonds that break while YADE has them stay as they were.
            there = rows[4, :, 4] == 1
            assert there.sum() > 100
            rows, ours = rows[:5, there], ours[:5, there]
        worst = [np.abs(rows[..., k] - ours[..., k]).max() / np.abs(rows[..., k]).max() for k in range(5)]
        print("kept objects:", options, len(rows[0]), "ended", *ended, ["%.1e" % w for w in worst])
        # Breaking bonds amplify the rounding of sums in another order.
        apart = abs(x - y).max()
        assert max(worst) < 1e-7 and apart < 1e-9 * 0.5e-3, (worst, apart)


def test_a_kept_container():
    """O.interactions in a variable of the script, from before the take-over, has the bonds as long as the engine has them."""
    block(rate=0.0)
    kept = O.interactions
    pairs = sorted((i.id1, i.id2) for i in kept if i.isReal)
    for native in FORMS:
        e = taken_over(native)
        O.step()
        assert len(e.contacts()["cpm"]) > 500 and sorted((i.id1, i.id2) for i in kept if i.isReal) == pairs
        assert kept.countReal() == len(pairs) == len(kept) == len(kept.all()) and kept.has(*pairs[3]) and kept[pairs[3]].isReal
        assert kept.withBody(60) == O.bodies[60].intrs() and len(kept.own) == 0
        # One of spheres that do not touch; others would touch again.
        apart = next(i for i in kept if i.geom.penetrationDepth < -1e-4)
        assert kept.nth(pairs.index((apart.id1, apart.id2))) == apart
        kept.erase(apart.id1, apart.id2)
        pairs.remove((apart.id1, apart.id2))
        O.step()
        assert kept.countReal() == len(pairs) and sorted((i.id1, i.id2) for i in kept) == pairs, (kept.countReal(), len(pairs))
        e.give_back()
        assert sorted((i.id1, i.id2) for i in kept if i.isReal) == pairs and kept.countReal() == len(pairs)


def test_changes_within_the_block_are_refused():
    """Within `with engine.interactions():` the bonds are interactions of YADE, which end with the block."""
    for change in (lambda: setattr(next(iter(O.interactions)).phys, "E", 1e9), lambda: O.interactions.erase(*[(i.id1, i.id2) for i in O.interactions][7])):
        for native in FORMS:
            block()
            e = taken_over(native)
            with raises(YadeError, "within the block"):
                with e.interactions():
                    change()
            O.run(2, True)


def test_other_laws():
    """Bonds of bond() have geometry and forces; what YADE does not have is NaN, and what it cannot compute is refused."""
    concrete(spheres=[(0, 0, k * 2e-3, 1e-3) for k in range(6)], rate=0.0)
    O.interactions.clear()
    e = bridge.bond(
        material={"name": "rod", "density": 2000, "cohesive_beam": {"young": 2e9, "poisson": 0.3, "radius_ratio": 0.5}},
        bonds={"law": "cohesive_beam", "interaction_ratio": 1.05},
        contacts={"law": "none"},
    )
    O.bodies[5].state.vel = Vector3(0.01, 0, 0.02)
    O.run(20, True)
    x, forces = e.forces()
    found = {(i.id1, i.id2): i for i in O.interactions}
    assert len(found) == 5 == O.interactions.countReal() and len(O.bodies[1].intrs()) == 2
    for pair, force in zip(forces.pair, forces.force):
        i = found[tuple(sorted(int(k) for k in pair))]
        sign = 1 if pair[0] < pair[1] else -1
        assert np.abs(np.array(i.phys.normalForce + i.phys.shearForce) + sign * force).max() < 1e-12 * np.abs(forces.force).max()
        assert math.isnan(i.phys.kn) and abs(i.geom.penetrationDepth) < 1e-4
    for function in (unbalancedForce, utils.fabricTensor, Law2_ScGeom_CpmPhys_Cpm().elasticEnergy):
        with raises(YadeError, "have another law"):
            function()
    with raises(YadeError, "cannot be erased"):
        O.interactions.erase(0, 1)
    O.interactions[0, 1].phys.normalForce = Vector3(1, 0, 0)
    with raises(YadeError, "normalForce of the contact of bodies 0 and 1"):
        O.step()


def test_loops_that_read_nothing():
    """Objects get their values when a script reads the first one: all is as if each step had been read, and what a script changes acts."""
    found = []
    for reads in (True, False):
        chance = random.Random(1)
        concrete(rate=20.0, spheres=[[*(2e-3 * n + chance.uniform(-1e-4, 1e-4) for n in place), 1e-3] for place in np.ndindex(4, 4, 7)])
        O.run(60, True)
        start = O.interactions.countReal()
        bridge.take_over()
        for step in range(40):
            O.step()
            if reads:
                sum(i.phys.omega for i in O.interactions)
            else:
                assert sum(1 for _ in O.interactions) > 100 and O.bodies[50].intrs()
            if step % 13 == 12:
                for i in list(O.interactions)[::50]:
                    i.phys.undamagedCohesion *= 0.5
                O.interactions.erase(*sorted((i.id1, i.id2) for i in O.interactions)[step])
        found.append((positions(), history()))
    assert np.array_equal(found[0][0], found[1][0]) and found[0][1] == found[1][1]
    assert 100 < len(found[0][1]) < start


main(globals())
