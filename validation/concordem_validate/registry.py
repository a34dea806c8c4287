"""All engines by name: ours, those of installed packages, and those of the user's `validate.toml`.

An engine is any object with

- `NAME`;
- `version()`: text that changes whenever the program does; raises NotInstalled with the remedy;
- `run(task, folder, limit) -> Result`: runs in the empty `folder` for at most `limit` seconds; raises Unsupported for a scenario that it
  does not know, never drops a part of it;

and, if it likes, `also(task)`: text of further inputs of a run, and `NEEDS_START = False` if it does not use `task.start`.

A package announces engines by the entry point `concordem_validate.engines`, whose value is such an object.
"""
from importlib import metadata

from .engines import analytic, concordem, esys, lammps, liggghts, table, yade
from .errors import HarnessError

GROUP = "concordem_validate.engines"
ENGINES = {engine.NAME: engine for engine in (concordem, yade, liggghts.ONE, liggghts.TWO, lammps, esys, analytic, table)}
OURS = frozenset(ENGINES)


def add(name, engine, source):
    """Register an engine; a name that is taken is refused, because a verdict must say which code it is about."""
    if name in ENGINES and ENGINES[name] is not engine:
        raise HarnessError(f"{source}: the engine `{name}` exists already; choose another name")
    lacks = [word for word in ("version", "run") if not callable(getattr(engine, word, None))]
    if lacks:
        raise HarnessError(f"{source}: the engine `{name}` has no function {' and '.join(lacks)}; add it")
    ENGINES[name] = engine


def know(name):
    """Whether there is such an engine. `ENGINE@KIND`, a self-check of an engine, comes into being when it is first named."""
    base, _, kind = name.partition("@")
    if kind and base in ENGINES and name not in ENGINES:
        from .selfcheck import SelfCheck
        ENGINES[name] = SelfCheck(name, ENGINES[base], kind)
    return name in ENGINES


def load_packages():
    """Register the engines of installed packages."""
    for point in metadata.entry_points(group=GROUP):
        try:
            engine = point.load()
        except Exception as error:
            raise HarnessError(f"entry point {point.name} = {point.value}: cannot be loaded: {type(error).__name__}: {error}") from None
        add(point.name, engine, f"entry point {point.value}")


def needs_start(name):
    return getattr(ENGINES[name], "NEEDS_START", True)
