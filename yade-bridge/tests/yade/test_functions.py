"""Every function of YADE's modules, every engine, and every method of a law answers as in stock YADE while a bonded engine has the bonds, or is
refused by name: beside bonds of concrete, and of `CohFrictMat`. The lists come from YADE itself: a function that has no call here is an error.

The outcomes are in functions.json, from which the book's table is made; CONCORDEM_WRITE=1 writes it.
"""
# threads: 1

import bz2
import importlib
import inspect
import json
import math
import os
import pickle
import random
import re
import resource
import shutil
import signal
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
import cohesive_scene
from functions import CALLS, ENGINES
from harness import main
import gts
import pylab
import yade.params
from yade import config, export, minieigenHP, pack, plot, post2d, utils

import concordem.yade as bridge
from concordem import YadeError
from concordem.yade import _hooks

RESULTS = os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), "functions.json")
#: Of YADE's answer: sums in another order.
TOLERANCE = 1e-9


#: The bonds of a scene.
KINDS = ("concrete", "cohesive")


def of_concrete():
    """A specimen between a wall and a facet, with damaged bonds, whose next steps are those of stock YADE or of a bonded engine."""
    chance = random.Random(1)
    spheres = [[*(2e-3 * n + chance.uniform(-1e-4, 1e-4) for n in place), 1e-3] for place in np.ndindex(4, 4, 8)]
    concrete(rate=4.0, spheres=spheres)
    m = O.materials[0]
    top = max(s[2] for s in spheres) + 0.9e-3
    O.bodies.append(utils.wall((0, 0, -0.9e-3), 2, material=m, color=(1, 1, 1)))
    names = dict(
        mid=O.bodies[60],
        facet_id=O.bodies.append(utils.facet([(-1, -1, top), (1, -1, top), (0, 2, top)], material=m, color=(1, 1, 1))),
        ends=[b.id for b in O.bodies if b.state.blockedDOFs and b.state.pos[2] > 7e-3],
        low=Vector3(0, 0, 2e-3),
        high=Vector3(6e-3, 6e-3, 12e-3),
    )
    loop = O.engines[2]
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Facet_Aabb()], verletDist=1.5e-3),
        InteractionLoop(
            loop.geomDispatcher.functors + [Ig2_Wall_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
            loop.physDispatcher.functors,
            loop.lawDispatcher.functors,
        ),
        O.engines[3],
    ]
    O.run(150, True)
    return names


def of_cohesive_spheres():
    """A specimen of CohFrictMat on a facet, of which some bonds have broken."""
    radius = cohesive_scene.RADIUS
    cohesive_scene.lattice(counts=(4, 4, 8), rate=4.0)
    low = min(b.state.pos[2] for b in O.bodies) - 0.95 * radius
    names = dict(
        mid=O.bodies[60],
        facet_id=O.bodies.append(utils.facet([(-1, -1, low), (1, -1, low), (0, 2, low)], material=O.materials[0], color=(1, 1, 1))),
        ends=[b.id for b in O.bodies if b.state.blockedDOFs and b.state.pos[2] > 8 * radius],
        low=Vector3(0, 0, 2 * radius),
        high=Vector3(6 * radius, 6 * radius, 12 * radius),
    )
    loop = O.engines[2]
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=0.2 * radius),
        InteractionLoop(
            loop.geomDispatcher.functors[:1] + [Ig2_Facet_Sphere_ScGeom6D()],
            loop.physDispatcher.functors,
            loop.lawDispatcher.functors,
        ),
        O.engines[3],
    ]
    O.run(150, True)
    return names


def taken_over(kind, ours, laws=()):
    """`laws`: functors of other laws that O.engines has, too; then there are no contacts but bonds at the end."""
    names = of_concrete() if kind == "concrete" else of_cohesive_spheres()
    if laws:
        loop = O.engines[2]
        functors = loop.lawDispatcher.functors + [getattr(yade.wrapper, law)() for law in laws]
        O.engines = O.engines[:2] + [InteractionLoop(loop.geomDispatcher.functors, loop.physDispatcher.functors, functors)] + O.engines[3:]
    if ours:
        bridge.take_over()
    O.run(20, True)
    for i in list(O.interactions) if laws else []:
        if not (isinstance(O.bodies[i.id1].shape, Sphere) and isinstance(O.bodies[i.id2].shape, Sphere)):
            O.interactions.erase(i.id1, i.id2)
    return names


def flat(value):
    """What can be compared of an answer, as a list."""
    if value is None or isinstance(value, (bool, str)):
        return [value]
    if isinstance(value, (int, float)):
        return [float(value)]
    if isinstance(value, dict):
        return [part for key in sorted(value, key=str) for part in [str(key), *flat(value[key])]]
    if hasattr(value, "row") and hasattr(value, "cols"):
        return [float(value[i, j]) for i in range(value.rows()) for j in range(value.cols())]
    if type(value).__name__ == "Matrix3":
        return [float(value[i, j]) for i in range(3) for j in range(3)]
    if hasattr(value, "__len__"):
        return [part for k in range(len(value)) for part in flat(list(value)[k] if isinstance(value, (set, range)) else value[k])]
    return [type(value).__name__]


def same(one, two):
    """Largest difference of two answers over the largest number; infinite if their forms differ."""
    one, two = flat(one), flat(two)
    numbers = [[x for x in side if isinstance(x, float)] for side in (one, two)]
    if [x if not isinstance(x, float) else 0 for x in one] != [x if not isinstance(x, float) else 0 for x in two]:
        return math.inf
    a, b = np.array(numbers[0]), np.array(numbers[1])
    if not len(a):
        return 0.0
    if (np.isnan(a) != np.isnan(b)).any() or (np.isinf(a) != np.isinf(b)).any():
        return math.inf
    finite = np.isfinite(a)
    scale = np.abs(a[finite]).max(initial=0)
    return float(np.abs(a[finite] - b[finite]).max(initial=0) / (scale or 1))


class Bonds2d(post2d.Flatten):
    def __call__(self, i):
        return i.geom.contactPoint[0], i.geom.contactPoint[1]

    def planar(self, i, vector):
        return vector[0], vector[1]

    def normal(self, i, vector):
        return vector[2]


def namespace(names):
    folder = tempfile.mkdtemp()

    def words(path):
        """The numbers of a file, rounded, without the time of day; lines in any order, since YADE's files list interactions in theirs."""
        lines = []
        for line in open(folder + path):
            if line.startswith("# created"):
                continue
            parts = []
            for word in line.split():
                try:
                    parts.append("%.7g" % float(word))
                except ValueError:
                    parts.append(word.replace(folder, ""))
            lines.append(" ".join(parts))
        return sorted(lines)

    def vtk(call):
        call(export.VTKExporter(folder + "/vtk"))
        files = sorted(name for name in os.listdir(folder) if name.endswith(".vtk"))
        return [(len(lines := words("/" + name)), sums(lines)) for name in files]

    def sums(lines):
        """Sums of the numbers of a file and of their squares, in each column: the order of lines is YADE's."""
        rows = [[float(word) for word in line.split()] for line in lines if re.fullmatch(r"[-+.e\d ]+", line)]
        return [[len(row := [r for r in rows if len(r) == n]), sum(map(sum, row)), sum(x * x for r in row for x in r)] for n in (1, 2, 3)]

    def pack_of(call):
        return call(pack.SpherePack())

    def line():
        return pylab.gca().plot([1, 2], [3, 4])[0]

    def figure(call):
        """What a function of yade.plot draws and writes: the numbers of all curves, and files without the time of day."""
        plot.reset()
        plot.plots = {"a": ("b",)}
        for a in (1, 2):
            plot.addData(a=a, b=a * O.interactions.countReal())
        call()
        files = sorted(name for name in os.listdir(folder) if not name.endswith((".py", ".gnuplot")) and name != "table")
        data = [bz2.open(folder + "/" + name, "rt").read() if name.endswith(".bz2") else os.path.getsize(folder + "/" + name) > 100 for name in files]
        return [[line.get_ydata() for axes in figure.axes for line in axes.lines] for figure in map(pylab.figure, pylab.get_fignums())], files, data

    def bars():
        """Heights of the bars, and values of the colored circles, of the present diagram."""
        return [bar.get_height() for bar in pylab.gca().patches], [part.get_array() for part in pylab.gca().collections]

    table = folder + "/table"
    with open(table, "w") as file:
        file.write("a b\n1 2\n3 4\n")
    return {
        **globals(),
        **names,
        "folder": folder,
        "words": words,
        "vtk": vtk,
        "pack_of": pack_of,
        "table": table,
        "line": line,
        "figure": figure,
        "bars": bars,
        "params": yade.params,
        "grid": RegularGrid(min=(-1.5, -1.5, -1.5), nGP=(4, 4, 4), spacing=1.0),
        "levels": minieigenHP.AlignedBox3((-1, -1, -1), (1, 1, 1)),
        "surface": gts.sphere(2),
        "triax": TriaxialCompressionEngine(**{f"wall_{side}_id": k for side, k in zip(("left", "bottom", "back", "right", "top", "front"), (0, 0, 0, 127, 127, 127))}),
        "corners": [Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1)],
        "kinetic": lambda: utils.kineticEnergy(),
        "energy": lambda: [utils.kineticEnergy(), utils.unbalancedForce(), [b.state.pos for b in O.bodies]],
    }


#: Names of the prepared scene.
_names = {}


def prepare(kind, ours, laws=()):
    """Prepare the scene in which every call acts in a process of its own, so that it need not be built for each."""
    _names.clear()
    _names.update(taken_over(kind, ours, laws))


def by_steps(self, nSteps=-1, wait=False):
    """O.run in a forked process, which does not have the thread of YADE's loop."""
    assert nSteps > 0
    _hooks.check()
    for _ in range(nSteps):
        self.step()


def answer(call, names):
    space = namespace(names)
    try:
        return "answer", flat(eval(call, space))
    except YadeError as error:
        return "refused", str(error)
    except Exception as error:
        return "error", f"{type(error).__name__}: {error}"
    finally:
        shutil.rmtree(space["folder"])


def answered(call):
    """What a call gives in the prepared scene: ("answer", numbers), ("refused", text), or ("error", text); None if it ends the process."""

    def forked():
        yade.wrapper.Omega.run = by_steps
        return answer(call, _names)

    return in_a_child(forked)


def functions_of(name):
    """The functions and classes that a module of YADE gives to scripts."""
    module = importlib.import_module("yade." + name)
    found = []
    for key in dir(module):
        value = getattr(module, key)
        home = getattr(value, "__module__", None) or ""
        of_c = type(value).__name__ == "function" and not inspect.isfunction(value)
        if callable(value) and not key.startswith("_") and (of_c or home == "yade." + name or (home.startswith("yade._pack") and name == "pack")):
            found.append(key)
    return found


#: Of each module of CALLS, before the first take-over, which replaces some.
FUNCTIONS = {module: functions_of(module) for module in CALLS}


def outcome(call, stock, ours):
    """What the book says of a function: that it answers as YADE does, or how it is refused; raises if neither."""
    if ours and ours[0] == "refused":
        return "refused: " + ours[1]
    if stock is None:
        assert ours is None, (call, "ends stock YADE, but not the bonded engine", ours)
        return "ends stock YADE in this scene"
    assert ours is not None, f"{call} ended the process, or took a minute of processor time"
    (kind, wanted), (ours, found) = stock, ours
    if kind == ours == "error":
        assert wanted == found, (call, wanted, found)
        return "as YADE: " + wanted.splitlines()[0][:100]
    assert (kind, ours) == ("answer", "answer"), (call, kind, wanted if kind == "error" else "", ours, found if ours == "error" else "")
    if "getCapillaryStress" in call:
        # Stock YADE takes each interaction for one of CapillaryPhys, and adds up what lies in memory behind it.
        assert len(wanted) == len(found) == 9
        return "as YADE"
    difference = same(wanted, found)
    assert difference < TOLERANCE, (call, difference, str(wanted)[:300], str(found)[:300])
    return "as YADE"


def in_both(kind, calls, one, laws=()):
    """`one(call, ours)` for each call, in the prepared scene of stock YADE and beside a bonded engine."""
    found = []
    for ours in (False, True):
        prepare(kind, ours, laws)
        found.append([one(call, ours) for call in calls])
    return zip(calls, *found)


def test_every_function():
    for kind in KINDS:
        found, wrong, asked = {}, [], {}
        for module, calls in CALLS.items():
            here = FUNCTIONS[module]
            assert len(here) > 5, module
            unknown = sorted(set(here) - set(calls))
            assert not unknown, f"yade.{module} has functions without a call in functions.py: {unknown}"
            asked.update({f"{module}.{name}": calls[name] if kind == "concrete" else calls[name].replace("epsN", "normalAdhesion") for name in here})

        def one(name, ours):
            if "pack.random" not in asked[name]:
                return answered(asked[name])
            # They run scenes of their own, until they are dense.
            found = answer(asked[name], taken_over(kind, ours))
            prepare(kind, ours)
            return found

        for name, stock, ours in in_both(kind, list(asked), one):
            try:
                found[name] = outcome(asked[name], stock, ours)
            except AssertionError as error:
                wrong.append(f"{name}: {error}")
        assert not wrong, "\n".join([kind, *wrong])
        compare("functions", kind, found)


def in_a_child(call):
    """What `call` returns in a process of its own, because some engines end the process; None if it died, or took longer than 60 s of processor time,
    which other processes do not lengthen."""
    reader, writer = os.pipe()
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
        # One that waits forever.
        signal.alarm(600)
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            with os.fdopen(writer, "wb") as file:
                pickle.dump(call(), file)
        finally:
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as file:
        data = file.read()
    os.waitpid(child, 0)
    return pickle.loads(data) if data else None


def numbers_of_files(folder):
    """How many numbers each file has, with their sums and those of their squares."""
    found = []
    for path, _, names in sorted(os.walk(folder)):
        for name in sorted(names):
            text = open(os.path.join(path, name), errors="replace").read()
            numbers = [float(x) for x in re.findall(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])", text)]
            found += [name, float(len(numbers)), sum(numbers), sum(x * x for x in numbers)]
    return found


def with_engine(name, kind):
    """Bodies, time step, and files after two steps of the prepared scene with an engine of this class behind the others."""
    folder = tempfile.mkdtemp()
    # Some engines write files there.
    os.chdir(tempfile.mkdtemp())
    settings = {key: value.replace("FOLDER", folder) if isinstance(value, str) else value for key, value in ENGINES.get(name, {}).items()}
    if kind == "cohesive" and "recorders" in settings:
        # Else stock YADE reads a damage that these states do not have.
        settings["recorders"] = [recorder for recorder in settings["recorders"] if recorder != "cpm"]
    try:
        engine = getattr(yade.wrapper, name)(**settings)
        O.engines = O.engines[:-1] + [engine] + O.engines[-1:]
        O.step()
        O.step()
        numbers = {key: flat(value) for key, value in engine.dict().items() if not key.startswith("real") and key != "fileName" and key != "file"}
        states = [(b.state.pos, b.state.vel, getattr(b.state, "normDmg", 0.0), getattr(b.state, "numBrokenCohesive", 0.0)) for b in O.bodies]
        return "answer", (flat(states), O.dt, numbers, numbers_of_files(folder))
    except YadeError as error:
        return "refused", str(error)
    except Exception as error:
        return "error", f"{type(error).__name__}: {error}".replace(folder, "")
    finally:
        shutil.rmtree(folder)


def outcome_of_engine(name, stock, ours):
    if ours is not None and ours[0] == "refused":
        return "refused: " + ours[1]
    if stock is None:
        assert ours is None, (name, "ends stock YADE, but not the bonded engine", ours[0])
        return "ends stock YADE in this scene"
    assert ours is not None, (name, "died")
    if stock[0] == ours[0] == "error":
        assert stock[1] == ours[1], (name, stock, ours)
        return "as YADE: an error"
    assert stock[0] == ours[0] == "answer", (name, stock[0], stock[1] if stock[0] == "error" else "", ours[0], ours[1] if ours[0] == "error" else "")
    for what, one, two in zip(("states", "O.dt", "attributes", "files"), stock[1], ours[1]):
        assert same(one, two) < TOLERANCE, (name, what, same(one, two), str(one)[:300], str(two)[:300])
    return "as YADE"


def test_every_engine():
    wrapper = yade.wrapper
    names = sorted(n for n in dir(wrapper) if isinstance(getattr(wrapper, n), type) and issubclass(getattr(wrapper, n), wrapper.Engine))
    assert len(names) > 90
    for kind in KINDS:
        found, wrong = {}, []
        stocks = [name for name in names if not name.endswith("_Rust")]
        for name, stock, ours in in_both(kind, stocks, lambda name, ours: in_a_child(lambda: with_engine(name, kind))):
            try:
                found[name] = outcome_of_engine(name, stock, ours)
            except AssertionError as error:
                wrong.append(str(error))
        assert not wrong, "\n".join([kind, *wrong])
        compare("engines", kind, found)


#: What methods of laws are called with.
ARGUMENTS = {"initPlasticDissipation": "1.5", "yieldSigmaTMagnitude": "-1e6, 0.2, 3e6, 0.8"}
#: Physics of the bonds.
PHYSICS = {"concrete": "CpmPhys", "cohesive": "CohFrictPhys"}


def methods_of_laws():
    """Laws, and their methods."""
    laws = sorted(n for n in dir(yade.wrapper) if n.startswith("Law2_") and not n.endswith("_Rust"))
    found = {law: vars(getattr(yade.wrapper, law)) for law in laws}
    return {law: [m for m, f in own.items() if not m.startswith("_") and (callable(f) or isinstance(f, staticmethod))] for law, own in found.items()}


def takes_for_its_own(law, kind):
    """Whether contacts of these bonds are contacts of a law, by the physics in its name."""
    physics = getattr(yade.wrapper, law.split("_")[2], None)
    return physics is not None and issubclass(getattr(yade.wrapper, PHYSICS[kind]), physics)


def test_every_method_of_a_law():
    """Of every law that O.engines has besides that of the bonds. Some methods take contacts of every law for their own, without a look at their class:
    numbers without meaning, or the end of stock YADE. They find no bonds, and answer as in stock YADE without contacts."""
    methods = {law: names for law, names in methods_of_laws().items() if names}
    asked = {}
    for law, names in methods.items():
        for name in names:
            asked[f"{law}.{name}"] = f"next(f for f in O.engines[2].lawDispatcher.functors if type(f).__name__ == {law!r}).{name}({ARGUMENTS.get(name, '')})"
    for kind in KINDS:
        present = {"concrete": "Law2_ScGeom_CpmPhys_Cpm", "cohesive": "Law2_ScGeom6D_CohFrictPhys_CohesionMoment"}[kind]
        others = sorted(set(methods) - {present})
        found, wrong = {}, []
        alone = {}
        prepare(kind, False, others)
        O.interactions.clear()
        for name, call in asked.items():
            alone[name] = answered(call)
        for name, stock, ours in in_both(kind, list(asked), lambda name, ours: answered(asked[name]), others):
            try:
                found[name] = outcome(asked[name], stock, ours)
            except AssertionError as error:
                if takes_for_its_own(name.split(".")[0], kind):
                    wrong.append(f"{name}: {error}")
                    continue
                try:
                    outcome(asked[name], alone[name], ours)
                except AssertionError as error:
                    wrong.append(f"{name}: {error}")
                    continue
                found[name] = "no bonds"
        assert not wrong, "\n".join([kind, *wrong])
        assert found[f"{present}.elasticEnergy"] == "as YADE"
        compare("laws", kind, found)


def compare(what, kind, found):
    """The outcomes are those of the file from which the book is made."""
    with open(RESULTS) as file:
        kept = json.load(file)
    version = str(config.version)
    if os.environ.get("CONCORDEM_WRITE"):
        kept.setdefault(what, {}).setdefault(kind, {})[version] = found
        with open(RESULTS, "w") as file:
            json.dump(kept, file, indent=1, sort_keys=True)
            file.write("\n")
    told = kept.get(what, {}).get(kind, {}).get(version, {})
    other = {name: (told.get(name), found.get(name)) for name in {**told, **found} if told.get(name) != found.get(name)}
    assert not other, f"functions.json is not up to date; write it with CONCORDEM_WRITE=1: {what}, {kind}: {other}"


main(globals())
