"""Checks around functions of YADE while a scene has bonded engines, so that no bond is lost without a word.

A bonded engine cannot notice that it does not act any more. Therefore `O.run`, `O.step`, and `O.wait` ask every engine of the
scene whether all is as it needs, and so does an assignment to O.engines during a run. O.interactions and functions that read it answer with
the bonds (:mod:`._container`). Scenes without bonded engines are not affected.
"""

from __future__ import annotations

import contextlib
import contextvars
import functools
import os
import sys
import tempfile
import threading
from typing import Any, Callable, Iterator, Protocol, Sequence

import numpy as np

from .._errors import YadeError
from . import _container, _lending, _pause, _rules
from ._container import lent
from ._interactions import LAWS
from ._mirror import Mirror
from ._scene import is_at_rest


class Bonded(Protocol):
    """A bonded engine of the current scene, in either form."""

    #: Whether the bonds are in O.interactions now.
    _shown: bool
    #: Of the PyRunner that computes the bonds, which scripts do not see in O.engines; empty if the engine itself stands there.
    command: str

    @property
    def moves_bodies(self) -> bool:
        """Whether it moves its bodies in place of NewtonIntegrator."""

    def check(self, deep: bool) -> None:
        """Raise YadeError unless the scene is as the engine needs it; `deep`: settings and bodies, too."""

    def check_engines(self, engines: list[Any]) -> None:
        """Raise YadeError unless the engine works in O.engines."""

    def stress_sum(self) -> Any:
        """`Σ l⊗f` over all contacts, J, (3, 3)."""

    @property
    def lends(self) -> bool:
        """Whether the bonds can be lent to engines of YADE that read interactions."""

    def mirror(self) -> Mirror:
        """The bonds as objects of YADE."""

    def update_lost(self) -> None:
        """Write to YADE's states how many bonds and contacts their bodies have lost."""

    def refuse_erasing(self) -> None:
        """Raise YadeError if bonds cannot be erased now."""

    def before_erasing(self, number: int) -> None:
        """Let a body go that a script is about to erase, or raise YadeError."""

    def has_body(self, number: int) -> bool:
        """Whether a body belongs to this engine."""

    @property
    def law(self) -> str:
        """YADE's law that the bonds have, so that YADE's functions can read them; empty if YADE does not have it."""


#: Functions that give the bonded engines of the current scene.
sources: list[Callable[[], Sequence[Bonded]]] = []
#: Functions that save the bonds next to the file of a scene, and that load them.
savers: list[Callable[[str], Any]] = []
loaders: list[Callable[[str], Any]] = []
#: Functions that tell, quickly, whether the current scene needs no check before a step: nothing is there, or nothing has changed since the last one.
calm: list[Callable[[], bool]] = []
#: Functions that put other checks in place; they get the module of YADE's classes.
installers: list[Callable[[Any], Any]] = []
#: Functions that forget what belongs to scenes that end.
forgetters: list[Callable[[], Any]] = []
_plain = contextvars.ContextVar("plain", default=False)
#: Folder of the scenes that O.saveTmp keeps.
_folder: tempfile.TemporaryDirectory[str] | None = None
#: The error that stopped the last run.
_failed: YadeError | None = None
_installed = False

#: Functions of YADE in C++ that read interactions: they find the bonds of concrete. Those of bond() have laws that they do not know.
READING_FUNCTIONS = (
    *("bodyNumInteractionsHistogram", "bodyStressTensors", "fabricTensor", "forcesOnCoordPlane"),
    *("forcesOnPlane", "getCapillaryStress", "getStressAndTangent", "getStressProfile", "getStressProfile_contact"),
    *("interactionAnglesHistogram", "intrsOfEachBody", "maxOverlapRatio", "normalShearStressTensors", "numIntrsOfEachBody", "sumFacetNormalForces"),
    *("stressTensorOfPeriodicCell", "totalForceInVolume", "unbalancedForce"),
)
#: Laws of bonds that the methods of a law read; "": those of bond(), for which they are refused. Methods of all other laws find no bonds: some take every
#: interaction for one of theirs, which can end the process.
METHODS_OF_LAWS = {
    "Law2_ScGeom_CpmPhys_Cpm": ("", "Law2_ScGeom_CpmPhys_Cpm"),
    "Law2_ScGeom6D_CohFrictPhys_CohesionMoment": ("", "Law2_ScGeom6D_CohFrictPhys_CohesionMoment"),
    "Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM": ("", "Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM"),
    # They read every FrictPhys.
    "Law2_ScGeom_FrictPhys_CundallStrack": ("Law2_ScGeom6D_CohFrictPhys_CohesionMoment",),
    "Law2_ScGeom_FrictViscoPhys_CundallStrackVisco": ("Law2_ScGeom6D_CohFrictPhys_CohesionMoment",),
    "Law2_PolyhedraGeom_PolyhedraPhys_Volumetric": ("Law2_ScGeom6D_CohFrictPhys_CohesionMoment",),
}


def bonded() -> list[Bonded]:
    """The bonded engines of the current scene."""
    return [engine for source in sources for engine in source()]


def _hidden() -> list[Bonded]:
    """The bonded engines whose bonds are not in O.interactions."""
    _lending.settle()
    return [engine for engine in bonded() if not engine._shown]


@contextlib.contextmanager
def plain() -> Iterator[None]:
    """Within this, YADE's own save and load do not look for bonds."""
    before = _plain.set(True)
    try:
        yield
    finally:
        _plain.reset(before)


def _with_bonds(function: Any, path_of: Callable[..., str], use: list[Callable[[str], Any]]) -> Any:
    """A function of YADE that saves or loads a scene, and the bonds next to the file `path_of(arguments)`."""

    @functools.wraps(function)
    def checked(self: Any, *arguments: Any, **named: Any) -> Any:
        _lending.settle()
        if use is savers:
            if path_of is _file:
                refuse_missing_folder(path_of(self, *arguments, **named))
            for engine in _hidden() if is_at_rest() else []:
                engine.update_lost()
        found = function(self, *arguments, **named)
        if not _plain.get():
            for one in use:
                one(path_of(self, *arguments, **named))
        return found

    return checked


def refuse_missing_folder(path: str) -> None:
    """Raise YadeError if the folder of a file to be saved does not exist. YADE itself then hangs, or, with small scenes, silently saves nothing."""
    folder = os.path.dirname(os.path.abspath(path))
    if not os.path.isdir(folder):
        raise _rules.refuse(f"O.save: the folder {folder} does not exist; create it, or choose another folder", "NoFolder")


def _file(_omega: Any, file: str, *_arguments: Any, **_named: Any) -> str:
    return str(file)


def _file_of_mark(_omega: Any, mark: str = "", *_arguments: Any, **_named: Any) -> str:
    global _folder
    if _folder is None:
        _folder = tempfile.TemporaryDirectory(prefix="concordem-")
    return os.path.join(_folder.name, f"mark-{mark.encode().hex()}")


def _last_file(omega: Any, *_arguments: Any, **_named: Any) -> str:
    name, memory = str(omega.filename), ":memory:"
    return _file_of_mark(omega, name[len(memory) :]) if name.startswith(memory) else name


def check(deep: bool = True) -> None:
    """Raise YadeError unless all bonded engines of the scene are in order."""
    for engine in bonded():
        engine.check(deep)


def one_line(error: YadeError) -> YadeError:
    """Remember an error that stops the run, for :func:`_raised`, and keep YADE's log from repeating its traceback."""
    global _failed
    _failed = error
    _quiet(True)
    return error.with_traceback(None)


def _quiet(quiet: bool) -> None:
    """Hide or show what YADE logs when an engine fails."""
    try:
        from yade import log
    except ImportError:
        return
    for name in ("ThreadRunner", "yadeWrapper.cpp"):
        try:
            if quiet:
                log.setLevel(name, log.NOFILTER)
            else:
                log.unsetLevel(name)
        except Exception:  # a YADE without this logger
            return


def _raised(call: Callable[[], Any]) -> Any:
    """Call a function of YADE; if one of our engines stopped it, raise its error instead of YADE's text of many lines."""
    global _failed
    try:
        found = call()
    except RuntimeError as error:
        ours, _failed = _failed, None
        _quiet(False)
        if ours is not None and str(ours) in str(error):
            raise ours.with_traceback(None) from None
        raise
    ours, _failed = _failed, None
    if ours is not None:
        _quiet(False)
        raise ours.with_traceback(None) from None
    return found


def _hook(error_type: Any, error: Any, trace: Any, previous: Any) -> None:
    if _failed is not None and error is _failed:
        print(f"concordem: {error}", file=sys.stderr)
    else:
        previous(error_type, error, trace)


def replace_everywhere(name: str, old: Any, new: Any) -> None:
    """Replace a function of YADE in every module that has imported it; scripts import all names."""
    for module in list(sys.modules.values()):
        space = getattr(module, "__dict__", None)
        if isinstance(space, dict) and space.get(name) is old:
            space[name] = new


def install() -> None:
    """Put the checks in place; once."""
    global _installed
    if _installed:
        return
    _installed = True
    import yade.utils
    import yade.wrapper

    omega = yade.wrapper.Omega
    run, step, wait, engines = omega.run, omega.step, omega.wait, omega.engines

    @functools.wraps(run)
    def checked_run(self: Any, nSteps: int = -1, wait: bool = False) -> Any:
        if not self.running:
            _lending.settle()
            _raised(lambda: None)
            check()
        found = _raised(lambda: run(self, nSteps, wait))
        if wait:
            check()
        return found

    @functools.wraps(step)
    def checked_step(self: Any) -> Any:
        # The engines read settings and bodies in their own steps, now and then.
        if not all(is_calm() for is_calm in calm):
            check(deep=False)
        _pause.stepping = threading.get_ident()
        try:
            return _raised(lambda: step(self))
        finally:
            _pause.stepping = None
            _lending.settle()

    @functools.wraps(wait)
    def checked_wait(self: Any) -> Any:
        found = _raised(lambda: wait(self))
        check()
        return found

    def get(self: Any) -> Any:
        return _lending.of_script(engines.fget(self))

    def assign(self: Any, new: Any) -> None:
        new = list(new)
        engines.fset(self, _lending.with_ours(new))
        if self.running and bonded():
            working = _lending.working_engines()
            for engine in bonded():
                engine.check_engines(working)

    omega.run, omega.step, omega.wait = checked_run, checked_step, checked_wait
    for name, path_of, use in (
        ("save", _file, savers),
        ("saveTmp", _file_of_mark, savers),
        ("load", _file, loaders),
        ("loadTmp", _file_of_mark, loaders),
        ("reload", _last_file, loaders),
    ):
        setattr(omega, name, _with_bonds(getattr(omega, name), path_of, use))
    for name in ("reset", "resetThisScene", "resetCurrentScene", "resetAllScenes"):
        setattr(omega, name, _forgetting(getattr(omega, name)))
    omega.resetTime = _refusing("O.resetTime()", omega.resetTime, _TO_ZERO)
    _dead_integrator(yade.wrapper)
    omega.engines = property(get, assign, None, engines.__doc__)
    _lending.owners = lambda: [engine for engine in bonded() if not engine._shown]
    _lending.commands = lambda: {engine.command for engine in bonded() if engine.command}
    _lending.raw_engines = lambda: engines.fget(yade.wrapper.Omega())
    call, run_engine = yade.wrapper.Engine.__call__, omega.runEngine
    yade.wrapper.Engine.__call__ = functools.wraps(call)(lambda self: _called(self, lambda: call(self)))
    omega.runEngine = functools.wraps(run_engine)(lambda self, engine: _called(engine, lambda: run_engine(self, engine)))
    previous = sys.excepthook
    sys.excepthook = lambda error_type, error, trace: _hook(error_type, error, trace, previous)
    for name in READING_FUNCTIONS:
        function = getattr(yade.utils, name, None)
        if function is not None:
            replace_everywhere(name, function, _reading(f"{name}()", function))
    why = "lists the bodies whose bounds overlap, which it does not search between bonded bodies; use O.bodies[i].intrs()"
    replace_everywhere("getBodyIdsContacts", yade.utils.getBodyIdsContacts, _refusing("getBodyIdsContacts()", yade.utils.getBodyIdsContacts, why))
    replace_everywhere("getStress", yade.utils.getStress, _stress(yade.utils.getStress))
    replace_everywhere("createInteraction", yade.utils.createInteraction, _creating(yade.utils.createInteraction))
    for name in dir(yade.wrapper):
        kind = getattr(yade.wrapper, name)
        reads = name in METHODS_OF_LAWS or name in ("TesselationWrapper", "TriaxialStressController")
        for method, function in list(vars(kind).items()) if reads or name.startswith("Law2_") else ():
            if reads and not method.startswith("_") and type(function).__name__ == "function":
                setattr(kind, method, _reading(f"{name}.{method}()", function, METHODS_OF_LAWS.get(name)))
            elif isinstance(function, staticmethod):
                setattr(kind, method, staticmethod(_refusing(f"{name}.{method}()", function.__func__)))
    cohesion = yade.wrapper.Ip2_CohFrictMat_CohFrictMat_CohFrictPhys
    if hasattr(cohesion, "setCohesion"):
        cohesion.setCohesion = _filling(cohesion.setCohesion)
    _container_of_bonds(yade.wrapper)
    _lost_of_states(yade.wrapper.CpmState)
    _joints_of_states(yade.wrapper.JCFpmState)
    for one in installers:
        one(yade.wrapper)
    _bodies_that_change(yade.wrapper.BodyContainer)
    replace_everywhere("flipCell", yade.utils.flipCell, _flipping(yade.utils.flipCell))
    if hasattr(yade.wrapper.Cell, "flipCell"):
        yade.wrapper.Cell.flipCell = _flipping(yade.wrapper.Cell.flipCell)


def _forgetting(function: Any) -> Any:
    """A function of YADE that deletes scenes."""

    @functools.wraps(function)
    def with_bonds(*arguments: Any, **named: Any) -> Any:
        for forget in forgetters:
            forget()
        return function(*arguments, **named)

    return with_bonds


def _container_of_bonds(wrapper: Any) -> None:
    """Let `O.interactions` and `Body.intrs()` have the bonds."""
    _container.install(wrapper.InteractionContainer, _hidden)
    intrs = wrapper.Body.intrs

    @functools.wraps(intrs)
    def with_bonds(self: Any) -> Any:
        found = intrs(self)
        for engine in _hidden():
            found = engine.mirror().of_body(self.id) + found
        return found

    wrapper.Body.intrs = with_bonds


def _bodies_that_change(container: Any) -> None:
    """Let bonded engines follow erased bodies, and refuse that their bodies enter or leave clumps."""
    erase = container.erase

    @functools.wraps(erase)
    def erasing(self: Any, id: int, eraseClumpMembers: bool = False) -> bool:
        engines, body = bonded(), self[id] if 0 <= id < len(self) else None
        if engines and body is not None:
            members = body.shape.members if eraseClumpMembers and body.isClump else {}
            for number in (id, *members):
                for engine in engines:
                    if engine.has_body(number):
                        engine.before_erasing(number)
        return bool(erase(self, id, eraseClumpMembers))

    container.erase = erasing
    for name in ("clump", "addToClump", "releaseFromClump", "deleteClumpMember", "deleteClumpBody", "replaceByClumps"):
        setattr(container, name, _clumping(name, getattr(container, name)))


def _numbers(values: Any) -> Iterator[int]:
    """The ids of bodies among arguments, with the members of clumps."""
    for value in values:
        if isinstance(value, (list, tuple)):
            yield from _numbers(value)
        elif isinstance(value, int) and not isinstance(value, bool):
            yield value


def _clumping(name: str, function: Any) -> Any:
    """A function that changes which bodies are in clumps."""

    @functools.wraps(function)
    def checked(self: Any, *arguments: Any, **named: Any) -> Any:
        for engine in bonded():
            given = set(_numbers([*arguments, *named.values()]))
            for body in [self[number] for number in given if 0 <= number < len(self)]:
                given |= set(body.shape.members) if body is not None and body.isClump else set()
            touched = sorted(number for number in given if engine.has_body(number))
            if touched or name == "replaceByClumps":
                which = f"body {touched[0]} belongs" if touched else "some spheres belong"
                raise _rules.refuse(
                    f"O.bodies.{name}(): {which} to a bonded engine, which cannot follow a change of clumps; call give_back() before, and "
                    "take_over() after it",
                    "Clumps",
                )
        return function(self, *arguments, **named)

    return checked


def _flipping(function: Any) -> Any:
    """flipCell, which exchanges the images of all contacts."""

    @functools.wraps(function)
    def checked(*arguments: Any, **named: Any) -> Any:
        if _hidden():
            raise _rules.refuse("flipCell(): a bonded engine keeps the periodic images of its bonds; call give_back() before, and take_over() after it", "Bonded")
        return function(*arguments, **named)

    return checked


def _lost_of_states(state: Any) -> None:
    """Let `CpmState.numBrokenCohesive`, which YADE's law counts, have what the bonded engines have counted."""
    lost = state.numBrokenCohesive

    def get(self: Any) -> int:
        for engine in _hidden():
            engine.update_lost()
        return int(lost.fget(self))

    def put(self: Any, value: int) -> None:
        if _hidden():
            raise _rules.refuse(
                "numBrokenCohesive of a body cannot be set while a bonded engine counts what its bodies lose; set it before take_over()", "Changed"
            )
        lost.fset(self, value)

    state.numBrokenCohesive = property(get, put, None, lost.__doc__)


def _joints_of_states(state: Any) -> None:
    """Refuse that a script puts spheres on a joint, whose next contacts YADE would make by the joint's parameters."""
    joint = state.onJoint

    def put(self: Any, value: bool) -> None:
        if value and any(engine.law == LAWS["jointed"] for engine in _hidden()):
            raise _rules.refuse("onJoint of a body cannot be set while a bonded engine has spheres of JCFpmMat, because joints are not followed; call give_back() before", "Joints")
        joint.fset(self, value)

    state.onJoint = property(joint.fget, put, None, joint.__doc__)


#: Why the clock stays.
_TO_ZERO = (
    "sets the iteration to 0, in which stock YADE takes bonds that were made in iteration 0 for new ones, without strain; call it before take_over(), or "
    "give_back() before, and take_over() after it"
)


def _dead_integrator(wrapper: Any) -> None:
    """Refuse that a script stops a NewtonIntegrator whose bodies a bonded engine moves: it is dead already."""
    dead = wrapper.Engine.dead

    def put(self: Any, value: bool) -> None:
        if value and dead.fget(self) and any(engine.moves_bodies for engine in bonded()):
            raise _rules.refuse(
                "NewtonIntegrator has dead=True because a bonded engine with motion=True moves its bodies, and would go on; end it with give_back() or "
                "remove(), or take over with motion=False",
                "Motion",
            )
        dead.fset(self, value)

    wrapper.NewtonIntegrator.dead = property(dead.fget, put, None, dead.__doc__)


#: Why a method of another law than concrete is refused.
_OF_ITS_LAW = "reads interactions of its law, which bonds do not have; use concordem.operators with the engine's forces()"


def _refusing(name: str, function: Any, why: str = _OF_ITS_LAW) -> Any:
    """A function of YADE that cannot answer beside a bonded engine."""

    @functools.wraps(function)
    def checked(*arguments: Any, **named: Any) -> Any:
        if _hidden():
            raise _rules.refuse(f"{name} {why}", "BlindFunction")
        return function(*arguments, **named)

    return checked


def _reading(name: str, function: Any, laws: Sequence[str] | None = None) -> Any:
    """A function of YADE that reads interactions, and finds the bonds; a method of a law finds those of these `laws`."""

    @functools.wraps(function)
    def with_bonds(*arguments: Any, **named: Any) -> Any:
        hidden = [engine for engine in _hidden() if laws is None or engine.law in laws]
        if not hidden:
            return function(*arguments, **named)
        if not all(engine.law for engine in hidden):
            raise _rules.refuse(
                f"{name} reads the interactions of YADE's laws, but the bonds of bond() have another law; use concordem.operators with the "
                "engine's forces(), or call it within `with engine.interactions():`",
                "BlindFunction",
            )
        with lent(hidden):
            return function(*arguments, **named)

    return with_bonds


def _called(engine: Any, call: Callable[[], Any]) -> Any:
    """An engine that a script calls, with the bonds if it reads interactions."""
    hidden = _hidden()
    if not hidden or not (_rules.is_followed(engine) or _rules.is_blind(engine)):
        return call()
    if not (_rules.is_followed(engine) and all(one.law for one in hidden)):
        _rules.refuse_blind_call(engine)
    for one in hidden:
        one.update_lost()
    with lent(hidden):
        return call()


def _filling(function: Any) -> Any:
    """A function of YADE in C++ that changes an interaction, which may be a bond."""

    @functools.wraps(function)
    def with_values(*arguments: Any, **named: Any) -> Any:
        for engine in _hidden():
            engine.mirror().fill()
        return function(*arguments, **named)

    return with_values


def _creating(function: Any) -> Any:
    """createInteraction that does not add a second force between two bonded bodies."""

    @functools.wraps(function)
    def checked(id1: int, id2: int, *arguments: Any, **named: Any) -> Any:
        for engine in _hidden():
            if engine.has_body(id1) and engine.has_body(id2):
                raise _rules.refuse(
                    f"createInteraction({id1}, {id2}): both bodies belong to a bonded engine, which computes what is between them; call "
                    "give_back() before, and take_over() after it",
                    "Bonded",
                )
        return function(id1, id2, *arguments, **named)

    return checked


def _stress(function: Any) -> Any:
    """getStress that adds the bonds."""

    @functools.wraps(function)
    def with_bonds(volume: float = 0.0) -> Any:
        import yade.wrapper

        found = function(volume)
        engines = _hidden()
        if not engines:
            return found
        omega = yade.wrapper.Omega()
        # YADE's rule for the volume.
        whole = volume or (abs(omega.cell.hSize.determinant()) if omega.periodic else 1.0)
        # YADE's first index is the force.
        of_bonds = np.sum([np.asarray(engine.stress_sum()).T for engine in engines], axis=0) / whole
        return found + type(found)(*(float(x) for x in of_bonds.reshape(-1)))

    return with_bonds
