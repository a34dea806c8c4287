"""Checks without a peer: `ENGINE@KIND` is the same engine on a scenario that must give the same answer, turned back.

- `twin`: the last bit of one coordinate is another. Two such runs part where rounding grows: nothing can be compared beyond.
- `rotated`: x, y, z become y, z, x, which rounds nothing.
- `renumbered`: the particles in reverse order.
- `half-step`: half the time step and twice the steps; the difference is the error of the step, about a quarter for second order.
- `restart`: half of the run, then the rest by another process from what the first has stored. An engine has a function for that,
  `run_in_two(task, folder, limit)`.
"""
import copy
import math

import numpy as np

from .engines import translate
from .errors import HarnessError, Incomparable, Unsupported
from .quantity import si
from .result import Result, Series

# what a turned or renumbered scenario may hold; everything else is refused
_KNOWN = {"version", "title", "author", "packing", "material", "bonds", "contacts", "integration", "set", "prescribe", "force", "initial", "stop", "output",
          "kinematics", "wall"}
_VECTORS = ("velocity", "angular_velocity", "force", "moment")


def _plain(document, kind):
    unknown = set(document) - _KNOWN
    if unknown or document["packing"].get("kind") != "spheres" or set(document["packing"]) - {"kind", "spheres", "cell"}:
        raise Unsupported(f"`{kind}` is for scenarios of given spheres without {', '.join(sorted(unknown)) or 'a generated packing'}")
    return copy.deepcopy(document)


def _twin(document):
    document = _plain(document, "twin")
    spheres = document["packing"]["spheres"]
    x = si(spheres[-1][0])
    spheres[-1][0] = math.nextafter(x, math.inf) if x else 1e-300
    return document


def _turn(vector):
    return [vector[2], vector[0], vector[1]]


def _rotated(document):
    document = _plain(document, "rotated")
    packing = document["packing"]
    packing["spheres"] = [[*_turn(sphere[:3]), *sphere[3:]] for sphere in packing["spheres"]]
    if "cell" in packing:
        packing["cell"] = _turn(packing["cell"])
    for table in ("prescribe", "force", "initial"):
        for one in document.get(table, []):
            if set(one) - {"set", "acts", *_VECTORS}:
                raise Unsupported(f"`rotated`: no turned {', '.join(sorted(set(one) - {'set', *_VECTORS}))} of {table}")
            one.update({key: _turn(one[key]) for key in _VECTORS if key in one})
    for one in document.get("set", []):
        if one["selection"]["kind"] == "box":
            one["selection"].update({key: _turn(one["selection"][key]) for key in ("minimum", "maximum")})
        elif one["selection"]["kind"] not in ("ids", "all"):
            raise Unsupported(f"`rotated`: no turned set by {one['selection']['kind']}")
    for wall in document.get("wall", []):
        if set(wall) - {"name", "material", "shape", "velocity"} or wall["shape"]["kind"] not in ("box", "plane"):
            raise Unsupported("`rotated`: only walls that are planes or boxes")
        wall["shape"].update({k: _turn(wall["shape"][k]) for k in ("minimum", "maximum", "normal", "point") if k in wall["shape"]})
        if "velocity" in wall:
            wall["velocity"] = _turn(wall["velocity"])
    if "gravity" in document.get("integration", {}):
        document["integration"]["gravity"] = _turn(document["integration"]["gravity"])
    return document


def _turned_back(one, count):
    if one.values.shape[-1:] == (3,):
        one.values = np.roll(one.values, -1, axis=-1)
        if one.values.ndim > 2 and one.values.shape[-2:] == (3, 3) and one.unit != "m":
            one.values = np.roll(one.values, -1, axis=-2)


def _renumbered(document):
    document = _plain(document, "renumbered")
    spheres = document["packing"]["spheres"]
    document["packing"]["spheres"] = spheres[::-1]
    for one in document.get("set", []):
        if one["selection"]["kind"] == "ids":
            one["selection"]["ids"] = [len(spheres) - 1 - i for i in one["selection"]["ids"]]
        elif one["selection"]["kind"] not in ("all", "box"):
            raise Unsupported(f"`renumbered`: no set by {one['selection']['kind']}")
    return document


def _numbered_back(one, count):
    if one.values.ndim > 1 and one.values.shape[1] == count:
        one.values = one.values[:, ::-1]


def _half_step(document):
    document = copy.deepcopy(document)
    integration = document.setdefault("integration", {})
    if integration.get("time_step", "auto") == "auto" or document.get("stage") or set(document.get("stop", {})) - {"steps", "time"}:
        raise Unsupported("`half-step` needs integration.time_step, and a stop after steps or a time")
    integration["time_step"] = 0.5 * si(integration["time_step"])
    if "steps" in document.get("stop", {}):
        document["stop"]["steps"] *= 2
    output = document.setdefault("output", {})
    output["sample_interval"] = 2 * output.get("sample_interval", 10)
    if output.get("snapshot_interval"):
        output["snapshot_interval"] *= 2
    for one in document.get("sample", []):
        if "interval" in one:
            one["interval"] *= 2
    return document


def _nothing(one, count):
    pass


def _same(document):
    return document


def half_of(task):
    """The step at which a run in two parts stops: half way, where a sample and a snapshot are written."""
    if task.scenario.get("stage"):
        raise Unsupported("`restart`: no run in stages")
    steps, output = translate.steps_of(task.scenario, task.start.dt), task.scenario.get("output", {})
    interval = math.lcm(output.get("sample_interval", 10), output.get("snapshot_interval") or 1)
    half = steps // 2 // interval * interval
    if not 0 < half < steps:
        raise Unsupported(f"`restart`: the run of {steps} steps has no sample near its middle; give a smaller output.sample_interval")
    return half


def joined(first, second, half):
    """The result of a run in two parts: samples up to the step `half` are of the first, later ones of the second."""
    one = copy.copy(second)
    one.series = {}
    for name, a in first.series.items():
        if name not in second.series:
            raise Incomparable("error", f"the second part of the run of {second.engine} has no series `{name}`")
        b = second.series[name]
        early, late = a.steps <= half, b.steps > half
        if a.times is not None or b.times is not None:
            end = half * first.dt * (1 + 1e-9)
            early, late = first.time(name) <= end, second.time(name) > end
        times = None if a.times is None else np.concatenate([a.times[early], b.times[late]])
        one.series[name] = Series(np.concatenate([a.steps[early], b.steps[late]]), np.concatenate([a.values[early], b.values[late]]), a.unit,
                                  a.description, times)
    # what happened in the first part
    one.fields = {name: (np.concatenate([first.fields[name][0], values]), unit) if name.startswith("events/") and name in first.fields
                  else (values, unit) for name, (values, unit) in second.fields.items()}
    return one


KINDS = {"twin": (_twin, _nothing), "rotated": (_rotated, _turned_back), "renumbered": (_renumbered, _numbered_back), "half-step": (_half_step, _nothing),
         "restart": (_same, _nothing)}


class SelfCheck:
    """An engine on a changed scenario, whose result is changed back."""

    def __init__(self, name, engine, kind):
        if kind not in KINDS:
            raise HarnessError(f"unknown self-check `{name}`; valid ones are {', '.join(f'{engine.NAME}@{k}' for k in KINDS)}")
        self.NAME, self.engine, self.kind = name, engine, kind
        self.change, self.back = KINDS[kind]

    def version(self):
        return f"{self.engine.version()} on a {self.kind} scenario"

    def also(self, task):
        return getattr(self.engine, "also", lambda _: "")(task)

    def run(self, task, folder, limit):
        from . import start as starts
        own = copy.copy(task)
        own.scenario, own.check_threads = self.change(task.scenario), False
        if self.change is not _same:
            exported = copy.copy(task.start)
            exported.dt = task.start.dt * (0.5 if self.kind == "half-step" else 1.0)
            own.start = starts.state(own.scenario, task.folder, exported)
        result = self._run(own, folder, limit)
        if not isinstance(result, Result):
            raise HarnessError(f"{self.engine.NAME} returned no result")
        for one in result.series.values():
            self.back(one, len(task.start.radius))
        result.engine = self.NAME
        return result

    def _run(self, task, folder, limit):
        if self.kind != "restart":
            return self.engine.run(task, folder, limit)
        in_two = getattr(self.engine, "run_in_two", None)
        if in_two is None:
            raise Unsupported(f"the harness cannot stop and continue {self.engine.NAME}; give it a function `run_in_two`, or a command `restart`")
        return in_two(task, folder, limit)
