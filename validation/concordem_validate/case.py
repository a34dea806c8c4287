"""Cases: folders with a physical question, a scenario, engines, and checks. Every tolerance has a reason."""
import fnmatch
import importlib.util
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path

from . import quirks, scenario
from .engines import ENGINES
from .errors import HarnessError

ROOT = Path(__file__).parents[1] / "cases"
KINDS = {"series", "scalar", "ensemble"}
TIERS = {"fast", "full"}
_CASE = {"title", "question", "source", "tier", "time_limit_s", "engines", "scenario", "variant", "check"}
_VARIANT = {"name", "changes", "peer_changes", "scenario", "engines", "about", "command"}
_CHECK = {"name", "kind", "peer", "variants", "of", "to_step", "from_step", "scale", "tolerance", "reason", "quirk", "known"}


@dataclass
class Check:
    """One comparison of ConcorDEM with a peer."""

    name: str
    kind: str
    peer: str
    of: str
    variants: list
    reason: str
    tolerance: float = None
    scale: object = "maximum"
    from_step: int = 0
    to_step: int = None
    quirk: str = None
    known: list = None


@dataclass
class Task:
    """One variant of a case, as passed to an engine."""

    case: str
    variant: str
    folder: Path
    scenario: dict
    module: object
    start: object = None
    peer_scenario: dict = None  # scenario of the peers, where ConcorDEM has a limit
    peer: str = None  # for the command `operators`: the peer whose state our operators are applied to
    frozen: object = None  # state of that peer
    command: str = "run"
    about: str = ""
    check_threads: bool = False
    plant: dict = field(default_factory=dict)


@dataclass
class Case:
    name: str
    folder: Path
    title: str
    question: str
    source: str
    tier: str
    time_limit: float
    engines: list
    tasks: list
    engines_of: dict
    checks: list
    module: object

    def only(self, variants, peers):
        """The same case with only some variants and peers."""
        tasks = [t for t in self.tasks if t.variant in variants]
        engines_of = {v: [e for e in self.engines_of[v] if e in peers] for v in variants}
        few = replace(self, tasks=tasks, engines_of=engines_of)
        few.checks = [c for c in self.checks if c.peer in peers and few.variants_of(c)]
        return few

    def variants_of(self, check):
        found = [t.variant for t in self.tasks if any(fnmatch.fnmatch(t.variant, p) for p in check.variants)]
        return [v for v in found if check.peer in self.engines_of[v]]


def names(root=ROOT):
    return sorted(path.parent.name for path in root.glob("*/case.toml"))


def _refuse(place, table, allowed):
    unknown = set(table) - allowed
    if unknown:
        raise HarnessError(f"{place}: unknown key {', '.join(sorted(unknown))}; valid keys are {', '.join(sorted(allowed))}")


def _engines(place, wanted):
    for name in wanted:
        if name not in ENGINES:
            raise HarnessError(f"{place}: unknown engine `{name}`; valid engines are {', '.join(ENGINES)}")
    return list(wanted)


def load(name, root=ROOT):
    folder = root / name
    path = folder / "case.toml"
    if not path.exists():
        raise HarnessError(f"unknown case `{name}`; the cases are {', '.join(names(root))}")
    with open(path, "rb") as file:
        data = tomllib.load(file)
    _refuse(path, data, _CASE)
    for key in ("title", "question", "source", "engines", "check"):
        if not data.get(key):
            raise HarnessError(f"{path}: `{key}` is missing; add it")
    if data.get("tier", "fast") not in TIERS:
        raise HarnessError(f"{path}: `tier` must be fast or full")
    module = None
    if (folder / "case.py").exists():
        spec = importlib.util.spec_from_file_location(f"concordem_case_{name.replace('-', '_')}", folder / "case.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    engines = _engines(path, data["engines"])
    tasks, engines_of = [], {}
    for k, variant in enumerate(data.get("variant", [{"name": "main"}])):
        _refuse(f"{path}: variant {variant.get('name')}", variant, _VARIANT)
        document = scenario.load(folder / variant.get("scenario", data.get("scenario", "scenario.toml")))
        document = scenario.changed(document, variant.get("changes", {}))
        if hasattr(module, "scenario"):
            # scenarios that are too long for a file, such as random clouds of spheres
            document = module.scenario(document)
        command = variant.get("command", "run")
        if command not in ("run", "elastic", "operators"):
            raise HarnessError(f"{path}: `command` must be run, elastic, or operators")
        peers = _engines(path, variant.get("engines", engines))
        if command == "operators" and len(peers) != 1:
            raise HarnessError(f"{path}: variant {variant['name']}: command `operators` needs exactly one peer")
        tasks.append(Task(
            name, variant["name"], folder, document, module, command=command, check_threads=k == 0 and command == "run",
            peer_scenario=scenario.changed(document, variant["peer_changes"]) if "peer_changes" in variant else None,
            peer=peers[0] if command == "operators" else None, about=variant.get("about", "").strip()))
        engines_of[variant["name"]] = peers
    checks, known = [], quirks.load()
    for check in data["check"]:
        place = f"{path}: check `{check.get('name')}`"
        _refuse(place, check, _CHECK)
        if check.get("kind") not in KINDS or check.get("peer") not in engines:
            raise HarnessError(f"{place}: needs `kind` ({', '.join(sorted(KINDS))}) and `peer`, one of the case's engines")
        if not check.get("reason", "").strip():
            raise HarnessError(f"{place}: `reason` is missing; give the reason of the tolerance")
        if ("quirk" in check) != ("known" in check) or ("tolerance" in check) == ("known" in check):
            raise HarnessError(f"{place}: give either `tolerance`, or both `quirk` and `known = [least, most]`")
        if "quirk" in check and check["quirk"] not in known:
            raise HarnessError(f"{place}: quirks.toml has no quirk `{check['quirk']}`; add it")
        checks.append(Check(**{"variants": ["*"], **check}))
    case = Case(name, folder, data["title"], data["question"], data["source"], data.get("tier", "fast"),
                float(data.get("time_limit_s", 120)), engines, tasks, engines_of, checks, module)
    for check in checks:
        if not case.variants_of(check):
            raise HarnessError(f"{path}: check `{check.name}` applies to no variant that `{check.peer}` runs")
    return case
