"""Cohesive and frictional spheres (YADE's `CohFrictMat`), for :mod:`._histories`."""

from __future__ import annotations

import contextlib
import math
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ._concrete import class_of, engine_of, scatter_fields, scatter_geometry
from ._history_layout import add_geometry, add_physics
from ._rules import check_distance, functors_of, refuse
from ._scene import Addresses, Bodies, Interactions, Reals, gather, host

#: See :class:`._histories.Law`.
MATERIAL, PHYSICS, WIDTH = "CohFrictMat", "CohFrictPhys", 35
#: The functors.
FUNCTORS = {
    "geomDispatcher": "Ig2_Sphere_Sphere_ScGeom6D",
    "physDispatcher": "Ip2_CohFrictMat_CohFrictMat_CohFrictPhys",
    "lawDispatcher": "Law2_ScGeom6D_CohFrictPhys_CohesionMoment",
}
#: Columns of the history in our solver, in its order, with YADE's attributes of the physics.
_REALS = {
    "normal_stiffness": "kn",
    "shear_stiffness": "ks",
    "rolling_stiffness": "kr",
    "twisting_stiffness": "ktw",
    "friction_coefficient": "tangensOfFrictionAngle",
    "normal_adhesion": "normalAdhesion",
    "shear_adhesion": "shearAdhesion",
    "rolling_adhesion": "rollingAdhesion",
    "twisting_adhesion": "twistingAdhesion",
    "rolling_friction": "maxRollPl",
    "twisting_friction": "maxTwistPl",
    "plastic_overlap": "unp",
    "largest_plastic_displacement": "unpMax",
}
_FLAGS = {"fragile": "fragile", "friction_off": "cohesionDisablesFriction", "moments": "momentRotationLaw"}
_MOMENTS = {"bending_moment": "moment_bending", "twisting_moment": "moment_twist"}
#: Attributes of CohFrictMat but the angle of friction, by the names of our solver.
_MATERIAL = {
    "young": "young",
    "poisson": "poisson",
    "rolling_stiffness": "alphaKr",
    "twisting_stiffness": "alphaKtw",
    "rolling_friction": "etaRoll",
    "twisting_friction": "etaTwist",
    "normal_cohesion": "normalCohesion",
    "shear_cohesion": "shearCohesion",
    "cohesive": "isCohesive",
    "fragile": "fragile",
    "moments": "momentRotationLaw",
}


def add_layout() -> None:
    """See :class:`._histories.Law`."""
    add_physics(PHYSICS, (*_REALS.values(),), ("normalForce", "shearForce", *_MOMENTS.values()), ("cohesionBroken", *_FLAGS.values(), "initCohesion"))
    add_geometry()


def has(name: str) -> bool:
    """Whether this version's CohFrictPhys has an attribute."""
    return f"CohFrictPhys.{name}" in host().layout


class _Settings:
    def __init__(self) -> None:
        omega = host().omega
        geometry, physics, law = functors_of(omega.engines, FUNCTORS, "spheres of CohFrictMat need")
        _refuse_options(geometry, physics, law, omega)
        check_distance(geometry.interactionDetectionFactor, FUNCTORS["geomDispatcher"])
        self.kinematics = "yade-ratcheting" if geometry.avoidGranularRatcheting else "yade"
        self.newton = engine_of("NewtonIntegrator")
        if not omega.dt > 0 or not np.isfinite(omega.dt):
            raise refuse(f"O.dt is {omega.dt}; set it to a positive number", "TimeStep")
        self.dt = omega.dt
        # Other versions are not known to the probing of memory either, unless they are asked for.
        self.rules = {
            "version": "2023.02a" if not has("rollingAdhesion") else "2025.2.0",
            "cohesion_on_new_contacts": bool(physics.setCohesionOnNewContacts),
            "moments_without_cohesion": bool(law.always_use_moment_law),
            "incremental_moments": bool(law.useIncrementalForm),
            "shear_creep_viscosity": float(law.creep_viscosity) if law.shear_creep else 0.0,
        }


def _refuse_options(geometry: Any, physics: Any, law: Any, omega: Any) -> None:
    """Raise YadeError for what our solver does not follow."""
    name = class_of(law)
    for option, why in (
        ("twist_creep", "the creep of twist is not followed"),
        ("neverErase", "contacts end as without it"),
        ("traceEnergy", "the plastic dissipation of the contacts would be missing"),
    ):
        if getattr(law, option):
            raise refuse(f"{name} has {option}=True, but {why}; set {option}=False, or keep YADE's law", "Engines")
    if law.shear_creep and not law.creep_viscosity > 0:
        raise refuse(f"{name}.creep_viscosity is {law.creep_viscosity}; give a positive number with shear_creep", "Engines")
    if omega.trackEnergy:
        raise refuse("O.trackEnergy is True, but the energies of the bonds would be missing in O.energy; set it to False, or keep YADE's law", "Engines")
    name = class_of(geometry)
    if geometry.creep or not geometry.updateRotations:
        raise refuse(f"{name} has creep={geometry.creep} and updateRotations={geometry.updateRotations}; keep False and True, or keep YADE's law", "Engines")
    name = class_of(physics)
    if physics.setCohesionNow:
        raise refuse(
            f"{name} has setCohesionNow=True, and makes bonds in the next step in which YADE has contacts; take one more step, after which YADE itself sets it "
            "to False, or set it to False",
            "Engines",
        )
    makers = ["frictAngle"] + [f"{kind}Cohesion" for kind in ("normal", "shear", "rolling", "twisting")] * bool(physics.setCohesionOnNewContacts)
    for maker in makers:
        if getattr(physics, maker, None) is not None:
            raise refuse(f"{name} has {maker}, a MatchMaker, which contacts that begin later would lack; set {maker}=None, and values of the materials", "Engines")


settings = _Settings


def geometries() -> tuple[str, ...]:
    """See :class:`._histories.Law`."""
    return ("ScGeom6D",)


def material(material: Any) -> dict[str, Any]:
    """See :class:`._histories.Law`."""
    row = {ours: _plain(getattr(material, theirs)) for ours, theirs in _MATERIAL.items()}
    return {**row, "friction_coefficient": math.tan(material.frictionAngle)}


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool) else float(value)


def refuse_bodies(found: Bodies) -> None:
    """See :class:`._histories.Law`."""


def refuse_contacts(contacts: Interactions) -> None:
    """See :class:`._histories.Law`: raise YadeError if a contact is to get cohesion in the next step."""
    if (waiting := np.flatnonzero(gather(contacts.phys, "CohFrictPhys.initCohesion", "u8"))).size:
        k = waiting[0]
        raise refuse(
            f"the contact of bodies {contacts.id1[k]} and {contacts.id2[k]} has initCohesion=True, and gets its cohesion in YADE's next step; take one step before",
            "NotCohesive",
        )


def _quaternions(geom: Addresses) -> tuple[Reals, Reals]:
    """Real and other parts of the orientation of the second body relative to the first, when the contact began."""
    one, two = (gather(geom, f"ScGeom6D.initialOrientation{k}", components=4) for k in (1, 2))
    u, v, s, t = -one[:, :3], two[:, :3], one[:, 3:], two[:, 3:]
    return (s * t)[:, 0] - (u * v).sum(axis=1), s * v + t * u + np.cross(u, v)


def history(contacts: Interactions) -> Reals:
    """See :class:`._histories.Law`."""
    phys, geom = contacts.phys, contacts.geom

    def physics(name: str, components: int = 1) -> Any:
        return gather(phys, f"CohFrictPhys.{name}", components=components)

    def flag(name: str) -> Any:
        return gather(phys, f"CohFrictPhys.{name}", "u8").astype(float)

    columns = [physics(name) if has(name) else np.zeros(len(phys)) for name in _REALS.values()]
    columns.append(1.0 - flag("cohesionBroken"))
    columns += [flag(name) for name in _FLAGS.values()]
    normal = gather(geom, "ScGeom.normal", components=3)
    columns.append(np.einsum("ij,ij->i", physics("normalForce", 3), normal))
    real, rest = _quaternions(geom)
    vectors = [physics("shearForce", 3), *(physics(name, 3) for name in _MOMENTS.values()), real[:, None], rest]
    shape = [gather(geom, "ScGeom6D.twist")[:, None], gather(geom, "ScGeom6D.bending", components=3)]
    return np.concatenate([np.stack(columns, axis=1), *vectors, *shape], axis=1)


#: What a script may change with an effect: of the physics, with the numbers of bytes, and of the geometry.
_WATCHED = (
    *((name, 8) for name in _REALS.values()),
    *((name, 1) for name in ("cohesionBroken", *_FLAGS.values(), "initCohesion")),
    *((name, 24) for name in ("shearForce", *_MOMENTS.values())),
)
_WATCHED_GEOMETRY = (("initialOrientation1", 32), ("initialOrientation2", 32))


def watched() -> tuple[tuple[str, int], ...]:
    """See :class:`._histories.Law`."""
    return tuple((name, size) for name, size in _WATCHED if has(name))


def rows_of_geometry(geom: Addresses) -> tuple[tuple[tuple[str, int], ...], NDArray[np.uint8]]:
    """See :class:`._histories.Law`: `Ip2.setCohesion` changes it."""
    return _WATCHED_GEOMETRY, _core.memory_rows(geom, [(host().layout[f"ScGeom6D.{name}"], size) for name, size in _WATCHED_GEOMETRY])


def classes() -> tuple[str, str]:
    """See :class:`._histories.Law`."""
    return "ScGeom6D", "CohFrictPhys"


making = contextlib.nullcontext


def write_values(geom: Addresses, phys: Addresses, first: Reals, table: Any, sign: Reals, read: Sequence[tuple[int, int]] = ()) -> NDArray[np.uint8]:
    """See :class:`._histories.Law`."""
    turned = sign[:, None]
    normal = table["normal"] * turned
    scatter_geometry(geom, first, normal, table["length"], gather(geom, "ScGeom.refR1"), gather(geom, "ScGeom.refR2"))
    # Of both orientations, YADE's law needs only one relative to the other.
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (len(sign), 1))
    rest = np.concatenate([table["rest_rotation"] * turned, table["rest_rotation_real"][:, None]], axis=1)
    scatter_fields(
        geom,
        "ScGeom6D",
        {
            "initialOrientation1": upright,
            "initialOrientation2": rest,
            "twist": table["twist"],
            "bending": table["bending"] * turned,
        },
    )
    for name, values in {"cohesionBroken": 1.0 - table["cohesive"], **{name: table[ours] for ours, name in _FLAGS.items()}}.items():
        _core.memory_scatter_u8(phys, host().layout[f"CohFrictPhys.{name}"], values.astype(np.uint8))
    return scatter_fields(
        phys,
        "CohFrictPhys",
        {
            **{name: table[ours] for ours, name in _REALS.items() if has(name)},
            **{name: table[ours] * turned for ours, name in _MOMENTS.items()},
            "shearForce": table["shear_force"] * turned,
            "normalForce": table["normal_force"][:, None] * normal,
        },
        read,
    )
