"""Transfers concrete (YADE's CPM) with its history from a scene to our solver and back."""

from __future__ import annotations

import ctypes
from typing import Any, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ._clumps import Clumps
from ._memory import address_of
from ._own import STORED, Own, damage, defined, own_of, rows_of_pairs
from ._rules import (
    check_creation,
    check_damage_law,
    check_distance,
    functors_of_concrete,
    is_a,
    refuse,
    refuse_contact,
    refuse_image,
    refuse_sphere,
)
from ._scene import Addresses, Bodies, Interactions, Ints, Reals, bodies, gather, host, interactions, of_class

#: Engines that our solver replaces while it advances a scene.
REPLACED = {"ForceResetter", "InsertionSortCollider", "InteractionLoop", "NewtonIntegrator"}
#: Engines that only observe or run scripts; they do not run meanwhile.
PAUSED = {"PyRunner", "CpmStateUpdater", "VTKRecorder", "SnapshotEngine", "PeriodicEngine"}


def class_of(instance: Any) -> str:
    """Name of an object's class."""
    return str(type(instance).__name__)


def engine_of(name: str) -> Any:
    """The only active engine of this class; an error if there is not exactly one."""
    found = [engine for engine in host().omega.engines if class_of(engine) == name and not engine.dead]
    if len(found) != 1:
        raise refuse(f"O.engines has {len(found)} active engines {name}; keep exactly one", "Engines")
    return found[0]


class Settings:
    """Settings of a scene's engines that affect concrete. `late`: whether YADE may make bonds later."""

    def __init__(self, late: bool = False) -> None:
        omega = host().omega
        geometry, physics, law = functors_of_concrete(omega.engines)
        self.omega_threshold, self.eps_soft, self.rel_kn_soft = law.omegaThreshold, law.epsSoft, law.relKnSoft
        self.ratcheting = bool(geometry.avoidGranularRatcheting)
        check_creation(physics.cohesiveThresholdIter, omega.iter, late)
        if not late:
            check_distance(geometry.interactionDetectionFactor)
        self.newton = engine_of("NewtonIntegrator")
        self.damping, self.gravity = self.newton.damping, tuple(self.newton.gravity)
        if not omega.dt > 0 or not np.isfinite(omega.dt):
            raise refuse(f"O.dt is {omega.dt}; set it to a positive number", "TimeStep")
        self.dt = omega.dt

    @property
    def kinematics(self) -> str:
        """Name of the kinematics that YADE uses."""
        return "yade-ratcheting" if self.ratcheting else "yade"

    def refuse_motion(self) -> None:
        """Raise YadeError if our solver would move the bodies otherwise than NewtonIntegrator."""
        # Use the dictionary, because reading the attribute prints a warning.
        if self.newton.dict().get("densityScaling") or self.newton.mask != -1:
            raise refuse("the hand-over does not support densityScaling and mask of NewtonIntegrator; unset them", "Engines")
        if not self.newton.dampGravity and any(self.gravity):
            raise refuse("the hand-over does not support NewtonIntegrator.dampGravity=False; set it to True", "Engines")

    def parameters(self, one: Any, two: Any, mode: str) -> dict[str, Any]:
        """Parameters between two materials, computed as in `Ip2_CpmMat_CpmMat_CpmPhys`."""

        def mean(name: str) -> float:
            a, b = getattr(one, name), getattr(two, name)
            return float(a if a == b else 0.5 * (a + b))

        found = {
            "mode": mode,
            "young": mean("young"),
            "shear_ratio": mean("poisson"),
            "cohesion": mean("sigmaT"),
            "friction_angle": mean("frictionAngle"),
            "crack_onset_strain": mean("epsCrackOnset"),
            "relative_ductility": mean("relDuctility"),
            "damage_law": "linear" if one.damLaw == 0 else "exponential",
            "omega_threshold": float(self.omega_threshold),
            "never_damage": bool(one.neverDamage or two.neverDamage),
            "shear_contribution": mean("equivStrainShearContrib"),
            "soft_strain": float(self.eps_soft),
            "relative_soft_stiffness": float(self.rel_kn_soft),
            "isotropic_prestress": mean("isoPrestress"),
        }
        return defined(found)


def _of_concrete(everything: Bodies) -> NDArray[np.bool_]:
    """Which bodies have a CpmMat."""
    omega = host().omega
    _, first, number = np.unique(everything.material, return_index=True, return_inverse=True)
    found = [is_a(omega.bodies[int(everything.ids[k])].material, "CpmMat") for k in first]
    return np.array(found, bool)[number.reshape(-1)]


class Concrete:
    """The concrete of a scene: spheres of CpmMat and the contacts between them. `only`: ids of the spheres; the others are foreign. `late`: whether
    YADE may make bonds later."""

    def __init__(self, only: Any = None, late: bool = False) -> None:
        omega = host().omega
        self.settings = Settings(late)
        everything = bodies()
        ball = of_class(everything.shape, "Sphere.vtable")
        if only is not None:
            ball &= np.isin(everything.ids, only)
        concrete, stateful = ball & _of_concrete(everything), ball & of_class(everything.state, "CpmState.vtable")
        if (halves := everything.ids[concrete != stateful]).size:
            body = omega.bodies[int(halves[0])]
            refuse_sphere(body.id, class_of(body.material), class_of(body.state))
        ball = concrete
        self.bodies = everything.of(ball)
        self.others = everything.of(~ball)
        if not len(self.bodies.ids):
            raise refuse("the scene has no spheres of CpmMat; add them", "NotConcrete")
        self.materials, self.material = self._materials()
        self._row = np.full(int(everything.ids.max()) + 1, -1, np.int64)
        self._row[self.bodies.ids] = np.arange(len(self.bodies.ids))
        found = interactions()
        one, two = self._row[found.id1], self._row[found.id2]
        inner = (one >= 0) & (two >= 0)
        known = of_class(found.phys, "CpmPhys.vtable") & of_class(found.geom, "ScGeom.vtable")
        if (foreign := np.flatnonzero(inner & ~known)).size:
            contact = host().interactions[int(found.id1[foreign[0]]), int(found.id2[foreign[0]])]
            refuse_contact(contact.id1, contact.id2, class_of(contact.phys), class_of(contact.geom))
        self.foreign = int((~inner).sum())
        """Number of interactions with other bodies."""
        self._set_contacts(found.of(inner))
        self.clumps = Clumps(self.bodies.ids)
        #: Contacts with parameters of their own, once the assembly has been made.
        self.own: Own | None = None
        #: Whether a script may have changed parameters since the last step of the law.
        self._changed = False

    def _set_contacts(self, contacts: Interactions) -> None:
        self.contacts = contacts
        self.pair = np.stack([self._row[contacts.id1], self._row[contacts.id2]], axis=1).astype(np.uint32)

    def anew(self, contacts: Interactions, kind: dict[str, Any], solver: _core.Hosted, threads: int | None) -> _core.Hosted:
        """The assembly `solver` of a bonded engine of this `kind` with these contacts instead of its own, and without the spheres that are
        not here."""
        ids = solver.bodies()["id"]
        self._set_contacts(contacts)
        self._changed = True
        lost = np.zeros(int(ids.max()) + 1, np.uint32)
        lost[ids] = solver.particle_results()[1]
        return self.hosted(kind["kinematics"], kind["mode"], False, threads, lost[self.bodies.ids])

    def _materials(self) -> tuple[list[Any], NDArray[np.uint32]]:
        omega = host().omega
        distinct, first, number = np.unique(self.bodies.material, return_index=True, return_inverse=True)
        materials = [omega.bodies[int(self.bodies.ids[k])].material for k in first]
        for k, material in zip(first, materials):
            check_damage_law(int(self.bodies.ids[k]), material.damLaw)
        assert len(distinct) == len(materials)
        return materials, number.astype(np.uint32).reshape(-1)

    def laws(self, mode: str) -> list[tuple[int, int, dict[str, Any]]]:
        """Parameter rows for all pairs of materials."""
        count = len(self.materials)
        return [
            (i, j, self.settings.parameters(self.materials[i], self.materials[j], mode))
            for i in range(count)
            for j in range(i, count)
        ]

    def hosted(self, kinematics: str, mode: str, damping: bool, threads: int | None, lost: Any = None) -> _core.Hosted:
        """The assembly in our solver. `damping`: our solver moves the bodies, with YADE's damping and gravity. `lost`: numbers of bonds and
        contacts that the bodies have lost; None: those in YADE."""
        omega = host().omega
        if damping:
            self.settings.refuse_motion()
        state = self.bodies.state
        inertia = gather(state, "State.inertia", components=3)
        if not (inertia[:, 0] == inertia[:, 1]).all() or not (inertia[:, 0] == inertia[:, 2]).all():
            raise refuse("a sphere has different moments of inertia about its axes; give it equal ones")
        arrays: dict[str, Any] = {
            "id": self.bodies.ids.astype(np.uint32),
            "position": self.bodies.positions,
            "velocity": gather(state, "State.vel", components=3),
            "orientation": gather(state, "State.ori", components=4),
            "angular_velocity": gather(state, "State.angVel", components=3),
            "radius": gather(self.bodies.shape, "Sphere.radius"),
            "mass": gather(state, "State.mass"),
            "inertia": np.ascontiguousarray(inertia[:, 0]),
            "material": self.material,
            "constraint": gather(state, "State.blockedDOFs", "i32").astype(np.uint32),
            "lost": gather(state, "CpmState.numBrokenCohesive", "i32").clip(0).astype(np.uint32) if lost is None else lost,
        }
        cell = None
        if omega.periodic:
            cell = cell_of(omega)
            if damping:
                # YADE deforms the cell at the beginning of a step, our solver at the end.
                edges, gradient, rate = cell
                cell = (edges + self.settings.dt * rate @ edges, gradient + self.settings.dt * rate @ gradient, rate)
        settings = self.settings
        contacts = self._contact_arrays(mode)
        assert self.own is not None
        try:
            return _core.Hosted.concrete(
                arrays,
                contacts,
                self.laws(mode),
                len(self.materials),
                settings.dt,
                kinematics,
                damping=settings.damping if damping else 0.0,
                gravity=settings.gravity if damping else None,
                cell=cell,
                threads=threads or omega.numThreads,
                clumps=self.clumps.arrays(settings.newton, settings.dt),
                own=self.own.laws,
            )
        except ValueError as error:
            raise refuse(str(error)) from error

    def _contact_arrays(self, mode: str) -> dict[str, Any]:
        contacts = self.contacts

        def physics(name: str, components: int = 1) -> Any:
            return gather(contacts.phys, f"CpmPhys.{name}", components=components)

        def geometry(name: str, components: int = 1) -> Any:
            return gather(contacts.geom, f"ScGeom.{name}", components=components)

        length = physics("refLength")
        radii = geometry("refR1") + geometry("refR2")
        bonded = gather(contacts.phys, "CpmPhys.isCohesive", "u8") != 0
        stored = np.stack([gather(contacts.phys, f"CpmPhys.{name}", kind).astype(float) for name, kind in STORED.items()], axis=1)
        ids = np.stack([contacts.id1, contacts.id2], axis=1)
        self.own = own_of(stored, self.laws(mode), self.material[self.pair], bonded, ids)
        prestress = physics("isoPrestress")
        prestress = np.where(prestress != 0, prestress / physics("E"), 0.0)
        kappa = physics("kappaD")
        anew = (self.own.row > 0) | (bonded & self._changed)
        omega = np.where(anew, damage(self.own.stored, kappa), physics("omega"))
        history = np.concatenate(
            [
                (physics("epsN") - prestress)[:, None],
                kappa[:, None],
                omega[:, None],
                physics("epsNPl")[:, None],
                np.zeros((len(length), 1)),
                physics("epsT", 3),
                physics("epsTPl", 3),
            ],
            axis=1,
        )
        if (far := np.flatnonzero(np.abs(contacts.image).max(axis=1, initial=0) > 127)).size:
            refuse_image(int(contacts.id1[far[0]]), int(contacts.id2[far[0]]))
        return {
            "pair": self.pair,
            "image": contacts.image,
            "bonded": bonded,
            "length": length,
            "area": physics("crossSection"),
            "normal": geometry("normal", 3),
            "distance": radii - geometry("penetrationDepth"),
            "history": history,
            "radii": radii,
            "reference_overlap": physics("refPD"),
            "stored": self.own.stored,
            "own": self.own.row,
        }


def cell_of(omega: Any) -> tuple[Reals, Reals, Reals]:
    """Edges (m, as columns), deformation gradient, and velocity gradient (1/s) of the periodic cell."""

    def matrix(value: Any) -> Reals:
        return np.array([[value[i, j] for j in range(3)] for i in range(3)])

    return matrix(omega.cell.hSize), matrix(omega.cell.trsf), matrix(omega.cell.velGrad)


def scatter(addresses: NDArray[np.uint64], field: str, values: Any) -> None:
    """Write a field of all objects."""
    flat = np.ascontiguousarray(values, dtype=float).reshape(-1)
    _core.memory_scatter(np.ascontiguousarray(addresses), host().layout[field], flat)


def scatter_fields(addresses: NDArray[np.uint64], kind: str, fields: dict[str, Any], read: Sequence[tuple[int, int]] = ()) -> NDArray[np.uint8]:
    """Write several fields of objects of this class, each object once, and read those at `read` (offset, bytes) then."""
    # A column without rows may be misaligned.
    rows = [(host().layout[f"{kind}.{name}"], np.require(values, float, ["C", "A"]).reshape(-1)) for name, values in fields.items()]
    return _core.memory_exchange(np.ascontiguousarray(addresses), rows, read)


def scatter_geometry(geom: NDArray[np.uint64], first: Reals, normal: Reals, length: Reals, radius: Reals, other: Reals) -> None:
    """Write normal, overlap, and contact point, m. `first`: positions of the first bodies; `radius`, `other`: reference radii of both."""
    overlap = radius + other - length
    point = first + normal * (radius - 0.5 * overlap)[:, None]
    scatter_fields(geom, "ScGeom", {"normal": normal, "penetrationDepth": overlap, "contactPoint": point})


def gather_fields(addresses: NDArray[np.uint64], kind: str, names: Sequence[str]) -> Iterator[Reals]:
    """Read several numbers of objects of this class, each object once."""
    rows = _core.memory_rows(np.ascontiguousarray(addresses), [(host().layout[f"{kind}.{name}"], 8) for name in names])
    return iter(np.ascontiguousarray(rows.view(np.float64).T))


def keys_of(one: Any, two: Any, bonded: Any) -> NDArray[np.int64]:
    """A number for each contact from its unordered pair and whether it is a bond (particles of a broken bond may touch again)."""
    one, two = np.asarray(one, np.int64), np.asarray(two, np.int64)
    return np.minimum(one, two) << 32 | np.maximum(one, two) << 1 | np.asarray(bonded, np.int64)


def _keys_of_yade(concrete: Concrete) -> NDArray[np.int64]:
    contacts = concrete.contacts
    return keys_of(contacts.id1, contacts.id2, gather(contacts.phys, "CpmPhys.isCohesive", "u8") != 0)


def write_bodies(concrete: Concrete, solver: _core.Hosted) -> None:
    """Write positions and motion back to YADE."""
    now = solver.bodies()
    place = np.full(int(concrete.bodies.ids.max()) + 1, -1, np.int64)
    place[concrete.bodies.ids] = np.arange(len(concrete.bodies.ids))
    state = concrete.bodies.state[place[now["id"]]]
    scatter(state, "State.pos", now["position"])
    scatter(state, "State.vel", now["velocity"])
    scatter(state, "State.angVel", now["angular_velocity"])
    scatter(state, "State.ori", now["orientation"])
    concrete.clumps.write(solver)


def sort_anew() -> None:
    """Make the collider check all pairs in the next step, because erased interactions included potential contacts. The collider has no
    command for this, so replace it by a new one with the same settings."""
    yade = host()
    old = engine_of("InsertionSortCollider")
    own = {"newton", "boundDispatcher", "numAction", "numReinit", "fastestBodyMaxDist", "doSort"}
    settings = {name: value for name, value in old.dict().items() if name not in own}
    new = yade.wrapper.InsertionSortCollider(old.boundDispatcher.functors, **settings)
    engines = list(yade.omega.engines)
    place = next(k for k, engine in enumerate(engines) if class_of(engine) == "InsertionSortCollider" and not engine.dead)
    yade.omega.engines = engines[:place] + [new] + engines[place + 1 :]


def create_interactions(one: Any, two: Any) -> list[Any]:
    """Create an interaction between each pair of bodies, by the functors of the scene."""
    from yade.utils import createInteraction

    omega = host().omega
    made = []
    for first, second in zip(np.minimum(one, two).tolist(), np.maximum(one, two).tolist()):
        if host().interactions.has(first, second):
            host().interactions.erase(first, second)
        # YADE's own: the pair belongs to a bonded engine.
        contact = getattr(createInteraction, "__wrapped__", createInteraction)(first, second)
        # Not this iteration: the law would treat the contact as new and discard its history.
        contact.iterMadeReal = max(omega.iter - 1, 0)
        made.append(contact)
    return made


def write_images(addresses: NDArray[np.uint64], images: Any) -> None:
    """Write the periodic images of the second bodies of interactions."""
    for k in range(3):
        column = np.ascontiguousarray(np.asarray(images)[:, k], np.int32)
        _core.memory_scatter_i32(np.ascontiguousarray(addresses), host().layout["Interaction.cellDist"] + 4 * k, column)


def _create_contacts(table: Any, kind: dict[str, Any]) -> None:
    """Create interactions of the concrete law with the constants of these contacts; their histories are written later. `kind`: of the bonded
    engine, with the parameters that bonds have of their own."""
    made = create_interactions(table["a"], table["b"])
    for contact, bonded in zip(made, table["bonded"].tolist()):
        contact.phys.isCohesive = bonded
    geom, phys = (np.array([address_of(getattr(contact, name)) for contact in made], np.uint64) for name in ("geom", "phys"))
    ductility = np.array([contact.phys.relDuctility for contact in made])
    scatter(phys, "CpmPhys.epsFracture", gather(phys, "CpmPhys.epsCrackOnset") * ductility)
    write_own(phys, table["bonded"], table["a"], table["b"], kind)
    write_constants(geom, phys, table["reference_length"], table["area"])
    turned = np.where(table["a"] == [contact.id1 for contact in made], 1, -1)
    write_images(np.array([address_of(contact) for contact in made], np.uint64), table["image"] * turned[:, None])


def write_own(phys: Addresses, bonded: Any, one: Any, two: Any, kind: dict[str, Any]) -> None:
    """Write the parameters that bonds of a bonded engine of this `kind` have of their own."""
    rows, values = rows_of_pairs(kind, one, two)
    keep = np.asarray(bonded, bool)[rows]
    mine = np.ascontiguousarray(phys[rows[keep]])
    for (name, type_of), column in zip(STORED.items(), values[keep].T):
        if type_of == "f64":
            scatter(mine, f"CpmPhys.{name}", column)
            continue
        place = host().layout[f"CpmPhys.{name}"]
        if type_of == "i32":
            _core.memory_scatter_i32(mine, place, column.astype(np.int32))
        else:
            for address, value in zip(mine.tolist(), column.tolist()):
                ctypes.c_uint8.from_address(address + place).value = int(value)


def write_constants(geom: Addresses, phys: Addresses, length: Reals, area: Reals) -> None:
    """Write what the law computes once, when a contact is new."""
    radii = gather(geom, "ScGeom.refR1") + gather(geom, "ScGeom.refR2")
    for name, values in (
        ("refLength", length),
        ("crossSection", area),
        ("refPD", radii - length),
        ("kn", area * gather(phys, "CpmPhys.E") / length),
        ("ks", area * gather(phys, "CpmPhys.G") / length),
    ):
        scatter(phys, f"CpmPhys.{name}", values)


def write_contacts(solver: _core.Hosted, kind: dict[str, Any]) -> dict[str, int]:
    """Write contacts back to YADE: update histories, erase opened contacts, create new ones. `kind`: of the bonded engine."""
    yade = host()
    omega = yade.omega
    # Other spheres of concrete, created since the take-over, have contacts of YADE.
    mine = solver.bodies()["id"]
    concrete = Concrete(mine, late=True)
    tables = solver.contacts()
    table = np.concatenate([tables[name] for name in ("cpm", "unbonded") if name in tables])
    theirs, ours = _keys_of_yade(concrete), keys_of(table["a"], table["b"], table["bonded"])
    if len(np.unique(ours >> 1)) != len(ours):
        raise refuse("two bodies touch through two periodic images, which YADE cannot store; enlarge the cell", "TwoImages")
    gone = ~np.isin(theirs, ours)
    for one, two in zip(concrete.contacts.id1[gone], concrete.contacts.id2[gone]):
        yade.interactions.erase(int(one), int(two))
        for body in (int(one), int(two)):
            omega.bodies[body].state.numBrokenCohesive += 1
    new = ~np.isin(ours, theirs)
    if new.any():
        _create_contacts(table[new], kind)
    if gone.any() or new.any():
        concrete = Concrete(mine, late=True)
        theirs = _keys_of_yade(concrete)
    order = np.argsort(ours, kind="stable")
    place = np.minimum(np.searchsorted(ours[order], theirs), len(ours) - 1)
    table = table[order[place]]
    if len(ours) != len(theirs) or not (keys_of(table["a"], table["b"], table["bonded"]) == theirs).all():
        raise refuse("contacts of the solver and of YADE do not match", "Layout")
    sign = np.where(table["a"] == concrete.contacts.id1, 1.0, -1.0)
    now = solver.bodies()
    row = np.zeros(int(now["id"].max()) + 1, np.int64)
    row[now["id"]] = np.arange(len(now["id"]))
    geom, phys = concrete.contacts.geom, concrete.contacts.phys
    write_values(geom, phys, now["position"][row[concrete.contacts.id1]], table, sign, constants_of(geom, phys))
    return {"erased": int(gone.sum()), "made": int(new.sum()), "written": len(table)}


#: Columns of a contact from which its normal force follows.
NORMAL_HISTORY = ("normal_strain", "plastic_normal_strain", "omega")


def _normal(modulus: Reals, prestress: Reals, table: Any) -> tuple[Reals, Reals]:
    """Total normal strain, and the normal stress before the prestress is taken off, Pa."""
    strain = table["normal_strain"] + prestress / modulus
    effective = strain - table["plastic_normal_strain"]
    return strain, (1.0 - np.where(effective > 0, table["omega"], 0.0)) * modulus * effective


def write_normal_force(geom: Addresses, phys: Addresses, table: Any, sign: Reals) -> None:
    """Write of :func:`write_values` what a time step depends on: normal and normal force."""
    normal = table["normal"] * sign[:, None]
    modulus, prestress, area = gather_fields(phys, "CpmPhys", ("E", "isoPrestress", "crossSection"))
    stress = _normal(modulus, prestress, table)[1] - prestress
    scatter(phys, "CpmPhys.normalForce", -(stress * area)[:, None] * normal)
    scatter(geom, "ScGeom.normal", normal)


def constants_of(geom: Addresses, phys: Addresses) -> list[Reals]:
    """What :func:`write_values` needs of contacts and the law does not change."""
    names = ("E", "G", "crossSection", "isoPrestress", "undamagedCohesion", "tanFrictionAngle", "epsCrackOnset")
    return [*gather_fields(phys, "CpmPhys", names), *gather_fields(geom, "ScGeom", ("refR1", "refR2"))]


def write_values(
    geom: Addresses, phys: Addresses, first: Reals, table: Any, sign: Reals, constants: list[Reals], read: Sequence[tuple[int, int]] = ()
) -> NDArray[np.uint8]:
    """Write what the law computes in every step, and read the physics as :func:`scatter_fields`. `first`: positions of the first bodies in that step;
    `sign`: -1 where the table has the bodies in the other order; `constants`: of :func:`constants_of`."""
    turned = sign[:, None]
    normal = table["normal"] * turned
    shear, slip = table["shear_strain"] * turned, table["plastic_shear_strain"] * turned
    modulus, shear_modulus, area, prestress, cohesion, friction, onset, radius, other = constants
    bonded = table["bonded"]
    omega, kappa = table["omega"], table["kappa"]
    strain, stress = _normal(modulus, prestress, table)
    # While a contact slips, YADE stores a plastic strain with which the elastic traction exceeds the bound; the bound acts.
    # As YADE: a cohesion that is not a number bounds the stress by 0.
    bound = np.fmax(0.0, cohesion * (1.0 - omega) - stress * friction)
    traction = shear_modulus[:, None] * (shear - slip)
    size = np.linalg.norm(traction, axis=1)
    if (beyond := np.flatnonzero(size > bound)).size:
        traction[beyond] *= (bound[beyond] / size[beyond])[:, None]
    stress = stress - prestress
    residual = np.where(bonded, np.where(kappa < onset, 1.0, (1.0 - omega) * kappa / onset), 0.0)
    force, shear_force = stress * area, traction * area[:, None]
    scatter_geometry(geom, first, normal, table["length"], radius, other)
    return scatter_fields(
        phys,
        "CpmPhys",
        {
            "kappaD": kappa,
            "omega": omega,
            "epsN": strain,
            "epsNPl": table["plastic_normal_strain"],
            "epsT": shear,
            "epsTPl": slip,
            "sigmaN": stress,
            "sigmaT": traction,
            "Fn": force,
            "Fs": shear_force,
            "normalForce": -force[:, None] * normal,
            "shearForce": -shear_force,
            "relResidualStrength": residual,
        },
        read,
    )


def write_states(solver: _core.Hosted) -> None:
    """Write damage and stress of the particles to YADE's CpmState, as CpmStateUpdater does."""
    everything = bodies()
    row = np.full(int(everything.ids.max()) + 1, -1, np.int64)
    row[everything.ids] = np.arange(len(everything.ids))
    state = everything.state[row[solver.bodies()["id"]]]
    if not of_class(state, "CpmState.vtable").all():
        raise refuse("update_states needs CpmState, which some bodies do not have; do not use it", "NotConcrete")
    damage, _, stress = solver.particle_results()
    scatter(state, "CpmState.normDmg", damage)
    scatter(state, "CpmState.stress", stress)


def add_to_lost(state: Addresses, count: Ints) -> None:
    """Add numbers of bonds and contacts that bodies have lost to YADE's CpmState, as YADE's law does."""
    place = host().layout["CpmState.numBrokenCohesive"]
    _core.memory_scatter_i32(state, place, _core.memory_gather(state, place, "i32", 1) + count)


def add_to_clock(steps: int, dt: float) -> None:
    """Advance YADE's clock by `steps` steps of `dt` (s)."""
    yade = host()
    scene = address_of(yade.omega._sceneObj)
    iteration = ctypes.c_long.from_address(scene + yade.layout["Scene.iter"])
    time = ctypes.c_double.from_address(scene + yade.layout["Scene.time"])
    if iteration.value != yade.omega.iter or time.value != yade.omega.time:
        raise refuse("YADE's clock was not found at its offset in memory; restart YADE", "Layout")
    iteration.value += steps
    # Add step by step, for the same rounding as in YADE.
    for _ in range(steps):
        time.value += dt
