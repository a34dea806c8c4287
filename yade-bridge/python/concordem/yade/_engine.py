"""The bonded engine: bonds that belong to us, in a scene that stays YADE's.

In every step YADE moves its bodies, and a PyRunner asks for the forces of all bonds at once. Bonds are contiguous arrays in
our solver and no interactions of YADE; bodies are masked against each other in YADE's collider, so that contacts between
them after breakage are ours, too. Forces are added through YADE's own `ForceContainer::addForce`.
"""

from __future__ import annotations

import hashlib
import json
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core, operators
from .._errors import YadeError
from .._types import Contacts
from ._concrete import Concrete, cell_of, class_of, engine_of, refuse, scatter
from ._memory import address_of, memory
from ._scene import Bodies, Reals, at_rest, bodies, gather, host, interactions, of_class

#: Engines that read O.interactions and would silently find nothing there, with what to do instead.
BLIND = {
    "CpmStateUpdater": "take_over(update_states=n) takes its place",
    "GlobalStiffnessTimeStepper": "set O.dt yourself, from O.dt before or engine.largest_time_step",
    "PeriTriaxController": "drive the cell from a PyRunner with engine.stress()",
    "Peri3dController": "drive the cell from a PyRunner with engine.stress()",
    "PeriIsoCompressor": "drive the cell from a PyRunner with engine.stress()",
    "KinemSimpleShearBox": "it reads contact forces",
    "TesselationWrapper": "use concordem.operators",
    "FlowEngine": "it reads contacts",
}
#: Recorders of VTKRecorder that walk the interactions.
BLIND_RECORDERS = {"all", "intr", "stress", "bstresses", "cpm", "force", "cracks", "moments", "coordNumber"}

_registered: dict[str, BondedEngine] = {}


def _run(name: str) -> None:
    """One step of an engine; called by its PyRunner."""
    engine = _registered.get(name)
    if engine is None:
        raise YadeError(
            f'the bonded engine "{name}" is in O.engines, but its bonds are not here: YADE saves the engine, not its bonds. '
            "Save with concordem.yade.save and load with concordem.yade.load",
            "NotLoaded",
        )
    engine._step()


def _command(name: str) -> str:
    return f"__import__('concordem.yade').yade._run({name!r})"


def _is_in_engines(name: str) -> bool:
    return any(getattr(engine, "command", "") == _command(name) for engine in host().omega.engines)


def _sort_anew() -> None:
    """Make the collider look at all pairs in the next step: those that were only possible have been forgotten. It cannot be
    told to, so a new one with the same settings takes its place."""
    yade = host()
    old = engine_of("InsertionSortCollider")
    own = {"newton", "boundDispatcher", "numAction", "numReinit", "fastestBodyMaxDist", "doSort"}
    settings = {name: value for name, value in old.dict().items() if name not in own}
    new = yade.wrapper.InsertionSortCollider(old.boundDispatcher.functors, **settings)
    engines = list(yade.omega.engines)
    place = next(k for k, engine in enumerate(engines) if class_of(engine) == "InsertionSortCollider" and not engine.dead)
    yade.omega.engines = engines[:place] + [new] + engines[place + 1 :]


def _check_engines(replaced: str = "") -> None:
    for engine in host().omega.engines:
        name = class_of(engine)
        if engine.dead or name == replaced:
            continue
        if name in BLIND:
            raise refuse(
                f"O.engines has {name}, which looks for contacts in O.interactions and would find none: {BLIND[name]}. Take "
                "it out, or make it dead=True",
                "BlindEngine",
            )
        if name == "VTKRecorder":
            blind = BLIND_RECORDERS & set(engine.recorders)
            if blind:
                raise refuse(
                    f"VTKRecorder records {sorted(blind)}, which it would look for in O.interactions and not find; leave "
                    "recorders of spheres, velocity, and the like",
                    "BlindEngine",
                )


class BondedEngine:
    """Bonds of some spheres of the scene. Made by :func:`take_over` or :func:`bond`."""

    def __init__(self, name: str, solver: _core.Hosted, ids: NDArray[np.int32], kind: dict[str, Any]) -> None:
        if name in _registered and _is_in_engines(name):
            raise refuse(f'there is a bonded engine "{name}" already', "Name")
        self.name = name
        #: The assembly in our solver.
        self.solver = solver
        #: Bodies whose bonds are here.
        self.ids = ids
        self._kind = kind
        self._scene = 0
        self._update_states = int(kind.get("update_states", 0))
        self.attached = False

    # -- in and out of the scene ------------------------------------------------------------------------------------

    def _attach(self) -> None:
        yade = host()
        layout = yade.layout
        scene = address_of(yade.omega._sceneObj)
        container = memory.pointer(scene + layout["Scene.bodies"])
        fields = ("Body.state", "State.pos", "State.vel", "State.angVel", "State.ori", "State.blockedDOFs")
        self.solver.attach(container + layout["bodies.vector"], scene + layout["Scene.forces"], [layout[f] for f in fields])
        self._scene, self._container = scene, container
        _registered[self.name] = self
        self.attached = True

    def _insert(self) -> None:
        """Put the engine behind the InteractionLoop."""
        yade = host()
        engines = list(yade.omega.engines)
        place = next(k for k, engine in enumerate(engines) if class_of(engine) == "InteractionLoop") + 1
        runner = yade.wrapper.PyRunner(command=_command(self.name), iterPeriod=1, initRun=True, firstIterRun=0)
        yade.omega.engines = engines[:place] + [runner] + engines[place:]

    def _mask(self) -> None:
        """Let YADE's collider leave the bodies alone among themselves."""
        omega = host().omega
        everything = bodies()
        masks = gather(everything.address, "Body.groupMask", "i32")
        mine = np.isin(everything.ids, self.ids)
        distinct = np.unique(masks[mine])
        if len(distinct) != 1:
            raise refuse(f"the bodies have {len(distinct)} different masks; YADE can only keep bodies of one mask apart", "Masks")
        collider = engine_of("InsertionSortCollider")
        used = int(np.bitwise_or.reduce(masks)) | collider.avoidSelfInteractionMask
        free = [bit for bit in range(30) if not used >> bit & 1]
        if not free:
            raise refuse("all bits of the masks are in use", "Masks")
        bit = 1 << free[-1]
        for number in self.ids:
            omega.bodies[int(number)].groupMask = int(distinct[0]) | bit
        collider.avoidSelfInteractionMask |= bit
        self._kind["mask"] = bit
        self._clear_interactions()
        _sort_anew()

    def _clear_interactions(self) -> None:
        """Take the interactions among our bodies out of YADE."""
        omega = host().omega
        found = interactions()
        inner = np.isin(found.id1, self.ids) & np.isin(found.id2, self.ids)
        if inner.all():
            omega.interactions.clear()
            return
        for one, two in zip(found.id1[inner], found.id2[inner]):
            omega.interactions.erase(int(one), int(two))
        # Erasing by ids leaves them as contacts to come, which would be real again where spheres overlap.
        omega.interactions.eraseNonReal()

    def remove(self) -> None:
        """Take the engine out of O.engines; its bonds are gone, and the bodies may touch as YADE's again."""
        yade = host()
        yade.omega.engines = [e for e in yade.omega.engines if getattr(e, "command", "") != _command(self.name)]
        bit = self._kind.get("mask", 0)
        if bit:
            for number in self.ids:
                body = yade.omega.bodies[int(number)]
                if body is not None:  # it may be gone, which is a reason to remove the engine
                    body.groupMask &= ~bit
            collider = engine_of("InsertionSortCollider")
            collider.avoidSelfInteractionMask &= ~bit
            _sort_anew()
        _registered.pop(self.name, None)
        self.attached = False

    # -- every step --------------------------------------------------------------------------------------------------

    def _step(self) -> None:
        yade = host()
        omega = yade.omega
        scene = address_of(omega._sceneObj)
        if scene != self._scene or memory.pointer(scene + yade.layout["Scene.bodies"]) != self._container:
            raise YadeError(f'the bonded engine "{self.name}" belongs to another scene', "OtherScene")
        if omega.iter % 256 == 0:
            _check_engines()
        try:
            self.solver.contact_step(omega.dt, cell_of(omega) if omega.periodic else None)
        except (RuntimeError, ValueError) as error:
            raise YadeError(f'the bonded engine "{self.name}" at iteration {omega.iter}: {error}', "Step") from error
        if self._update_states and omega.iter % self._update_states == 0:
            self.update_states()

    # -- looking at it ------------------------------------------------------------------------------------------------

    @property
    def bond_count(self) -> int:
        """Bonds that have not broken."""
        return self.solver.bond_count

    @property
    def broken(self) -> int:
        """Bonds that broke since the engine was made."""
        return self.solver.broken

    def contacts(self) -> dict[str, NDArray[np.void]]:
        """Tables of bonds by law and of `unbonded` contacts with their histories; `a` and `b` are ids of bodies."""
        return self.solver.contacts()

    def forces(self) -> tuple[Reals, Contacts]:
        """Places of the particles (m) and contacts with forces, as :mod:`concordem.operators` reads them."""
        return self.solver.bodies()["position"], self.solver.forces()

    def stress(self, volume: float | None = None) -> Reals:
        """Stress of the cell, or of a body of this volume (m^3), by bonds and contacts: Pa, tension positive, (3, 3)."""
        cell = self.solver.cell
        if volume is None:
            if cell is None:
                raise ValueError("give the volume of the body: only a periodic cell has one of its own")
            volume = abs(float(np.linalg.det(cell[0])))
        x, contacts = self.forces()
        return operators.region_stress(x, contacts, operators.Region.all(volume)).stress

    def update_states(self) -> None:
        """Write damage, broken bonds, and stress of the particles into YADE's CpmState, as CpmStateUpdater would."""
        yade = host()
        everything = bodies()
        row = np.full(int(everything.ids.max()) + 1, -1, np.int64)
        row[everything.ids] = np.arange(len(everything.ids))
        now = self.solver.bodies()
        state = everything.state[row[now["id"]]]
        if not of_class(state, "CpmState.vtable").all():
            raise refuse("update_states writes to CpmState, which these bodies do not have", "NotConcrete")
        count = len(now["id"])
        tables = self.solver.contacts()
        links, damage = np.zeros(count), np.zeros(count)
        for law, table in tables.items():
            if law == "unbonded":
                continue
            if "kappa" in (table.dtype.names or ()):
                onset = self._kind["onset"]
                lost = 1.0 - np.where(table["kappa"] < onset, 1.0, (1.0 - table["omega"]) * table["kappa"] / onset)
            else:
                lost = table["damage"]
            for side in ("index_a", "index_b"):
                np.add.at(links, table[side], 1.0)
                np.add.at(damage, table[side], lost)
        broken = self.solver.losses().astype(np.int32)
        total = links + broken
        scatter(state, "CpmState.normDmg", np.where(total > 0, (damage + broken) / np.where(total > 0, total, 1), 0.0))
        _core.memory_scatter_i32(state, yade.layout["CpmState.numBrokenCohesive"], broken)
        # YADE's volume of a particle: the sphere over a packing fraction of 0.62; half of each branch for either side.
        moments = operators.particle_moments(now["position"], self.solver.forces(), partition="half-branch")
        volume = operators.particle_volumes(now["radius"], packing_fraction=0.62)
        stress = np.asarray(moments) / volume[:, None, None]
        scatter(state, "CpmState.stress", 0.5 * (stress + stress.transpose(0, 2, 1)))


def take_over(
    name: str = "bonds",
    kinematics: str | None = None,
    mode: str = "yade-public",
    update_states: int = 0,
    threads: int | None = None,
) -> BondedEngine:
    """Take the bonds of a live scene of concrete (YADE's CPM) over, with their histories, and go on with them here.

    After this line `O.run` works as before; interactions between the spheres are gone from O.interactions. With the
    defaults it is YADE's law to rounding; `kinematics="finite", mode="thesis"` is the corrected law. `update_states`:
    write CpmState every so many steps, in place of YADE's CpmStateUpdater, which is made dead. Bits do not depend on the number of threads, of YADE (``-j``) or here.
    """
    at_rest()
    concrete = Concrete()
    replaced = "CpmStateUpdater" if update_states else ""
    _check_engines(replaced)
    kinematics = kinematics or concrete.settings.kinematics
    solver = concrete.hosted(kinematics, mode, False, threads)
    kind = {
        "kind": "concrete",
        "kinematics": kinematics,
        "mode": mode,
        "update_states": update_states,
        "onset": float(concrete.materials[0].epsCrackOnset),
        "laws": concrete.laws(mode),
        "materials": len(concrete.materials),
    }
    if update_states and len({material.epsCrackOnset for material in concrete.materials}) > 1:
        raise refuse("update_states knows one crack onset strain; the materials have several", "Materials")
    engine = _begin(BondedEngine(name, solver, concrete.bodies.ids, kind))
    for other in host().omega.engines:
        if class_of(other) == replaced:
            other.dead = True
    return engine


def _begin(engine: BondedEngine) -> BondedEngine:
    engine._attach()
    try:
        engine._mask()
        engine._insert()
    except Exception:
        _registered.pop(engine.name, None)
        engine.attached = False
        raise
    return engine


def bond(
    material: dict[str, Any],
    bonds: dict[str, Any] | None = None,
    contacts: dict[str, Any] | None = None,
    ids: Any = None,
    name: str = "bonds",
    kinematics: str = "finite",
    threads: int | None = None,
    **tables: Any,
) -> BondedEngine:
    """Bond spheres of the live scene with any of our laws: concrete, cohesive beams, brittle links, deformable particles.

    `material`, `bonds`, and `contacts` are the tables of a scenario (without `bonds` all contacts are unbonded, without `contacts`
    particles without a bond pass through each other); `ids` the spheres (all if not given); other tables of a scenario
    (`deformable`, `dimension`, ...) may follow. Masses and motion are those of YADE's bodies.

    >>> concordem.yade.bond(                                                       # doctest: +SKIP
    ...     material={"name": "glass", "density": 2500, "cohesive_beam":
    ...               {"young": "300 GPa", "poisson": 0.3, "radius_ratio": 0.6, "tensile_strength": "60 MPa"}},
    ...     bonds={"law": "cohesive_beam", "interaction_ratio": 1.1}, contacts={"law": "none"})
    """
    at_rest()
    omega = host().omega
    if omega.periodic:
        raise refuse("bond() knows no periodic scenes yet; take_over() does", "Periodic")
    _check_engines()
    everything = bodies()
    ball = of_class(everything.shape, "Sphere.vtable")
    if ids is not None:
        wanted = np.isin(everything.ids, np.asarray(ids))
        if int(wanted.sum()) != len(set(map(int, ids))):
            raise refuse("some of `ids` are no bodies of the scene", "OtherBodies")
        if not ball[wanted].all():
            raise refuse(f"body {int(everything.ids[wanted & ~ball][0])} is no sphere", "OtherBodies")
        ball = wanted
    mine = everything.of(ball)
    for number in mine.ids:
        if not omega.bodies[int(number)].isStandalone:
            raise refuse(f"body {int(number)} belongs to a clump", "Clumps")
    radius = gather(mine.shape, "Sphere.radius")
    spheres = np.concatenate([mine.positions, radius[:, None]], axis=1)
    description = dict(
        packing={"kind": "spheres", "spheres": spheres},
        material=material,
        contacts=contacts or {"law": "none"},
        kinematics=kinematics,
        stop={"steps": 1},
        **({"bonds": bonds} if bonds else {}),
        **tables,
    )
    scenario = _core.Scenario(**description)
    solver = _hosted_of(scenario, mine, omega.dt, threads)
    kind = {"kind": "scenario", "scenario": scenario.text, "onset": 0.0}
    return _begin(BondedEngine(name, solver, mine.ids, kind))


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
        )
    except ValueError as error:
        raise refuse(f"the bodies cannot be bonded: {error}") from error


# -- save and load -----------------------------------------------------------------------------------------------------


def _fingerprint() -> str:
    """Hash of where all bodies are and how they move, and of the clock."""
    omega = host().omega
    found = bodies()
    digest = hashlib.sha256()
    for column in (
        found.ids,
        found.positions,
        gather(found.state, "State.vel", components=3),
        gather(found.state, "State.angVel", components=3),
        gather(found.state, "State.ori", components=4),
        np.array([omega.iter], np.int64),
        np.array([omega.time, omega.dt]),
    ):
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()


def _beside(path: str | os.PathLike[str], name: str) -> str:
    return f"{os.fspath(path)}.{name}.concordem"


def save(path: str | os.PathLike[str]) -> list[str]:
    """`O.save(path)`, and the bonds of every bonded engine in a file beside it; the names of all files."""
    at_rest()
    yade = host()
    files = [os.fspath(path)]
    yade.omega.save(os.fspath(path))
    scene = address_of(yade.omega._sceneObj)
    for engine in _registered.values():
        if engine._scene != scene:
            continue
        beside = _beside(path, engine.name)
        text = {
            "fingerprint": _fingerprint(),
            "name": engine.name,
            "ids": engine.ids.tolist(),
            "kind": engine._kind,
            "losses": engine.solver.losses().tolist(),
        }
        engine.solver.save(beside, json.dumps(text))
        files.append(beside)
    return files


def load(path: str | os.PathLike[str], threads: int | None = None) -> list[BondedEngine]:
    """`O.load(path)`, and the bonds that :func:`save` wrote beside it. A file that belongs to another scene is refused."""
    yade = host()
    omega = yade.omega
    omega.load(os.fspath(path))
    wanted = [e.command for e in omega.engines if class_of(e) == "PyRunner" and "concordem.yade" in e.command]
    engines = []
    for command in wanted:
        name = command.rsplit("(", 1)[1].rstrip(")").strip("'\"")
        beside = _beside(path, name)
        if not os.path.exists(beside):
            raise refuse(f'the bonds of the engine "{name}" are not here: {beside} is missing', "NotLoaded")
        text = json.loads(_core.hosted_text(beside))
        if text["fingerprint"] != _fingerprint():
            raise refuse(f"{beside} does not belong to the scene in {os.fspath(path)}: bodies, motion, or clock differ", "Mismatch")
        _registered.pop(name, None)
        engines.append(_restore(text, beside, threads))
    return engines


def _restore(text: dict[str, Any], beside: str, threads: int | None) -> BondedEngine:
    omega = host().omega
    ids, kind = np.array(text["ids"], np.int32), text["kind"]
    everything = bodies()
    found = everything.of(np.isin(everything.ids, ids))
    if kind["kind"] == "scenario":
        solver = _hosted_of(_core.Scenario.from_text(kind["scenario"], beside), found, omega.dt, threads)
    else:
        inertia = gather(found.state, "State.inertia", components=3)
        empty = np.zeros(0)
        solver = _core.Hosted.concrete(
            {
                "id": found.ids.astype(np.uint32),
                "position": found.positions,
                "velocity": gather(found.state, "State.vel", components=3),
                "orientation": gather(found.state, "State.ori", components=4),
                "angular_velocity": gather(found.state, "State.angVel", components=3),
                "radius": gather(found.shape, "Sphere.radius"),
                "mass": gather(found.state, "State.mass"),
                "inertia": np.ascontiguousarray(inertia[:, 0]),
                "material": np.zeros(len(found.ids), np.uint32),
                "constraint": gather(found.state, "State.blockedDOFs", "i32").astype(np.uint32),
            },
            {
                "pair": np.zeros((0, 2), np.uint32),
                "image": np.zeros((0, 3), np.int8),
                "bonded": np.zeros(0, bool),
                "length": empty,
                "area": empty,
                "normal": np.zeros((0, 3)),
                "distance": empty,
                "history": np.zeros((0, 11)),
            },
            [tuple(row) for row in kind["laws"]],
            kind["materials"],
            omega.dt,
            kind["kinematics"],
            cell=cell_of(omega) if omega.periodic else None,
            threads=threads or omega.numThreads,
        )
    solver.restore(beside, np.array(text["losses"], np.uint32))
    engine = BondedEngine(text["name"], solver, ids, kind)
    engine._attach()
    return engine
