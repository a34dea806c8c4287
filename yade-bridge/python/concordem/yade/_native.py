"""Finds, checks, and registers the native plugin in the running YADE.

The plugin is a library that was compiled against the headers of exactly this YADE (:mod:`concordem.yade._build`). Its file name
contains a hash of everything that affects the class layout, so another YADE does not find it. Before registration, YADE's Python reads
objects that the plugin wrote; any difference raises :class:`concordem.YadeError`.
"""

from __future__ import annotations

import builtins
import ctypes
import hashlib
import json
import os
import sys
from pathlib import Path
from typing import Any

from .._errors import YadeError
from . import _hooks, _lending, _native_bonds, _rules
from ._interactions import LAWS

#: Classes of the plugin that are written by hand, bases first; those of other laws are generated (:func:`classes`).
CLASSES = (
    "CpmPhys_Rust",
    "Ip2_CpmMat_CpmMat_CpmPhys_Rust",
    "Law2_ScGeom_CpmPhys_Rust",
    "LinearBondMat_Rust",
    "DeformableState_Rust",
    "LinearBondPhys_Rust",
    "Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust",
    "Law2_ScGeom_LinearBondPhys_Rust",
    "DeformableParticles_Rust",
    "BondedEngine_Rust",
)
#: Environment variable with the folder of plugins.
FOLDER = "CONCORDEM_YADE_PLUGINS"

_library: ctypes.PyDLL | None = None


def facts() -> dict[str, Any]:
    """All facts about the running YADE that affect the layout of its classes."""
    try:
        import yade
        from yade import config
    except ImportError as error:
        raise YadeError("the native plugin works only inside YADE; run `yade script.py`", "NotInYade") from error
    try:
        from yade import libVersions

        versions = {name: value[-1] for name, value in libVersions.getAllVersionsCpp().items() if value}
    except (ImportError, AttributeError):
        versions = {}
    assert yade is not None
    libraries = {file.name: file.stat().st_size for file in sorted(Path(config.libDir).glob("*.so"))}
    return {
        "version": str(config.version),
        "revision": str(config.revision),
        "features": sorted(set(config.features)),
        "bits": int(config.highPrecisionBits),
        "python": "%d.%d" % sys.version_info[:2],
        "compiler": versions.get("compiler", ""),
        "boost": versions.get("boost", ""),
        "eigen": versions.get("eigen", ""),
        "libraries": libraries,
    }


def folder() -> Path:
    """Folder of plugins."""
    given = os.environ.get(FOLDER)
    if given:
        return Path(given)
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local/share") / "concordem"


def staged() -> Path:
    """Folder of the compiled library and the shim's sources in the wheel."""
    return Path(__file__).parent / "native"


def classes() -> tuple[str, ...]:
    """All classes of the plugin, bases first."""
    generated = staged() / "classes.txt"
    return (*CLASSES, *(generated.read_text().split() if generated.is_file() else ()))


def stamp() -> str:
    """Hash of the files in :func:`staged`."""
    parts = staged()
    found = hashlib.sha256()
    for file in sorted(parts.glob("*")) if parts.is_dir() else []:
        found.update(file.name.encode())
        found.update(file.read_bytes())
    return found.hexdigest()


def place(of: dict[str, Any]) -> Path:
    """Path of the plugin for a YADE with these facts."""
    text = json.dumps([of, stamp()], sort_keys=True)
    return folder() / f"yade-{of['version']}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.so"


def bundled() -> Path:
    """Folder of the plugins that come with the package."""
    return Path(__file__).parent / "plugins"


def find(of: dict[str, Any]) -> Path:
    """The plugin for a YADE with these facts: one that the user has built, else the one that came with the package; the first place if
    there is none."""
    built = place(of)
    return next((path for path in (built, bundled() / built.name) if path.exists()), built)


def load(path: Path | None = None) -> None:
    """Load the plugin for this YADE and register its classes; scripts can use them without a prefix.

    Raises YadeError if the plugin has not been built or does not match this YADE.
    """
    global _library
    if _library is not None:
        return
    found = facts()
    path = path or find(found)
    if not path.exists():
        raise YadeError(
            f"there is no native plugin for this YADE ({found['version']}, {found['compiler']}) and this concordem; build it "
            f"with `python3 -m concordem.yade build` (looked for {path})",
            "NotBuilt",
        )
    try:
        # Same mode as for YADE's plugins; a PyDLL keeps the interpreter's lock.
        library = ctypes.PyDLL(str(path), mode=ctypes.RTLD_GLOBAL | os.RTLD_NOW)
    except OSError as error:
        raise YadeError(f"the native plugin cannot be loaded: {error}; rebuild it", "Layout") from error
    library.concordem_yade_samples.restype = ctypes.py_object
    library.concordem_yade_register.restype = ctypes.py_object
    library.concordem_yade_register.argtypes = [ctypes.py_object]
    library.concordem_yade_forget_laws.restype = ctypes.py_object
    library.concordem_yade_difference.restype = ctypes.py_object
    library.concordem_yade_difference.argtypes = [ctypes.py_object, ctypes.py_object]
    compare(library.concordem_yade_samples())
    library.concordem_yade_register(list(classes()))
    import yade
    import yade.wrapper

    for name in classes():
        made = getattr(yade.wrapper, name, None)
        if made is None:
            raise YadeError(f"YADE did not register the class {name}; please report this", "Layout")
        setattr(yade, name, made)
        setattr(builtins, name, made)
    _native_bonds.add_methods(yade.wrapper.BondedEngine_Rust)
    library.concordem_yade_abandoned.restype = ctypes.py_object
    _library = library
    _hooks.sources.append(_here)
    _hooks.calm.append(lambda: not _here())
    _hooks.install()


class _Engine:
    """A `BondedEngine_Rust` of the scene, or with `lost` the reason why the scene has lost it."""

    def __init__(self, engine: Any, place: int = -1, lost: str = "") -> None:
        self._engine, self._place, self._lost, self.command = engine, place, lost, ""
        self._shown = engine is not None and _native_bonds.is_shown(engine)

    def check(self, deep: bool) -> None:
        """Raise YadeError unless the engine is in its place and alive; in its steps, it checks the rest itself."""
        self._refuse_lost()
        if not _native_bonds.follow(self._engine):
            return
        _rules.refuse_shown(self._shown, "BondedEngine_Rust")
        _rules.refuse_order(_lending.working_engines(), [self._place], "BondedEngine_Rust")
        if deep:
            self._ask()

    def check_engines(self, engines: list[Any]) -> None:
        """Raise YadeError unless the engine works in O.engines. It checks a new list in its next step."""
        if not any(type(engine).__name__ == "BondedEngine_Rust" for engine in engines):
            _rules.refuse_order(engines, [], "BondedEngine_Rust")

    def interactions(self) -> Any:
        """Show the bonds as interactions."""
        return self._engine.interactions()

    def mirror(self) -> Any:
        """The bonds as objects of YADE."""
        self._refuse_lost()
        return _native_bonds.mirror(self._engine)

    @property
    def moves_bodies(self) -> bool:
        """Whether it moves its bodies: NewtonIntegrator does."""
        return False

    @property
    def lends(self) -> bool:
        """Whether the bonds can be lent: within a step, those of the native engine cannot be read."""
        return False

    def update_lost(self) -> None:
        """Write to YADE's states how many bonds and contacts their bodies have lost."""
        if self.is_concrete:
            _native_bonds.update_lost(self._engine)

    def _refuse_lost(self) -> None:
        if self._lost:
            raise YadeError(self._lost, "EngineLost")

    @property
    def law(self) -> str:
        """YADE's law that the bonds have; empty if YADE does not have it."""
        return LAWS["concrete"] if self.is_concrete else ""

    @property
    def is_concrete(self) -> bool:
        """Whether the bonds have the law of YADE's concrete, so that YADE's functions can read them."""
        self._refuse_lost()
        return not self._engine.scenario

    def has_body(self, number: int) -> bool:
        """Whether a body belongs to this engine."""
        import yade.wrapper

        return not self._lost and bool(yade.wrapper.Omega().bodies[number].groupMask & self._engine.selfMask)

    def before_erasing(self, number: int) -> None:
        """Raise YadeError: the engine cannot go on without a body."""
        raise _rules.refuse(
            f"body {number} belongs to BondedEngine_Rust, which cannot go on without it; call give_back() before you erase it, and takeOver() after it",
            "Bodies",
        )

    def refuse_erasing(self) -> None:
        """Raise YadeError if bonds cannot be erased now."""
        _rules.refuse_erasing("BondedEngine_Rust", self.is_concrete)
        import yade.wrapper

        if yade.wrapper.Omega().subStep >= 0:
            raise _rules.refuse(
                "bonds of BondedEngine_Rust cannot be erased within a step; erase them between two steps, not from a PyRunner", "Changed"
            )

    def _ask(self) -> None:
        try:
            self._engine.check()
        except RuntimeError as error:
            raise YadeError(str(error), "Scene") from None

    def stress_sum(self) -> Any:
        """`Σ l⊗f` over all contacts, J, (3, 3)."""
        found = self._engine.stress(1.0)
        return [[found[i, j] for j in range(3)] for i in range(3)]


def _here() -> list[_hooks.Bonded]:
    """The native bonded engines of the current scene with bonds."""
    engines = enumerate(_lending.working_engines())
    found: list[_hooks.Bonded] = [_Engine(e, k) for k, e in engines if type(e).__name__ == "BondedEngine_Rust" and e.selfMask]
    lost = library().concordem_yade_abandoned()
    return found + [_Engine(None, lost=lost)] if lost else found


def compare(samples: tuple[list[tuple[Any, dict[str, Any]]], dict[str, Any]]) -> None:
    """Raise YadeError unless YADE reads the values that the plugin wrote to objects."""
    import yade.wrapper

    objects, scene = samples
    omega = yade.wrapper.Omega()
    seen = {
        "dt": omega.dt,
        "iter": omega.iter,
        "time": omega.time,
        "periodic": omega.periodic,
        "bodies": len(omega.bodies),
        "engines": len(omega.engines),
    }
    pairs = [(f"O.{name}", value, scene[name]) for name, value in seen.items()]
    for instance, fields in objects:
        name = type(instance).__name__
        pairs += [(f"{name}.{field}", getattr(instance, field), value) for field, value in fields.items()]
    for field, yades, ours in pairs:
        if not _equal(yades, ours):
            raise YadeError(
                f"the plugin does not match this YADE: {field} is {yades!r} in YADE and {ours!r} in the plugin; rebuild it with "
                "the headers of exactly this version",
                "Layout",
            )


def _equal(one: Any, two: Any) -> bool:
    return bool(one == two) or (one != one and two != two)


def loaded() -> bool:
    """Whether the plugin is loaded."""
    return _library is not None


def library() -> ctypes.PyDLL:
    """The plugin; loads it if necessary."""
    load()
    assert _library is not None
    return _library


#: YADE laws and their replacements.
_LAWS = {"Law2_ScGeom_CpmPhys_Cpm": "Law2_ScGeom_CpmPhys_Rust"}


def use_rust_cpm(check: int = 0) -> Any:
    """Replace YADE's concrete law in O.engines by `Law2_ScGeom_CpmPhys_Rust` with the same settings; returns the functor.

    `check`: every `check` steps YADE's own law computes every contact as well, and the run stops if a bit differs
    (`functor.error`). Raises YadeError if YADE is running or O.engines has no concrete law.
    """
    load()
    import yade.wrapper

    omega = yade.wrapper.Omega()
    if omega.running:
        raise YadeError("YADE is running in the background; call O.pause() or O.wait() first", "Running")
    found = []
    for engine in omega.engines:
        if type(engine).__name__ == "InteractionLoop":
            dispatcher = engine.lawDispatcher
        elif type(engine).__name__ == "LawDispatcher":
            dispatcher = engine
        else:
            continue
        functors = list(dispatcher.functors)
        for k, law in enumerate(functors):
            name = type(law).__name__
            if name in _LAWS:
                settings = law.dict()
                functors[k] = getattr(yade.wrapper, _LAWS[name])(**settings)
            if name in _LAWS or name in _LAWS.values():
                functors[k].checkEvery = int(check)
                found.append(functors[k])
        dispatcher.functors = functors
    if not found:
        raise YadeError("O.engines has no Law2_ScGeom_CpmPhys_Cpm to replace; add an InteractionLoop with it", "NotConcrete")
    # Contacts cache their functor.
    library().concordem_yade_forget_laws()
    return found[0]
