"""The user's `validate.toml`: folders of cases, engines, and what a round requires. Paths in it are relative to it."""
from dataclasses import dataclass, field
from pathlib import Path

from . import case as cases
from . import registry, tables
from .engines.command import CommandEngine
from .errors import HarnessError

NAME = "validate.toml"
_TOP = {"cases": list, "reference": str, "output": str, "require": list, "engine": dict}
_ENGINE = {"command": (str, list), "version": (str, list), "restart": (str, list), "inputs": list, "output": str, "environment": dict, "needs_start": bool}


@dataclass
class Project:
    """What a round works with; the defaults are those of our own sources."""

    roots: list = field(default_factory=lambda: [cases.ROOT])
    output: Path = None
    reference: str = None
    require: list = field(default_factory=list)
    path: Path = None


def load(path=None, folders=()):
    """The project in `path`, or in `validate.toml` here if there is one; `folders` of cases on the command line come first."""
    registry.load_packages()
    here = Path(NAME)
    if path is None and here.exists():
        path = here
    project = _read(Path(path)) if path else Project()
    for folder in folders:
        if not Path(folder).is_dir():
            raise HarnessError(f"{folder} is no folder of cases; mend --cases")
    if folders:
        project.roots = [Path(f).resolve() for f in folders]
    if project.output is None:
        project.output = _default_output()
    return project


def _default_output():
    """In our sources below `target`, elsewhere here."""
    top = Path(__file__).parents[2]
    return top / "target" / "validate" if (top / "rust-core").is_dir() else Path("concordem-validate")


def _read(path):
    file = tables.File(path)
    home = path.resolve().parent
    file.check(file.data, _TOP)
    for name, table in file.data.get("engine", {}).items():
        if not isinstance(table, dict):
            raise HarnessError(f"{path}: `engine.{name}` is no table; write [engine.{name}]")
        header = f"engine.{name}"
        file.file_name("", name, name=header)
        if "@" in name:
            raise file.error("", f"the name `{name}` has an @, which marks self-checks; choose another name", table=header)
        file.check(table, _ENGINE, header)
        if "command" not in table:
            raise file.error("", f"engine `{name}` has no `command`; add it", table=header)
        if table.get("output", "csv") not in ("csv", "hdf5"):
            raise file.error("output", f"`output` is `{table['output']}`; use csv or hdf5", table=header)
        try:
            engine = CommandEngine(name, home, **table)
        except HarnessError as error:
            raise file.error("command", str(error), table=header) from None
        registry.ENGINES.pop(name, None) if name not in registry.OURS else None
        registry.add(name, engine, f"{path}:{file.line('', table=header)}")
    roots = []
    for key in ("cases", "require"):
        file.rows(key, str, file.data.get(key, []))
    for folder in file.data.get("cases", ["cases"]):
        root = cases.ROOT if folder == "package" else home / folder
        if not root.is_dir():
            raise file.error("cases", f"there is no folder {root}; add it, or mend `cases`")
        roots.append(root)
    for name in [*file.data.get("require", []), *([file.data["reference"]] if "reference" in file.data else [])]:
        if not registry.know(name):
            raise file.error("require", f"unknown engine `{name}`; valid engines are {', '.join(registry.ENGINES)}")
    output = home / file.data.get("output", "concordem-validate")
    return Project(roots, output, file.data.get("reference"), file.data.get("require", []), path)
