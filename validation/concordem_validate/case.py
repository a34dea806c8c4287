"""Cases: folders with a physical question, a scenario, engines, and checks. Every tolerance has a reason."""
import fnmatch
import importlib.util
import itertools
import math
from dataclasses import dataclass, field, replace
from pathlib import Path

from . import balance, quirks, scenario, tables
from .errors import HarnessError
from .norms import NORMS
from .quantity import si
from .registry import ENGINES, know

# the cases lie in the wheel, or beside the package in the sources
_PLACES = Path(__file__).parent / "cases", Path(__file__).parents[1] / "cases"
ROOT = next((place for place in _PLACES if place.is_dir()), _PLACES[0])
KINDS = {"series", "scalar", "ensemble", "bits", "speed", "balance"}
ITSELF = "itself"  # peer of a balance
TIERS = {"fast", "full"}
COMMANDS = {"run", "elastic", "operators"}
_CASE = {"title": str, "question": str, "source": str, "tier": str, "time_limit_s": float, "engines": list, "reference": str, "scenario": str,
         "variant": list, "check": list}
_VARIANT = {"name": str, "changes": dict, "peer_changes": dict, "scenario": str, "engines": list, "about": str, "command": str}
_CHECK = {"name": str, "kind": str, "peer": (str, list), "variants": list, "of": str, "over": str, "meet": str, "norm": str, "match": str,
          "frame": str, "constant": bool, "may_be_zero": bool, "twin": float, "paired": bool, "to_step": int, "from_step": int, "from": (float, str), "to": (float, str),
          "scale": (float, str), "tolerance": float, "band": list, "repeats": int, "reference": str, "reason": str, "quirk": str, "known": list}
_CHOICES = {"kind": KINDS, "meet": {"common", "interpolate"}, "norm": set(NORMS), "match": {"id", "place"}, "frame": {"fixed", "rigid"}}


@dataclass
class Check:
    """One comparison of the reference with a peer."""

    name: str
    kind: str
    peer: str
    variants: list
    reason: str
    of: str = ""
    tolerance: float = None
    scale: object = "maximum"
    over: str = "time"
    meet: str = "common"
    norm: str = "max"
    match: str = "id"
    frame: str = "fixed"
    constant: bool = False
    may_be_zero: bool = False  # a number that is an error itself
    twin: float = None  # allowed multiple of the difference that one changed bit makes
    paired: bool = True
    from_step: int = 0
    to_step: int = None
    first: float = None
    last: float = None
    band: list = None  # least and most ratio of run times
    repeats: int = None
    quirk: str = None
    known: list = None
    until: object = None
    reference: str = "concordem"
    roles_changed: bool = False

    @property
    def pair(self):
        return self.reference, self.peer

    @property
    def allowed(self):
        """What may be found, in words."""
        if self.band is not None:
            return f"{self.band[0]:.2g} … {self.band[1]:.2g}"
        if self.known is not None:
            return f"{self.known[0]:.1g} … {self.known[1]:.1g} (known)"
        return f"≤ {self.tolerance:.1g}"


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
    place: Path = None  # file of the scenario
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
    reference: str = "concordem"

    def only(self, variants, peers):
        """The same case with only some variants and peers."""
        tasks = [t for t in self.tasks if t.variant in variants]
        engines_of = {v: [e for e in self.engines_of[v] if e in peers] for v in variants}
        few = replace(self, tasks=tasks, engines_of=engines_of)
        few.checks = [c for c in self.checks if c.peer in (*peers, ITSELF) and few.variants_of(c)]
        return few

    def with_reference(self, name):
        """The same case with another reference. The old one becomes a peer, with the tolerance of its check with the new one if there is one."""
        if name == self.reference:
            return self
        # a check with a reference of its own is about that engine
        checks = [replace(c, reference=name, peer=c.reference if c.peer == name else c.peer, roles_changed=c.kind != "balance")
                  if c.reference == self.reference else c for c in self.checks]
        both = {v: list(dict.fromkeys([*engines, self.reference])) for v, engines in self.engines_of.items()}
        engines = list(dict.fromkeys([*self.engines, self.reference]))
        return replace(self, reference=name, engines=engines, engines_of=both, checks=checks)

    def all_pairs(self):
        """The same case with every check between all engines of its name, with the widest of their tolerances."""
        out, groups = [], {}
        for check in self.checks:
            groups.setdefault((check.name, check.of, check.kind, tuple(check.variants), check.reference), []).append(check)
        for members in groups.values():
            # a check with a reference of its own is about that engine
            if members[0].kind in ("balance", "speed") or members[0].reference != self.reference or any("@" in c.peer for c in members):
                out += members
                continue
            widest = max(members, key=lambda c: c.known[1] if c.known else c.tolerance)
            names = list(dict.fromkeys([self.reference, *(c.peer for c in members)]))
            for a, b in itertools.combinations(names, 2):
                own = next((c for c in members if (a, b) == c.pair), None)
                out.append(own or replace(widest, reference=a, peer=b, roles_changed=True))
        both = {v: list(dict.fromkeys([*engines, self.reference])) for v, engines in self.engines_of.items()}
        return replace(self, engines_of=both, checks=out)

    def variants_of(self, check):
        found = [t.variant for t in self.tasks if any(fnmatch.fnmatch(t.variant, p) for p in check.variants)]
        there = lambda v, engine: engine in (self.reference, ITSELF) or engine in self.engines_of[v]
        return [v for v in found if there(v, check.peer) and there(v, check.reference)]


def names(root=ROOT):
    return sorted(path.parent.name for path in Path(root).glob("*/case.toml"))


def find(name, roots):
    """Load a case from the first folder of cases that has it."""
    for root in roots:
        if (Path(root) / name / "case.toml").exists():
            return load(name, root)
    known = sorted({n for root in roots for n in names(root)})
    raise HarnessError(f"unknown case `{name}`; the cases are {', '.join(known) or f'none: {roots[0]} has no folder with a case.toml'}")


def load(name, root=ROOT):
    folder = Path(root) / name
    path = folder / "case.toml"
    if not path.exists():
        return find(name, [root])
    file = tables.File(path)
    data = file.data
    file.check(data, _CASE)
    file.rows("engines", str, data.get("engines", []))
    file.rows("check", dict, data.get("check", []))
    if data.get("time_limit_s", 1) <= 0:
        raise file.error("time_limit_s", f"`time_limit_s` is {data['time_limit_s']}; give seconds above zero")
    for key in ("title", "question", "source", "engines", "check"):
        if not data.get(key):
            raise HarnessError(f"{path}: `{key}` is missing; add it")
    if data.get("tier", "fast") not in TIERS:
        raise file.error("tier", f"`{data['tier']}` is not a tier; use fast or full")
    module = _module(name, folder)
    reference = _engines(file, [data.get("reference", "concordem")])[0]
    engines = _engines(file, data["engines"])
    if reference in engines:
        raise file.error("engines", f"`{reference}` is the reference, so it would be compared with itself; leave it out")
    tasks, engines_of = _variants(file, data, name, folder, module, engines)
    known = quirks.load_all(root)
    checks = [c for k, table in enumerate(data["check"]) for c in _checks(file, k, table, engines, reference, known)]
    case = Case(name, folder, data["title"], data["question"], data["source"], data.get("tier", "fast"),
                float(data.get("time_limit_s", 120)), engines, tasks, engines_of, checks, module, reference)
    for check in checks:
        if not case.variants_of(check):
            raise HarnessError(f"{path}: check `{check.name}` applies to no variant that `{check.peer}` runs; mend `variants`")
    return case


def _module(name, folder):
    """The case's own functions. What it raises is a fault of the case, not of the harness."""
    path = folder / "case.py"
    if not path.exists():
        return None
    spec = importlib.util.spec_from_file_location(f"concordem_case_{name.replace('-', '_')}", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise HarnessError(f"{path} cannot be loaded: {type(error).__name__}: {error}") from None
    return module


def _engines(file, wanted):
    for name in wanted:
        if not know(name):
            raise file.error("engines", f"unknown engine `{name}`; valid engines are {', '.join(ENGINES)}; add yours to validate.toml")
    return list(wanted)


def _variants(file, data, name, folder, module, engines):
    tasks, engines_of = [], {}
    for k, variant in enumerate(data.get("variant", [{"name": "main"}])):
        if not isinstance(variant, dict) or not isinstance(variant.get("name", ""), str) or not variant.get("name"):
            raise file.error("variant", "a variant has no `name`; add it", k)
        file.check(variant, _VARIANT, "variant", k)
        file.file_name("name", variant["name"], k, "variant")
        file.rows("engines", str, variant.get("engines", []), k, "variant")
        if variant["name"] in engines_of:
            raise file.error("name", f"the variant `{variant['name']}` appears twice; rename one", k, "variant")
        place = folder / variant.get("scenario", data.get("scenario", "scenario.toml"))
        document = scenario.load(place)
        try:
            document = scenario.changed(document, variant.get("changes", {}))
        except HarnessError as error:
            raise file.error("changes", f"variant {variant['name']}: {error}", k, "variant") from None
        if hasattr(module, "scenario"):
            # scenarios that are too long for a file, such as random clouds of spheres
            try:
                document = module.scenario(document)
            except Exception as error:
                raise HarnessError(f"{folder / 'case.py'}: scenario() failed for variant {variant['name']}: {type(error).__name__}: {error}") from None
        command = variant.get("command", "run")
        if command not in COMMANDS:
            raise file.error("command", f"`{command}` is not a command; use {', '.join(sorted(COMMANDS))}", k, "variant")
        peers = _engines(file, variant.get("engines", engines))
        if command == "operators" and len(peers) != 1:
            raise HarnessError(f"{file.path}: variant {variant['name']}: command `operators` needs exactly one peer")
        tasks.append(Task(
            name, variant["name"], folder, document, module, place=place, command=command, check_threads=k == 0 and command == "run",
            peer_scenario=scenario.changed(document, variant["peer_changes"]) if "peer_changes" in variant else None,
            peer=peers[0] if command == "operators" else None, about=variant.get("about", "").strip()))
        engines_of[variant["name"]] = peers
    # twins run where a check needs them, though nothing is compared with them alone
    for table in data["check"]:
        if isinstance(table, dict) and "twin" in table:
            for variant, peers in engines_of.items():
                twin = _engines(file, [f"{data.get('reference', 'concordem')}@twin"])
                if any(fnmatch.fnmatch(variant, p) for p in table.get("variants", ["*"])):
                    engines_of[variant] = list(dict.fromkeys([*peers, *twin]))
    return tasks, engines_of


def _checks(file, number, table, engines, reference, known):
    """The checks of a table, one for each peer that it names."""
    table = dict(table)
    error = lambda key, text: file.error(key, f"check `{table.get('name')}`: {text}", number, "check")
    file.check(table, _CHECK, "check", number)
    file.rows("variants", str, table.get("variants", []), number, "check")
    file.rows("peer", str, table["peer"] if isinstance(table.get("peer"), list) else [], number, "check")
    if table.get("kind") == "balance":
        table.setdefault("peer", ITSELF)
        if table.get("of") not in balance.KINDS:
            raise error("of", f"`of` of a balance is {table.get('of')!r}; use {' or '.join(balance.KINDS)}")
    for key in ("name", "kind", "peer"):
        if not table.get(key):
            raise error("name", f"`{key}` is missing; add it")
    for key, allowed in _CHOICES.items():
        if key in table and table[key] not in allowed:
            raise error(key, f"`{key}` is `{table[key]}`; use {', '.join(sorted(allowed))}")
    if not table.get("of") and table["kind"] not in ("bits", "speed"):
        raise error("name", "`of` is missing; name the series or number")
    if not table.get("reason", "").strip():
        raise error("name", "`reason` is missing; give the reason of the tolerance")
    if table["kind"] == "bits":
        if table.setdefault("tolerance", 0.0) or "known" in table or "band" in table:
            raise error("tolerance", "`bits` are the same or not; leave `tolerance` out, or use `series`")
    if ("quirk" in table) != ("known" in table) or ("tolerance" in table) + ("known" in table) + ("band" in table) != 1:
        raise error("tolerance", "give either `tolerance`, or both `quirk` and `known = [least, most]`; of `speed` also `band = [least, most]`")
    if "quirk" in table:
        if table["quirk"] not in known:
            raise error("quirk", f"quirks.toml has no quirk `{table['quirk']}`; add it")
        table["until"] = known[table["quirk"]].get("until")
    _limits(error, table)
    for key, name in (("from", "first"), ("to", "last")):
        if key in table:
            table[name] = _quantity(error, key, table.pop(key))
    reference = table.pop("reference", reference)
    if reference not in engines and reference != file.data.get("reference", "concordem"):
        raise error("reference", f"`{reference}` is not one of the case's engines: {', '.join(engines)}")
    peers = table.pop("peer")
    for peer in [peers] if isinstance(peers, str) else peers:
        if table.get("twin") is not None and not (table["kind"] == "series" and 1 <= table["twin"] < math.inf):
            raise error("twin", "`twin` is for series; give the allowed multiple of the twins' difference, from 1")
        if peer == reference:
            raise error("peer", f"`{peer}` would be compared with itself; give another `peer` or `reference`")
        if peer not in engines and (peer, table["kind"]) != (ITSELF, "balance"):
            raise error("peer", f"`{peer}` is not one of the case's engines: {', '.join(engines)}")
        yield Check(**{"variants": ["*"], **table, "peer": peer, "reference": reference})


def _quantity(error, key, value):
    try:
        size = si(value)
    except HarnessError as wrong:
        raise error(key, f"`{key}`: {wrong}") from None
    if not math.isfinite(size):
        raise error(key, f"`{key}` is {value}; give a finite number")
    return size


def _limits(error, table):
    """Tolerances that are numbers, and that something can exceed."""
    if "tolerance" in table and not table["tolerance"] >= 0:
        raise error("tolerance", f"`tolerance` is {table['tolerance']}; give a number from 0")
    if "known" in table:
        range_ = table["known"]
        if len(range_) != 2 or not all(isinstance(v, (int, float)) for v in range_) or not 0 <= range_[0] <= range_[1]:
            raise error("known", f"`known` is {range_}; give [least, most]")
        if range_[0] == 0:
            raise error("known", f"`known` is {range_}: a difference that may be zero is not known; give a least one, or `tolerance`")
    if "scale" in table and table["scale"] not in ("maximum", "displacement", "sum") and not _quantity(error, "scale", table["scale"]) > 0:
        raise error("scale", f"`scale` is {table['scale']}; give a size above zero")
    for key in ("band", "repeats"):
        if key in table and table["kind"] != "speed":
            raise error(key, f"`{key}` is for `kind = \"speed\"`")
    if table["kind"] == "speed":
        range_ = table.get("band") or table.get("known") or [0, table.get("tolerance")]
        if len(range_) != 2 or not all(isinstance(v, (int, float)) for v in range_) or not 0 <= range_[0] < range_[1] or range_[1] == math.inf:
            raise error("band", f"the ratio may be {range_}; give `band = [least, most]` of the run time of the reference over that of the peer")
        if table.get("repeats", 1) < 1:
            raise error("repeats", f"`repeats` is {table['repeats']}; give a number from 1")
        return
    relative = table.get("scale", "maximum") in ("maximum", "displacement", "sum")
    most = table["known"][1] if "known" in table else table["tolerance"]
    if relative and most >= 1 and table["kind"] != "bits":
        raise error("tolerance" if "tolerance" in table else "known", f"a relative tolerance of {most:g} lets zero pass; give less than 1")
