"""Transfers cohesive and frictional spheres (YADE's `CohFrictMat`) with the histories of their contacts from a scene to our solver and back.

The history of a contact in our solver has what YADE keeps in `CohFrictPhys` and `ScGeom6D`, with the same numbers, so single contacts keep the
stiffnesses and strengths that a script has given to them.
"""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ._clumps import Clumps
from ._cohesive_layout import add_layout, has
from ._concrete import cell_of, class_of, create_interactions, engine_of, scatter_fields, write_images
from ._memory import address_of
from ._rules import check_distance, functors_of, refuse, refuse_image
from ._scene import Addresses, Bodies, Interactions, Reals, bodies, gather, host, interactions, of_class

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


class Settings:
    """Settings of a scene's engines that affect cohesive and frictional spheres."""

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


def _are_cohesive(everything: Bodies) -> NDArray[np.bool_]:
    """Which bodies have a CohFrictMat."""
    omega = host().omega
    _, first, number = np.unique(everything.material, return_index=True, return_inverse=True)
    found = [class_of(omega.bodies[int(everything.ids[k])].material) == "CohFrictMat" for k in first]
    return np.array(found, bool)[number.reshape(-1)]


def spheres(everything: Bodies) -> NDArray[np.bool_]:
    """Which bodies are spheres of CohFrictMat."""
    return of_class(everything.shape, "Sphere.vtable") & _are_cohesive(everything)


def is_cohesive(everything: Bodies) -> bool:
    """Whether a take-over takes spheres of CohFrictMat: there are some, and no concrete."""
    return not of_class(everything.state, "CpmState.vtable").any() and bool(spheres(everything).any())


class Cohesive:
    """The spheres of CohFrictMat of a scene and the contacts between them. `only`: ids of the spheres; the others are foreign."""

    def __init__(self, only: Any = None) -> None:
        add_layout()
        self.settings = Settings()
        everything = bodies()
        ball = spheres(everything)
        if only is not None:
            ball &= np.isin(everything.ids, only)
        self.bodies = everything.of(ball)
        if not len(self.bodies.ids):
            raise refuse("the scene has no spheres of CohFrictMat; add them", "NotCohesive")
        omega = host().omega
        distinct, first, number = np.unique(self.bodies.material, return_index=True, return_inverse=True)
        self.materials = [omega.bodies[int(self.bodies.ids[k])].material for k in first]
        self._material = number.astype(np.uint32).reshape(-1)
        self._row = np.full(int(everything.ids.max()) + 1, -1, np.int64)
        self._row[self.bodies.ids] = np.arange(len(self.bodies.ids))
        found = interactions()
        inner = (self._row[found.id1] >= 0) & (self._row[found.id2] >= 0)
        known = of_class(found.phys, "CohFrictPhys.vtable") & of_class(found.geom, "ScGeom6D.vtable")
        if (foreign := np.flatnonzero(inner & ~known)).size:
            contact = host().interactions[int(found.id1[foreign[0]]), int(found.id2[foreign[0]])]
            raise refuse(
                f"the contact of bodies {contact.id1} and {contact.id2} has {class_of(contact.phys)} and {class_of(contact.geom)}, but a contact of CohFrictMat "
                f"has CohFrictPhys and ScGeom6D; between spheres of CohFrictMat use only {FUNCTORS['physDispatcher']} and {FUNCTORS['geomDispatcher']}"
            )
        self.contacts = found.of(inner)
        self.clumps = Clumps(self.bodies.ids)

    def anew(self, contacts: Interactions, threads: int | None) -> _core.Hosted:
        """The assembly with these contacts instead of those of the scene."""
        self.contacts = contacts
        return self.hosted(threads)

    def hosted(self, threads: int | None, kinematics: str | None = None) -> _core.Hosted:
        """The assembly in our solver."""
        settings, omega = self.settings, host().omega
        try:
            return hosted(
                self.bodies,
                self._material,
                self._contact_arrays(),
                self.kind(),
                threads or omega.numThreads,
                self.clumps.arrays(settings.newton, settings.dt),
                kinematics or settings.kinematics,
            )
        except ValueError as error:
            raise refuse(str(error)) from error

    def kind(self) -> dict[str, Any]:
        """What a bonded engine saves of it."""
        rows = []
        for material in self.materials:
            row = {ours: _plain(getattr(material, theirs)) for ours, theirs in _MATERIAL.items()}
            rows.append({**row, "friction_coefficient": math.tan(material.frictionAngle)})
        return {"materials": rows, "rules": self.settings.rules}

    def _contact_arrays(self) -> dict[str, Any]:
        contacts = self.contacts
        _refuse_waiting(contacts)
        if (far := np.flatnonzero(np.abs(contacts.image).max(axis=1, initial=0) > 127)).size:
            refuse_image(int(contacts.id1[far[0]]), int(contacts.id2[far[0]]))
        radii = gather(contacts.geom, "ScGeom.refR1") + gather(contacts.geom, "ScGeom.refR2")
        return {
            "pair": np.stack([self._row[contacts.id1], self._row[contacts.id2]], axis=1).astype(np.uint32),
            "image": contacts.image,
            "normal": gather(contacts.geom, "ScGeom.normal", components=3),
            "distance": radii - gather(contacts.geom, "ScGeom.penetrationDepth"),
            "history": _history(contacts),
        }


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool) else float(value)


def hosted(found: Bodies, material: Any, contacts: dict[str, Any], kind: dict[str, Any], threads: int, clumps: Any, kinematics: str) -> _core.Hosted:
    """The assembly of these spheres."""
    omega, state = host().omega, found.state
    inertia = gather(state, "State.inertia", components=3)
    if not (inertia[:, 0] == inertia[:, 1]).all() or not (inertia[:, 0] == inertia[:, 2]).all():
        raise refuse("a sphere has different moments of inertia about its axes; give it equal ones")
    arrays = {
        "id": found.ids.astype(np.uint32),
        "position": found.positions,
        "velocity": gather(state, "State.vel", components=3),
        "orientation": gather(state, "State.ori", components=4),
        "angular_velocity": gather(state, "State.angVel", components=3),
        "radius": gather(found.shape, "Sphere.radius"),
        "mass": gather(state, "State.mass"),
        "inertia": np.ascontiguousarray(inertia[:, 0]),
        "material": material,
        "constraint": gather(state, "State.blockedDOFs", "i32").astype(np.uint32),
        "lost": np.zeros(len(found.ids), np.uint32),
    }
    cell = cell_of(omega) if omega.periodic else None
    return _core.Hosted.cohesive(arrays, contacts, kind["materials"], kind["rules"], omega.dt, kinematics, cell=cell, threads=threads, clumps=clumps)


def without_contacts() -> dict[str, Any]:
    """Arrays of no contacts, for an assembly whose state is read from a file."""
    return {
        "pair": np.zeros((0, 2), np.uint32),
        "image": np.zeros((0, 3), np.int8),
        "normal": np.zeros((0, 3)),
        "distance": np.zeros(0),
        "history": np.zeros((0, 35)),
    }


def _refuse_waiting(contacts: Interactions) -> None:
    """Raise YadeError if a contact is to get cohesion in the next step."""
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


def _history(contacts: Interactions) -> Reals:
    """What YADE keeps of the contacts, a row each."""
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
    """Names and bytes of what a script may change in the physics."""
    return tuple((name, size) for name, size in _WATCHED if has(name))


def places() -> list[tuple[int, int]]:
    """Where these are."""
    return [(host().layout[f"CohFrictPhys.{name}"], size) for name, size in watched()]


def rows_of_geometry(geom: Addresses) -> tuple[tuple[tuple[str, int], ...], NDArray[np.uint8]]:
    """What a script may change in the geometry (`Ip2.setCohesion`)."""
    return _WATCHED_GEOMETRY, _core.memory_rows(geom, [(host().layout[f"ScGeom6D.{name}"], size) for name, size in _WATCHED_GEOMETRY])


def new_objects(count: int) -> list[tuple[Any, Any]]:
    """Objects of YADE for contacts: geometry and physics."""
    wrapper = host().wrapper
    return [(wrapper.ScGeom6D(), wrapper.CohFrictPhys()) for _ in range(count)]


def write_values(geom: Addresses, phys: Addresses, first: Reals, table: Any, sign: Reals, read: Sequence[tuple[int, int]] = ()) -> NDArray[np.uint8]:
    """Write what our solver keeps of the contacts, and read the physics at `read`. `first`: positions of the first bodies in that step; `sign`: -1
    where the table has the bodies in the other order."""
    turned = sign[:, None]
    normal = table["normal"] * turned
    radius = gather(geom, "ScGeom.refR1")
    overlap = radius + gather(geom, "ScGeom.refR2") - table["length"]
    scatter_fields(
        geom,
        "ScGeom",
        {"normal": normal, "penetrationDepth": overlap, "contactPoint": first + normal * (radius - 0.5 * overlap)[:, None]},
    )
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


def write_contacts(solver: _core.Hosted) -> dict[str, int]:
    """Write the contacts to YADE, which has none between these bodies."""
    table, now = solver.contacts()["unbonded"], solver.bodies()
    one, two = np.minimum(table["a"], table["b"]), np.maximum(table["a"], table["b"])
    if len(np.unique(one.astype(np.int64) << 32 | two)) != len(table):
        raise refuse("two bodies touch through two periodic images, which YADE cannot store; enlarge the cell", "TwoImages")
    made = create_interactions(one, two)
    address = np.array([address_of(contact) for contact in made], np.uint64)
    geom, phys = (np.array([address_of(getattr(contact, name)) for contact in made], np.uint64) for name in ("geom", "phys"))
    first_ids = np.array([contact.id1 for contact in made], np.int64)
    sign = np.where(table["a"] == first_ids, 1.0, -1.0)
    row = np.zeros(int(now["id"].max()) + 1, np.int64)
    row[now["id"]] = np.arange(len(now["id"]))
    write_images(address, table["image"] * sign.astype(np.int32)[:, None])
    write_values(geom, phys, now["position"][row[first_ids]], table, sign)
    return {"erased": 0, "made": len(made), "written": len(made)}
