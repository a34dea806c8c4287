"""Bonds of a bonded engine as interactions of YADE: for good (the engine ends), or for a script that reads them."""

from __future__ import annotations

import contextlib
import ctypes
from typing import Any, Iterator, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from . import _changes, _histories
from ._concrete import class_of, create_interactions, scatter, sort_anew, write_contacts, write_images
from ._memory import known_address_of, known_pointer
from ._rules import refuse
from ._scene import Interactions, Ints, Reals, at_rest, gather, host, interactions, of_class


def table_of(solver: _core.Hosted) -> dict[str, NDArray[Any]]:
    """All contacts of the last step, one row each.

    `a`, `b`: ids of the bodies; `image`: periodic image of b; `law`: number of the law's table in `Hosted.contacts`; `bonded`, `damage`,
    `area`, `reference_length`; `normal`: from a to b, and `length`, the distance of the centers (m); `force`, `moment`: on a (N, N m).
    """
    tables = solver.contacts()
    names = ("a", "b", "index_a", "index_b", "image", "bonded", "damage", "area", "reference_length", "normal", "length")
    found = {name: np.concatenate([table[name] for table in tables.values()]) for name in names}
    found["law"] = np.repeat(np.arange(len(tables)), [len(table) for table in tables.values()])
    forces = solver.forces(False)[1]
    if not np.array_equal(forces.pair, np.stack([found["index_a"], found["index_b"]], axis=1)):
        raise refuse("contacts and forces of the solver do not match; please report this", "Layout")
    found["force"] = forces.force
    found["moment"] = np.zeros_like(forces.force) if forces.moment is None else forces.moment
    return found


def clear_between(ids: Ints) -> None:
    """Remove the interactions between these bodies from YADE."""
    own, found = host().interactions, interactions()
    inner = np.isin(found.id1, ids) & np.isin(found.id2, ids)
    if inner.all():
        own.clear()
        return
    for one, two in zip(found.id1[inner], found.id2[inner]):
        own.erase(int(one), int(two))
    # Erasing by ids leaves potential contacts, which would become real again where spheres overlap.
    own.eraseNonReal()


#: Owners of an interaction of YADE, and of its geometry and physics, if no script has kept one: the container, and both bodies.
_OWNERS = {"": 3, "Interaction.geom": 1, "Interaction.phys": 1}


def kept_between(ids: Ints) -> list[Any]:
    """The real interactions between these bodies of which a script has kept the object, or a part."""
    found, layout = interactions(), host().layout
    vector = known_pointer(known_address_of(host().omega._sceneObj) + layout["Scene.interactions"]) + layout["interactions.vector"]
    start, end = (ctypes.c_uint64 * 2).from_address(vector)
    pointers = np.ctypeslib.as_array((ctypes.c_uint64 * ((end - start) // 8)).from_address(start)).reshape(-1, 2) if end > start else np.zeros((0, 2), np.uint64)
    order = np.argsort(pointers[:, 0])
    owner = order[np.searchsorted(pointers[order, 0], found.address)]
    kept = np.zeros(len(found.address), bool)
    for field, usual in _OWNERS.items():
        # Beside the target, a shared pointer has the address of its counter, whose number follows the address of its class.
        if field:
            counter = _core.memory_rows(found.address, [(layout[field] + 8, 8)]).view(np.uint64).reshape(-1)
        else:
            counter = np.ascontiguousarray(pointers[owner, 1])
        kept |= _core.memory_rows(counter, [(8, 4)]).view(np.int32).reshape(-1) > usual
    kept &= np.isin(found.id1, ids) & np.isin(found.id2, ids)
    return [host().interactions[int(one), int(two)] for one, two in zip(found.id1[kept], found.id2[kept])]


#: YADE's law of the bonds of each kind of engine; others have laws that YADE does not have.
LAWS = {"concrete": "Law2_ScGeom_CpmPhys_Cpm", **{kind: law.FUNCTORS["lawDispatcher"] for kind, law in _histories.LAWS.items()}}


class Bonds(Protocol):
    """A bonded engine, with or without headers."""

    name: str
    _kind: dict[str, Any]
    _placed: bool
    _next: int
    _shown: bool
    _update_states: int

    @property
    def solver(self) -> _core.Hosted:
        """The bonds."""

    @property
    def ids(self) -> Ints:
        """Ids of the bodies."""

    def check(self, deep: bool) -> None:
        """Raise YadeError unless the scene is as the engine needs it."""

    def update_states(self) -> None:
        """Write CpmState."""

    def hand_over_objects(self) -> None:
        """Let the objects that a script has kept share what YADE has got."""

    def _take_out(self) -> None: ...
    def _put_in(self) -> None: ...
    def _release(self) -> None: ...
    def _as_yades(self) -> contextlib.AbstractContextManager[None]: ...


def give_back(engine: Bonds) -> dict[str, int]:
    """See :meth:`BondedEngine.give_back`."""
    at_rest()
    if engine._kind["kind"] not in LAWS:
        raise refuse(
            f'the bonds of "{engine.name}" follow a law that stock YADE does not have, so they cannot become interactions; use '
            "interactions() to read them, or a functor of the native plugin from the start",
            "NotConcrete",
        )
    if engine._placed:
        engine.check(deep=True)
    omega = host().omega
    if omega.subStep >= 0 and engine._next <= omega.iter:
        raise refuse(
            f'the bonded engine "{engine.name}" has not acted in this step, whose forces would be lost; call give_back() from a PyRunner '
            "behind it in O.engines",
            "EngineOrder",
        )
    counts = hand_over(engine)
    engine._release()
    return counts


def hand_over(engine: Bonds) -> dict[str, int]:
    """Give the bonds back, without the checks of :func:`give_back`; the engine stays registered."""
    if engine._kind["kind"] == "concrete":
        engine.update_states()
    engine._take_out()
    try:
        counts = _write_contacts(engine)
        engine.hand_over_objects()
    except BaseException:
        # Nothing is lost: the bonds act again.
        clear_between(engine.ids)
        engine._put_in()
        raise
    if engine._update_states:  # the take-over has disabled it
        for other in host().omega.engines:
            if class_of(other) == "CpmStateUpdater":
                other.dead = False
    return counts


@contextlib.contextmanager
def shown(engine: Bonds) -> Iterator[None]:
    """See :meth:`BondedEngine.interactions`."""
    at_rest()
    if engine._shown:
        yield  # an outer block shows them
        return
    engine.check(deep=True)
    engine._shown = True
    try:
        with engine._as_yades():
            _create(engine)
        before = _present(engine)
        yield
        _refuse_changes(before, _present(engine))
    finally:
        clear_between(engine.ids)
        engine._shown = False
        # Last: it assigns O.engines, whose engines that read interactions get their helpers back.
        sort_anew()


def _present(engine: Bonds) -> tuple[Interactions, list[_changes.Rows]]:
    """The interactions between the bodies, and what a script may change in them."""
    found = interactions()
    found = found.of(np.isin(found.id1, engine.ids) & np.isin(found.id2, engine.ids))
    return found, _changes.everything(found.address, found.geom, found.phys, engine._kind["kind"])


def _refuse_changes(before: tuple[Interactions, list[_changes.Rows]], now: tuple[Interactions, list[_changes.Rows]]) -> None:
    """Raise YadeError if a script has changed the interactions, which end with the block."""
    if not np.array_equal(before[0].address, now[0].address):
        gone = np.flatnonzero(~np.isin(before[0].address, now[0].address))
        what = f"the contact of bodies {before[0].id1[gone[0]]} and {before[0].id2[gone[0]]} was erased" if len(gone) else "interactions were created"
    else:
        changed = _changes.between(before[1], now[1])
        if not changed:
            return
        name, row = next(iter(changed.items()))
        what = f"{name} of the contact of bodies {before[0].id1[row]} and {before[0].id2[row]} was changed"
    raise refuse(
        f"{what} within the block `with engine.interactions():`, which only shows the bonds, so the change is lost; change and erase bonds of "
        "take_over() in O.interactions without the block",
        "Changed",
    )


def _write_contacts(engine: Bonds) -> dict[str, int]:
    """Write bonds and contacts of one of YADE's laws to YADE."""
    if engine._kind["kind"] in _histories.LAWS:
        return _histories.write_contacts(engine.solver, engine._kind["kind"])
    return write_contacts(engine.solver, engine._kind)


def _create(engine: Bonds) -> None:
    if engine._kind["kind"] in LAWS:
        _write_contacts(engine)
        return
    table = table_of(engine.solver)
    one, two = np.minimum(table["a"], table["b"]).astype(np.int32), np.maximum(table["a"], table["b"]).astype(np.int32)
    create_interactions(one, two)
    _write_forces(engine.ids, one, two, table)


def _write_forces(ids: Ints, one: Ints, two: Ints, table: dict[str, NDArray[Any]]) -> None:
    """Write geometry and forces of the table to the interactions between these bodies, whatever the classes of their physics."""
    found = interactions()
    found = found.of(np.isin(found.id1, ids) & np.isin(found.id2, ids))
    keys = one.astype(np.int64) << 32 | two
    order = np.argsort(keys)
    low, high = np.minimum(found.id1, found.id2).astype(np.int64), np.maximum(found.id1, found.id2)
    row = order[np.searchsorted(keys[order], low << 32 | high)]
    if len(row) != len(keys) or not of_class(found.geom, "ScGeom.vtable").all():
        raise refuse("YADE's functors did not make one ScGeom per bond; use Ig2_Sphere_Sphere_ScGeom for these spheres")
    for body_one, body_two in zip(found.id1[:1], found.id2[:1]):
        physics = host().interactions[int(body_one), int(body_two)].phys
        if not isinstance(physics, host().wrapper.NormShearPhys):
            raise refuse(f"YADE's functors make {class_of(physics)} for these spheres, which has no normal and shear force")
    sign = np.where(table["a"][row] == found.id1, 1.0, -1.0)[:, None]
    normal: Reals = table["normal"][row] * sign
    # YADE's forces act on the second body.
    force: Reals = -table["force"][row] * sign
    along = np.einsum("ij,ij->i", force, normal)[:, None] * normal
    scatter(found.phys, "CpmPhys.normalForce", along)
    scatter(found.phys, "CpmPhys.shearForce", force - along)
    scatter(found.geom, "ScGeom.normal", normal)
    radii = gather(found.geom, "ScGeom.refR1") + gather(found.geom, "ScGeom.refR2")
    scatter(found.geom, "ScGeom.penetrationDepth", radii - table["length"][row])
    write_images(found.address, table["image"][row] * sign.astype(np.int32))
