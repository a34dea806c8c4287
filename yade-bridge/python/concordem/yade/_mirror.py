"""The bonds of an engine as objects of YADE, outside of YADE's own container of interactions.

A script that asks for interactions gets these objects (:mod:`._container`). They are made when the first one is asked for. Later calls
write the present values into all of them at once, at most once per step, so a run whose script does not ask pays nothing. What a script
changes in them is found by comparison and followed before the next step, or refused.
"""

from __future__ import annotations

import functools
import math
import sys
import threading
import weakref
from typing import Any, Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from .. import _core
from . import _changes, _histories, _reading
from ._concrete import NORMAL_HISTORY, constants_of, keys_of, scatter, write_constants, write_images, write_normal_force, write_own, write_values
from ._interactions import Bonds, table_of
from ._memory import known_address_of, memory
from ._own import STORED
from ._rules import refuse
from ._scene import Addresses, Interactions, Ints, gather, host


def _physics_of(one: Any, two: Any) -> dict[str, Any]:
    """Attributes that `Ip2_CpmMat_CpmMat_CpmPhys` gives to a contact between two materials."""

    def mean(name: str) -> float:
        a, b = getattr(one, name), getattr(two, name)
        return float(a if a == b else 0.5 * (a + b))

    same = ("epsCrackOnset", "relDuctility", "equivStrainShearContrib", "dmgTau", "dmgRateExp", "plTau", "plRateExp", "isoPrestress")
    return {
        **{name: mean(name) for name in same},
        "E": mean("young"),
        "G": mean("young") * mean("poisson"),
        "tanFrictionAngle": math.tan(mean("frictionAngle")),
        "undamagedCohesion": mean("sigmaT"),
        "epsFracture": mean("epsCrackOnset") * mean("relDuctility"),
        "neverDamage": bool(one.neverDamage or two.neverDamage),
        "damLaw": one.damLaw,
    }


def _locked(method: Callable[..., Any]) -> Any:
    """A method of :class:`Mirror` that one thread runs at a time."""

    @functools.wraps(method)
    def alone(self: Mirror, *arguments: Any) -> Any:
        with self._lock:
            return method(self, *arguments)

    return alone


class Mirror:
    """Objects of YADE for all bonds and contacts of a bonded engine.

    `bonds`: gives the engine, or, for the native one, a copy of its bonds. `moment`: gives a value that differs after each step. `parameters`:
    the engine follows changes of the parameters of bonds, and asks in each step, so that objects that a script has kept stay current.
    """

    def __init__(self, bonds: Callable[[], Bonds], moment: Callable[[], Any], parameters: bool = False) -> None:
        self._bonds, self._moment, self._parameters = bonds, moment, parameters
        self._at: Any = None
        #: The last step whose normals and normal forces are written, and the rows of the solver then, with their order in the objects.
        self._stiff_at: Any = None
        self._rows: dict[str, Any] = {}
        self._order = np.zeros(0, np.int64)
        self._keys = np.zeros(0, np.int64)
        #: Reference lengths, bit by bit. A contact that opened and closed between two looks has another one, and nothing of the earlier contact.
        self._reference = np.zeros(0, np.int64)
        self._contacts: list[Any] = []
        #: Objects of contacts that have ended, which scripts have kept, by the pair.
        self._ended: weakref.WeakValueDictionary[int, Any] = weakref.WeakValueDictionary()
        #: Objects that a script has kept from YADE, by the pair; those of Python are others.
        self._adopted: dict[int, Any] = {}
        none: Addresses = np.zeros(0, np.uint64)
        self._address, self._geom, self._phys = none, none, none
        self._one = self._two = np.zeros(0, np.int32)
        self._index: dict[tuple[int, int], int] | None = None
        self._of_body: tuple[NDArray[Any], NDArray[Any]] | None = None
        #: Of the engine: concrete, one of the laws with histories, or scenario.
        self._kind = "concrete"
        #: Whether a script may have changed the objects since the last comparison.
        self.out = False
        self._before: list[_changes.Rows] = []
        self._erased = 0
        #: The contacts of the solver at the last look, in its order.
        self._unsorted = self._keys
        #: Whether an object has another periodic image than that of its second body.
        self._imaged = False
        #: Of the objects; None after something may have changed them.
        self._constant: list[Any] | None = None
        #: What scripts do not change of the interactions themselves.
        self._fixed: _changes.Rows | None = None
        #: What told the contacts of the solver when the objects were filled; None: unknown.
        self._filled: NDArray[np.uint64] | None = None
        #: The step whose values the first reading writes (:mod:`._reading`).
        self._waits_at: Any = None
        #: The objects as they are written, for :meth:`_hand_out`; None if they must be read.
        self._written: list[_changes.Rows] | None = None
        #: Held while the objects are written or compared, because a script and a PyRunner may read at once. A step takes no lock of a mirror.
        self._lock = threading.RLock()

    @property
    def classes(self) -> tuple[str, str]:
        """Names of YADE's classes of geometry and physics."""
        if self._kind in _histories.LAWS:
            return _histories.LAWS[self._kind].classes()
        return {"concrete": ("ScGeom", "CpmPhys"), "scenario": ("ScGeom", "NormShearPhys")}[self._kind]

    # -- reading ------------------------------------------------------------------------------------------------------

    @_locked
    def refresh(self) -> None:
        """Write the present values into the objects, if they are not those of the last step."""
        moment = self._moment()
        if moment == self._at:
            return
        self._refuse_late_changes()
        bonds = self._bonds()
        # While YADE runs in another thread, a step may end between two calls.
        for _ in range(1000):
            filled = bonds.solver.contact_rows() if self._parameters else None
            table, bodies = _table(bonds), bonds.solver.bodies()
            again = self._moment()
            if again == moment:
                break
            moment = again
        with _reading.filling():
            self._write(bonds, table, bodies)
        self._at, self._before, self._filled = moment, [], filled

    @_locked
    def refresh_stiffness(self) -> None:
        """As :meth:`refresh`, of what GlobalStiffnessTimeStepper reads alone: normals and normal forces of the same contacts as before."""
        moment = self._moment()
        if moment == self._at or moment == self._stiff_at:
            return
        table = _table(self._bonds())
        if self._before or self._kind != "concrete" or not _same_rows(table, self._rows):
            self.refresh()
            return
        columns = {name: table[name][self._order] for name in ("a", "normal", *NORMAL_HISTORY)}
        write_normal_force(self._geom, self._phys, columns, np.where(columns["a"] == self._one, 1.0, -1.0))
        self._stiff_at = moment

    def _write(self, bonds: Bonds, table: Any, bodies: dict[str, Any]) -> None:
        self._kind = bonds._kind["kind"]
        self._rows = {name: table[name] for name in _ROW}
        unsorted = keys_of(table["a"], table["b"], table["bonded"])
        order = self._order
        if not np.array_equal(unsorted, self._unsorted):
            order = np.argsort(unsorted, kind="stable")
        keys = unsorted[order]
        if (keys[1:] >> 1 == keys[:-1] >> 1).any():
            raise refuse("two bodies touch through two periodic images, which YADE cannot store; enlarge the cell", "TwoImages")
        if isinstance(table, np.ndarray):
            table = table.take(order)
        else:
            table = {name: values[order] for name, values in table.items()}
        row = np.zeros(int(bodies["id"].max(initial=0)) + 1, np.int64)
        row[bodies["id"]] = np.arange(len(bodies["id"]))
        if not (np.array_equal(keys, self._keys) and np.array_equal(_bits(table["reference_length"]), self._reference)):
            self._match(keys, table, bodies["radius"][row], bonds._kind)
        sign = np.where(table["a"] == self._one, 1.0, -1.0)
        first = bodies["position"][row[self._one]]
        places = _changes.places_in_physics(self._kind)
        if self._kind == "concrete":
            if self._constant is None:
                self._constant = constants_of(self._geom, self._phys)
            physics = write_values(self._geom, self._phys, first, table, sign, self._constant, places)
        elif self._kind in _histories.LAWS:
            physics = _histories.LAWS[self._kind].write_values(self._geom, self._phys, first, table, sign, places)
        else:
            _write_forces(self._geom, self._phys, first, table, sign)
        if self._imaged or table["image"].any():
            write_images(self._address, table["image"] * sign.astype(np.int32)[:, None])
            self._imaged, self._fixed = True, None
        if self._kind != "scenario":
            if self._fixed is None:
                self._fixed = _changes.of_contacts(self._address)
            self._written = [self._fixed, _changes.of_physics(physics, self._kind), *_changes.of_geometry(self._geom, self._kind)]
        self._order, self._unsorted = order, unsorted

    def _match(self, keys: NDArray[np.int64], table: Any, radius: Any, kind: dict[str, Any]) -> None:
        """Keep the objects of contacts that still exist, and make those of new ones."""
        place = np.minimum(np.searchsorted(self._keys, keys), max(len(self._keys) - 1, 0))
        known = np.zeros(len(keys), bool)
        if len(self._keys):
            known = (self._keys[place] == keys) & (self._reference[place] == _bits(table["reference_length"]))
        one, two = (keys >> 32).astype(np.int32), (keys >> 1 & 0x7FFFFFFF).astype(np.int32)
        old = self._contacts
        contacts: list[Any] = [old[k] if kept else None for k, kept in zip(place.tolist(), known.tolist())]
        address, geom, phys = (np.where(known, column[place] if len(column) else 0, 0).astype(np.uint64) for column in (self._address, self._geom, self._phys))
        new = np.flatnonzero(~known)
        physics = self._constants(one[new], two[new])
        wrapper = host().wrapper
        shapes, parts = (getattr(wrapper, name) for name in self.classes)
        # A script may have kept the object of a contact that is another one now, between the same bodies, or none.
        gone = np.setdiff1d(np.arange(len(old)), place[known])
        earlier = {int(self._keys[k] >> 1): (old[k], int(self._reference[k])) for k in gone.tolist()}
        references = _bits(table["reference_length"])
        for k, given in zip(new.tolist(), physics):
            pair = int(keys[k] >> 1)
            contact, reference = earlier.pop(pair, (self._ended.pop(pair, None) or self._adopted.get(pair), 0))
            if contact is not None and reference == int(references[k]):
                # A bond that has broken, and is a contact without cohesion.
                shape, made = contact.geom, contact.phys
            else:
                contact = contact or wrapper.Interaction()
                shape, made = shapes(), parts(kn=math.nan, ks=math.nan) if self._kind == "scenario" else parts()
                _reading.put(contact, shape, made)
            if given is not None:
                for name, value in {**given, "isCohesive": bool(keys[k] & 1)}.items():
                    setattr(made, name, value)
            contacts[k] = contact
            address[k], geom[k], phys[k] = known_address_of(contact), known_address_of(shape), known_address_of(made)
        for pair, (contact, _) in earlier.items():
            _reading.put(contact, None, None)
            self._ended[pair] = contact
        layout = host().layout
        for name, ids in (("Interaction.id1", one), ("Interaction.id2", two)):
            _core.memory_scatter_i32(address[new], layout[name], ids[new])
        scatter(geom[new], "ScGeom.refR1", radius[one[new]])
        scatter(geom[new], "ScGeom.refR2", radius[two[new]])
        # It belongs to YADE's steps.
        scatter(geom[new], "ScGeom.shearInc", np.full((len(new), 3), math.nan))
        if self._kind == "concrete":
            write_own(phys[new], keys[new] & 1, one[new], two[new], kind)
            write_constants(geom[new], phys[new], table["reference_length"][new], table["area"][new])
        self._keys, self._contacts, self._one, self._two = keys, contacts, one, two
        self._reference = _bits(table["reference_length"])
        self._address, self._geom, self._phys = address, geom, phys
        self._index = self._of_body = None
        self._constant = self._fixed = self._written = None

    def _constants(self, one: Ints, two: Ints) -> Iterable[dict[str, Any] | None]:
        """Attributes of the physics of new contacts; None for laws that YADE does not have."""
        if self._kind != "concrete":
            return [None] * len(one)
        yade = host()
        scene = known_address_of(yade.omega._sceneObj)
        every = _core.memory_targets(memory.pointer(scene + yade.layout["Scene.bodies"]) + yade.layout["bodies.vector"])
        pairs = np.stack([gather(np.ascontiguousarray(every[ids]), "Body.material", "u64") for ids in (one, two)], axis=1)
        _, first, number = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
        rows = [_physics_of(*(yade.omega.bodies[int(ids[k])].material for ids in (one, two))) for k in first]
        return [rows[k] for k in number.reshape(-1)]

    # -- for scripts --------------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        # What a script has erased is gone at once. Before the next look, the engine has the number.
        if self._moment() == self._at:
            return len(self._contacts)
        self._refuse_late_changes()
        return int(self._bonds().solver.contact_count)

    def contacts(self) -> list[Any]:
        """All objects, by the ids of their bodies."""
        self._hand_out()
        return self._contacts

    def nth(self, place: int) -> Any:
        """One object."""
        self._hand_out()
        return self._contacts[place]

    def find(self, one: int, two: int) -> Any:
        """The object between two bodies; None if there is none."""
        self._hand_out()
        if self._index is None:
            self._index = {pair: k for k, pair in enumerate(zip(self._one.tolist(), self._two.tolist()))}
        place = self._index.get((one, two) if one < two else (two, one))
        return None if place is None else self._contacts[place]

    def of_body(self, number: int) -> list[Any]:
        """The objects of one body."""
        self._hand_out()
        if self._of_body is None:
            ends = np.concatenate([self._one, self._two])
            order = np.argsort(ends, kind="stable")
            starts = np.searchsorted(ends[order], np.arange(int(ends.max(initial=-1)) + 2))
            self._of_body = order % max(len(self._one), 1), starts
        order, starts = self._of_body
        if not 0 <= number < len(starts) - 1:
            return []
        return [self._contacts[k] for k in order[starts[number] : starts[number + 1]].tolist()]

    def pointers(self, stiffness: bool = False) -> NDArray[np.uint64]:
        """Addresses of the interactions, with their present values; `stiffness`: those that a time step needs."""
        if stiffness:
            self.refresh_stiffness()
        else:
            self.refresh()
        return self._address

    def interactions(self) -> Interactions:
        """The objects as rows."""
        image = gather(self._address, "Interaction.cellDist", "i32", 3)
        return Interactions(self._address, self._one, self._two, image, self._geom, self._phys)

    @_locked
    def _hand_out(self) -> None:
        """Before a script gets objects: fill them, or let the first reading do so, if they are those of the contacts of the last step."""
        moment = self._moment()
        if moment == self._waits_at:
            return
        if moment != self._at and self._filled is not None and not self._imaged:
            if np.array_equal(self._bonds().solver.contact_rows(), self._filled):
                self._waits_at = moment
                _reading.wait(self)
                return
        self.fill()

    @_locked
    def match(self) -> None:
        """Let those objects be real whose contacts exist after the last step."""
        if self._moment() != self._at and (self._filled is None or not np.array_equal(self._bonds().solver.contact_rows(), self._filled)):
            self.fill()

    @_locked
    def fill(self) -> None:
        """Write the values of the last step into the objects, for a script that may change them."""
        self._waits_at = None
        self.refresh()
        self.out = True
        if not self._before:
            self._before = self._written or self._read()
        self._written = None

    # -- objects that a script has kept from YADE, or keeps when YADE gets the bonds back --------------------------------------------

    def adopt(self, contacts: list[Any]) -> None:
        """Have these interactions of YADE, whose contacts the engine has taken over."""
        bonds = self._bonds()
        self._kind = bonds._kind["kind"]
        table = _table(bonds)
        row = {tuple(sorted(pair)): k for k, pair in enumerate(zip(table["a"].tolist(), table["b"].tolist()))}
        rows = np.array([row[tuple(sorted((contact.id1, contact.id2)))] for contact in contacts])
        keys = keys_of(*(table[name][rows] for name in ("a", "b", "bonded")))
        order = np.argsort(keys)
        self._contacts = [contacts[k] for k in order.tolist()]
        self._keys, self._reference = keys[order], _bits(table["reference_length"][rows[order]])
        self._adopted = dict(zip((self._keys >> 1).tolist(), self._contacts))
        self._one, self._two = ((self._keys >> shift & 0x7FFFFFFF).astype(np.int32) for shift in (32, 1))
        parts = [(contact, contact.geom, contact.phys) for contact in self._contacts]
        self._address, self._geom, self._phys = (np.array([known_address_of(part[k]) for part in parts], np.uint64) for k in range(3))
        _reading.wait(self)

    @_locked
    def hand_over(self) -> None:
        """Let the objects that a script has kept share the parts of the interactions that YADE has made of the same contacts."""
        own = host().interactions
        with _reading.filling():
            for contact in self._contacts:
                # The list, the name, and the argument.
                if sys.getrefcount(contact) > 3 and own.has(contact.id1, contact.id2):
                    made = own[contact.id1, contact.id2]
                    _reading.put(contact, made.geom, made.phys)

    # -- changes by scripts -------------------------------------------------------------------------------------------

    def _read(self) -> list[_changes.Rows]:
        return _changes.everything(self._address, self._geom, self._phys, self._kind)

    def _changes(self) -> dict[str, int]:
        """The attributes that a script has changed, with a row of each."""
        return _changes.between(self._before, self._read()) if self._before else {}

    @_locked
    def changed(self) -> bool:
        """Whether a script has changed or erased bonds, so that the engine must be built anew from these objects; it calls :meth:`followed`
        then. Raises YadeError for changes that no engine can follow, until they are set back."""
        if not self.out:
            return False
        changed = self._changes()
        for name, row in changed.items():
            if name in (*_FIXED, *(() if self._parameters else STORED)) or self._kind == "scenario":
                if self._kind == "scenario":
                    remedy = "its law computes it from the bond: leave it"
                elif name in STORED:
                    remedy = "ConcorDEM takes it from the materials: set it back, or give the bodies another material before take_over()"
                else:
                    remedy = "set it back; to change it, call give_back() before, and take_over() after it"
                raise refuse(f"{name} of the contact of bodies {self._one[row]} and {self._two[row]} was changed, but a bonded engine cannot follow; {remedy}", "Changed")
        if changed and self._moment() != self._at:
            self._refuse_late(changed)
        self.out = False
        if self._parameters:
            # What the script has kept is filled when it reads it again.
            _reading.wait(self)
        return bool(changed or self._erased)

    @_locked
    def followed(self) -> None:
        """The engine has the changes."""
        self._at, self._stiff_at, self._before, self._erased, self._rows, self._filled = None, None, [], 0, {}, None
        self._constant = self._fixed = self._written = None

    def values(self) -> dict[str, Any]:
        """Attributes of the physics that the law reads, row by row."""
        return _changes.values(self._phys)

    def _refuse_late_changes(self) -> None:
        """Raise YadeError if a script has changed objects before a step that has not followed; the native engine tells no step."""
        if not self.out and self._parameters:
            return
        changed = self._changes()
        self._before = []
        if changed:
            self._refuse_late(changed)

    def _refuse_late(self, changed: dict[str, int]) -> None:
        name, row = next(iter(changed.items()))
        raise refuse(
            f"{name} of the contact of bodies {self._one[row]} and {self._two[row]} was changed in an object of an earlier step, so the change was "
            "lost; take the contact from O.interactions again in the step in which you change it",
            "Changed",
        )

    @_locked
    def erase(self, one: int, two: int) -> bool:
        """Forget the object between two bodies; returns whether there was one."""
        self.fill()
        if self.find(one, two) is None:
            return False
        assert self._index is not None
        self._forget(np.arange(len(self._keys)) != self._index[(one, two) if one < two else (two, one)])
        return True

    @_locked
    def clear(self) -> None:
        """Forget all objects."""
        self.fill()
        self._forget(np.zeros(len(self._keys), bool))

    def _forget(self, keep: NDArray[np.bool_]) -> None:
        self._erased += int((~keep).sum())
        self._filled = None
        self._rows = {}
        self._contacts = [contact for contact, kept in zip(self._contacts, keep.tolist()) if kept]
        self._keys, self._one, self._two, self._reference = self._keys[keep], self._one[keep], self._two[keep], self._reference[keep]
        self._address, self._geom, self._phys = (np.ascontiguousarray(column[keep]) for column in (self._address, self._geom, self._phys))
        self._before = [rows.of(keep) for rows in self._before]
        self._constant = self._fixed = self._written = None
        self._index = self._of_body = None


#: What a script may not change.
_FIXED = ("geom", "phys", "cellDist", "isActive", "initCohesion", "isOnJoint", "momentBroken")
#: What tells a contact of the solver.
_ROW = ("a", "b", "bonded", "reference_length")


def _bits(numbers: Any) -> NDArray[np.int64]:
    return np.ascontiguousarray(numbers, dtype=float).view(np.int64)


def _same_rows(table: Any, rows: dict[str, Any]) -> bool:
    return bool(rows) and all(np.array_equal(table[name], rows[name]) for name in _ROW)


def _table(bonds: Bonds) -> Any:
    """All contacts of the last step, one row each."""
    if bonds._kind["kind"] == "scenario":
        return table_of(bonds.solver)
    tables = bonds.solver.contacts()
    found = [tables[name] for name in ("cpm", "unbonded") if len(tables.get(name, ()))]
    return found[0] if len(found) == 1 else np.concatenate(found or list(tables.values()))


def _write_forces(geom: Addresses, phys: Addresses, first: Any, table: Any, sign: Any) -> None:
    """Write geometry and forces of a law that YADE does not have."""
    turned = sign[:, None]
    normal = table["normal"] * turned
    # YADE's forces act on the second body.
    force = -table["force"] * turned
    along = np.einsum("ij,ij->i", force, normal)[:, None] * normal
    scatter(phys, "CpmPhys.normalForce", along)
    scatter(phys, "CpmPhys.shearForce", force - along)
    radius = gather(geom, "ScGeom.refR1")
    overlap = radius + gather(geom, "ScGeom.refR2") - table["length"]
    scatter(geom, "ScGeom.normal", normal)
    scatter(geom, "ScGeom.penetrationDepth", overlap)
    scatter(geom, "ScGeom.contactPoint", first + normal * (radius - 0.5 * overlap)[:, None])
