"""The page of what functions, engines, and laws of YADE answer beside a bonded engine, from the outcomes of yade-bridge/tests/yade/test_functions.py."""

import json
from collections import defaultdict

from .text import ROOT

RESULTS = ROOT / "yade-bridge/tests/yade/functions.json"
TITLES = {
    "functions": ("Functions", "Functions of the modules that scripts import."),
    "engines": ("Engines", "Engines and recorders, behind the others in `O.engines`."),
    "laws": ("Methods of laws", "Methods of the functors of all laws in `O.engines`, also of laws that the bonds do not have."),
}
#: Scenes of the test.
KINDS = {"concrete": "Beside bonds of concrete", "cohesive": "Beside contacts of `CohFrictMat`"}


def _grouped(outcomes):
    """Names by outcome; `outcomes`: for each version, the outcome of each name."""
    groups = defaultdict(list)
    versions = sorted(outcomes)
    for name in sorted({name for found in outcomes.values() for name in found}):
        found = {version: outcomes[version][name] for version in versions if name in outcomes[version]}
        which = "" if len(found) == len(versions) else f" ({', '.join(found)})"
        if len(set(found.values())) == 1:
            groups[next(iter(found.values()))].append(f"`{name}`{which}")
        else:
            for version, outcome in found.items():
                groups[outcome].append(f"`{name}` ({version})")
    return groups


def _short(outcome):
    """An outcome in a few words."""
    kind, _, reason = outcome.partition(": ")
    words = {
        "as YADE": "answers as stock YADE" + (", which raises an error in the scene of the test" if reason else ""),
        "no bonds": "finds no bonds, and answers for other contacts: stock YADE takes bonds for contacts of this law without a look at their class, which gives "
        "numbers without meaning, or ends it",
        "ends stock YADE in this scene": "ends stock YADE in the scene of the test",
    }
    return words.get(kind, "refused")


def pages():
    """The page, by file name."""
    kept = json.loads(RESULTS.read_text(encoding="utf-8"))
    versions = sorted({version for kinds in kept.values() for found in kinds.values() for version in found})
    lines = [
        "# Functions and engines of YADE beside a bonded engine", "",
        "A test calls each of them in a scene of stock YADE and in the same scene after `take_over()`. A number that differs by more than 1e-9 is an error, "
        f"and so is a function that the test does not know. YADE {', '.join(versions)}.", "",
    ]
    for what, (title, meaning) in TITLES.items():
        lines += [f"## {title}", "", meaning, ""]
        for kind, scene in KINDS.items():
            lines += [f"### {scene}: {title.lower()}", ""]
            short = defaultdict(list)
            for outcome, names in _grouped(kept.get(what, {}).get(kind, {})).items():
                short[_short(outcome)] += names
            refused = sorted(name for name in short.pop("refused", []))
            for outcome in sorted(short):
                lines += [f"{outcome[0].upper()}{outcome[1:]}", f": {', '.join(sorted(short[outcome]))}", ""]
            if refused:
                lines += ["Refused, with the remedy", f": {', '.join(refused)}", ""]
    return {"yade-functions.md": "\n".join(lines)}
