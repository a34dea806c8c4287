"""What a bonded engine needs of the scene, for both of its forms: the order of O.engines, no engines that look for the bonds in
O.interactions, and settings that stay as they were at the take-over.

Reads YADE's attributes through Python only, so that it works with any version.
"""

from __future__ import annotations

import json
from typing import Any, Iterable, Sequence

from .._errors import YadeError

_NOTHING = "there is no replacement"
_STRESS = "record the engine's stress() from a PyRunner"
#: Engines that read O.interactions and find the bonds of take_over() there: the engine lends them (:mod:`._lending`). A class stands for all
#: that derive from it.
FOLLOWED = (
    *("CpmStateUpdater", "GlobalStiffnessTimeStepper", "PeriTriaxController", "Peri3dController", "PeriIsoCompressor", "TriaxialStateRecorder"),
    *("TriaxialCompressionEngine", "VTKRecorder"),
)
#: Engines that read O.interactions, where they do not find the bonds of other engines than take_over(), with their replacements; all but those
#: of FOLLOWED do not find those of take_over() either.
BLIND = {
    "CapillarityEngine": _NOTHING,
    "CapillaryStressRecorder": _STRESS,
    "CohesiveFrictionalContactLaw": "use InteractionLoop",
    "CpmStateUpdater": "use BondedEngine_Rust(updateStates=n)",
    "DFNFlowEngine": _NOTHING,
    "Disp2DPropLoadEngine": _NOTHING,
    "ElasticContactLaw": "use InteractionLoop",
    "FoamCoupling": _NOTHING,
    "GlobalStiffnessTimeStepper": "set O.dt yourself",
    "KinemSimpleShearBox": _NOTHING,
    "Law2_ScGeom_CapillaryPhys_Capillarity": _NOTHING,
    "LawTester": _NOTHING,
    "LubricationPDFEngine": "use the engine's forces()",
    "MeasureCapStress": _STRESS,
    "MicroMacroAnalyser": "use concordem.operators",
    "PDFEngine": "use the engine's forces()",
    "PartialSatClayEngine": _NOTHING,
    "Peri3dController": "drive the cell from a PyRunner with the engine's stress()",
    "PeriIsoCompressor": "drive the cell from a PyRunner with the engine's stress()",
    "PeriTriaxController": "drive the cell from a PyRunner with the engine's stress()",
    "ThermalEngine": _NOTHING,
    "TriaxialCompressionEngine": "use TriaxialStressController, and the engine's stress()",
    "TriaxialStateRecorder": _STRESS,
}
#: The engines of flow are instances of a template; the names of their bases begin with this.
_FLOW = "FlowEngine"
#: Recorders of VTKRecorder that read O.interactions.
BLIND_RECORDERS = {"all", "intr", "stress", "bstresses", "cpm", "force", "cracks", "moments", "coordNumber"}


def refuse(message: str, kind: str = "Scene") -> YadeError:
    """An error about the scene."""
    return YadeError(message, kind)


def classes(instance: Any) -> list[str]:
    """Names of an object's class and of its bases."""
    return [one.__name__ for one in type(instance).__mro__]


def is_a(instance: Any, name: str) -> bool:
    """Whether an object is of a class or of one derived from it."""
    return name in classes(instance)


def _remedy(engine: Any) -> str | None:
    """The replacement of an engine that would not find the bonds; None for others."""
    for name in classes(engine):
        if name in BLIND:
            return BLIND[name]
        if name.startswith(_FLOW):
            return _NOTHING
    return None


def is_followed(engine: Any) -> bool:
    """Whether an engine of YADE finds the bonds of take_over()."""
    return any(is_a(engine, name) for name in FOLLOWED)


def _with_slaves(engines: Iterable[Any]) -> Iterable[tuple[Any, bool]]:
    """The engines that are not dead, and those that a ParallelEngine has, each with whether it is one of these."""
    for engine in engines:
        if engine.dead:
            continue
        yield engine, False
        if is_a(engine, "ParallelEngine"):
            for slave in engine.slaves:
                yield from ((one, True) for one, _ in _with_slaves(slave if isinstance(slave, (list, tuple)) else [slave]))


def refuse_blind_engines(engines: Sequence[Any], replaced: str = "", lends: bool = False) -> None:
    """Raise YadeError if an active engine looks for the bonds in O.interactions, and does not find them there. `replaced`: an engine that will
    be disabled; `lends`: the bonds are lent to FOLLOWED."""
    loops = sum(is_a(engine, "InteractionLoop") and not engine.dead for engine in engines)
    if loops > 1:
        raise refuse(f"O.engines has {loops} active engines InteractionLoop; keep exactly one", "Engines")
    for engine, is_slave in _with_slaves(engines):
        name = type(engine).__name__
        if is_a(engine, "InteractionLoop") and engine.callbacks:
            raise refuse(
                f"InteractionLoop has the callback {type(engine.callbacks[0]).__name__}, which YADE calls for its own contacts only, not for the bonds; "
                "set callbacks=[], and read the bonds in a PyRunner",
                "BlindEngine",
            )
        if name == replaced or (lends and not is_slave and is_followed(engine)):
            continue
        remedy = "take it out of the ParallelEngine" if lends and is_slave and is_followed(engine) else _remedy(engine)
        if name == "VTKRecorder":
            blind = BLIND_RECORDERS & set(engine.recorders)
            if blind:
                raise refuse(
                    f"VTKRecorder records {sorted(blind)} from O.interactions, where the bonds no longer are; keep only recorders of "
                    "bodies, such as spheres and velocity (engine.write_vtk writes the bonds, and a recorder with dead=True works within "
                    "`with engine.interactions():`)",
                    "BlindEngine",
                )
        elif remedy is not None:
            raise refuse(
                f"O.engines has {name}, which reads O.interactions, where the bonds no longer are; remove it or set dead=True ({remedy})",
                "BlindEngine",
            )


def is_blind(engine: Any) -> bool:
    """Whether an engine reads O.interactions for what only a bonded engine has."""
    return _remedy(engine) is not None or (is_a(engine, "VTKRecorder") and bool(BLIND_RECORDERS & set(engine.recorders)))


def refuse_blind_call(engine: Any) -> None:
    """Raise YadeError if a script calls an engine that would not find the bonds."""
    if is_blind(engine):
        remedy = _remedy(engine) or "use engine.write_vtk()"
        raise refuse(
            f"{type(engine).__name__} reads O.interactions, where the bonds no longer are ({remedy}); call it within `with engine.interactions():`",
            "BlindEngine",
        )


def refuse_idle_loop(engines: Sequence[Any], what: str) -> None:
    """Raise YadeError if no InteractionLoop is alive: in stock YADE, no contact acts then."""
    loops = [engine for engine in engines if is_a(engine, "InteractionLoop")]
    if loops and all(engine.dead for engine in loops):
        raise refuse(
            f"InteractionLoop has dead=True, and stock YADE would compute no contact, but the bonds of {what} act; set dead=False, or delete its bonds "
            "(its remove() or release())",
            "Engines",
        )


def refuse_order(engines: Sequence[Any], mine: Sequence[int], what: str) -> None:
    """Raise YadeError unless the engine `what`, at the places `mine`, is in O.engines once, alive, after ForceResetter and before
    NewtonIntegrator."""
    if not mine:
        raise refuse(
            f"O.engines lacks {what}, so its bonds would not act; keep it when you assign O.engines, or delete its bonds before "
            "(its remove() or release())",
            "EngineLost",
        )
    if len(mine) > 1:
        raise refuse(f"O.engines has {what} {len(mine)} times; keep it once", "EngineOrder")
    place = mine[0]
    if engines[place].dead:
        raise refuse(f"{what} has dead=True, so its bonds do not act; set dead=False, or delete its bonds (its remove() or release())", "EngineDead")
    resetters, integrators = ([k for k, e in enumerate(engines) if is_a(e, name)] for name in ("ForceResetter", "NewtonIntegrator"))
    if not integrators:
        raise refuse(
            f"O.engines has no NewtonIntegrator; add it after {what}",
            "EngineOrder",
        )
    if not resetters or resetters[-1] > place:
        raise refuse(f"ForceResetter must come before {what}, whose forces it would delete; change the order of O.engines", "EngineOrder")
    if integrators[0] < place:
        raise refuse(f"NewtonIntegrator must come after {what}, whose forces it would miss; change the order of O.engines", "EngineOrder")


#: YADE's law of concrete, and its attributes.
LAW = ("Law2_ScGeom_CpmPhys_Cpm", ("omegaThreshold", "epsSoft", "relKnSoft"))
_GEOMETRY = ("Ig2_Sphere_Sphere_ScGeom", ("interactionDetectionFactor", "avoidGranularRatcheting"))
#: The same of cohesive and frictional spheres.
_COHESIVE_LAW = (
    "Law2_ScGeom6D_CohFrictPhys_CohesionMoment",
    ("always_use_moment_law", "neverErase", "shear_creep", "twist_creep", "creep_viscosity", "traceEnergy", "useIncrementalForm"),
)
_COHESIVE_GEOMETRY = ("Ig2_Sphere_Sphere_ScGeom6D", ("interactionDetectionFactor", "avoidGranularRatcheting", "creep", "updateRotations"))
_COHESIVE_PHYSICS = ("Ip2_CohFrictMat_CohFrictMat_CohFrictPhys", ("setCohesionNow", "setCohesionOnNewContacts", "frictAngle"))
_COHESIVE_MATERIAL = (
    *("young", "poisson", "frictionAngle", "alphaKr", "alphaKtw", "etaRoll", "etaTwist", "normalCohesion", "shearCohesion"),
    *("isCohesive", "fragile", "momentRotationLaw"),
)
#: The same of jointed ones.
_JOINTED_LAW = ("Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM", ("smoothJoint", "neverErase", "recordMoments", "useStrainEnergy"))
_JOINTED_PHYSICS = ("Ip2_JCFpmMat_JCFpmMat_JCFpmPhys", ("cohesiveTresholdIteration", "xSectionWeibullShapeParameter"))
_JOINTED_MATERIAL = ("young", "poisson", "frictionAngle", "residualFrictionAngle", "tensileStrength", "cohesion", "type")
_MATERIAL = (
    *("young", "poisson", "sigmaT", "frictionAngle", "epsCrackOnset", "relDuctility", "damLaw", "neverDamage"),
    *("equivStrainShearContrib", "isoPrestress"),
)
#: By material: attributes of functors for law, geometry, and physics, and of the material.
_WATCHED: dict[str, tuple[Any, ...]] = {
    "CpmMat": (LAW, _GEOMETRY, ("Ip2_CpmMat_CpmMat_CpmPhys", ()), _MATERIAL),
    "CohFrictMat": (_COHESIVE_LAW, _COHESIVE_GEOMETRY, _COHESIVE_PHYSICS, _COHESIVE_MATERIAL),
    "JCFpmMat": (_JOINTED_LAW, _GEOMETRY, _JOINTED_PHYSICS, _JOINTED_MATERIAL),
}


#: What concrete needs in InteractionLoop: a functor of this class in each dispatcher.
_FUNCTORS = {"geomDispatcher": _GEOMETRY[0], "physDispatcher": "Ip2_CpmMat_CpmMat_CpmPhys", "lawDispatcher": LAW[0]}
_OR_BOND = "or bond the spheres with bond() or BondedEngine_Rust(scenario=...)"


def functors_of_concrete(engines: Iterable[Any]) -> list[Any]:
    """The functors of concrete for geometry, physics, and law; raise YadeError if one is missing."""
    found = functors_of(engines, _FUNCTORS, "concrete needs")
    if getattr(found[1], "E", None) is not None:
        raise refuse(
            "Ip2_CpmMat_CpmMat_CpmPhys has E, a MatchMaker, which contacts that begin later would lack; set E=None, and young of the materials, "
            "or phys.E of single contacts",
            "NotConcrete",
        )
    return found


def functors_of(engines: Iterable[Any], names: dict[str, str], who: str) -> list[Any]:
    """The functors with these names, by dispatcher; raise YadeError if one is missing. `who`: needs them."""
    loops = [engine for engine in engines if is_a(engine, "InteractionLoop") and not engine.dead]
    if not loops:
        raise refuse(f"O.engines has no active InteractionLoop; add one with {', '.join(names.values())}, {_OR_BOND}", "Engines")
    if len(loops) > 1:
        raise refuse(f"O.engines has {len(loops)} active engines InteractionLoop; keep exactly one", "Engines")
    found = []
    for dispatcher, name in names.items():
        matching = [functor for functor in getattr(loops[0], dispatcher).functors if is_a(functor, name)]
        if not matching:
            raise refuse(f"InteractionLoop has no {name}, which {who}; add it, {_OR_BOND}", "NotConcrete")
        found.append(matching[-1])
    return found


def refuse_sphere(body: int, material: str, state: str) -> None:
    """Raise YadeError: a sphere has only one of CpmMat and CpmState. The arguments are the names of its classes."""
    raise refuse(
        f"body {body} has {material} and {state}, but a sphere of concrete has CpmMat and CpmState; give it both, or neither", "NotConcrete"
    )


def check_damage_law(body: int, law: int) -> None:
    """Raise YadeError if there is no such damage law. `body`: a body of the material."""
    if law not in (0, 1):
        raise refuse(f"damLaw of the material of body {body} is {law}; give 0 or 1", "NotConcrete")


def refuse_contact(one: int, two: int, physics: str, geometry: str) -> None:
    """Raise YadeError: a contact of concrete has objects of other functors. The arguments are the names of their classes."""
    raise refuse(
        f"the contact of bodies {one} and {two} has {physics} and {geometry}, but a contact of concrete has CpmPhys and ScGeom; between "
        "spheres of CpmMat use only Ip2_CpmMat_CpmMat_CpmPhys and Ig2_Sphere_Sphere_ScGeom"
    )


def refuse_image(one: int, two: int) -> None:
    """Raise YadeError: a contact spans more periodic cells than a bond can store."""
    raise refuse(
        f"the contact of bodies {one} and {two} spans more than 127 periodic cells, which is the maximum; move the bodies into one cell "
        "(O.cell.wrap) before YADE creates the contact"
    )


def settings(engines: Iterable[Any], materials: Iterable[Any]) -> dict[str, str]:
    """Settings of the spheres that the engine has read at the take-over: attributes of functors and materials, as text."""
    found: dict[str, str] = {}
    materials = list(materials)
    kind = next((name for name in _WATCHED if any(is_a(material, name) for material in materials)), None)
    if kind is None:
        return found
    of_laws, of_shapes, of_physics, of_materials = _WATCHED[kind]
    for loop in engines:
        if loop.dead or not is_a(loop, "InteractionLoop"):
            continue
        shapes, physics, laws = (dispatcher.functors for dispatcher in (loop.geomDispatcher, loop.physDispatcher, loop.lawDispatcher))
        for (name, attributes), functors in ((of_laws, laws), (of_shapes, shapes), (of_physics, physics)):
            for functor in functors:
                if is_a(functor, name):
                    found.update((f"{name}.{key}", repr(getattr(functor, key))) for key in attributes)
    for material in materials:
        found.update((f"O.materials[{material.id}].{key}", repr(getattr(material, key))) for key in of_materials)
    return found


def check_creation(limit: int, now: int, late: bool = False) -> None:
    """Raise YadeError if YADE still creates bonds at iteration `now`. `limit`: cohesiveThresholdIter; `late`: only if it does so forever."""
    if limit < 0:
        raise refuse(
            "cohesiveThresholdIter is negative, so YADE would create bonds forever; set it to the iteration after which contacts are "
            "unbonded",
            "Engines",
        )
    if now < limit and not late:
        raise refuse(f"YADE creates bonds until iteration {limit} (cohesiveThresholdIter); take over after it", "Engines")


def refuse_later_bonds(engines: Iterable[Any], now: int, what: str) -> None:
    """Raise YadeError if a script lets YADE bond contacts that begin from now on."""
    for loop in engines:
        for functor in loop.physDispatcher.functors if is_a(loop, "InteractionLoop") and not loop.dead else ():
            if is_a(functor, _FUNCTORS["physDispatcher"]) and (functor.cohesiveThresholdIter < 0 or now < functor.cohesiveThresholdIter):
                raise refuse(
                    f"cohesiveThresholdIter is {functor.cohesiveThresholdIter} now, so YADE would bond contacts that begin in this iteration, {now}, but "
                    f"new contacts of {what} stay unbonded; set the number of an iteration, between two steps or from a PyRunner behind NewtonIntegrator",
                    "Changed",
                )


#: The setting of contacts that begin at a distance, as :func:`settings` names it.
DISTANCE = "Ig2_Sphere_Sphere_ScGeom.interactionDetectionFactor"


def bonds_until(engines: Iterable[Any], now: int) -> str:
    """Until when YADE makes bonds from iteration `now` on; empty if it does not."""
    for loop in engines:
        for functor in loop.physDispatcher.functors if is_a(loop, "InteractionLoop") and not loop.dead else ():
            if is_a(functor, _FUNCTORS["physDispatcher"]) and functor.cohesiveThresholdIter > now:
                return f"YADE makes bonds until iteration {functor.cohesiveThresholdIter} (cohesiveThresholdIter)"
    return ""


def late(engines: Sequence[Any], now: int) -> str:
    """Until when YADE makes bonds, or contacts at a distance, from iteration `now` on; empty if it does not."""
    until = bonds_until(engines, now)
    for loop in engines:
        for functor in loop.geomDispatcher.functors if is_a(loop, "InteractionLoop") and not loop.dead and not until else ():
            if is_a(functor, _GEOMETRY[0]) and functor.interactionDetectionFactor not in (1.0, -1.0):
                return f"contacts begin at a distance until interactionDetectionFactor, now {functor.interactionDetectionFactor}, is 1"
    return until


def check_distance(factor: float, functor: str = _GEOMETRY[0]) -> None:
    """Raise YadeError if new contacts would start at a distance."""
    if factor not in (1.0, -1.0):
        raise refuse(
            f"{functor}.interactionDetectionFactor is {factor}, so new contacts would start at a distance; set it to 1 "
            "after the bonds have been created",
            "Engines",
        )


def refuse_shown(shown: bool, what: str) -> None:
    """Raise YadeError if the bonds of an engine are shown as interactions."""
    if shown:
        raise refuse(
            f"the bonds of {what} are shown as interactions, whose forces YADE would add a second time; leave the block "
            "`with engine.interactions()` before the next step",
            "Shown",
        )


def refuse_erasing(what: str, concrete: bool) -> None:
    """Raise YadeError if bonds cannot be erased because YADE does not have their law."""
    if not concrete:
        raise refuse(
            f"bonds of {what} follow a law that stock YADE does not have, and cannot be erased; cut them from the start (the tables `cut` of "
            "the scenario)",
            "Changed",
        )


def refuse_skipped(expected: int, now: int, what: str) -> None:
    """Raise YadeError if the engine did not act in the iterations from `expected` on; `now` is the present one."""
    if now > expected:
        raise refuse(
            f"{what} did not act in iterations {expected} to {now - 1}, in which its bonds were without force; keep it in O.engines "
            "and alive, or delete its bonds (its remove() or release())",
            "Skipped",
        )


def refuse_collider(engines: Iterable[Any], mask: int, what: str) -> None:
    """Raise YadeError if YADE would find contacts between the bonded bodies, whose bit of `groupMask` is `mask`."""
    colliders = [engine for engine in engines if is_a(engine, "Collider") and not engine.dead]
    for collider in colliders:
        if collider.avoidSelfInteractionMask & mask != mask:
            raise refuse(
                f"{type(collider).__name__} has avoidSelfInteractionMask={collider.avoidSelfInteractionMask} without the bit {mask}, which keeps YADE "
                f"from adding a second force between the bodies of {what}; set avoidSelfInteractionMask={collider.avoidSelfInteractionMask | mask}",
                "Masks",
            )


def refuse_apart(engines: Iterable[Any], masks: Sequence[int], mask: int, what: str) -> None:
    """Raise YadeError if YADE would not let bonded bodies touch that have these values of `groupMask`, but for the engine's bit `mask`."""
    for one in masks:
        for two in masks:
            if not one & two:
                raise refuse(
                    f"bonded bodies have groupMask={one | mask} and groupMask={two | mask}, which in YADE do not touch each other, but new contacts of "
                    f"{what} do not ask for it; give them a common bit, or call give_back() before, and take_over() after it",
                    "Masks",
                )
            for collider in (engine for engine in engines if is_a(engine, "Collider") and not engine.dead):
                if one & two & collider.avoidSelfInteractionMask & ~mask:
                    raise refuse(
                        f"{type(collider).__name__} has avoidSelfInteractionMask={collider.avoidSelfInteractionMask}, with which YADE makes no contacts "
                        f"between bodies of groupMask={one | mask}, but new contacts of {what} do not ask for it; set "
                        f"avoidSelfInteractionMask={collider.avoidSelfInteractionMask & ~(one & two) | mask}, or call give_back() before, and take_over() after it",
                        "Masks",
                    )


def refuse_mask(body: int, found: int, mask: int, what: str) -> None:
    """Raise YadeError: a bonded body lost its bit of `groupMask`."""
    raise refuse(
        f"body {body} has groupMask={found} without the bit {mask}, which keeps YADE from adding a second force between the bodies of {what}; "
        f"set groupMask={found | mask}",
        "Masks",
    )


def refuse_material(body: int, what: str) -> None:
    """Raise YadeError: a bonded body has another material than at the take-over."""
    raise refuse(f"body {body} has another material than at the take-over; {what} keeps the old one: set it back", "Changed")


def refuse_radius(body: int, before: float, now: float, what: str) -> None:
    """Raise YadeError: a bonded body has another radius than at the take-over."""
    raise refuse(
        f"the radius of body {body} was {before:.6g} m at the take-over and is {now:.6g} m now (growParticles?); {what} keeps the old "
        "one: change radii before the take-over",
        "Changed",
    )


def refuse_changes(before: dict[str, str], now: dict[str, str], what: str) -> None:
    """Raise YadeError if a setting differs from the one at the take-over. A functor that was removed has no effect on the bonds."""
    for name, value in now.items():
        if before.get(name, value) != value:
            raise refuse(
                f"{name} was {before[name]} at the take-over and is {value} now; {what} keeps the old value: set it back, or set it "
                "before the take-over",
                "Changed",
            )


# -- called by BondedEngine_Rust ---------------------------------------------------------------------------------------


def check_native(engines: Sequence[Any], mine: Sequence[int], what: str, replaced: str) -> None:
    """Raise YadeError unless the native engine works in these engines."""
    refuse_order(engines, mine, what)
    refuse_idle_loop(engines, what)
    refuse_blind_engines(engines, replaced)


def settings_text(engines: Iterable[Any], materials: Iterable[Any]) -> str:
    """:func:`settings` as one text."""
    return json.dumps(settings(engines, materials))


def check_settings(before: str, engines: Iterable[Any], materials: Iterable[Any], what: str) -> None:
    """Raise YadeError if the settings differ from those of :func:`settings_text`."""
    refuse_changes(json.loads(before), settings(engines, materials), what)
