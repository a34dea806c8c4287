"""What would happen to a script, before a night's run: what a bonded engine follows, what it refuses, and what this YADE does not know.

The script is read, not run (:func:`examine`): names of classes and their keyword arguments are compared with the running YADE. Of the
present scene, :func:`doctor` also says whether it can be taken over.
"""

from __future__ import annotations

import ast
import builtins
import os
import sys
from typing import Any, Iterator, NamedTuple

from .._errors import YadeError
from . import _rules
from ._scene import bodies, host


class Finding(NamedTuple):
    """One remark about a script or a scene."""

    line: int
    """Line of the script; 0 for the scene."""
    verdict: str
    """`"followed"`, `"refused"`, or `"unknown"` (this YADE does not have it)."""
    what: str
    """The name, or the engine."""
    why: str
    """The reason, or the remedy."""

    def __str__(self) -> str:
        return f"{f'line {self.line}' if self.line else 'scene'}: {self.verdict}: {self.what}: {self.why}"


_GIVE_BACK = "refused while a bonded engine has these bodies: call give_back() before, and take_over() after it"
#: Functions and methods that change what a bonded engine keeps.
_REFUSED = {
    **dict.fromkeys(("clump", "addToClump", "releaseFromClump", "deleteClumpMember", "deleteClumpBody", "replaceByClumps"), _GIVE_BACK),
    **dict.fromkeys(("createInteraction", "flipCell", "resetTime"), _GIVE_BACK),
    **dict.fromkeys(("growParticle", "growParticles", "setContactFriction"), "refused after the take-over: call it before"),
}
#: Attributes that a loop over interactions may set.
_FOLLOWED = {
    "erase": "bonds that are erased are gone before the next step, and bodies with their bonds",
    "interactions": "has the bonds",
    "intrs": "has the bonds",
    "numBrokenCohesive": "counts what the bodies lose",
    "nbTensCracks": "counts on",
    "nbShearCracks": "counts on",
}
#: Names that YADE had once, with what they are now.
_RENAMED = {
    "BexResetter": "ForceResetter",
    "PhysicalActionContainerReseter": "ForceResetter",
    "InteractionDispatchers": "InteractionLoop",
    "BoundingVolumeMetaEngine": "BoundDispatcher",
    "BoundingObjectMetaEngine": "BoundDispatcher",
    "InteractionGeometryMetaEngine": "IGeomDispatcher",
    "InteractionGeometryDispatcher": "IGeomDispatcher",
    "InteractionPhysicsDispatcher": "IPhysDispatcher",
    "ConstitutiveLawDispatcher": "LawDispatcher",
    "NewtonsDampedLaw": "NewtonIntegrator",
    "Ig2_Sphere_Sphere_Dem3DofGeom": "Ig2_Sphere_Sphere_ScGeom",
    "Law2_Dem3DofGeom_CpmPhys_Cpm": "Law2_ScGeom_CpmPhys_Cpm",
    "Law2_Dem3Dof_CpmPhys_Cpm": "Law2_ScGeom_CpmPhys_Cpm",
}


def _known() -> dict[str, Any]:
    """The names that a script of YADE finds."""
    main = sys.modules["__main__"].__dict__
    module = host().module
    return {**vars(builtins), **vars(host().wrapper), **vars(module), **{name: main[name] for name in list(main)}}


def _assigned(tree: ast.AST) -> set[str]:
    """Names that the script itself makes, labels of engines included."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            found.add(node.id)
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            found.add(node.name)
        elif isinstance(node, ast.arg):
            found.add(node.arg)
        elif isinstance(node, ast.alias):
            found.add((node.asname or node.name).split(".")[0])
        elif isinstance(node, ast.ExceptHandler) and node.name:
            found.add(node.name)
        elif isinstance(node, ast.keyword) and node.arg == "label" and isinstance(node.value, ast.Constant):
            found.add(str(node.value.value).split("[")[0])
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) == "readParamsFromTable":
            found |= {word.arg for word in node.keywords if word.arg}
    return found


def examine(text: str) -> list[Finding]:
    """Findings about the text of a script, by line. Raises YadeError outside of YADE."""
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        why = "Python 2: YADE runs Python 3; convert it with `2to3 -w`" if "print" in str(error) or "exec" in str(error) else str(error.msg)
        return [Finding(error.lineno or 1, "unknown", (error.text or "").strip()[:60], why)]
    found = {finding: None for finding in _findings(tree)}
    return sorted(found, key=lambda finding: (finding.line, finding.what))


def _findings(tree: ast.AST) -> Iterator[Finding]:
    known, own = _known(), _assigned(tree)
    starred = any(isinstance(node, ast.ImportFrom) and node.names[0].name == "*" and not (node.module or "").startswith("yade") for node in ast.walk(tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in known and node.id not in own and not starred:
            now = _RENAMED.get(node.id)
            why = f"is {now} now" if now else "neither the script nor this YADE has this name"
            yield Finding(node.lineno, "unknown", node.id, why)
        elif isinstance(node, ast.Call):
            yield from _of_call(node, known)
        elif isinstance(node, ast.Attribute) and node.attr in _FOLLOWED:
            yield Finding(node.lineno, "followed", node.attr, _FOLLOWED[node.attr])
    for text, line in _commands(tree):
        try:
            inner = ast.parse(text)
        except SyntaxError:
            yield Finding(line, "unknown", text[:60], "is not Python 3")
            continue
        for node in ast.walk(inner):
            if isinstance(node, ast.Attribute) and node.attr in _REFUSED:
                yield Finding(line, "refused", node.attr, _REFUSED[node.attr])


def _commands(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Texts that engines run: commands and hooks."""
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg in ("command", "doneHook", "hook") and isinstance(node.value, ast.Constant):
            yield str(node.value.value), node.value.lineno


def _of_call(node: ast.Call, known: dict[str, Any]) -> Iterator[Finding]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if name in _REFUSED:
        yield Finding(node.lineno, "refused", name, _REFUSED[name])
    kind = known.get(name)
    wrapper = host().wrapper
    if not (isinstance(kind, type) and issubclass(kind, wrapper.Serializable)):
        return
    for word in node.keywords:
        if word.arg and not hasattr(kind, word.arg):
            yield Finding(node.lineno, "unknown", f"{name}({word.arg}=…)", "this YADE has no such attribute")
    if not issubclass(kind, wrapper.Engine):
        return
    bases = [one.__name__ for one in kind.__mro__]
    if any(base in _rules.FOLLOWED for base in bases):
        yield Finding(node.lineno, "followed", name, "finds the bonds of take_over()")
        return
    remedy = next((_rules.BLIND[base] for base in bases if base in _rules.BLIND), None)
    if remedy is not None:
        yield Finding(node.lineno, "refused", name, f"reads interactions, where the bonds no longer are ({remedy})")


def _of_scene() -> Iterator[Finding]:
    """Whether the present scene can be taken over, and with `motion=True`."""
    from ._concrete import Concrete
    from ._engine import engines
    from ._histories import Spheres, kind_of

    omega = host().omega
    if engines():
        yield Finding(0, "followed", f"{len(engines())} bonded engine(s)", "the scene has been taken over")
        return
    try:
        _rules.refuse_blind_engines(omega.engines, lends=True)
        if kind := kind_of(bodies()):
            spheres = Spheres(kind)
            count = spheres.hosted(1).contact_count
            what = f"{len(spheres.bodies.ids)} spheres of {spheres.law.MATERIAL} with {count} contacts"
            yield Finding(0, "followed" if count else "refused", "take_over()", what)
            yield from _of_motion(bool(spheres.clumps.bodies))
            return
        until = _rules.bonds_until(omega.engines, omega.iter)
        concrete = Concrete(late=bool(until))
        concrete.hosted(concrete.settings.kinematics, "yade-public", False, 1)
    except YadeError as error:
        yield Finding(0, "refused", "take_over()", str(error))
        return
    bonds = int((concrete.own.row >= 0).sum()) if concrete.own is not None else 0
    own = int((concrete.own.row > 0).sum()) if concrete.own is not None else 0
    if until:
        yield Finding(0, "followed", "take_over()", f"{until}, and the bonded engine waits until then")
        return
    what = f"{len(concrete.bodies.ids)} spheres of concrete with {bonds} contacts"
    yield Finding(0, "followed" if bonds else "refused", "take_over()", what + (f", {own} with parameters of their own" if own else ""))
    yield from _of_motion(bool(concrete.clumps.bodies))


def _of_motion(clumps: bool) -> Iterator[Finding]:
    """Whether the engine cannot move the bodies."""
    omega = host().omega
    if omega.periodic or clumps or omega.trackEnergy:
        yield Finding(0, "refused", "take_over(motion=True)", "needs a scene without a periodic cell, clumps, and O.trackEnergy; use motion=False")


def doctor(script: str | os.PathLike[str] | None = None, quiet: bool = False) -> list[Finding]:
    """Say what a bonded engine would follow and refuse, and what this YADE does not know, without a step; print it and return it.

    `script`: its path; default: the running script. The scene is the present one, so call it where :func:`take_over` will stand. `quiet`: print
    nothing. A script that is only read (``python3 -m concordem.yade check script.py``) is not run.

    >>> concordem.yade.doctor()                            # doctest: +SKIP
    line 12: followed: GlobalStiffnessTimeStepper: finds the bonds of take_over()
    line 40: refused: clump: refused while a bonded engine has these bodies: call give_back() before, and take_over() after it
    scene: followed: take_over(): 1160 spheres of concrete with 6482 contacts
    """
    path = os.fspath(script) if script is not None else sys.argv[0]
    found: list[Finding] = []
    if os.path.isfile(path) and path.endswith(".py"):
        with open(path, encoding="utf-8", errors="replace") as file:
            found += examine(file.read())
    if len(host().omega.bodies):
        found += _of_scene()
    if not quiet:
        for finding in found:
            print(finding)
    return found
