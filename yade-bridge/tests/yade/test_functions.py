"""Every function of YADE's modules, every engine, and every method of a law answers as in stock YADE while a bonded engine has the bonds, or is
refused by name. The lists come from YADE itself: a function that has no call here is an error.

The outcomes are in functions.json, from which the book's table is made; CONCORDEM_WRITE=1 writes it.
"""
# threads: 1

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
from functions import APART, CALLS, ENGINES
from harness import main
from yade import config, export, pack, plot, post2d, utils

import concordem.yade as bridge
from concordem import YadeError
from concordem.yade import _hooks

RESULTS = os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), "functions.json")
#: Of YADE's answer: sums in another order.
TOLERANCE = 1e-9


def scene(rate=4.0):
    """A specimen between a wall and a facet, with damaged bonds, whose next steps are those of stock YADE or of a bonded engine."""
    chance = random.Random(1)
    spheres = [[*(2e-3 * n + chance.uniform(-1e-4, 1e-4) for n in place), 1e-3] for place in np.ndindex(4, 4, 8)]
    concrete(rate=rate, spheres=spheres)
    m = O.materials[0]
    top = max(s[2] for s in spheres) + 0.9e-3
    names = dict(
        mid=O.bodies[60],
        wall_id=O.bodies.append(utils.wall((0, 0, -0.9e-3), 2, material=m, color=(1, 1, 1))),
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


def taken_over(ours):
    names = scene()
    if ours:
        bridge.take_over()
    O.run(20, True)
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
        """The numbers of a file, rounded; lines in any order, since YADE's files list interactions in theirs."""
        lines = []
        for line in open(folder + path):
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
        "corners": [Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1)],
        "kinetic": lambda: utils.kineticEnergy(),
        "energy": lambda: [utils.kineticEnergy(), utils.unbalancedForce(), [b.state.pos for b in O.bodies]],
    }


#: Names of the prepared scene.
_names = {}


def prepare(ours):
    """Prepare the scene in which every call acts in a process of its own, so that it need not be built for each."""
    _names.clear()
    _names.update(taken_over(ours))


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


def answered(call, ours):
    """What a call gives in the prepared scene: ("answer", numbers), ("refused", text), or ("error", text)."""

    def forked():
        yade.wrapper.Omega.run = by_steps
        return answer(call, _names)

    if "pack.random" in call:
        # They run scenes of their own, until they are dense.
        found = answer(call, taken_over(ours))
        prepare(ours)
        return found
    found = in_a_child(forked)
    assert found is not None, f"{call} ended the process, or took a minute of processor time"
    return found


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


def outcome(call, stock, ours):
    """What the book says of a function: that it answers as YADE does, or how it is refused; raises if neither."""
    kind, wanted = stock
    ours, found = ours
    if ours == "refused":
        return "refused: " + found
    if kind == ours == "error":
        assert wanted == found, (call, wanted, found)
        return "as YADE: " + wanted.splitlines()[0][:100]
    assert (kind, ours) == ("answer", "answer"), (call, kind, wanted if kind == "error" else "", ours, found if ours == "error" else "")
    difference = same(wanted, found)
    assert difference < TOLERANCE, (call, difference, str(wanted)[:300], str(found)[:300])
    return "as YADE"


def in_both(calls, one):
    """`one(call)` for each call, in the prepared scene of stock YADE and beside a bonded engine."""
    found = []
    for ours in (False, True):
        prepare(ours)
        found.append([one(call, ours) for call in calls])
    return zip(calls, *found)


def test_every_function():
    reasons = {name: reason for reason, names in APART.items() for name in names}
    found, wrong, asked = {}, [], {}
    for module, calls in CALLS.items():
        here = functions_of(module)
        assert len(here) > 5, module
        unknown = sorted(set(here) - set(calls))
        assert not unknown, f"yade.{module} has functions without a call in functions.py: {unknown}"
        for name in here:
            if calls[name] is None:
                found[f"{module}.{name}"] = f"not called: {reasons[name]}"
            else:
                asked[f"{module}.{name}"] = calls[name]
    for name, stock, ours in in_both(list(asked), lambda name, ours: answered(asked[name], ours)):
        try:
            found[name] = outcome(asked[name], stock, ours)
        except AssertionError as error:
            wrong.append(f"{name}: {error}")
    assert not wrong, "\n".join(wrong)
    compare("functions", found)


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


def with_engine(name):
    """Bodies, time step, and files after two steps of the prepared scene with an engine of this class behind the others."""
    folder = tempfile.mkdtemp()
    # Some engines write files there.
    os.chdir(tempfile.mkdtemp())
    settings = {key: value.replace("FOLDER", folder) if isinstance(value, str) else value for key, value in ENGINES.get(name, {}).items()}
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
    found, wrong = {}, []
    stocks = [name for name in names if not name.endswith("_Rust")]
    for name, stock, ours in in_both(stocks, lambda name, ours: in_a_child(lambda: with_engine(name))):
        try:
            found[name] = outcome_of_engine(name, stock, ours)
        except AssertionError as error:
            wrong.append(str(error))
    assert not wrong, "\n".join(wrong)
    compare("engines", found)


def test_every_method_of_a_law():
    """Those of concrete. Methods of other laws take contacts of every law for their own, which is undefined and ends stock YADE now and then."""
    law, other = "Law2_ScGeom_CpmPhys_Cpm", "not called: takes contacts of every law for its own, which is undefined in stock YADE"
    found = {}
    for name in sorted(n for n in dir(yade.wrapper) if n.startswith("Law2_") and not n.endswith("_Rust")):
        for method, function in vars(getattr(yade.wrapper, name)).items():
            if not method.startswith("_") and (callable(function) or isinstance(function, staticmethod)):
                found[f"{name}.{method}"] = other
                if name == law:
                    ((call, *both),) = in_both([f"O.engines[2].lawDispatcher.functors[0].{method}()"], answered)
                    found[f"{name}.{method}"] = outcome(call, *both)
    assert found[f"{law}.elasticEnergy"] == "as YADE"
    compare("laws", found)


def compare(what, found):
    """The outcomes are those of the file from which the book is made."""
    with open(RESULTS) as file:
        kept = json.load(file)
    version = str(config.version)
    if os.environ.get("CONCORDEM_WRITE"):
        kept.setdefault(what, {})[version] = found
        with open(RESULTS, "w") as file:
            json.dump(kept, file, indent=1, sort_keys=True)
            file.write("\n")
    assert kept.get(what, {}).get(version) == found, f"functions.json is not up to date; write it with CONCORDEM_WRITE=1: {what}"


main(globals())
