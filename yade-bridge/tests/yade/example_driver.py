"""Runs one of YADE's concrete examples unattended, with one line of ours added or none: run by `examples.py`, inside YADE.

The driver gives what a person at the screen gives: small specimens, a seed, periods in iterations where the script has seconds,
waiting. Settings come in the environment (`EXAMPLE`, a JSON object); the last line printed is `RESULT` and a JSON object.
"""

import json
import os
import sys
import types

import yade.wrapper
from yade import pack, plot

SETTINGS = json.loads(os.environ["EXAMPLE"])
LAST = 20_000  # no example needs as many

try:
    import future  # noqa: F401
except ImportError:
    # Debian 13 does not have it; in Python 3, the imported names have no effect.
    future = types.ModuleType("future")
    future.standard_library = types.SimpleNamespace(install_aliases=lambda: None)
    sys.modules["future"] = future


def periodic_in_steps(kind):
    """The engine with its periods in iterations."""

    def make(*arguments, **options):
        label = options.get("command", kind)
        if options.pop("realPeriod", None) is not None or "virtPeriod" in options:
            options.pop("virtPeriod", None)
            # At the start of a run, the load fluctuates and may look like a peak.
            options.update(iterPeriod=10 if "Plot" in label else 50, firstIterRun=500 if "Damaged" in label else 0)
        return getattr(yade.wrapper, kind)(*arguments, **options)

    return make


def seeded(function, **changed):
    """A generator of packings with a seed and smaller sizes, kept in the working folder; always as read from there, which may
    differ in a bit from what was just made."""

    def make(*arguments, **options):
        options.update(changed, seed=1, memoizeDb="packings.sqlite")
        function(*arguments, **options)
        return function(*arguments, **options)

    return make


PyRunner = periodic_in_steps("PyRunner")
CpmStateUpdater = periodic_in_steps("CpmStateUpdater")
pack.randomDensePack = seeded(pack.randomDensePack, spheresInCell=200)
pack.randomPeriPack = seeded(pack.randomPeriPack, initSize=Vector3(1.2e-3, 1.2e-3, 1.2e-3))


def Law2_ScGeom_CpmPhys_Cpm(**options):
    """Delete bonds without strength, so that they are counted."""
    return yade.wrapper.Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=0.95, **options)


with open(SETTINGS["path"]) as file:
    text = file.read()
where, line = SETTINGS["anchor"], SETTINGS["line"]
if line:
    assert text.count(where) == 1, "%s has %r %d times" % (SETTINGS["path"], where, text.count(where))
    text = text.replace(where, line + where if SETTINGS["before"] else where + line)
names = [name + " " for name in SETTINGS["parameters"]]
with open("parameters.table", "w") as file:
    file.write("".join(names) + "\n" + " ".join(map(repr, SETTINGS["parameters"].values())) + "\n")
os.environ["YADE_BATCH"] = "parameters.table:2"
O.stopAtIter = LAST
try:
    exec(compile(text, SETTINGS["path"], "exec"), globals())
except SystemExit:
    pass
if SETTINGS["run"]:
    O.run()
O.wait()
# CpmState counts each bond at both ends.
broken = sum(getattr(b.state, "numBrokenCohesive", 0) for b in O.bodies) // 2
series = [float(x) for x in plot.data[SETTINGS["series"]]]
result = {
    "steps": O.iter,
    "ended": O.iter < LAST,
    "broken": broken,
    "bodies": len(O.bodies),
    "series": series,
}
print("RESULT " + json.dumps(result))
sys.stdout.flush()
