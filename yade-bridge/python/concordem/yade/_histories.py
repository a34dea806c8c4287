"""Transfers spheres whose contacts have histories with all that YADE keeps of them (`CohFrictMat`, `JCFpmMat`) from a scene to our solver and back.

The history of a contact in our solver has the same numbers as YADE's physics and geometry of it, so single contacts keep the stiffnesses and
strengths that a script has given to them. What differs between the laws is in a module each: :mod:`._cohesive`, :mod:`._jointed`.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any, Protocol, Sequence

import numpy as np
from numpy.typing import NDArray

from .. import _core
from . import _cohesive, _jointed
from ._clumps import Clumps
from ._concrete import cell_of, class_of, create_interactions, write_images
from ._memory import address_of
from ._rules import refuse, refuse_image
from ._scene import Addresses, Bodies, Interactions, Reals, bodies, gather, host, interactions, of_class


class Settings(Protocol):
    """Settings of a scene's engines that affect the spheres."""

    kinematics: str
    newton: Any
    dt: float
    rules: dict[str, Any]


class Law(Protocol):
    """What a module says of a law."""

    #: YADE's classes of the material and of the physics, and the columns of the history.
    MATERIAL: str
    PHYSICS: str
    WIDTH: int
    #: YADE's functors by dispatcher.
    FUNCTORS: dict[str, str]

    def add_layout(self) -> None:
        """Find the fields in YADE's memory."""

    def settings(self) -> Settings:
        """Of the scene; raise YadeError for what our solver does not follow."""

    def geometries(self) -> tuple[str, ...]:
        """YADE's classes of the geometry of a contact that this scene may have."""

    def material(self, material: Any) -> dict[str, Any]:
        """Attributes of a material, by the names of our solver."""

    def refuse_bodies(self, found: Bodies) -> None:
        """Raise YadeError for spheres that our solver does not follow."""

    def refuse_contacts(self, contacts: Interactions) -> None:
        """Raise YadeError for contacts that our solver does not follow."""

    def history(self, contacts: Interactions) -> Reals:
        """What YADE keeps of the contacts, a row each."""

    def watched(self) -> tuple[tuple[str, int], ...]:
        """Names and bytes of what a script may change in the physics."""

    def rows_of_geometry(self, geom: Addresses) -> tuple[tuple[tuple[str, int], ...], NDArray[np.uint8]] | None:
        """Names and bytes of what a script may change in the geometry, and these."""

    def classes(self) -> tuple[str, str]:
        """Names of YADE's classes of geometry and physics."""

    def making(self) -> AbstractContextManager[None]:
        """Within this, YADE makes interactions whose histories are written afterwards."""

    def write_values(
        self, geom: Addresses, phys: Addresses, first: Reals, table: Any, sign: Reals, read: Sequence[tuple[int, int]] = ()
    ) -> NDArray[np.uint8]:
        """Write what our solver keeps of the contacts, and read the physics at `read`. `first`: positions of the first bodies in that step; `sign`: -1
        where the table has the bodies in the other order."""


#: The laws by the kind of their bonded engines.
LAWS: dict[str, Law] = {"cohesive": _cohesive, "jointed": _jointed}


def _have(everything: Bodies, material: str) -> NDArray[np.bool_]:
    """Which bodies have a material of this class."""
    omega = host().omega
    _, first, number = np.unique(everything.material, return_index=True, return_inverse=True)
    found = [class_of(omega.bodies[int(everything.ids[k])].material) == material for k in first]
    return np.array(found, bool)[number.reshape(-1)]


def spheres(everything: Bodies, kind: str) -> NDArray[np.bool_]:
    """Which bodies are spheres of the material of a law."""
    return of_class(everything.shape, "Sphere.vtable") & _have(everything, LAWS[kind].MATERIAL)


def kind_of(everything: Bodies) -> str:
    """The kind of the spheres that a take-over takes, if they are not of concrete, which goes first; empty for none."""
    if of_class(everything.state, "CpmState.vtable").any():
        return ""
    return next((kind for kind in LAWS if spheres(everything, kind).any()), "")


class Spheres:
    """The spheres under a law of a scene and the contacts between them. `only`: ids of the spheres; the others are foreign."""

    def __init__(self, kind: str, only: Any = None) -> None:
        self._kind, self.law = kind, LAWS[kind]
        self.law.add_layout()
        self.settings = self.law.settings()
        everything = bodies()
        ball = spheres(everything, kind)
        if only is not None:
            ball &= np.isin(everything.ids, only)
        self.bodies = everything.of(ball)
        if not len(self.bodies.ids):
            raise refuse(f"the scene has no spheres of {self.law.MATERIAL}; add them", "NotCohesive")
        self.law.refuse_bodies(self.bodies)
        omega = host().omega
        distinct, first, number = np.unique(self.bodies.material, return_index=True, return_inverse=True)
        self.materials = [omega.bodies[int(self.bodies.ids[k])].material for k in first]
        self._material = number.astype(np.uint32).reshape(-1)
        self._row = np.full(int(everything.ids.max()) + 1, -1, np.int64)
        self._row[self.bodies.ids] = np.arange(len(self.bodies.ids))
        found = interactions()
        inner = (self._row[found.id1] >= 0) & (self._row[found.id2] >= 0)
        shapes = self.law.geometries()
        known = of_class(found.phys, f"{self.law.PHYSICS}.vtable") & np.any([of_class(found.geom, f"{name}.vtable") for name in shapes], axis=0)
        if (foreign := np.flatnonzero(inner & ~known)).size:
            contact = host().interactions[int(found.id1[foreign[0]]), int(found.id2[foreign[0]])]
            functors = self.law.FUNCTORS
            raise refuse(
                f"the contact of bodies {contact.id1} and {contact.id2} has {class_of(contact.phys)} and {class_of(contact.geom)}, but a contact of "
                f"{self.law.MATERIAL} has {self.law.PHYSICS} and {' or '.join(shapes)}; between spheres of {self.law.MATERIAL} use only "
                f"{functors['physDispatcher']} and {functors['geomDispatcher']}"
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
                {"kind": self._kind, **self.kind()},
                threads or omega.numThreads,
                self.clumps.arrays(settings.newton, settings.dt),
                kinematics or settings.kinematics,
            )
        except ValueError as error:
            raise refuse(str(error)) from error

    def kind(self) -> dict[str, Any]:
        """What a bonded engine saves of it."""
        return {"materials": [self.law.material(material) for material in self.materials], "rules": self.settings.rules}

    def _contact_arrays(self) -> dict[str, Any]:
        contacts = self.contacts
        self.law.refuse_contacts(contacts)
        if (far := np.flatnonzero(np.abs(contacts.image).max(axis=1, initial=0) > 127)).size:
            refuse_image(int(contacts.id1[far[0]]), int(contacts.id2[far[0]]))
        radii = gather(contacts.geom, "ScGeom.refR1") + gather(contacts.geom, "ScGeom.refR2")
        return {
            "pair": np.stack([self._row[contacts.id1], self._row[contacts.id2]], axis=1).astype(np.uint32),
            "image": contacts.image,
            "normal": gather(contacts.geom, "ScGeom.normal", components=3),
            "distance": radii - gather(contacts.geom, "ScGeom.penetrationDepth"),
            "history": self.law.history(contacts),
        }


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
    law, materials, rules = kind["kind"], kind["materials"], kind["rules"]
    return _core.Hosted.with_histories(law, arrays, contacts, materials, rules, omega.dt, kinematics, cell=cell, threads=threads, clumps=clumps)


def without_contacts(kind: str) -> dict[str, Any]:
    """Arrays of no contacts, for an assembly whose state is read from a file."""
    return {
        "pair": np.zeros((0, 2), np.uint32),
        "image": np.zeros((0, 3), np.int8),
        "normal": np.zeros((0, 3)),
        "distance": np.zeros(0),
        "history": np.zeros((0, LAWS[kind].WIDTH)),
    }


def places(kind: str) -> list[tuple[int, int]]:
    """Offsets and numbers of bytes of what a script may change in the physics."""
    law = LAWS[kind]
    return [(host().layout[f"{law.PHYSICS}.{name}"], size) for name, size in law.watched()]


def write_contacts(solver: _core.Hosted, kind: str) -> dict[str, int]:
    """Write the contacts to YADE, which has none between these bodies."""
    table, now = solver.contacts()["unbonded"], solver.bodies()
    one, two = np.minimum(table["a"], table["b"]), np.maximum(table["a"], table["b"])
    if len(np.unique(one.astype(np.int64) << 32 | two)) != len(table):
        raise refuse("two bodies touch through two periodic images, which YADE cannot store; enlarge the cell", "TwoImages")
    with LAWS[kind].making():
        made = create_interactions(one, two)
    address = np.array([address_of(contact) for contact in made], np.uint64)
    geom, phys = (np.array([address_of(getattr(contact, name)) for contact in made], np.uint64) for name in ("geom", "phys"))
    first_ids = np.array([contact.id1 for contact in made], np.int64)
    sign = np.where(table["a"] == first_ids, 1.0, -1.0)
    row = np.zeros(int(now["id"].max()) + 1, np.int64)
    row[now["id"]] = np.arange(len(now["id"]))
    write_images(address, table["image"] * sign.astype(np.int32)[:, None])
    LAWS[kind].write_values(geom, phys, now["position"][row[first_ids]], table, sign)
    return {"erased": 0, "made": len(made), "written": len(made)}
