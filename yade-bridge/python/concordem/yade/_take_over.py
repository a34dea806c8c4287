"""Makes bonded engines: of the bonds of a concrete scene, or of spheres of the scene and tables of a scenario."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from . import _late, _rules
from ._clumps import Clumps
from ._concrete import Concrete, cell_of, class_of, engine_of
from ._engine import BondedEngine, _registered
from ._histories import LAWS, Spheres, kind_of, spheres
from ._motion import only_integrator
from ._rules import refuse
from ._scene import Bodies, at_rest, bodies, gather, host, of_class


def _refuse_bonded(mine: Bodies) -> None:
    """Raise YadeError if the collider already excludes contacts between some of the bodies."""
    mask = engine_of("InsertionSortCollider").avoidSelfInteractionMask
    excluded = gather(mine.address, "Body.groupMask", "i32") & mask != 0
    if excluded.any():
        raise refuse(
            f"body {int(mine.ids[excluded][0])} is excluded from contacts by the collider's avoidSelfInteractionMask, as bodies of a "
            "bonded engine are; call remove() of that engine first, or unset the mask",
            "Masks",
        )


def take_over(
    name: str = "bonds",
    kinematics: str | None = None,
    mode: str = "yade-public",
    update_states: int = 0,
    threads: int | None = None,
    motion: bool = False,
) -> BondedEngine:
    """Take over the bonds of a concrete scene (YADE's CPM), of cohesive and frictional spheres (CohFrictMat), or of jointed ones (JCFpmMat), with
    their histories; our solver computes them from now on.

    `O.run` works as before, but O.interactions no longer contains the contacts between the spheres. The defaults reproduce YADE's law
    up to rounding; `kinematics="finite", mode="thesis"` is the corrected law. `update_states`: write CpmState every `update_states`
    steps; YADE's CpmStateUpdater is then set to dead=True. Results are bitwise equal for any number of threads, here and in YADE
    (``-j``).

    `motion`: the engine also moves its bodies, in place of NewtonIntegrator and with the same bits, which is faster; NewtonIntegrator keeps
    the other bodies and all settings.

    While YADE still makes bonds (`cohesiveThresholdIter` ahead), or makes more of them later, its law computes all contacts, and the engine waits; it
    takes them over in the step of the last new bond. Raises YadeError if the scene is not supported.
    """
    at_rest()
    if of_histories := kind_of(bodies()):
        return _take_over_histories(of_histories, name, kinematics, mode, update_states, threads, motion)
    kind = {"kind": "concrete", "kinematics": kinematics, "mode": mode, "update_states": update_states, "motion": motion}
    waits = _rules.bonds_until(host().omega.engines, host().omega.iter)
    if waits and motion:
        raise refuse(f"{waits}, and motion=True starts between two runs; call take_over(motion=True) after that, or set motion=False", "Motion")
    concrete = _concrete_of(kind, bool(waits))
    if waits:
        engine = BondedEngine(name, None, concrete.bodies.ids[:0], kind, threads)
        _begin(engine)
        _late.tell(engine)
        return engine
    solver = _bonds_of(concrete, kind, threads)
    if not solver.bond_count:
        raise refuse(
            "there are no bonds to take over; let YADE create them first (an interactionDetectionFactor above 1 in a step before "
            "cohesiveThresholdIter)",
            "NoBonds",
        )
    return _begin(BondedEngine(name, solver, concrete.bodies.ids, kind, threads))


def _take_over_histories(of: str, name: str, kinematics: str | None, mode: str, update_states: int, threads: int | None, motion: bool) -> BondedEngine:
    """:func:`take_over` of spheres whose contacts have histories."""
    if mode != "yade-public" or update_states:
        raise refuse(f"mode={mode!r} and update_states={update_states} are for concrete; spheres of {LAWS[of].MATERIAL} follow YADE's law: leave both out", "NotConcrete")
    everything = bodies()
    _refuse_bonded(everything.of(spheres(everything, of)))
    taken = Spheres(of)
    _rules.refuse_blind_engines(host().omega.engines, lends=True)
    kind = {"kind": of, "kinematics": kinematics or taken.settings.kinematics, "motion": motion, **taken.kind()}
    solver = taken.hosted(threads, kind["kinematics"])
    if not solver.contact_count:
        raise refuse("there are no contacts to take over; let YADE make them first (one step)", "NoBonds")
    return _begin(BondedEngine(name, solver, taken.bodies.ids, kind, threads))


def _concrete_of(kind: dict[str, Any], late: bool) -> Concrete:
    """The concrete of the scene, for a bonded engine of this kind."""
    everything = bodies()
    # Before the settings, in which NewtonIntegrator would be missing beside an engine that moves the bodies.
    _refuse_bonded(everything.of(of_class(everything.state, "CpmState.vtable")))
    concrete = Concrete(late=late)
    _rules.refuse_blind_engines(host().omega.engines, _replaced(kind), lends=True)
    return concrete


def _replaced(kind: dict[str, Any]) -> str:
    """The engine of YADE that a bonded engine of this kind replaces."""
    return "CpmStateUpdater" if kind.get("update_states") else ""


def _bonds_of(concrete: Concrete, kind: dict[str, Any], threads: int | None) -> _core.Hosted:
    """The contacts of the scene in our solver; `kind` gets what the engine saves of them."""
    kind["kinematics"] = kind["kinematics"] or concrete.settings.kinematics
    solver = concrete.hosted(kind["kinematics"], kind["mode"], False, threads)
    kind.update(laws=concrete.laws(kind["mode"]), materials=len(concrete.materials), **(concrete.own.kind() if concrete.own is not None else {}))
    return solver


def take_over_late(engine: BondedEngine) -> bool:
    """Take over the bonds for which an engine has waited; returns whether there are any."""
    kind = dict(engine._kind)
    concrete = _concrete_of(kind, late=True)
    solver = _bonds_of(concrete, kind, engine._threads)
    if not solver.bond_count:
        return False
    engine._placed = False
    engine._have(solver, concrete.bodies.ids, kind)
    _begin(engine, insert=False)
    return True


def _begin(engine: BondedEngine, insert: bool = True) -> BondedEngine:
    """Let an engine act. `insert`: it is not in O.engines yet."""
    omega = host().omega
    if engine._waits:
        engine._stand_by()
        return engine
    disabled = [other for other in omega.engines if class_of(other) == _replaced(engine._kind) and not other.dead]
    engine._attach()
    try:
        if engine._motion is not None:
            engine._motion.begin()
        if insert:
            engine._insert()
        for other in disabled:
            other.dead = True
        # A PyRunner's new engines act from the next step on.
        if not omega.running:
            engine.check_engines(omega.engines)
        # Last, because it takes the bonds out of YADE's container.
        engine._mask()
        engine._placed = True
        # With the helpers of engines that read interactions, and without the PyRunner for scripts.
        omega.engines = omega.engines
    except Exception:
        for other in disabled:
            other.dead = False
        if engine._motion is not None and engine._motion.active:
            engine._motion.end()
        _registered.pop(engine.name, None)
        engine.attached = False
        omega.engines = [other for other in omega.engines if getattr(other, "command", "") != engine.command]
        raise
    return engine


def bond(
    material: dict[str, Any],
    bonds: dict[str, Any] | None = None,
    contacts: dict[str, Any] | None = None,
    ids: Any = None,
    name: str = "bonds",
    kinematics: str | None = None,
    threads: int | None = None,
    motion: bool = False,
    **tables: Any,
) -> BondedEngine:
    """Bond spheres of the scene with any ConcorDEM law: concrete, cohesive beams, linear bonds, with or without deformable particles.

    `material`, `bonds`, and `contacts` are tables of a scenario; `tables` are its other tables and keys (`deformable`, `dimension`,
    ...). Without `bonds`, all contacts are unbonded; without `contacts`, unbonded particles pass through each other. `ids`: the
    spheres; default all. Masses and motion come from YADE's bodies. A periodic cell is YADE's; members of one clump have neither bonds nor contacts
    with each other. `motion`: as in :func:`take_over`. Raises YadeError if the scene is not supported,
    ScenarioError if the tables are invalid.

    >>> concordem.yade.bond(                                                       # doctest: +SKIP
    ...     material={"name": "glass", "density": 2500, "cohesive_beam":
    ...               {"young": "300 GPa", "poisson": 0.3, "radius_ratio": 0.6, "tensile_strength": "60 MPa"}},
    ...     bonds={"law": "cohesive_beam", "interaction_ratio": 1.1}, contacts={"law": "none"})
    """
    at_rest()
    omega = host().omega
    _rules.refuse_blind_engines(omega.engines)
    everything = bodies()
    ball = of_class(everything.shape, "Sphere.vtable")
    if ids is not None:
        wanted = np.isin(everything.ids, np.asarray(ids))
        if int(wanted.sum()) != len(set(map(int, ids))):
            raise refuse("`ids` contains ids without a body; give ids of spheres in the scene", "OtherBodies")
        if not ball[wanted].all():
            raise refuse(f"body {int(everything.ids[wanted & ~ball][0])} is not a sphere; give ids of spheres", "OtherBodies")
        ball = wanted
    mine = everything.of(ball)
    _refuse_bonded(mine)
    radius = gather(mine.shape, "Sphere.radius")
    spheres = np.concatenate([mine.positions, radius[:, None]], axis=1)
    description = dict(
        packing={"kind": "spheres", "spheres": spheres, **_periodic(mine)},
        material=material,
        contacts=contacts or {"law": "none"},
        stop={"steps": 1},
        **({"kinematics": kinematics} if kinematics else {}),
        **({"bonds": bonds} if bonds else {}),
        **tables,
    )
    scenario = _core.Scenario(**description)
    solver = _hosted_of(scenario, mine, omega.dt, threads)
    if bonds and not solver.bond_count:
        raise refuse("the spheres are too far apart for bonds; increase bonds.interaction_ratio", "NoBonds")
    kind = {"kind": "scenario", "scenario": scenario.text, "motion": motion}
    return _begin(BondedEngine(name, solver, mine.ids, kind))


def _periodic(mine: Bodies) -> dict[str, Any]:
    """The periodic cell of the scene, as keys of a packing."""
    omega = host().omega
    if not omega.periodic:
        return {}
    edges = cell_of(omega)[0]
    if (edges != np.diag(np.diag(edges))).any() or (np.diag(edges) <= 0).any():
        raise refuse("bond() needs a rectangular periodic cell along the axes; bond the spheres before O.cell is sheared", "Periodic")
    outside = ((mine.positions < 0) | (mine.positions >= np.diag(edges))).any(axis=1)
    if outside.any():
        number = int(mine.ids[outside][0])
        raise refuse(
            f"body {number} is outside of the periodic cell, where bond() does not search for its neighbors; move it by whole edges: "
            f"O.bodies[{number}].state.pos = O.cell.wrap(O.bodies[{number}].state.pos), before YADE makes contacts",
            "Periodic",
        )
    return {"cell": np.diag(edges).tolist()}


def _hosted_of(scenario: _core.Scenario, mine: Bodies, dt: float, threads: int | None) -> _core.Hosted:
    inertia = gather(mine.state, "State.inertia", components=3)
    mass = gather(mine.state, "State.mass")
    try:
        return _core.Hosted.of_scenario(
            scenario,
            mine.ids.astype(np.uint32),
            mass,
            np.ascontiguousarray(inertia.min(axis=1)),
            dt,
            threads or host().omega.numThreads,
            clumps=Clumps(mine.ids).arrays(only_integrator(host().omega.engines), dt),
        )
    except ValueError as error:
        raise refuse(f"the bodies cannot be bonded: {error}") from error
