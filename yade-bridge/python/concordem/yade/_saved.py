"""Save and load bonded engines: the bonds lie in a file next to that of the scene."""

from __future__ import annotations

import hashlib
import json
import os
from typing import Any

import numpy as np

from .. import _core
from . import _hooks, _lending
from ._clumps import Clumps
from ._concrete import cell_of, class_of
from ._engine import BondedEngine, _registered, engines
from ._histories import LAWS, hosted, without_contacts
from ._motion import only_integrator
from ._rules import refuse
from ._scene import at_rest, bodies, gather, host
from ._take_over import _hosted_of


def _fingerprint() -> str:
    """Hash of the positions and velocities of all bodies and of the clock."""
    omega = host().omega
    found = bodies()
    digest = hashlib.sha256()
    for column in (
        found.ids,
        found.positions,
        gather(found.state, "State.vel", components=3),
        gather(found.state, "State.angVel", components=3),
        gather(found.state, "State.ori", components=4),
        np.array([omega.iter], np.int64),
        np.array([omega.time, omega.dt]),
    ):
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()


def _beside(path: str | os.PathLike[str], name: str) -> str:
    return f"{os.fspath(path)}.{name}.concordem"


def _write_bonds(path: str) -> list[str]:
    """Save the bonds of every bonded engine of the scene next to its file; return the paths."""
    files = []
    for engine in engines():
        beside = _beside(path, engine.name)
        text = {
            "fingerprint": _fingerprint(),
            "name": engine.name,
            "ids": engine.ids.tolist(),
            "kind": engine._kind,
            "motion_bit": engine._motion.bit if engine._motion is not None else 0,
        }
        if engine._waits:
            # The bonds are YADE's.
            with open(beside, "w", encoding="utf-8") as file:
                json.dump(text, file)
        else:
            text["losses"] = [counts.tolist() for counts in engine.solver.losses()]
            engine.solver.save(beside, json.dumps(text))
        files.append(beside)
    return files


def _read_bonds(path: str, threads: int | None = None) -> list[BondedEngine]:
    """Load the bonds of the scene that YADE has just loaded from this file."""
    wanted = [e.command for e in _lending.working_engines() if class_of(e) == "PyRunner" and "concordem.yade" in e.command and "._run(" in e.command]
    found = []
    for command in wanted:
        name = command.rsplit("(", 1)[1].rstrip(")").strip("'\"")
        beside = _beside(path, name)
        if not os.path.exists(beside):
            raise refuse(f'the bonds of the engine "{name}" are missing; put {beside} next to the scene file', "NotLoaded")
        text = _text_of(beside)
        if text["fingerprint"] != _fingerprint():
            raise refuse(f"{beside} does not belong to the scene in {path}: bodies, motion, or clock differ; load the matching file", "Mismatch")
        _registered.pop(name, None)
        found.append(_restore(text, beside, threads))
    return found


def _text_of(beside: str) -> dict[str, Any]:
    """What is told of an engine in its file, which has no bonds if the engine waited for them."""
    with open(beside, "rb") as file:
        waits = file.read(1) == b"{"
    if waits:
        with open(beside, encoding="utf-8") as file:
            return dict(json.load(file))
    return dict(json.loads(_core.hosted_text(beside)))


_hooks.savers.append(_write_bonds)
_hooks.loaders.append(_read_bonds)


def save(path: str | os.PathLike[str]) -> list[str]:
    """Call `O.save(path)` and save the bonds of every bonded engine in a separate file next to it; return the paths of all files.

    In a process with a bonded engine, `O.save` and `O.saveTmp` do the same.
    """
    at_rest()
    with _hooks.plain():
        host().omega.save(os.fspath(path))
    return [os.fspath(path), *_write_bonds(os.fspath(path))]


def load(path: str | os.PathLike[str], threads: int | None = None) -> list[BondedEngine]:
    """Call `O.load(path)` and load the bonds that :func:`save` wrote. Raises YadeError if a file is missing or belongs to another scene.

    In a process that had a bonded engine, `O.load`, `O.loadTmp`, and `O.reload` do the same.
    """
    with _hooks.plain():
        host().omega.load(os.fspath(path))
    return _read_bonds(os.fspath(path), threads)


def _restore(text: dict[str, Any], beside: str, threads: int | None) -> BondedEngine:
    omega = host().omega
    ids, kind = np.array(text["ids"], np.int32), text["kind"]
    if "losses" not in text:
        waiting = BondedEngine(text["name"], None, ids, kind, threads)
        waiting._stand_by(insert=False)
        return waiting
    everything = bodies()
    found = everything.of(np.isin(everything.ids, ids))
    if kind["kind"] in LAWS:
        LAWS[kind["kind"]].add_layout()
        material = np.zeros(len(found.ids), np.uint32)
        clumps = Clumps(found.ids).arrays(only_integrator(omega.engines), omega.dt)
        solver = hosted(found, material, without_contacts(kind["kind"]), kind, threads or omega.numThreads, clumps, kind["kinematics"])
    elif kind["kind"] == "scenario":
        solver = _hosted_of(_core.Scenario.from_text(kind["scenario"], beside), found, omega.dt, threads)
    else:
        inertia = gather(found.state, "State.inertia", components=3)
        empty = np.zeros(0)
        solver = _core.Hosted.concrete(
            {
                "id": found.ids.astype(np.uint32),
                "position": found.positions,
                "velocity": gather(found.state, "State.vel", components=3),
                "orientation": gather(found.state, "State.ori", components=4),
                "angular_velocity": gather(found.state, "State.angVel", components=3),
                "radius": gather(found.shape, "Sphere.radius"),
                "mass": gather(found.state, "State.mass"),
                "inertia": np.ascontiguousarray(inertia[:, 0]),
                "material": np.zeros(len(found.ids), np.uint32),
                "constraint": gather(found.state, "State.blockedDOFs", "i32").astype(np.uint32),
                "lost": np.zeros(len(found.ids), np.uint32),
            },
            {
                "pair": np.zeros((0, 2), np.uint32),
                "image": np.zeros((0, 3), np.int8),
                "bonded": np.zeros(0, bool),
                "length": empty,
                "area": empty,
                "normal": np.zeros((0, 3)),
                "distance": empty,
                "history": np.zeros((0, 11)),
                "radii": empty,
                "reference_overlap": empty,
                "stored": np.zeros((0, 10)),
                "own": np.zeros(0, np.uint32),
            },
            [tuple(row) for row in kind["laws"]],
            kind["materials"],
            omega.dt,
            kind["kinematics"],
            cell=cell_of(omega) if omega.periodic else None,
            threads=threads or omega.numThreads,
            own=kind.get("own"),
            clumps=Clumps(found.ids).arrays(only_integrator(omega.engines), omega.dt),
        )
    solver.restore(beside, *(np.array(counts, np.uint32) for counts in text["losses"]))
    engine = BondedEngine(text["name"], solver, ids, kind, threads)
    engine._attach()
    if engine._motion is not None:
        engine._motion.resume(text["motion_bit"])
    engine._placed = True
    host().omega.engines = host().omega.engines
    return engine
