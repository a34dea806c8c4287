"""The bonded engine: our solver computes the bonds in a scene that YADE integrates.

In every step, YADE moves its bodies, and a PyRunner computes the forces of all bonds. Bonds are contiguous arrays in our solver, not
YADE interactions. A mask excludes contacts between the bodies from YADE's collider, so our solver also computes contacts after
breakage. Forces are added through YADE's `ForceContainer::addForce`.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core, operators
from .._errors import YadeError
from .._types import Contacts
from . import _hooks, _interactions, _late, _lending, _reading, _rules, _thread_state, _vtk
from ._concrete import Concrete, add_to_clock, add_to_lost, cell_of, class_of, engine_of, sort_anew, write_states
from ._histories import Spheres
from ._jointed import count_cracks
from ._memory import address_of, known_address_of, known_pointer, memory
from ._mirror import Mirror
from ._motion import Motion, free_bit
from ._rules import refuse
from ._scene import Ints, Reals, at_rest, bodies, bodies_stand, gather, host, is_at_rest

_registered: dict[str, BondedEngine] = {}


def _run(name: str) -> None:
    """One step of an engine; called by its PyRunner."""
    _thread_state.keep()
    engine = _registered.get(name)
    try:
        if engine is None:
            raise YadeError(
                f'the bonded engine "{name}" is in O.engines, but its bonds are missing, because O.save does not save them; use '
                "concordem.yade.save and concordem.yade.load",
                "NotLoaded",
            )
        engine._step()
    except YadeError as error:
        failed = _hooks.one_line(error)
    else:
        return
    raise failed from None


def _command(name: str) -> str:
    return f"__import__('concordem.yade').yade._run({name!r})"


def _is_in_engines(name: str) -> bool:
    return any(getattr(engine, "command", "") == _command(name) for engine in _lending.working_engines())


def _here() -> list[BondedEngine]:
    """The bonded engines of the current scene."""
    if not _registered:
        return []
    scene = known_address_of(host().omega._sceneObj)
    return [engine for engine in _registered.values() if engine._placed and engine._scene == scene and engine._is_here()]


def _calm() -> bool:
    """Whether no engine needs a check before a step: O.engines of the scene are those of the last check."""
    if not _registered:
        return True
    scene = known_address_of(host().omega._sceneObj)
    return all(engine._scene == scene and engine._is_calm() for engine in _registered.values())


def _forget() -> None:
    """The current scene ends."""
    for engine in _here():
        engine._release()


_hooks.sources.append(_here)
_hooks.calm.append(_calm)
_hooks.forgetters.append(_forget)


class BondedEngine:
    """Bonds of some spheres of the scene. Created by :func:`take_over` or :func:`bond`."""

    def __init__(self, name: str, solver: _core.Hosted | None, ids: NDArray[np.int32], kind: dict[str, Any], threads: int | None = None) -> None:
        """`solver`: None for an engine that waits for the bonds (:mod:`._late`)."""
        if name in _registered and _is_in_engines(name):
            raise refuse(f'there already is a bonded engine "{name}"; choose another name', "Name")
        self.name = name
        #: Of the PyRunner in O.engines.
        self.command = _command(name)
        self._threads = threads
        self._scene = 0
        #: The bodies of that scene; None: the engine is in no scene.
        self._held: Any = None
        self.attached = False
        #: Whether the engine is, or should be, in O.engines.
        self._placed = False
        #: The iteration in which the engine must act next.
        self._next = 0
        #: Bonds that had broken before.
        self._broken = 0
        self._have(solver, ids, kind)

    def _have(self, solver: _core.Hosted | None, ids: NDArray[np.int32], kind: dict[str, Any]) -> None:
        """Have these bonds from now on, or wait for bonds."""
        self._solver: Any = solver
        #: Whether YADE has the bonds, of which it makes more.
        self._waits = solver is None
        #: Number of times that the bonds were built anew, after a script has changed them.
        self._rebuilt = 0
        _reading.end(getattr(self, "_mirror", None))
        #: The bonds as objects of YADE, once a script has asked for them.
        self._mirror: Mirror | None = None
        #: When YADE's states were last told what their bodies have lost.
        self._lost_at: Any = None
        #: Ids of the bonded bodies, ascending.
        self.ids = ids
        #: What YADE's states have been told.
        self._lost = np.zeros(0, np.int32) if solver is None else self._lost_now()
        #: Bonded bodies that a script has erased since the bonds were built.
        self._erased: set[int] = set()
        self._kind = kind
        self._update_states = int(kind.get("update_states", 0))
        #: What moves the bodies in place of NewtonIntegrator; None: NewtonIntegrator moves them.
        self._motion = Motion(self) if kind.get("motion") else None
        #: Whether the last check failed.
        self._suspect = False
        #: Whether the bonds are in YADE's own container: for a script that reads them, or because the engine waits.
        self._shown = self._waits

    @property
    def solver(self) -> _core.Hosted:
        """The assembly in our solver."""
        if self._solver is None:
            _late.refuse_waiting(self._title)
        if self._mirror is not None and self._mirror.out:
            self._follow(self._mirror)
        found: _core.Hosted = self._solver
        return found

    # -- in and out of the scene ------------------------------------------------------------------------------------

    def _attach_solver(self) -> None:
        yade = host()
        layout = yade.layout
        scene = address_of(yade.omega._sceneObj)
        container = memory.pointer(scene + layout["Scene.bodies"])
        fields = ("Body.state", "State.pos", "State.vel", "State.angVel", "State.ori", "State.blockedDOFs")
        self._solver.attach(container + layout["bodies.vector"], scene + layout["Scene.forces"], [layout[f] for f in fields])
        self._place(scene, container)

    def _place(self, scene: int, container: int) -> None:
        """The scene and its bodies, by their addresses."""
        self._scene, self._container = scene, container
        # While this exists, YADE puts no other container at that address.
        self._held = host().omega.bodies

    def _attach(self) -> None:
        yade = host()
        self._attach_solver()
        # In the next step if a PyRunner takes over in this one.
        self._next = yade.omega.iter + (yade.omega.subStep >= 0)
        self._watch()
        _registered[self.name] = self
        self.attached = True
        _hooks.install()

    def mirror(self) -> Mirror:
        """The bonds as objects of YADE."""
        if self._mirror is None:
            self._mirror = Mirror(lambda: self, lambda: (self._rebuilt, self._solver.steps), parameters=True)
        return self._mirror

    def has_body(self, number: int) -> bool:
        """Whether a body belongs to this engine."""
        place = int(np.searchsorted(self.ids, number))
        return place < len(self.ids) and int(self.ids[place]) == number and number not in self._erased

    @property
    def moves_bodies(self) -> bool:
        """Whether it moves its bodies in place of NewtonIntegrator."""
        return self._motion is not None and self._motion.active

    @property
    def is_concrete(self) -> bool:
        """Whether the bonds have the law of YADE's concrete."""
        return bool(self._kind["kind"] == "concrete")

    @property
    def law(self) -> str:
        """YADE's law that the bonds have; empty if YADE does not have it."""
        return _interactions.LAWS.get(self._kind["kind"], "")

    @property
    def lends(self) -> bool:
        """Whether the bonds can be lent to engines of YADE that read interactions."""
        return bool(self.law)

    def update_lost(self) -> None:
        """Tell YADE's states how many bonds and contacts their bodies have lost."""
        if self._waits:
            return
        moment = (self._rebuilt, self._solver.steps)
        if not self.is_concrete or moment == self._lost_at:
            return
        self._lost_at = (self._rebuilt, self.solver.steps)
        lost = self._lost_now()
        there = self._bodies_now() == self._bodies
        state = gather(np.ascontiguousarray(self._bodies[there]), "Body.state", "u64")
        # YADE itself counts contacts with other bodies.
        add_to_lost(state, (lost - self._lost)[there])
        self._lost = lost

    def _lost_now(self) -> Ints:
        """Numbers of bonds and contacts that the bodies have lost, in the order of `ids`."""
        bonds, openings = self._solver.losses()
        lost = np.zeros(len(self.ids), np.int32)
        lost[np.searchsorted(self.ids, self._solver.bodies()["id"])] = bonds + openings
        return lost

    def refuse_erasing(self) -> None:
        """Raise YadeError if bonds cannot be erased."""
        _rules.refuse_erasing(self._title, bool(self.law))

    def _follow(self, mirror: Mirror) -> None:
        """Build the bonds anew if a script has changed or erased some of them in O.interactions, or erased bodies."""
        if not mirror.changed() and not self._erased:
            return
        self.update_lost()
        before, ids = self._solver, self.ids[~np.isin(self.ids, list(self._erased))]
        try:
            with self._as_yades():
                if self.is_concrete:
                    concrete = Concrete(ids, late=True)
                    self._solver = concrete.anew(mirror.interactions(), self._kind, before, self._threads)
                    assert concrete.own is not None
                    self._kind.update(concrete.own.kind())
                else:
                    self._solver = Spheres(self._kind["kind"], ids).anew(mirror.interactions(), self._threads)
                self._attach_solver()
        except BaseException:
            mirror.out = True  # so that the next step asks again
            raise
        mirror.followed()
        self._rebuilt += 1
        self._broken += before.broken
        if self._erased:
            self.ids, self._erased = ids, set()
            self._watch()
        self._lost = self._lost_now()
        if self._motion is not None and self._motion.active:
            self._motion._share()
        # The next check looks at O.engines again, and tells the solver.
        self._suspect = True

    def before_erasing(self, number: int) -> None:
        """Erase the bonds of a body that a script is about to erase; the engine goes on without it."""
        at_rest()
        _rules.refuse_shown(self._shown, self._title)
        if not self.law:
            raise refuse(
                f"body {number} belongs to {self._title}, whose bonds follow a law that stock YADE does not have, so it cannot be erased; "
                "call remove() before, or leave the body out by `ids` of bond()",
                "Bodies",
            )
        if len(self.ids) == len(self._erased) + 1:
            raise refuse(f"body {number} is the last one of {self._title}; call remove() before you erase it", "Bodies")
        mirror = self.mirror()
        for contact in mirror.of_body(number):
            mirror.erase(contact.id1, contact.id2)
        mirror.out = True
        self._erased.add(number)

    def _bodies_now(self) -> NDArray[np.uint64]:
        """Addresses of the bodies, 0 for one that was deleted."""
        every = _core.memory_targets(self._container + host().layout["bodies.vector"])
        found = np.zeros(len(self.ids), np.uint64)
        inside = self.ids < len(every)
        found[inside] = every[self.ids[inside]]
        return found

    def _is_here(self) -> bool:
        """Whether the scene at this address still is the one with the bonded bodies."""
        if self._held is None or known_pointer(self._scene + host().layout["Scene.bodies"]) != self._container:
            self._held = None  # the scene has ended, and never comes back
            return False
        return not self._waits or _is_in_engines(self.name)

    def _facts_of_bodies(self) -> tuple[NDArray[np.uint64], Reals]:
        """Addresses of the materials, and radii."""
        return gather(self._bodies, "Body.material", "u64"), gather(gather(self._bodies, "Body.shape", "u64"), "Sphere.radius")

    def _watch(self) -> None:
        """Remember what must not change."""
        omega = host().omega
        self._bodies = self._bodies_now()
        self._materials, self._radii = self._facts_of_bodies()
        self._watched: list[Any] = []
        if self.law:
            _, first = np.unique(self._materials, return_index=True)
            self._watched = [omega.bodies[int(self.ids[k])].material for k in np.sort(first)]
        self._settings = _rules.settings(omega.engines, self._watched) if self._watched else {}

    @property
    def _title(self) -> str:
        return f'the bonded engine "{self.name}" (a PyRunner)'

    def check_engines(self, engines: list[Any]) -> None:
        """Raise YadeError unless the engine works in these engines."""
        mine = [k for k, engine in enumerate(engines) if getattr(engine, "command", "") == self.command]
        if not any(_rules.is_a(engine, "InteractionLoop") for engine in engines):
            raise refuse(f"O.engines has no InteractionLoop, behind which {self._title} acts; add it, or delete the bonds (remove())", "Engines")
        _rules.refuse_idle_loop(engines, self._title)
        _rules.refuse_order(engines, mine, self._title)
        _rules.refuse_blind_engines(engines, lends=self.lends)
        _rules.refuse_collider(engines, self._kind.get("mask", 0), self._title)
        if self._motion is not None and self._motion.active:
            self._motion.check_engines(engines, mine[0])

    def check(self, deep: bool) -> None:
        """Raise YadeError unless the engine is in its place in O.engines and has acted in every step; `deep`: and unless the settings
        and bodies are those of the take-over. From when on YADE makes more bonds, the engine waits."""
        if self._waits:
            if host().omega.subStep < 0 and is_at_rest():
                _late.end_if_due(self)
            return
        _rules.refuse_shown(self._shown, self._title)
        omega = host().omega
        deep = deep or self._suspect
        if deep or not self.solver.undisturbed():
            self._suspect = True
            if self._motion is not None and self._motion.active:
                self._motion.adopt()
            self.check_engines(_lending.working_engines())
            self.solver.watch(self._scene + host().layout["Scene.engines"], host().layout["Engine.dead"])
        _rules.refuse_skipped(self._next, omega.iter, self._title)
        if deep:
            late = self.is_concrete and _late.may_begin(self) and is_at_rest() and bool(_late.why())
            self._check_settings(late)
            if late:
                _late.begin(self)
                return
        self._suspect = False

    def _is_calm(self) -> bool:
        """Whether a check that is not deep would find nothing new."""
        changed = self._mirror is not None and self._mirror.out
        return self._placed and not changed and not self._suspect and not self._shown and self._solver.undisturbed() and self._is_here()

    def _check_settings(self, late: bool = False) -> None:
        """`late`: the engine is about to wait for bonds that YADE makes."""
        omega = host().omega
        if self._settings:
            now = _rules.settings(omega.engines, self._watched)
            if late:
                now.pop(_rules.DISTANCE, None)
            else:
                _rules.refuse_later_bonds(omega.engines, omega.iter, self._title)
            _rules.refuse_changes(self._settings, now, self._title)
        if omega.periodic and getattr(omega.cell, "flipFlippable", False):
            raise refuse("O.cell.flipFlippable=True exchanges the periodic images of the bonds, which a bonded engine keeps; set it to False", "Periodic")
        if (self._bodies_now() != self._bodies).any():
            return  # the next step reports it
        if self._motion is not None and self._motion.active:
            self._motion.check()
        _rules.refuse_collider(omega.engines, self._kind.get("mask", 0), self._title)
        masks = gather(self._bodies, "Body.groupMask", "i32")
        if (unmasked := np.flatnonzero(masks & self._kind.get("mask", 0) != self._kind.get("mask", 0))).size:
            _rules.refuse_mask(int(self.ids[unmasked[0]]), int(masks[unmasked[0]]), self._kind["mask"], self._title)
        if self._kind.get("mask"):
            _rules.refuse_apart(omega.engines, np.unique(masks & ~self._kind["mask"]).tolist(), self._kind["mask"], self._title)
        materials, radii = self._facts_of_bodies()
        if self._settings and (materials != self._materials).any():
            _rules.refuse_material(int(self.ids[materials != self._materials][0]), self._title)
        if (radii != self._radii).any():
            k = int(np.flatnonzero(radii != self._radii)[0])
            _rules.refuse_radius(int(self.ids[k]), float(self._radii[k]), float(radii[k]), self._title)

    def _insert(self) -> None:
        """Put the engine after InteractionLoop in O.engines."""
        yade = host()
        engines = list(yade.omega.engines)
        place = next(k for k, engine in enumerate(engines) if class_of(engine) == "InteractionLoop") + 1
        runner = yade.wrapper.PyRunner(command=self.command, iterPeriod=1, initRun=True, firstIterRun=0)
        yade.omega.engines = engines[:place] + [runner] + engines[place:]

    def _mask(self) -> None:
        """Exclude contacts between the bodies from YADE's collider."""
        omega = host().omega
        everything = bodies()
        masks = gather(everything.address, "Body.groupMask", "i32")
        mine = np.isin(everything.ids, self.ids)
        distinct = np.unique(masks[mine])
        if len(distinct) != 1:
            raise refuse(f"the bodies have {len(distinct)} different groupMasks; give all bonded bodies the same", "Masks")
        collider = engine_of("InsertionSortCollider")
        used = int(np.bitwise_or.reduce(masks)) | collider.avoidSelfInteractionMask
        bit = free_bit(used)
        for number in self.ids:
            omega.bodies[int(number)].groupMask = int(distinct[0]) | bit
        collider.avoidSelfInteractionMask |= bit
        self._kind["mask"] = bit
        if self.law and self._mirror is None and (kept := _interactions.kept_between(self.ids)):
            self.mirror().adopt(kept)
        _interactions.clear_between(self.ids)
        sort_anew()

    def remove(self) -> None:
        """Remove the engine from O.engines and delete its bonds; YADE handles contacts between the bodies again. To keep the bonds, use
        :meth:`give_back`."""
        self._take_out()
        self._release()

    def _take_out(self) -> None:
        """Remove the engine from O.engines and from the collider's mask."""
        yade = host()
        if self._is_here():
            self.update_lost()
        if self._motion is not None and self._motion.active:
            self._motion.end()
        self._placed = False
        yade.omega.engines = [e for e in yade.omega.engines if getattr(e, "command", "") != self.command]
        bit = self._kind.get("mask", 0)
        if bit:
            for number in self.ids:
                body = yade.omega.bodies[int(number)]
                if body is not None:  # it may have been deleted
                    body.groupMask &= ~bit
            collider = engine_of("InsertionSortCollider")
            collider.avoidSelfInteractionMask &= ~bit
            sort_anew()

    def hand_over_objects(self) -> None:
        """Let the objects that a script has kept share what YADE has got."""
        if self._mirror is not None:
            self._mirror.hand_over()

    def _put_in(self) -> None:
        """Undo :meth:`_take_out`."""
        if self._motion is not None:
            self._motion.begin()
        self._mask()
        self._insert()
        self._next = host().omega.iter + (host().omega.subStep >= 0)
        self._placed = True
        host().omega.engines = host().omega.engines

    def _as_yades(self) -> AbstractContextManager[None]:
        """Within this, the scene looks as if YADE moved the bodies."""
        return self._motion.suspended() if self._motion is not None and self._motion.active else contextlib.nullcontext()

    def _release(self) -> None:
        _reading.end(self._mirror)
        _registered.pop(self.name, None)
        self._held = None
        self.attached = False

    # -- for YADE and its scripts ---------------------------------------------------------------------------------------

    def give_back(self) -> dict[str, int]:
        """Remove the engine from O.engines, and return its bonds and contacts to YADE as interactions with their histories. YADE goes on
        with its own law, from the same forces and energies if the engine had YADE's (`mode="yade-public"`).

        Returns the numbers of interactions `made`, `erased`, and `written`. For :func:`take_over` only; stock YADE does not have the laws
        of :func:`bond`. Takes some 0.1 ms per bond. If YADE cannot store a contact, the error leaves the engine as it was.
        """
        return _interactions.give_back(self)

    def interactions(self) -> AbstractContextManager[None]:
        """Show the bonds and contacts of the last step as interactions, so that scripts and engines of YADE can read them:

        >>> with engine.interactions():                         # doctest: +SKIP
        ...     print(sum(i.phys.normalForce.norm() for i in O.interactions))
        ...     recorder()                                      # a VTKRecorder(dead=True, multiblock=True) in O.engines

        Within the block, O.interactions contains them, and functions of YADE that read it work as usual; a step is refused. For bonds of
        :func:`take_over`, all attributes are those of YADE's law. For bonds of :func:`bond`, the functors of the scene make the
        interactions, which get the normal, the distance, and the normal and shear force of the bond; other attributes (stiffnesses,
        moments) are those of the functors. Takes some 0.1 ms per bond.
        """
        return _interactions.shown(self)

    def write_vtk(self, prefix: str | os.PathLike[str]) -> list[str]:
        """Write the bonds and contacts to `PREFIX-intrs.ITER.vtp` and the spheres to `PREFIX-spheres.ITER.vtu`, as YADE's VTKRecorder
        names them; returns the paths.

        Lines have `forceN` (N, positive in compression, as in VTKRecorder), `absForceT`, `forceT` (on the second body, N), `moment`
        (N m), `damage`, `bonded`, `law`, `length`, `id1`, `id2`. A contact across a periodic border is a line to the image of the second
        sphere. Spheres have `radii`, `id`, `linVelVec`, `angVelVec`, `damage` (mean of the bonds).

        >>> PyRunner(command="engine.write_vtk('out/wall')", iterPeriod=100)         # doctest: +SKIP
        """
        return _vtk.write(self, os.fspath(prefix))

    # -- every step --------------------------------------------------------------------------------------------------

    def _wait(self, broken: int) -> None:
        """Wait for bonds that YADE makes; it has those of the engine already, of which `broken` had broken."""
        self._broken = broken
        self._have(None, np.zeros(0, np.int32), {name: value for name, value in self._kind.items() if name != "mask"})
        self._stand_by()

    def _stand_by(self, insert: bool = True) -> None:
        """Be in O.engines, registered, without bonds; `insert`: it is not there yet."""
        yade = host()
        scene = address_of(yade.omega._sceneObj)
        self._place(scene, memory.pointer(scene + yade.layout["Scene.bodies"]))
        _registered[self.name] = self
        self.attached = True
        _hooks.install()
        if insert:
            self._insert()
        self._placed = True
        yade.omega.engines = yade.omega.engines

    def _step(self) -> None:
        yade = host()
        omega = yade.omega
        if self._waits:
            _late.end_if_due(self)
            return
        scene = known_address_of(omega._sceneObj)
        if scene != self._scene or known_pointer(scene + yade.layout["Scene.bodies"]) != self._container:
            raise YadeError(f'the bonded engine "{self.name}" belongs to another scene; remove it from O.engines', "OtherScene")
        now: int = omega.iter
        if now > self._next or now % 64 == 0 or self._suspect or self._shown or not self.solver.undisturbed():
            self.check(deep=now % 64 == 0)
        dt: float = omega.dt
        solver = self.solver
        most = self._steps_at_once(now, dt) if self._motion is not None and self._motion.active else 1
        done, failed, steps = 1, None, solver.steps
        try:
            if most > 1:
                done, failed = solver.contact_steps(dt, most)
            elif solver.contact_step(dt, cell_of(omega) if omega.periodic else None):
                # As if NewtonIntegrator had found such a body.
                ctypes.c_bool.from_address(scene + yade.layout["Scene.doSort"]).value = True
        except (RuntimeError, ValueError) as error:
            raise YadeError(f'the bonded engine "{self.name}" at iteration {now}: {error}', "Step") from error
        if done > 1 or failed:
            # YADE itself counts the present step.
            now += done - (failed is None)
            self._count_cracks(omega.iter, steps)
            add_to_clock(now - omega.iter, dt)
        else:
            self._count_cracks(now, steps)
        self._next = now + 1
        if failed:
            raise YadeError(f'the bonded engine "{self.name}" at iteration {now}: {failed}', "Step")
        if self._update_states and now % self._update_states == 0:
            self.update_states()

    def _count_cracks(self, first: int, before: int) -> None:
        """Tell YADE's law of cracks. `first`: the iteration of the step of the solver after `before` ones."""
        if self._kind["kind"] == "jointed":
            count_cracks(self._solver, first, before)

    def _steps_at_once(self, now: int, dt: float) -> int:
        assert self._motion is not None
        most = self._motion.steps_at_once(now, dt)
        if self._update_states:
            most = min(most, -now % self._update_states + 1)
        return most

    # -- results ------------------------------------------------------------------------------------------------------

    @property
    def bond_count(self) -> int:
        """Number of intact bonds."""
        return self.solver.bond_count

    @property
    def broken(self) -> int:
        """Number of bonds broken since the engine was created."""
        return self.solver.broken + self._broken

    def contacts(self) -> dict[str, NDArray[np.void]]:
        """Tables of bonds by law and of `unbonded` contacts, with their histories; `a` and `b` are body ids."""
        return self.solver.contacts()

    def temperatures(self) -> tuple[NDArray[np.uint32], Reals]:
        """Ids of the bodies, and their temperatures, K. Only with `[heat]` in the scenario of :func:`bond`."""
        temperatures = self.solver.temperatures
        if temperatures is None:
            raise ValueError("no heat flows; give a scenario with [heat] to bond()")
        return self.solver.bodies()["id"], temperatures

    def forces(self) -> tuple[Reals, Contacts]:
        """Positions of the particles, m, (n, 3), and contacts with the forces of the last step, for :mod:`concordem.operators`.

        Positions and branch vectors are the present ones, as in YADE's operators; while YADE runs in another thread, those of the last
        step.
        """
        return self.solver.forces(bodies_stand())

    def stress_sum(self) -> Reals:
        """`Σ l⊗f` over all bonds and contacts, J, first index the branch vector, (3, 3)."""
        x, contacts = self.forces()
        return operators.region_stress(x, contacts, operators.Region.all(1.0)).stress

    def stress(self, volume: float | None = None) -> Reals:
        """Stress of the periodic cell, or of a body of this volume (m^3), from bonds and contacts, Pa, tension positive, (3, 3): the
        transpose of what YADE's getStress(volume) gives."""
        cell = self.solver.cell
        if volume is None:
            if cell is None:
                raise ValueError("the volume is missing; give stress(volume), which only a periodic scene can omit")
            volume = abs(float(np.linalg.det(cell[0])))
        return self.stress_sum() / volume

    def update_states(self) -> None:
        """Write damage, broken bonds, and stress of the particles to YADE's CpmState, as CpmStateUpdater does."""
        write_states(self.solver)
        self.update_lost()


def engines() -> list[BondedEngine]:
    """The bonded engines of the current scene."""
    return _here()
