"""Jointed cohesive frictional spheres (YADE's `JCFpmMat`), for :mod:`._histories`, and what YADE's law counts and records of their cracks."""

from __future__ import annotations

import contextlib
import math
from typing import Any, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ._concrete import class_of, engine_of, scatter_fields, scatter_geometry
from ._history_layout import add_geometry, add_physics
from ._rules import check_distance, functors_of, is_a, refuse
from ._scene import Addresses, Bodies, Interactions, Reals, gather, host

#: See :class:`._histories.Law`.
MATERIAL, PHYSICS, WIDTH = "JCFpmMat", "JCFpmPhys", 17
#: The functors.
FUNCTORS = {
    "geomDispatcher": "Ig2_Sphere_Sphere_ScGeom",
    "physDispatcher": "Ip2_JCFpmMat_JCFpmMat_JCFpmPhys",
    "lawDispatcher": "Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM",
}
#: Geometry with more attributes, of which our solver keeps none.
_SIX = "Ig2_Sphere_Sphere_ScGeom6D"
#: Columns of the history in our solver that a script may change with an effect, with YADE's attributes of the physics.
_REALS = {
    "normal_stiffness": "kn",
    "shear_stiffness": "ks",
    "friction_coefficient": "tanFrictionAngle",
    "largest_tension": "FnMax",
    "largest_shear": "FsMax",
    "cross_section": "crossSection",
    "rest_overlap": "initD",
}
#: Those that the law computes in every step.
_RESULTS = {"aperture": "crackJointAperture", "strain_energy": "strainEnergy"}
#: Flags, with their columns. YADE's law sets the last two together.
_FLAGS = {"isCohesive": "cohesive", "isBroken": "cracked", "momentBroken": "cracked"}
#: Attributes of JCFpmMat but the angles of friction, by the names of our solver.
_MATERIAL = {
    "young": "young",
    "poisson": "poisson",
    "tensile_strength": "tensileStrength",
    "cohesion": "cohesion",
}


def add_layout() -> None:
    """See :class:`._histories.Law`."""
    add_physics(PHYSICS, (*_REALS.values(), *_RESULTS.values()), ("normalForce", "shearForce"), (*_FLAGS, "isOnJoint"))
    add_geometry()


class _Settings:
    def __init__(self) -> None:
        omega = host().omega
        geometry, physics, law = functors_of(omega.engines, FUNCTORS, "spheres of JCFpmMat need")
        _refuse_options(geometry, physics, law, omega)
        check_distance(geometry.interactionDetectionFactor, class_of(geometry))
        self.kinematics = "yade-ratcheting" if geometry.avoidGranularRatcheting else "yade"
        self.newton = engine_of("NewtonIntegrator")
        if not omega.dt > 0 or not np.isfinite(omega.dt):
            raise refuse(f"O.dt is {omega.dt}; set it to a positive number", "TimeStep")
        self.dt = omega.dt
        self.rules = {"bonds_new_contacts": physics.cohesiveTresholdIteration < 0, "never_erase": bool(law.neverErase)}


settings = _Settings


def _refuse_options(geometry: Any, physics: Any, law: Any, omega: Any) -> None:
    """Raise YadeError for what our solver does not follow."""
    name = class_of(law)
    if law.recordMoments:
        raise refuse(
            f"{name} has recordMoments=True, but clusters of cracks are not followed; set recordMoments=False (`concordem events` clusters cracks of results "
            "of our own solver), or keep YADE's law",
            "Engines",
        )
    if not law.useStrainEnergy:
        raise refuse(f"{name} has useStrainEnergy=False, but kineticEnergy of the contacts is not followed; set useStrainEnergy=True, or keep YADE's law", "Engines")
    if omega.trackEnergy:
        raise refuse("O.trackEnergy is True, but the energies of the bonds would be missing in O.energy; set it to False, or keep YADE's law", "Engines")
    name, limit = class_of(physics), physics.cohesiveTresholdIteration
    if omega.iter < limit:
        raise refuse(f"YADE creates bonds until iteration {limit} ({name}.cohesiveTresholdIteration); take over after it", "Engines")
    if limit < 0 and physics.xSectionWeibullShapeParameter > 0:
        raise refuse(
            f"{name} has cohesiveTresholdIteration={limit} and xSectionWeibullShapeParameter={physics.xSectionWeibullShapeParameter}, so YADE draws the strengths "
            "of later bonds at random, without a seed; set cohesiveTresholdIteration=1, or keep YADE's law",
            "Engines",
        )


def geometries() -> tuple[str, ...]:
    """See :class:`._histories.Law`."""
    return ("ScGeom", "ScGeom6D")


def material(material: Any) -> dict[str, Any]:
    """See :class:`._histories.Law`."""
    row = {ours: float(getattr(material, theirs)) for ours, theirs in _MATERIAL.items()}
    angle, residual = material.frictionAngle, material.residualFrictionAngle
    friction = {"friction_coefficient": math.tan(angle), "residual_friction_coefficient": math.tan(residual if residual >= 0 else angle)}
    return {**row, **friction, "type": int(material.type)}


_NO_JOINTS = "smooth joints and joint strengths are not followed; keep YADE's law for this scene"


def refuse_bodies(found: Bodies) -> None:
    """See :class:`._histories.Law`: raise YadeError for spheres on a joint."""
    omega = host().omega
    for number in found.ids.tolist():
        if omega.bodies[number].state.onJoint:
            raise refuse(f"body {number} has state.onJoint=True, but {_NO_JOINTS}, or set onJoint=False before YADE makes contacts", "Joints")


def refuse_contacts(contacts: Interactions) -> None:
    """See :class:`._histories.Law`: raise YadeError for contacts on a joint."""
    if (joined := np.flatnonzero(gather(contacts.phys, "JCFpmPhys.isOnJoint", "u8"))).size:
        k = joined[0]
        raise refuse(f"the contact of bodies {contacts.id1[k]} and {contacts.id2[k]} has isOnJoint=True, but {_NO_JOINTS}", "Joints")


def history(contacts: Interactions) -> Reals:
    """See :class:`._histories.Law`."""
    phys = contacts.phys

    def physics(name: str, components: int = 1) -> Any:
        return gather(phys, f"JCFpmPhys.{name}", components=components)

    columns = [physics(name) for name in _REALS.values()]
    columns += [gather(phys, f"JCFpmPhys.{name}", "u8").astype(float) for name in ("isCohesive", "isBroken")]
    # Without shear stiffness, YADE's energy is 0/0.
    columns += [np.nan_to_num(physics(name)) for name in _RESULTS.values()]
    normal = gather(contacts.geom, "ScGeom.normal", components=3)
    none = np.zeros(len(phys))
    # Of cracks and events there is nothing between two steps.
    columns += [none, np.einsum("ij,ij->i", physics("normalForce", 3), normal)]
    return np.concatenate([np.stack(columns, axis=1), physics("shearForce", 3), none[:, None]], axis=1)


_WATCHED = (
    *((name, 8) for name in _REALS.values()),
    *((name, 1) for name in (*_FLAGS, "isOnJoint")),
    *((name, 24) for name in ("normalForce", "shearForce")),
)


def watched() -> tuple[tuple[str, int], ...]:
    """See :class:`._histories.Law`."""
    return _WATCHED


def rows_of_geometry(geom: Addresses) -> None:
    """See :class:`._histories.Law`."""


def _is_six() -> bool:
    """Whether YADE's functor makes ScGeom6D."""
    functor, *_ = functors_of(host().omega.engines, FUNCTORS, "spheres of JCFpmMat need")
    return is_a(functor, _SIX)


def classes() -> tuple[str, str]:
    """See :class:`._histories.Law`."""
    return ("ScGeom6D" if _is_six() else "ScGeom"), "JCFpmPhys"


@contextlib.contextmanager
def making() -> Iterator[None]:
    """See :class:`._histories.Law`: YADE would count bonds a second time."""
    _, physics, _ = functors_of(host().omega.engines, FUNCTORS, "spheres of JCFpmMat need")
    limit = physics.cohesiveTresholdIteration
    physics.cohesiveTresholdIteration = 0
    try:
        yield
    finally:
        physics.cohesiveTresholdIteration = limit


def write_values(geom: Addresses, phys: Addresses, first: Reals, table: Any, sign: Reals, read: Sequence[tuple[int, int]] = ()) -> NDArray[np.uint8]:
    """See :class:`._histories.Law`."""
    turned = sign[:, None]
    normal = table["normal"] * turned
    scatter_geometry(geom, first, normal, table["length"], gather(geom, "ScGeom.refR1"), gather(geom, "ScGeom.refR2"))
    for name, column in _FLAGS.items():
        _core.memory_scatter_u8(phys, host().layout[f"JCFpmPhys.{name}"], table[column].astype(np.uint8))
    return scatter_fields(
        phys,
        PHYSICS,
        {
            **{name: table[ours] for ours, name in (_REALS | _RESULTS).items()},
            "shearForce": table["shear_force"] * turned,
            "normalForce": table["normal_force"][:, None] * normal,
        },
        read,
    )


# -- cracks -----------------------------------------------------------------------------------------------------------

_HEADER = "iter time p0 p1 p2 type size norm0 norm1 norm2 nrg onJnt"


def count_cracks(solver: _core.Hosted, first: int, before: int) -> None:
    """Add what has happened to bonds to the counts of YADE's law and states, and to its record. `first`: the iteration of the assembly's step
    `before`."""
    cracks, begun = solver.take_happenings()
    omega = host().omega
    for pair in begun:
        for number in pair:
            omega.bodies[number].state.nbInitBonds += 1
    if not cracks:
        return
    *_, law = functors_of(omega.engines, FUNCTORS, "spheres of JCFpmMat need")
    lines = []
    for step, pair, kind, point, normal, size, energy, area in cracks:
        for number in pair:
            state = omega.bodies[number].state
            state.nbBrokenBonds += 1
            state.damageIndex += 1.0 / state.nbInitBonds if state.nbInitBonds else np.inf
        if kind == 1:
            law.nbTensCracks += 1
            law.totalTensCracksE += energy
        else:
            law.nbShearCracks += 1
            law.totalShearCracksE += energy
        law.totalCracksSurface += area
        time = omega.time
        for _ in range(step - before):
            time += omega.dt
        numbers = (time, *point), (size, *normal, energy)
        place, rest = (" ".join(f"{x:.17g}" for x in part) for part in numbers)
        lines.append(f"{first + step - before} {place} {kind} {rest} 0\n")
    if law.recordCracks:
        _record(f"cracks_{law.Key}.txt", lines, law.cracksFileExist)
    law.cracksFileExist = True


def _record(path: str, lines: list[str], goes_on: bool) -> None:
    with open(path, "a" if goes_on else "w", encoding="utf-8") as file:
        if file.tell() == 0:
            file.write(_HEADER + "\n")
        file.writelines(lines)
