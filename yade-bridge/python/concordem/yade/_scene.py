"""The current YADE scene as arrays, read from memory at once."""

from __future__ import annotations

import functools
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core, operators
from .._errors import YadeError
from .._types import Contacts, Fabric, Loads, RegionStress
from ._layout import probe
from ._memory import address_of, memory, pack_real
from ._pause import in_the_loop, step_under_way
from ._probe import Layout

Reals = NDArray[np.float64]
Ints = NDArray[np.int32]
Addresses = NDArray[np.uint64]
Truncation = Literal["branch-clipped", "half-crossing", "internal-only"]
Partition = Literal["contact-point", "half-branch"]


class _Yade:
    """The running YADE and, once it is needed, the memory layout of its objects."""

    def __init__(self) -> None:
        try:
            import yade
            import yade.wrapper
        except ImportError as error:
            raise YadeError(
                "concordem.yade works only inside YADE; run `yade script.py`, or add YADE's folder to sys.path before the import "
                "(see the tutorial)",
                "NotInYade",
            ) from error
        self.module: Any = yade
        self.wrapper: Any = yade.wrapper
        self.omega: Any = yade.wrapper.Omega()
        self.names = _Names(yade, self.omega)

    @property
    def interactions(self) -> Any:
        """YADE's own O.interactions, without the bonds of bonded engines."""
        found = self.omega.interactions
        return getattr(found, "own", found)

    @functools.cached_property
    def layout(self) -> Layout:
        """Where YADE stores the fields of its objects."""
        return probe(self.names)


class _Names:
    """The names of YADE that `_layout` needs, independent of the script's imports."""

    def __init__(self, module: Any, omega: Any) -> None:
        self.config = module.config
        self.wrapper = module.wrapper
        self.O = omega
        # Get the vector types from objects, because their modules depend on the version.
        self.Vector3: Any = type(module.wrapper.State().pos)
        self.Vector3i: Any = type(module.wrapper.Interaction().cellDist)
        self.Matrix3: Any = type(module.wrapper.CpmState().stress)


_instance: _Yade | None = None


def host() -> _Yade:
    """The running YADE."""
    global _instance
    if _instance is None:
        _instance = _Yade()
    return _instance


def is_at_rest() -> bool:
    """Whether no other thread changes YADE's memory now. YADE's own loop waits for the scripts that it calls."""
    return not host().omega.running or in_the_loop()


def bodies_stand() -> bool:
    """Whether no other thread moves bodies now, not even in a step that a paused run has not finished. A step that an error has ended looks
    the same, so False after it."""
    omega = host().omega
    return in_the_loop() or not (omega.running or step_under_way(omega))


def at_rest() -> None:
    """Raise YadeError if another thread may change YADE's memory."""
    if not is_at_rest():
        raise YadeError("YADE is running in the background; call O.pause() or O.wait() first, or call this from a PyRunner", "Running")


class Bodies(NamedTuple):
    """Bodies of a scene, one row each."""

    ids: Ints
    """Ids."""
    address: Addresses
    """Addresses of the C++ objects."""
    state: Addresses
    """Addresses of their states."""
    shape: Addresses
    """Addresses of their shapes; 0 for none."""
    material: Addresses
    """Addresses of their materials; 0 for none."""
    positions: Reals
    """Positions, m, (n, 3)."""

    def of(self, rows: NDArray[np.bool_]) -> Bodies:
        """The selected rows."""
        columns: list[Any] = [np.ascontiguousarray(column[rows]) for column in self]
        return Bodies(*columns)


class Interactions(NamedTuple):
    """Real interactions of a scene, one row each."""

    address: Addresses
    """Addresses of the C++ objects."""
    id1: Ints
    """First body."""
    id2: Ints
    """Second body."""
    image: Ints
    """Periodic image of the second body, (n, 3)."""
    geom: Addresses
    """Addresses of their geometries."""
    phys: Addresses
    """Addresses of their physics."""

    def of(self, rows: NDArray[np.bool_]) -> Interactions:
        """The selected rows."""
        columns: list[Any] = [np.ascontiguousarray(column[rows]) for column in self]
        return Interactions(*columns)


def gather(addresses: Addresses, field: str, kind: str = "f64", components: int = 1) -> NDArray[Any]:
    """Read a field of all objects; `components` numbers of type `kind` each."""
    return _core.memory_gather(addresses, host().layout[field], kind, components)


def bodies() -> Bodies:
    """All bodies of the scene."""
    at_rest()
    yade = host()
    layout, omega = yade.layout, yade.omega
    container = memory.pointer(address_of(omega._sceneObj) + layout["Scene.bodies"])
    address = _core.memory_targets(container + layout["bodies.vector"])
    if len(address) != len(omega.bodies):
        raise YadeError(f"found {len(address)} bodies in memory, but O.bodies has {len(omega.bodies)}; please report this", "Layout")
    address = np.ascontiguousarray(address[address != 0])
    ids = gather(address, "Body.id", "i32")
    state = gather(address, "Body.state", "u64")
    found = Bodies(
        ids,
        address,
        state,
        gather(address, "Body.shape", "u64"),
        gather(address, "Body.material", "u64"),
        gather(state, "State.pos", components=3),
    )
    for k in _sample(len(ids)):
        body = omega.bodies[int(ids[k])]
        _same("the position of body %d" % ids[k], found.positions[k].tobytes(), pack_real(body.state.pos))
        _same("the address of body %d" % ids[k], int(address[k]), address_of(body))
    return found


def interactions() -> Interactions:
    """All real interactions of the scene."""
    at_rest()
    yade = host()
    layout, omega = yade.layout, yade.omega
    container = memory.pointer(address_of(omega._sceneObj) + layout["Scene.interactions"])
    address = _core.memory_targets(container + layout["interactions.vector"])
    if len(address) != len(yade.interactions):
        raise YadeError(f"found {len(address)} interactions in memory, but O.interactions has {len(yade.interactions)}; please report this", "Layout")
    geom, phys = gather(address, "Interaction.geom", "u64"), gather(address, "Interaction.phys", "u64")
    real = (geom != 0) & (phys != 0)
    address, geom, phys = (np.ascontiguousarray(column[real]) for column in (address, geom, phys))
    one, two = _two_ints(address, "Interaction.id1", "Interaction.id2")
    found = Interactions(
        address,
        one,
        two,
        gather(address, "Interaction.cellDist", "i32", 3),
        geom,
        phys,
    )
    for k in _sample(len(address)):
        try:
            contact = yade.interactions[int(found.id1[k]), int(found.id2[k])]
        except IndexError:
            raise YadeError(f"interaction {found.id1[k]}-{found.id2[k]} is in memory, but not in O.interactions; please report this", "Layout")
        _same("an interaction", int(address[k]), address_of(contact))
        _same("the image of an interaction", tuple(found.image[k]), tuple(contact.cellDist))
    return found


def _sample(count: int) -> list[int]:
    """A few indices from the first to the last."""
    return sorted({0, count // 3, count // 2, (2 * count) // 3, count - 1}) if count else []


def _same(what: str, found: Any, wanted: Any) -> None:
    if found != wanted:
        raise YadeError(f"{what} is {found!r} in memory, but {wanted!r} in YADE's Python; please report this", "Layout")


def of_class(addresses: Addresses, table: str) -> NDArray[np.bool_]:
    """Which objects have the method table of a class; False for null addresses."""
    return np.asarray(_core.memory_gather(addresses, 0, "u64") == np.uint64(host().layout[table]))


#: For each method table, whether the class derives from ScGeom or NormShearPhys.
_trusted: dict[str, dict[int, bool]] = {"geom": {}, "phys": {}}


def _two_ints(addresses: Addresses, one: str, two: str) -> tuple[Ints, Ints]:
    """Two ints of the same objects, read together if they are adjacent."""
    layout = host().layout
    if layout[two] - layout[one] != 4:
        return gather(addresses, one, "i32"), gather(addresses, two, "i32")
    both = gather(addresses, one, "i32", 2)
    return np.ascontiguousarray(both[:, 0]), np.ascontiguousarray(both[:, 1])


def _two_vectors(addresses: Addresses, one: str, two: str) -> Reals:
    """Sum of two vectors of the same objects, read together if they are close."""
    layout = host().layout
    first, second = sorted((layout[one], layout[two]))
    between = (second - first) // 8
    if (second - first) % 8 or between > 8:
        return gather(addresses, one, components=3) + gather(addresses, two, components=3)
    row = _core.memory_gather(addresses, first, "f64", between + 3)
    return np.asarray(row[:, :3] + row[:, between:])


def _readable(found: Interactions) -> NDArray[np.bool_]:
    """Which interactions are sphere contacts with normal and shear force; each class is checked once through Python."""
    yade = host()
    bases = {"geom": yade.wrapper.ScGeom, "phys": yade.wrapper.NormShearPhys}
    keep = np.ones(len(found.address), bool)
    for name, addresses in (("geom", found.geom), ("phys", found.phys)):
        tables = _core.memory_gather(addresses, 0, "u64")
        unknown = np.ones(len(tables), bool)
        for table, trusted in _trusted[name].items():
            of_this = tables == np.uint64(table)
            unknown &= ~of_this
            if not trusted:
                keep &= ~of_this
        distinct, first = np.unique(tables[unknown], return_index=True)
        first = np.flatnonzero(unknown)[first]
        for table, k in zip(distinct, first):
            contact = yade.interactions[int(found.id1[k]), int(found.id2[k])]
            instance = getattr(contact, name)
            trusted = isinstance(instance, bases[name])
            if trusted:
                field, attribute = ("ScGeom.normal", "normal") if name == "geom" else ("CpmPhys.normalForce", "normalForce")
                data = memory.read(int(addresses[k]) + yade.layout[field], 24)
                _same(f"{attribute} of {type(instance).__name__}", data, pack_real(getattr(instance, attribute)))
            _trusted[name][int(table)] = trusted
            if not trusted:
                keep &= tables != table
    return keep


class Snapshot:
    """Bodies and contacts of the scene at one moment, and operators on them.

    >>> snapshot = concordem.yade.snapshot()             # doctest: +SKIP
    >>> snapshot.region_stress().stress                  # doctest: +SKIP

    `contacts` contains sphere contacts (ScGeom and derived classes) whose physics has normal and shear force. Contacts of a sphere with
    a body without a radius (facet, wall, box) are `loads`. A is the first body of an interaction. Conventions are those of
    :mod:`concordem.operators`: tension positive; ``sigma[i, j]``: i position, j force, the transpose of ``getStress()``.
    """

    def __init__(self) -> None:
        yade = host()
        self.bodies = bodies()
        self.interactions = interactions()
        #: Number of steps so far.
        self.iter: int = yade.omega.iter
        #: Time, s.
        self.time: float = yade.omega.time
        #: Edge vectors of the periodic cell as columns, m, (3, 3); None without a cell.
        self.cell: Reals | None = _cell_matrix(yade.omega) if yade.omega.periodic else None
        spheres = of_class(self.bodies.shape, "Sphere.vtable")
        #: Whether each body is a sphere.
        self.is_sphere = spheres
        self.radii: Reals = np.full(len(spheres), np.nan)
        self.radii[spheres] = gather(np.ascontiguousarray(self.bodies.shape[spheres]), "Sphere.radius")
        self._row = np.full(int(self.bodies.ids.max(initial=-1)) + 1, -1, np.int64)
        self._row[self.bodies.ids] = np.arange(len(self.bodies.ids))
        self._read_contacts()

    def _read_contacts(self) -> None:
        found = self.interactions
        keep = _readable(found)
        self.unread = int(len(keep) - keep.sum())
        """Number of interactions of other classes, which are ignored."""
        if not keep.all():
            found = found.of(keep)
        self.interactions = found
        one, two = self._row[found.id1], self._row[found.id2]
        x = self.bodies.positions
        branch = x[two] - x[one]
        if self.cell is not None:
            branch += found.image @ self.cell.T
        point = gather(found.geom, "ScGeom.contactPoint", components=3)
        # YADE's forces act on the second body.
        force = -_two_vectors(found.phys, "CpmPhys.normalForce", "CpmPhys.shearForce")
        ball = self.is_sphere
        inner = ball[one] & ball[two]
        pair = np.stack([one, two], axis=1).astype(np.uint32)
        columns: list[Any] = [pair, branch, point, force]
        if not inner.all():
            columns = [column[inner] for column in columns]
        self.contacts = Contacts(*columns)
        """Contacts between spheres, for operators; `pair` contains rows of `bodies`."""
        self.contact_rows = np.flatnonzero(inner)
        """Rows of `interactions` for each row of `contacts`."""
        first, second = ball[one] & ~ball[two], ball[two] & ~ball[one]
        particle = np.concatenate([one[first], two[second]]).astype(np.uint32)
        loads = np.concatenate([force[first], -force[second]])
        self.loads = Loads(particle, np.concatenate([point[first], point[second]]), loads, None)
        """Forces of walls and facets on spheres."""

    @property
    def positions(self) -> Reals:
        """Positions of all bodies, m, (n, 3)."""
        return self.bodies.positions

    @property
    def velocities(self) -> Reals:
        """Velocities of all bodies, m/s, (n, 3)."""
        return gather(self.bodies.state, "State.vel", components=3)

    @property
    def angular_velocities(self) -> Reals:
        """Angular velocities of all bodies, rad/s, (n, 3)."""
        return gather(self.bodies.state, "State.angVel", components=3)

    @property
    def displacements(self) -> Reals:
        """Displacements of all bodies since their reference position, m, (n, 3)."""
        return self.positions - gather(self.bodies.state, "State.refPos", components=3)

    @property
    def masses(self) -> Reals:
        """Masses of all bodies, kg, (n,)."""
        return gather(self.bodies.state, "State.mass")

    @property
    def period(self) -> operators.Period | None:
        """Periodic cell for operators; None without a cell."""
        return None if self.cell is None else operators.Period(self.cell)

    def _whole(self, region: operators.Region | None, volume: float | None) -> operators.Region:
        if region is not None:
            return region
        if volume is not None:
            return operators.Region.all(volume)
        if self.cell is not None:
            return operators.Region.periodic_cell(self.cell)
        raise ValueError("the volume is missing; give a region or a volume, which only a periodic scene can omit")

    def region_stress(
        self, region: operators.Region | None = None, volume: float | None = None, truncation: Truncation = "branch-clipped"
    ) -> RegionStress:
        """Stress of a region, of the periodic cell, or of a body of this volume (m^3), Pa. See operators.region_stress.

        Branches to bodies that are not spheres end at the contact point. YADE's getStress takes the position of the body instead, which differs
        for forces along a wall or facet: they then depend on where in its plane the position is. `full` and `partial` count contacts between
        spheres.
        """
        where = self._whole(region, volume)
        period = None if region is None else self.period
        found = operators.region_stress(self.positions, self.contacts, where, truncation, period)
        particle, point, force, _ = self.loads
        if not len(particle):
            return found
        # The walls as points of their own.
        rows = np.arange(len(particle), dtype=np.uint32)
        pair = np.stack([particle, rows + np.uint32(len(self.positions))], axis=1)
        positions = np.concatenate([self.positions, point])
        outer = Contacts(pair, point - self.positions[particle], point, force)
        return found._replace(stress=found.stress + operators.region_stress(positions, outer, where, truncation, period).stress)

    def particle_stress(self, volumes: Reals | None = None, partition: Partition = "contact-point") -> Reals:
        """Stress of every body from its contacts and loads, Pa, (n, 3, 3); NaN for bodies that are not spheres.

        `volumes` (n,), m^3: default those of the spheres. See operators.particle_stress."""
        moments = operators.particle_moments(self.positions, self.contacts, self.loads, partition)
        volume = 4.0 / 3.0 * np.pi * self.radii**3 if volumes is None else np.asarray(volumes)
        return np.asarray(moments / volume[:, None, None])

    def couple_stress(self, region: operators.Region, reference: Any = None) -> Any:
        """Stress and couple stress conjugate to the affine modes of motion of a region. See operators.conjugate_stress."""
        return operators.conjugate_stress(self.positions, self.contacts, region, reference, self.period)

    def fabric(
        self, region: operators.Region | None = None, volume: float | None = None, truncation: Truncation = "branch-clipped"
    ) -> Fabric:
        """Fabric tensor and coordination number of a region, of the periodic cell, or of the whole scene. See operators.fabric."""
        where = self._whole(region, volume)
        period = None if region is None else self.period
        return operators.fabric(self.positions, self.contacts, where, truncation, period)

    def strain(self, region: operators.Region | None = None) -> operators.AffineFit:
        """Best affine fit of the displacements of the spheres since their reference positions. See operators.affine_fit."""
        rows = np.flatnonzero(self.is_sphere)
        where = operators.Region.all(1.0) if region is None else region
        x, u = self.positions[rows], self.displacements[rows]
        return operators.affine_fit(x - u, u, where)


def _cell_matrix(omega: Any) -> Reals:
    matrix = omega.cell.hSize
    return np.array([[matrix[i, j] for j in range(3)] for i in range(3)])


def snapshot() -> Snapshot:
    """Read the current scene."""
    return Snapshot()
