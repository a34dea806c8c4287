"""Mistakes planted in what an engine gets: those that no check sees tell what the cases cannot find."""
import copy

import numpy as np

from . import registry
from .errors import HarnessError
from .quantity import si

_PART = 0.01


class _Mutant:
    """An engine that gets a changed task."""

    def __init__(self, engine, change, label):
        self.NAME, self.engine, self.change, self.label = engine.NAME, engine, change, label
        self.NEEDS_START = getattr(engine, "NEEDS_START", True)

    def version(self):
        return f"{self.engine.version()} with {self.label}"

    def also(self, task):
        return getattr(self.engine, "also", lambda _: "")(task)

    def run(self, task, folder, limit):
        own = copy.copy(task)
        own.scenario, own.start, own.check_threads = copy.deepcopy(task.scenario), copy.deepcopy(task.start), False
        self.change(own)
        return self.engine.run(own, folder, limit)


def _scaled(name):
    def change(task):
        setattr(task.start, name, getattr(task.start, name) * (1 + _PART))
    return change


def _without_bond(task):
    task.start.bonds, task.start.reference_length = task.start.bonds[:-1], task.start.reference_length[:-1]


def _at(path):
    def change(task):
        place = task.scenario
        try:
            for key in path[:-1]:
                place = place[key]
            value = place[path[-1]]
        except (KeyError, IndexError):
            # another variant, which has no such key
            return
        place[path[-1]] = [si(v) * (1 + _PART) for v in value] if isinstance(value, list) else si(value) * (1 + _PART)
    return change


def _numbers(value, path):
    """Paths of all quantities that are not zero."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _numbers(item, (*path, key))
        return
    try:
        sizes = [si(v) for v in value] if isinstance(value, list) else [si(value)]
    except HarnessError:
        return
    if any(sizes):
        yield path


def mistakes(case, engine):
    """All mistakes for a case: label and change of the task."""
    documents = [task.scenario for task in case.tasks]
    out = []
    if registry.needs_start(engine):
        out += [(f"{name} {_PART:.0%} too large", _scaled(name)) for name in ("mass", "radius", "dt", "velocity", "angular_velocity")]
        if any("bonds" in document for document in documents):
            out.append(("the last bond left out", _without_bond))
    paths = [p for document in documents for k, m in enumerate(document["material"]) for p in _numbers(m, ("material", k))]
    paths += [("integration", key) for document in documents for key in ("gravity",) if any(map(si, document.get("integration", {}).get(key, [])))]
    out += [(f"{'.'.join(map(str, path))} {_PART:.0%} too large", _at(path)) for path in dict.fromkeys(paths)
            if not (registry.needs_start(engine) and path[-1] == "density")]
    return out


def _alters(change, task):
    """Whether a mistake changes anything of a task: a spin that is zero stays so."""
    own = copy.copy(task)
    own.scenario, own.start = copy.deepcopy(task.scenario), copy.deepcopy(task.start)
    change(own)
    same = task.start is None or all(np.array_equal(value, getattr(own.start, name)) for name, value in task.start.__dict__.items())
    return not same or own.scenario != task.scenario


def survivors(case, engine, make_runner):
    """Mistakes of an engine that no check of a case sees, those that some check sees, and those that change nothing here: lists of labels."""
    original = registry.ENGINES[engine]
    made = make_runner()
    sound = made.run([case])
    if sound.failed(strict=False):
        raise HarnessError(f"case {case.name} fails already; mend it before you plant mistakes")
    computed = [made.with_start(copy.copy(task), engine) for task in case.tasks if sound.outcomes[case.name, task.variant, engine].status == "done"]
    unseen, seen, idle = [], [], []
    for label, change in mistakes(case, engine):
        if not any(_alters(change, task) for task in computed):
            idle.append(label)
            continue
        registry.ENGINES[engine] = _Mutant(original, change, label)
        try:
            round_ = make_runner().run([case])
        finally:
            registry.ENGINES[engine] = original
        bad = [v for v in round_.verdicts if v.status == "fail"] + [o for o in round_.outcomes.values() if o.status not in ("done", "missing", "skipped")]
        (seen if bad else unseen).append(label)
    return unseen, seen, idle
